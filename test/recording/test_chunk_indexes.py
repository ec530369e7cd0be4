"""Indexes of chunks leave the memory, and the file is what it would be with them in it."""

import gc
from pathlib import Path

import pytest
from mcap.reader import make_reader
from mcap.records import ChunkIndex

from stickslip_ros.recording import chunk_indexes
from stickslip_ros.recording.cdr import pack_float64
from stickslip_ros.recording.channels import Channel, Qos
from stickslip_ros.recording.chunks import Stored
from stickslip_ros.recording.container import Container
from stickslip_ros.recording.file_form import FileForm

CHANNELS = [Channel(f'/t{i}', 'std_msgs/msg/Float64', Qos(depth=1)) for i in range(3)]
FORM = FileForm(compression='none', chunk_size_bytes=100)
CHUNKS = 40


def begin(path: Path) -> Container:
    container = Container(path, CHANNELS, FORM)
    container.start({}, {})
    return container


def fill(container: Container) -> None:
    for i in range(4 * CHUNKS):
        container.write(Stored(1 + i % 3, i, pack_float64(float(i)), i))


def chunk_indexes_in_memory() -> int:
    gc.collect()
    return sum(type(each) is ChunkIndex for each in gc.get_objects())


def written(path: Path) -> bytes:
    container = begin(path)
    fill(container)
    container.finish({})
    return path.read_bytes()


def test_no_index_stays_in_memory(tmp_path: Path):
    container = begin(tmp_path / 'a.mcap')
    before = chunk_indexes_in_memory()
    fill(container)
    assert container.chunks > CHUNKS / 2
    assert chunk_indexes_in_memory() <= before
    container.finish({})
    with (tmp_path / 'a.mcap').open('rb') as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    assert len(summary.chunk_indexes) == container.chunks


def test_the_file_is_that_of_a_writer_which_keeps_them(tmp_path: Path, monkeypatch):
    spilled = written(tmp_path / 'spilled.mcap')
    monkeypatch.setattr(chunk_indexes, 'LIST_OF_WRITER', '_no_such_name')
    assert written(tmp_path / 'kept.mcap') == spilled


@pytest.mark.parametrize('room_bytes', [0, 1, 500, 1500])
def test_a_full_temporary_folder_costs_memory_only(tmp_path: Path, monkeypatch, room_bytes: int):
    spilled = written(tmp_path / 'spilled.mcap')
    container = begin(tmp_path / 'full.mcap')
    indexes = getattr(container._writer, chunk_indexes.LIST_OF_WRITER)
    indexes._file = Full(indexes._file, room_bytes)
    fill(container)
    assert len(indexes._kept) > 0
    container.finish({})
    assert (tmp_path / 'full.mcap').read_bytes() == spilled


def test_without_a_temporary_folder(tmp_path: Path, monkeypatch):
    spilled = written(tmp_path / 'spilled.mcap')

    def refuse(**_: object) -> None:
        raise FileNotFoundError('No usable temporary directory found')

    monkeypatch.setattr(chunk_indexes.tempfile, 'TemporaryFile', refuse)
    assert written(tmp_path / 'kept.mcap') == spilled


class Full:
    """A file on a disk with little room: what is too much is written in part, then refused."""

    def __init__(self, file, room_bytes: int) -> None:
        self._file = file
        self._room_bytes = room_bytes

    def write(self, data: bytes) -> int:
        if not self._room_bytes:
            raise OSError(28, 'No space left on device')
        part = data[: self._room_bytes]
        self._room_bytes -= len(part)
        return self._file.write(part)

    def __getattr__(self, name: str):
        return getattr(self._file, name)
