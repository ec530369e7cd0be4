# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Check that a recording is complete; refuse incomplete files with a remedy."""

import os
import shlex
import sqlite3
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO, Final

import zstandard
from mcap.exceptions import McapError

from stickslip_ros.errors import RecordingError, StickSlipError
from stickslip_ros.files import SWEEP_PARTS, read_bytes, readable
from stickslip_ros.process.stopping import stop_if_asked
from stickslip_ros.recording.chunks import MAGIC, ZSTD_MAGIC, ChunkReader
from stickslip_ros.recording.database import DATABASE_MAGIC, open_database
from stickslip_ros.recording.layout import STORAGES

_ROS_1_MAGIC: Final = b'#ROSBAG V'
PROFILE: Final = 'ros2'

#: Errors that libraries raise on malformed bytes.
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


def is_recording(path: Path) -> bool:
    """Return whether a file or directory is a recording or another program's log."""
    if path.is_dir():
        return not any(path.glob(SWEEP_PARTS))
    if path.suffix.lower() in STORAGES:
        return True
    return _begin_of(path).startswith((MAGIC, DATABASE_MAGIC, _ROS_1_MAGIC, ZSTD_MAGIC))


def is_database(path: Path) -> bool:
    """Return whether a file has storage sqlite3."""
    return path.is_file() and _begin_of(path) == DATABASE_MAGIC


def _begin_of(path: Path) -> bytes:
    return read_bytes(path, 'check the path', len(DATABASE_MAGIC))


def recover_hint(path: Path) -> str:
    """Return the command that saves the readable part of a file or directory."""
    name = shlex.quote(str(path))
    if is_database(path):
        return f'save the readable part with: sqlite3 {name} .recover | sqlite3 saved.db3'
    return f'save the readable part with "stickslip recover {name}"'


def convert_hint(path: Path) -> str:
    """Return the commands that convert a compressed bag, or a bag of ROS 1."""
    source, target = map(shlex.quote, (str(path), str(path.with_name(f'{path.stem}_ros2'))))
    return f'"pip install rosbags", then "rosbags-convert --src {source} --dst {target}"'


@contextmanager
def open_whole(path: Path) -> Iterator[ChunkReader]:
    """
    Open a recording; turn the reader's errors into RecordingError.

    Raises RecordingError if the file is not there, is no MCAP, is cut off or is damaged.

    """
    try:
        stream = readable(path).open('rb')
    except (OSError, ValueError) as error:
        problem = f'it cannot be opened ({getattr(error, "strerror", error)})'
        raise RecordingError(path, problem, 'check the name and its permissions') from error
    with stream:
        try:
            begin = stream.read(len(DATABASE_MAGIC))
            if begin == DATABASE_MAGIC:
                with open_database(path) as database:
                    yield database
            else:
                refuse_foreign(path, begin)
                yield ChunkReader(stream, _summary_start(path, stream))
        except StickSlipError:
            raise
        except DAMAGE as error:
            stop_if_asked()  # a stop interrupts a query of a database
            kind = '' if isinstance(error, ValueError) else f'{type(error).__name__} '
            problem = f'it is damaged ({kind}{error})'
            raise RecordingError(path, problem, recover_hint(path)) from error


def refuse_foreign(path: Path, begin: bytes = b'') -> None:
    """Refuse a file that is no bag of ROS 2 by its first bytes; name the remedy."""
    begin = begin or _begin_of(path)
    if begin.startswith(_ROS_1_MAGIC):
        raise RecordingError(path, 'it is a bag of ROS 1', convert_hint(path))
    if begin.startswith(ZSTD_MAGIC):
        name, unpacked = shlex.quote(str(path)), path.with_suffix('').name
        hint = f'unpack it with "zstd -d {name}", and name {unpacked}'
        raise RecordingError(path, 'it is compressed by zstd', hint)
    if not begin:
        raise RecordingError(path, 'it is not an MCAP file: it is empty', 'name another recording')
    if not begin.startswith((MAGIC, DATABASE_MAGIC)):
        hint = 'name a recording that ends in .mcap or .db3'
        raise RecordingError(path, 'it is not an MCAP file', hint)


def _summary_start(path: Path, stream: BinaryIO) -> int:
    """Return the offset of the summary, or of the footer without one; refuse a cut-off file."""
    end_bytes = _FOOTER.size + len(MAGIC)
    stream.seek(max(stream.seek(0, os.SEEK_END) - end_bytes, 0))
    tail = stream.read()
    if len(tail) < end_bytes or not tail.endswith(MAGIC):
        problem = 'its end is missing: the recording was cut off'
        raise RecordingError(path, problem, recover_hint(path))
    _, _, summary_start, _, _ = _FOOTER.unpack_from(tail)
    return int(summary_start) or stream.tell() - end_bytes
