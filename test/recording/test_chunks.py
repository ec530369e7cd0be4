# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A chunk is unpacked into what it announces, in a memory that the file cannot choose."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import lz4.frame
import numpy as np
import pytest
import zstandard
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.data_stream import RecordBuilder
from mcap.reader import make_reader
from mcap.records import (
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Message,
    Schema,
)
from mcap.writer import CompressionType
from mcap_records import foreign
from memory import memory_limited_to

from stickslip_ros.errors import Miscounted, RecordingError
from stickslip_ros.interface.cdr import pack_float64
from stickslip_ros.message_types import FLOAT64
from stickslip_ros.recording import chunks
from stickslip_ros.recording.chunks import MAGIC
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.recover import recover_file

GIGA = 1 << 30
ROOM_BYTES = 100 << 20  # what may be taken beside what the process has
LARGE_BYTES = 2 * ROOM_BYTES
NUMBERS = [Schema(1, b'float64 data', 'ros2msg', FLOAT64), Channel(1, '/u', 'cdr', {}, 1)]


def encoded(*records: McapRecord) -> bytes:
    builder = RecordBuilder()
    for record in records:
        record.write(builder)
    return bytes(builder.end())


def message(time_ns: int, value: float = 0.0, channel: int = 1) -> Message:
    return Message(channel, time_ns, pack_float64(value), time_ns, 0)


def hand_made(path: Path, *parts: Chunk) -> Path:
    """Write a file of these chunks, whatever they say of themselves."""
    content = MAGIC + encoded(Header('ros2', 'by hand'))
    indexes = []
    for part in parts:
        written = encoded(part)
        indexes.append(
            ChunkIndex(
                len(written),
                len(content),
                part.compression,
                len(part.data),
                part.message_end_time,
                0,
                {},
                part.message_start_time,
                part.uncompressed_size,
            )
        )
        content += written
    content += encoded(DataEnd(0))
    summary = encoded(*NUMBERS, *indexes)
    path.write_bytes(content + summary + encoded(Footer(len(content), 0, 0)) + MAGIC)
    return path


def plain(*records: Message) -> Chunk:
    data, times_ns = encoded(*records), [each.log_time for each in records]
    return Chunk('', data, max(times_ns), min(times_ns), 0, len(data))


def announced(size_bytes: int) -> bytes:
    """Give the beginning of a frame that says how long its content is."""
    packer = zstandard.ZstdCompressor().compressobj(size=size_bytes)
    return packer.compress(bytes(1000)) + packer.flush(zstandard.COMPRESSOBJ_FLUSH_BLOCK)


def packed_by_zstd() -> bytes:
    return zstandard.ZstdCompressor(write_content_size=False).compress(bytes(LARGE_BYTES))


HOSTILE: dict[str, tuple[Callable[[], Chunk], str]] = {
    'large': (lambda: Chunk('zstd', announced(8 * GIGA), 0, 0, 0, 8 * GIGA), 'above the limit'),
    'zstd that lies': (lambda: Chunk('zstd', announced(8 * GIGA), 0, 0, 0, 1000), 'announces'),
    'zstd of no size': (lambda: Chunk('zstd', packed_by_zstd(), 0, 0, 0, 1000), 'full frame'),
    'lz4 that lies': (
        lambda: Chunk('lz4', lz4.frame.compress(bytes(LARGE_BYTES)), 0, 0, 0, 1000),
        'announces',
    ),
    'lz4 of no size': (
        lambda: Chunk(
            'lz4', lz4.frame.compress(bytes(LARGE_BYTES), store_size=False), 0, 0, 0, 1000
        ),
        'announces',
    ),
    'short': (lambda: Chunk('', b'', 0, 0, 0, 1000), 'announces'),
    'unknown': (lambda: Chunk('bz2', b'', 0, 0, 0, 0), 'compression .bz2. is not known'),
    'late, and says so': (
        lambda: plain(message(1 << 63)),
        'a time of 9223372036854775808 ns is above',
    ),
    'late': (
        lambda: replace(plain(message(1 << 63)), message_start_time=0, message_end_time=0),
        'a time of 9223372036854775808 ns is above',
    ),
    'of no channel': (lambda: plain(message(0, channel=7)), 'channel 7 is not described'),
    'of little messages': (
        lambda: Chunk('', b'\x05' + bytes(8), 0, 0, 0, 9),
        'a message of 0 bytes is below 22',
    ),
    'of a long record': (
        lambda: Chunk('', b'\x05\xff' + bytes(7), 0, 0, 0, 9),
        'longer than its chunk',
    ),
}


@pytest.mark.parametrize('kind', HOSTILE)
def test_a_chunk_that_is_not_what_it_announces_is_refused_in_little_memory(kind, tmp_path):
    chunk, told = HOSTILE[kind]
    path = hand_made(tmp_path / 'run.mcap', plain(message(5, 1.5)), chunk())
    with memory_limited_to(ROOM_BYTES):
        with pytest.raises(RecordingError, match=told):
            list(Recording(path).records())
        recovery = recover_file(path, tmp_path / 'output.mcap')
    assert recovery.messages == 1
    assert len(recovery.losses) == 1
    assert list(Recording(tmp_path / 'output.mcap').messages()) == [('/u', 5, 1.5)]


def test_chunks_of_one_time_are_not_all_opened_if_they_are_large(tmp_path, monkeypatch):
    parts = [plain(*(message(k) for k in range(100))) for _ in range(3)]
    path = hand_made(tmp_path / 'run.mcap', *parts)
    monkeypatch.setattr(chunks, 'CHUNK_MAX_BYTES', 2 * parts[0].uncompressed_size)
    assert len(list(Recording(path).records())) == 300
    with pytest.raises(RecordingError, match='in chunks of one time'):
        list(Recording(path).messages())


def change_index(path: Path, change: Callable[[ChunkIndex], ChunkIndex]) -> None:
    """Change what the summary of a file says of its first chunk."""
    with path.open('rb') as file:
        [first, *_] = make_reader(file).get_summary().chunk_indexes
    content, end = path.read_bytes(), Footer(0, 0, 0)
    at = content.rindex(encoded(first))
    begin = int.from_bytes(content[-len(MAGIC) - 20 : -len(MAGIC) - 12], 'little')
    summary = content[begin:at] + encoded(change(first)) + content[at + len(encoded(first)) :]
    behind = len(encoded(end)) + len(MAGIC)
    written = encoded(Footer(begin, 0, 0)) + MAGIC
    path.write_bytes(content[:begin] + summary[:-behind] + written)


def test_message_indexes_that_begin_elsewhere_than_behind_their_chunk_are_refused(indexed: Path):
    change_index(
        indexed,
        lambda each: replace(
            each,
            message_index_offsets={k: at + 16 for k, at in each.message_index_offsets.items()},
        ),
    )
    with pytest.raises(RecordingError, match=r'the message indexes behind byte .* do not match'):
        Recording(indexed)


def test_an_index_with_more_channels_than_its_chunk_is_refused(indexed: Path):
    """The numbers of the topics that are there are right."""

    def with_another(each: ChunkIndex) -> ChunkIndex:
        end = each.chunk_start_offset + each.chunk_length + each.message_index_length
        offsets = {**each.message_index_offsets, 9: end}
        return replace(
            each,
            message_index_offsets=offsets,
            message_index_length=(each.message_index_length + 15 + 16 * 3),
        )

    change_index(indexed, with_another)
    with indexed.open('rb') as file, pytest.raises(Miscounted, match='but its index lists others'):
        list(chunks.ChunkReader(file, summary_start_of(indexed)).pieces())


def summary_start_of(path: Path) -> int:
    return int.from_bytes(path.read_bytes()[-len(MAGIC) - 20 : -len(MAGIC) - 12], 'little')


PACKED = {
    'messages': encoded(message(1)) * 50_000,
    'records of another kind': (b'\x80' + bytes(8)) * 50_000,
    'zeros': bytes(500_000),
}


@pytest.mark.parametrize('kind', PACKED)
def test_a_small_chunk_does_not_unpack_to_many_records(kind: str, tmp_path: Path):
    data = PACKED[kind]
    packed = zstandard.ZstdCompressor().compress(data)
    path = hand_made(tmp_path / 'run.mcap', Chunk('zstd', packed, 1, 1, 0, len(data)))
    with pytest.raises(RecordingError, match=r'records in a chunk, above .* "mcap decompress"'):
        list(Recording(path).records())
    if kind == 'messages':  # the remedy
        path = hand_made(tmp_path / 'run.mcap', plain(*[message(1)] * 50_000))
        assert len(list(Recording(path).records())) == 50_000


@pytest.fixture
def indexed(tmp_path: Path) -> Path:
    """Write two topics in turn, in several chunks with an index of their messages."""
    writer = foreign(tmp_path / 'run.mcap', chunk_size=1000, compression=CompressionType.NONE)
    schema = writer.register_schema(FLOAT64, 'ros2msg', b'float64 data')
    numbers = [writer.register_channel(topic, 'cdr', schema) for topic in ('/u', '/v')]
    for at in range(100):
        writer.add_message(numbers[at % 2], at, pack_float64(float(at)), at, at)
    writer.finish()
    return tmp_path / 'run.mcap'


@pytest.mark.parametrize('wrong', [0, 1, 9, 1 << 20, (1 << 63) - 1])
def test_an_index_that_leads_nowhere_is_not_followed(indexed: Path, wrong: int):
    with indexed.open('rb') as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    content = bytearray(indexed.read_bytes())
    at = next(iter(summary.chunk_indexes[0].message_index_offsets.values()))
    head_bytes = 9 + 6 + 8  # of the record and of the index, and a time
    content[at + head_bytes : at + head_bytes + 8] = wrong.to_bytes(8, 'little')
    data_end = content.rindex(encoded(DataEnd(0))[:1] + (4).to_bytes(8, 'little')) + 9
    content[data_end : data_end + 4] = bytes(4)  # of which nothing is known then
    indexed.write_bytes(content)
    for topic, values in (('u', range(0, 100, 2)), ('v', range(1, 100, 2))):
        assert Recording(indexed).series(topic).value.tolist() == list(values)


@settings(derandomize=True, deadline=None, max_examples=50)
@given(
    parts=st.lists(st.lists(st.integers(0, 20), min_size=1, max_size=8), min_size=1, max_size=6),
    compression=st.sampled_from(CompressionType),
    topics=st.sampled_from([None, ['/a'], ['/b', '/a'], ['/nothing']]),
    in_time_order=st.booleans(),
)
def test_messages_come_in_the_order_in_which_the_mcap_library_gives_them(
    tmp_path_factory: pytest.TempPathFactory,
    parts: list[list[int]],
    compression: CompressionType,
    topics: list[str] | None,
    in_time_order: bool,
):
    """Chunks overlap in time, times repeat."""
    path = tmp_path_factory.mktemp('any') / 'run.mcap'
    writer = foreign(path, compression=compression)
    schema = writer.register_schema(FLOAT64, 'ros2msg', b'float64 data')
    numbers = [writer.register_channel(name, 'cdr', schema) for name in ('/a', '/b')]
    for part in parts:
        for place, time_ns in enumerate(part):
            writer.add_message(numbers[place % 2], time_ns, pack_float64(place), time_ns, place)
        writer.flush()
    writer.finish()
    with path.open('rb') as stream:
        expected = [
            (channel.topic, each)
            for _, channel, each in make_reader(stream).iter_messages(
                topics, log_time_order=in_time_order
            )
        ]
    found = Recording(path)._stored(topics, in_time_order=in_time_order)
    assert [(topic, each) for _, topic, each in found] == expected


def test_a_large_recording_is_read_in_the_memory_of_its_chunks(tmp_path: Path):
    """Fifty chunks of 4 MB, one after the other."""
    size_bytes = 4 << 20
    writer = foreign(tmp_path / 'run.mcap', chunk_size=size_bytes)
    schema = writer.register_schema('x/msg/Blob', 'ros2msg', b'uint8[] data')
    number = writer.register_channel('/blob', 'cdr', schema)
    for at in range(LARGE_BYTES // size_bytes):
        writer.add_message(number, at, bytes(size_bytes), at)
    writer.finish()
    with memory_limited_to(ROOM_BYTES):
        sizes = [len(each.data) for _, each in Recording(tmp_path / 'run.mcap').records()]
    np.testing.assert_array_equal(sizes, size_bytes)
