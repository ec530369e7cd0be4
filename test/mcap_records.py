"""What stands in an MCAP file: its records in order, and its messages in order."""

import struct
from collections.abc import Iterator
from pathlib import Path

from mcap.opcode import Opcode
from mcap.reader import make_reader

MAGIC_BYTES = 8
Row = tuple[str, int, int, bytes]


def records_of(content: bytes) -> Iterator[tuple[int, int, Opcode]]:
    """Give where each record of a finished file begins and ends, and of what kind it is."""
    start = MAGIC_BYTES
    while start < len(content) - MAGIC_BYTES:
        opcode, length = struct.unpack_from('<BQ', content, start)
        end = start + 9 + length
        yield start, end, Opcode(opcode)
        start = end


def rows_of(path: Path) -> list[Row]:
    """Give topic, time, sequence number and bytes of each message of a finished file."""
    with path.open('rb') as stream:
        messages = make_reader(stream, validate_crcs=True).iter_messages(log_time_order=False)
        return [
            (channel.topic, each.log_time, each.sequence, each.data)
            for _, channel, each in messages
        ]
