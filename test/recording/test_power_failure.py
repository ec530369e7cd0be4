# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Wherever a kill or a power failure interrupts the writer, what it had secured comes back."""

import os
from itertools import pairwise
from pathlib import Path
from random import Random

import pytest
from mcap_records import Row, rows_of

from stickslip_ros.interface import cdr
from stickslip_ros.interface.channels import Channel, Qos
from stickslip_ros.message_types import FLOAT64
from stickslip_ros.recording.layout import FileForm, Layout
from stickslip_ros.recording.recover import recover_file
from stickslip_ros.recording.storage import RunFiles
from stickslip_ros.recording.writer import Stored

MESSAGES = 100
SECTOR_BYTES = 128
"""What a disk writes at once; smaller than a real one, so that these files have several."""
KILLS = 4
"""Between two calls that bring the file to the disk."""


@pytest.mark.parametrize('compression', ['zstd', 'lz4', 'none'])
def test_no_moment_loses_what_was_secured(tmp_path, monkeypatch, compression):
    """
    The file only grows, so a kill leaves a beginning of it.

    A power failure leaves what was brought to the disk, and any sectors of what was written since.

    """
    path = tmp_path / 'run.mcap'
    safe: list[tuple[int, int]] = [(0, 0)]
    fsync = os.fsync

    def watched(handle: int) -> None:
        fsync(handle)
        if path.exists() and os.path.sameopenfile(handle, stream.fileno()):
            safe.append((path.stat().st_size, files.written))

    channels = [Channel(f'/t{i}', FLOAT64, Qos(1)) for i in range(3)]
    form = FileForm(compression, chunk_size_bytes=1500, flush_period_s=0.0)
    files = RunFiles(Layout.plan(path), channels, form, {'run': {'seed': '7'}}, {}, dict)
    with path.open('rb') as stream, monkeypatch.context() as patch:
        patch.setattr(os, 'fsync', watched)
        for number in range(MESSAGES):
            value = Random(number).random()
            files.write(Stored(1 + number % 3, number, cdr.pack_float64(value), number // 3))
            if number % 7 == 0:
                files.keep()
                assert files.secured == files.written
        files.finish()
    content, expected = path.read_bytes(), rows_of(path)
    assert len(expected) == MESSAGES
    assert len(safe) > MESSAGES // 7
    random = Random(16)
    for (before, secured), (after, _) in pairwise(safe):
        for end in (before, *(random.randrange(before, after) for _ in range(KILLS)), after):
            rows = recovered(content[:end], tmp_path) if secured else []
            assert rows == expected[: len(rows)]
            assert len(rows) >= secured
        mixed = bytearray(content[:before].ljust(after, b'\0'))
        for start in range(before, after, SECTOR_BYTES):
            if random.random() < 0.5:
                mixed[start : start + SECTOR_BYTES] = content[start:after][:SECTOR_BYTES]
        rows = recovered(bytes(mixed), tmp_path) if secured else []
        assert rows[:secured] == expected[:secured]
        assert set(rows) <= set(expected)


def recovered(content: bytes, folder: Path) -> list[Row]:
    """Give the messages that come back."""
    source, output = folder / 'source.mcap', folder / 'output.mcap'
    output.unlink(missing_ok=True)
    source.write_bytes(content)
    recovery = recover_file(source, output)
    return rows_of(source if recovery.is_whole else output)
