# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A recording tells what is in it, and a broken one tells what is wrong."""

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.writer import CompressionType
from mcap_records import WITHOUT_INDEX, foreign, foreign_numbers
from written_messages import written

from stickslip_ros.budget import NAMES_MOST
from stickslip_ros.errors import RecordingError, StickSlipError, UnknownName, WrongKind
from stickslip_ros.interface import cdr
from stickslip_ros.interface.channels import Channel, Qos
from stickslip_ros.message_types import (
    FLOAT64,
    FLOAT64_ARRAY,
    INT32,
    POINT_STAMPED,
    WRENCH_STAMPED,
)
from stickslip_ros.recording import reader
from stickslip_ros.recording.layout import FileForm
from stickslip_ros.recording.reader import ChannelSummary, Recording
from stickslip_ros.recording.recorder import Recorder
from stickslip_ros.recording.recover import recover

Run = list[tuple[str, int, bytes]]
MS_NS = 1_000_000


@pytest.fixture
def recording(recorded: Path) -> Recording:
    return Recording(recorded)


@pytest.fixture(scope='module')
def damaged(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp('damaged') / 'run.mcap'


def read_all(path: Path) -> None:
    content_of(path)
    Recording(path).trace()


def content_of(path: Path) -> tuple:
    recording = Recording(path)
    messages = [(topic, at, repr(each)) for topic, at, each in recording.messages()]
    return recording.channels, recording.metadata, recording.attachments, messages


def test_messages_come_back_in_the_order_of_their_times(recording, run, channels):
    types = {each.topic: each.type_name for each in channels}
    expected = [(topic, at, written(cdr.unpack(types[topic], data))) for topic, at, data in run]
    assert [(topic, at, written(each)) for topic, at, each in recording.messages()] == expected


def test_messages_of_chosen_topics_come_alone(recording: Recording):
    messages = list(recording.messages(['event', '/stand/command/steps']))
    assert messages == [
        ('/stand/command/steps', 19 * MS_NS, -3),
        ('/stand/drive/event', 19 * MS_NS, '{"result": "SUCCEEDED"}'),
    ]


def test_descriptions_and_attached_files_come_back(recording: Recording):
    assert recording.metadata['stickslip_run'] == {'seed': '7', 'specimen': 'steel µ'}
    assert recording.attachments == {'parameters.yaml': ('application/yaml', b'seed: 7\n')}


def test_channels_tell_counts_times_and_rates(recording: Recording):
    channels = {each.topic: each for each in recording.channels}
    force = ChannelSummary('/stand/force', WRENCH_STAMPED, 20, 0, 19 * MS_NS, 0)
    assert channels['/stand/force'] == force
    assert force.rate_hz == pytest.approx(1000.0, rel=1e-12)
    assert channels['/stand/voltage'].rate_hz == pytest.approx(100.0, rel=1e-12)


def test_a_topic_with_one_message_or_none_has_no_rate(tmp_path: Path):
    channels = [Channel('/one', INT32, Qos(1)), Channel('/none', INT32, Qos(1))]
    with Recorder(tmp_path / 'run.mcap', channels) as recorder:
        recorder.put('/one', 5, cdr.pack_int32(1))
    one, none = Recording(tmp_path / 'run.mcap').channels
    assert (one.first_ns, one.last_ns, one.rate_hz) == (5, 5, 0.0)
    assert (none.first_ns, none.last_ns, none.rate_hz) == (None, None, 0.0)


def test_a_recording_without_messages_opens(tmp_path: Path):
    Recorder(tmp_path / 'run.mcap', [Channel('/trace', FLOAT64_ARRAY, Qos(1))]).close()
    recording = Recording(tmp_path / 'run.mcap')
    assert list(recording.messages()) == []
    assert recording.trace() == {}
    with pytest.raises(UnknownName, match='this recording has no samples'):
        recording.series('trace')


@pytest.mark.parametrize(
    ('topic', 'field', 'unit', 'last'),
    [
        ('position', '', 'm', 19e-9),
        ('/stand/position', 'y', 'm', 0.0),
        ('truth/position', 'x', 'm', -1.0),
        ('force', '', 'N', -19.0),
        ('force', 'torque.z', 'N m', 0.5),
        ('voltage', '', 'V', 100.0),
        ('status', 'data', '', 5.0),
        ('steps', '', '', -3.0),
        ('joint_states', '', 'm', 10e-9),
        ('joint_states', 'effort', 'N', -10.0),
        ('trace', '', 'V', 2 * 19e-3),
        ('trace', 'force', 'N', 5 * 19e-3),
    ],
)
def test_a_quantity_is_asked_for_by_topic_and_field(recording, topic, field, unit, last):
    series = recording.series(topic, field)
    assert series.unit == unit
    assert series.value[-1] == pytest.approx(last, rel=1e-12, abs=0)


def test_a_quantity_of_a_joint_that_the_messages_do_not_have_is_refused(recording: Recording):
    with pytest.raises(
        WrongKind, match=r'velocity \(\) is not the number of one joint; read a topic'
    ):
        recording.series('joint_states', 'velocity')


def test_a_point_is_placed_at_its_own_stamp_and_a_number_at_its_log_time(tmp_path: Path):
    channels = [Channel('/p', POINT_STAMPED, Qos(1)), Channel('/u', FLOAT64, Qos(1))]
    with Recorder(tmp_path / 'run.mcap', channels) as recorder:
        recorder.put('/p', 2_500_000_000, cdr.pack_stamped(1_500_000_000, '', (0, 0, 0)))
        recorder.put('/u', 2_500_000_000, cdr.pack_float64(0.0))
    recording = Recording(tmp_path / 'run.mcap')
    assert recording.series('p').time_s.tolist() == [1.5]
    assert recording.series('u').time_s.tolist() == [2.5]


def test_the_blocks_of_a_trace_are_joined(recording: Recording):
    columns = recording.trace()
    assert list(columns) == ['voltage', 'foot', 'position', 'force']
    assert [each.unit for each in columns.values()] == ['V', 'm', 'm', 'N']
    np.testing.assert_allclose(columns['foot'].time_s, np.arange(20) * 1e-3, rtol=1e-12)
    np.testing.assert_array_equal(columns['foot'].value, 3.0 * columns['foot'].time_s)


def test_a_quantity_tells_its_origin(recording: Recording):
    assert recording.series('position').origin == 'run.mcap /stand/position'
    assert recording.series('trace', 'foot').origin == 'run.mcap /stand/trace foot'


def test_a_wrong_name_is_answered_with_the_right_ones(recording: Recording):
    with pytest.raises(UnknownName, match='/stand/voltage'):
        recording.series('volts')
    with pytest.raises(UnknownName, match='has x, y, z'):
        recording.series('position', 'w')
    with pytest.raises(UnknownName, match='has no numbers'):
        recording.series('event')
    with pytest.raises(UnknownName, match='has voltage, foot, position, force'):
        recording.series('trace', 'foots')


def test_an_ending_means_the_topic_in_the_fewest_namespaces(tmp_path: Path):
    channels = [Channel('/a/b/u', FLOAT64, Qos(1)), Channel('/laboratory/u', FLOAT64, Qos(1))]
    Recorder(tmp_path / 'run.mcap', channels).close()
    assert Recording(tmp_path / 'run.mcap').series('u').origin == 'run.mcap /laboratory/u'


def test_an_ending_that_two_topics_share_is_refused(tmp_path: Path):
    channels = [Channel(f'/{stand}/u', FLOAT64, Qos(1)) for stand in 'ab']
    Recorder(tmp_path / 'run.mcap', channels).close()
    with pytest.raises(RecordingError, match='u may be /a/u or /b/u'):
        Recording(tmp_path / 'run.mcap').series('u')


def test_topics_of_unknown_types_are_passed_over_unless_asked_for(tmp_path: Path):
    writer = foreign(tmp_path / 'run.mcap')
    schema = writer.register_schema('std_msgs/msg/Float64', 'ros2msg', b'float64 data')
    number = writer.register_channel('/u', 'cdr', schema)
    note = writer.register_channel('/note', 'json', 0)
    writer.add_message(number, 2, cdr.pack_float64(1.5), 2)
    writer.add_message(note, 3, b'{}', 3)
    writer.finish()
    recording = Recording(tmp_path / 'run.mcap')
    assert list(recording.messages()) == [('/u', 2, 1.5)]
    with pytest.raises(UnknownName, match='message type'):
        list(recording.messages(['note']))


def test_a_run_of_many_topics_is_counted_message_by_message_to_the_same_end(recorded, monkeypatch):
    by_summary = Recording(recorded).channels
    assert len(by_summary) < reader.TOPICS_MOST
    monkeypatch.setattr(reader, 'TOPICS_MOST', len(by_summary))
    assert Recording(recorded).channels == by_summary


def test_more_records_of_metadata_than_names_are_allowed_are_not_read(tmp_path: Path):
    writer = foreign(tmp_path / 'run.mcap')
    for number in range(NAMES_MOST.most + 1):
        writer.add_metadata(f'{number}', {})
    writer.finish()
    with pytest.raises(
        RecordingError, match=r'run\.mcap: it asks for 4097 topics, types, entries'
    ):
        Recording(tmp_path / 'run.mcap')


@pytest.mark.parametrize(
    ('sequences', 'gaps'),
    [([4, 5, 6], 0), ([1, 4, 6], 3), ([0, 0, 0], None), ([2**32 - 1, 0, 2], 1), ([5, 3, 4], 0)],
    ids=['late start', 'losses', 'not numbered', 'wrapped', 'started anew'],
)
def test_gaps_are_the_numbers_that_are_missing(tmp_path: Path, sequences: list[int], gaps: int):
    path = foreign_numbers(tmp_path / 'run.mcap', [(0, each, 0.0) for each in sequences])
    assert Recording(path).channels[0].gaps == gaps


def test_a_missing_file_is_refused(tmp_path: Path):
    with pytest.raises(RecordingError, match='No such file or directory'):
        Recording(tmp_path / 'run.mcap')


def flipped(piece: bytes, mask: int = 0x01) -> Callable[[bytes], bytes]:
    """Give the damage of the last byte of the last place in which a piece stands."""

    def damage(content: bytes) -> bytes:
        at = content.rindex(piece) + len(piece) - 1
        return content[:at] + bytes([content[at] ^ mask]) + content[at + 1 :]

    return damage


HOSTILE: dict[str, tuple[bytes | Callable[[bytes], bytes], str]] = {
    'empty': (b'', 'it is not an MCAP file: it is empty'),
    'text': (b'time,position\n0,1\n' * 20, 'is not an MCAP file; name a recording that ends in'),
    'rosbag1': (b'#ROSBAG V2.0\n', 'it is a bag of ROS 1; "pip install rosbags"'),
    'sqlite3': (b'SQLite format 3\0' + bytes(84), 'it is damaged .* sqlite3 .* .recover'),
    'a wrong text': (flipped(b'steel'), 'the checksum of its data is wrong'),
    'a wrong attachment': (flipped(b'seed: 7'), 'the checksum of its data is wrong'),
    'a wrong profile': (lambda each: each.replace(b'ros2', b'ros3', 1), 'checksum of its data'),
    'a wrong summary': (flipped(b'/stand/voltage', 0xFF), 'checksum of its summary'),
    'a wrong number': (
        lambda each: each.replace(b'\x28\xb5\x2f\xfd', b'\x28\xb5\x2f\xfc', 1), 'it is damaged',
    ),
}  # fmt: skip


@pytest.mark.parametrize('kind', HOSTILE)
def test_a_file_that_is_not_whole_or_of_another_kind_is_refused(recorded, damaged, kind):
    content, refusal = HOSTILE[kind]
    damaged.write_bytes(content if isinstance(content, bytes) else content(recorded.read_bytes()))
    with pytest.raises(RecordingError, match=refusal):
        list(Recording(damaged).messages())


def test_a_directory_without_a_recording_is_refused(tmp_path: Path):
    with pytest.raises(RecordingError, match='it is a directory without a recording'):
        Recording(tmp_path)


@pytest.mark.parametrize('options', [WITHOUT_INDEX, {'use_chunking': False}])
def test_a_file_without_an_index_is_refused_and_recovered_with_one(tmp_path: Path, options):
    rows = [(7, 0, 1.5), (5, 1, 2.5)]
    path = foreign_numbers(tmp_path / 'run.mcap', rows, **options)
    with pytest.raises(RecordingError, match='no index of chunks; copy its messages with'):
        Recording(path)
    [recovery], written = recover(path)
    assert (recovery.messages, recovery.losses[0].problem[:9]) == (2, 'its index')
    assert Recording(written).series('u').value.tolist() == [2.5, 1.5]


@settings(derandomize=True, deadline=None, max_examples=100)
@given(st.data())
def test_a_file_that_was_cut_off_is_refused_wherever_it_was_cut(recorded, damaged, data):
    whole = recorded.read_bytes()
    damaged.write_bytes(whole[: data.draw(st.integers(8, len(whole) - 1))])
    with pytest.raises(RecordingError, match='its end is missing'):
        Recording(damaged)


@settings(derandomize=True, deadline=None, max_examples=300)
@given(st.data())
def test_damaged_bytes_are_refused_or_harmless_but_never_change_what_is_read(
    recorded: Path, damaged: Path, data: st.DataObject
):
    content = bytearray(recorded.read_bytes())
    content[data.draw(st.integers(0, len(content) - 1))] ^= data.draw(st.integers(1, 255))
    damaged.write_bytes(content)
    with suppress(StickSlipError):
        assert content_of(damaged) == content_of(recorded)


def test_a_damaged_head_of_a_chunk_never_crashes(recorded: Path, damaged: Path):
    whole = recorded.read_bytes()
    with recorded.open('rb') as stream:
        chunk = make_reader(stream).get_summary().chunk_indexes[0]
    head_bytes = chunk.chunk_length - chunk.compressed_size
    for index in range(chunk.chunk_start_offset, chunk.chunk_start_offset + head_bytes):
        damaged.write_bytes(whole[:index] + bytes([whole[index] ^ 0x80]) + whole[index + 1 :])
        with suppress(StickSlipError):
            read_all(damaged)


def test_a_wrong_number_in_a_chunk_without_compression_is_refused(tmp_path: Path):
    path = tmp_path / 'run.mcap'
    message = cdr.pack_float64(1.5)
    with Recorder(path, [Channel('/u', FLOAT64, Qos(1))], form=FileForm('none')) as recorder:
        recorder.put('/u', 0, message)
    path.write_bytes(path.read_bytes().replace(message, cdr.pack_float64(2.5)))
    with pytest.raises(RecordingError, match='the checksum of its data is wrong'):
        Recording(path)


def test_a_wrong_number_in_a_chunk_of_another_program_is_refused(tmp_path: Path):
    path = foreign_numbers(tmp_path / 'run.mcap', [(2, 0, 1.5)], compression=CompressionType.NONE)
    path.write_bytes(path.read_bytes().replace(cdr.pack_float64(1.5), cdr.pack_float64(2.5)))
    with pytest.raises(RecordingError, match='the checksum of a chunk is wrong'):
        list(Recording(path).messages())


def test_an_mcap_file_that_is_not_of_ros_is_refused(tmp_path: Path):
    foreign(tmp_path / 'run.mcap', 'x-camera').finish()
    with pytest.raises(RecordingError, match="profile 'x-camera', not a recording of ROS 2"):
        Recording(tmp_path / 'run.mcap')


def test_a_file_without_a_profile_is_known_by_its_schemas(tmp_path: Path):
    path = foreign_numbers(tmp_path / 'run.mcap', [(2, 0, 1.5)], profile='')
    [(_, _, message)] = Recording(path).messages()
    assert message == 1.5
    foreign(tmp_path / 'empty.mcap', '').finish()
    with pytest.raises(RecordingError, match="profile '', not a recording of ROS 2"):
        Recording(tmp_path / 'empty.mcap')
