"""Tables of spreadsheets and measuring programs, written by the libraries made for them."""

from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest
from nptdms import ChannelObject, TdmsWriter
from scipy.io import savemat

from stickslip_ros import StickSlipError
from stickslip_ros.tables.experiment import OVER_TIME, Reading, read_experiment

TIME_S = np.arange(50) * 1.7e-5
FORCE_MN = 11.3 * np.sin(2e4 * TIME_S) + 0.123456789


def write_excel(path: Path) -> None:
    cells = [
        ['Prüfstand 3', None],
        ['time (s)', 'Kraft (mN)'],
        *zip(TIME_S, FORCE_MN, strict=True),
    ]
    pd.DataFrame(cells).to_excel(path, header=False, index=False)


def write_parquet(path: Path) -> None:
    pd.DataFrame({'time (s)': TIME_S, 'Kraft (mN)': FORCE_MN}).to_parquet(path)


def write_hdf5(path: Path) -> None:
    with h5py.File(path, 'w') as file:
        for name, unit, values in (('time', 's', TIME_S), ('Kraft', 'mN', FORCE_MN)):
            file.create_dataset(f'run 7/{name}', data=values).attrs['units'] = unit
        file['run 7/serial number'] = 4711


def write_matlab(path: Path) -> None:
    savemat(path, {'time_s': TIME_S[:, np.newaxis], 'force_mN': FORCE_MN, 'fs': 58823.5})


def write_tdms(path: Path) -> None:
    told = {'wf_increment': 1.7e-5, 'wf_start_offset': 0.0, 'unit_string': 'mN'}
    with TdmsWriter(path) as writer:
        writer.write_segment([ChannelObject('rig', 'Kraft', FORCE_MN, properties=told)])


WRITERS = {
    '.xlsx': write_excel,
    '.parquet': write_parquet,
    '.h5': write_hdf5,
    '.hdf5': write_hdf5,
    '.mat': write_matlab,
    '.tdms': write_tdms,
}


@pytest.mark.parametrize('suffix', WRITERS)
def test_a_table_is_understood_as_if_it_were_text(tmp_path: Path, suffix: str):
    path = tmp_path / f'run{suffix}'
    WRITERS[suffix](path)
    experiment = read_experiment(path)
    assert experiment.kind == OVER_TIME
    np.testing.assert_allclose(experiment.columns['time_s'], TIME_S, rtol=1e-14, atol=1e-20)
    np.testing.assert_allclose(experiment.columns['force_n'], 1e-3 * FORCE_MN, rtol=1e-14)


@pytest.mark.parametrize('suffix', WRITERS)
@pytest.mark.parametrize(
    'damage', [lambda data: b'', lambda data: data[: len(data) // 2], lambda data: b'1,2\n3,4\n']
)
def test_a_damaged_file_is_refused(tmp_path: Path, suffix: str, damage: Callable[[bytes], bytes]):
    path = tmp_path / f'run{suffix}'
    WRITERS[suffix](path)
    path.write_bytes(damage(path.read_bytes()))
    with pytest.raises(StickSlipError, match=r'run\.'):
        read_experiment(path)


def test_vectors_of_several_lengths_are_told(tmp_path: Path):
    path = tmp_path / 'run.mat'
    savemat(path, {'time_s': TIME_S, 'force_mN': FORCE_MN[1:]})
    with pytest.raises(StickSlipError, match='time_s has 50, force_mN has 49'):
        read_experiment(path)


def test_a_header_can_be_named(tmp_path: Path):
    path = tmp_path / 'run.h5'
    with h5py.File(path, 'w') as file:
        file['t'], file['ch1'] = TIME_S, FORCE_MN
    reading = Reading({'time_s': 't (s)', 'force_n': 'ch1 (mN)'})
    found = read_experiment(path, reading).columns['force_n']
    np.testing.assert_allclose(found, 1e-3 * FORCE_MN, rtol=1e-14)
