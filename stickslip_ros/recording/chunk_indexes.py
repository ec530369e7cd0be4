"""Where the chunks of a file lie, kept out of the memory until the file is finished."""

import tempfile
from collections.abc import Iterator
from contextlib import suppress
from io import BufferedReader
from itertools import islice
from typing import Final

from mcap.data_stream import RecordBuilder
from mcap.records import ChunkIndex
from mcap.stream_reader import StreamReader
from mcap.writer import Writer

LIST_OF_WRITER: Final = '_Writer__chunk_indices'
"""Where a writer of ``mcap`` keeps its indexes. It has no public name; where it is missing, they
stay in the memory: about 0.8 kB a chunk."""


class ChunkIndexes:
    """
    Indexes of chunks, in a temporary file, or in the memory where that takes no more.

    It does what a writer does with its list of them: append, and iterate over all once, in the
    end.

    """

    def __init__(self) -> None:
        self._file = tempfile.TemporaryFile(buffering=0)  # noqa: SIM115 - close()
        self._spilled = 0
        self._kept: list[ChunkIndex] = []

    def append(self, index: ChunkIndex) -> None:
        """Keep one more."""
        builder = RecordBuilder()
        index.write(builder)
        record = builder.end()  # type: ignore[no-untyped-call]
        with suppress(OSError):
            if not self._kept and self._file.write(record) == len(record):
                self._spilled += 1
                return
        self._kept.append(index)

    def __iter__(self) -> Iterator[ChunkIndex]:
        self._file.seek(0)
        with BufferedReader(self._file) as file:
            for record in islice(StreamReader(file, skip_magic=True).records, self._spilled):
                assert isinstance(record, ChunkIndex)
                yield record
        yield from self._kept

    def close(self) -> None:
        """Take the temporary file away."""
        self._file.close()


def spill_indexes(writer: Writer) -> ChunkIndexes | None:
    """Have a writer keep the indexes of its chunks out of the memory; give where, if it can."""
    if hasattr(writer, LIST_OF_WRITER):
        with suppress(OSError):
            indexes = ChunkIndexes()
            setattr(writer, LIST_OF_WRITER, indexes)
            return indexes
    return None
