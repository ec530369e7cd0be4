# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Encode and decode messages in the format that ROS 2 sends and records.

The format is plain CDR, version 1, of the OMG's DDS-XTypes 1.3, Section 7.4.1, little endian:
a header of four bytes, then each number aligned to its own size, counted from the end of the
header. Padding is zero, so equal messages give equal bytes. Numbers out of a field's range raise
`struct.error`.

"""

import struct
from collections.abc import Callable, Sequence
from functools import lru_cache, partial
from math import prod
from typing import Final

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.budget import AXES, CHUNK_BYTES, LABEL_MOST, Limit
from stickslip_ros.errors import RecordingError, UnknownName, WrongKind
from stickslip_ros.interface import messages as m
from stickslip_ros.message_types import FLOAT64, FLOAT64_ARRAY, INT32, JOINT_STATE, STRING, UINT32
from stickslip_ros.units import NS_PER_S

_HEADER: Final = b'\x00\x01\x00\x00'
LONGEST_TAIL_BYTES: Final = 3
"""Largest padding after the last field: some serialisers fill the last word."""
JOINT_TAIL_BYTES: Final = 12
"""Largest padding that Fast CDR writes after joints with an empty array."""
CACHED_HEADS: Final = 64
"""Packed frames and array layouts cached."""

_pack_words: Final = struct.Struct('<II').pack
_pack_stamp: Final = struct.Struct('<4siI').pack
pack_number: Final = struct.Struct('<d').pack  # a number after a header, aligned
pack_float64: Final = partial(struct.Struct('<4sd').pack, _HEADER)
pack_int32: Final = partial(struct.Struct('<4si').pack, _HEADER)
pack_uint32: Final = partial(struct.Struct('<4sI').pack, _HEADER)
"""Pack a ``std_msgs/msg/Float64``, ``Int32`` or ``UInt32``."""


def pack_string(text: str) -> bytes:
    """Pack a ``std_msgs/msg/String``."""
    return _HEADER + _text_field(text)


def pack_float64_array(
    values: Array, labels: Sequence[str], front: tuple[tuple[str, int], ...] = ()
) -> bytes:
    """
    Pack a ``std_msgs/msg/Float64MultiArray`` in row-major order, with a label for each axis.

    The stride of an axis is the product of its size and all later sizes. Axes in ``front``
    (label, size) have stride 0: the array is constant along them. Raises WrongKind if labels and
    axes differ in number.

    """
    head = _array_head(np.shape(values), tuple(labels), front)
    return head + np.asarray(values, dtype='<f8').tobytes()


def pack_stamped(stamp_ns: int, frame_id: str, values: Sequence[float]) -> bytes:
    """
    Pack a ``geometry_msgs/msg/PointStamped`` or ``WrenchStamped``.

    The values are three coordinates, m; or three forces, N, and three torques, N m.

    """
    numbers = struct.pack(f'<{len(values)}d', *values)
    return pack_stamp(stamp_ns) + frame_field(frame_id) + numbers


def pack_stamp(stamp_ns: int) -> bytes:
    """Pack a ``rosgraph_msgs/msg/Clock``, or the start of a message that has a header."""
    return _pack_stamp(_HEADER, *divmod(stamp_ns, NS_PER_S))


@lru_cache(maxsize=CACHED_HEADS)
def frame_field(frame_id: str) -> bytes:
    """Pack the frame of a ``std_msgs/msg/Header``, padded for numbers."""
    text = _text_field(frame_id)
    # 8: seconds and nanoseconds of the stamp stand in front.
    return text + _padding(8 + len(text), 8)


def pack_joints(message: m.JointMessage) -> bytes:
    """Pack a ``sensor_msgs/msg/JointState``."""
    body = pack_stamp(message.stamp_ns)[len(_HEADER) :] + _text_field(message.frame_id)
    body += _padding(len(body), 4) + struct.pack('<I', len(message.names))
    for name in message.names:
        body += _padding(len(body), 4) + _text_field(name)
    for numbers in message.arrays:
        body += _padding(len(body), 4) + struct.pack('<I', len(numbers))
        if numbers:
            body += _padding(len(body), 8) + struct.pack(f'<{len(numbers)}d', *numbers)
    return _HEADER + body


def unpack(type_name: str, data: bytes) -> m.Message:
    """
    Decode one message with its header, of a type such as ``std_msgs/msg/Float64``.

    Raises UnknownName if this package does not record the type; RecordingError if the bytes are
    cut off, in another encoding, or of another type.

    """
    read = _READERS.get(type_name)
    if read is None:
        raise UnknownName('message type', type_name, f'the known ones are {", ".join(_READERS)}')
    try:
        cursor = _Cursor(data)
        message = read(cursor)
        cursor.check_end()
    except ValueError as error:
        raise RecordingError(
            type_name,
            f'{len(data)} bytes are not one little-endian CDR message of this type: {error}',
            'check the type of the topic, and that the message was not cut off',
        ) from error
    return message


def _text_field(text: str) -> bytes:
    """
    Pack a string: its length with the closing zero, the text, a zero.

    A zero inside is refused: C programs would cut the string there.

    """
    encoded = text.encode()
    if b'\0' in encoded:
        raise WrongKind('text', text, 'free of zero characters', 'remove them')
    return struct.pack('<I', len(encoded) + 1) + encoded + b'\0'


def _padding(length_bytes: int, alignment_bytes: int) -> bytes:
    """Return zeros that pad a length to a multiple of the alignment."""
    return bytes(-length_bytes % alignment_bytes)


@lru_cache(maxsize=CACHED_HEADS)
def _array_head(
    sizes: tuple[int, ...], labels: tuple[str, ...], front: tuple[tuple[str, int], ...]
) -> bytes:
    """
    Pack the head of a Float64MultiArray: everything before its numbers.

    An array without numbers gets no padding: Fast CDR adds some, but other readers refuse it.

    """
    if len(sizes) != len(labels):
        raise WrongKind('labels', labels, f'{len(sizes)} in number', 'give one label per axis')
    axes = [(*axis, 0) for axis in front]
    axes += [(label, sizes[axis], prod(sizes[axis:])) for axis, label in enumerate(labels)]
    body = struct.pack('<I', len(axes))
    for label, size, stride in axes:
        body += _text_field(label)
        body += _padding(len(body), 4) + _pack_words(size, stride)
    body += _padding(len(body), 4) + _pack_words(0, prod(sizes))
    return _HEADER + body + (_padding(len(body), 8) if prod(sizes) else b'')


class _Cursor:
    """Reads the fields of a message in order; ValueError if a field is missing."""

    def __init__(self, data: bytes) -> None:
        if data[:2] != _HEADER[:2] or len(data) < len(_HEADER):
            raise ValueError(f'they begin with "{data[:4].hex(" ")}", not "{_HEADER.hex(" ")}"')
        self._body = memoryview(data)[len(_HEADER) :]
        self._at = 0

    def int32(self) -> int:
        return int.from_bytes(self._claim(4, 4), 'little', signed=True)

    def uint32(self) -> int:
        return int.from_bytes(self._claim(4, 4), 'little')

    def text(self, limit: Limit = CHUNK_BYTES) -> str:
        """Read a string; some writers omit the closing zero of an empty string."""
        encoded = bytes(self._claim(self.uint32(), 1))
        limit.check(len(encoded) - 1)
        if encoded[-1:] not in (b'', b'\0'):
            raise ValueError('a text in them has no closing zero')
        if b'\0' in encoded[:-1]:
            raise ValueError('a text in them has a zero inside')
        return encoded[:-1].decode()

    def float64(self) -> float:
        return self.float64s(1)[0]

    def float64s(self, count: int) -> tuple[float, ...]:
        """Read `count` numbers; 0 numbers need no alignment."""
        if not count:
            return ()
        return struct.unpack(f'<{count}d', self._claim(8 * count, 8))

    def stamped(self, count: int) -> m.StampedMessage:
        """Read a ``std_msgs/msg/Header`` and `count` numbers."""
        stamp_ns = self.int32() * NS_PER_S + self.uint32()
        return m.StampedMessage(stamp_ns, self.text(LABEL_MOST), self.float64s(count))

    def array(self) -> m.ArrayMessage:
        """Read a ``std_msgs/msg/Float64MultiArray``; its numbers are a copy, aligned, writable."""
        AXES.check(count := self.uint32())
        axes = [(self.text(LABEL_MOST), self.uint32(), self.uint32()) for _ in range(count)]
        labels, sizes, strides = zip(*axes, strict=True) if axes else ((), (), ())
        offset, count = self.uint32(), self.uint32()
        if count:
            data = np.frombuffer(self._claim(8 * count, 8), '<f8').astype(np.float64)
        else:
            self._at = min(self._at + -self._at % 8, len(self._body))
            data = np.empty(0)
        if sizes and offset == 0 and prod(sizes) == count:
            data = data.reshape(sizes)
        return m.ArrayMessage(labels, sizes, data, strides, offset)

    def joints(self) -> m.JointMessage:
        """Read a ``sensor_msgs/msg/JointState``."""
        stamp_ns = self.int32() * NS_PER_S + self.uint32()
        frame_id = self.text(LABEL_MOST)
        AXES.check(count := self.uint32())
        names = tuple(self.text(LABEL_MOST) for _ in range(count))
        arrays = [self.float64s(self.uint32()) for _ in m.JOINT_UNITS]
        message = m.JointMessage(stamp_ns, frame_id, names, *arrays)
        if () in message.arrays:
            self._at = min(self._at + JOINT_TAIL_BYTES, len(self._body))
        return message

    def check_end(self) -> None:
        left_bytes = len(self._body) - self._at
        if left_bytes > LONGEST_TAIL_BYTES:
            raise ValueError(f'{left_bytes} of them are left over')

    def _claim(self, size_bytes: int, alignment_bytes: int) -> memoryview:
        """Return the bytes of a field and advance past it."""
        start = self._at + -self._at % alignment_bytes
        missing_bytes = start + size_bytes - len(self._body)
        if missing_bytes > 0:
            raise ValueError(f'at least {missing_bytes} are missing')
        self._at = start + size_bytes
        return self._body[start : self._at]


_READERS: Final[dict[str, Callable[[_Cursor], m.Message]]] = {
    FLOAT64: _Cursor.float64,
    INT32: _Cursor.int32,
    UINT32: _Cursor.uint32,
    STRING: _Cursor.text,
    FLOAT64_ARRAY: _Cursor.array,
    JOINT_STATE: _Cursor.joints,
    **{
        type_name: partial(_Cursor.stamped, count=len(fields))
        for type_name, fields in m.STAMPED_FIELDS.items()
    },
}
