"""The node records what it says and hears, and other people's tools read it."""

import json
import math
import shutil
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rclpy.serialization import deserialize_message
from rosbags.highlevel import AnyReader

from stickslip_ros.interface.messages import ArrayMessage, StampedMessage
from stickslip_ros.interface.topics import COMMAND_TOPICS, READINGS, recorded_channels
from stickslip_ros.parameters import Parameters, parse_yaml
from stickslip_ros.recording.reader import Recording
from stickslip_ros.ros.interface import MESSAGE_TYPES

RECORDED = {key: channel.topic for key, channel in recorded_channels(Parameters()).items()}
#: A tick long enough that no reading is lost on its way to a busy operator: 100 are kept for it.
UNHURRIED = {'sim.block': 0.01}
#: One command on each topic that a session leaves out; refused or not, it is recorded.
MORE = (
    ('steps', 2),
    ('jog', 0.0),
    ('position', math.nan),
    ('joint', math.inf),
    ('waveform', ((0.0, 1.0),)),
)
LOAD_N = 0.1
PRELOAD_N = 0.51
AMPLITUDE_V, FREQUENCY_HZ, STEPS = 300.0, 500.0, 20.0


def record_a_session(stand: Any, *more: tuple[str, Any]) -> Path:
    """Record a bit of everything, then more commands; give the file."""
    operator = stand.operator
    answer = operator.set_recording(wanted=True)
    assert answer.success
    operator.command('sawtooth', (AMPLITUDE_V, FREQUENCY_HZ, STEPS))
    operator.wait_for_event('sawtooth', 0)
    operator.command('load', LOAD_N)
    operator.wait_for_event('load', 0)
    operator.command('preload', PRELOAD_N)
    operator.wait_for_event('preload', 0)
    operator.command('voltage', 40.0)
    operator.wait_for_event('voltage', 0)
    operator.command('voltage', 400.0)
    operator.wait_for_event('voltage', len(operator.events))
    for name, value in more:
        operator.command(name, value)
        operator.wait_for_event(name, 0)
    operator.trigger('reset')
    operator.wait_for_event('reset', 0)
    ended = operator.set_recording(wanted=False)
    assert ended.success
    assert ended.message == answer.message
    return Path(answer.message)


def test_a_recording_ends_with_its_name_and_opens(stand: Any, tmp_path: Path):
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


def test_the_answer_says_why_recording_does_not_start_or_end(stand: Any):
    operator = stand.operator
    answer = operator.set_recording(wanted=False)
    assert (answer.success, answer.message) == (False, 'set_recording refused: not recording')
    assert operator.set_recording(wanted=True).success
    answer = operator.set_recording(wanted=True)
    assert (answer.success, answer.message) == (False, 'set_recording refused: already recording')
    assert operator.set_recording(wanted=False).success


def test_two_recordings_without_a_name_are_two_files(stand: Any, tmp_path: Path):
    paths = []
    for _ in range(2):
        paths.append(stand.operator.set_recording(wanted=True).message)
        stand.operator.set_recording(wanted=False)
    assert sorted(map(str, tmp_path.glob('*.mcap'))) == sorted(paths)
    starts = [
        {channel.topic: channel.first_ns for channel in Recording(path).channels} for path in paths
    ]
    info = '/stickslip_drive/info'
    assert starts[0][info] < starts[1][info]


@pytest.mark.parametrize('flush_period_s', [0.1, 60.0], ids=['meanwhile', 'at the end'])
def test_a_deleted_recording_has_failed_and_the_drive_goes_on(
    start_drive: Callable, tmp_path: Path, flush_period_s: float
):
    folder = tmp_path / 'runs'
    values = {'record.directory': str(folder), 'record.flush_period': flush_period_s}
    stand = start_drive(values)
    assert stand.operator.set_recording(wanted=True).success
    shutil.rmtree(folder)
    if flush_period_s < 1.0:
        stand.operator.wait_for_event('recording', 0)
    answer = stand.operator.set_recording(wanted=False)
    assert not answer.success
    assert 'it was deleted, moved or replaced while it was written' in answer.message
    event = stand.operator.wait_for_event('recording', 0)
    assert event['result'] == 'RECORDING_FAILED'
    assert stand.operator.set_recording(wanted=True).success
    assert stand.operator.set_recording(wanted=False).success
    assert [each['command'] for each in stand.operator.events] == ['recording']


def test_a_recording_in_parts_is_told_by_names_that_exist(
    start_drive: Callable, tmp_path: Path, capfd: pytest.CaptureFixture[str]
):
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


def test_an_existing_file_is_not_overwritten(start_drive: Callable, tmp_path: Path):
    file = tmp_path / 'kept.mcap'
    file.write_bytes(b'mine')
    stand = start_drive({'record.name': 'kept.mcap'})
    answer = stand.operator.set_recording(wanted=True)
    assert not answer.success
    assert answer.message == (
        f'set_recording refused: {file}: it exists and is not overwritten; choose another name'
    )
    assert file.read_bytes() == b'mine'
    assert stand.drive.session.worker.writer is None
    stand.operator.command('voltage', 10.0)
    assert stand.operator.wait_for_event('voltage', 0)['result'] == 'DONE'


def test_record_on_start_records_from_time_zero(start_drive: Callable, tmp_path: Path):
    stand = start_drive({'record.on_start': True, 'record.name': 'all.mcap'})
    stand.operator.set_recording(wanted=False)
    position = Recording(tmp_path / 'all.mcap').series('position')
    assert position.time_s[0] == pytest.approx(1e-3)
    assert len(position) == round(position.time_s[-1] / 1e-3)


def test_record_on_start_over_an_existing_file_leaves_the_node_inactive(
    start_drive: Callable, tmp_path: Path
):
    (tmp_path / 'kept.mcap').write_bytes(b'mine')
    stand = start_drive({'record.on_start': True, 'record.name': 'kept.mcap'}, wait=False)
    assert stand.operator.state() == 'inactive'
    (tmp_path / 'kept.mcap').unlink()
    assert stand.operator.change_state('activate')
    assert stand.operator.state() == 'active'


@pytest.mark.parametrize('transition', ['deactivate', 'shutdown'])
def test_leaving_the_active_state_finishes_the_recording(
    start_drive: Callable, tmp_path: Path, transition: str
):
    stand = start_drive({'record.on_start': True, 'record.name': 'run.mcap'})
    session = stand.drive.session
    assert stand.operator.change_state(transition)
    recording = Recording(tmp_path / 'run.mcap')
    counts = {channel.topic: channel.messages for channel in recording.channels}
    assert counts['/position'] == session.bench.time_ns // session.parameters.block_ns
    assert {channel.gaps for channel in recording.channels} == {0}


def test_topics_of_a_recording_carry_the_namespace(start_drive: Callable):
    stand = start_drive(namespace='/left')
    path = stand.operator.set_recording(wanted=True).message
    stand.operator.set_recording(wanted=False)
    assert set(Recording(path).types) == {f'/left{name}' for name in RECORDED.values()}


def test_rosbags_and_mcap_ros2_and_rclpy_decode_every_message(stand: Any):
    path = record_a_session(stand, *MORE)
    ours = Counter(topic for topic, _, _ in Recording(path).messages())
    with AnyReader([path]) as reader:
        theirs = Counter(
            each.topic
            for each, _, data in reader.messages()
            if getattr(reader.deserialize(data, each.msgtype), '__msgtype__', '') == each.msgtype
        )
    with path.open('rb') as stream:
        decoded = list(
            make_reader(stream, decoder_factories=[DecoderFactory()]).iter_decoded_messages()
        )
    positions = {}
    for schema, channel, message, seen in decoded:
        rcl = deserialize_message(message.data, MESSAGE_TYPES[schema.name])
        if channel.topic == '/position':
            positions[message.log_time] = (rcl.point.x, seen.point.x)
    assert theirs == ours == Counter(channel.topic for _, channel, _, _ in decoded)
    assert all(rcl == seen for rcl, seen in positions.values())
    assert set(ours) == set(RECORDED.values())


def test_types_hashes_and_quality_of_service_are_those_of_the_live_topics(stand: Any):
    path = record_a_session(stand)
    node = stand.operator.node
    with path.open('rb') as stream:
        summary = make_reader(stream).get_summary()
    stored = {channel.topic: channel for channel in summary.channels.values()}
    for topic in (*COMMAND_TOPICS, *READINGS):
        if topic.key not in RECORDED:
            continue
        get = (
            node.get_subscriptions_info_by_topic
            if topic in COMMAND_TOPICS
            else node.get_publishers_info_by_topic
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


def test_positions_on_the_topic_are_those_in_the_file_to_the_bit(start_drive: Callable):
    stand = start_drive(UNHURRIED)
    path = record_a_session(stand)
    recorded = {
        time_ns: message.values[0]
        for _, time_ns, message in Recording(path).messages(['/position'])
        if isinstance(message, StampedMessage)
    }
    operator = stand.operator
    operator.spin_until(lambda: operator.time_ns >= max(recorded), 'the last position')
    heard = {time: operator.positions.get(time) for time in recorded}
    assert len(recorded) >= 6
    assert heard == recorded


def test_commands_are_in_the_file_at_the_tick_of_their_effect(stand: Any):
    path = record_a_session(stand)
    messages = list(Recording(path).messages())
    events = [json.loads(str(m)) for topic, _, m in messages if topic == RECORDED['event']]
    at_ns = {e['command']: e['time_ns'] for e in events if e['result'] == 'DONE'}
    refused = [e for e in events if e['result'] == 'INVALID_PARAMETER']
    commands = [(topic, t, m) for topic, t, m in messages if topic.startswith('/command/')]
    block_ns = stand.drive.session.parameters.block_ns
    assert {t % block_ns for _, t, _ in commands} == {0}
    [sawtooth] = [(t, m) for topic, t, m in commands if topic == '/command/sawtooth']
    assert isinstance(sawtooth[1], ArrayMessage)
    assert sawtooth[1].data.tolist() == [AMPLITUDE_V, FREQUENCY_HZ, STEPS]
    lasts_ns = round(STEPS / FREQUENCY_HZ * 1e9)
    assert lasts_ns <= at_ns['sawtooth'] - sawtooth[0] <= lasts_ns + block_ns
    [load] = [(t, m) for topic, t, m in commands if topic == '/command/load']
    assert isinstance(load[1], StampedMessage)
    assert load[1].values == (LOAD_N, 0.0, 0.0, 0.0, 0.0, 0.0)
    assert load[1].stamp_ns == 0  # its sender gave none
    assert load[0] == at_ns['load']  # a load is done when it is taken
    voltages = [(t, m) for topic, t, m in commands if topic == '/command/voltage']
    assert [m for _, m in voltages] == [40.0, 400.0]
    assert at_ns['voltage'] == voltages[0][0] + block_ns  # reached within one update
    assert [each['time_ns'] for each in refused] == [voltages[1][0]]


def test_times_in_the_file_never_fall_and_begin_with_info_and_status(stand: Any):
    path = record_a_session(stand)
    with path.open('rb') as stream:
        in_file_order = [
            (channel.topic, message.log_time, message.publish_time)
            for _, channel, message in make_reader(stream).iter_messages(log_time_order=False)
        ]
    times = [log_time for _, log_time, _ in in_file_order]
    assert times == sorted(times)
    assert times == [publish_time for *_, publish_time in in_file_order]
    assert [topic for topic, *_ in in_file_order[:2]] == [RECORDED['info'], RECORDED['status']]


def test_the_file_keeps_parameters_seed_and_versions(start_drive: Callable):
    stand = start_drive({'stand.preload': 0.25, 'sim.seed': 7})
    path = stand.operator.set_recording(wanted=True).message
    stand.operator.set_recording(wanted=False)
    recording = Recording(path)
    media_type, text = recording.attachments['parameters.yaml']
    assert media_type == 'application/yaml'
    assert parse_yaml(text.decode(), 'file') == stand.drive.session.parameters
    run = recording.metadata['stickslip_run']
    assert (run['seed'], run['dt_s']) == ('7', '5e-06')
    assert {'numpy', 'numba', 'stickslip_ros', 'wall_start'} <= run.keys()


def test_as_fast_as_possible_waits_for_the_disk_and_loses_nothing(
    start_drive: Callable, tmp_path: Path
):
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


def test_the_answer_names_the_file_wherever_it_is_read(
    start_drive: Callable, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(tmp_path)
    stand = start_drive({'record.directory': 'here', 'record.name': 'run'})
    for wanted in (True, False):
        answer = stand.operator.set_recording(wanted=wanted)
        assert answer.message == str(tmp_path / 'here' / 'run.mcap')
    assert Recording(answer.message).metadata
