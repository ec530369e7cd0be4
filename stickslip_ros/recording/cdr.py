"""
Messages to bytes and back, as ROS 2 carries and records them.

Padding is zero, so equal messages are equal bytes. Numbers that a field cannot hold are refused
by `struct.error`, as `struct` does.

"""

import struct
from collections.abc import Callable, Sequence
from functools import lru_cache
from math import prod
from typing import Final

import numpy as np
from numpy.typing import NDArray

from stickslip_ros.errors import RecordingError, UnknownName, WrongKind
from stickslip_ros.recording import messages as m
from stickslip_ros.recording.cdr_fields import HEADER, Cursor, padding, text_field
from stickslip_ros.units import NS_PER_S

#: Distinct frames and array layouts that are kept packed.
CACHED_HEADS: Final = 64

_pack_float64: Final = struct.Struct('<4sd').pack
_pack_int32: Final = struct.Struct('<4si').pack
_pack_uint32: Final = struct.Struct('<4sI').pack
_pack_words: Final = struct.Struct('<II').pack


def pack_float64(value: float) -> bytes:
    """Pack a ``std_msgs/msg/Float64``."""
    return _pack_float64(HEADER, value)


def pack_int32(value: int) -> bytes:
    """Pack a ``std_msgs/msg/Int32``."""
    return _pack_int32(HEADER, value)


def pack_uint32(value: int) -> bytes:
    """Pack a ``std_msgs/msg/UInt32``."""
    return _pack_uint32(HEADER, value)


def pack_string(text: str) -> bytes:
    """Pack a ``std_msgs/msg/String``."""
    return HEADER + text_field(text)


def pack_float64_array(values: NDArray[np.float64], labels: Sequence[str]) -> bytes:
    """
    Pack a ``std_msgs/msg/Float64MultiArray`` in row-major order.

    Parameters
    ----------
    values : ndarray of float
        Any number of axes.
    labels : sequence of str
        One label per axis of `values`.

    Returns
    -------
    bytes
        The message; the stride of an axis is the product of its size and all later sizes.

    Raises
    ------
    WrongKind
        If there are not as many labels as axes.

    """
    head = _array_head(np.shape(values), tuple(labels))
    return head + np.asarray(values, dtype='<f8').tobytes()


def pack_point_stamped(stamp_ns: int, frame_id: str, xyz: Sequence[float]) -> bytes:
    """Pack a ``geometry_msgs/msg/PointStamped``: time in ns, coordinates in m."""
    pack, size, text = _stamped(frame_id, 3)
    return pack(HEADER, *divmod(stamp_ns, NS_PER_S), size, text, *xyz)


def pack_wrench_stamped(
    stamp_ns: int, frame_id: str, force: Sequence[float], torque: Sequence[float]
) -> bytes:
    """Pack a ``geometry_msgs/msg/WrenchStamped``: time in ns, force in N, torque in N m."""
    pack, size, text = _stamped(frame_id, 6)
    return pack(HEADER, *divmod(stamp_ns, NS_PER_S), size, text, *force, *torque)


def unpack(type_name: str, data: bytes) -> m.Message:
    """
    Read the bytes of one message.

    Parameters
    ----------
    type_name : str
        One of the types that this package records, as ``std_msgs/msg/Float64``.
    data : bytes
        The message with its header.

    Returns
    -------
    float, int, str, ArrayMessage, PointMessage or WrenchMessage
        What the message says.

    Raises
    ------
    UnknownName
        If the type is not one that this package records.
    RecordingError
        If the bytes are cut off, in another encoding, or of another type.

    """
    read = _READERS.get(type_name)
    if read is None:
        raise UnknownName('message type', type_name, f'the known ones are {", ".join(_READERS)}')
    try:
        cursor = Cursor(data)
        message = read(cursor)
        cursor.check_end()
    except ValueError as error:
        raise _foreign(type_name, len(data), error) from error
    return message


def _foreign(type_name: str, size_bytes: int, error: ValueError) -> RecordingError:
    return RecordingError(
        type_name,
        f'{size_bytes} bytes are not one little-endian CDR message of this type: {error}',
        'check the type of the topic, and that the message was not cut off',
    )


@lru_cache(maxsize=CACHED_HEADS)
def _array_head(sizes: tuple[int, ...], labels: tuple[str, ...]) -> bytes:
    """
    Give all of a Float64MultiArray that stands in front of its numbers.

    Where there are none, nothing is padded for them: Fast CDR does so nevertheless, other readers
    take it for bytes that are left over, and all agree on a message without.

    """
    if len(sizes) != len(labels):
        raise WrongKind('labels', labels, f'{len(sizes)} in number', 'give one label per axis')
    body = struct.pack('<I', len(sizes))
    for axis, label in enumerate(labels):
        body += text_field(label)
        body += padding(len(body), 4) + _pack_words(sizes[axis], prod(sizes[axis:]))
    body += padding(len(body), 4) + _pack_words(0, prod(sizes))
    return HEADER + body + (padding(len(body), 8) if prod(sizes) else b'')


@lru_cache(maxsize=CACHED_HEADS)
def _stamped(frame_id: str, count: int) -> tuple[Callable[..., bytes], int, bytes]:
    """Give what packs a std_msgs/Header in `frame_id` and `count` numbers behind it."""
    text = text_field(frame_id)[4:]
    fill = len(padding(12 + len(text), 8))
    return struct.Struct(f'<4siII{len(text)}s{fill}x{count}d').pack, len(text), text


def _read_float64(cursor: Cursor) -> float:
    return cursor.float64s(1)[0]


def _read_array(cursor: Cursor) -> m.ArrayMessage:
    rows = [(cursor.text(), cursor.uint32(), cursor.uint32()) for _ in range(cursor.uint32())]
    labels = tuple(label for label, _, _ in rows)
    sizes = tuple(size for _, size, _ in rows)
    offset, data = cursor.uint32(), cursor.float64_sequence()
    if sizes and offset == 0 and prod(sizes) == data.size:
        data = data.reshape(sizes)
    return m.ArrayMessage(labels, sizes, data)


def _read_point(cursor: Cursor) -> m.PointMessage:
    stamp_ns, frame_id = cursor.stamp_ns(), cursor.text()
    x, y, z = cursor.float64s(3)
    return m.PointMessage(stamp_ns, frame_id, x, y, z)


def _read_wrench(cursor: Cursor) -> m.WrenchMessage:
    stamp_ns, frame_id = cursor.stamp_ns(), cursor.text()
    fx, fy, fz, tx, ty, tz = cursor.float64s(6)
    return m.WrenchMessage(stamp_ns, frame_id, (fx, fy, fz), (tx, ty, tz))


_READERS: Final[dict[str, Callable[[Cursor], m.Message]]] = {
    m.FLOAT64: _read_float64,
    m.INT32: Cursor.int32,
    m.UINT32: Cursor.uint32,
    m.STRING: Cursor.text,
    m.FLOAT64_ARRAY: _read_array,
    m.POINT_STAMPED: _read_point,
    m.WRENCH_STAMPED: _read_wrench,
}
