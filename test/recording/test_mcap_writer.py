"""A file has the bytes that the mcap package would write, without its indexes in the memory."""

import tempfile
import tracemalloc
from pathlib import Path

import pytest
from mcap.writer import CompressionType, Writer

from stickslip_ros.recording import SCHEMAS, TYPE_HASHES, Channel, FileForm, Qos, cdr
from stickslip_ros.recording import messages as m
from stickslip_ros.recording.mcap_writer import McapWriter, Stored

CHANNELS = [Channel(f'/t{i}', m.FLOAT64, Qos(depth=1)) for i in range(3)]
CHANNELS += [Channel('/status', m.UINT32, Qos(depth=1, latched=True))]
METADATA = {'run': {'seed': '7', 'specimen': 'steel µ'}, 'empty': {}}
ATTACHMENTS = {'a.yaml': ('application/yaml', b'a: 1\n'), 'none': ('', b'')}
CLOSING = {'end': {'written': '160'}}
MESSAGES_PER_CHUNK = 4
CHUNKS = 40


def begin(path: Path, compression: str = 'none') -> McapWriter:
    form = FileForm(compression, chunk_size_bytes=3 * 43)
    return McapWriter(path, CHANNELS, form, METADATA, ATTACHMENTS)


def messages(chunks: int = CHUNKS) -> list[Stored]:
    """Give the first message, which is a chunk by itself, and those of further chunks."""
    return [
        Stored(1 + i % 3, i, cdr.pack_float64(float(i)), i)
        for i in range(1 + chunks * MESSAGES_PER_CHUNK)
    ]


def written(path: Path, compression: str = 'none') -> bytes:
    writer = begin(path, compression)
    for message in messages():
        writer.write(message)
    writer.finish(CLOSING)
    return path.read_bytes()


def written_by_mcap(path: Path, compression: str, stored: list[Stored]) -> bytes:
    kinds = {
        'zstd': CompressionType.ZSTD,
        'lz4': CompressionType.LZ4,
        'none': CompressionType.NONE,
    }
    with path.open('wb') as stream:
        writer = Writer(stream, 1 << 40, kinds[compression], enable_data_crcs=True)
        writer.start('ros2')
        for name, (media_type, data) in ATTACHMENTS.items():
            writer.add_attachment(0, 0, name, media_type, data)
        for name, entries in METADATA.items():
            writer.add_metadata(name, entries)
        names = dict.fromkeys(channel.type_name for channel in CHANNELS)
        schemas = {
            name: writer.register_schema(name, 'ros2msg', SCHEMAS[name].encode()) for name in names
        }
        for channel in CHANNELS:
            described = {
                'offered_qos_profiles': channel.qos.to_yaml(),
                'topic_type_hash': TYPE_HASHES[channel.type_name],
            }
            writer.register_channel(channel.topic, 'cdr', schemas[channel.type_name], described)
        for number, (channel_id, time_ns, data, sequence) in enumerate(stored):
            writer.add_message(channel_id, time_ns, data, time_ns, sequence)
            if number % MESSAGES_PER_CHUNK == 0:
                writer.flush()
        for name, entries in CLOSING.items():
            writer.add_metadata(name, entries)
        writer.finish()
    return path.read_bytes()


@pytest.mark.parametrize('compression', ['zstd', 'lz4', 'none'])
def test_the_bytes_are_those_of_the_mcap_package(tmp_path: Path, compression: str):
    expected = written_by_mcap(tmp_path / 'mcap.mcap', compression, messages())
    assert written(tmp_path / 'ours.mcap', compression) == expected


def test_a_file_without_messages_is_that_of_the_mcap_package(tmp_path: Path):
    begin(tmp_path / 'ours.mcap').finish(CLOSING)
    expected = written_by_mcap(tmp_path / 'mcap.mcap', 'none', [])
    assert (tmp_path / 'ours.mcap').read_bytes() == expected


def test_a_long_file_takes_no_more_memory_than_a_short_one(tmp_path: Path):
    writer = begin(tmp_path / 'run.mcap')
    first, *rest = messages(chunks=1100)
    tracemalloc.start()
    for message in [first, *rest[:400]]:
        writer.write(message)
    before, _ = tracemalloc.get_traced_memory()
    for message in rest[400:]:
        writer.write(message)
    after, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    writer.finish({})
    assert writer.chunks > 1000
    assert after - before < 20_000


class Full:
    """A file on a disk with little room: what is too much is written in part, then refused."""

    def __init__(self, file, room_bytes: int) -> None:
        self._file = file
        self._room_bytes = room_bytes

    def write(self, data: bytes) -> int:
        if self._room_bytes == 0:
            raise OSError(28, 'No space left on device')
        written = self._file.write(data[: self._room_bytes])
        self._room_bytes -= written
        return written

    def __getattr__(self, name: str):
        return getattr(self._file, name)


@pytest.mark.parametrize('room_bytes', [0, 1, 500, 1500])
def test_a_full_temporary_folder_costs_memory_only(tmp_path: Path, monkeypatch, room_bytes: int):
    expected = written(tmp_path / 'spilled.mcap')
    make = tempfile.TemporaryFile
    monkeypatch.setattr(tempfile, 'TemporaryFile', lambda **given: Full(make(**given), room_bytes))
    assert written(tmp_path / 'full.mcap') == expected


def test_without_a_temporary_folder_it_costs_memory_too(tmp_path: Path, monkeypatch):
    expected = written(tmp_path / 'spilled.mcap')

    def refuse(**_: object) -> None:
        raise FileNotFoundError('No usable temporary directory found')

    monkeypatch.setattr(tempfile, 'TemporaryFile', refuse)
    assert written(tmp_path / 'kept.mcap') == expected
