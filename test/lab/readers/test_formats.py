# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Tables of spreadsheets and measuring programs, written by the libraries made for them."""

import struct
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from memory import memory_limited_to
from nptdms import ChannelObject, TdmsWriter
from scipy.io import savemat

from stickslip_ros import StickSlipError, budget
from stickslip_ros.lab.measurements.table_options import TableOptions
from stickslip_ros.lab.measurements.tables import read_experiment
from stickslip_ros.lab.measurements.vocabulary import OVER_TIME
from stickslip_ros.lab.readers import formats

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


def write_numpy(path: Path) -> None:
    others = {'fs': 58823.5, 'picture': np.eye(4), 'note': 'rig'}
    np.savez_compressed(path, **{'time_s': TIME_S, 'force_mN': FORCE_MN, **others})


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
    '.npz': write_numpy,
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


@pytest.mark.parametrize('is_packed', [False, True])
@pytest.mark.parametrize(
    'kind', ['f8', 'f4', 'i1', 'u1', 'i2', 'u2', 'i4', 'u4', 'i8', 'u8', 'bool', '>f8']
)
def test_vectors_of_each_kind_of_matlab_are_read(tmp_path, is_packed, kind):
    path, times = tmp_path / 'run.mat', np.arange(3)
    values = np.array([1, 0, 1], kind)
    others = {'name': 'rig', 'z': np.ones(5) * 1j, 'm': np.eye(3), 'fs': 50.0}
    others |= {'settings': {'a': np.arange(7)}, 'cells': np.array([1, 'b'], object)}
    others['a_name_that_is_longer'] = 0.0
    savemat(path, {**others, 't': times, 'position': values}, do_compression=is_packed)
    reading = TableOptions({'time_s': 't (s)', 'position_m': 'position (m)'})
    columns = read_experiment(path, reading).columns
    assert columns['time_s'].tolist() == [0.0, 1.0, 2.0]
    assert columns['position_m'].tolist() == [1.0, 0.0, 1.0]


def matlab_element(kind: int, data: bytes) -> bytes:
    return struct.pack('>II', kind, len(data)) + data + bytes(-len(data) % 8)


def matlab_matrix(name: str, values: list[float], stored: int = 9) -> bytes:
    """Give a row as a machine with the other byte order writes it."""
    flags, shape = struct.pack('>II', 6, 0), struct.pack('>ii', 1, len(values))
    numbers = struct.pack(f'>{len(values)}d', *values)
    parts = ((6, flags), (5, shape), (1, name.encode()), (stored, numbers))
    return matlab_element(14, b''.join(matlab_element(*part) for part in parts))


@pytest.mark.parametrize('stored', [9, 8, 14, 127, 1 << 15])
def test_types_that_matlab_does_not_have_crash_nothing(tmp_path: Path, stored: int):
    path = tmp_path / 'run.mat'
    content = b'MATLAB 5.0 MAT-file'.ljust(124) + b'\1\0MI' + matlab_matrix('time_s', [0.0, 1.0])
    path.write_bytes(content + matlab_matrix('position_m', [0.25, 0.5], stored))
    if stored == 9:
        assert read_experiment(path).columns['position_m'].tolist() == [0.25, 0.5]
        return
    with pytest.raises(StickSlipError, match=r'cannot be read as \.mat'):
        read_experiment(path)


def test_vectors_of_several_lengths_are_told(tmp_path: Path):
    path = tmp_path / 'run.mat'
    savemat(path, {'time_s': TIME_S, 'force_mN': FORCE_MN[1:]})
    with pytest.raises(StickSlipError, match='lengths: time_s of 50; force_mN of 49; name'):
        read_experiment(path)


@pytest.mark.parametrize('write', [savemat, lambda path, named: np.savez(path, **named)])
def test_of_vectors_of_several_lengths_the_user_names_which(tmp_path, write):
    path = tmp_path / f'run{".mat" if write is savemat else ".npz"}'
    other = {'t2': TIME_S[3:], 'u': FORCE_MN[3:]}
    write(path, {'t1': TIME_S, 'f': FORCE_MN, **other, 'k': np.arange(7.0)})
    reading = TableOptions({'time_s': 't2 (s)', 'force_n': 'u (mN)'})
    columns = read_experiment(path, reading).columns
    np.testing.assert_array_equal(columns['time_s'], TIME_S[3:])
    with pytest.raises(StickSlipError, match=r'vectors of 50: line 1'):
        read_experiment(path, TableOptions({'time_s': 't1 (s)', 'force_n': 'u (mN)'}))


def test_pickled_objects_in_an_archive_of_numpy_are_not_opened(tmp_path: Path):
    np.savez(tmp_path / 'run.npz', time_s=TIME_S, note=np.array(['rig', 'b'], object))
    with pytest.raises(StickSlipError, match='Object arrays cannot be loaded'):
        read_experiment(tmp_path / 'run.npz')


def test_two_vectors_of_one_name_are_refused(tmp_path: Path):
    """The second would stand in for the first."""
    with h5py.File(tmp_path / 'run.h5', 'w') as file:
        file['a/force_mN'] = file['b/force_mN'] = FORCE_MN
        file['time_s'] = TIME_S
    with pytest.raises(StickSlipError, match=r'#2 .a/force_mN., #3 .b/force_mN.; fill in'):
        read_experiment(tmp_path / 'run.h5')
    columns = read_experiment(tmp_path / 'run.h5', TableOptions({'force_n': 'b/force_mN'})).columns
    np.testing.assert_allclose(columns['force_n'], 1e-3 * FORCE_MN, rtol=1e-14)


def write_sheets(path: Path, *sheets: list[tuple]) -> Path:
    with pd.ExcelWriter(path) as book:
        for number, cells in enumerate(sheets, 1):
            pd.DataFrame(cells).to_excel(book, sheet_name=f'S{number}', header=False, index=False)
    return path


NOTES = [('operator', 'somebody'), ('temperature', 22.5)]
SWEEP = [('preload (N)', 'stroke (nm)', 'force (mN)'), (0.1, 60.0, 18.0), (0.1, 90.0, 27.0)]
UNKNOWN = [('a', 'b'), (1.0, 2.0), (3.0, 4.0)]


def test_of_a_workbook_the_first_sheet_counts_that_is_a_table(tmp_path: Path):
    path = write_sheets(tmp_path / 'run.xlsx', NOTES, UNKNOWN, SWEEP, SWEEP[:2])
    experiment = read_experiment(path)
    assert experiment.columns['force_n'].tolist() == [18e-3, 27e-3]
    assert experiment.origin == f'{path}, sheet S3'
    said = TableOptions({'time_s': 'a (s)', 'force_n': 'b (mN)'})
    assert read_experiment(path, said).origin == f'{path}, sheet S2'


def test_of_a_workbook_without_a_table_the_first_sheet_with_numbers_is_refused(tmp_path: Path):
    path = write_sheets(tmp_path / 'run.xlsx', NOTES[:1], UNKNOWN)
    with pytest.raises(StickSlipError, match='sheet S2: line 1: has neither a time nor an amp'):
        read_experiment(path)
    path = write_sheets(tmp_path / 'other.xlsx', NOTES[:1], NOTES[:1])
    with pytest.raises(StickSlipError, match='sheet S1: line 1: has no rows of numbers'):
        read_experiment(path)


def test_errors_of_a_formula_are_cells_without_a_number(tmp_path: Path):
    path = write_sheets(tmp_path / 'run.xlsx', [*SWEEP, (0.1, 120.0, '#DIV/0!')])
    assert read_experiment(path).columns['force_n'].tolist() == [18e-3, 27e-3]


def test_a_time_that_is_the_index_of_a_frame_comes_back_out_of_parquet(tmp_path: Path):
    path = tmp_path / 'frame.parquet'
    index = pd.Index(TIME_S, name='time_s')
    pd.DataFrame({'force_n': FORCE_MN, 'note': '1 %'}, index).to_parquet(path)
    read = read_experiment(path).columns
    np.testing.assert_array_equal(read['time_s'], TIME_S)
    np.testing.assert_array_equal(read['force_n'], FORCE_MN)


def test_units_that_are_no_utf_8_are_refused_and_can_be_named(tmp_path: Path):
    path = tmp_path / 'run.h5'
    text = h5py.string_dtype('utf-8', None)
    with h5py.File(path, 'w') as file:
        for name, unit, values in (('time', b's', TIME_S), ('force', b'\xb5N', FORCE_MN)):
            file[name] = values
            file[name].attrs.create('units', unit, dtype=text)
    with pytest.raises(StickSlipError, match=r"#1 'force \(\?N\)', #2 'time \(s\)'; fill in"):
        read_experiment(path)
    assert 'force_n' in read_experiment(path, TableOptions({'force_n': 'force (µN)'})).columns


ROOM_BYTES = 100 << 20
MANY = 1 << 29  # numbers, of which there is no room for an eighth
LIMITS = {'NUMBERS_MOST': 500_000, 'TABLE_BYTES': 4_000_000, 'TAGS': 250_000}
"""A hundredth of those of the package, which would take a minute."""


def hdf5_of_zeros(path: Path) -> None:
    with h5py.File(path, 'w') as file:
        for name in ('time_s', 'force_n'):
            file.create_dataset(name, (MANY,), 'f8', chunks=(1 << 20,), compression='gzip')


def hdf5_with_a_large_chunk(path: Path) -> None:
    with h5py.File(path, 'w') as file:
        for name in ('time_s', 'force_n'):
            data = file.create_dataset(name, (2,), 'f8', maxshape=(None,), chunks=(MANY // 8,))
            data.id.write_direct_chunk((0,), b'\0')


def hdf5_of_another_file(path: Path) -> None:
    secret = path.with_name('secret.txt')
    secret.write_bytes(b'TOPSECRET' * 16)
    with h5py.File(path, 'w') as file:
        file['force_n'] = TIME_S[:18]
        file.create_dataset('time_s', (18,), 'f8', external=[(str(secret), 0, 144)])


def hdf5_of_another_dataset(path: Path) -> None:
    other = path.with_name('other.h5')
    with h5py.File(other, 'w') as file:
        file['secret'] = TIME_S
    layout = h5py.VirtualLayout(TIME_S.shape, 'f8')
    layout[:] = h5py.VirtualSource(other, 'secret', TIME_S.shape)
    with h5py.File(path, 'w') as file:
        file['force_n'] = TIME_S
        file.create_virtual_dataset('time_s', layout)


def matlab_that_lies(path: Path) -> None:
    """Pack a quarter of a gigabyte behind a variable of ten numbers."""
    savemat(path, {'time_s': np.zeros(10)})
    content = path.read_bytes()
    inner = content[128:].replace(struct.pack('<II', 9, 80), struct.pack('<II', 9, 1 << 31))
    packed = zlib.compress(inner + bytes(1 << 28), 1)
    path.write_bytes(content[:128] + struct.pack('<II', 15, len(packed)) + packed)


SPREADSHEET = 'http://schemas.openxmlformats.org/spreadsheetml/2006/main'
STRINGS = 'xl/sharedStrings.xml'
STRINGS_TYPE = 'application/vnd.openxmlformats-officedocument.spreadsheetml.sharedStrings+xml'
DECLARED = f'<Override PartName="/{STRINGS}" ContentType="{STRINGS_TYPE}"/></Types>'


def workbook(path: Path, sheet: str, text: str = '') -> None:
    """Replace the sheet of a workbook that another program has written; cells share a text."""
    write_sheets(path, SWEEP)
    with zipfile.ZipFile(path) as archive:
        parts = {name: archive.read(name).decode() for name in archive.namelist()}
    types = '[Content_Types].xml'
    parts[types] = parts[types].replace('</Types>', DECLARED)
    parts[STRINGS] = f'<sst xmlns="{SPREADSHEET}"><si><t>{text}</t></si></sst>'
    with zipfile.ZipFile(path, 'w', zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for name, content in parts.items():
            archive.writestr(name, sheet if name.endswith('sheet1.xml') else content)


SHEET = (
    f'<worksheet xmlns="{SPREADSHEET}">'
    '<dimension ref="A1:XFD1048576"/><sheetData>{}</sheetData></worksheet>'
)


def sheet(rows: str, text: str = '') -> Callable[[Path], None]:
    return lambda path: workbook(path, SHEET.format(rows), text)


def packed(columns: dict[str, Any]) -> Callable[[Path], None]:
    return lambda path: savemat(path, columns, do_compression=True)


def parquet(columns: dict[str, Any]) -> Callable[[Path], None]:
    return lambda path: pq.write_table(pa.table(columns), path)


MANY_NUMBERS = 'numbers of a table, above the limit of 500000; leave some out'
MANY_TAGS = 'tags in a workbook, above the limit of 250000'
MANY_BYTES = 'unpacked bytes of a table or another file, above the limit of 4000000'
WIDE = ''.join(f'<row r="{row}"><c r="ZZZ{row}"><v>1</v></c></row>' for row in range(1, 50))
FAR = '<row r="9000000000"><c r="A9000000000"><v>1</v></c></row>'
CELLS = '<row>' + '<c t="s"><v>0</v></c>' * 10_000 + '</row>'  # which share a text
ZEROS = {name: np.zeros(300_000) for name in ('time_s', 'force_n')}
BYTES = {name: each.astype(np.int8) for name, each in ZEROS.items()}  # floats take eight times it
ONE_TEXT = {'time_s': TIME_S, 'note': ['x' * 500_000] * 50}
ONE_LIST = {'time_s': [0.0], 'more': [np.zeros(1 << 20)]}
LONG = dict.fromkeys(ZEROS, np.zeros(1 << 19))


def archive_of_zeros(path: Path) -> None:
    np.savez_compressed(path, time_s=ZEROS['time_s'], force_n=ZEROS['force_n'])


HOSTILE: dict[str, tuple[str, Callable[[Path], Any], str]] = {
    'HDF5 of zeros': ('.h5', hdf5_of_zeros, MANY_NUMBERS),
    'HDF5 with a large chunk': ('.h5', hdf5_with_a_large_chunk, MANY_NUMBERS),
    'HDF5 of another file': ('.h5', hdf5_of_another_file, 'time_s stands in another file'),
    'HDF5 of another dataset': ('.h5', hdf5_of_another_dataset, 'time_s stands in another file'),
    'mat of zeros': ('.mat', packed(ZEROS), MANY_BYTES),
    'mat that lies': ('.mat', matlab_that_lies, MANY_BYTES),
    'mat of bytes': ('.mat', packed(BYTES), MANY_NUMBERS),
    'far cell': ('.xlsx', sheet(FAR), MANY_NUMBERS),
    'wide rows': ('.xlsx', sheet(WIDE), MANY_NUMBERS),
    'tags': ('.xlsx', sheet('<x/>' * 300_000), MANY_TAGS),
    'text': ('.xlsx', sheet(' ' * 4_500_000), MANY_BYTES),
    'one text of many cells': ('.xlsx', sheet(CELLS, 'x' * 5000), MANY_BYTES),
    'npz of zeros': ('.npz', archive_of_zeros, MANY_BYTES),
    'Parquet of zeros': ('.parquet', parquet(LONG), MANY_NUMBERS),
    'Parquet of a list': ('.parquet', parquet(ONE_LIST), MANY_NUMBERS),
    'Parquet of one text': ('.parquet', parquet(ONE_TEXT), 'add a column position_m'),
}


@pytest.mark.parametrize('name', HOSTILE)
def test_what_a_file_says_of_its_size_is_looked_at_before_it_is_read(tmp_path, name, monkeypatch):
    suffix, write, told = HOSTILE[name]
    for row, limit in LIMITS.items():
        monkeypatch.setattr(formats, row, getattr(budget, row)._replace(most=limit))
    path = tmp_path / f'run{suffix}'
    write(path)
    with memory_limited_to(ROOM_BYTES), pytest.raises(StickSlipError, match=told):
        read_experiment(path)


def hdf5_of_few_bytes(path: Path, columns: dict[str, np.ndarray]) -> None:
    with h5py.File(path, 'w') as file:
        for name, values in columns.items():
            file.create_dataset(name, data=values, compression='gzip')


SMALL: dict[str, Callable[[Path, Any], None]] = {
    '.npz': lambda path, columns: np.savez_compressed(path, **columns),
    '.h5': hdf5_of_few_bytes,
    '.mat': lambda path, columns: packed(columns)(path),
    '.parquet': lambda path, columns: parquet(columns)(path),
}


@pytest.mark.parametrize('suffix', SMALL)
def test_a_small_file_does_not_unpack_to_millions_of_numbers(tmp_path: Path, suffix: str):
    zeros = np.zeros(2_000_000)
    SMALL[suffix](tmp_path / f'run{suffix}', {'time_s': zeros, 'force_n': zeros})
    with pytest.raises(StickSlipError, match=r'numbers of a table, above the limit of 2\d{6};'):
        read_experiment(tmp_path / f'run{suffix}')


@pytest.mark.parametrize('as_in_pandas_3', [False, True])
def test_the_names_of_a_frame_are_read_with_any_type_of_text(as_in_pandas_3: bool):
    with pd.option_context('future.infer_string', as_in_pandas_3):
        frame = pd.DataFrame({'time_s': TIME_S, 'force_n': 1e-3 * FORCE_MN})
        assert (frame.columns.dtype == object) is not as_in_pandas_3
        read = read_experiment(frame).columns
    np.testing.assert_array_equal(read['force_n'], frame['force_n'])
