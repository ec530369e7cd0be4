# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Each verb takes each kind of source, and reads the same numbers from it."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from mcap_records import foreign_numbers

from stickslip_ros import compare, open_run, simulate
from stickslip_ros.errors import StickSlipError
from stickslip_ros.lab.cli.main import main
from stickslip_ros.lab.measurements.measurement import measured
from stickslip_ros.lab.panel.controls import read_waveform
from stickslip_ros.lab.panel.player import Player

ROWS, STEP_S = 200, 1e-4
TIME_S = STEP_S * np.arange(ROWS)
POSITION_M = 1e-7 * np.sin(np.arange(ROWS) / 7.0)
TOPIC = '/u'
POINTS = {'preload (N)': (0.5, 0.5, 1.0), 'amplitude (nm)': (60, 80, 90), 'force (mN)': (1, 3, 2)}


@pytest.fixture
def table(tmp_path: Path) -> Path:
    """Give a table over time."""
    frame = pd.DataFrame({'time (s)': TIME_S, 'position (nm)': 1e9 * POSITION_M})
    frame.to_csv(path := tmp_path / 'scope.csv', index=False)
    return path


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    """Give the same numbers as messages of another program."""
    at_ns = (round(1e9 * each) for each in TIME_S)
    rows = ((ns, k, float(v)) for k, (ns, v) in enumerate(zip(at_ns, POSITION_M, strict=True)))
    return foreign_numbers(tmp_path / 'bag.mcap', rows)


@pytest.fixture
def points(tmp_path: Path) -> list[Path]:
    """Give two tables by amplitude."""
    paths = [tmp_path / 'a.csv', tmp_path / 'b.csv']
    for path in paths:
        pd.DataFrame(POINTS).to_csv(path, index=False)
    return paths


def words_of(path: Path) -> list[str]:
    """Return a source on a command line, with the topic of a bag."""
    return [str(path), *(['--map', f'position_m={TOPIC}.data'] if path.suffix == '.mcap' else [])]


@pytest.mark.parametrize('kind', ['table', 'bag'])
def test_a_table_and_a_bag_are_drawn_exported_imported_and_played(kind, request, tmp_path, capsys):
    path = request.getfixturevalue(kind)
    picture, out = tmp_path / 'p.png', tmp_path / 'out.csv'
    assert main(['plot', *words_of(path), '-o', str(picture), '--json']) == 0
    [drawn] = json.loads(capsys.readouterr().out)['quantities']
    assert picture.stat().st_size > 10_000
    assert (drawn['name'], drawn['samples']) == ('position_m', ROWS)
    assert drawn['largest'] == pytest.approx(POSITION_M.max(), rel=1e-9)
    for verb in ('export', 'import'):
        assert main([verb, *words_of(path), '-o', str(out)]) == 0
        read = pd.read_csv(out, comment='#')
        np.testing.assert_allclose(read.time_s, TIME_S, atol=1e-12)
        np.testing.assert_allclose(read.position_m, POSITION_M, atol=1e-18)
    topics = {'position_m': f'{TOPIC}.data'} if kind == 'bag' else None
    run = open_run(path, topics)
    np.testing.assert_allclose(run.frame.position_m, POSITION_M, atol=1e-18)
    assert len(run.table((0.005, 0.01005))) == 51
    assert len(run.plot(0.005, 0.01).axes) == 1
    assert str(ROWS) in run._repr_html_()
    heights = [each for _, each in Player(path, topics).overview()['points']]
    assert max(heights) == pytest.approx(POSITION_M.max(), abs=1e-10)


def test_a_table_has_neither_commands_nor_a_stand(table: Path):
    run = open_run(table)
    for each in ('recording', 'parameters'):
        with pytest.raises(StickSlipError):
            getattr(run, each)


def test_a_data_frame_and_several_tables_are_opened_and_compared(table: Path):
    frame = pd.read_csv(table)
    assert open_run(frame).series['position_m'].value == pytest.approx(POSITION_M, abs=1e-18)
    [agreement] = [each.agreement for each in compare(open_run(frame), table).quantities]
    assert (agreement.points, abs(agreement.largest) < 1e-18) == (ROWS, True)


def test_points_of_several_tables_are_drawn_and_exported(points, tmp_path, capsys):
    files, out = [*map(str, points)], tmp_path / 'out.csv'
    assert main(['plot', *files, '-o', str(tmp_path / 'p.svg'), '--json']) == 0
    drawn = json.loads(capsys.readouterr().out)
    assert drawn['axis'] == 'amplitude_m'
    assert [(each['samples'], each['largest']) for each in drawn['quantities']] == [(6, 3e-3)]
    assert '1 N' in (tmp_path / 'p.svg').read_text()
    assert main(['export', *files, '-o', str(out)]) == 0
    assert pd.read_csv(out).force_n.tolist() == [1e-3, 3e-3, 2e-3] * 2


@pytest.mark.parametrize(
    ('words', 'told'),
    [
        (('plot', '--window', '1ms@0'), 'leave out --window'),
        (('export', '--rate', '10', '-o', 'o.csv'), 'leave out --window and --rate'),
        (('export', '--readings', '-o', 'o.csv'), 'leave out --readings'),
    ],
)
def test_options_of_time_are_refused_on_points(words, told, points, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)  # where the table goes
    verb, *others = words
    assert main([verb, str(points[0]), *others]) == 2
    assert told in capsys.readouterr().err
    kept = [each for each in others if each.startswith('-o') or each == 'o.csv']
    assert main([verb, str(points[0]), *kept]) == 0


def test_points_have_no_series_and_a_recording_needs_to_be_alone(points, table, bag):
    with pytest.raises(StickSlipError, match='is by amplitude and has no times'):
        open_run(points[0])
    with pytest.raises(StickSlipError, match='give it alone'):
        measured([table, bag])


def test_the_panel_takes_the_voltage_of_an_uploaded_recording(tmp_path: Path, table: Path):
    path = simulate(voltage_v=100.0, steps=3, record=tmp_path / 'run.mcap').path
    rows: Any = np.array(read_waveform(path.read_bytes(), 'run.mcap'))
    voltage = open_run(path).series['voltage_v']
    np.testing.assert_array_equal(rows[:, 1], voltage.value)
    np.testing.assert_allclose(rows[:, 0], voltage.time_s - voltage.time_s[0], atol=1e-12)
    with pytest.raises(StickSlipError, match='voltage'):
        read_waveform(table.read_bytes(), 'scope.csv')
