# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A bag that ros2 bag record made of the drive: its run, parameters and commands are known."""

import random
from dataclasses import replace as changed
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_records import foreign
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as BagWriter
from rosbags.typesys import Stores, get_typestore

from stickslip_ros.instrument.commands import Request
from stickslip_ros.interface.cdr import pack_float64, unpack
from stickslip_ros.interface.messages import StampedMessage
from stickslip_ros.interface.schemas import SCHEMAS
from stickslip_ros.lab.cli.main import main
from stickslip_ros.lab.measurements.recorded import recorded_series
from stickslip_ros.lab.measurements.recorded_run import open_run
from stickslip_ros.lab.runs.replay import replay
from stickslip_ros.message_types import FLOAT64, VECTOR3_STAMPED
from stickslip_ros.parameters import Parameters
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.run import ReportingBench, RunWriter

MS_NS = 1_000_000
NOW_NS = 1_795_818_000 * 1_000_000_000
END_MS = 60
ORIGIN_NS = 1_700_000_000_123_456_789
STAND = Parameters().updated({'load_cell.contact': 'absent', 'actuator.gain': 5e-10})
PLAN = (
    (10, Request('sawtooth', (100.0, 1000.0, 8.0))),
    (25, Request('voltage', (30.0,))),
    (40, Request('waveform', (0.0, 30.0, 2e-3, 80.0, 5e-3, 20.0))),
)


@pytest.fixture(scope='module', name='run')
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Record some commands with the recorder of the package."""
    bench = ReportingBench(STAND, time_origin_ns=ORIGIN_NS)
    path = tmp_path_factory.mktemp('run') / 'run.mcap'
    with RunWriter(path, STAND, wait=True, time_origin_ns=ORIGIN_NS) as writer:
        bench.record(writer)
        while (now_ns := bench.bench.time_ns) < END_MS * MS_NS:
            due = [each for at_ms, each in PLAN if at_ms * MS_NS == now_ns]
            bench.update(now_ns + STAND.block_ns, due)
    return path


def copied(
    run: Path,
    target: Path,
    *,
    shift_ns: int = 0,
    late_ns: int = 0,
    late: str = 'command',
    lost: int = 0,
    is_old: bool = False,
) -> Path:
    """
    Write messages alone, as another recorder does: it adds a shift to their times.

    Commands, or others, come up to ``late_ns`` later, and each message of a number ``lost`` is
    lost. In an old bag the voltage has no stamp.

    """
    chance, rows = random.Random(1), []
    with run.open('rb') as stream:
        for told, channel, message in make_reader(stream).iter_messages():
            late_by = chance.randrange(late_ns) if late_ns and late in channel.topic else 0
            schema, data = told, message.data
            if is_old and channel.topic == '/voltage':
                stamped = unpack(VECTOR3_STAMPED, data)
                assert isinstance(stamped, StampedMessage)
                data = pack_float64(stamped.values[0])
                schema = changed(told, name=FLOAT64, data=SCHEMAS[FLOAT64].encode())
            rows.append((message.log_time + shift_ns + late_by, schema, channel, data))
    writer, known, seen = foreign(target), {}, 0
    for time_ns, schema, channel, data in sorted(rows, key=lambda each: each[0]):
        if channel.topic not in known:
            number = writer.register_schema(schema.name, schema.encoding, schema.data)
            known[channel.topic] = writer.register_channel(channel.topic, 'cdr', number)
        seen += channel.topic == '/position'
        if not (lost and channel.topic == '/position' and seen % lost == 0):
            writer.add_message(known[channel.topic], time_ns, data, time_ns, 0)
    writer.finish()
    return target


@pytest.mark.parametrize('shift_ns', [0, NOW_NS - ORIGIN_NS], ids=['convert', 'wall'])
def test_a_bag_of_the_drive_is_replayed_to_the_byte(run: Path, tmp_path: Path, shift_ns: int):
    bag = copied(run, tmp_path / 'bag.mcap', shift_ns=shift_ns)
    result = replay(bag, tmp_path / 'again.mcap')
    assert (result.requests, result.identical) == (3, True), result.difference
    assert result.apart_m == 0.0


@pytest.mark.parametrize('late_ms', [1, 3, 8])
def test_commands_that_came_late_stand_at_the_times_of_their_events(run, tmp_path, late_ms):
    bag = copied(run, tmp_path / 'bag.mcap', shift_ns=NOW_NS, late_ns=late_ms * MS_NS)
    result = replay(bag, tmp_path / 'again.mcap')
    assert (result.identical, result.apart_m) == (True, 0.0), result.difference


def test_a_bag_that_lost_readings_gives_the_run_within_their_noise(run, tmp_path, capsys):
    bag = copied(run, tmp_path / 'bag.mcap', lost=10)
    assert [each.gaps for each in Recording(bag).channels if each.topic == '/position'] == [None]
    assert main(['replay', str(bag)]) == 0
    said = capsys.readouterr().out
    assert 'began at rest' in said
    assert '0 nm RMS' in said


def test_the_storage_of_rosbag2_is_replayed_too(run: Path, tmp_path: Path):
    store = get_typestore(Stores.ROS2_JAZZY)
    with BagWriter(tmp_path / 'bag', version=9, storage_plugin=StoragePlugin.SQLITE3) as bag:
        known = {}
        with run.open('rb') as stream:
            for schema, channel, message in make_reader(stream).iter_messages():
                if channel.topic not in known:
                    known[channel.topic] = bag.add_connection(
                        channel.topic, schema.name, typestore=store
                    )
                bag.write(known[channel.topic], message.log_time, message.data)
    assert replay(tmp_path / 'bag', tmp_path / 'again.mcap').identical


def test_parameters_and_the_trace_of_a_bag_are_those_of_the_drive(run: Path, tmp_path: Path):
    bag = open_run(copied(run, tmp_path / 'bag.mcap', shift_ns=NOW_NS))
    ours = open_run(run)
    assert bag.parameters == ours.parameters
    assert bag.series.keys() == ours.series.keys()
    for name, each in ours.series.items():
        assert np.array_equal(bag.series[name].time_s, each.time_s)
        assert np.array_equal(bag.series[name].value, each.value)


@pytest.mark.parametrize('of', [{'is_old': True}, {'late': '/voltage', 'late_ns': 5 * MS_NS}])
def test_readings_stand_at_their_stamps_and_an_old_voltage_at_those_of_others(run, tmp_path, of):
    bag = Recording(copied(run, tmp_path / 'bag.mcap', shift_ns=NOW_NS, **of))
    for name in ('voltage', 'position', 'joint_states'):
        found, expected = bag.series(name), Recording(run).series(name)
        assert np.array_equal(found.time_s, expected.time_s)
        assert np.array_equal(found.value, expected.value)
        assert found.unit == expected.unit
    assert recorded_series(bag, traced=False).keys() == {'voltage_v', 'position_m', 'force_n'}


@pytest.mark.parametrize('verb', ['compare', 'fit', 'plot', 'export', 'info'])
def test_every_verb_takes_a_bag_of_the_drive_without_a_map(run, tmp_path, verb, capsys):
    bag = str(copied(run, tmp_path / 'bag.mcap', shift_ns=NOW_NS))
    words = {
        'compare': [bag, 'model', '--json'],
        'fit': [bag, '--free', 'actuator.gain', '--starts', '1', '--json'],
        'plot': [bag, '-o', str(tmp_path / 'a.png')],
        'export': [bag, '-o', str(tmp_path / 'a.csv')],
        'info': [bag],
    }
    assert main([verb, *words[verb]]) == 0, capsys.readouterr().err


def without(run: Path, target: Path, topic: str) -> Path:
    """Write a bag by a recorder on wall-clock time that did not hear a topic."""
    copied(run, target.with_name('all.mcap'), shift_ns=NOW_NS)
    writer, known = foreign(target), {}
    with target.with_name('all.mcap').open('rb') as stream:
        for schema, channel, message in make_reader(stream).iter_messages():
            if channel.topic == topic:
                continue
            if channel.topic not in known:
                number = writer.register_schema(schema.name, schema.encoding, schema.data)
                known[channel.topic] = writer.register_channel(channel.topic, 'cdr', number)
            times_ns = message.log_time, message.publish_time
            writer.add_message(known[channel.topic], times_ns[0], message.data, times_ns[1], 0)
    writer.finish()
    return target


def test_the_trace_places_messages_where_no_position_was_recorded(run: Path, tmp_path: Path):
    bag = Recording(without(run, tmp_path / 'bag.mcap', '/position'))
    expected = Recording(run).series('voltage').time_s
    assert np.array_equal(bag.series('voltage').time_s, expected)


def test_a_bag_without_its_commands_is_compared_by_its_trace(run, tmp_path, capsys):
    bag = without(run, tmp_path / 'bag.mcap', '/command/voltage')
    assert main(['replay', str(bag)]) == 2
    assert 'holds 2 of 3 commands' in capsys.readouterr().err
    assert main(['compare', str(bag), 'model']) == 0


@pytest.mark.parametrize('verb', ['export', 'compare', 'fit'])
def test_a_window_beyond_a_bag_says_from_when_to_when_it_is(run, tmp_path, verb, capsys):
    bag = str(copied(run, tmp_path / 'bag.mcap', shift_ns=NOW_NS))
    words = {
        'export': ['-o', str(tmp_path / 'a.csv')],
        'compare': ['model'],
        'fit': ['--free', 'actuator.gain'],
    }
    assert main([verb, bag, *words[verb], '--window', '1ms@5s']) == 2
    assert 'outside of the run, 0 s to 0.06 s' in capsys.readouterr().err
