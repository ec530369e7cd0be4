"""From ROS messages to requests, and from numbers to messages; limits are judged elsewhere."""

import math
from array import array
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from std_msgs.msg import MultiArrayDimension

from stickslip_ros.errors import OutOfRange, WrongKind
from stickslip_ros.instrument.commands import Request
from stickslip_ros.parameters import to_nanoseconds
from stickslip_ros.recording.topics import WAVEFORM_ROWS_MAX, Topic
from stickslip_ros.ros.interface import MESSAGE_TYPES
from stickslip_ros.ros.permit import Grant

ROW = 2
"""Numbers in a row of a waveform: time and voltage."""


def to_request(topic: Topic, message: Any) -> Request:
    """
    Return what a message on a command topic asks for.

    Parameters
    ----------
    topic : Topic
        A command topic.
    message : ROS message
        As received.

    Raises
    ------
    WrongKind
        If the layout of a waveform says anything but rows of time and voltage.
    OutOfRange
        If a waveform has too many rows for a message.

    """
    if topic.request == 'waveform':
        _check_length(len(message.data) // ROW)
        _check_rows(message)
    return Request(topic.request, _READ[topic.type_name](message))


def to_grant(message: Any) -> Grant:
    """
    Return what a message on ``command/grant`` allows.

    Raises
    ------
    WrongKind, OutOfRange
        If it is not a time and a count of commands.

    """
    values = list(message.data[:3])
    if len(values) != 2 or not all(map(math.isfinite, values)):
        mend = 'send [until s, commands]'
        raise WrongKind('grant', values, 'a list of 2 finite numbers', mend)
    until_s, commands = values
    if until_s < 0.0:
        raise OutOfRange('grant until', until_s, 's', 'below 0 s', 'give a simulated time')
    if commands < 0.0 or commands != math.floor(commands):
        mend = 'give the number of messages sent on command topics since the activation'
        raise OutOfRange('grant commands', commands, '', 'not a count', mend)
    return Grant(to_nanoseconds(until_s), int(commands))


def to_message(topic: Topic, value: Any) -> Any:
    """
    Return the message of a command topic.

    Parameters
    ----------
    topic : Topic
        A command topic.
    value : float, int or sequence of float
        The number, or the numbers in their order; rows for a waveform; of a load or a position
        its x alone.

    """
    message = MESSAGE_TYPES[topic.type_name]()
    _WRITE[topic.type_name](message, value)
    return message


def _check_length(rows: int) -> None:
    if rows > WAVEFORM_ROWS_MAX:
        limit = f'above the {WAVEFORM_ROWS_MAX} of a message'
        mend = 'send fewer, or play the whole from a file with `stickslip replay`'
        raise OutOfRange('waveform rows', rows, '', limit, mend)


def _check_rows(message: Any) -> None:
    """Refuse a waveform whose layout is given and is not that of rows in order."""
    layout, count = message.layout, len(message.data)
    sizes = [dim.size for dim in layout.dim]
    strides = [dim.stride for dim in layout.dim]
    fits = sizes == [count // ROW, ROW] and count % ROW == 0
    in_order = all(
        given in (0, meant) for given, meant in zip(strides, (count, ROW), strict=False)
    )
    if (layout.dim and not (fits and in_order)) or layout.data_offset:
        shown = f'sizes {sizes[:4]}, strides {strides[:4]}, offset {layout.data_offset}'
        mend = f'say [n, {ROW}] with strides [{ROW} n, {ROW}], or leave the layout empty'
        raise WrongKind(f'layout of a waveform of {count} numbers', shown, 'rows of two', mend)


def _write_array(message: Any, value: Any) -> None:
    numbers = np.asarray(value, dtype=float)
    message.data = array('d', numbers.tobytes())
    if numbers.ndim == 2:
        rows, columns = numbers.shape
        message.layout.dim = [
            MultiArrayDimension(label='row', size=rows, stride=rows * columns),
            MultiArrayDimension(label='time[s],voltage[V]', size=columns, stride=columns),
        ]


def _write_number(message: Any, value: Any) -> None:
    message.data = type(message.data)(value)


def _write_point(message: Any, value: Any) -> None:
    message.point.x = float(value)


def _write_wrench(message: Any, value: Any) -> None:
    message.wrench.force.x = float(value)


def _read_point(message: Any) -> tuple[float, ...]:
    point = message.point
    return (point.x, point.y, point.z)


def _read_wrench(message: Any) -> tuple[float, ...]:
    force, torque = message.wrench.force, message.wrench.torque
    return (force.x, force.y, force.z, torque.x, torque.y, torque.z)


_READ: Mapping[str, Callable[[Any], Sequence[float]]] = {
    'std_msgs/msg/Float64': lambda message: (message.data,),
    'std_msgs/msg/Int32': lambda message: (float(message.data),),
    'std_msgs/msg/Float64MultiArray': lambda message: message.data,  # an array.array
    'geometry_msgs/msg/PointStamped': _read_point,
    'geometry_msgs/msg/WrenchStamped': _read_wrench,
}
_WRITE: Mapping[str, Callable[[Any, Any], None]] = {
    'std_msgs/msg/Float64': _write_number,
    'std_msgs/msg/Int32': _write_number,
    'std_msgs/msg/Float64MultiArray': _write_array,
    'geometry_msgs/msg/PointStamped': _write_point,
    'geometry_msgs/msg/WrenchStamped': _write_wrench,
}
