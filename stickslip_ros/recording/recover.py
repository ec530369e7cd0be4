"""Makes the rest of an unfinished, cut or damaged recording readable: a new file beside it."""

import os
import re
import shutil
import struct
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO, Final, NamedTuple

from mcap import records as r
from mcap.data_stream import RecordBuilder
from mcap.exceptions import EndOfFile
from mcap.opcode import Opcode
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.writer import Writer

from stickslip_ros.errors import RecordingError
from stickslip_ros.files import readable
from stickslip_ros.process.stopping import stop_if_asked
from stickslip_ros.recording.bag import bag_parts, refuse_sqlite, write_metadata
from stickslip_ros.recording.integrity import (
    CRC_BYTES,
    DAMAGE,
    MAGIC,
    PROFILE,
    SQLITE_MAGIC,
    open_whole,
    sqlite_refusal,
)
from stickslip_ros.recording.layout import SUFFIX, Layout
from stickslip_ros.recording.reader import ChannelSummary
from stickslip_ros.recording.run_file import RUN_RECORD, TIME_ORIGIN

RECOVERY_RECORD: Final = 'stickslip_recovery'
"""Metadata record in which a recovered file says what it was made of and what is lost."""
MARK: Final = '.recovered'  # what is added to the name of a recovered file or directory
BLOCK_BYTES: Final = 1 << 20  # what is read at once where a chunk is looked for
RECORD_MAX_BYTES: Final = 1 << 30
"""A record that says that it is longer counts as damaged: it would have to fit into the memory."""

_HEAD: Final = struct.Struct('<BQ')
_CHUNK_HEAD_BYTES: Final = 45  # from the opcode to the name of the compression
_CHUNK_TIMES: Final = struct.Struct('<BQQQ')  # opcode, length, first and last time
_CHUNK_START: Final = re.compile(
    rb'\x06(?=.{5}\x00{3}.{28}(?:\x00{4}|\x03\x00{3}lz4|\x04\x00{3}zstd))', re.DOTALL
)
"""Opcode and length of a chunk, and a compression that exists."""


@dataclass(frozen=True)
class Loss:
    """Bytes that cannot be read, what is wrong with them, and the times that they still tell."""

    offset: int
    size_bytes: int
    problem: str
    first_ns: int | None = None
    last_ns: int | None = None


class Found(NamedTuple):
    """A record, or those of a chunk, and where they end."""

    records: Sequence[r.McapRecord]
    end: int
    chunk: r.Chunk | None = None


class Scan:
    """What stands in a file and what is lost of it, in order; it goes on behind each fault."""

    def __init__(self, stream: BinaryIO) -> None:
        self._stream = stream
        self.size_bytes = stream.seek(0, os.SEEK_END)
        self._has_chunks = False

    def __iter__(self) -> Iterator[Found | Loss]:
        start = len(MAGIC)
        while start < self.size_bytes:
            stop_if_asked()
            try:
                found = self._read(start)
            except DAMAGE as error:
                end = self._next(start)
                yield self._loss(start, end, error)
            else:
                end = found.end
                yield found
                self._has_chunks |= found.chunk is not None
                if isinstance(found.records[0], r.Footer):
                    if self.bytes_at(end, len(MAGIC) + 1) != MAGIC:
                        yield Loss(end, self.size_bytes - end, 'the end is damaged')
                    return
            start = end

    def bytes_at(self, start: int, size_bytes: int) -> bytes:
        """Return bytes of the file; fewer at its end."""
        self._stream.seek(start)
        return self._stream.read(size_bytes)

    def _end_of(self, start: int) -> int | None:
        """Return where the record that begins here ends, or is cut off; None where none can be."""
        head = self.bytes_at(start, _HEAD.size)
        if len(head) < _HEAD.size:
            return self.size_bytes
        opcode, length = _HEAD.unpack(head)
        is_record = Opcode.HEADER <= opcode <= Opcode.DATA_END and length <= RECORD_MAX_BYTES
        return start + _HEAD.size + int(length) if is_record else None

    def _read(self, start: int) -> Found:
        """
        Read the record or the chunk that begins here.

        A record is taken only if writing it again gives the same bytes: then every length inside
        it agrees with every other one, and the checksum of an attachment is right, unless it has
        none. A chunk without checksum must be understood to its last byte. Raises DAMAGE if there
        is none that is whole.

        """
        end = self._end_of(start)
        if end is None or end > self.size_bytes:
            raise EndOfFile
        content = self.bytes_at(start, end - start)
        reader = StreamReader(
            BytesIO(content), skip_magic=True, emit_chunks=True, record_size_limit=None
        )
        record = next(reader.records)
        written = _encode(record)
        if isinstance(record, r.Attachment) and not any(content[-CRC_BYTES:]):
            content, written = content[:-CRC_BYTES], written[:-CRC_BYTES]
        if written != content:
            raise ValueError('its lengths or its checksum are wrong')
        if isinstance(record, r.Message) and (self._has_chunks or self._end_of(end) is None):
            raise ValueError('it stands beside chunks, or nothing follows it')
        if not isinstance(record, r.Chunk):
            return Found([record], end)
        inner = breakup_chunk(record, validate_crc=True)
        if not record.uncompressed_crc:
            known_bytes = sum(len(_encode(each)) for each in inner)
            if known_bytes != record.uncompressed_size:
                raise ValueError(f'{known_bytes} of {record.uncompressed_size} bytes make sense')
        return Found(inner, end, record)

    def _next(self, start: int) -> int:
        """Return where to go on behind a fault: at the next record, chunk or the end."""
        end = self._end_of(start)
        if end is not None and end <= self.size_bytes and self._end_of(end) is not None:
            return end
        start += 1
        while start < self.size_bytes:
            stop_if_asked()
            # One that begins at the end of a block is found as well: blocks overlap.
            block = self.bytes_at(start, BLOCK_BYTES + _CHUNK_HEAD_BYTES)
            for match in _CHUNK_START.finditer(block):
                with suppress(*DAMAGE):
                    if self._read(start + match.start()).chunk is not None:
                        return start + match.start()
            start += BLOCK_BYTES
        return self.size_bytes

    def _loss(self, start: int, end: int, error: Exception) -> Loss:
        """Say what stands where nothing can be read."""
        head = self.bytes_at(start, _CHUNK_TIMES.size)
        if head[0] not in set(Opcode):
            return Loss(start, end - start, 'bytes that are no record')
        is_cut = isinstance(error, EndOfFile)
        problem = 'cut off, or a length in it is wrong' if is_cut else f'damaged ({error})'
        kind = Opcode(head[0]).name.lower().replace('_', ' ')
        has_times = head[0] == Opcode.CHUNK and len(head) == _CHUNK_TIMES.size
        times_ns = _CHUNK_TIMES.unpack(head)[2:] if has_times else (None, None)
        return Loss(start, end - start, f'{kind} {problem}', *times_ns)


def _encode(record: r.McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    return bytes(builder.end())  # type: ignore[no-untyped-call]


@dataclass(frozen=True)
class Recovery:
    """What could be read of a file, and what became of it; times are simulated time."""

    source: str
    output: str  # the readable copy; empty for a file that is whole
    size_bytes: int
    lost_bytes: int
    chunks: int  # that are whole
    messages: int  # that were read
    unchecked: int  # of them, covered by no checksum
    undescribed: int  # messages that are lost because nothing says any more what they are
    last_ns: int | None  # time of the last message that was read
    topics: list[ChannelSummary]
    losses: list[Loss]
    notes: list[str]  # what the list of losses does not say
    is_whole: bool  # whether there was nothing to recover


class Content:
    """What is left of a file: descriptions and counts, but no messages."""

    def __init__(self, source: Path, scan: Scan) -> None:
        self.source, self.size_bytes = source, scan.size_bytes
        self.header: r.Header | None = None
        self.schemas: dict[int, r.Schema] = {}
        self.channels: dict[int, r.Channel] = {}
        self.metadata: list[r.Metadata] = []
        self.attachments: list[r.Attachment] = []
        self.chunks = self.unchecked = 0
        self._counts: dict[int, ChannelSummary] = {}
        self._losses: list[Loss] = []
        kinds = set[type]()
        believed = True
        try:
            with open_whole(source):
                is_index_whole = True
        except RecordingError:
            is_index_whole = False
        for found in scan:
            if isinstance(found, Loss):
                self._losses.append(found)
                continue
            self.chunks += found.chunk is not None
            for record in found.records:
                kinds.add(type(record))
                match record:
                    case r.Message():
                        count = self._counts.setdefault(record.channel_id, ChannelSummary())
                        count.add(record.log_time, record.sequence)
                        self.unchecked += not (found.chunk and found.chunk.uncompressed_crc)
                    case r.Header():
                        self.header = self.header or record
                    case r.Schema() if believed:  # of two descriptions the first one counts
                        self.schemas.setdefault(record.id, record)
                    case r.Channel() if believed:
                        self.channels.setdefault(record.id, record)
                    case r.Metadata():
                        self.metadata.append(record)
                    case r.Attachment():
                        self.attachments.append(record)
                    case r.DataEnd():
                        believed = is_index_whole
        self._is_finished = r.Footer in kinds
        self._is_indexed = bool(kinds & {r.Statistics, r.ChunkIndex})

    def account(self, output: Path | None) -> Recovery:
        """Say what was read and what was lost; without an output, that the file is whole."""
        runs = [each.metadata for each in self.metadata if each.name == RUN_RECORD]
        written = runs[0].get(TIME_ORIGIN, '') if runs else ''
        origin_ns = int(written) if written.isdecimal() else 0

        def at_simulated_times(each: Any) -> Any:
            times_ns = {'first_ns': each.first_ns, 'last_ns': each.last_ns}
            return replace(
                each, **{k: None if at is None else at - origin_ns for k, at in times_ns.items()}
            )

        topics = []
        for key, channel in sorted(self.channels.items()):
            schema = self.schemas.get(channel.schema_id)
            count = at_simulated_times(self._counts.get(key, ChannelSummary()))
            type_name = schema.name if schema else ''
            topics.append(replace(count, topic=channel.topic, type_name=type_name))
        losses = [at_simulated_times(each) for each in self._losses] if output else []
        messages = sum(each.messages for each in topics)
        undescribed = sum(each.messages for each in self._counts.values()) - messages
        notes = {
            'it was not finished: what came after its last chunk was never written': (
                not self._is_finished
            ),
            f'{undescribed} messages are lost: what they are is not described any more': (
                undescribed > 0
            ),
            'it has no index': self._is_finished and not self._is_indexed,
            'every chunk is whole, but a byte outside of them is wrong: look at metadata and '
            'names': self._is_finished and self._is_indexed and not losses,
            'its header is lost: ROS 2 is assumed': self.header is None,
        }
        return Recovery(
            source=str(self.source),
            output=str(output or ''),
            size_bytes=self.size_bytes,
            lost_bytes=sum(each.size_bytes for each in losses),
            chunks=self.chunks,
            messages=messages,
            unchecked=self.unchecked,
            undescribed=undescribed,
            last_ns=max((e.last_ns for e in topics if e.last_ns is not None), default=None),
            topics=topics,
            losses=losses,
            notes=[note for note, applies in notes.items() if applies and output],
            is_whole=output is None,
        )


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
    if is_bag and not (parts := parts or sorted(path.glob(f'*{SUFFIX}'))):
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
            scan = Scan(stream)
            content = Content(source, scan)
            if _is_whole(source):
                return content.account(None)
            kept = content.header, content.channels, content.metadata, content.attachments
            if not is_part and not any(kept):
                begin = scan.bytes_at(0, len(SQLITE_MAGIC))
                if begin == SQLITE_MAGIC:
                    raise sqlite_refusal(source)
                problem = 'it is not an MCAP file' if begin else 'it is empty'
                if begin.startswith(MAGIC):
                    problem = 'it ends before its first record'
                raise RecordingError(source, problem, 'there is nothing in it to recover')
            recovery = content.account(output)
            with _new_file(output) as target:
                _write(content, recovery, Scan(stream), target)
            return recovery
    except OSError as error:
        problem = f'it cannot be read ({error.strerror})'
        raise RecordingError(source, problem, 'name an MCAP file or a bag directory') from error


def _is_whole(path: Path) -> bool:
    """Return whether every byte of a file is as its checksums say, and all of it is indexed."""
    try:
        with open_whole(path, checks_data=True) as reader:
            messages = sum(1 for _ in reader.iter_messages(log_time_order=False))
            summary = reader.get_summary()
            list(reader.iter_metadata())
            list(reader.iter_attachments())
    except RecordingError:
        return False
    statistics = summary.statistics if summary else None
    return statistics is None or bool(statistics.message_count == messages)


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


def _write(content: Content, recovery: Recovery, scan: Scan, stream: BinaryIO) -> None:
    """Write all that was read; identifiers are given anew."""
    writer = Writer(stream, enable_data_crcs=True)
    writer.start(content.header.profile if content.header else PROFILE)
    for each in content.attachments:
        writer.add_attachment(
            each.create_time, each.log_time, each.name, each.media_type, each.data
        )
    account = {
        'source': content.source.name,
        'source_bytes': str(recovery.size_bytes),
        'lost_bytes': str(recovery.lost_bytes),
        'messages': str(recovery.messages),
        'messages_without_checksum': str(recovery.unchecked),
        'last_time_ns': str(recovery.last_ns),
        'notes': '; '.join(recovery.notes),
    }
    for loss in recovery.losses:
        account[f'loss at byte {loss.offset}'] = f'{loss.size_bytes} bytes: {loss.problem}'
    for topic in recovery.topics:
        if topic.gaps:
            account[f'missing {topic.topic}'] = str(topic.gaps)
    for metadata in (*content.metadata, r.Metadata(RECOVERY_RECORD, account)):
        writer.add_metadata(metadata.name, metadata.metadata)
    schemas = {
        key: writer.register_schema(schema.name, schema.encoding, schema.data)
        for key, schema in sorted(content.schemas.items())
    }
    channels = {
        key: writer.register_channel(
            channel.topic,
            channel.message_encoding,
            schemas.get(channel.schema_id, 0),
            channel.metadata,
        )
        for key, channel in sorted(content.channels.items())
    }
    for found in scan:
        for record in found.records if isinstance(found, Found) else ():
            if isinstance(record, r.Message) and record.channel_id in channels:
                writer.add_message(
                    channels[record.channel_id],
                    record.log_time,
                    record.data,
                    record.publish_time,
                    record.sequence,
                )
    writer.finish()  # type: ignore[no-untyped-call]
