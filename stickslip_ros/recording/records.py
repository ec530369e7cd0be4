"""Single records of an MCAP file, read with distrust: what does not come back equal is refused."""

import re
import struct
from collections.abc import Iterator
from io import BytesIO
from mmap import mmap
from typing import Final, NamedTuple

import zstandard
from mcap.data_stream import ReadDataStream, RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, McapRecord, Message, Schema
from mcap.stream_reader import StreamReader, breakup_chunk

from stickslip_ros.recording.integrity import DAMAGE

Bytes = bytes | mmap

HEAD: Final = struct.Struct('<BQ')
CRC_BYTES: Final = 4
_CHUNK_HEAD: Final = struct.Struct('<QQQII')
_LENGTH: Final = struct.Struct('<Q')
#: Longer than the name of any compression.
_NAME_MAX_BYTES: Final = 16
#: A longer record among damaged bytes is not looked for, a chunk excepted.
_SOUGHT_MAX_BYTES: Final = 1 << 24
#: Where a record may begin: an opcode, then a length below 2^40 bytes.
_START: Final = re.compile(rb'(?=[\x01-\x0f].{5}\x00\x00\x00)', re.DOTALL)


class Found(NamedTuple):
    """A record that reads well, and where it ends."""

    record: McapRecord
    end: int


def read_record(data: Bytes, offset: int) -> Found | None:
    """
    Return the record that begins at an offset, or None where there is none.

    A record is taken only if writing it again gives the same bytes: then every length inside it
    agrees with every other one, and the checksum of an attachment is right.

    """
    if offset + HEAD.size > len(data):
        return None
    _, length = HEAD.unpack(data[offset : offset + HEAD.size])
    end = offset + HEAD.size + length
    if end > len(data):
        return None
    raw = bytes(data[offset:end])
    try:
        record = _parse(raw)
        return Found(record, end) if _is_equal(record, raw) else None
    except (*DAMAGE, StopIteration):
        return None


def _parse(raw: bytes) -> McapRecord:
    reader = StreamReader(BytesIO(raw), skip_magic=True, emit_chunks=True, record_size_limit=None)
    return next(iter(reader.records))


def _is_equal(record: McapRecord, raw: bytes) -> bool:
    """Compare a record with its bytes; an attachment without checksum has a zero there."""
    builder = RecordBuilder()
    record.write(builder)
    written = bytes(builder.end())  # type: ignore[no-untyped-call]
    if isinstance(record, Attachment) and not any(raw[-CRC_BYTES:]):
        return written[:-CRC_BYTES] == raw[:-CRC_BYTES]
    return written == raw


def is_cut_message(data: Bytes, offset: int) -> bool:
    """Tell whether a message begins here that the end of the file cuts off."""
    if data[offset] != Opcode.MESSAGE or offset + HEAD.size > len(data):
        return bool(data[offset] == Opcode.MESSAGE)
    _, length = HEAD.unpack(data[offset : offset + HEAD.size])
    return bool(len(data) < offset + HEAD.size + length < len(data) + _SOUGHT_MAX_BYTES)


def candidates(data: Bytes, start: int) -> Iterator[int]:
    """Give offsets from a place on at which a record may begin."""
    for match in _START.finditer(data, start):
        if _is_plausible(data, match.start()):
            yield match.start()


def _is_plausible(data: Bytes, offset: int) -> bool:
    """Look at the lengths alone, before anything is copied."""
    opcode, length = HEAD.unpack(data[offset : offset + HEAD.size])
    body = offset + HEAD.size
    if body + length > len(data):
        return False
    if opcode != Opcode.CHUNK:
        return bool(length <= _SOUGHT_MAX_BYTES)
    if length < _CHUNK_HEAD.size:
        return False
    first_ns, last_ns, _, _, name_bytes = _CHUNK_HEAD.unpack_from(data, body)
    at = body + _CHUNK_HEAD.size + name_bytes
    if first_ns > last_ns or name_bytes > _NAME_MAX_BYTES or at + _LENGTH.size > len(data):
        return False
    [size_bytes] = _LENGTH.unpack_from(data, at)
    return bool(at + _LENGTH.size + size_bytes == body + length)


def chunk_times_ns(data: Bytes, offset: int) -> tuple[int, int] | tuple[()]:
    """Return what a chunk says of the times in it, if one begins here, whole or not."""
    body = offset + HEAD.size
    if data[offset] != Opcode.CHUNK or body + _CHUNK_HEAD.size > len(data):
        return ()
    first_ns, last_ns, *_ = _CHUNK_HEAD.unpack_from(data, body)
    return first_ns, last_ns


def unpack_chunk(chunk: Chunk) -> list[McapRecord]:
    """
    Return what is in a chunk.

    Raises
    ------
    DAMAGE
        Any of these errors if the checksum is wrong or the content makes no sense.

    """
    records = breakup_chunk(chunk, validate_crc=True)
    size_bytes = sum(map(_size_bytes, records))
    if size_bytes != chunk.uncompressed_size:
        raise ValueError(f'{size_bytes} of {chunk.uncompressed_size} bytes are understood')
    return records


def _size_bytes(record: McapRecord) -> int:
    if isinstance(record, Message):
        return HEAD.size + 22 + len(record.data)
    builder = RecordBuilder()
    record.write(builder)
    return builder.count


def unpack_cut_chunk(data: Bytes, offset: int) -> list[McapRecord]:
    """
    Return the complete records of a chunk whose end is missing; no checksum covers them.

    Parameters
    ----------
    data : bytes
        The file.
    offset : int
        Where the chunk begins; it goes on to the end of the file.

    """
    if data[offset] != Opcode.CHUNK:
        return []
    try:
        chunk = Chunk.read(ReadDataStream(BytesIO(data[offset + HEAD.size :])))
        plain = _decompress_start(chunk)
    except DAMAGE:
        return []
    return list(_complete_records(plain, chunk))


def _decompress_start(chunk: Chunk) -> bytes:
    """Return what the beginning of a chunk gives; lz4 is left alone, whose blocks are large."""
    if chunk.compression == 'zstd':
        return bytes(zstandard.ZstdDecompressor().decompressobj().decompress(chunk.data))
    return b'' if chunk.compression else chunk.data


def _complete_records(plain: bytes, chunk: Chunk) -> Iterator[McapRecord]:
    """Give records until one makes no sense or lies outside the times of its chunk."""
    offset = 0
    while (found := read_record(plain, offset)) is not None:
        record, offset = found
        if not isinstance(record, Schema | Channel | Message):
            return
        if isinstance(record, Message) and not _is_within(record, chunk):
            return
        yield record


def _is_within(message: Message, chunk: Chunk) -> bool:
    return bool(chunk.message_start_time <= message.log_time <= chunk.message_end_time)
