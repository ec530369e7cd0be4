# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Recordings of a real rig: any message, the rig's own topics, clock and zero."""

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from mcap_records import foreign_numbers
from processes import run_process
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from stickslip_ros import CompareOptions, Parameters, StickSlipError, compare, open_run
from stickslip_ros.lab.cli.main import main
from stickslip_ros.lab.measurements.mapped import mapped_series
from stickslip_ros.lab.measurements.run_result import SawtoothRun
from stickslip_ros.lab.panel.player import Player
from stickslip_ros.recording.reader import Recording

STORE = get_typestore(Stores.ROS2_JAZZY)
Run = tuple[SawtoothRun, Path]
START_NS = 1_760_000_000_123_456_789
LATE_S = 0.004
SAMPLE_S = 2e-5
ZERO_M = 3.25e-6
TOPICS = {
    'position_m': '/rig/encoder.vector.x',
    'force_n': '/rig/cell.data (mN)',
    'voltage_v': '/rig/amp.data[1]',
}


@pytest.fixture(scope='module')
def rig(recorded_run: Run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write what a rig would have recorded of a run: with a library and types of others."""
    trace: Any = open_run(recorded_run[1]).frame
    folder = tmp_path_factory.mktemp('rig') / 'bag'
    types = STORE.types
    header, stamp = types['std_msgs/msg/Header'], types['builtin_interfaces/msg/Time']
    layout = types['std_msgs/msg/MultiArrayLayout'](dim=[], data_offset=0)
    kinds = {
        '/rig/encoder': 'geometry_msgs/msg/Vector3Stamped',
        '/rig/cell': 'std_msgs/msg/Float32',
        '/rig/amp': 'std_msgs/msg/Float32MultiArray',
    }
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        to = {
            name: writer.add_connection(name, kind, typestore=STORE)
            for name, kind in kinds.items()
        }
        for time_s, row in zip(trace.index[1::2], trace.iloc[1::2].itertuples(), strict=True):
            at_ns = START_NS + round(1e9 * (time_s + LATE_S))
            point = types['geometry_msgs/msg/Vector3'](x=row.position_m + ZERO_M, y=0.0, z=0.0)
            messages = {
                '/rig/encoder': types[kinds['/rig/encoder']](
                    header(stamp(*divmod(at_ns, 10**9)), 'rig'), point
                ),
                '/rig/cell': types[kinds['/rig/cell']](data=np.float32(1e3 * row.force_n)),
                '/rig/amp': types[kinds['/rig/amp']](
                    layout, np.array([0.0, row.voltage_v], dtype=np.float32)
                ),
            }
            for name, message in messages.items():
                late_ns = 250_000 if name == '/rig/encoder' else 0  # written after it was sent
                data = STORE.serialize_cdr(message, kinds[name])
                writer.write(to[name], at_ns + late_ns, data)
    return folder


def test_a_rig_has_the_quantities_that_the_user_names(rig: Path, recorded_run: Run):
    ours = open_run(recorded_run[1]).frame.iloc[1::2]
    frame = open_run(rig, topics=TOPICS).frame
    assert frame.index[0] == 0.0
    np.testing.assert_allclose(np.diff(frame.index), np.diff(ours.index), atol=2e-9)
    np.testing.assert_allclose(frame.position_m - ZERO_M, ours.position_m, rtol=0, atol=1e-20)
    np.testing.assert_allclose(frame.force_n, ours.force_n, rtol=1e-7, atol=1e-12)
    np.testing.assert_allclose(frame.voltage_v, ours.voltage_v, rtol=1e-7)


def test_each_verb_takes_a_bag_of_sqlite3(rig, recorded_run, tmp_path, capsys):
    convert = Path(sys.executable).with_name('rosbags-convert')
    run_process([convert, '--src', rig, '--dst', tmp_path / 'rig'], check=True)
    [file] = (tmp_path / 'rig').glob('*.db3')
    said = [word for name, text in TOPICS.items() for word in ('--map', f'{name}={text}')]
    tables = []
    for each in (rig, file):
        words = [['info', each], ['export', each, *said, '-o', tmp_path / 'table.csv']]
        words += [
            ['compare', recorded_run[1], each, *said],
            ['replay', each, *said, '-o', 'b.mcap'],
        ]
        words += [['fit', each, *said, '--free', 'runner.mass']]
        assert [main([*map(str, each)]) for each in words] == [0, 0, 0, 2, 2]
        tables.append((tmp_path / 'table.csv').read_text())
    assert tables[0] == tables[1]
    assert capsys.readouterr().err.count('miss 20 samples') == 4


def test_an_open_run_of_a_rig_is_compared_as_it_was_opened(rig: Path, recorded_run: Run):
    ours = open_run(recorded_run[1])
    opened = compare(ours, open_run(rig, topics=TOPICS))
    named = compare(recorded_run[1], rig, options=CompareOptions(headers=TOPICS))
    assert opened.to_json() == named.to_json()
    table = compare(ours.frame, ours)
    assert [each.agreement.largest for each in table.quantities] == [0.0] * 4


def test_clock_and_zero_of_a_rig_are_found_and_told(rig: Path, recorded_run: Run):
    options = CompareOptions(headers=TOPICS, align=True, offset=True)
    found = compare(recorded_run[1], rig, options=options)
    first_s = open_run(recorded_run[1]).frame.index[1]
    assert found.alignment is not None
    assert found.alignment.shift_s == pytest.approx(first_s, abs=SAMPLE_S)
    by_name = {each.name: each for each in found.quantities}
    assert by_name['position_m'].offset == pytest.approx(-ZERO_M, rel=1e-3)
    assert by_name['force_n'].offset == 0.0
    assert found.alignment.decided_by == 'voltage_v'
    for each in found.quantities:  # a sample of 40 us lies in each fall of the voltage
        assert each.agreement.relative_rms < (0.06 if each.name == 'voltage_v' else 0.005)


def test_a_rig_is_drawn_and_played_and_the_model_is_driven_by_what_drove_it(rig, tmp_path, capsys):
    said = [word for name, text in TOPICS.items() for word in ('--map', f'{name}={text}')]
    frame: Any = open_run(rig, topics=TOPICS).frame
    assert main(['plot', str(rig), *said, '-o', str(tmp_path / 'rig.png'), '--json']) == 0
    drawn = {each['name']: each for each in json.loads(capsys.readouterr().out)['quantities']}
    assert drawn.keys() == TOPICS.keys()
    assert drawn['position_m']['largest'] == frame.position_m.max()
    overview = Player(rig, TOPICS).overview()
    heights = [height for _, height in overview['points']]
    assert max(heights) - min(heights) == pytest.approx(np.ptp(frame.position_m), rel=1e-3)
    # Its monitor samples each step at the same phases, one of them in the fall.
    assert main(['replay', str(rig), *said, '-o', str(tmp_path / 'model.mcap')]) == 2
    assert 'miss 20 samples; give a table of its corners' in capsys.readouterr().err
    ends_s = 1e-3 * np.arange(1, 21)
    times_s = np.concatenate(([0.0], np.column_stack((ends_s - 2e-6, ends_s)).ravel()))
    volts = np.concatenate(([0.0], np.tile((300.0, 0.0), 20)))
    commands = pd.DataFrame({'time_s': times_s, 'voltage_v': volts})
    commands.to_csv(corners := tmp_path / 'corners.csv', index=False)
    assert main(['replay', str(corners), '-o', str(tmp_path / 'model.mcap')]) == 0
    found = compare(rig, Parameters(), options=CompareOptions(headers=TOPICS, commands=commands))
    for each in found.quantities:
        assert each.agreement.relative_rms < 0.02
    assert main(['replay', str(rig)]) == 2
    told = 'was recorded by another program: it has no parameters.yaml and no commands; map its'
    assert told in capsys.readouterr().err
    assert main(['plot', str(rig)]) == 2
    assert 'map its topics with --map' in capsys.readouterr().err


def test_a_window_leaves_out_what_is_not_wanted(rig: Path, recorded_run: Run):
    window_s = 0.0051, 0.00613
    options = CompareOptions(headers=TOPICS, window_s=window_s)
    found = compare(recorded_run[1], rig, options=options)
    for each in found.quantities:
        [part] = each.parts
        assert window_s[0] <= part.x.min() <= part.x.max() <= window_s[1]


@pytest.mark.parametrize(
    ('topics', 'told'),
    [
        ({'position_m': '/rig/encoder.point.x'}, 'its numbers are header.stamp.sec'),
        ({'position_m': '/rig/encodr.vector.x'}, "has no topic and field '/rig/encodr.vector.x'"),
        ({'position_m': '/rig/encoder'}, 'has no topic and field'),
        ({'voltage_v': '/rig/amp.data[2]'}, 'the array of a message has 2 elements'),
        ({'voltage_v': '/rig/amp.data'}, 'its numbers are'),
        ({'voltage_v': '/rig/amp..data'}, 'write it as point.x'),
        ({'force_n': '/rig/cell.data (nm)'}, 'a unit of N'),
        ({'speed': '/rig/cell.data'}, 'over time time_s, position_m'),
        ({'time_s': '/rig/cell.data'}, 'none of position_m'),
    ],
)
def test_what_a_rig_does_not_have_is_refused(rig: Path, topics: dict[str, str], told: str):
    with pytest.raises(StickSlipError, match=told.replace('[', r'\[')):
        open_run(rig, topics=topics)


def test_counts_that_are_taken_for_metres_are_refused(tmp_path: Path):
    rows = ((1000 * k, k, 2000.0 + k) for k in range(20))
    recording = Recording(foreign_numbers(tmp_path / 'counts.mcap', rows))
    with pytest.raises(StickSlipError, match=r'above the largest position_m, 1 m; give its unit'):
        mapped_series(recording, {'position_m': '/u.data'})
    read, _ = mapped_series(recording, {'position_m': '/u.data (1.22 nm)'})
    assert read['position_m'].value[0] == pytest.approx(2000.0 * 1.22e-9)
