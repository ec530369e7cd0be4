"""Reads what is intact of a damaged MCAP file, stretch by stretch."""

import re
import struct
import zlib
from collections.abc import Iterator, Sequence
from io import BytesIO
from mmap import mmap
from typing import Final, NamedTuple

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    Channel,
    Chunk,
    DataEnd,
    Footer,
    McapRecord,
    Message,
    Schema,
)
from mcap.stream_reader import StreamReader, breakup_chunk

from stickslip_ros.recording.integrity import CRC_BYTES, DAMAGE, MAGIC
from stickslip_ros.recording.mcap_writer import MESSAGE_HEAD, encode

Bytes = bytes | mmap

_HEAD: Final = struct.Struct('<BQ')
_CHUNK_HEAD: Final = struct.Struct('<QQQII')
_INNER: Final = (Message, Schema, Channel)
"""Records that also stand inside chunks: in a damaged one they are not to be trusted."""
_SOUGHT_MAX_BYTES: Final = 1 << 24
"""A longer record among damaged bytes is not looked for, a chunk excepted."""
_START: Final = re.compile(
    rb'(?=[\x01-\x05\x07-\x0f].{3}\x00{5}'
    rb'|\x06.{5}\x00{3}.{28}(?:\x00{4}|\x03\x00{3}lz4|\x04\x00{3}zstd))',
    re.DOTALL,
)
"""Where a record may begin: an opcode and a length; of a chunk, a compression that exists too."""


class Stretch(NamedTuple):
    """
    Bytes of a file that belong together: what stands in them, or why it cannot be read.

    Attributes
    ----------
    start, end : int
        Where they are.
    records : sequence of McapRecord
        One, or those of a chunk.
    problem : str
        Why the stretch is lost; of a chunk that is cut off, why the rest of it is.
    compression : str
        Of a chunk that is whole: ``zstd``, ``lz4``, ``none``; otherwise empty.
    is_checked : bool
        Whether a checksum covers the messages.

    """

    start: int
    end: int
    records: Sequence[McapRecord] = ()
    problem: str = ''
    compression: str = ''
    is_checked: bool = False

    @property
    def is_chunk(self) -> bool:
        """Whether the records stand in a chunk, whole or cut off."""
        return bool(self.compression or self.problem)


class _Found(NamedTuple):
    record: McapRecord
    end: int


def read_stretch(data: Bytes, offset: int) -> Stretch | None:
    """Return the record or the chunk that begins at an offset; None where there is none."""
    found = _read_record(data, offset)
    if found is None:
        return None
    if not isinstance(found.record, Chunk):
        return Stretch(offset, found.end, [found.record])
    chunk = found.record
    try:
        records = _unpack_chunk(chunk)
    except DAMAGE as error:
        problem = f'a chunk is damaged ({type(error).__name__} {error})'
        return Stretch(offset, found.end, problem=problem)
    compression, is_checked = chunk.compression or 'none', bool(chunk.uncompressed_crc)
    return Stretch(offset, found.end, records, '', compression, is_checked)


def read_messages(data: Bytes, offset: int) -> list[Message]:
    """Read again the messages of a record, of a chunk, or of one that the end cuts off."""
    stretch = read_stretch(data, offset)
    records = stretch.records if stretch else _unpack_cut_chunk(data, offset)
    return [record for record in records if isinstance(record, Message)]


def times_ns(data: Bytes, offset: int) -> tuple[int, int] | tuple[None, None]:
    """Return what a chunk says of the times in it, if one begins here, whole or not."""
    body = offset + _HEAD.size
    if data[offset : offset + 1] != b'\x06' or body + _CHUNK_HEAD.size > len(data):
        return None, None
    first_ns, last_ns, *_ = _CHUNK_HEAD.unpack_from(data, body)
    return first_ns, last_ns


class Scan:
    """Goes through a file from its beginning to its end, and goes on behind what is damaged."""

    def __init__(self, data: Bytes) -> None:
        self._data = data
        self._is_in_index = self._has_chunks = self._has_messages = False
        self._channels: set[int] = set()

    def __iter__(self) -> Iterator[Stretch]:
        offset = len(MAGIC)
        while offset < len(self._data):
            stretch = self._read(offset)
            yield stretch
            offset = stretch.end
            if any(isinstance(record, Footer) for record in stretch.records):
                if self._data[offset:] != MAGIC:
                    yield Stretch(offset, len(self._data), problem='the end is damaged')
                return

    def _read(self, offset: int) -> Stretch:
        """Read what begins at an offset, or pass over what makes no sense."""
        stretch = read_stretch(self._data, offset)
        if stretch is not None and not stretch.compression and not stretch.problem:
            stretch = self._judge(stretch.records[0], stretch)
        if stretch is None:
            stretch = self._skip(offset)
        self._has_chunks |= bool(stretch.compression)
        for record in stretch.records:
            self._is_in_index |= isinstance(record, DataEnd)
            self._has_messages |= isinstance(record, Message)
            if isinstance(record, Channel):
                self._channels.add(record.id)
        return stretch

    def _judge(self, record: McapRecord, stretch: Stretch) -> Stretch | None:
        """
        Take a record outside of chunks for what it is worth: None for a doubtful message.

        A file has its messages in chunks or outside of them: one behind a chunk may be what was
        left of another.

        """
        if isinstance(record, Message) and (
            self._has_chunks or not self._is_followed(stretch.end)
        ):
            return None
        if isinstance(record, Footer):
            return stretch._replace(records=[record, *self._indexed(record, stretch.end)])
        if self._is_in_index and isinstance(record, Schema | Channel):
            return stretch._replace(records=())
        return stretch

    def _indexed(self, footer: Footer, end: int) -> Iterator[McapRecord]:
        """Give what the index announces, but only if its checksum is right."""
        start, crc = footer.summary_start, footer.summary_crc
        if crc and zlib.crc32(self._data[start : end - CRC_BYTES]) != crc:
            return
        while start and start < end and (found := _read_record(self._data, start)):
            if isinstance(found.record, Schema | Channel):
                yield found.record
            start = found.end

    def _skip(self, start: int) -> Stretch:
        """Pass over what makes no sense, up to where it makes sense again."""
        for match in _START.finditer(self._data, start + 1):
            offset = match.start()
            found = _read_record(self._data, offset)
            if found is not None and self._is_trusted(found):
                return Stretch(start, offset, problem=self._problem(start))
        records = _unpack_cut_chunk(self._data, start)
        return Stretch(start, len(self._data), records, self._problem_at_end(start, records))

    def _is_trusted(self, found: _Found) -> bool:
        """
        Return whether a record found among damaged bytes is one, and not a part of another.

        A message outside a chunk agrees with almost any bytes: it is taken only in a file without
        chunks, and only if another record follows.

        """
        record = found.record
        if not isinstance(record, _INNER):
            return True
        if self._has_chunks or not self._has_messages or not isinstance(record, Message):
            return False
        return record.channel_id in self._channels and self._is_followed(found.end)

    def _is_followed(self, end: int) -> bool:
        """Return whether a record follows a message outside a chunk: nothing else checks it."""
        is_last = end == len(self._data) or self._is_cut_message(end)
        return is_last or _read_record(self._data, end) is not None

    def _is_cut_message(self, offset: int) -> bool:
        """Return whether a message begins here that the end of the file cuts off."""
        if self._data[offset] != Opcode.MESSAGE:
            return False
        end = _end_of(self._data, offset)
        return end is None or len(self._data) < end < len(self._data) + _SOUGHT_MAX_BYTES

    def _problem(self, start: int) -> str:
        """Say what stands where no record can be read."""
        if self._is_in_index:
            return 'the index is damaged; it is made anew'
        if self._data[start] == Opcode.CHUNK:
            return 'a chunk whose length is wrong'
        return 'bytes that are no record'

    def _problem_at_end(self, start: int, saved: Sequence[McapRecord]) -> str:
        """Say what stands where nothing more can be read."""
        opcode, end = self._data[start], _end_of(self._data, start)
        if opcode == Opcode.CHUNK and (end is None or end > len(self._data)):
            messages = sum(isinstance(record, Message) for record in saved)
            kept = f', {messages} messages saved' if messages else ''
            return f'the last chunk is cut off{kept}'
        if self._is_in_index or opcode == Opcode.MESSAGE_INDEX:
            return 'the index is cut off; it is made anew'
        return 'bytes that are no record, up to the end'


def _end_of(data: Bytes, offset: int) -> int | None:
    """Return where a record says that it ends; None where its length is cut off."""
    head = data[offset : offset + _HEAD.size]
    return offset + _HEAD.size + _HEAD.unpack(head)[1] if len(head) == _HEAD.size else None


def _read_record(data: Bytes, offset: int) -> _Found | None:
    """
    Return the record that begins at an offset, or None where there is none.

    A record is taken only if writing it again gives the same bytes: then every length inside it
    agrees with every other one, and the checksum of an attachment is right. One without checksum
    has a zero there.

    """
    end = _end_of(data, offset)
    if end is None or end > len(data):
        return None
    raw = bytes(data[offset:end])
    reader = StreamReader(BytesIO(raw), skip_magic=True, emit_chunks=True, record_size_limit=None)
    try:
        record = next(reader.records)
        written = encode(record)
    except (*DAMAGE, StopIteration):
        return None
    if isinstance(record, Attachment) and not any(raw[-CRC_BYTES:]):
        raw, written = raw[:-CRC_BYTES], written[:-CRC_BYTES]
    return _Found(record, end) if written == raw else None


def _unpack_chunk(chunk: Chunk) -> list[McapRecord]:
    """
    Return what is in a chunk; one without checksum must be understood to its last byte.

    Raises
    ------
    DAMAGE
        Any of these errors if the checksum is wrong or the content makes no sense.

    """
    records = breakup_chunk(chunk, validate_crc=True)
    if not chunk.uncompressed_crc:
        size_bytes = sum(map(_size_bytes, records))
        if size_bytes != chunk.uncompressed_size:
            raise ValueError(f'{size_bytes} of {chunk.uncompressed_size} bytes are understood')
    return records


def _size_bytes(record: McapRecord) -> int:
    if isinstance(record, Message):
        return MESSAGE_HEAD.size + len(record.data)
    return len(encode(record))


def _unpack_cut_chunk(data: Bytes, offset: int) -> list[McapRecord]:
    """Return the complete records of a chunk that the end of a file cuts off, unchecked."""
    if data[offset] != Opcode.CHUNK:
        return []
    try:
        chunk = Chunk.read(ReadDataStream(BytesIO(data[offset + _HEAD.size :])))
        plain = _decompress_start(chunk)
    except DAMAGE:
        return []
    records: list[McapRecord] = []
    end = 0
    while (found := _read_record(plain, end)) and isinstance(found.record, _INNER):
        record, end = found
        if isinstance(record, Message) and not (
            chunk.message_start_time <= record.log_time <= chunk.message_end_time
        ):
            break
        records.append(record)
    return records


def _decompress_start(chunk: Chunk) -> bytes:
    """Return what the beginning of a chunk gives; lz4 is left alone, whose blocks are large."""
    if chunk.compression == 'zstd':
        return bytes(zstandard.ZstdDecompressor().decompressobj().decompress(chunk.data))
    return b'' if chunk.compression else chunk.data
