"""The file itself: an MCAP container as ROS 2 tools expect it, open for writing."""

import os
import struct
import tempfile
import zlib
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from io import FileIO
from pathlib import Path
from typing import IO, Final, NamedTuple

import lz4.frame
import zstandard
from mcap import records
from mcap.data_stream import RecordBuilder
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.writer import LIBRARY_IDENTIFIER

from stickslip_ros.errors import RecordingError, UnknownName
from stickslip_ros.recording.channels import Channel
from stickslip_ros.recording.integrity import CRC_BYTES, MAGIC, PROFILE
from stickslip_ros.recording.layout import FileForm
from stickslip_ros.recording.schemas import SCHEMAS, TYPE_HASHES

COMPRESSORS: Final = {'zstd': zstandard.compress, 'lz4': lz4.frame.compress, 'none': bytes}

MESSAGE_HEAD: Final = struct.Struct('<BQHIQQ')
"""Opcode and length of a message record, channel, sequence number, log time, publish time."""
_RECORD_HEAD_BYTES: Final = 9
_BLOCK_BYTES: Final = 1 << 16


class Stored(NamedTuple):
    """A message as it stands in a file; channels are numbered from 1, as they are announced."""

    channel_id: int
    time_ns: int
    data: bytes
    sequence: int


def encode(record: records.McapRecord) -> bytes:
    """Return the bytes of a record."""
    builder = RecordBuilder()
    record.write(builder)
    return bytes(builder.end())  # type: ignore[no-untyped-call]


class McapWriter:
    """
    A new MCAP file that is being written by one caller at a time; missing folders are made.

    Where a chunk ends is decided by the sizes and the simulated times of its messages alone. The
    first chunk ends with the first time, so that the channels are soon on the disk. The bytes are
    those of ``mcap.writer.Writer``, which would keep an index of each chunk in the memory, and
    could not give the chunk in progress.

    Raises
    ------
    RecordingError
        If the file exists or cannot be made.
    UnknownName
        If the compression is not one of the three.

    """

    def __init__(
        self,
        path: Path,
        channels: Sequence[Channel],
        form: FileForm,
        metadata: Mapping[str, Mapping[str, str]],
        attachments: Mapping[str, tuple[str, bytes]],
    ) -> None:
        if form.compression not in COMPRESSORS:
            known = ', '.join(COMPRESSORS)
            raise UnknownName('compression', form.compression, f'take one of {known}')
        self.path = path
        self.chunks = 0
        self.pending = 0
        self._end = 0
        self._form = form
        self._schemas, self._channels = _announcements(channels)
        self._announced = b''.join((*self._schemas, *self._channels))
        self._records = bytearray(self._announced)
        self._least_bytes = len(self._records)
        self._times_ns: dict[int, list[tuple[int, int]]] = defaultdict(list)
        self._chunk_start_ns = self._chunk_end_ns = self._last_ns = 0
        self._start_ns: int | None = None
        self._counts: dict[int, int] = defaultdict(int)
        self._secured = 0
        self._provisional_bytes = 0
        self._unwritten = bytearray()
        self._crc = 0
        self._indexes: dict[Opcode, list[bytes]] = defaultdict(list)
        self._stream = _create(path)
        self._chunk_indexes = _Spill()
        self._identity = _identity(os.fstat(self._stream.fileno()))
        with self._discarding():
            self._begin(metadata, attachments)

    def _begin(
        self,
        metadata: Mapping[str, Mapping[str, str]],
        attachments: Mapping[str, tuple[str, bytes]],
    ) -> None:
        """Write all that precedes the messages."""
        self._put(MAGIC)
        self._put(encode(records.Header(PROFILE, LIBRARY_IDENTIFIER)))
        for name, (media_type, data) in attachments.items():
            self.attach(name, media_type, data)
        self._add_metadata(metadata)
        self._write_out()
        _sync_folder(self.path.parent)

    def attach(self, name: str, media_type: str, data: bytes) -> None:
        """Add an attachment; no message is there yet."""
        offset, length = self._put(encode(records.Attachment(0, 0, name, media_type, data)))
        index = records.AttachmentIndex(offset, length, 0, 0, len(data), name, media_type)
        self._indexes[Opcode.ATTACHMENT_INDEX].append(encode(index))
        self._write_out()

    def write(self, message: Stored) -> None:
        """Add a message; its time must not be earlier than the last one's."""
        channel_id, time_ns, data, sequence = message
        if self.pending and time_ns >= self._chunk_end_ns:
            self.end_chunk()
        if not self.pending:
            period_ns = self._form.chunk_period_ns if self.chunks else 1
            self._chunk_start_ns, self._chunk_end_ns = time_ns, time_ns + period_ns
        if self._start_ns is None:
            self._start_ns = time_ns
        length = MESSAGE_HEAD.size - _RECORD_HEAD_BYTES + len(data)
        head = Opcode.MESSAGE, length, channel_id, sequence, time_ns, time_ns
        self._times_ns[channel_id].append((time_ns, len(self._records)))
        self._records += MESSAGE_HEAD.pack(*head)
        self._records += data
        self._last_ns = time_ns
        self._counts[channel_id] += 1
        self.pending += 1
        if len(self._records) - self._least_bytes > self._form.chunk_size_bytes:
            self.end_chunk()

    def end_chunk(self) -> None:
        """Write the chunk in progress and hand it to the operating system."""
        chunk = self._chunk_of(bytes(self._records))
        offset, length = self._put(encode(chunk))
        message_indexes = {
            channel_id: self._put(encode(records.MessageIndex(channel_id, times)))
            for channel_id, times in self._times_ns.items()
        }
        index = records.ChunkIndex(
            message_start_time=chunk.message_start_time,
            message_end_time=chunk.message_end_time,
            chunk_start_offset=offset,
            chunk_length=length,
            message_index_offsets={key: at for key, (at, _) in message_indexes.items()},
            message_index_length=sum(length for _, length in message_indexes.values()),
            compression=chunk.compression,
            compressed_size=len(chunk.data),
            uncompressed_size=chunk.uncompressed_size,
        )
        self._chunk_indexes.append(encode(index))
        self._write_out()
        self._records.clear()
        self._times_ns.clear()
        self.pending = self._secured = self._least_bytes = 0
        self.chunks += 1

    def _chunk_of(self, plain: bytes) -> records.Chunk:
        compression = self._form.compression
        return records.Chunk(
            compression='' if compression == 'none' else compression,
            data=COMPRESSORS[compression](plain),
            message_start_time=self._chunk_start_ns,
            message_end_time=self._last_ns,
            uncompressed_crc=zlib.crc32(plain),
            uncompressed_size=len(plain),
        )

    def secure(self) -> None:
        """
        Bring all that was written to the disk, without ending the chunk.

        The chunk in progress is written provisionally at the end of the file, where the real one
        will take its place: what the finished file says does not depend on when this is called.
        It announces every channel again: the file may hold no other chunk.

        """
        if self.pending > self._secured:
            announced = self._announced if self.chunks else b''
            chunk = encode(self._chunk_of(announced + self._records))
            self._replace_provisional(chunk)
            self._provisional_bytes = len(chunk)
            self._secured = self.pending
        self.sync()

    def sync(self) -> None:
        """
        Have the operating system bring to the disk what it was handed.

        Raises
        ------
        RecordingError
            If the file is no longer where it was made: what it holds will be gone when it ends.

        """
        os.fsync(self._stream.fileno())
        try:
            is_there = _identity(self.path.lstat()) == self._identity
        except OSError:
            is_there = False
        if not is_there:
            problem = 'it was deleted, moved or replaced while it was written'
            raise RecordingError(
                self.path, problem, 'record anew, and leave the file in its place'
            )

    def finish(self, metadata: Mapping[str, Mapping[str, str]]) -> None:
        """Write closing metadata, the last chunk, the summary and the end; close the file."""
        self._add_metadata(metadata)
        if self.pending:
            self.end_chunk()
        self._put(encode(records.DataEnd(self._crc)))
        self._add_summary()
        self.sync()
        self._close()

    def abandon(self) -> None:
        """Close the file as it is, with what fits on the disk."""
        with suppress(OSError):
            self._close()

    def _close(self) -> None:
        self._chunk_indexes.close()
        self._stream.close()

    def _put(self, data: bytes) -> tuple[int, int]:
        """Add bytes behind the others; give where they begin and how many they are."""
        offset = self._end + len(self._unwritten)
        self._unwritten += data
        self._crc = zlib.crc32(data, self._crc)
        return offset, len(data)

    def _write_out(self) -> None:
        """Hand what was added to the operating system."""
        self._replace_provisional(bytes(self._unwritten))
        self._end += len(self._unwritten)
        self._provisional_bytes = 0
        self._unwritten.clear()

    def _replace_provisional(self, data: bytes) -> None:
        """
        Write at the end of the file, over the provisional chunk if one stands there.

        In its place it would be lost to a kill or a power failure in between: the bytes are first
        brought to the disk behind it. What stands twice in between, `recover` takes once.

        """
        handle = self._stream.fileno()
        if self._provisional_bytes:
            behind = self._end + max(self._provisional_bytes, len(data))
            _write_at(handle, data, behind)
            os.fsync(handle)
        _write_at(handle, data, self._end)
        if self._provisional_bytes:
            os.fsync(handle)
            os.ftruncate(handle, self._end + len(data))
            os.fsync(handle)

    def _add_metadata(self, metadata: Mapping[str, Mapping[str, str]]) -> None:
        for name, entries in metadata.items():
            offset, length = self._put(encode(records.Metadata(name, dict(entries))))
            self._indexes[Opcode.METADATA_INDEX].append(
                encode(records.MetadataIndex(offset, length, name))
            )

    def _add_summary(self) -> None:
        """Write what is in the file and where, group by group, and where the groups are."""
        groups: dict[Opcode, Iterable[bytes]] = {
            Opcode.SCHEMA: self._schemas,
            Opcode.CHANNEL: self._channels,
            Opcode.STATISTICS: [encode(self._statistics())],
            Opcode.CHUNK_INDEX: self._chunk_indexes,
            Opcode.ATTACHMENT_INDEX: self._indexes[Opcode.ATTACHMENT_INDEX],
            Opcode.METADATA_INDEX: self._indexes[Opcode.METADATA_INDEX],
        }
        self._write_out()
        self._crc = 0
        start = self._end
        offsets = []
        for opcode, blocks in groups.items():
            group_start = self._end
            for block in blocks:
                self._put(block)
                self._write_out()
            group_length = self._end - group_start
            offsets.append(encode(records.SummaryOffset(opcode, group_start, group_length)))
        offset_start, _ = self._put(b''.join(offsets))
        footer = encode(records.Footer(start, offset_start, 0))[:-CRC_BYTES]
        crc = zlib.crc32(footer, self._crc)
        self._put(footer + crc.to_bytes(CRC_BYTES, 'little') + MAGIC)
        self._write_out()

    def _statistics(self) -> records.Statistics:
        return records.Statistics(
            attachment_count=len(self._indexes[Opcode.ATTACHMENT_INDEX]),
            channel_count=len(self._channels),
            channel_message_counts=self._counts,
            chunk_count=self.chunks,
            message_count=sum(self._counts.values()),
            message_end_time=self._last_ns,
            message_start_time=self._start_ns or 0,
            metadata_count=len(self._indexes[Opcode.METADATA_INDEX]),
            schema_count=len(self._schemas),
        )

    @contextmanager
    def _discarding(self) -> Iterator[None]:
        """Take the file away again when it cannot even be begun."""
        try:
            yield
        except BaseException as error:
            self.abandon()
            self.path.unlink()
            if isinstance(error, (OSError, McapError)):
                raise RecordingError(
                    self.path, f'it cannot be begun ({error})', 'choose another place'
                ) from error
            raise


class _Spill:
    """Bytes kept out of the memory until they are read once, unless no other place has room."""

    def __init__(self) -> None:
        self._file: IO[bytes] | None = None
        with suppress(OSError):
            self._file = tempfile.TemporaryFile(buffering=0)  # noqa: SIM115 - close()
        self._spilled_bytes = 0
        self._kept = bytearray()

    def append(self, data: bytes) -> None:
        """Keep some more."""
        with suppress(OSError):
            if self._file and not self._kept and self._file.write(data) == len(data):
                self._spilled_bytes += len(data)
                return
        self._kept += data

    def __iter__(self) -> Iterator[bytes]:
        left_bytes = self._spilled_bytes
        if self._file:
            self._file.seek(0)
            while block := self._file.read(min(left_bytes, _BLOCK_BYTES)):
                yield block
                left_bytes -= len(block)
        yield bytes(self._kept)

    def close(self) -> None:
        """Take the temporary file away."""
        if self._file:
            self._file.close()


def _announcements(channels: Sequence[Channel]) -> tuple[list[bytes], list[bytes]]:
    """Return the records of the schemas, once each, and of the channels."""
    names = list(dict.fromkeys(channel.type_name for channel in channels))
    schemas = [
        encode(
            records.Schema(id=number, name=name, encoding='ros2msg', data=SCHEMAS[name].encode())
        )
        for number, name in enumerate(names, 1)
    ]
    described = [
        encode(
            records.Channel(
                id=number,
                topic=channel.topic,
                message_encoding='cdr',
                schema_id=names.index(channel.type_name) + 1,
                metadata={
                    'offered_qos_profiles': channel.qos.to_yaml(),
                    'topic_type_hash': TYPE_HASHES[channel.type_name],
                },
            )
        )
        for number, channel in enumerate(channels, 1)
    ]
    return schemas, described


def _create(path: Path) -> FileIO:
    """Open a file that must not exist yet."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        return path.open('xb', buffering=0)
    except OSError as error:
        if os.path.lexists(path):
            problem, hint = 'it exists and is not overwritten', 'choose another name'
        else:
            problem, hint = f'it cannot be made ({error.strerror})', 'choose another folder'
        raise RecordingError(path, problem, hint) from error


def _identity(status: os.stat_result) -> tuple[int, int]:
    """Return what makes a file the same one, whatever its name."""
    return status.st_dev, status.st_ino


def _write_at(handle: int, data: bytes, offset: int) -> None:
    """Write at a place of a file."""
    view = memoryview(data)
    while view:
        written = os.pwrite(handle, view, offset)
        view, offset = view[written:], offset + written


def _sync_folder(folder: Path) -> None:
    """Bring the name of a new file to the disk, where the file system knows how."""
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
