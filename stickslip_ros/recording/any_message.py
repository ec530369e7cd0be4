# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Read numbers from messages of any type by the definition that a recording carries."""

import re
from collections.abc import Iterable, Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import Any, Final

import numpy as np
from mcap.records import Channel, Schema
from numpy.typing import NDArray

from stickslip_ros.arrays import Array
from stickslip_ros.errors import RecordingError, UnknownName, quoted
from stickslip_ros.interface.messages import STAMPED_FIELDS
from stickslip_ros.message_types import (
    FLOAT64,
    INT32,
    POINT_STAMPED,
    UINT32,
    VECTOR3_STAMPED,
    WRENCH_STAMPED,
)
from stickslip_ros.process.stopping import stop_if_asked
from stickslip_ros.recording.chunks import (
    ALL_TIMES_NS,
    LENGTH_BYTES,
    MESSAGE_HEAD,
    SEQUENCE_AT,
    ChunkMessages,
    Places,
    gather,
)
from stickslip_ros.recording.definition import ENCODING_BYTES, LITTLE_ENDIAN, Decode, decoder_of
from stickslip_ros.recording.integrity import open_whole
from stickslip_ros.recording.layout import TIME_MAX_NS
from stickslip_ros.units import NS_PER_S

PART: Final = re.compile(r'([^\W\d]\w*)((?:\[[^\[\]]+\])*)')
"""A name in the path of a field, with places in arrays: ``position[0]``, ``position[x]``."""
_JOINT_FIRST: Final = re.compile(r'^(\[[^\[\]]+\])\.(\w+)')  # [x].position
FRONTS: Final = {
    POINT_STAMPED: 'point.',
    VECTOR3_STAMPED: 'vector.',
    WRENCH_STAMPED: 'wrench.',
}
"""Field of each type that holds its numbers, with a dot."""
_PLAIN: Final = {FLOAT64: '<f8', INT32: '<i4', UINT32: '<u4'}  # messages of one number, `data`
_HEADER_BYTES: Final = 12  # seconds, nanoseconds, length of the frame
_NUMBER = bool, int, float, np.generic
LISTED: Final = 20  # most numbers listed in a refusal
_Numbers = tuple[Places, Array, Places]  # times, ns, numbers, log times, ns


class Joint(str):
    """Name of an array element, from the array ``name`` of its message."""

    __slots__ = ()


def numbers_of(
    files: Sequence[Path],
    topic: str,
    field: str,
    *,
    by_stamp: bool = True,
    in_blocks: bool = False,
    repeats: bool = False,
    window_ns: tuple[int, int] = ALL_TIMES_NS,
) -> _Numbers:
    """
    Return time, ns, number and log time, ns, of each message of a topic, in order of time.

    ``by_stamp`` takes the stamp of the header as time, if there is one; else the log time counts.
    A field is a path such as ``point.x``, ``wrench.force.x``, ``data`` or ``position[0]``;
    ``position[x]`` is the number of the joint x. ``in_blocks`` returns all numbers of an array or
    column, at the time of their message. Messages repeated in parts of a run count once. A window
    reads all chunks that may hold messages of its log times. RecordingError: a message is damaged
    or its definition unknown; UnknownName: the field is unknown or no number.

    """
    none = np.empty(0, np.int64)
    found: list[_Numbers] = [(none, np.empty(0), none)]
    last, fields = -1, dict[int, Field]()
    for file in files:
        with open_whole(file) as reader:
            fields = {}
            is_first = True
            for piece in reader.pieces([topic], window_ns):
                numbers = gather(piece.data, piece.starts + SEQUENCE_AT, '<u4')
                is_repeated = repeats and is_first and len(numbers) and numbers[0] == last
                begin, is_first = int(is_repeated), is_first and not len(numbers)
                last = int(numbers[-1]) if len(numbers) else last
                for key in np.unique(piece.channels[begin:]).tolist():
                    stop_if_asked()
                    if key not in fields:
                        channel = reader.get_summary().channels[key]
                        schema = reader.get_summary().schemas.get(channel.schema_id)
                        fields[key] = Field(file, channel, schema, field, in_blocks=in_blocks)
                    places = np.flatnonzero(piece.channels[begin:] == key) + begin
                    found.append(fields[key].read(piece, places, by_stamp=by_stamp))
    if not any(len(values) for _, values, _ in found):
        for each in fields.values():
            each.refuse_absent()
    times_ns, values, logs_ns = map(np.concatenate, zip(*found, strict=True))
    order = np.argsort(times_ns, kind='stable')
    return times_ns[order], values[order], logs_ns[order]


class Field:
    """One number, or all numbers of an array, in each message of a channel."""

    def __init__(
        self, file: Path, channel: Channel, schema: Schema | None, field: str, *, in_blocks: bool
    ) -> None:
        self._file, self._channel, self._schema = file, channel, schema
        self._field, self._in_blocks = field, in_blocks
        self._topic, self._path = channel.topic, path_of(channel.topic, field)
        self._decode: Decode | None = None
        self._joints = set[str]()  # joints at the place of the path, or all

    def read(self, piece: ChunkMessages, places: Places, *, by_stamp: bool) -> _Numbers:
        """Return time, number and log time of messages; ValueError for a damaged message."""
        times_ns = logs_ns = piece.times_ns[places]
        at_once = None if self._in_blocks else self._read_at_once(piece, piece.starts[places])
        seconds, nanoseconds, values, counts = at_once or self._read_each(piece, places)
        if by_stamp:
            stamps_ns = self._to_ns(seconds, nanoseconds)
            times_ns = np.where(stamps_ns == 0, logs_ns, stamps_ns)
        return np.repeat(times_ns, counts), values, np.repeat(logs_ns, counts)

    def _read_at_once(
        self, piece: ChunkMessages, starts: Places
    ) -> tuple[NDArray[Any], NDArray[Any], Array, Places] | None:
        """Read messages of our own types at once; None for other types."""
        data, kind = piece.data, self._schema.name if self._schema else ''
        front, is_plain = FRONTS.get(kind, ''), kind in _PLAIN
        names = ['data'] if is_plain else [front + e for e in STAMPED_FIELDS.get(kind, ())]
        if self._field not in names or self._channel.message_encoding != 'cdr':
            return None
        ends = starts + gather(data, starts - LENGTH_BYTES, '<i8')
        starts = starts + MESSAGE_HEAD.size + ENCODING_BYTES
        too_short = f'a message on {self._topic} is too short'
        if np.any(starts + _HEADER_BYTES * bool(front) > ends):
            raise ValueError(too_short)
        if np.any(gather(data, starts - ENCODING_BYTES, '>u2') != LITTLE_ENDIAN):
            return None
        seconds: NDArray[Any] = np.zeros(len(starts), np.int64)
        nanoseconds = seconds
        number, at = _PLAIN.get(kind, '<f8'), starts
        if front:
            seconds, nanoseconds = gather(data, starts, '<i4'), gather(data, starts + 4, '<u4')
            frame_bytes = gather(data, starts + _HEADER_BYTES - 4, '<u4').astype(np.int64)
            at = starts + (_HEADER_BYTES + frame_bytes + 7) // 8 * 8
            at += 8 * names.index(self._field)
        if np.any(at + np.dtype(number).itemsize > ends):
            raise ValueError(too_short)
        values = gather(data, at, number).astype(np.float64)
        return seconds, nanoseconds, values, np.ones(len(starts), np.int64)

    def _read_each(
        self, piece: ChunkMessages, places: Places
    ) -> tuple[NDArray[Any], NDArray[Any], Array, Places]:
        """Return seconds, nanoseconds and numbers of messages, and the count in each."""
        decode = self._decode = self._decode or decoder_of(self._channel, self._schema, self._file)
        stamps, values = list[tuple[Any, Any]](), list[Array]()
        for place in places.tolist():
            stop_if_asked()
            message = decode(piece.message(place).data)
            try:
                values.append(np.asarray(self._find(message), np.float64))
            except OverflowError:
                problem = f'has a message on {self._topic} that is not JSON: a number is too large'
                raise RecordingError(self._file, problem, 'name another topic') from None
            stamps.append(_stamp_in(message))
        self._check_joint()
        seconds, nanoseconds = np.array(stamps, object).T
        counts = np.array([len(each) for each in values], np.int64)
        return seconds, nanoseconds, np.concatenate(values), counts

    def _find(self, message: Any) -> Any:
        """Return the numbers of a message; empty if it lacks the joint."""
        path, column, found = self._path, None, message
        if self._in_blocks and isinstance(path[-1], int):
            *path, column = path
        names: Any = getattr(message, 'name', None)
        names = names if isinstance(names, list) else None
        try:
            for part in path:
                place: Any = part
                if isinstance(part, Joint):
                    self._joints.update(names)
                    if part not in names:
                        return []
                    place = names.index(part)
                elif isinstance(part, int) and names is not None:
                    self._joints.update(names[part : part + 1])
                is_array = isinstance(found, list | dict | np.ndarray)
                found = found[place] if is_array else vars(found)[place]
        except IndexError:
            reason = f'the array of a message has {len(found)} elements'
            raise UnknownName(f'field of {self._topic}', self._field, reason) from None
        except (KeyError, TypeError):
            raise self._unknown(_leaves_in(message)) from None
        is_array = isinstance(found, list | np.ndarray) and (
            len(found) == 0 or any(_leaves_in(found))
        )
        if self._in_blocks and is_array:
            return self._samples(message, found, column)
        if not self._in_blocks and (found is None or isinstance(found, _NUMBER)):
            return [np.nan if found is None else found]
        samples = [f'{self._field} at ...kHz, an array of samples'] * is_array
        raise self._unknown([*_leaves_in(message), *samples])

    def _samples(self, message: Any, array: Any, column: Any) -> Any:
        """Return all numbers of an array, or one column of a table."""
        axes: Any = getattr(getattr(message, 'layout', None), 'dim', ())
        width = axes[1].size if len(axes) > 1 else 1
        if column is None and width not in {1, len(array)}:
            reason = f'a message is a table of {width} columns; name one, {self._field}[0]'
            raise UnknownName(f'field of {self._topic}', self._field, reason)
        if column is not None and (not column < width > 1 or len(array) % width):
            reason = f'a message of {len(array)} numbers is a table of {width} columns, or none'
            raise UnknownName(f'field of {self._topic}', self._field, reason)
        return array if column is None else array[column::width]

    def _check_joint(self) -> None:
        """Refuse an array index if the joint at it changes between messages."""
        if len(self._joints) > 1 and not any(isinstance(each, Joint) for each in self._path):
            known = sorted(self._joints)
            problem = f'{self._field} of {self._topic} is {" and ".join(known)} in turn'
            ways = ' or '.join(f'{self._topic}[{each}].{self._path[0]}' for each in known)
            raise RecordingError(self._file, problem, f'name the joint: {ways}')

    def refuse_absent(self) -> None:
        """Refuse a joint that is in no message."""
        if self._joints:
            raise self._unknown(f'{self._path[0]}[{each}]' for each in sorted(self._joints))

    def _unknown(self, numbers: Iterable[str]) -> UnknownName:
        """Return the refusal of the field, which lists the numbers of the message."""
        known = [*islice(numbers, LISTED + 1)]
        listed = ', '.join([*known[:LISTED], *['...'] * (len(known) > LISTED)]) or 'none'
        return UnknownName(f'field of {self._topic}', self._field, f'its numbers are {listed}')

    def _to_ns(self, seconds: NDArray[Any], nanoseconds: NDArray[Any]) -> Places:
        """Return stamps; RecordingError for an invalid time."""
        wrong: NDArray[np.bool_] = np.zeros(len(seconds), np.bool_)
        if {seconds.dtype.kind, nanoseconds.dtype.kind} - {'i', 'u'}:
            pairs = zip(seconds.tolist(), nanoseconds.tolist(), strict=True)
            wrong = np.array([{*map(type, each)} != {int} for each in pairs], np.bool_)
        if not wrong.any():
            wrong = (seconds < 0) | (seconds >= TIME_MAX_NS // NS_PER_S)
            wrong |= (nanoseconds < 0) | (nanoseconds >= NS_PER_S)
        if wrong.any():
            at = int(np.argmax(wrong))
            stamp = f'{quoted(seconds.tolist()[at])} s {quoted(nanoseconds.tolist()[at])} ns'
            problem = f'has the stamp {stamp} on {self._topic}'
            hint = 'write whole seconds and nanoseconds below 1e9, or 0 for the time of the file'
            raise RecordingError(self._file, problem, hint)
        return seconds.astype(np.int64) * NS_PER_S + nanoseconds.astype(np.int64)


def _stamp_in(message: Any) -> tuple[Any, Any]:
    """Return seconds and nanoseconds of a ROS or Foxglove message; 0 without a stamp."""
    fields = message if isinstance(message, dict) else vars(message)
    header = fields.get('header')
    stamp = header.get('stamp') if isinstance(header, dict) else getattr(header, 'stamp', None)
    if isinstance(message, dict) and stamp is None:
        stamp = message.get('timestamp')
    if not isinstance(stamp, dict):
        return getattr(stamp, 'sec', 0), getattr(stamp, 'nanosec', 0)
    return stamp.get('sec'), stamp.get('nanosec', stamp.get('nsec'))


def _leaves_in(value: Any, name: str = '') -> Iterator[str]:
    """Yield the paths of the numbers in a message, of arrays only the first element."""
    if isinstance(value, list | np.ndarray):
        yield from _leaves_in(value[0], f'{name}[0]') if len(value) else ()
    elif isinstance(value, _NUMBER):
        yield name
    elif value is not None and not isinstance(value, str):
        for key, each in (value if isinstance(value, dict) else vars(value)).items():
            yield from _leaves_in(each, f'{name}.{key}' if name else key)


def path_of(topic: str, field: str) -> list[str | int]:
    """Split the path of a field into names and array indices."""
    path: list[str | int] = []
    for part in re.split(r'\.(?![^\[]*\])', _JOINT_FIRST.sub(r'\2\1', field)):
        if (found := PART.fullmatch(part)) is None:
            hint = 'write it as point.x, position[0] or position[JOINT]'
            raise UnknownName(f'field of {topic}', field, hint)
        places = re.findall(r'\[([^\[\]]+)\]', found[2])
        path += [found[1], *(int(e) if e.isdecimal() else Joint(e) for e in places)]
    return path
