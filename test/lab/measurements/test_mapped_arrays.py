# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Numbers of arrays: joints by name, blocks of samples, columns of a table, and the own trace."""

import json
import re
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest
from mcap_records import foreign

from stickslip_ros import open_run
from stickslip_ros.arrays import Array
from stickslip_ros.errors import StickSlipError
from stickslip_ros.interface import cdr
from stickslip_ros.interface.messages import JointMessage
from stickslip_ros.interface.schemas import SCHEMAS
from stickslip_ros.lab.cli.main import main
from stickslip_ros.lab.measurements.mapped import mapped_series
from stickslip_ros.lab.measurements.run_result import SawtoothRun
from stickslip_ros.message_types import FLOAT64_ARRAY, JOINT_STATE
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.series import Series

MS_NS = 1_000_000
BEGIN_NS = 1_700_000_000 * 1_000_000_000
BLOCK, BLOCKS = 10, 30
TIME_S = 1e-4 * np.arange(BLOCK * BLOCKS)
VOLTS = 1e3 * TIME_S
ROUNDING_S = 2e-9
LATE_NS = 300_000  # by which blocks come late
Run = tuple[SawtoothRun, Path]
Rows = Iterable[tuple[str, str, int, bytes]]


def written(path: Path, rows: Rows) -> Path:
    writer, known = foreign(path), {}
    for topic, kind, at_ns, data in rows:
        if topic not in known:
            schema = writer.register_schema(kind, 'ros2msg', SCHEMAS[kind].encode())
            known[topic] = writer.register_channel(topic, 'cdr', schema)
        writer.add_message(known[topic], at_ns, data, at_ns)
    writer.finish()
    return path


def joints() -> Rows:
    """Two joints whose places change, and those of another robot between them."""
    for at in range(100):
        at_ns, here = BEGIN_NS + at * MS_NS, ('stage', 1e-9 * at)
        there = 'arm.x', -1.0
        names, numbers = zip(*((here, there) if at % 2 else (there, here)), strict=True)
        for joint in (names, numbers), (('wheel',), (0.7,)):
            message = JointMessage(at_ns, 'base', *joint)
            yield '/joint_states', JOINT_STATE, at_ns, cdr.pack_joints(message)


def blocks(lost: int = -1) -> Rows:
    """Blocks of samples at 10 kHz that come when they are full, up to LATE_NS late."""
    table: Array = np.column_stack((TIME_S, VOLTS, 1e-9 * VOLTS)).astype(np.float64)
    for number in range(BLOCKS):
        end_ns = BEGIN_NS + (number + 1) * MS_NS + number * 7 % 10 * LATE_NS // 10
        part = slice(BLOCK * number, BLOCK * (number + 1))
        for topic, values, labels in (
            ('/scope', table[part, 1], ('sample',)),
            ('/table', table[part, 1:], ('sample', 'voltage[V],position[m]')),
            ('/trace', table[part], ('sample', 't[s],voltage[V],position[m]')),
        ):
            if number != lost:
                yield topic, FLOAT64_ARRAY, end_ns, cdr.pack_float64_array(values, labels)


def volts_of(path: Path, field: str) -> tuple[Series, list[str]]:
    series, notes = mapped_series(Recording(path), {'voltage_v': field})
    return series['voltage_v'], notes


@pytest.mark.parametrize('field', ['[stage].position', '.position[stage]'])
def test_a_joint_is_read_by_its_name_where_places_change(tmp_path: Path, field: str):
    path = written(tmp_path / 'run.mcap', joints())
    series, _ = mapped_series(Recording(path), {'position_m': f'/joint_states{field}'})
    assert series['position_m'].value.tolist() == [1e-9 * at for at in range(100)]
    np.testing.assert_allclose(series['position_m'].time_s, 1e-3 * np.arange(100), atol=ROUNDING_S)


def test_a_place_that_is_of_several_joints_is_refused_with_their_names(tmp_path: Path):
    path = written(tmp_path / 'run.mcap', joints())
    with pytest.raises(StickSlipError) as refused:
        mapped_series(Recording(path), {'position_m': '/joint_states.position[0]'})
    ways = re.findall(r'/joint_states\[[\w.]+\]\.position', str(refused.value))
    assert len(ways) == 3
    found = [mapped_series(Recording(path), {'foot_m': each})[0]['foot_m'].value for each in ways]
    assert [each[2] for each in found] == [-1.0, 2e-9, 0.7]
    with pytest.raises(StickSlipError, match=r'position\[arm.x\], position\[stage\]'):
        mapped_series(Recording(path), {'position_m': '/joint_states[lid].position'})


@pytest.mark.parametrize(
    'field', ['/scope.data at 10kHz', '/table[voltage] at 1e4', '/table.data[0] (V) at 10 kHz']
)
def test_blocks_are_samples_at_the_stated_rate_though_they_come_late(tmp_path: Path, field: str):
    series, notes = volts_of(written(tmp_path / 'run.mcap', blocks()), field)
    np.testing.assert_allclose(series.time_s, TIME_S, atol=ROUNDING_S)
    assert np.array_equal(series.value, VOLTS)
    assert notes == [f'{field.split(maxsplit=1)[0]}: {BLOCKS} blocks hold samples at 10000 Hz']


def test_a_lost_block_leaves_a_gap_and_is_told(tmp_path: Path):
    path = written(tmp_path / 'run.mcap', blocks(lost=4))
    series, notes = volts_of(path, '/scope.data at 10kHz')
    kept = np.r_[0:40, 50:300]
    np.testing.assert_allclose(series.time_s, TIME_S[kept], atol=ROUNDING_S)
    assert np.array_equal(series.value, VOLTS[kept])
    assert '1 are lost' in notes[0]


@pytest.mark.parametrize('rate', ['5kHz', '20 kHz', '11kHz'])
def test_a_rate_that_is_not_that_of_the_blocks_is_refused_with_theirs(tmp_path: Path, rate: str):
    path = written(tmp_path / 'run.mcap', blocks())
    with pytest.raises(StickSlipError, match=r'not the rate .* of its blocks') as refused:
        volts_of(path, f'/scope.data at {rate}')
    [seen] = re.findall(r'at [\d.]+Hz', str(refused.value))
    series, _ = volts_of(path, f'/scope.data {seen}')
    np.testing.assert_allclose(series.time_s, TIME_S, atol=1e-9 * LATE_NS)


@pytest.mark.parametrize(
    ('field', 'told'),
    [
        ('/scope.data', 'data at ...kHz'),
        ('/scope.data[1] at 10kHz', 'a table of 1 columns'),
        ('/table.data at 10kHz', 'a table of 2 columns; name one, data[0]'),
        ('/table[volts] at 10kHz', 'it has voltage, position'),
        ('/table[voltage]', '"/table[voltage] at ...kHz"'),
        ('/scope.data at noon', 'a rate'),
    ],
)
def test_an_array_that_is_no_number_says_how_to_read_it(tmp_path: Path, field: str, told: str):
    path = written(tmp_path / 'run.mcap', blocks())
    with pytest.raises(StickSlipError, match=re.escape(told)):
        volts_of(path, field)


def test_a_trace_has_times_and_its_columns_names(tmp_path: Path, recorded_run: Run):
    series, _ = volts_of(written(tmp_path / 'run.mcap', blocks()), '/trace[voltage] (mV)')
    np.testing.assert_allclose(series.time_s, TIME_S, atol=ROUNDING_S)
    np.testing.assert_allclose(series.value, 1e-3 * VOLTS, rtol=1e-12)
    ours = open_run(recorded_run[1])
    mapped = open_run(recorded_run[1], topics={'voltage_v': '/trace[voltage]'}).series['voltage_v']
    np.testing.assert_allclose(mapped.time_s, ours.series['voltage_v'].time_s, atol=ROUNDING_S)
    assert np.array_equal(mapped.value, ours.series['voltage_v'].value)


def test_a_map_holds_in_each_verb_for_a_recording_of_the_drive_too(recorded_run, tmp_path, capsys):
    path, table = str(recorded_run[1]), tmp_path / 'a.csv'
    named = ['--map', 'voltage_v=/trace[voltage]', '--map', 'position_m=/trace[force] (um)']
    assert main(['export', path, *named, '-o', str(table)]) == 0
    assert main(['compare', path, 'model', *named, '--json']) == 0
    capsys.readouterr()
    assert main(['compare', path, str(table), *named, '--json']) == 0  # the table has no topics
    both = json.loads(capsys.readouterr().out)['quantities']
    assert [each['agreement']['largest'] for each in both] == [0.0, 0.0]
    assert main(['compare', path, 'model', '--map', 'position_m=/rig/x.y']) == 2
    assert "no topic and field '/rig/x.y'" in capsys.readouterr().err
    assert main(['replay', path, *named, '-o', str(tmp_path / 'b.mcap')]) == 2
    assert 'leave --map away' in capsys.readouterr().err
    force = open_run(path).series['force_n'].value
    read = open_run(table).series['position_m'].value
    np.testing.assert_allclose(read, 1e-6 * force, rtol=1e-12)
