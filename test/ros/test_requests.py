"""Messages become requests, numbers become messages; what makes no sense is refused."""

import math

import pytest
from std_msgs.msg import Float64MultiArray, MultiArrayDimension

from stickslip_ros.errors import OutOfRange, StickSlipError, WrongKind
from stickslip_ros.instrument.commands import Request
from stickslip_ros.recording.topics import COMMANDS, WAVEFORM_ROWS_MAX, Topic
from stickslip_ros.ros.interface import MESSAGE_TYPES
from stickslip_ros.ros.permit import Grant
from stickslip_ros.ros.requests import to_grant, to_message, to_request

BY_NAME = {topic.request: topic for topic in COMMANDS}


def topic_of(name: str) -> Topic:
    return BY_NAME[name]


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
def test_a_value_goes_through_its_message_to_the_request(
    name: str, value: object, values: tuple[float, ...]
):
    message = to_message(topic_of(name), value)
    assert isinstance(message, MESSAGE_TYPES[topic_of(name).type_name])
    request = to_request(topic_of(name), message)
    assert Request(request.name, tuple(request.values)) == Request(name, values)


def test_every_command_topic_is_covered():
    assert set(BY_NAME) == {
        'voltage',
        'sawtooth',
        'steps',
        'jog',
        'waveform',
        'position',
        'load',
        'preload',
        'grant',
    }


def test_all_coordinates_of_a_target_reach_the_request():
    message = MESSAGE_TYPES['geometry_msgs/msg/PointStamped']()
    message.point.x, message.point.y, message.point.z = 1.0, 2.0, 3.0
    assert to_request(topic_of('position'), message).values == (1.0, 2.0, 3.0)


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
    request = to_request(topic_of('waveform'), message)
    assert tuple(request.values) == tuple(message.data)


@pytest.mark.parametrize(
    'message',
    [
        waveform([(6, 6)], 6),
        waveform([(2, 6), (3, 3)], 6),
        waveform([(3, 2), (2, 6)], 6),
        waveform([(3, 6), (2, 1)], 6),
        waveform([(2, 4), (2, 2)], 6),
        waveform([(1, 6), (3, 6), (2, 2)], 6),
        waveform([(2, 4), (2, 2)], 5),
        waveform([(3, 6), (2, 2)], 6, offset=1),
        waveform([], 6, offset=2),
    ],
    ids=[
        'one axis',
        'columns',
        'column-major',
        'stride',
        'fewer',
        'three axes',
        'odd',
        'offset',
        'offset alone',
    ],
)
def test_a_layout_that_is_not_rows_of_two_is_refused(message: Float64MultiArray):
    with pytest.raises(WrongKind, match='rows of two; say'):
        to_request(topic_of('waveform'), message)


def test_the_numbers_of_a_waveform_are_not_copied_and_too_many_are_refused():
    longest = waveform([], 2 * WAVEFORM_ROWS_MAX)
    assert to_request(topic_of('waveform'), longest).values is longest.data
    longer = waveform([], 2 * (WAVEFORM_ROWS_MAX + 1))
    with pytest.raises(OutOfRange) as caught:
        to_request(topic_of('waveform'), longer)
    assert str(caught.value) == (
        'waveform rows 100001 is above the 100000 of a message; '
        'send fewer, or play the whole from a file with `stickslip replay`'
    )


def test_a_grant_is_rounded_to_nanoseconds():
    message = to_message(topic_of('grant'), (0.1 + 0.2, 3))
    assert to_grant(message) == Grant(300_000_000, 3)


@pytest.mark.parametrize(
    ('values', 'refusal', 'message'),
    [
        ([], WrongKind, 'grant [] is not a list of 2 finite numbers; send [until s, commands]'),
        ([1.0], WrongKind, 'is not a list of 2'),
        ([1.0, 2.0, 3.0, 4.0], WrongKind, 'is not a list of 2'),
        ([math.nan, 0.0], WrongKind, 'is not a list of 2 finite'),
        ([math.inf, 0.0], WrongKind, 'is not a list of 2 finite'),
        ([1.0, math.nan], WrongKind, 'is not a list of 2 finite'),
        ([-1e-9, 0.0], OutOfRange, 'grant until -1e-09 s is below 0 s; give a simulated time'),
        ([1.0, -1.0], OutOfRange, 'grant commands -1 is not a count; give the number'),
        ([1.0, 0.5], OutOfRange, 'grant commands 0.5 is not a count'),
    ],
)
def test_a_bad_grant_is_refused(values: list[float], refusal: type[StickSlipError], message: str):
    with pytest.raises(refusal) as caught:
        to_grant(Float64MultiArray(data=values))
    assert message in str(caught.value)
