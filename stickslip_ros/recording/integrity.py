# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Check that a recording is complete; refuse another with a remedy."""

import os
import shlex
import sqlite3
import struct
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO, Final

import zstandard
from mcap.exceptions import McapError
from mcap.opcode import Opcode

from stickslip_ros.errors import RecordingError, StickSlipError
from stickslip_ros.files import read_bytes, readable
from stickslip_ros.recording.chunks import MAGIC, ChunkReader
from stickslip_ros.recording.database import DATABASE_MAGIC, open_database
from stickslip_ros.recording.layout import STORAGES

_ROS_1_MAGIC: Final = b'#ROSBAG V'
_PX4_MAGIC: Final = b'ULog\x01\x12\x35'
PROFILE: Final = 'ros2'
CRC_BYTES: Final = 4

#: What the libraries underneath raise on bytes that make no sense.
DAMAGE: Final = (
    McapError,
    ValueError,
    LookupError,
    ArithmeticError,
    OSError,
    MemoryError,
    RuntimeError,
    sqlite3.Error,
    struct.error,
    zstandard.ZstdError,
)
_FOOTER: Final = struct.Struct('<BQQQI')
_DATA_END: Final = struct.Struct('<BQI')
_BLOCK_BYTES: Final = 1 << 20


def is_recording(path: Path) -> bool:
    """Return whether a path is that of a recording, or of a log of another program."""
    if path.is_dir() or path.suffix.lower() in STORAGES:
        return True
    return _begin_of(path).startswith((MAGIC, DATABASE_MAGIC, _ROS_1_MAGIC, _PX4_MAGIC))


def is_database(path: Path) -> bool:
    """Return whether a path is that of a file of storage sqlite3."""
    return path.is_file() and _begin_of(path) == DATABASE_MAGIC


def _begin_of(path: Path) -> bytes:
    return read_bytes(path, 'check the path', len(DATABASE_MAGIC))


def recover_hint(path: Path) -> str:
    """Say how to save what can be read of a file or a directory."""
    name = shlex.quote(str(path))
    if is_database(path):
        return f'save what is whole with: sqlite3 {name} .recover | sqlite3 saved.db3'
    return f'save what is whole with "stickslip recover {name}"'


def convert_hint(path: Path) -> str:
    """Say how a compressed bag, or one of ROS 1, becomes one that opens here."""
    source, target = map(shlex.quote, (str(path), str(path.with_name(f'{path.stem}_ros2'))))
    return f'"pip install rosbags", then "rosbags-convert --src {source} --dst {target}"'


@contextmanager
def open_whole(path: Path, *, checks_data: bool = False) -> Iterator[ChunkReader]:
    """
    Open a recording, and give the reader's complaints about its bytes as RecordingError.

    Raises RecordingError if the file is not there, is no MCAP, is cut off, has no summary or is
    damaged.

    """
    try:
        stream = readable(path).open('rb')
    except (OSError, ValueError) as error:
        problem = f'it cannot be opened ({getattr(error, "strerror", error)})'
        raise RecordingError(path, problem, 'check the name and its permissions') from error
    with stream:
        try:
            if is_database(path):
                with open_database(path, checks_data=checks_data) as database:
                    yield database
                return
            summary_start, size_bytes = _check_ends(path, stream), stream.seek(0, os.SEEK_END)
            if checks_data:
                end = summary_start - _DATA_END.size
                stream.seek(end)
                opcode, _, expected = _DATA_END.unpack(stream.read(_DATA_END.size))
                if opcode != Opcode.DATA_END:
                    raise ValueError('its data does not end at its summary')
                if expected not in {0, _checksum(stream, 0, end) if expected else 0}:
                    raise ValueError('the checksum of its data is wrong')
            stream.seek(0)
            reader = ChunkReader(stream, size_bytes, summary_start)
            if checks_data:
                reader.check_counts()
            yield reader
        except StickSlipError:
            raise
        except DAMAGE as error:
            kind = '' if isinstance(error, ValueError) else f'{type(error).__name__} '
            problem = f'it is damaged ({kind}{error})'
            raise RecordingError(path, problem, recover_hint(path)) from error


def refuse_foreign(path: Path) -> None:
    """Refuse a file that does not begin as a bag of ROS 2 does, and name the way to one."""
    begin = _begin_of(path)
    if begin.startswith(_ROS_1_MAGIC):
        raise RecordingError(path, 'it is a bag of ROS 1', convert_hint(path))
    if begin.startswith(_PX4_MAGIC):
        command = f'"pip install pyulog", then "ulog2csv {shlex.quote(str(path))}"'
        hint = f'{command} makes tables: --map time_s="timestamp (us)"'
        raise RecordingError(path, 'it is a log of PX4 (ULog)', hint)
    if not begin:
        raise RecordingError(path, 'it is not an MCAP file: it is empty', 'name another recording')
    if not begin.startswith((MAGIC, DATABASE_MAGIC)):
        hint = 'name a recording that ends in .mcap or .db3'
        raise RecordingError(path, 'it is not an MCAP file', hint)


def _check_ends(path: Path, stream: BinaryIO) -> int:
    """Look at both ends of a file; give where its summary begins."""
    refuse_foreign(path)
    end_bytes = _FOOTER.size + len(MAGIC)
    tail_start = max(stream.seek(0, os.SEEK_END) - end_bytes, 0)
    stream.seek(tail_start)
    tail = stream.read()
    if len(tail) < end_bytes or not tail.endswith(MAGIC):
        problem = 'its end is missing: the recording was cut off'
        raise RecordingError(path, problem, recover_hint(path))
    _, _, summary_start, _, expected = _FOOTER.unpack_from(tail)
    if summary_start == 0:
        raise RecordingError(path, 'it has no summary', recover_hint(path))
    checked_bytes = tail_start + _FOOTER.size - CRC_BYTES - summary_start
    if expected not in {0, _checksum(stream, summary_start, checked_bytes)}:
        raise ValueError('the checksum of its summary is wrong')
    return int(summary_start)


def _checksum(stream: BinaryIO, start: int, size_bytes: int) -> int:
    """Return the checksum of a stretch of a file."""
    stream.seek(start)
    crc = 0
    while size_bytes > 0 and (block := stream.read(min(size_bytes, _BLOCK_BYTES))):
        crc = zlib.crc32(block, crc)
        size_bytes -= len(block)
    return crc
