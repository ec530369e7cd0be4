# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""``stickslip export``: tables that pandas reads without us."""

import gc
import weakref
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from mcap_records import foreign, foreign_numbers, rewritten

from stickslip_ros import open_run
from stickslip_ros.interface.cdr import pack_float64
from stickslip_ros.lab.cli.main import main
from stickslip_ros.lab.measurements import recorded
from stickslip_ros.lab.measurements.measurement import table_of_series
from stickslip_ros.lab.measurements.run_result import SawtoothRun
from stickslip_ros.message_types import FLOAT64

Run = tuple[SawtoothRun, Path]
KEPT_MOST = 2  # earlier tables: the first, which names the columns, and the last
READERS: dict[str, Callable[..., Any]] = {
    '.csv': partial(pd.read_csv, float_precision='round_trip'),
    '.parquet': pd.read_parquet,
    '.xlsx': pd.read_excel,
}


@pytest.mark.parametrize('suffix', READERS)
def test_a_trace_becomes_a_table_with_units(recorded_run: Run, tmp_path: Path, suffix: str):
    table = tmp_path / f'run{suffix}'
    assert main(['export', str(recorded_run[1]), '-o', str(table), '--window', '2ms@1ms']) == 0
    frame = READERS[suffix](table).reset_index()
    expected = open_run(recorded_run[1]).frame.loc[0.001:0.003]
    rtol = 1e-15 if suffix == '.xlsx' else 0.0  # openpyxl writes 16 digits
    for name in ('voltage_v', 'foot_m', 'position_m', 'force_n'):
        np.testing.assert_allclose(frame[name], expected[name], rtol=rtol)
    np.testing.assert_allclose(frame.time_s, expected.index, rtol=rtol)


def test_readings_are_those_of_the_topics(recorded_run: Run, tmp_path: Path):
    table = tmp_path / 'run.csv'
    assert main(['export', str(recorded_run[1]), '--readings', '-o', str(table)]) == 0
    frame = READERS['.csv'](table)
    position = open_run(recorded_run[1]).recording.series('position')
    np.testing.assert_array_equal(frame.time_s, position.time_s)
    np.testing.assert_array_equal(frame.position_m, position.value)


def test_a_rate_gives_means_over_intervals_at_their_middles(tmp_path: Path):
    rows = [(at * 250_000, at, float(at)) for at in (0, 1, 2, 3, 4, 5, 12)]  # 4 kHz, with a gap
    path, table = foreign_numbers(tmp_path / 'run.mcap', rows), tmp_path / 'run.csv'
    words = ('--map', 'voltage_v=/u.data', '--rate', '1kHz', '-o', str(table))
    assert main(['export', str(path), *words]) == 0
    frame = READERS['.csv'](table)
    assert frame.time_s.tolist() == [0.0005, 0.0015, 0.0035]
    assert frame.voltage_v.tolist() == [1.5, 4.5, 12.0]


def test_topics_of_one_length_and_other_times_share_a_table_and_lose_no_row(tmp_path: Path):
    writer = foreign(tmp_path / 'run.mcap')
    schema = writer.register_schema(FLOAT64, 'ros2msg', b'float64 data')
    for name, times_ns in (('/u', (0, 5, 5)), ('/x', (0, 1, 2))):
        channel = writer.register_channel(name, 'cdr', schema)
        for time_ns in times_ns:
            writer.add_message(channel, time_ns, pack_float64(time_ns), time_ns)
    writer.finish()
    words = ('--map', 'voltage_v=/u.data', '--map', 'position_m=/x.data')
    table = tmp_path / 'run.csv'
    assert main(['export', str(tmp_path / 'run.mcap'), *words, '-o', str(table)]) == 0
    assert READERS['.csv'](table).notna().sum().tolist() == [5, 3, 3]


@pytest.mark.parametrize('suffix', READERS)
@pytest.mark.parametrize(
    'words', [(), ('--readings',), ('--rate', '913.7'), ('--window', '3ms@1ms')]
)
def test_a_long_recording_is_written_stretch_by_stretch_as_a_short_one(
    recorded_run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, suffix: str,
    words: tuple[str, ...],
):  # fmt: skip
    path = rewritten(recorded_run[1], tmp_path / 'run.mcap', chunk_size=9000)
    frames = []
    for name, size_bytes in (('short', 1 << 30), ('long', 20_000)):
        monkeypatch.setattr(recorded, 'STRETCH_BYTES', size_bytes)
        table = tmp_path / f'{name}{suffix}'
        assert main(['export', str(path), '-o', str(table), *words]) == 0
        frames.append(READERS[suffix](table))
    short, long = frames
    pd.testing.assert_frame_equal(short, long, rtol=1e-13 if '--rate' in words else 1e-15)


@pytest.mark.parametrize('suffix', ['.csv', '.parquet'])
def test_no_stretch_outlives_its_writing_even_without_a_collection(
    suffix: str, recorded_run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    path = rewritten(recorded_run[1], tmp_path / 'run.mcap', chunk_size=3000)
    monkeypatch.setattr(recorded, 'STRETCH_BYTES', 5000)
    frames, alive = list[weakref.ref[pd.DataFrame]](), list[int]()

    def counted(*given: Any) -> pd.DataFrame:
        alive.append(sum(each() is not None for each in frames))
        made = table_of_series(*given)
        frames.append(weakref.ref(made))
        return made

    monkeypatch.setattr('stickslip_ros.lab.cli.export.table_of_series', counted)
    gc.disable()
    try:
        assert main(['export', str(path), '-o', str(tmp_path / f'run{suffix}')]) == 0
    finally:
        gc.enable()
    assert len(alive) > KEPT_MOST + 1
    assert max(alive) <= KEPT_MOST


@pytest.mark.parametrize('words', [('run.xlsx',), ('run.csv', '--readings')])
def test_what_is_exported_is_read_again(recorded_run: Run, tmp_path: Path, words: tuple[str, ...]):
    table = tmp_path / words[0]
    main(['export', str(recorded_run[1]), '-o', str(table), *words[1:]])
    assert main(['compare', str(recorded_run[1]), str(table)]) == 0


@pytest.mark.parametrize(
    ('words', 'told'),
    [
        (('-o', 'run.txt'), 'one of .csv, .parquet, .xlsx'),
        (('-o', 'run.csv', '--window', '1ms@9s'), 'is outside of the run, 0 s to '),
        (('-o', 'run.csv', '--rate', '0'), '--rate 0 Hz is not above 0 Hz'),
        (('-o', 'run.csv', '--map', 'force_n=/x.data'), 'has no topic and field'),
        (
            ('--readings', '-o', 'run.csv', '--map', 'force_n=/x.data'),
            'leave out --readings or --map',
        ),
    ],
)
def test_what_cannot_be_written_is_refused(
    recorded_run: Run, words: tuple[str, ...], told: str, capsys: pytest.CaptureFixture[str],
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
):  # fmt: skip
    monkeypatch.chdir(tmp_path)
    assert main(['export', str(recorded_run[1]), *words]) == 2
    assert told in capsys.readouterr().err
