# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Read a recording: messages, descriptions, quantities over time."""

import math
from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import suppress
from copy import copy
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import numpy as np
from mcap.records import Message as Stored
from mcap.summary import Summary

from stickslip_ros.budget import NAMES_MOST, load_json
from stickslip_ros.errors import RecordingError, UnknownName
from stickslip_ros.interface.cdr import unpack
from stickslip_ros.interface.messages import ArrayMessage, JointMessage, Message, find_quantity
from stickslip_ros.interface.schemas import SCHEMAS
from stickslip_ros.message_types import (
    FLOAT64_ARRAY,
    JOINT_STATE,
    POINT_STAMPED,
    STRING,
)
from stickslip_ros.process.stopping import stop_if_asked
from stickslip_ros.recording.any_message import FRONTS, numbers_of
from stickslip_ros.recording.bag import bag_parts
from stickslip_ros.recording.chunks import ALL_TIMES_NS, begin_of
from stickslip_ros.recording.copies import DriveClock
from stickslip_ros.recording.integrity import PROFILE, open_whole
from stickslip_ros.recording.layout import Layout
from stickslip_ros.recording.run_file import (
    RUN_RECORD,
    TIME_ORIGIN,
    TOPICS_RECORD,
    run_from_info,
    to_time_ns,
)
from stickslip_ros.recording.series import Series, TraceColumns
from stickslip_ros.recording.storage import CLOSING_RECORD, FIRST_PART, FOLLOWED_BY, PART_RECORD
from stickslip_ros.units import NS_PER_S

INFO_ENDING: Final = '/info'
_SEQUENCE_NUMBERS: Final = 1 << 32
TRACE_ROWS_MAX: Final = 10_000_000
"""Largest number of trace rows read without a window: 200 s at 50 kHz, 0.4 GB."""
MESSAGE_S: Final = 10.0
"""Mean time between messages, s; above this, some times are probably wrong."""
TOPICS_MOST: Final = 100  # from this number on, one pass counts all messages
ALL_S: Final = -math.inf, math.inf
Described = dict[str, dict[str, str]]  # metadata of a file


@dataclass
class ChannelSummary:
    """Content of a topic, counted in file order."""

    topic: str = ''
    type_name: str = ''
    messages: int = 0
    first_ns: int | None = None  # earliest time; None without messages
    last_ns: int | None = None  # latest time
    # Missing sequence numbers: messages lost before the file. None: messages are not numbered.
    gaps: int | None = 0
    first_sequence: int = 0  # number of the first message

    def __post_init__(self) -> None:
        self._sequence: int | None = None

    @property
    def rate_hz(self) -> float:
        """Mean rate from the first to the last message; 0 if undefined."""
        if self.first_ns is None or self.last_ns is None or self.first_ns == self.last_ns:
            return 0.0
        return (self.messages - 1) * NS_PER_S / (self.last_ns - self.first_ns)

    def add_all(self, messages: int, first: Stored, last: Stored, *, origin_ns: int) -> None:
        """Count the messages of a file; times and numbers rise, the first may be repeated."""
        is_repeated = self._sequence == first.sequence
        new = messages - is_repeated
        ends = [last] if is_repeated else [first, last]
        for each in ends[:new]:
            self.add(each.log_time - origin_ns, each.sequence)
        between = new - len(ends[:new])
        self.messages += between
        if self.gaps is not None:
            self.gaps -= between

    def add(self, time_ns: int, sequence: int) -> None:
        """Count a message; repeated or falling numbers count as no gap."""
        self.first_ns = time_ns if self.first_ns is None else min(self.first_ns, time_ns)
        self.last_ns = time_ns if self.last_ns is None else max(self.last_ns, time_ns)
        if self._sequence is None:
            self.first_sequence, self._sequence = sequence, sequence - 1
        step = (sequence - self._sequence) % _SEQUENCE_NUMBERS
        lost = (self.gaps or 0) + (step - 1 if 0 < step < _SEQUENCE_NUMBERS // 2 else 0)
        self.gaps = lost if sequence or self._sequence else lost or None
        self.messages += 1
        self._sequence = sequence


class Recording:
    """
    A finished MCAP recording: one file, numbered parts of a run, or a bag directory.

    Files are opened for each call and closed after it. The end of a topic's name is enough:
    ``position`` finds ``/stand/position``, the shortest name with this end. All times are
    simulated time: log time less the time origin. A bag that rosbag2 made of a drive of this
    package has no sequence numbers; its parameters are taken from ``~/info``, and its log times
    are converted by the stamps of the readings. Raises RecordingError if the recording is
    missing, cut off, damaged or no recording of ROS 2; damage may be found only when that part
    is read.

    """

    def __init__(self, path: str | Path, origin: str = '') -> None:
        self.path = Path(path)
        self.origin = origin or str(path)  # name shown to users
        self.files = _find_parts(self.path)
        self.metadata: Described = {}
        self.attachments: dict[str, tuple[str, bytes]] = {}
        self.types: dict[str, str] = {}
        self._counts: list[dict[str, int]] = []  # messages by topic of each file with statistics
        # First and last log time of each file that has messages.
        self._spans_ns: list[tuple[int, int] | None] = []
        described = [self._describe(file) for file in self.files]
        for file, own in zip(self.files, described, strict=True):
            self.metadata |= own
            self._check_part(file, described[0], own)
        self._repeats = PART_RECORD in self.metadata
        self.window_s = ALL_S
        self.lost = Counter[str]()  # rows of traces read in all windows, less the rows inside
        if self._repeats and not self.path.exists():  # the path is the parts' common name
            layout = Layout.plan(self.path, split=True)
            oldest = layout.part(self.metadata[PART_RECORD].get(FIRST_PART, 0))
            if self.files[0] not in (layout.part(0), oldest):
                raise _missing_part(oldest)
        follower = described[-1].get(CLOSING_RECORD, {}).get(FOLLOWED_BY, '')
        if follower and self.path not in self.files:
            raise _missing_part(self.files[-1].with_name(follower))
        self.is_copy = False  # a drive of this package, another program's recorder
        self.is_copy = not self.is_ours and self._adopt()

    def _adopt(self) -> bool:
        """Take parameters and topics from a recorded ``~/info``; return whether there is one."""
        runs = {}
        for topic, text in self._infos():
            if topic not in runs and (run := run_from_info(topic, text)):
                runs[topic] = run
        for metadata, attachments in runs.values() if len(runs) == 1 else ():
            self.metadata |= metadata
            self.attachments |= attachments
        return len(runs) == 1

    def _infos(self) -> Iterator[tuple[str, str]]:
        """Yield topic and text of each message on a ``~/info``, in the order of time."""
        texts = [name for name, kind in self.types.items() if kind == STRING]
        infos = [name for name in texts if name.endswith(INFO_ENDING)]
        for kind, topic, message in self._stored(infos, in_time_order=True) if infos else ():
            text = None
            with suppress(ValueError, RecordingError):  # maybe another program's topic
                text = str(unpack(kind, message.data))
            if text is not None:
                yield topic, text

    @property
    def _is_by_us(self) -> bool:
        """Whether a recorder of this package wrote it, with numbers and the drive's times."""
        return self.is_ours and not self.is_copy

    @cached_property
    def _clock(self) -> DriveClock | None:
        """Clock of the drive; None if log times are its simulated time."""
        if not self.is_copy:
            return None
        topics = self.metadata[TOPICS_RECORD]
        kinds = {'position': POINT_STAMPED, 'trace': FLOAT64_ARRAY}
        names = {key: load_json(topics[key])['topic'] for key in kinds}
        there = {each: name for each, name in names.items() if self.types.get(name) == kinds[each]}
        return DriveClock.fit(self.files, there, self.time_origin_ns)

    def drive_times(self, log_ns: Any) -> Any:
        """Convert log times to the times at which the drive sent the messages, ns."""
        return log_ns if self._clock is None else self._clock.drive_times(log_ns)

    def _check_part(self, file: Path, first: Described, own: Described) -> None:
        """Refuse a part of another run, or a part out of order."""
        place, runs = self.files.index(file), [each.get(RUN_RECORD, {}) for each in (own, first)]
        if self._spans_ns[place] is None:  # it has no messages
            return
        if runs[0] != runs[1]:
            origins = ', not '.join(each.get(TIME_ORIGIN, 'unknown') for each in runs)
            problem = f'it is of another run than {self.files[0].name} (time origin {origins} ns)'
            raise RecordingError(file, problem, 'move it away, or open it as a single file')
        parts = [each.get(PART_RECORD, {}).get('part', '')[:9] for each in (own, first)]
        if all(map(str.isdecimal, parts)) and int(parts[0]) != int(parts[1]) + place:
            problem = f'it is part {parts[0]} in the place of part {int(parts[1]) + place}'
            raise RecordingError(
                file, problem, 'restore the missing part or the order of the parts'
            )

    def _describe(self, file: Path) -> Described:
        """Read a file's summary, attachments and metadata; return the metadata."""
        with open_whole(file) as reader:
            reader.check()
            summary = reader.get_summary()
            profile = reader.get_header().profile
            encodings = {each.encoding for each in summary.schemas.values()}
            encodings |= {each.message_encoding for each in summary.channels.values()}
            # Some programs name no profile; then schemas, or JSON messages, decide.
            if profile != PROFILE and (profile or not encodings & {'ros2msg', 'ros2idl', 'json'}):
                raise RecordingError(
                    file,
                    f'it is an MCAP file of profile {profile!r}, not a recording of ROS 2',
                    'export its columns as CSV with the program that wrote it: fit and compare '
                    'read tables',
                )
            self._take_summary(summary)
            own = {each.name: dict(each.metadata) for each in reader.iter_metadata()}
            if file == self.files[0]:
                self.attachments = {
                    each.name: (each.media_type, each.data) for each in reader.iter_attachments()
                }
            NAMES_MOST.check(max(len(self.types), len(own), *map(len, own.values())), file)
        return own

    def _take_summary(self, summary: Summary) -> None:
        """Add the types, the span and the counts of a file."""
        schemas = {0: '', **{key: each.name for key, each in summary.schemas.items()}}
        by_channel = summary.statistics.channel_message_counts if summary.statistics else {}
        # A chunk without messages has no end.
        chunks = [each for each in summary.chunk_indexes if each.message_end_time]
        begins_ns = [each.message_start_time for each in chunks]
        ends_ns = [each.message_end_time for each in chunks]
        self._spans_ns.append((min(begins_ns), max(ends_ns)) if chunks else None)
        counts = Counter[str]()
        for channel in summary.channels.values():
            self.types.setdefault(channel.topic, schemas[channel.schema_id])
            counts[channel.topic] += by_channel.get(channel.id, 0)
        self._counts.append(dict(counts) if by_channel else {})

    @cached_property
    def time_origin_ns(self) -> int:
        """Time origin of the run; 0 if it is neither in metadata nor in a recorded ``~/info``."""
        text = self.metadata.get(RUN_RECORD, {}).get(TIME_ORIGIN)
        if text is None:  # take the first drive with a time origin
            for _, info in self._infos():
                with suppress(ValueError, TypeError, KeyError, RecursionError, RecordingError):
                    return to_time_ns(load_json(info)[TIME_ORIGIN])
            return 0
        try:
            return to_time_ns(text)
        except ValueError:
            problem, hint = f'has the time origin {text!r}', 'record with a drive of this package'
            raise RecordingError(self.path, problem, hint) from None

    @cached_property
    def span_s(self) -> tuple[float, float]:
        """First and last time of all messages, s; NaN if there are none."""
        spans_ns = [each for each in self._spans_ns if each]
        if not spans_ns:
            return math.nan, math.nan
        ends_ns = min(spans_ns)[0], max(end_ns for _, end_ns in spans_ns)
        first_ns, last_ns = (int(self.drive_times(each)) for each in ends_ns)
        origin_ns = self.time_origin_ns
        return (first_ns - origin_ns) / NS_PER_S, (last_ns - origin_ns) / NS_PER_S

    @property
    def notes(self) -> list[str]:
        """Return a warning if messages are more than 10 s apart on average."""
        messages, (first_s, last_s) = sum(sum(each.values()) for each in self._counts), self.span_s
        if self.window_s != ALL_S or not last_s - first_s > MESSAGE_S * messages > 0:
            return []
        span = f'{messages} messages lie between {first_s:.6g} s and {last_s:.6g} s'
        return [f'{span}: some times are probably wrong; leave those messages out with --window']

    def within(self, start_s: float, end_s: float) -> 'Recording':
        """
        Return the recording with ``series`` and ``trace`` of a window, both ends included.

        Of a recording of this package only the chunks of the window are read.

        """
        part = copy(self)
        part.window_s = start_s, end_s
        return part

    def cuts_s(self, size_bytes: int) -> list[float]:
        """Return times, s, that cut the recording into pieces of at most this size, or a chunk."""
        cuts_ns, piece_bytes = set[int](), 0
        for file in self.files if self._clock is None else ():
            with open_whole(file) as reader:
                for chunk in sorted(reader.get_summary().chunk_indexes, key=begin_of):
                    piece_bytes += chunk.uncompressed_size
                    if piece_bytes > size_bytes:
                        cuts_ns.add(chunk.message_start_time)
                        piece_bytes = chunk.uncompressed_size
        return [(each - self.time_origin_ns) / NS_PER_S for each in sorted(cuts_ns)]

    @property
    def is_ours(self) -> bool:
        """Whether a drive of this package sent the messages."""
        return RUN_RECORD in self.metadata

    def _window_ns(self, *, is_open: bool) -> tuple[int, int]:
        """Return the range of log times of messages in the window."""
        start_s, end_s = self.window_s
        if not self.is_ours or self._clock:  # its messages count at their stamps
            return ALL_TIMES_NS
        first_ns, last_ns = ALL_TIMES_NS
        if not math.isinf(start_s):
            first_ns = math.floor(start_s * NS_PER_S) + self.time_origin_ns
        if not (is_open or math.isinf(end_s)):
            last_ns = math.ceil(end_s * NS_PER_S) + self.time_origin_ns
        return first_ns, last_ns

    def _files_within(self, window_ns: tuple[int, int]) -> list[Path]:
        """Return the files that may hold messages of these log times."""
        return [
            file
            for file, span_ns in zip(self.files, self._spans_ns, strict=True)
            if span_ns is None or (span_ns[0] <= window_ns[1] and window_ns[0] <= span_ns[1])
        ]

    @cached_property
    def channels(self) -> list[ChannelSummary]:
        """
        Content of each topic, in the order of the file.

        A run of this package needs only the first and the last message of each topic; other
        recordings, and those with many topics, take one pass over all messages.

        """
        summaries = {topic: ChannelSummary(topic, kind) for topic, kind in self.types.items()}
        is_numbered = self._is_by_us
        if not (is_numbered and all(self._counts) and len(summaries) < TOPICS_MOST):
            for topic, message in self.records():
                time_ns = message.log_time - self.time_origin_ns
                summaries[topic].add(time_ns, message.sequence)
                is_numbered |= message.sequence > 0
            for each in summaries.values():
                if each.messages and not is_numbered:  # a single 0 does not count
                    each.gaps = None
            return list(summaries.values())
        for file, counts in zip(self.files, self._counts, strict=True):
            with open_whole(file) as reader:
                for topic, count in counts.items():
                    if ends := reader.ends(topic) if count else []:
                        summaries[topic].add_all(count, *ends, origin_ns=self.time_origin_ns)
        return list(summaries.values())

    def messages(self, topics: Iterable[str] | None = None) -> Iterator[tuple[str, int, Message]]:
        """Yield topic, simulated time in ns and message, in the order of their times."""
        if topics is None:
            return self._read([name for name, kind in self.types.items() if kind in SCHEMAS])
        return self._read([self.find(topic) for topic in topics])

    def series(self, topic: str, field: str = '') -> Series:
        """
        Return one quantity over time, by log time for a run of this package.

        In a recording of another program the stamp of a message counts, if there is one, because
        the log time may be much later. Raises UnknownName if the topic or the field is unknown.

        """
        name = self.find(topic)
        if self.types[name] == FLOAT64_ARRAY:
            columns = self.trace(name)
            if columns and field in ('', *columns):
                return columns[field or next(iter(columns))]
            known = ', '.join(columns) or 'no samples'
            raise UnknownName(f'column of {name}', field, f'this recording has {known}')
        type_name = self.types[name]
        quantity, by_us = find_quantity(name, type_name, field), self._is_by_us
        if type_name == JOINT_STATE:
            pairs = [
                (at_ns if by_us else each.stamp_ns - self.time_origin_ns, quantity.of(each))
                for _, at_ns, each in self._read([name])
                if isinstance(each, JointMessage)
            ]
            times_ns = np.array([time for time, _ in pairs], dtype=np.int64)
            values = np.array([value for _, value in pairs], dtype=np.float64)
        else:
            path = FRONTS.get(type_name, '') + quantity.name
            window_ns = self._window_ns(is_open=False)
            times_ns, values, _ = numbers_of(
                self._files_within(window_ns),
                name,
                path,
                by_stamp=not by_us,
                repeats=self._repeats,
                window_ns=window_ns,
            )
            has_stamp = type_name in FRONTS
            times_ns = times_ns if has_stamp else self.drive_times(times_ns)
            times_ns = times_ns - self.time_origin_ns
        series = Series(times_ns / NS_PER_S, values, quantity.unit, self._origin(name))
        return series.window(*self.window_s)

    def trace(self, topic: str = 'trace') -> dict[str, Series]:
        """
        Return all columns of a trace by name: ``voltage``, ``foot``, ``position``, ``force``.

        RecordingError: the trace has more than TRACE_ROWS_MAX rows, and there is no window.

        """
        name = self.find(topic)
        columns = None
        # A block is sent after its last sample.
        window_ns = self._window_ns(is_open=True)
        start_s, end_s = self.window_s
        for kind, _, message in self._stored([name], window_ns, in_time_order=True):
            if kind != FLOAT64_ARRAY:
                continue
            each = unpack(kind, message.data)
            assert isinstance(each, ArrayMessage)
            at_s = (message.log_time - self.time_origin_ns) / NS_PER_S
            if self.is_ours and each.data.ndim == 2 and at_s > end_s and each.data[0, 0] > end_s:
                break
            self.lost[name] += len(each.data) * (start_s <= at_s <= end_s)
            if columns is None:
                columns = TraceColumns(self._origin(name), self._rows_ahead(name, len(each.data)))
            columns.add(each)
        joined = columns.series() if columns else {}
        found = {key: each.window(start_s, end_s) for key, each in joined.items()}
        self.lost[name] -= max(map(len, found.values()), default=0)
        return found

    def _rows_ahead(self, topic: str, block_rows: int) -> int:
        """Return the number of rows of a whole trace, or refuse it; 0 for a window."""
        if self.window_s != ALL_S:
            return 0
        rows = block_rows * sum(each.get(topic, 0) for each in self._counts)
        if rows > TRACE_ROWS_MAX:
            problem = (
                f'has {rows} rows of {topic}, above the {TRACE_ROWS_MAX} that are held at once'
            )
            hint = 'take a stretch: --window 10s@60s, in Python window_s=(60.0, 70.0)'
            raise RecordingError(self.path, problem, hint)
        return rows

    def find(self, name: str) -> str:
        """Return the full name of a topic by its end; refuse an unknown or ambiguous end."""
        if name in self.types:
            return name
        ending = '/' + name.lstrip('/')

        def depth(topic: str) -> int:
            return topic.count('/')

        found = sorted((t for t in self.types if t.endswith(ending)), key=depth)
        if not found:
            raise UnknownName('topic', name, f'{self.path.name} has {", ".join(self.types)}')
        if len(found) > 1 and depth(found[0]) == depth(found[1]):
            raise RecordingError(self.path, f'{name} may be {" or ".join(found)}', 'name one')
        return found[0]

    def records(self, topics: list[str] | None = None) -> Iterator[tuple[str, Stored]]:
        """Yield topic and stored message of some topics or all, in file order."""
        for _, topic, message in self._stored(topics, in_time_order=False):
            yield topic, message

    def _read(
        self, topics: list[str], window_ns: tuple[int, int] = ALL_TIMES_NS
    ) -> Iterator[tuple[str, int, Message]]:
        for type_name, topic, message in self._stored(topics, window_ns, in_time_order=True):
            time_ns = message.log_time - self.time_origin_ns
            yield topic, time_ns, unpack(type_name, message.data)

    def _stored(
        self,
        topics: list[str] | None,
        window_ns: tuple[int, int] = ALL_TIMES_NS,
        *,
        in_time_order: bool,
    ) -> Iterator[tuple[str, str, Stored]]:
        """Yield type, topic and message, file by file; skip messages repeated in parts."""
        last: dict[str, int] = {}
        for file in self._files_within(window_ns):
            before = dict(last) if self._repeats else {}
            with open_whole(file) as reader:
                for schema, channel, message in reader.messages(
                    topics, window_ns, in_time_order=in_time_order
                ):
                    stop_if_asked()
                    if before.pop(channel.topic, None) == message.sequence:
                        continue
                    last[channel.topic] = message.sequence
                    if self.is_copy:
                        message.log_time = int(self.drive_times(message.log_time))
                    yield schema.name if schema else '', channel.topic, message

    def _origin(self, topic: str) -> str:
        return f'{self.path.name} {topic}'


def _find_parts(path: Path) -> list[Path]:
    """Return the files of a recording in the order of time; refuse a missing file."""
    if path.is_dir():
        return bag_parts(path)
    if path.exists():
        return [path]
    layout = Layout.plan(path, split=True)
    parts = layout.parts()
    first = int(parts[0].stem.rpartition('_')[2]) if parts else 0
    for number, part in enumerate(parts, first):
        if part != layout.part(number):
            raise _missing_part(layout.part(number))
    return parts or [path]


def _missing_part(path: Path) -> RecordingError:
    return RecordingError(
        path, 'this part of the run is missing', 'put it back, or open parts one by one'
    )
