"""Wherever a kill or a power failure interrupts the writer, what it had secured comes back."""

import os
from collections.abc import Callable
from functools import partial
from pathlib import Path
from random import Random
from typing import NamedTuple

import pytest
from mcap_records import Row, rows_of

from stickslip_ros.recording import Channel, FileForm, Qos, cdr
from stickslip_ros.recording import messages as m
from stickslip_ros.recording.mcap_writer import McapWriter, Stored
from stickslip_ros.recording.recover import recover_file

MESSAGES = 100
SECTOR_BYTES = 128
"""What a disk writes at once; smaller than a real one, so that these files have several."""


class Moment(NamedTuple):
    """What the file may be when the process or the machine stops, and what had been promised."""

    content: bytes
    secured: int


class Disk:
    """
    Stands before the system calls and collects what a stop in any of them could leave.

    A kill leaves a beginning of the call; a power failure leaves what was brought to the disk, and
    any sectors of what was written since.

    """

    def __init__(self, patch: pytest.MonkeyPatch, path: Path) -> None:
        self.path = path
        self.secured = 0
        self.killed: list[Moment] = []
        self.failed: list[Moment] = []
        self._random = Random(16)
        self._safe = b''
        for name in ('pwrite', 'ftruncate', 'fsync'):
            patch.setattr(os, name, partial(self._call, name, getattr(os, name)))

    def _call(self, name: str, call: Callable, handle: int, *args):
        if name == 'pwrite':
            data, offset = args
            call(handle, data[: self._random.randrange(len(data))], offset)
            self._look()
        result = call(handle, *args)
        self._look()
        if name == 'fsync':
            self._safe = self.path.read_bytes()
        return result

    def _look(self) -> None:
        now = self.path.read_bytes()
        self.killed.append(Moment(now, self.secured))
        size = self._random.choice([len(now), len(self._safe)])
        mixed = bytearray(self._safe.ljust(size, b'\0'))
        for start in range(0, len(now), SECTOR_BYTES):
            if self._random.random() < 0.5:
                mixed[start : start + SECTOR_BYTES] = now[start : start + SECTOR_BYTES]
        self.failed.append(Moment(bytes(mixed[:size]), self.secured))


@pytest.mark.parametrize('compression', ['zstd', 'lz4', 'none'])
def test_no_moment_loses_what_was_secured(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, compression: str
):
    channels = [Channel(f'/t{i}', m.FLOAT64, Qos(1)) for i in range(3)]
    form = FileForm(compression, chunk_size_bytes=1500)
    with monkeypatch.context() as patch:
        disk = Disk(patch, tmp_path / 'run.mcap')
        writer = McapWriter(disk.path, channels, form, {'run': {'seed': '7'}}, {})
        for number in range(MESSAGES):
            value = Random(number).random()
            writer.write(Stored(1 + number % 3, number, cdr.pack_float64(value), number // 3))
            if number % 7 == 0:
                writer.secure()
                disk.secured = number + 1
        writer.finish({'end': {'written': str(MESSAGES)}})
    expected = rows_of(disk.path)
    assert len(expected) == MESSAGES
    assert any(moment.secured for moment in disk.killed)
    for moment in disk.killed:
        rows, _ = recovered(moment, tmp_path)
        assert rows == expected[: len(rows)]
        assert len(rows) >= moment.secured
    for moment in disk.failed:
        rows, unchecked = recovered(moment, tmp_path)
        assert set(rows) >= set(expected[: moment.secured])
        assert len(set(rows)) == len(rows)
        assert len(set(rows) - set(expected)) <= unchecked


def recovered(moment: Moment, folder: Path) -> tuple[list[Row], int]:
    """Give the messages that come back, and how many of them no checksum covers."""
    if moment.secured == 0:
        return [], 0
    source, output = folder / 'source.mcap', folder / 'output.mcap'
    output.unlink(missing_ok=True)
    source.write_bytes(moment.content)
    recovery = recover_file(source, output)
    return rows_of(source if recovery.is_whole else output), recovery.unchecked
