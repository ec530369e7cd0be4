# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Messages become requests and requests messages, live and recorded; nonsense is refused."""

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from builtin_interfaces.msg import Time
from geometry_msgs.msg import PointStamped
from hypothesis import given
from hypothesis import strategies as st
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray, MultiArrayDimension

from stickslip_ros.errors import OutOfRange, RecordingError, WrongKind
from stickslip_ros.instrument.commands import COMMANDS, WAVEFORM_ROWS_MAX, Request
from stickslip_ros.instrument.joints import Joints
from stickslip_ros.instrument.reports import Status
from stickslip_ros.interface import cdr
from stickslip_ros.interface.channels import Channel, Qos
from stickslip_ros.interface.feed import Packed
from stickslip_ros.interface.requests import pack_command, pack_request, receive_request
from stickslip_ros.interface.topics import COMMAND_TOPICS
from stickslip_ros.message_types import FLOAT64, STRING
from stickslip_ros.parameters import Parameters
from stickslip_ros.recording.differences import compare_data, data_digest
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.recorder import Recorder
from stickslip_ros.recording.requests import recorded_requests
from stickslip_ros.recording.run import RunWriter
from stickslip_ros.ros.interface import MESSAGE_TYPES
from stickslip_ros.units import NS_PER_S

BY_NAME = {topic.request: topic for topic in COMMAND_TOPICS}

NUMBER = st.floats(allow_nan=False)
STAMPS_NS = st.integers(-(2**31) * NS_PER_S, 2**31 * NS_PER_S - 1)
FRAME = st.sampled_from(['', 'stage_base', 'camera'])
TAG = st.sampled_from(['', 'left', 'a#b'])


def numbers(count: int) -> st.SearchStrategy[tuple[float, ...]]:
    return st.tuples(*[NUMBER] * count)


ARRAY = st.lists(NUMBER, max_size=3).map(tuple)
NAMES = st.lists(st.sampled_from(['runner_joint', 'arm']), max_size=3).map(tuple)
JOINTS = st.builds(Joints, NAMES, ARRAY, ARRAY, ARRAY)
REQUESTS = st.one_of(
    st.builds(Request, st.sampled_from(['voltage', 'preload', 'jog']), numbers(1)),
    st.builds(Request, st.just('steps'), st.integers(-(2**31), 2**31 - 1).map(lambda n: (n,))),
    st.builds(Request, st.just('sawtooth'), st.lists(NUMBER, max_size=5).map(tuple), tag=TAG),
    st.builds(
        Request,
        st.just('waveform'),
        st.lists(NUMBER, max_size=9).map(tuple),
        cycles=st.integers(0, 2**32 - 1),
        tag=TAG,
    ),
    st.builds(
        Request, st.just('position'), numbers(3), stamp_ns=STAMPS_NS, frame_id=FRAME, tag=TAG
    ),
    st.builds(Request, st.just('load'), numbers(6), stamp_ns=STAMPS_NS, frame_id=FRAME, tag=TAG),
    st.builds(
        Request, st.just('joint'), stamp_ns=STAMPS_NS, frame_id=FRAME, joints=JOINTS, tag=TAG
    ),
    st.sampled_from([Request('stop'), Request('reset'), Request('clear_faults')]),
    st.just(Request('fault', settings=(('fault.dead_foot', 2), ('fault.load_cell', 'freeze')))),
)


def written(path: Path, requests: list[Request], voltage_v: float = 0.0) -> Recording:
    with RunWriter(path, Parameters(), wait=True) as writer:
        writer.begin(0, Status(0))
        for tick, request in enumerate(requests):
            writer.write(pack_request(request, tick))
        writer.write(Packed('voltage', len(requests), cdr.pack_float64(voltage_v)))
    return Recording(path)


@given(requests=st.lists(REQUESTS, max_size=6))
def test_requests_come_back_in_their_order_and_to_the_bit(tmp_path_factory, requests):
    recording = written(tmp_path_factory.mktemp('log') / 'run.mcap', requests)
    read = list(recorded_requests(recording))
    assert [each.time_ns for each in read] == list(range(len(requests)))
    back = [replace(each.request, values=tuple(each.request.values)) for each in read]
    assert back == requests


def test_topics_have_the_names_in_a_recording_that_they_always_had(tmp_path):
    names = written(tmp_path / 'run.mcap', []).metadata['stickslip_topics']
    topics = {name: json.loads(text)['topic'] for name, text in names.items()}
    assert (topics['voltage'], topics['piezo']) == ('/command/voltage', '/voltage')
    assert (topics['target'], topics['position']) == ('/command/position', '/position')
    others = 'sawtooth steps jog waveform load preload joint joint_states force trace status event'
    named = {'voltage', 'piezo', 'target', 'position', 'request', 'info', *others.split()}
    assert topics.keys() == named


def test_a_recording_that_is_no_run_has_no_requests(tmp_path):
    path = tmp_path / 'other.mcap'
    with Recorder(path, [Channel('/voltage', FLOAT64, Qos(1))]):
        pass
    with pytest.raises(RecordingError, match='does not say which topic is which'):
        list(recorded_requests(Recording(path)))


@pytest.mark.parametrize('text', ['[' * 5000, '"text"', '[]', '{}', '{"topic": 1}', '9' * 5000])
def test_what_a_recording_says_of_its_topics_is_not_believed(tmp_path: Path, text: str):
    path, said = tmp_path / 'run.mcap', {'position': text, 'request': text}
    Recorder(path, [Channel('/p', STRING, Qos(1))], metadata={'stickslip_topics': said}).close()
    with pytest.raises(RecordingError, match='does not say which topic is which'):
        list(recorded_requests(Recording(path)))


@pytest.mark.parametrize('text', ['[' * 5000, '"text"', '[]', '{}', '9' * 5000])
def test_a_recorded_request_that_makes_no_sense_is_refused(tmp_path: Path, text: str):
    path = tmp_path / 'run.mcap'
    content = {name: Channel(f'/{name}', STRING, Qos(1)) for name in ('position', 'request')}
    said = {
        name: json.dumps({'topic': each.topic, **vars(each.qos)}) for name, each in content.items()
    }
    with Recorder(path, [*content.values()], metadata={'stickslip_topics': said}) as recorder:
        recorder.put('/request', 1, cdr.pack_string(text))
    with pytest.raises(RecordingError, match='holds a request that cannot be read'):
        list(recorded_requests(Recording(path)))


def test_equal_recordings_are_equal_and_the_first_difference_is_named(tmp_path):
    requests = [Request('voltage', (1.0,)), Request('stop')]
    one = written(tmp_path / 'one.mcap', requests)
    same = written(tmp_path / 'same.mcap', requests)
    other = written(tmp_path / 'other.mcap', requests, voltage_v=2.0)
    short = written(tmp_path / 'short.mcap', requests[:1])
    assert compare_data(one, same) is None
    assert data_digest(one) == data_digest(same) != data_digest(other)
    difference = compare_data(one, other)
    assert difference is not None
    assert (difference.message, difference.topic, difference.what) == (4, '/voltage', 'data')
    assert compare_data(one, short) is not None


def received(name: str, message: Any) -> Request:
    """Give what the drive makes of a message that ROS has serialised."""
    return receive_request(BY_NAME[name], bytes(serialize_message(message)))


def waveform(dims: list[tuple[int, int]], count: int, offset: int = 0) -> Float64MultiArray:
    """Give a waveform of so many numbers whose layout has these sizes and strides."""
    message = Float64MultiArray(data=[float(n) for n in range(count)])
    message.layout.data_offset = offset
    message.layout.dim = [MultiArrayDimension(size=size, stride=stride) for size, stride in dims]
    return message


@pytest.mark.parametrize(
    ('name', 'value', 'values'),
    [
        ('voltage', 150.0, (150.0,)),
        ('sawtooth', (300.0, 1000.0, 20.0), (300.0, 1000.0, 20.0)),
        ('steps', -7, (-7.0,)),
        ('jog', 40.0, (40.0,)),
        ('waveform', ((0.0, 0.0), (0.1, 5.0)), (0.0, 0.0, 0.1, 5.0)),
        ('position', 2e-6, (2e-6, 0.0, 0.0)),
        ('load', 0.1, (0.1, 0.0, 0.0, 0.0, 0.0, 0.0)),
        ('preload', 0.3, (0.3,)),
    ],
)
def test_a_value_goes_through_its_message_to_the_request(name, value, values):
    data = pack_command(BY_NAME[name], value)
    request = received(name, deserialize_message(data, MESSAGE_TYPES[BY_NAME[name].type_name]))
    assert Request(request.name, tuple(request.values)) == Request(name, values)


@pytest.mark.parametrize(
    ('name', 'value', 'cycles', 'why'),
    [
        ('steps', 1.5, 1, 'steps 1.5 is not a whole number from -2147483648 to 2147483647'),
        ('steps', 3_000_000_000, 1, r'steps 3e\+09 is not a whole number'),
        ('steps', math.nan, 1, 'steps nan is not a whole number'),
        ('steps', math.inf, 1, 'steps inf is not a whole number'),
        ('waveform', (0, 0, 1, 5), 99_999_999_999, 'cycles 99999999999 is not a whole number'),
        ('waveform', (0, 0, 1, 5), -2, 'cycles -2 is not a whole number from 0'),
        ('waveform', (0, 0, 1, 5), 'often', "cycles 'often' is not a whole number"),
        ('voltage', ['much'], 1, r"voltage \['much'\] is not a list of numbers; send voltage V"),
        ('voltage', {}, 1, 'voltage {} is not a list of numbers'),
        ('sawtooth', ['300', '', 0], 1, 'sawtooth .* is not a list of numbers; send amplitude'),
        ('sawtooth', [[1], [2, 3]], 1, 'sawtooth .* is not a list of numbers'),
        ('voltage', 'much', 1, "voltage 'much' is not a list of numbers; send voltage V"),
        pytest.param('voltage', 10**400, 1, 'voltage 1000.* is not a list', id='huge'),
        ('voltage', (1.0, 2.0), 1, r'voltage \[1.0, 2.0\] is not 1 to 1 numbers'),
        ('steps', (), 1, r'steps \[\] is not 1 to 1 numbers'),
        ('position', (0, 0, 0, 0), 1, 'position .* is not 1 to 3 numbers; send x m, y m, z m'),
    ],
)
def test_what_a_message_cannot_carry_is_refused_whoever_sends_it(name, value, cycles, why):
    with pytest.raises((OutOfRange, WrongKind), match=why):
        pack_command(BY_NAME[name], value, cycles=cycles)


@pytest.mark.parametrize(('name', 'value'), [('steps', -(2**31)), ('steps', 2**31 - 1)])
def test_a_message_carries_every_number_of_its_field(name: str, value: int):
    assert receive_request(BY_NAME[name], pack_command(BY_NAME[name], value)).values == (value,)


def test_every_command_topic_is_covered():
    assert set(BY_NAME) == {name for name, row in COMMANDS.items() if row.has_topic} | {'grant'}
    assert len(BY_NAME) == 10


def test_a_stamp_that_no_header_can_hold_is_refused():
    message = PointStamped()
    message.header.stamp = Time(sec=2**31 - 1, nanosec=2**32 - 1)
    with pytest.raises(OutOfRange, match='stamp of position 2147483651294967295 ns is above'):
        received('position', message)


def test_all_coordinates_of_a_target_its_frame_and_its_stamp_reach_the_request():
    message = PointStamped()
    message.header.frame_id = 'camera'
    message.header.stamp = Time(sec=1_800_000_000, nanosec=123_456_789)
    message.point.x, message.point.y, message.point.z = 1.0, 2.0, 3.0
    request = received('position', message)
    assert (request.values, request.frame_id) == ((1.0, 2.0, 3.0), 'camera')
    assert request.stamp_ns == 1_800_000_000_123_456_789


@pytest.mark.parametrize(
    ('label', 'cycles', 'tag'),
    [('cycle#left', 7, 'left'), ('cycle', 7, ''), ('#left', 1, 'left'), ('row#left', 1, 'left')],
)
def test_the_label_of_the_first_axis_may_carry_a_tag(label: str, cycles: int, tag: str):
    message = Float64MultiArray(data=[0.0, 20.0, 1.0, 20.0])
    message.layout.dim = [MultiArrayDimension(label=label, size=7 if cycles == 7 else 2)]
    if cycles == 1:
        message.layout.dim += [MultiArrayDimension(label='time,voltage', size=2)]
    request = received('waveform', message)
    assert (request.cycles, request.tag) == (cycles, tag)


def test_what_follows_a_frame_is_a_tag():
    message = PointStamped()
    for frame, expected in (('#left', ('', 'left')), ('camera#a#b', ('camera', 'a#b'))):
        message.header.frame_id = frame
        request = received('position', message)
        assert (request.frame_id, request.tag) == expected


@pytest.mark.parametrize('name', ['voltage', 'steps'])
def test_a_tag_without_room_is_refused_whoever_sends_it(name: str):
    with pytest.raises(WrongKind, match=f"tag of {name} 'left' is not none: it has no room; "):
        pack_command(BY_NAME[name], 1, tag='left')


def test_a_message_without_a_tag_has_the_bytes_that_it_always_had():
    packed = pack_command(BY_NAME['sawtooth'], (300.0, 1000.0, 5.0))
    labels = (b'amplitude[V],frequency[Hz],steps',)
    assert all(label in packed for label in labels)
    assert b'#' not in packed
    assert b'cycle' not in pack_command(BY_NAME['waveform'], (0.0, 0.0, 1.0, 5.0))


def test_names_and_arrays_of_joints_reach_the_request_as_they_are():
    message = JointState(name=['arm', 'runner_joint'], position=[1.0, 2.0], effort=[3.0])
    message.header.stamp = Time(sec=5)
    request = received('joint', message)
    assert request.joints == Joints(('arm', 'runner_joint'), (1.0, 2.0), (), (3.0,))
    assert (request.values, request.stamp_ns) == ((), 5 * NS_PER_S)


def test_a_position_without_more_is_a_joint_without_a_name():
    data = pack_command(BY_NAME['joint'], 2e-6)
    assert receive_request(BY_NAME['joint'], data).joints == Joints((), (2e-6,))
    data = pack_command(BY_NAME['joint'], (math.nan, 1e-5))
    assert receive_request(BY_NAME['joint'], data).joints.velocities == (1e-5,)


def test_more_joints_than_a_robot_has_are_refused():
    with pytest.raises(OutOfRange, match='joints 1001 is above the 1000 of a message'):
        received('joint', JointState(position=[0.0] * 1001))


def test_a_frame_of_a_name_that_nobody_gives_is_refused():
    message = PointStamped()
    message.header.frame_id = 1001 * 'x'
    with pytest.raises(OutOfRange, match='longer than 1000 characters; give the name that'):
        received('position', message)


@pytest.mark.parametrize(
    'message',
    [
        waveform([], 6),
        waveform([], 5),  # the bench refuses it, with an event
        waveform([(3, 6), (2, 2)], 6),
        waveform([(3, 0), (2, 0)], 6),
    ],
    ids=['no layout', 'odd', 'rows', 'no strides'],
)
def test_a_waveform_is_taken_as_rows(message: Float64MultiArray):
    request = received('waveform', message)
    assert tuple(request.values) == tuple(message.data)


@pytest.mark.parametrize('rest', [[], [(3, 6), (2, 2)]], ids=['alone', 'rows'])
@pytest.mark.parametrize('cycles', [0, 1, 7])
def test_a_first_axis_labelled_cycle_says_how_often_a_waveform_is_played(rest: list, cycles: int):
    message = waveform([(cycles, 0), *rest], 6)
    message.layout.dim[0].label = 'cycle'
    request = received('waveform', message)
    assert (request.cycles, tuple(request.values)) == (cycles, tuple(message.data))


def test_a_cycle_does_not_excuse_a_layout_of_other_columns():
    message = waveform([(4, 0), (2, 6), (3, 3)], 6)
    message.layout.dim[0].label = 'cycle'
    with pytest.raises(WrongKind, match="or none; after 'cycle' to repeat"):
        received('waveform', message)


NOT_ROWS = {
    'one axis': waveform([(6, 6)], 6),
    'columns': waveform([(2, 6), (3, 3)], 6),
    'column-major': waveform([(3, 2), (2, 6)], 6),
    'stride': waveform([(3, 6), (2, 1)], 6),
    'fewer': waveform([(2, 4), (2, 2)], 6),
    'three axes': waveform([(1, 6), (3, 6), (2, 2)], 6),
    'odd': waveform([(2, 4), (2, 2)], 5),
    'offset': waveform([(3, 6), (2, 2)], 6, offset=1),
    'offset alone': waveform([], 6, offset=2),
}


@pytest.mark.parametrize('message', NOT_ROWS.values(), ids=NOT_ROWS)
def test_a_layout_that_is_not_rows_of_two_is_refused(message: Float64MultiArray):
    with pytest.raises(WrongKind, match='rows of two; give'):
        received('waveform', message)


def test_the_longest_waveform_is_taken_and_a_longer_one_refused():
    longest = waveform([], 2 * WAVEFORM_ROWS_MAX)
    assert received('waveform', longest).values == longest.data
    longer = waveform([], 2 * (WAVEFORM_ROWS_MAX + 1))
    with pytest.raises(OutOfRange) as caught:
        received('waveform', longer)
    assert str(caught.value) == (
        'waveform rows 100001 is above the 100000 of a message; '
        'send fewer, or play the whole from a file with `stickslip replay`'
    )


def test_bytes_that_are_no_message_of_the_topic_are_refused():
    with pytest.raises(RecordingError, match='check the type of the topic'):
        receive_request(BY_NAME['load'], pack_command(BY_NAME['voltage'], 1.0))
