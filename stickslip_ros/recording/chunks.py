# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Messages of an MCAP file, chunk by chunk, in bounded memory."""

import heapq
import os
import struct
import zlib
from array import array
from collections import Counter
from collections.abc import Collection, Iterator
from functools import lru_cache
from io import BytesIO
from itertools import pairwise
from typing import Any, BinaryIO, Final, NamedTuple

import numpy as np
import zstandard
from lz4.frame import LZ4FrameDecompressor
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.reader import SeekingReader
from mcap.records import (
    AttachmentIndex,
    Channel,
    Chunk,
    ChunkIndex,
    Message,
    MetadataIndex,
    Schema,
    Statistics,
)
from mcap.stream_reader import StreamReader
from mcap.summary import Summary
from numpy.typing import NDArray

from stickslip_ros import budget
from stickslip_ros.errors import Miscounted, RecordingError
from stickslip_ros.recording.layout import TIME_MAX_NS

Places = NDArray[np.int64]

CHUNK_MAX_BYTES: Final = budget.CHUNK_BYTES.most
ALL_TIMES_NS: Final = 0, (1 << 64) - 1  # log times, ns; those above TIME_MAX_NS are refused
RECORD_HEAD: Final = struct.Struct('<BQ')  # opcode and length
MESSAGE_HEAD: Final = struct.Struct('<HIQQ')  # channel, sequence number, log and publish time
SEQUENCE_AT, LOG_TIME_AT = 2, 6
LENGTH_BYTES: Final = 8  # size of a record's length field
INDEX_HEAD_BYTES: Final = 15  # head of a message index: opcode, length, channel, size of its rows
INDEX_ROW_BYTES: Final = 16  # time and place
_DATA_END: Final = struct.Struct('<BQI')
_CRC_BYTES: Final = 4
_BLOCK_BYTES: Final = 1 << 20
CHANNELS: Final = 1 << 16  # largest number of channels
MAGIC: Final = b'\x89MCAP0\r\n'
_INDEX_ANEW: Final = 'copy its messages with "stickslip recover", which makes one'
_COUNT_ANEW: Final = 'copy its messages with "stickslip recover", which counts anew'
SUMMARIES_KEPT: Final = 4
"""Summaries cached, since windows of a long recording reopen its files: the summary of an hour
has 20,000 numbers and takes half a second to read."""
ZSTD_MAGIC: Final = b'\x28\xb5\x2f\xfd'


class ChunkMessages(NamedTuple):
    """Unpacked records, and the wanted messages among them."""

    data: bytes
    starts: Places  # of each message in the data, after opcode and length
    channels: NDArray[np.uint16]
    times_ns: Places  # log times
    described: Places  # starts of schemas and channels
    is_packed: bool = False  # whether each message was compressed separately

    def descriptions(self) -> Iterator[bytes]:
        """Yield the records of schemas and channels."""
        for start in self.described.tolist():
            _, length = RECORD_HEAD.unpack_from(self.data, start - RECORD_HEAD.size)
            yield self.data[start - RECORD_HEAD.size : start + length]

    def message(self, place: int) -> Message:
        start = int(self.starts[place])
        channel_id, sequence, log_time, publish_time = MESSAGE_HEAD.unpack_from(self.data, start)
        _, length = RECORD_HEAD.unpack_from(self.data, start - RECORD_HEAD.size)
        content = self.data[start + MESSAGE_HEAD.size : start + length]
        return Message(channel_id, log_time, content, publish_time, sequence)


_MergeRow = tuple[int, int, int, ChunkMessages | None]
"""Log time, chunk and place of a message; nothing at the start of a chunk."""


def gather(data: bytes, places: Places, kind: str) -> NDArray[Any]:
    """Return the numbers of a numpy type at byte offsets of the data."""
    width = np.dtype(kind).itemsize
    everywhere = max(len(data) - width + 1, 0)
    return np.ndarray((everywhere,), kind, data, strides=(1,))[places]


def unpack_chunk(chunk: Chunk) -> bytes:
    """Decompress the records of a chunk; ValueError if size or checksum is wrong."""
    size = chunk.uncompressed_size
    if size > CHUNK_MAX_BYTES:
        raise ValueError(f'a chunk of {size} bytes is above the limit of {CHUNK_MAX_BYTES}')
    data, announced = chunk.data, size
    if chunk.compression == 'zstd':
        if (announced := zstandard.frame_content_size(data)) in {-1, size}:
            data = zstandard.decompress(data, size)
    elif chunk.compression == 'lz4':
        # Read one byte more than announced: detects a longer frame without unpacking a bomb.
        data = LZ4FrameDecompressor().decompress(data, max_length=size + 1)
    elif chunk.compression:
        raise ValueError(f'its compression {chunk.compression!r} is not known')
    if announced not in {-1, size} or len(data) != size:
        raise ValueError(f'a chunk does not unpack to the {size} bytes that it announces')
    if chunk.uncompressed_crc not in {0, zlib.crc32(data)}:
        raise ValueError('the checksum of a chunk is wrong')
    return data


def find_messages(
    data: bytes, wanted: Collection[int] | None = None, packed: tuple[object, Any] = ('', None)
) -> ChunkMessages:
    """Return the messages of some channels, or of all; ValueError if the data are no records."""
    starts, described, at, end = array('q'), array('q'), 0, len(data)
    records, most = 0, budget.RECORDS.allowed(packed[1])
    while at < end and records <= most:
        records += 1
        opcode, length = RECORD_HEAD.unpack_from(data, at)
        at += RECORD_HEAD.size
        if opcode == Opcode.CHUNK:
            raise ValueError('a chunk is not in the index')
        if opcode == Opcode.MESSAGE:
            if length < MESSAGE_HEAD.size:
                raise ValueError(f'a message of {length} bytes is below {MESSAGE_HEAD.size}')
            starts.append(at)
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            described.append(at)
        at += length
    budget.RECORDS.check(records, *packed)
    if at != end:
        raise ValueError('a record is longer than its chunk')
    places, described_at = np.array(starts, np.int64), np.array(described, np.int64)
    channels = gather(data, places, '<u2')
    if wanted is not None:
        is_wanted = np.zeros(CHANNELS, np.bool_)  # np.isin takes several times as long
        is_wanted[list(wanted)] = True
        these = is_wanted[channels]
        places, channels = places[these], channels[these]
    times_ns = gather(data, places + LOG_TIME_AT, '<u8')
    if np.any(times_ns > TIME_MAX_NS):
        raise ValueError(f'a time of {times_ns.max()} ns is above {TIME_MAX_NS} ns')
    times_ns = times_ns.astype(np.int64)
    return ChunkMessages(data, places, channels, times_ns, described_at)


def unpack_messages(piece: ChunkMessages) -> ChunkMessages:
    """Decompress messages that rosbag2 compressed separately; return others unchanged."""
    if not len(piece.starts) or not piece.message(0).data.startswith(ZSTD_MAGIC):
        return piece
    parts, room = [*piece.descriptions()], CHUNK_MAX_BYTES
    for place, start in enumerate(piece.starts.tolist()):
        packed = piece.message(place).data
        size = zstandard.frame_content_size(packed)
        if not 0 <= size <= room:
            raise ValueError(f'a message of {size} bytes is above the {room} that are left')
        room -= size
        head = piece.data[start : start + MESSAGE_HEAD.size]
        parts += [RECORD_HEAD.pack(Opcode.MESSAGE, len(head) + size), head]
        parts.append(zstandard.decompress(packed, size) if size else b'')
    return find_messages(b''.join(parts))._replace(is_packed=True)


class ChunkReader(SeekingReader):
    """
    Reads messages of some or all topics of a finished file.

    An inconsistent file raises ValueError, LookupError or struct.error; Miscounted, if its
    messages, their indexes and its statistics differ.

    """

    _opened_bytes = 0  # size of all chunks open in the merge by time

    def __init__(self, stream: BinaryIO, summary_start: int) -> None:
        size_bytes, _ = stream.seek(0, os.SEEK_END), stream.seek(0)
        super().__init__(stream, record_size_limit=min(size_bytes, CHUNK_MAX_BYTES))
        self._summary_start = summary_start

    def get_summary(self) -> Summary:
        """Return the summary at the end of the file."""
        if self._summary is None:
            size_bytes = self._stream.seek(0, os.SEEK_END) - self._summary_start
            budget.INDEX_BYTES.check(size_bytes, self._stream.name)
            self._stream.seek(self._summary_start)
            data = self._stream.read()
            checked, ending = data[: -_CRC_BYTES - len(MAGIC)], data[-_CRC_BYTES - len(MAGIC) :]
            if int.from_bytes(ending[:_CRC_BYTES], 'little') not in {0, zlib.crc32(checked)}:
                raise ValueError('the checksum of its summary is wrong')
            self._summary = _summary_of(data)
            statistics, listed = self._summary.statistics, len(self._summary.chunk_indexes)
            if not listed and (statistics is None or statistics.message_count):
                problem = 'it has no index of chunks'
                raise RecordingError(self._stream.name, problem, _INDEX_ANEW)
            if statistics and statistics.chunk_count != listed:
                raise ValueError(f'its index lists {listed} of {statistics.chunk_count} chunks')
            check_names(self._stream.name, self._summary)
        return self._summary

    @property
    def is_packed(self) -> bool:
        """Whether each message was compressed separately, as rosbag2 can do."""
        indexes, _ = self._select(None, ALL_TIMES_NS)
        return any(self._read(each, None).is_packed for each in indexes[:1])

    def check(self) -> None:
        """Check the data by checksum, and the statistics by the lengths of the indexes."""
        left_bytes, crc = self._summary_start - _DATA_END.size, 0
        self._stream.seek(left_bytes)
        opcode, _, expected = _DATA_END.unpack(self._stream.read(_DATA_END.size))
        if opcode != Opcode.DATA_END:
            raise ValueError('its data does not end at its summary')
        self._stream.seek(0)
        while expected and (block := self._stream.read(min(left_bytes, _BLOCK_BYTES))):
            crc, left_bytes = zlib.crc32(block, crc), left_bytes - len(block)
        if crc != expected:
            raise ValueError('the checksum of its data is wrong')
        self._check_counts()

    def _check_counts(self) -> None:
        """Refuse messages of undescribed channels, and statistics that differ from the indexes."""
        summary, counts = self.get_summary(), Counter[int]()
        for index in summary.chunk_indexes:
            rows = _counts_in(index)
            counts += Counter(self._read(index, None).channels.tolist()) if rows is None else rows
        if unknown := counts.keys() - summary.channels.keys():
            raise ValueError(f'channel {min(unknown)} is not described')
        if (statistics := summary.statistics) is None:
            return
        by_channel = Counter(statistics.channel_message_counts) or counts  # empty: not known
        topics = {key: each.topic for key, each in summary.channels.items()}
        differ = [topic for key, topic in topics.items() if counts[key] != by_channel[key]]
        if differ or counts.total() != statistics.message_count:
            problem = f'it holds {counts.total()} messages, and its statistics count '
            problem += f'{statistics.message_count}, others of {", ".join(differ)}'
            raise Miscounted(self._stream.name, problem, _COUNT_ANEW)

    def pieces(
        self, topics: Collection[str] | None = None, window_ns: tuple[int, int] = ALL_TIMES_NS
    ) -> Iterator[ChunkMessages]:
        """Yield messages chunk by chunk, in file order; a window takes whole chunks."""
        indexes, wanted = self._select(topics, window_ns)
        for index in indexes:
            yield self._read(index, wanted)

    def ends(self, topic: str) -> list[Message]:
        """Return the first and the last message of a topic, in file order."""
        indexes, wanted = self._select([topic], ALL_TIMES_NS)
        found = []
        for place, order in ((0, indexes), (-1, indexes[::-1])):
            pieces = (self._read(index, wanted) for index in order)
            found += next(([each.message(place)] for each in pieces if len(each.starts)), [])
        return found

    def messages(
        self,
        topics: Collection[str] | None = None,
        window_ns: tuple[int, int] = ALL_TIMES_NS,
        *,
        in_time_order: bool = True,
    ) -> Iterator[tuple[Schema | None, Channel, Message]]:
        """Yield schema, channel and message, in the order of log times or of the file."""
        summary = self.get_summary()
        indexes, wanted = self._select(topics, window_ns)
        rows: Iterator[_MergeRow]
        if in_time_order:
            rows = heapq.merge(*(self._by_time(index, wanted) for index in indexes))
        else:
            pieces = self.pieces(topics, window_ns)
            rows = ((0, 0, at, each) for each in pieces for at in range(len(each.starts)))
        for _, _, place, piece in rows:
            if piece is not None:
                message = piece.message(place)
                channel = summary.channels[message.channel_id]
                schema = summary.schemas[channel.schema_id] if channel.schema_id else None
                yield schema, channel, message

    def _by_time(self, index: ChunkIndex, wanted: set[int] | None) -> Iterator[_MergeRow]:
        """Yield the start of a chunk, then its messages by time; a chunk opens when it is due."""
        yield *begin_of(index), -1, None
        piece = self._read(index, wanted)
        self._opened_bytes += len(piece.data)
        if self._opened_bytes > CHUNK_MAX_BYTES:
            problem = f'{self._opened_bytes} bytes in chunks of one time: above {CHUNK_MAX_BYTES}'
            raise ValueError(problem)
        for place in np.argsort(piece.times_ns, kind='stable').tolist():
            yield int(piece.times_ns[place]), index.chunk_start_offset, place, piece
        self._opened_bytes -= len(piece.data)

    def _select(
        self, topics: Collection[str] | None, window_ns: tuple[int, int]
    ) -> tuple[list[ChunkIndex], set[int] | None]:
        """Return chunks that may hold wanted messages, and the channels; None means all."""
        summary = self.get_summary()
        wanted = None
        if topics is not None:
            wanted = {key for key, each in summary.channels.items() if each.topic in topics}
        found = [
            each
            for each in summary.chunk_indexes
            if each.message_end_time >= window_ns[0]
            and each.message_start_time <= window_ns[1]
            and (
                wanted is None
                or not each.message_index_offsets
                or wanted & each.message_index_offsets.keys()
            )
        ]
        return found, wanted

    def _read(self, index: ChunkIndex, wanted: set[int] | None) -> ChunkMessages:
        """Return the messages of a chunk."""
        self._stream.seek(index.chunk_start_offset + RECORD_HEAD.size)
        chunk = Chunk.read(ReadDataStream(self._stream))
        packed = self._stream.name, len(chunk.data)
        piece = find_messages(unpack_chunk(chunk), wanted, packed)
        first_ns, last_ns = index.message_start_time, index.message_end_time
        at = f'the chunk at byte {index.chunk_start_offset}'
        wrong = (piece.times_ns < first_ns) | (piece.times_ns > last_ns)
        if wrong.any():  # windows select chunks by these times
            at_ns = piece.times_ns[wrong][0]
            raise ValueError(f'{at} announces {first_ns} ns to {last_ns} ns, and holds {at_ns} ns')
        found, rows = Counter(piece.channels.tolist()), _counts_in(index)
        if rows is not None and any(found[key] != rows[key] for key in wanted or found | rows):
            problem = f'{at} holds {found.total()} messages, but its index lists others'
            raise Miscounted(self._stream.name, problem, _COUNT_ANEW)
        return unpack_messages(piece)


@lru_cache(maxsize=SUMMARIES_KEPT)
def _summary_of(data: bytes) -> Summary:
    """
    Return the summary at the end of a file, its chunks sorted; it is cached: do not change it.

    The library's own reader would unpack a chunk inside the summary, however large.

    """
    summary = Summary()
    records = StreamReader(
        BytesIO(data), skip_magic=True, emit_chunks=True, record_size_limit=len(data)
    ).records
    for each in records:
        if isinstance(each, Schema):
            summary.schemas[each.id] = each
        elif isinstance(each, Channel):
            summary.channels[each.id] = each
        elif isinstance(each, Statistics):
            summary.statistics = each
        elif isinstance(each, ChunkIndex):
            summary.chunk_indexes.append(each)
        elif isinstance(each, AttachmentIndex):
            summary.attachment_indexes.append(each)
        elif isinstance(each, MetadataIndex):
            summary.metadata_indexes.append(each)
    summary.chunk_indexes.sort(key=lambda each: each.chunk_start_offset)
    for one, other in pairwise(summary.chunk_indexes):
        if other.chunk_start_offset < one.chunk_start_offset + one.chunk_length:
            at = other.chunk_start_offset
            raise ValueError(
                f'its index lists the chunk at byte {at} twice, or inside another chunk'
            )
    return summary


def check_names(path: object, summary: Summary) -> None:
    """Refuse too many or too long names in a summary; duplicates count."""
    kinds = [each.name for each in summary.schemas.values()]
    topics = [each.topic for each in summary.channels.values()]
    extras = len(summary.metadata_indexes) + len(summary.attachment_indexes)
    budget.NAMES_MOST.check(max(len(kinds), len(topics), extras), path)
    budget.NAME_CHARACTERS.check(max(map(len, kinds + topics), default=0), path)


def _counts_in(index: ChunkIndex) -> Counter[int] | None:
    """Count the messages of each channel by the lengths of its index; None without indexes."""
    if not index.message_index_length:
        return None
    begin = index.chunk_start_offset + index.chunk_length
    starts = sorted((at, key) for key, at in index.message_index_offsets.items())
    ends = [*(at for at, _ in starts[1:]), begin + index.message_index_length]
    if not starts or starts[0][0] != begin:
        problem = f'the message indexes behind byte {index.chunk_start_offset} do not match'
        raise ValueError(problem)
    rows_bytes = (
        (key, end - at - INDEX_HEAD_BYTES) for (at, key), end in zip(starts, ends, strict=True)
    )
    return Counter({key: size_bytes // INDEX_ROW_BYTES for key, size_bytes in rows_bytes})


def begin_of(index: ChunkIndex) -> tuple[int, int]:
    """Return start time and offset of a chunk."""
    return index.message_start_time, index.chunk_start_offset
