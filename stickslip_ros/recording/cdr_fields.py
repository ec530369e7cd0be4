"""
The fields that CDR messages are made of: text and alignment out, a cursor in.

The layout is that of the OMG's DDS-XTypes 1.3, Section 7.4.1 (plain CDR, version 1), little
endian: a header of four bytes, then each number aligned to its own size, counted from behind the
header.

"""

import struct
from typing import Final

import numpy as np
from numpy.typing import NDArray

from stickslip_ros.errors import WrongKind
from stickslip_ros.units import NS_PER_S

HEADER: Final = b'\x00\x01\x00\x00'
HEADER_SIZE_BYTES: Final = len(HEADER)
#: Some serialisers fill the last word, so a message may be this much longer than its fields.
LONGEST_TAIL_BYTES: Final = 3

_WORD: Final = struct.Struct('<I')
_SIGNED_WORD: Final = struct.Struct('<i')
_STAMP: Final = struct.Struct('<iI')


def text_field(text: str) -> bytes:
    """
    Give a string as CDR does: its length with the closing zero, the text, a zero.

    Raises
    ------
    WrongKind
        If the text has a zero inside: whoever reads it in C would see it cut off there.

    """
    encoded = text.encode()
    if b'\0' in encoded:
        raise WrongKind('text', text, 'free of zero characters', 'remove them')
    return _WORD.pack(len(encoded) + 1) + encoded + b'\0'


def padding(length_bytes: int, alignment_bytes: int) -> bytes:
    """Give the zeros that fill `length_bytes` up to a multiple of the alignment."""
    return bytes(-length_bytes % alignment_bytes)


class Cursor:
    """
    Takes the fields off a message one after the other.

    Parameters
    ----------
    data : bytes
        The message with its header.

    Raises
    ------
    ValueError
        Here if the header is of another encoding; in each method if the bytes end too early.

    """

    def __init__(self, data: bytes) -> None:
        if data[:2] != HEADER[:2] or len(data) < HEADER_SIZE_BYTES:
            raise ValueError(f'they begin with "{data[:4].hex(" ")}", not "{HEADER.hex(" ")}"')
        self._body = memoryview(data)[HEADER_SIZE_BYTES:]
        self._at = 0

    def uint32(self) -> int:
        """Take an unsigned word."""
        return int(_WORD.unpack_from(self._body, self._claim(4, 4))[0])

    def int32(self) -> int:
        """Take a signed word."""
        return int(_SIGNED_WORD.unpack_from(self._body, self._claim(4, 4))[0])

    def stamp_ns(self) -> int:
        """Take a ``builtin_interfaces/msg/Time``, in ns."""
        seconds, nanoseconds = _STAMP.unpack_from(self._body, self._claim(8, 4))
        return int(seconds * NS_PER_S + nanoseconds)

    def text(self) -> str:
        """Take a string; some writers leave out the closing zero of an empty one."""
        size = self.uint32()
        start, end = self._claim(size, 1), self._at
        encoded = bytes(self._body[start:end])
        if encoded[-1:] not in (b'', b'\0'):
            raise ValueError('a text in them has no closing zero')
        return encoded[:-1].decode()

    def float64s(self, count: int) -> tuple[float, ...]:
        """Take `count` numbers."""
        return struct.unpack_from(f'<{count}d', self._body, self._claim(8 * count, 8))

    def float64_sequence(self) -> NDArray[np.float64]:
        """Take a counted sequence of numbers: a copy, aligned and writable."""
        count = self.uint32()
        if not count:
            self._at = min(self._at + -self._at % 8, len(self._body))
            return np.empty(0)
        start = self._claim(8 * count, 8)
        return np.frombuffer(self._body, '<f8', count, start).astype(np.float64)

    def check_end(self) -> None:
        """Refuse bytes behind the last field."""
        left_bytes = len(self._body) - self._at
        if left_bytes > LONGEST_TAIL_BYTES:
            raise ValueError(f'{left_bytes} of them are left over')

    def _claim(self, size_bytes: int, alignment_bytes: int) -> int:
        """Give where a field starts and step behind it."""
        start = self._at + -self._at % alignment_bytes
        missing_bytes = start + size_bytes - len(self._body)
        if missing_bytes > 0:
            raise ValueError(f'at least {missing_bytes} are missing')
        self._at = start + size_bytes
        return start
