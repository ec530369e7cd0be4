# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The node records what it says and hears, and other people's tools read it."""

import itertools
import math
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml
from held_disk import HeldDisk
from mcap.reader import make_reader
from reports import ERROR, Reports, values_of

from stickslip_ros.errors import RecordingError
from stickslip_ros.interface.topics import COMMAND_TOPICS, READINGS, recorded_channels
from stickslip_ros.lab.cli.recording import describe_recording
from stickslip_ros.lab.runs.replay import replay
from stickslip_ros.parameters import Parameters
from stickslip_ros.recording.reader import Recording

RECORDED = {key: channel.topic for key, channel in recorded_channels(Parameters()).items()}


COMMANDS: tuple[tuple[str, Any], ...] = (
    ('sawtooth', (300.0, 500.0, 20.0)),
    ('load', 0.1),
    ('preload', 0.51),
    ('voltage', 40.0),
    ('voltage', 400.0),
    ('steps', 2),
    ('jog', 0.0),
    ('position', math.nan),
    ('joint', math.inf),
    ('waveform', ((0.0, 1.0),)),
)


def record_a_session(stand: Any) -> Path:
    """Record each command, refused or not, then a service; give the file."""
    operator = stand.operator
    answer = operator.set_recording(wanted=True)
    assert answer.success
    for name, value in COMMANDS:
        seen = len(operator.events)
        operator.command(name, value)
        operator.wait_for_event(name, seen)
    operator.trigger('reset')
    operator.wait_for_event('reset', 0)
    ended = operator.set_recording(wanted=False)
    assert ended.success
    assert ended.message == answer.message
    return Path(answer.message)


@pytest.mark.usefixtures('default_blocks')
def test_a_recording_opens_and_is_of_the_live_topics(stand: Any, tmp_path: Path):
    path = record_a_session(stand)
    assert path.parent == tmp_path
    assert path.match('run_*.mcap')
    recording = Recording(path)
    assert set(recording.types) == set(RECORDED.values())
    assert {channel.gaps for channel in recording.channels} == {0}
    counts = {channel.topic: channel.messages for channel in recording.channels}
    assert counts['/command/voltage'] == 2
    assert counts['/command/sawtooth'] == counts['/command/load'] == 1
    assert counts['/command/preload'] == 1
    assert counts['/stickslip_drive/info'] == 1
    assert counts['/position'] == counts['/force'] > 40
    assert recording.metadata['stickslip_recorder']['written'] == str(sum(counts.values()))
    node = stand.operator.node
    with path.open('rb') as stream:
        summary = make_reader(stream).get_summary()
    stored = {channel.topic: channel for channel in summary.channels.values()}
    for topic in (*COMMAND_TOPICS, *READINGS):
        if topic.key not in RECORDED:
            continue
        is_read = topic in READINGS
        get = (
            node.get_publishers_info_by_topic if is_read else node.get_subscriptions_info_by_topic
        )
        [live] = [each for each in get(topic.full_name()) if each.node_name == 'stickslip_drive']
        channel = stored[topic.full_name()]
        assert summary.schemas[channel.schema_id].name == live.topic_type
        assert channel.metadata['topic_type_hash'] == str(live.topic_type_hash)
        [profile] = yaml.safe_load(channel.metadata['offered_qos_profiles'])
        assert profile['reliability'] == live.qos_profile.reliability.value
        assert profile['durability'] == live.qos_profile.durability.value
        assert profile['liveliness'] == live.qos_profile.liveliness.value
        assert profile['depth'] == topic.offered_qos(stand.drive.session.parameters).depth
        for name in ('deadline', 'lifespan', 'liveliness_lease_duration'):
            duration_ns = profile[name]['sec'] * 10**9 + profile[name]['nsec']
            assert duration_ns == getattr(live.qos_profile, name).nanoseconds


def test_the_answer_says_why_recording_does_not_start_or_end(stand: Any):
    operator = stand.operator
    answer = operator.set_recording(wanted=False)
    assert (answer.success, answer.message) == (False, 'set_recording refused: not recording')
    assert operator.set_recording(wanted=True).success
    answer = operator.set_recording(wanted=True)
    assert (answer.success, answer.message) == (False, 'set_recording refused: already recording')
    assert operator.set_recording(wanted=False).success


@pytest.mark.parametrize('flush_period_s', [0.1, 60.0], ids=['meanwhile', 'at the end'])
def test_a_deleted_recording_has_failed_and_the_drive_goes_on(
    start_drive: Callable, tmp_path: Path, flush_period_s: float
):
    folder = tmp_path / 'runs'
    values = {'record.directory': str(folder), 'record.flush_period': flush_period_s}
    stand = start_drive(values)
    reports = Reports(stand)
    assert stand.operator.set_recording(wanted=True).success
    shutil.rmtree(folder)
    if flush_period_s < 1.0:
        stand.operator.wait_for_event('recording', 0)
        reports.await_part('recorder', lambda part: part.message.startswith('stopped: '))
    answer = stand.operator.set_recording(wanted=False)
    assert not answer.success
    assert 'it was deleted, moved or replaced while it was written' in answer.message
    event = stand.operator.wait_for_event('recording', 0)
    assert event['result'] == 'RECORDING_FAILED'
    assert stand.operator.set_recording(wanted=True).success
    assert stand.operator.set_recording(wanted=False).success
    assert [each['command'] for each in stand.operator.events] == ['recording']


def test_a_recording_in_parts_is_told_by_names_that_exist(start_drive, tmp_path, capfd):
    values = {'record.split_duration': 0.1, 'record.flush_period': 0.1, 'record.name': 'run'}
    stand = start_drive(values)
    assert stand.operator.set_recording(wanted=True).message == f'{tmp_path}/run_0.mcap'
    stand.operator.spin_for(0.25)
    parts = stand.operator.set_recording(wanted=False).message
    first, last = parts.split(' to ')
    assert first == f'{tmp_path}/run_0.mcap'
    files = sorted(tmp_path.glob('run_*.mcap'), key=lambda file: int(file.stem[4:]))
    assert files[-1].name == last
    counts = [channel.messages for file in files for channel in Recording(file).channels]
    assert f'recorded {parts}: {sum(counts)} messages, 0 dropped' in capfd.readouterr().err


def test_a_drive_that_keeps_its_last_parts_is_replayed_from_the_oldest_of_them(
    start_drive: Callable, tmp_path: Path
):
    values = {'record.split_duration': 0.1, 'record.flush_period': 0.1, 'record.keep_parts': 2}
    stand = start_drive({**values, 'record.name': 'run', 'record.trace': False})
    stand.operator.set_recording(wanted=True)
    stand.operator.command('sawtooth', (300.0, 500.0, 0.0))
    stand.operator.spin_until((tmp_path / 'run_3.mcap').exists, 'the fourth part')
    stand.operator.set_recording(wanted=False)
    assert len(list(tmp_path.glob('run_*.mcap'))) == 2
    run = Recording(tmp_path / 'run.mcap')
    assert run.series('position').time_s[0] > 0.15
    assert replay(tmp_path / 'run.mcap', tmp_path / 'again.mcap').identical


def test_a_recording_of_a_drive_in_a_namespace_is_named_after_it(start_drive: Callable):
    stand = start_drive(namespace='/left')
    path = Path(stand.operator.set_recording(wanted=True).message)
    assert path.match('run_2*_left.mcap')
    assert stand.operator.set_recording(wanted=False).message == str(path)


def test_an_existing_file_is_not_overwritten(start_drive: Callable, tmp_path: Path):
    file = tmp_path / 'kept.mcap'
    file.write_bytes(b'mine')
    stand = start_drive({'record.on_start': True, 'record.name': 'kept.mcap'}, wait=False)
    operator = stand.operator
    assert operator.state() == 'inactive'
    assert operator.set_parameter('record.on_start', value=False).successful
    assert operator.change_state('activate')
    answer = operator.set_recording(wanted=True)
    why = f'{file}: it exists and is not overwritten; choose another name'
    assert (answer.success, answer.message) == (False, f'set_recording refused: {why}')
    assert file.read_bytes() == b'mine'
    file.unlink()
    assert operator.set_recording(wanted=True).success


@pytest.mark.parametrize('transition', ['deactivate', 'shutdown'])
def test_leaving_the_active_state_finishes_the_recording(start_drive, tmp_path, transition):
    stand = start_drive({'record.on_start': True, 'record.name': 'run.mcap'})
    session = stand.drive.session
    assert stand.operator.change_state(transition)
    recording = Recording(tmp_path / 'run.mcap')
    counts = {channel.topic: channel.messages for channel in recording.channels}
    assert counts['/position'] == session.bench.time_ns // session.parameters.block_ns
    assert {channel.gaps for channel in recording.channels} == {0}
    assert recording.series('position').time_s[0] == session.parameters.sim.block
    event = stand.operator.wait_for_event('recording', 0)
    assert (event['result'], event['message']) == ('DONE', f'{tmp_path}/run.mcap')
    assert event['stamp_ns'] == recording.time_origin_ns + session.bench.time_ns


@pytest.mark.usefixtures('default_blocks')
def test_as_fast_as_possible_waits_for_the_disk_and_loses_nothing(start_drive, tmp_path):
    stand = start_drive(
        {
            'sim.real_time_factor': 0.0,
            'record.queue_length': 10,
            'record.on_start': True,
            'record.name': 'fast.mcap',
        }
    )
    session = stand.drive.session
    stand.operator.spin_until(lambda: session.bench.time_ns > 10**9, 'a second')
    stand.operator.set_recording(wanted=False)
    recording = Recording(tmp_path / 'fast.mcap')
    assert {channel.gaps for channel in recording.channels} == {0}
    position = recording.series('position')
    assert len(position) == round(position.time_s[-1] * 1e3) >= 1000


def test_the_answer_names_the_file_wherever_it_is_read(start_drive, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    stand = start_drive({'record.directory': 'here', 'record.name': 'run'})
    for wanted in (True, False):
        answer = stand.operator.set_recording(wanted=wanted)
        assert answer.message == str(tmp_path / 'here' / 'run.mcap')
    assert Recording(answer.message).metadata


def test_beside_a_disk_that_stands_still_only_readings_are_lost_and_log_and_info_name_them(
    start_drive: Callable,
    held_disk: HeldDisk,
    frequent_diagnostics: None,
    capfd: pytest.CaptureFixture[str],
):
    stand = start_drive({'record.queue_length': 10, 'record.name': 'run', 'sim.block': 1e-3})
    operator, log = stand.operator, ''
    path = Path(operator.set_recording(wanted=True).message)
    recorder = stand.drive.session.worker.writer.recorder
    held_disk.hold()
    held_disk.wait_for_writer()

    def lines(words: str) -> list[str]:
        nonlocal log
        log += capfd.readouterr().err
        return [each for each in log.splitlines() if words in each]

    operator.spin_until(lambda: len(lines('lacks readings')) >= 2, 'two warnings')
    for number in range(30):
        seen = len(operator.events)
        operator.command('voltage', 1.0 + number)
        operator.wait_for_event('voltage', seen)
    part = Reports(stand).next('recorder')
    told = values_of(part)
    assert (part.level, part.message) == (ERROR, f'{told["dropped"]} dropped')
    assert ' of /position' in told['losses']
    warnings = lines('lacks readings')
    counts = [int(each.partition('lacks readings, ')[2].split()[0]) for each in warnings]
    assert all(later >= 2 * earlier for earlier, later in itertools.pairwise(counts))
    assert all('[WARN]' in each and ' of /position' in each for each in warnings)
    held_disk.release()
    assert operator.set_recording(wanted=False).success
    operator.spin_until(lambda: bool(lines(f'recorded {path}')), 'the last line')
    [end] = lines(f'recorded {path}')
    assert '[WARN]' in end
    assert f'messages, {recorder.dropped} dropped: ' in end
    recording = Recording(path)
    sent = [(topic, each) for topic, _, each in recording.messages(['command/voltage'])]
    assert sent == [('/command/voltage', 1.0 + number) for number in range(30)]
    counts_of = {each.topic: each.messages for each in recording.channels}
    assert counts_of['/stickslip_drive/event'] == 30
    with path.open('rb') as stream:
        read = make_reader(stream).iter_messages(log_time_order=False)
        times = [each.log_time for _, _, each in read]
    assert times == sorted(times)
    notes = describe_recording(recording)['notes']
    [position] = [each for each in notes if ' of /position ' in each]
    assert re.fullmatch(r'lacks \d+ messages of /position between \S+ s and \S+ s', position)
    with pytest.raises(RecordingError, match=r'lacks \d+ messages of .* between .*queue_length'):
        replay(path, path.with_name('again.mcap'))
