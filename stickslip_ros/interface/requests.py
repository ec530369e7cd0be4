# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Encode and decode requests as messages."""

import json
import math
from array import array
from collections.abc import Sequence
from typing import Any

import numpy as np

from stickslip_ros.errors import OutOfRange, StickSlipError, WrongKind
from stickslip_ros.instrument.commands import (
    JOINT,
    WAVEFORM_ROWS_MAX,
    Command,
    Request,
    number_name,
)
from stickslip_ros.instrument.joints import NO_JOINTS, Joints
from stickslip_ros.interface import messages as m
from stickslip_ros.interface.cdr import (
    pack_float64,
    pack_float64_array,
    pack_int32,
    pack_joints,
    pack_stamped,
    pack_string,
    unpack,
)
from stickslip_ros.interface.feed import Packed
from stickslip_ros.interface.topics import COMMAND_TOPICS, Topic
from stickslip_ros.message_types import FLOAT64, FLOAT64_ARRAY, INT32, JOINT_STATE
from stickslip_ros.parameters.typed import to_si, with_point
from stickslip_ros.units import NS_PER_S, parse_quantity

_NAME_MAX = 1000
"""Longest name of a frame or joint in a message, characters."""
JOINTS_MAX = 1000
"""Most joints in a message."""
BY_TOPIC = {topic.request: topic for topic in COMMAND_TOPICS if topic.recorded}
"""Topic of each request with a topic."""
CYCLE = 'cycle'
"""Label of a repeated table's first axis; its size is the number of cycles to play."""
TAG = '#'
"""Separator before a tag, in the frame of a header or the label of a first axis."""
NOTES = 'request'
"""Key of the topic that reports every other request."""
INT32_MAX, UINT32_MAX = 2**31 - 1, 2**32 - 1


def pack_request(request: Request, time_ns: int) -> Packed:
    """Pack a request as the message of its topic, at the time of its effect."""
    topic = BY_TOPIC.get(request.name)
    if topic is not None:
        if topic.type_name == JOINT_STATE:
            frame = tagged(request.frame_id, request.tag)
            joints = m.JointMessage(request.stamp_ns, frame, *request.joints)
            return Packed(topic.key, time_ns, pack_joints(joints))
        stamp_ns, frame_id, tag = request.stamp_ns, request.frame_id, request.tag
        data = pack_command(topic, request.values, stamp_ns, frame_id, request.cycles, tag)
        return Packed(topic.key, time_ns, data)
    content: dict[str, object] = {
        'name': request.name,
        'values': request.values,
        'settings': dict(request.settings),
    }
    if request.tag:
        content['tag'] = request.tag
    return Packed(NOTES, time_ns, pack_string(json.dumps(content)))


def tagged(name: str, tag: str) -> str:
    """Return the name of a frame or axis, with the tag if any."""
    return f'{name}{TAG}{tag}' if tag else name


def pack_command(
    topic: Topic,
    values: Any,
    stamp_ns: int = 0,
    frame_id: str = '',
    cycles: int = 1,
    tag: str = '',
) -> bytes:
    """
    Return the message of a command topic.

    The values are a number, the numbers in order, or rows for a waveform; for a load or a
    position, x alone is enough; for a joint, its position. NaN means "not commanded". A table is
    played for ``cycles`` cycles; 0 repeats until replaced. The ``tag`` is returned in events.
    Raises WrongKind if a value is no number, their count is wrong, or the message has no field
    for a tag; OutOfRange if a number for a field of 32 bits is not whole, or too large.

    """
    wanted = f'send {", ".join(topic.numbers)}'
    try:
        numbers = np.ravel(np.asarray(values, dtype=np.float64))
    except (TypeError, ValueError, OverflowError):
        raise WrongKind(topic.request, values, 'a list of numbers', wanted) from None
    if topic.type_name != FLOAT64_ARRAY and not 1 <= len(numbers) <= len(topic.numbers):
        few = numbers[:8].tolist()
        raise WrongKind(topic.request, few, f'1 to {len(topic.numbers)} numbers', wanted)
    if topic.type_name in (FLOAT64, INT32):
        if tag:
            hint = 'leave it out, or send a saw-tooth, a waveform, a position or a joint'
            raise WrongKind(f'tag of {topic.request}', tag, 'none: it has no room', hint)
        if topic.type_name == FLOAT64:
            return pack_float64(*numbers)
        return pack_int32(_whole(topic.request, numbers[0], -INT32_MAX - 1, INT32_MAX))
    if topic.type_name in m.STAMPED_FIELDS:
        rest = (0.0,) * (len(topic.numbers) - len(numbers))
        return pack_stamped(stamp_ns, tagged(frame_id, tag), (*numbers, *rest))
    if topic.type_name == JOINT_STATE:
        arrays = ((float(number),) for number in numbers)
        return pack_joints(m.JointMessage(stamp_ns, tagged(frame_id, tag), (), *arrays))
    columns = ','.join(map(_column, topic.numbers))
    if not topic.is_table:
        return pack_float64_array(numbers, (tagged(columns, tag),))
    cycle = tagged(CYCLE, tag), _whole(CYCLE + 's', cycles, 0, UINT32_MAX)
    front = () if cycle == (CYCLE, 1) else (cycle,)
    is_whole = len(numbers) % len(topic.numbers) == 0
    rows = numbers.reshape(-1, len(topic.numbers)) if is_whole else numbers
    return pack_float64_array(rows, ('row', columns) if is_whole else (columns,), front)


def _whole(name: str, value: Any, low: int, high: int) -> int:
    """Return a whole number for a field of 32 bits; refuse a fraction or one out of range."""
    try:
        if low <= float(value) <= high and float(value).is_integer():
            return int(float(value))
    except (TypeError, ValueError, OverflowError):
        pass
    limit = f'not a whole number from {low} to {high}'
    raise OutOfRange(name, value, '', limit, 'round it, or bring it into these limits')


def typed_numbers(command: Command, words: Sequence[str]) -> list[float]:
    """Parse the typed numbers of a command, in order or by name."""
    labels = [label.partition(' ')[::2] for label in command.numbers]
    wanted = ', '.join(command.numbers) or 'no numbers'
    hint = f'{command.name} takes {wanted}' + ', row after row' * command.is_table
    rows = -(-len(words) // len(labels)) if command.is_table else 1
    count = max(rows, 1) * len(labels)
    rest = {JOINT: math.nan}.get(command.name, 0.0 if command.frame else None)
    numbers: list[float | None] = [rest] * count
    for k, word in enumerate(words):
        name, equals, text = word.rpartition('=')
        by_name = (place for place, label in enumerate(labels) if label[0] == name)
        place = next(by_name, count) if equals else k
        if place >= count:
            raise WrongKind(f'{command.name} number', word, 'one of its numbers', hint)
        label, unit = labels[place % len(labels)]
        number = number_name(command.name, label)
        numbers[place] = _typed_number(number, with_point(number, text), unit)
    lacking = ', '.join(labels[k % len(labels)][0] for k, n in enumerate(numbers) if n is None)
    if lacking:
        raise StickSlipError(f'{hint}; nothing is given for {lacking}')
    return [number for number in numbers if number is not None]


def _typed_number(name: str, text: str, unit: str) -> float:
    """Parse a typed number; without a unit it is a count or a choice of ``0 or 1``."""
    if unit and not unit[0].isdigit():
        return to_si(name, text, unit)
    number = parse_quantity(text, '')
    if unit and number not in {0.0, 1.0}:
        raise WrongKind(name, text, unit, 'give 1 for on, 0 for off')
    if number is None or not number.is_integer():
        raise WrongKind(name, text, 'a whole number', 'give an integer such as 42')
    return number


def _column(label: str) -> str:
    """Return the label of a number in a layout: ``voltage[V]`` for ``voltage V``."""
    name, _, unit = label.partition(' ')
    return f'{name}[{unit}]' if unit else name


def read_request(topic: Topic, data: bytes) -> Request:
    """
    Return the request in a message on a command topic.

    Raises RecordingError if the bytes are no message of the topic's type; WrongKind if the layout
    of a table does not describe its rows; OutOfRange if the stamp is too late for a header.

    """
    message = unpack(topic.type_name, data)
    values: Sequence[float] = ()
    cycles, tag = 1, ''
    if isinstance(message, m.StampedMessage | m.JointMessage):
        stamp_ns = message.stamp_ns
        if stamp_ns // NS_PER_S > INT32_MAX:  # its nanoseconds exceed 1e9
            limit = f'above the {INT32_MAX} s of a header'
            hint = 'send a stamp of this time, with nanoseconds below 1e9, or none'
            raise OutOfRange(f'stamp of {topic.request}', stamp_ns, 'ns', limit, hint)
        joints = NO_JOINTS
        if isinstance(message, m.JointMessage):
            joints = Joints(*message[2:])
        else:
            values = message.values
        frame_id, _, tag = message.frame_id.partition(TAG)
        return Request(topic.request, values, (), stamp_ns, frame_id, joints, tag=tag)
    if isinstance(message, m.ArrayMessage):
        axis, _, tag = ''.join(message.labels[:1]).partition(TAG)
        if topic.is_table:
            if axis == CYCLE:
                cycles = message.sizes[0]
            _check_layout(topic, message, first=int(axis == CYCLE))
        values = array('d', message.data.tobytes())
    else:
        assert isinstance(message, int | float)
        values = (float(message),)
    return Request(topic.request, values, cycles=cycles, tag=tag)


def receive_request(topic: Topic, data: bytes) -> Request:
    """
    Return the request in a message from the network, which limits its size.

    Raises StickSlipError like `read_request`, and for too many rows of a waveform, too many
    joints, or too long a name.

    """
    request = read_request(topic, data)
    for name in (request.frame_id, request.tag, *request.joints.names):
        if len(name) > _NAME_MAX:
            limit = f'longer than {_NAME_MAX} characters'
            hint = 'give the name that the drive has, or none'
            raise OutOfRange(f'name in {topic.request}', name, '', limit, hint)
    joints = max(map(len, request.joints))
    if joints > JOINTS_MAX:
        limit = f'above the {JOINTS_MAX} of a message'
        raise OutOfRange('joints', joints, '', limit, 'send only joints of the drive')
    rows = len(request.values) // len(topic.numbers)
    if topic.is_table and rows > WAVEFORM_ROWS_MAX:
        limit = f'above the {WAVEFORM_ROWS_MAX} of a message'
        hint = 'send fewer, or play the whole from a file with `stickslip replay`'
        raise OutOfRange(f'{topic.request} rows', rows, '', limit, hint)
    return request


def _check_layout(topic: Topic, message: m.ArrayMessage, first: int) -> None:
    """Refuse a table unless its layout, from axis `first` on, describes contiguous rows."""
    count, width = message.data.size, len(topic.numbers)
    sizes, strides = list(message.sizes[first:]), list(message.strides[first:])
    # Accept a count that gives no whole rows: the check of the numbers refuses it.
    fits = sizes == [count // width, width] if count % width == 0 else sizes == [count]
    in_order = all(
        given in (0, meant) for given, meant in zip(strides, (count, width), strict=False)
    )
    if (sizes and not (fits and in_order)) or message.offset:
        shown = f'sizes {sizes[:4]}, strides {strides[:4]}, offset {message.offset}'
        hint = f'give sizes [n, 2] and strides [2 n, 2], or none; after {CYCLE!r} to repeat'
        name = f'layout of a {topic.request} of {count} numbers'
        raise WrongKind(name, shown, 'rows of two', hint)
