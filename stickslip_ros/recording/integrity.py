"""Whether a file is a whole MCAP container, said in words that tell what to do about it."""

import shlex
import struct
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO, Final

import zstandard
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.reader import McapReader, SeekingReader

from stickslip_ros.errors import RecordingError, StickSlipError
from stickslip_ros.files import readable

MAGIC: Final = b'\x89MCAP0\r\n'
SQLITE_MAGIC: Final = b'SQLite format 3\0'
PROFILE: Final = 'ros2'

#: What the libraries underneath raise on bytes that make no sense.
DAMAGE: Final = (
    McapError,
    ValueError,
    LookupError,
    ArithmeticError,
    OSError,
    MemoryError,
    RuntimeError,
    struct.error,
    zstandard.ZstdError,
)
_FOOTER: Final = struct.Struct('<BQQQI')
_DATA_END: Final = struct.Struct('<BQI')
#: The checksum itself and the magic behind it.
_UNCHECKED_BYTES: Final = 4 + len(MAGIC)
_BLOCK_BYTES: Final = 1 << 20


def recover_mend(path: Path) -> str:
    """Say how to save what can be read of a file or a directory."""
    return f'save what is whole with "stickslip recover {shlex.quote(str(path))}"'


def convert_mend(path: Path) -> str:
    """Say how a bag of another storage becomes one that opens here."""
    return (
        f'convert it with "ros2 bag convert -i {shlex.quote(str(path))} -o FILE", where FILE says '
        '"output_bags: [{uri: converted, storage_id: mcap, all_topics: true}]"'
    )


@contextmanager
def open_whole(path: Path) -> Iterator[McapReader]:
    """
    Open a recording, and give the reader's complaints about its bytes as RecordingError.

    Raises
    ------
    RecordingError
        If the file is not there, is no MCAP, is cut off, has no summary or is damaged.

    """
    with _open(path) as stream:
        try:
            size_bytes = _check(path, stream)
            stream.seek(0)
            yield SeekingReader(stream, validate_crcs=True, record_size_limit=size_bytes)
        except StickSlipError:
            raise
        except DAMAGE as error:
            raise _damaged(path, f'{type(error).__name__} {error}') from error


def check_data(path: Path) -> None:
    """
    Compare all that stands before the summary with its checksum, where there is one.

    The checksums of chunks say nothing of metadata, attachments and indexes: this one does.

    Raises
    ------
    RecordingError
        If the file is not whole.

    """
    with open_whole(path), path.open('rb') as stream:
        _, _, summary_start, _, _ = _FOOTER.unpack(_tail(stream)[: _FOOTER.size])
        end = summary_start - _DATA_END.size
        stream.seek(end)
        opcode, _, expected = _DATA_END.unpack(stream.read(_DATA_END.size))
        if opcode != Opcode.DATA_END:
            raise _damaged(path, 'its data and its summary do not meet')
        if expected and expected != _checksum(stream, end):
            raise _damaged(path, 'the checksum of its data is wrong')


def check_profile(path: Path, reader: McapReader) -> None:
    """
    Make sure that an MCAP file was made for ROS 2.

    Raises
    ------
    RecordingError
        If its header names another profile.

    """
    profile = reader.get_header().profile
    if profile != PROFILE:
        raise RecordingError(
            path,
            f'it is an MCAP file of profile {profile!r}, not a recording of ROS 2',
            'open it with the program that it was made for',
        )


def _open(path: Path) -> BinaryIO:
    try:
        return readable(path).open('rb')
    except (OSError, ValueError) as error:
        problem = error.strerror if isinstance(error, OSError) else str(error)
        raise RecordingError(
            path, f'it cannot be opened ({problem})', 'check the name and its permissions'
        ) from error


def _check(path: Path, stream: BinaryIO) -> int:
    """Look at both ends of a file; give its size."""
    _check_magic(path, stream.read(len(SQLITE_MAGIC)))
    tail = _tail(stream)
    if len(tail) < _FOOTER.size + len(MAGIC) or not tail.endswith(MAGIC):
        raise RecordingError(
            path, 'its end is missing: the recording was cut off', recover_mend(path)
        )
    _check_summary(path, stream, tail)
    return stream.seek(0, 2)


def _check_magic(path: Path, start: bytes) -> None:
    if start.startswith(MAGIC):
        return
    if start == SQLITE_MAGIC:
        raise RecordingError(path, 'it is a bag of storage sqlite3', convert_mend(path))
    if not start:
        raise RecordingError(path, 'it is not an MCAP file: it is empty', 'name another recording')
    raise RecordingError(path, 'it is not an MCAP file', 'name a recording that ends in .mcap')


def _tail(stream: BinaryIO) -> bytes:
    """Return footer and magic."""
    size_bytes = stream.seek(0, 2)
    stream.seek(max(size_bytes - _FOOTER.size - len(MAGIC), 0))
    return stream.read()


def _check_summary(path: Path, stream: BinaryIO, tail: bytes) -> None:
    """Compare the summary with the checksum that is written behind it."""
    _, _, start, _, crc = _FOOTER.unpack_from(tail)
    if start == 0:
        raise RecordingError(path, 'it has no summary', recover_mend(path))
    stream.seek(start)
    summary = stream.read().removesuffix(tail[-_UNCHECKED_BYTES:])
    if crc not in (0, zlib.crc32(summary)):
        raise _damaged(path, 'the checksum of its summary is wrong')


def _checksum(stream: BinaryIO, size_bytes: int) -> int:
    """Return the checksum of the beginning of a file."""
    stream.seek(0)
    crc = 0
    while size_bytes > 0 and (block := stream.read(min(size_bytes, _BLOCK_BYTES))):
        crc = zlib.crc32(block, crc)
        size_bytes -= len(block)
    return crc


def _damaged(path: Path, problem: str) -> RecordingError:
    return RecordingError(path, f'it is damaged ({problem})', recover_mend(path))
