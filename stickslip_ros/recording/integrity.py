"""Whether a file is a whole MCAP container, said in words that tell what to do about it."""

import struct
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO, Final

import zstandard
from mcap.exceptions import McapError
from mcap.reader import McapReader, SeekingReader

from stickslip_ros.errors import RecordingError, StickSlipError

MAGIC: Final = b'\x89MCAP0\r\n'
RECOVER: Final = 'save what is whole with "mcap recover {0} -o recovered.mcap"'

_FOOTER: Final = struct.Struct('<BQQQI')
#: The checksum itself and the magic behind it.
_UNCHECKED_BYTES: Final = 4 + len(MAGIC)
#: What the libraries underneath raise on bytes that make no sense.
_DAMAGE: Final = (
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
        except _DAMAGE as error:
            raise _damaged(path, f'{type(error).__name__} {error}') from error


def _open(path: Path) -> BinaryIO:
    try:
        return path.open('rb')
    except OSError as error:
        raise RecordingError(
            path, f'it cannot be opened ({error.strerror})', 'check the name and its permissions'
        ) from error


def _check(path: Path, stream: BinaryIO) -> int:
    """Look at both ends of a file; give its size."""
    if stream.read(len(MAGIC)) != MAGIC:
        raise RecordingError(path, 'it is not an MCAP file', 'name a recording that ends in .mcap')
    size_bytes = stream.seek(0, 2)
    tail_bytes = _FOOTER.size + len(MAGIC)
    stream.seek(max(size_bytes - tail_bytes, 0))
    tail = stream.read()
    if len(tail) < tail_bytes or not tail.endswith(MAGIC):
        raise RecordingError(
            path, 'its end is missing: the recording was cut off', RECOVER.format(path)
        )
    _check_summary(path, stream, tail)
    return size_bytes


def _check_summary(path: Path, stream: BinaryIO, tail: bytes) -> None:
    """Compare the summary with the checksum that is written behind it."""
    _, _, start, _, crc = _FOOTER.unpack_from(tail)
    if start == 0:
        raise RecordingError(path, 'it has no summary', RECOVER.format(path))
    stream.seek(start)
    summary = stream.read().removesuffix(tail[-_UNCHECKED_BYTES:])
    if crc not in (0, zlib.crc32(summary)):
        raise _damaged(path, 'the checksum of its summary is wrong')


def _damaged(path: Path, problem: str) -> RecordingError:
    return RecordingError(path, f'it is damaged ({problem})', RECOVER.format(path))
