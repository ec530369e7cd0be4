# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Reads numbers from messages of any type, by the definition that a recording carries."""

import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from itertools import count, islice
from pathlib import Path
from typing import Any, Final

import numpy as np
from mcap.records import Channel, Schema
from numpy.typing import NDArray

from stickslip_ros.arrays import Array
from stickslip_ros.budget import DEFINITION_MOST, SKIPPED, load_json
from stickslip_ros.errors import RecordingError, UnknownName, quoted
from stickslip_ros.interface.cdr import unpack
from stickslip_ros.interface.messages import JOINT_UNITS, JointMessage
from stickslip_ros.message_types import JOINT_STATE
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
from stickslip_ros.recording.definition import (
    ALIGNMENT,
    ArrayOf,
    Definitions,
    Kind,
    Number,
    Struct,
    array_at,
    leaves,
    text_of_idl,
    way_to,
)
from stickslip_ros.recording.integrity import open_whole
from stickslip_ros.recording.layout import TIME_MAX_NS
from stickslip_ros.units import NS_PER_S

PART: Final = re.compile(r'([^\W\d]\w*)((?:\[[^\[\]]+\])*)')
"""A name in the path of a field, with places in arrays: ``position[0]``, ``position[x]``."""
_JOINT_FIRST: Final = re.compile(r'^(\[[^\[\]]+\])\.(\w+)')  # [x].position
_ENCODINGS: Final = 'ros2msg', 'ros2idl', ''
"""Forms in which rosbag2 writes a definition; without one the installed type is read."""
ORDERS: Final = {0: '>', 1: '<'}
"""numpy's names for the byte orders of plain CDR, by the first two bytes of a message."""
_HEAD_BYTES: Final = 4
BLOCK: Final = 1 << 18
"""Messages that are read at once; this bounds the memory."""
LISTED, LEAVES = 20, 1000
"""Largest count of numbers that a refusal lists, and of fields that it searches for them."""


class Joint(str):
    """The name of an element of arrays, as a message has it in its array ``name``."""

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
) -> tuple[Places, Array, Places]:
    """
    Return time, ns, one number, and log time, ns, of each message of a topic, in order of time.

    The time is the stamp of the header if the message has one and it is requested, else the log
    time. A field is a path such as ``point.x``, ``wrench.force.x``, ``data`` or ``position[0]``;
    ``position[x]`` is the number of the joint x. ``in_blocks`` gives all numbers of an array, or
    of a column, at the time of their message. Messages that parts of a run repeat count once. For
    a window, all chunks that may hold messages of these log times are read. RecordingError: a
    message is damaged, or of unknown definition; UnknownName: no such field, or it is no number.

    """
    none = np.empty(0, np.int64)
    found: list[tuple[Places, Array, Places]] = [(none, np.empty(0), none)]
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
                        kind = _field_kind(channel, schema, field, in_blocks)
                        fields[key] = kind(file, channel, schema, field, by_stamp=by_stamp)
                    places = np.flatnonzero(piece.channels[begin:] == key) + begin
                    blocks = (places[at : at + BLOCK] for at in range(0, len(places), BLOCK))
                    found += [fields[key].read(piece, block) for block in blocks]
    if not any(len(values) for _, values, _ in found):
        for each in fields.values():
            each.refuse_absent()
    times_ns, values, logs_ns = map(np.concatenate, zip(*found, strict=True))
    order = np.argsort(times_ns, kind='stable')
    return times_ns[order], values[order], logs_ns[order]


def _field_kind(
    channel: Channel, schema: Schema | None, field: str, in_blocks: bool
) -> 'type[Field]':
    if channel.message_encoding == 'json':
        return JsonField
    is_joint = schema is not None and schema.name == JOINT_STATE and '[' in field
    return BlockField if in_blocks else JointField if is_joint else Field


class Field:
    """A number in the messages of a channel, and their stamp if they have one."""

    def __init__(
        self, file: Path, channel: Channel, schema: Schema | None, field: str, *, by_stamp: bool
    ) -> None:
        self._file, self._topic, self._field = file, channel.topic, field
        path = path_of(channel.topic, field)
        if not schema or channel.message_encoding != 'cdr' or schema.encoding not in _ENCODINGS:
            problem = f'has no definition of {channel.topic} that ROS 2 writes'
            raise RecordingError(file, problem, 'record it with ros2 bag record, or as JSON')
        DEFINITION_MOST.check(len(schema.data), file)
        try:
            text = schema.data.decode() if schema.encoding else ''
            text = text_of_idl(text) if schema.encoding == 'ros2idl' else text
            kind = Definitions(schema.name, text).struct(schema.name)
        except ValueError as error:
            form = schema.encoding or 'no text'
            problem = f'has a definition ({form}) of {channel.topic} that cannot be read: {error}'
            hint = 'source the ROS 2 workspace that has it, or record it anew'
            raise RecordingError(file, problem, hint) from None
        try:
            self._find(kind, path)
        except (LookupError, ValueError):
            some = islice(leaves(kind), LEAVES)
            names = [name for name, leaf in some if isinstance(leaf, Number)]
            with suppress(LookupError):
                array = array_at(kind, path)
                if isinstance(array.element, Number) and array.count != 0:
                    names.append(f'{field} at ...kHz, an array of samples')
            raise self._unknown(names) from None
        self._stamp = None
        if by_stamp:
            with suppress(LookupError):
                parts = 'sec', 'nanosec'
                self._stamp = [way_to(kind, ('header', 'stamp', part)) for part in parts]

    def _find(self, kind: Struct, path: list[str | int]) -> None:
        """Note the way to the number; LookupError if there is none."""
        self._value = way_to(kind, path)

    def _take(self, bodies: 'Bodies') -> tuple[Array, Places]:
        """Return the numbers of messages, and how many each has."""
        values = bodies.number(*self._value)
        return values, np.ones(len(values), np.int64)

    def refuse_absent(self) -> None:
        """Refuse a field that no message had, if some might."""

    def read(self, piece: ChunkMessages, places: Places) -> tuple[Places, Array, Places]:
        """Return time, number and log time of some messages; ValueError if one is damaged."""
        starts, times_ns = piece.starts[places], piece.times_ns[places]
        ends = starts + gather(piece.data, starts - LENGTH_BYTES, '<i8')
        starts = starts + MESSAGE_HEAD.size
        if np.any(ends - starts < _HEAD_BYTES):
            raise ValueError(f'a message on {self._topic} is shorter than its head')
        representations = gather(piece.data, starts, '>u2')
        found = list[tuple[Places, Array, Places]]()
        for each in np.unique(representations).tolist():
            if each not in ORDERS:
                raise ValueError(
                    f'a message on {self._topic} has the encoding {each:#06x}, not plain CDR'
                )
            these = representations == each
            bodies = Bodies(piece.data, starts[these] + _HEAD_BYTES, ends[these], ORDERS[each])
            try:
                values, counts = self._take(bodies)
            except IndexError as error:
                raise UnknownName(f'field of {self._topic}', self._field, str(error)) from None
            known_ns = logs_ns = times_ns[these]
            if self._stamp:
                stamps_ns = self._to_ns(*(bodies.number(*way) for way in self._stamp))
                known_ns = np.where(stamps_ns == 0, logs_ns, stamps_ns)
            found.append((np.repeat(known_ns, counts), values, np.repeat(logs_ns, counts)))
        times_ns, values, logs_ns = map(np.concatenate, zip(*found, strict=True))
        return times_ns, values, logs_ns

    def _unknown(self, names: Iterable[str]) -> UnknownName:
        """Return the refusal of the field, with the numbers that there are."""
        known = [*names]
        listed = ', '.join([*known[:LISTED], *['...'] * (len(known) > LISTED)]) or 'none'
        return UnknownName(f'field of {self._topic}', self._field, f'its numbers are {listed}')

    def _to_ns(self, seconds: NDArray[Any], nanoseconds: NDArray[Any]) -> Places:
        """Return stamps; RecordingError if one is no time."""
        wrong: NDArray[np.bool_] = np.zeros(len(seconds), np.bool_)
        if {seconds.dtype.kind, nanoseconds.dtype.kind} - {'i', 'u'}:
            pairs = zip(seconds.tolist(), nanoseconds.tolist(), strict=True)
            wrong = np.array([{*map(type, each)} != {int} for each in pairs], np.bool_)
        if not wrong.any():
            wrong = (seconds < 0) | (seconds >= TIME_MAX_NS // NS_PER_S)
            wrong |= (nanoseconds < 0) | (nanoseconds >= NS_PER_S)
        if wrong.any():
            at = int(np.argmax(wrong))
            said = f'{quoted(seconds.tolist()[at])} s {quoted(nanoseconds.tolist()[at])} ns'
            problem = f'has the stamp {said} on {self._topic}'
            hint = 'write whole seconds and nanoseconds below 1e9, or 0 for the time of the file'
            raise RecordingError(self._file, problem, hint)
        return seconds.astype(np.int64) * NS_PER_S + nanoseconds.astype(np.int64)


class JointField(Field):
    """A number of a joint, by its name, or by a place that has one name."""

    def _find(self, kind: Struct, path: list[str | int]) -> None:
        self._known = set[str]()
        name, self._place = path
        super()._find(kind, [name, 0])
        self._at = [*JOINT_UNITS].index(str(name))

    def _take(self, bodies: 'Bodies') -> tuple[Array, Places]:
        values, counts, place = list[float](), list[int](), self._place
        for each in bodies.messages():
            message = unpack(JOINT_STATE, each)
            assert isinstance(message, JointMessage)
            names, numbers = message.names, message.arrays[self._at]
            self._known.update(names[place : place + 1] if isinstance(place, int) else names)
            is_there = isinstance(place, int) or place in names
            counts.append(int(is_there))
            if is_there:
                at = place if isinstance(place, int) else names.index(place)
                if at >= len(numbers):
                    raise IndexError(f'the array of a message has {len(numbers)} elements')
                values.append(numbers[at])
        if isinstance(place, int) and len(self._known) > 1:
            known = sorted(self._known)
            problem = f'place {place} of {self._topic} is {" and ".join(known)} in turn'
            ways = ' or '.join(f'{self._topic}[{e}].{[*JOINT_UNITS][self._at]}' for e in known)
            raise RecordingError(self._file, problem, f'name the joint: {ways}')
        return np.array(values), np.array(counts, np.int64)

    def refuse_absent(self) -> None:
        raise self._unknown(f'{[*JOINT_UNITS][self._at]}[{e}]' for e in sorted(self._known))


class BlockField(Field):
    """All numbers of an array, or a column of a table whose layout says how many there are."""

    def _find(self, kind: Struct, path: list[str | int]) -> None:
        column = path.pop() if isinstance(path[-1], int) else None
        self._column = column if isinstance(column, int) else None
        self._value, self._width = way_to(kind, [*path, 0]), None
        self._count = array_at(kind, path).count
        with suppress(LookupError):
            self._width = way_to(kind, [*path[:-1], 'layout', 'dim', 1, 'size'])

    def _take(self, bodies: 'Bodies') -> tuple[Array, Places]:
        values, counts = bodies.block(*self._value, self._count)
        widths = {1}
        with suppress(IndexError):  # without a second axis
            widths = {*bodies.number(*self._width).tolist()} if self._width else widths
        width = max(*widths, 1)
        if self._column is None and (width == 1 or np.all(counts == width)):
            return values, counts
        if len(widths) > 1 or np.any(counts % width) or not (self._column or 0) < width > 1:
            raise IndexError(f'a message is a table of {width} columns, or has none')
        if self._column is None:
            raise IndexError(f'a message is a table of {width} columns; name one, data[0]')
        return values.reshape(-1, width)[:, self._column], counts // width


class JsonField(Field):
    """A number in the messages of a channel in JSON; null is NaN."""

    def __init__(
        self, file: Path, channel: Channel, _schema: Schema | None, field: str, *, by_stamp: bool
    ) -> None:
        self._file, self._topic, self._field = file, channel.topic, field
        self._path, self._by_stamp = path_of(channel.topic, field), by_stamp

    def read(self, piece: ChunkMessages, places: Places) -> tuple[Places, Array, Places]:
        """Return time, number and log time of some messages; refuse one without."""
        times_ns, values, stamps = piece.times_ns[places], np.empty(len(places)), []
        for at, place in enumerate(places.tolist()):
            stop_if_asked()
            message, found = piece.message(place).data, None
            try:
                found = message = load_json(message, self._file)
                for part in self._path:
                    found = found[part]
                values[at] = np.nan if found is None else float(found + 0)  # no text
            except (LookupError, TypeError):
                raise self._unknown(islice(_leaves_in(message), LEAVES)) from None
            except (ValueError, OverflowError):
                problem = f'has a message on {self._topic} that is not JSON'
                raise RecordingError(self._file, problem, 'name another topic') from None
            stamps.append(_stamp_in(message) if self._by_stamp else (0, 0))
        stamps_ns = self._to_ns(*np.array(stamps, object).T)
        return np.where(stamps_ns == 0, times_ns, stamps_ns), values, times_ns


def _stamp_in(message: dict[str, Any]) -> tuple[Any, Any]:
    """Return seconds and nanoseconds, as ROS and Foxglove name them; 0 without a stamp."""
    header = message.get('header')
    stamp = header.get('stamp') if isinstance(header, dict) else message.get('timestamp')
    known = stamp if isinstance(stamp, dict) else {'sec': 0, 'nsec': 0}
    return known.get('sec'), known.get('nanosec', known.get('nsec'))


def _leaves_in(value: Any, name: str = '') -> Iterator[str]:
    """Yield the paths of the numbers in a message."""
    if isinstance(value, dict):
        for key, each in value.items():
            yield from _leaves_in(each, f'{name}.{key}' if name else key)
    elif isinstance(value, list):
        yield from _leaves_in(value[0], f'{name}[0]') if value else ()
    elif isinstance(value, int | float):
        yield name


class Bodies:
    """
    The bodies of several messages of one type and byte order, read at once.

    Places are counted from behind the head of a message, as alignment is. Raises ValueError for a
    message that is too short.

    """

    def __init__(self, data: bytes, starts: Places, ends: Places, order: str) -> None:
        self._data, self._starts, self._sizes, self._order = data, starts, ends - starts, order
        self._texts = count(1)  # that were skipped; those in arrays too
        self._at = np.zeros_like(starts)

    def number(self, before: Sequence[Kind | int], dtype: str) -> NDArray[Any]:
        """Return a number behind the fields before it; IndexError if an array is too short."""
        self._at = np.zeros_like(self._starts)
        for each in before:
            if isinstance(each, Kind):
                self._skip(each)
            elif (shortest := self._read('u4').min()) <= each:
                raise IndexError(f'the array of a message has {shortest} elements')
        return self._read(dtype)

    def block(
        self, before: Sequence[Kind | int], dtype: str, count: int | None
    ) -> tuple[Array, Places]:
        """Return all numbers of an array of ``count``, or of the said length; and how many."""
        self._at = np.zeros_like(self._starts)
        counts = np.full_like(self._starts, count or 0)
        places = [at for at, each in enumerate(before) if not isinstance(each, Kind)]
        for at, each in enumerate(before):
            if isinstance(each, Kind):
                self._skip(each)
                continue
            counts = self._read('u4').astype(np.int64)
            if (count is not None or at != places[-1]) and counts.min() <= each:
                raise IndexError(f'the array of a message has {counts.min()} elements')
        counts = counts if count is None else np.full_like(counts, count)
        size = np.dtype(dtype).itemsize
        self._advance(np.where(counts > 0, -self._at % size, 0))
        begins = self._starts + self._at
        self._advance(counts * size)
        inside = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
        places_of = np.repeat(begins, counts) + size * inside
        return gather(self._data, places_of, self._order + dtype).astype(np.float64), counts

    def messages(self) -> Iterator[bytes]:
        """Yield each with its head."""
        for start, size in zip(self._starts.tolist(), self._sizes.tolist(), strict=True):
            stop_if_asked()
            yield bytes(self._data[start - _HEAD_BYTES : start + size])

    def _read(self, dtype: str) -> NDArray[Any]:
        size = np.dtype(dtype).itemsize
        self._advance(-self._at % size + size)
        return gather(self._data, self._starts + self._at - size, self._order + dtype)

    def _advance(self, by: Places) -> None:
        self._at = self._at + by
        if np.any(self._at > self._sizes):
            raise ValueError('a message is shorter than its fields')

    def _skip(self, kind: Kind) -> None:
        if kind.width is not None:
            self._advance(np.array(kind.width)[self._at % ALIGNMENT])
        elif isinstance(kind, Struct):
            for _, each in kind.fields:
                self._skip(each)
        elif isinstance(kind, ArrayOf):
            is_said = kind.count is None
            counts = self._length() if is_said else np.full_like(self._at, kind.count)
            self._skip_each(kind.element, counts)
        else:
            self._advance(self._length())

    def _length(self) -> Places:
        stop_if_asked()  # each takes a step for all messages
        SKIPPED.check(next(self._texts))
        return self._read('u4').astype(np.int64)

    def _skip_each(self, element: Kind, counts: Places) -> None:
        """Skip an array of a kind whose length each message gives."""
        if element.width is not None:
            width = np.array(element.width)
            first = width[self._at % ALIGNMENT]
            each = width[(self._at + first) % ALIGNMENT]  # of all others
            self._advance(np.where(counts > 0, first + (counts - 1) * each, 0))
            return
        for number in range(int(counts.max())):
            more = counts > number
            starts, sizes = self._starts[more], self._sizes[more]
            part = Bodies(self._data, starts, starts + sizes, self._order)
            part._at, part._texts = self._at[more], self._texts
            part._skip(element)
            self._at[more] = part._at


def path_of(topic: str, field: str) -> list[str | int]:
    """Return the names and places on the way to a number."""
    path: list[str | int] = []
    for part in re.split(r'\.(?![^\[]*\])', _JOINT_FIRST.sub(r'\2\1', field)):
        if (found := PART.fullmatch(part)) is None:
            hint = 'write it as point.x, position[0] or position[JOINT]'
            raise UnknownName(f'field of {topic}', field, hint)
        places = re.findall(r'\[([^\[\]]+)\]', found[2])
        path += [found[1], *(int(e) if e.isdecimal() else Joint(e) for e in places)]
    return path
