"""A measured voltage or stroke, from whatever file it comes, becomes the same waveform."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from stickslip_ros.errors import StickSlipError
from stickslip_ros.parameters import Parameters
from stickslip_ros.recording.cdr import pack_float64
from stickslip_ros.recording.channels import Channel, Qos
from stickslip_ros.recording.recorder import Recorder
from stickslip_ros.study.drive_input import DriveInput, is_run, read_drive_input
from stickslip_ros.study.replay import replay_input

STAND = Parameters()
TIME_S = np.array([2.0, 2.01, 2.03])
VOLTAGE_V = np.array([10.0, 60.0, 20.0])
STROKE_M = (VOLTAGE_V - STAND.amplifier.voltage_min) * STAND.actuator.gain
ROUNDING = 1e-12
"""Strokes go through one product and one quotient."""


def csv_of(path: Path, name: str, values: object) -> Path:
    rows = ''.join(f'{t!r},{v!r}\n' for t, v in zip(TIME_S.tolist(), values, strict=True))
    path.write_text(f'time_s,{name}\n{rows}', encoding='utf-8')
    return path


def parquet_of(path: Path, **columns: object) -> Path:
    pq.write_table(pa.table(columns), path)
    return path


def mcap_of(path: Path, values: object) -> Path:
    with Recorder(path, [Channel('/lab/signal', 'std_msgs/msg/Float64', Qos(1))]) as recorder:
        for time_s, value in zip(TIME_S.tolist(), values, strict=True):
            recorder.put('/lab/signal', round(time_s * 1e9), pack_float64(value))
    return path


def assert_is_the_wave(given: DriveInput) -> None:
    np.testing.assert_allclose(given.time_s, TIME_S - TIME_S[0], atol=1e-9)
    np.testing.assert_allclose(given.voltage_v, VOLTAGE_V, rtol=ROUNDING)


@pytest.mark.parametrize(
    ('name', 'values'), [('voltage_v', VOLTAGE_V), ('foot_m', STROKE_M)], ids=['voltage', 'stroke']
)
def test_tables_and_topics_give_the_same_voltages(name: str, values: np.ndarray, tmp_path: Path):
    csv = csv_of(tmp_path / 'a.csv', name, values.tolist())
    table = parquet_of(tmp_path / 'a.parquet', time_s=TIME_S, **{name: values}, other=['x'] * 3)
    mcap = mcap_of(tmp_path / 'a.mcap', values.tolist())
    assert_is_the_wave(read_drive_input(csv, STAND))
    assert_is_the_wave(read_drive_input(table, STAND))
    is_stroke = name == 'foot_m'
    assert_is_the_wave(read_drive_input(mcap, STAND, 'signal', is_stroke=is_stroke))
    assert not is_run(mcap)
    assert not is_run(csv)


@pytest.mark.parametrize(
    ('times', 'values', 'message'),
    [
        ([0.0, 1e-3, 1e-3], [1.0, 2.0, 3.0], 'not after that of row 2'),
        ([0.0, 1e-3, 2e-3], [1.0, float('nan'), 3.0], 'row 2: voltage_v nan is no number'),
        ([0.0, float('inf'), 2e-3], [1.0, 2.0, 3.0], 'row 2: time_s inf is no number'),
        ([0.0, 1e-3, 2e-3], [1.0, 1e6, 3.0], 'waveform voltage of row 2 1e'),
        ([0.0], [1.0], 'has 1 rows; give at least two'),
        ([], [], 'has 0 rows; give at least two'),
    ],
    ids=['not rising', 'no number', 'no time', 'out of range', 'one row', 'empty'],
)
def test_what_cannot_be_played_is_refused(
    times: list[float], values: list[float], message: str, tmp_path: Path
):
    columns = {
        'time_s': pa.array(times, pa.float64()),
        'voltage_v': pa.array(values, pa.float64()),
    }
    path = parquet_of(tmp_path / 'bad.parquet', **columns)
    with pytest.raises(StickSlipError) as refusal:
        replay_input(read_drive_input(path, STAND), tmp_path / 'run.mcap', STAND)
    assert message in str(refusal.value)
    assert not (tmp_path / 'run.mcap').exists()


def test_too_many_rows_are_refused_with_the_most_that_go(tmp_path: Path):
    time_s = np.arange(1_000_001) * 1e-6
    with pytest.raises(StickSlipError, match='2 to 1000000 rows'):
        replay_input(DriveInput('x', time_s, 0.0 * time_s), tmp_path / 'run.mcap', STAND)


@pytest.mark.parametrize(
    ('name', 'content', 'message'),
    [
        ('a.csv', b'time_s,position_m\n0,0\n1,0\n', 'has no voltage_v and no foot_m'),
        ('a.csv', b'time_s,voltage_v\n0,1\n0,2\n', 'line 3, column time_s'),
        ('a.csv', b'time_s,voltage_v\n0,nan\n', 'column voltage_v'),
        ('a.parquet', b'nonsense', 'cannot be read'),
        ('a.mcap', b'nonsense', 'name the topic'),
    ],
)
def test_files_that_are_not_as_they_should_be_are_refused(
    name: str, content: bytes, message: str, tmp_path: Path
):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(StickSlipError, match=message):
        read_drive_input(tmp_path / name, STAND)


def test_a_file_that_is_not_there_is_refused(tmp_path: Path):
    for name in ('a.csv', 'a.parquet'):
        with pytest.raises(StickSlipError, match='cannot be read'):
            read_drive_input(tmp_path / name, STAND)
