# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A time origin moves stamps and log times and nothing else; readers give simulated time."""

import dataclasses
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from stickslip_ros.instrument.commands import Request
from stickslip_ros.interface import cdr
from stickslip_ros.interface import messages as m
from stickslip_ros.interface.cdr import unpack
from stickslip_ros.interface.channels import Channel, Qos
from stickslip_ros.lab.cli.recording import describe_recording
from stickslip_ros.lab.comparison.compare import compare
from stickslip_ros.lab.measurements.recorded import (
    TimeWindow,
    events_within,
    recorded_series,
)
from stickslip_ros.lab.measurements.run_figure import plot_run
from stickslip_ros.lab.runs.replay import replay
from stickslip_ros.message_types import FLOAT64, JOINT_STATE, POINT_STAMPED, STRING
from stickslip_ros.parameters import Parameters
from stickslip_ros.recording.differences import compare_data
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.recorder import Recorder
from stickslip_ros.recording.requests import recorded_requests
from stickslip_ros.recording.run import ReportingBench, RunWriter
from stickslip_ros.recording.run_file import info_json

#: As a double it would lose 0.12 us: every time that is taken from it must be an integer.
ORIGIN_NS = 1_800_000_000_123_456_789
MS_NS = 1_000_000
END_NS = 60 * MS_NS
PLAN = {
    5: Request('sawtooth', (300.0, 1000.0, 10.0)),
    20: Request('tare_force'),
    30: Request('load', (0.05, 0.0, 0.0, 0.0, 0.0, 0.0), stamp_ns=7),
}
WHOLE = TimeWindow(0.0, 1.0)
PARTS = {'record__format': 'bag', 'record__flush_period': 0.01, 'record__split_duration': 0.02}
STAMPED = {*m.STAMPED_FIELDS, JOINT_STATE}
Record = Callable[..., Path]


def record(path: Path, origin_ns: int, begin_ms: int = 0, **values: Any) -> Path:
    """Record a run with this time origin, from a time on."""
    wanted = {name.replace('__', '.'): value for name, value in values.items()}
    parameters = Parameters().updated({'sim.publish_truth': True, **wanted})
    run = ReportingBench(parameters, time_origin_ns=origin_ns)
    with RunWriter(path, parameters, wait=True, time_origin_ns=origin_ns) as writer:
        while (now_ns := run.bench.time_ns) < END_NS:
            if now_ns == begin_ms * MS_NS:
                run.record(writer)
            asked = PLAN.get(now_ns // MS_NS)
            run.update(now_ns + MS_NS, [asked] if asked else [])
    return writer.recorder.path


@pytest.fixture(scope='module')
def runs(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Give the recordings of one run with time origin 0 and with another."""
    folder = tmp_path_factory.mktemp('runs')
    zero, system = (folder / name / 'run.mcap' for name in ('zero', 'system'))
    return record(zero, 0), record(system, ORIGIN_NS)


@pytest.fixture(scope='module')
def recordings(runs: tuple[Path, Path]) -> tuple[Recording, Recording]:
    zero, system = runs
    return Recording(zero), Recording(system)


def unlike_in_origin(recordings: tuple[Recording, Recording]) -> Iterator[tuple[Any, Any, str]]:
    """Give the messages of both side by side, and their topic."""
    both = [list(each.records()) for each in recordings]
    for (topic, one), (_, other) in zip(*both, strict=True):
        yield one, other, topic


def test_stamps_and_log_times_are_the_origin_and_simulated_time(recordings):
    types = recordings[0].types
    for one, other, topic in unlike_in_origin(recordings):
        assert other.log_time == other.publish_time == one.log_time + ORIGIN_NS
        if types[topic] in STAMPED and 'command' not in topic:
            plain, moved = (unpack(types[topic], each.data) for each in (one, other))
            assert isinstance(plain, m.StampedMessage | m.JointMessage)
            assert plain.stamp_ns == one.log_time
            assert moved == plain._replace(stamp_ns=other.log_time)


def test_an_event_and_a_trace_differ_in_their_origin_alone(recordings):
    types, compared = recordings[0].types, set()
    for one, other, topic in unlike_in_origin(recordings):
        if topic in {'/trace', '/stickslip_drive/event'}:
            compared.add(topic)
            plain, moved = (unpack(types[topic], each.data) for each in (one, other))
            if isinstance(plain, m.ArrayMessage):
                assert isinstance(moved, m.ArrayMessage)
                assert np.array_equal(plain.data, moved.data)
                assert moved.labels == (f'sample; time_origin_ns={ORIGIN_NS}', plain.labels[1])
            else:
                event = json.loads(str(plain))
                moved_ns = event['time_ns'] + ORIGIN_NS
                assert json.loads(str(moved)) == event | {'stamp_ns': moved_ns}
    assert len(compared) == 2


def test_status_requests_and_commands_are_the_same_bytes(recordings):
    stamped = {name for name, kind in recordings[0].types.items() if kind in STAMPED}
    moved = {name for name in stamped if 'command' not in name} | {'/trace'}
    moved |= {'/stickslip_drive/info', '/stickslip_drive/event'}
    compared = set()
    for one, other, topic in unlike_in_origin(recordings):
        if topic not in moved:
            compared.add(topic)
            assert one.data == other.data
    names = {'status', 'request', 'sawtooth', 'load'}
    assert {name.rpartition('/')[2] for name in compared} == names


def test_the_origin_is_in_the_metadata_and_in_info(recordings: tuple[Recording, Recording]):
    zero, system = recordings
    assert (zero.time_origin_ns, system.time_origin_ns) == (0, ORIGIN_NS)
    assert system.metadata['stickslip_run']['time_origin_ns'] == str(ORIGIN_NS)
    [(_, _, info)] = system.messages(['info'])
    assert f'"time_origin_ns": {ORIGIN_NS}' in str(info)


def test_messages_channels_and_requests_are_told_in_simulated_time(recordings):
    zero, system = recordings
    assert [t for _, t, _ in zero.messages()] == [t for _, t, _ in system.messages()]
    assert zero.channels == system.channels
    assert list(recorded_requests(zero)) == list(recorded_requests(system))
    assert describe_recording(zero)['topics'] == describe_recording(system)['topics']


def test_quantities_events_and_bits_are_the_same_to_the_last_digit(recordings):
    zero, system = recordings
    for topic in (
        'position',
        'force',
        'voltage',
        'joint_states',
        'truth/position',
        'command/load',
    ):
        one, other = zero.series(topic), system.series(topic)
        np.testing.assert_array_equal(one.time_s, other.time_s)
        np.testing.assert_array_equal(one.value, other.value)
    for name, one in recorded_series(zero).items():
        np.testing.assert_array_equal(one.time_s, recorded_series(system)[name].time_s)
    assert events_within(zero, WHOLE) == events_within(system, WHOLE) != []


def test_a_picture_shows_simulated_time(runs: tuple[Path, Path], tmp_path: Path):
    one, other = (
        dataclasses.asdict(plot_run(Recording(each), tmp_path / 'run.svg', WHOLE)) for each in runs
    )
    assert repr(one) == repr(other)  # with values that are no numbers


def test_runs_of_different_origins_are_compared_at_equal_simulated_times(runs: tuple[Path, Path]):
    names = map(str, runs)
    comparison = compare(*names)
    assert comparison.differences == ()
    assert [each.agreement.rms for each in comparison.quantities] == [0.0] * 4
    assert all(each.left_out == 0 for each in comparison.quantities)


@pytest.mark.parametrize('begin_ms', [0, 7])
@pytest.mark.parametrize('values', [{}, PARTS], ids=['file', 'parts'])
def test_a_replay_has_the_recorded_origin_and_so_the_same_bytes(tmp_path, begin_ms, values):
    source = record(tmp_path / 'run.mcap', ORIGIN_NS, begin_ms, **values)
    result = replay(source, tmp_path / 'again.mcap')
    assert result.identical, result.difference
    again = Recording(result.output)
    assert len(again.files) == (3 if values else 1)
    assert again.time_origin_ns == ORIGIN_NS
    alone = replay(again.files[-1], tmp_path / 'alone.mcap')
    assert alone.identical, alone.difference


def test_a_difference_is_told_in_simulated_time(runs: tuple[Path, Path], tmp_path: Path):
    later = Recording(record(tmp_path / 'later.mcap', ORIGIN_NS, begin_ms=7))
    difference = compare_data(later, Recording(runs[1]))
    assert difference is not None
    assert (difference.what, difference.time_s) == ('time', 0.007)


def test_a_recording_of_another_program_takes_the_origin_from_info(tmp_path: Path):
    channels = [
        Channel('/left/stickslip_drive/info', STRING, Qos(1)),
        Channel('/left/position', POINT_STAMPED, Qos(1)),
        Channel('/left/voltage', FLOAT64, Qos(1)),
    ]
    with Recorder(tmp_path / 'bag.mcap', channels) as recorder:
        come_ns = ORIGIN_NS + 3 * MS_NS
        info = cdr.pack_string(info_json(Parameters(), ORIGIN_NS))
        recorder.put('/left/stickslip_drive/info', come_ns, info)
        point = cdr.pack_stamped(ORIGIN_NS + MS_NS, '', (0.0, 0.0, 0.0))
        recorder.put('/left/position', come_ns, point)
        recorder.put('/left/voltage', come_ns, cdr.pack_float64(1.0))
    recording = Recording(tmp_path / 'bag.mcap')
    assert recording.series('position').time_s.tolist() == [0.001]
    assert recording.series('voltage').time_s.tolist() == [0.001]  # it came with this position


def test_a_bag_of_two_drives_takes_the_origin_that_was_told_first(tmp_path: Path):
    topics = [f'/{name}/stickslip_drive/info' for name in ('left', 'right')]
    with Recorder(
        tmp_path / 'bag.mcap', [Channel(each, STRING, Qos(1)) for each in topics]
    ) as bag:
        for late, topic in enumerate(reversed(topics)):
            told = info_json(Parameters(), ORIGIN_NS + late)
            bag.put(topic, ORIGIN_NS + MS_NS + late, cdr.pack_string(told))
    recording = Recording(tmp_path / 'bag.mcap')
    assert not recording.is_ours
    assert recording.time_origin_ns == ORIGIN_NS


def test_an_info_with_parameters_nested_too_deep_is_of_no_drive(tmp_path: Path):
    deep = '[' * 400 + ']' * 400
    own = f'"sim.seed": 1, "sim.dt": 1e-6, "a": {deep}'
    text = f'{{"versions": {{}}, "time_origin_ns": 5, "parameters": {{{own}}}}}'
    with Recorder(tmp_path / 'bag.mcap', [Channel('/robot/info', STRING, Qos(1))]) as bag:
        bag.put('/robot/info', 9, cdr.pack_string(text))
    assert not Recording(tmp_path / 'bag.mcap').is_ours


@pytest.mark.parametrize(
    'text',
    [
        '{"a": 1}',
        '[' * 5000,
        'no JSON',
        *(f'{{"time_origin_ns": {each}}}' for each in ('"soon"', '1e999', 10**30, -1, 1.5)),
    ],
)
def test_an_info_of_another_kind_tells_no_origin(tmp_path: Path, text: str):
    with Recorder(tmp_path / 'bag.mcap', [Channel('/robot/info', STRING, Qos(1))]) as recorder:
        recorder.put('/robot/info', 5, cdr.pack_string(text))
    [(_, time_ns, _)] = Recording(tmp_path / 'bag.mcap').messages()
    assert time_ns == 5
