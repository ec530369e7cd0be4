# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Makes the rest of an unfinished, cut or damaged recording readable: a new file beside it."""

import json
import os
import shutil
from bisect import bisect_right
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO, Final

import numpy as np
from mcap import records as r
from mcap.data_stream import RecordBuilder
from mcap.exceptions import EndOfFile
from mcap.opcode import Opcode
from mcap.stream_reader import StreamReader
from mcap.summary import Summary
from mcap.writer import Writer

from stickslip_ros.errors import RecordingError
from stickslip_ros.files import readable
from stickslip_ros.process.stopping import stop_if_asked
from stickslip_ros.recording.bag import bag_parts, files_of_a_bag, refuse_sqlite, write_metadata
from stickslip_ros.recording.chunks import (
    CHUNK_MAX_BYTES,
    MAGIC,
    RECORD_HEAD,
    find_messages,
    unpack_chunk,
)
from stickslip_ros.recording.integrity import (
    CRC_BYTES,
    DAMAGE,
    PROFILE,
    SQLITE_MAGIC,
    open_whole,
    sqlite_refusal,
)
from stickslip_ros.recording.layout import SUFFIX, Layout
from stickslip_ros.recording.reader import ChannelSummary
from stickslip_ros.recording.run_file import RUN_RECORD, TIME_ORIGIN, to_time_ns

RECOVERY_RECORD: Final = 'stickslip_recovery'
"""Metadata record in which a recovered file says what it was made of and what is lost."""
MARK: Final = '.recovered'  # what is added to the name of a recovered file or directory
_KINDS: Final = {int(each): each.name.lower().replace('_', ' ') for each in Opcode}


@dataclass(frozen=True)
class Loss:
    """Bytes that cannot be read, what is wrong with them, and their times if the index has any."""

    offset: int
    size_bytes: int
    problem: str
    first_ns: int | None = None
    last_ns: int | None = None


@dataclass
class Recovery:
    """What could be read of a file, and what became of it; times are simulated time."""

    source: str
    size_bytes: int
    is_whole: bool = True  # nothing was to recover; then all but the number of messages is empty
    output: str = ''  # the readable copy
    lost_bytes: int = 0
    messages: int = 0  # that were read
    unchecked: int = 0  # of them, covered by no checksum
    last_ns: int | None = None  # time of the last message that was read
    topics: list[ChannelSummary] = field(default_factory=list)
    losses: list[Loss] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)  # what the list of losses does not say


def recover(path: Path, output: Path | None = None) -> tuple[list[Recovery], Path | None]:
    """Make a recording readable beside the original; return what became of its files and where."""
    is_bag = path.is_dir()
    if is_bag:
        refuse_sqlite(path)
        path = path if path.name else path.resolve()  # the directory in which one is
        if not path.name:
            raise RecordingError(path, 'it is no bag', 'name the directory of a bag')
    layout = Layout.plan(path, bag=is_bag, split=True)
    parts = [] if path.is_file() else layout.parts()
    if is_bag and not (parts := parts or files_of_a_bag(path)):
        raise RecordingError(path, 'there is no MCAP file in it', 'name the directory of a bag')
    name = f'{path.name}{MARK}' if is_bag else f'{layout.stem}{MARK}{SUFFIX}'
    target = output or path.with_name(name)
    if not parts:
        recovery = recover_file(path, target)
        return [recovery], None if recovery.is_whole else target
    copy = Layout.plan(target, bag=is_bag, split=True)
    copy.refuse_existing()
    recoveries = [recover_file(part, copy.part(n), is_part=True) for n, part in enumerate(parts)]
    if all(recovery.is_whole for recovery in recoveries):
        written = None
        if is_bag:
            try:
                bag_parts(path)
            except RecordingError:
                written = write_metadata(path, parts)
        return recoveries, written
    for number, recovery in enumerate(recoveries):
        if recovery.is_whole:
            with _new_file(copy.part(number)) as new, Path(recovery.source).open('rb') as old:
                shutil.copyfileobj(old, new)
    if is_bag:
        write_metadata(copy.folder, copy.parts())
    return recoveries, copy.path


def recover_file(source: Path, output: Path, *, is_part: bool = False) -> Recovery:
    """Write what can be read of a file, if it is not whole, to a new one, finished and indexed."""
    try:
        with readable(source).open('rb') as stream:
            result = Recovery(str(source), stream.seek(0, os.SEEK_END))
            if (messages := _messages_if_whole(source)) is not None:
                result.messages = messages
                return result
            with _new_file(output) as target:
                result.is_whole, result.output = False, str(output)
                if not Copy(source, stream, target, result).write() and not is_part:
                    stream.seek(0)
                    begin = stream.read(len(SQLITE_MAGIC))
                    if begin == SQLITE_MAGIC:
                        raise sqlite_refusal(source)
                    problem = 'it is not an MCAP file' if begin else 'it is empty'
                    if begin.startswith(MAGIC):
                        problem = 'it ends before its first record'
                    raise RecordingError(source, problem, 'there is nothing in it to recover')
            return result
    except OSError as error:
        problem = f'it cannot be read ({error.strerror})'
        raise RecordingError(source, problem, 'name an MCAP file or a bag directory') from error


def _messages_if_whole(path: Path) -> int | None:
    """Return how many messages a file has of which every byte is as its checksums say, or None."""
    try:
        with open_whole(path, checks_data=True) as reader:
            messages = sum(len(piece.starts) for piece in reader.pieces())
            said = reader.get_summary().statistics
            list(reader.iter_metadata())
            list(reader.iter_attachments())
    except RecordingError:
        return None
    return messages if said is None or said.message_count == messages else None


@contextmanager
def _new_file(path: Path) -> Iterator[BinaryIO]:
    """Make a file that does not exist yet; one that cannot be completed is taken away again."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        stream = path.open('xb')
        try:
            with stream:
                yield stream
                stream.flush()
                os.fsync(stream.fileno())
        except BaseException:
            path.unlink()
            raise
    except FileExistsError as error:
        problem, hint = 'it exists and is not overwritten', 'choose another name with -o'
        raise RecordingError(path, problem, hint) from error
    except OSError as error:
        problem = f'it cannot be written ({error.strerror})'
        raise RecordingError(path, problem, 'choose another place with -o') from error


class Copy:
    """
    A new file with what is whole in another one.

    That is what stands before the first damage and, where the index at the end is whole, each
    chunk, attachment and metadata record that it lists behind the damage.

    """

    def __init__(self, source: Path, stream: BinaryIO, target: BinaryIO, result: Recovery) -> None:
        self._stream, self._result = stream, result
        self._index, header = Summary(), None
        with suppress(RecordingError), open_whole(source) as reader:
            self._index = reader.get_summary()
        with suppress(*DAMAGE):
            header, _ = self._read(len(MAGIC))
        self._header = header if isinstance(header, r.Header) else None
        self._writer = Writer(target, enable_data_crcs=True)
        self._writer.start(self._header.profile if self._header else PROFILE)
        self._schemas: dict[int, tuple[int, str]] = {}  # number in the copy, and name
        self._channels: dict[int, tuple[int, ChannelSummary]] = {}
        self._origin_ns = 0
        for each in (*self._index.schemas.values(), *self._index.channels.values()):
            self._add(each)

    def write(self) -> bool:
        """Write what is whole, and say what is lost; return whether there was anything."""
        chunks = {each.chunk_start_offset: each for each in self._index.chunk_indexes}
        listed: list[Any] = [*self._index.attachment_indexes, *self._index.metadata_indexes]
        size = self._result.size_bytes
        places = {*chunks, *(at + each.chunk_length for at, each in chunks.items())}
        places |= {each.offset for each in listed}
        starts = sorted({size, *(each for each in places if each < size)})
        at, record, is_empty = len(MAGIC), None, True
        while at < size and not isinstance(record, r.DataEnd):
            stop_if_asked()
            try:
                record, end = self._read(at)
                self._add(record)
                is_empty = False
            except DAMAGE as error:
                is_cut, index = isinstance(error, EndOfFile), chunks.get(at)
                ends = (index.message_start_time, index.message_end_time) if index else ()
                kind = _KINDS.get(self._bytes(at, 1)[0], 'bytes')
                problem = 'cut off, or a length in it is wrong' if is_cut else f'damaged ({error})'
                end = starts[bisect_right(starts, at)]
                times_ns = (each - self._origin_ns for each in ends)
                self._result.losses.append(Loss(at, end - at, f'{kind} {problem}', *times_ns))
            at = end
        self._account()
        self._writer.finish()  # type: ignore[no-untyped-call]
        return not is_empty

    def _bytes(self, start: int, size_bytes: int) -> bytes:
        """Return bytes of the original; fewer at its end."""
        self._stream.seek(start)
        return self._stream.read(size_bytes)

    def _end_of(self, start: int) -> int:
        """Return where the record that begins here ends; ValueError if none can begin here."""
        head = self._bytes(start, RECORD_HEAD.size)
        opcode, length = RECORD_HEAD.unpack(head.ljust(RECORD_HEAD.size, b'\1'))
        if len(head) == RECORD_HEAD.size and (opcode not in _KINDS or length > CHUNK_MAX_BYTES):
            raise ValueError('no record begins here')
        return start + RECORD_HEAD.size + int(length)

    def _read(self, start: int) -> tuple[r.McapRecord, int]:
        """
        Return the record that begins here, and where it ends; DAMAGE if it is not whole.

        It is if writing it again gives the same bytes: then every length inside it agrees with
        every other one, and the checksum of an attachment is right, unless it has none. Behind a
        message, which has none, another record must begin.

        """
        if (end := self._end_of(start)) > self._result.size_bytes:
            raise EndOfFile
        content = self._bytes(start, end - start)
        record, builder = _parse(content), RecordBuilder()
        record.write(builder)
        written = bytes(builder.end())  # type: ignore[no-untyped-call]
        if isinstance(record, r.Attachment) and not any(content[-CRC_BYTES:]):
            content, written = content[:-CRC_BYTES], written[:-CRC_BYTES]
        if written != content:
            raise ValueError('its lengths or its checksum are wrong')
        if isinstance(record, r.Message):
            self._end_of(end)
        return record, end

    def _add(self, record: r.McapRecord) -> None:
        """Write a record; of two descriptions of one thing the first one counts."""
        match record:
            case r.Chunk():
                piece = find_messages(unpack_chunk(record), 0)
                for each in piece.descriptions():
                    self._add(_parse(each))
                unknown = {*map(int, np.unique(piece.channels))} - self._channels.keys()
                if unknown:
                    raise ValueError(f'nothing says what its channel {min(unknown)} is')
                for place in range(len(piece.starts)):
                    self._add(piece.message(place))
                self._result.unchecked -= len(piece.starts) if record.uncompressed_crc else 0
            case r.Message():
                number, summary = self._channels[record.channel_id]
                self._writer.add_message(
                    number, record.log_time, record.data, record.publish_time, record.sequence
                )
                summary.add(record.log_time - self._origin_ns, record.sequence)
                self._result.unchecked += 1
            case r.Schema() if record.id not in self._schemas:
                number = self._writer.register_schema(record.name, record.encoding, record.data)
                self._schemas[record.id] = number, record.name
            case r.Channel() if record.id not in self._channels:
                schema, name = self._schemas.get(record.schema_id, (0, ''))
                number = self._writer.register_channel(
                    record.topic, record.message_encoding, schema, record.metadata
                )
                self._channels[record.id] = number, ChannelSummary(record.topic, name)
            case r.Metadata():
                self._writer.add_metadata(record.name, record.metadata)
                if record.name == RUN_RECORD:
                    with suppress(KeyError, ValueError):
                        self._origin_ns = to_time_ns(record.metadata[TIME_ORIGIN])
            case r.Attachment():
                said = record.name, record.media_type, record.data
                self._writer.add_attachment(record.create_time, record.log_time, *said)

    def _account(self) -> None:
        """Say in the copy, and to who asked for it, what was read and what is lost."""
        result = self._result
        result.topics = [each for _, each in self._channels.values()]
        result.lost_bytes = sum(each.size_bytes for each in result.losses)
        result.messages = sum(each.messages for each in result.topics)
        lasts_ns = [each.last_ns for each in result.topics if each.last_ns is not None]
        result.last_ns = max(lasts_ns, default=None)
        is_indexed = bool(self._index.statistics or self._index.chunk_indexes)
        is_finished = self._bytes(max(result.size_bytes - len(MAGIC), 0), len(MAGIC)) == MAGIC
        notes = {
            'it was not finished: what came after its last chunk was never written': (
                not is_finished
            ),
            'its index is missing or damaged, and was made anew': is_finished and not is_indexed,
            'every chunk is whole, but a byte outside of them is wrong: look at metadata and '
            'names': is_indexed and not result.losses,
            'its header is lost: ROS 2 is assumed': self._header is None,
        }
        result.notes = [note for note, applies in notes.items() if applies]
        said = {**asdict(result), 'source': Path(result.source).name, 'output': ''}
        account = {name: json.dumps(each) for name, each in said.items()}
        self._writer.add_metadata(RECOVERY_RECORD, account)


def _parse(content: bytes) -> r.McapRecord:
    stream = BytesIO(content)
    reader = StreamReader(stream, skip_magic=True, emit_chunks=True, record_size_limit=None)
    return next(reader.records)
