"""What can still be read of an MCAP file in whatever state, and what cannot."""

import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Message,
    Metadata,
    Schema,
    Statistics,
)

from stickslip_ros.recording.integrity import DAMAGE, MAGIC
from stickslip_ros.recording.records import (
    CRC_BYTES,
    HEAD,
    Bytes,
    Found,
    candidates,
    chunk_times_ns,
    is_cut_message,
    read_record,
    unpack_chunk,
    unpack_cut_chunk,
)
from stickslip_ros.recording.tally import ChannelSummary, Tally

_INNER: Final = (Message, Schema, Channel)
"""Records that also stand inside chunks: in a damaged one they are not to be trusted."""


@dataclass(frozen=True)
class Loss:
    """
    A stretch of a file that cannot be read.

    Parameters
    ----------
    offset, size_bytes : int
        Where it is.
    problem : str
        What is wrong with it.
    first_ns, last_ns : int or None
        Times of the messages that it held, where it still says so.

    """

    offset: int
    size_bytes: int
    problem: str
    first_ns: int | None = None
    last_ns: int | None = None


@dataclass
class Salvage:
    """
    What was found in a file.

    Parameters
    ----------
    data : bytes or mmap
        The file.

    Attributes
    ----------
    chunks : int
        Chunks that are whole.
    compression : str
        Of the first of them.
    unchecked : int
        Messages that no checksum covers.
    is_finished, has_index : bool
        Whether the file says that it ends, and what it holds.

    """

    data: Bytes
    header: Header | None = None
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    metadata: list[Metadata] = field(default_factory=list)
    attachments: list[Attachment] = field(default_factory=list)
    losses: list[Loss] = field(default_factory=list)
    chunks: int = 0
    compression: str = ''
    unchecked: int = 0
    is_finished: bool = False
    has_index: bool = False
    _is_in_index: bool = False
    _groups: list[int] = field(default_factory=list)
    _tallies: dict[int, Tally] = field(default_factory=dict)

    def topics(self) -> list[ChannelSummary]:
        """Say what there is of each topic."""
        return [
            self._tallies.get(key, Tally()).summary(channel.topic, self._type_name(channel))
            for key, channel in sorted(self.channels.items())
        ]

    def strangers(self) -> int:
        """Count the messages that nothing describes."""
        return sum(
            tally.summary('', '').messages
            for key, tally in self._tallies.items()
            if key not in self.channels
        )

    def _type_name(self, channel: Channel) -> str:
        schema = self.schemas.get(channel.schema_id)
        return str(schema.name) if schema else ''

    def groups(self) -> Iterator[list[Message]]:
        """Give the messages chunk by chunk, in the order of the file."""
        for offset in self._groups:
            yield [each for each in self._records(offset) if isinstance(each, Message)]

    def _records(self, offset: int) -> list[McapRecord]:
        """Read again what was found readable."""
        found = read_record(self.data, offset)
        if found is None:
            return unpack_cut_chunk(self.data, offset)
        if isinstance(found.record, Chunk):
            return unpack_chunk(found.record)
        return [found.record]

    def scan(self) -> 'Salvage':
        """Go through the file from its beginning to its end."""
        offset = len(MAGIC)
        while offset < len(self.data) and not self.is_finished:
            found = read_record(self.data, offset)
            if found is None or not self._fits(found):
                offset = self._skip(offset)
            else:
                self._take(found, offset)
                offset = found.end
        return self

    def _take(self, found: Found, offset: int) -> None:
        """Keep a record that stands by itself."""
        record = found.record
        if isinstance(record, Header):
            self.header = self.header or record
        elif isinstance(record, Metadata):
            self.metadata.append(record)
        elif isinstance(record, Attachment):
            self.attachments.append(record)
        elif isinstance(record, Chunk):
            self._take_chunk(record, found, offset)
        elif isinstance(record, Message):
            self._take_inner([record], offset)
            self.unchecked += 1
        else:
            self._take_mark(found)

    def _take_mark(self, found: Found) -> None:
        """Keep what describes messages, and note where data and file end."""
        self._is_in_index |= isinstance(found.record, DataEnd)
        self.has_index |= isinstance(found.record, Statistics | ChunkIndex)
        if isinstance(found.record, Footer):
            self._take_index(found.record, found.end)
            self._end(found.end)
        elif not self._is_in_index:
            self._announce(found.record)

    def _take_chunk(self, chunk: Chunk, found: Found, offset: int) -> None:
        try:
            records = unpack_chunk(chunk)
        except DAMAGE as error:
            self.losses.append(
                Loss(
                    offset,
                    found.end - offset,
                    f'a chunk is damaged ({type(error).__name__} {error})',
                    chunk.message_start_time,
                    chunk.message_end_time,
                )
            )
            return
        self.chunks += 1
        self.compression = self.compression or chunk.compression or 'none'
        messages = self._take_inner(records, offset)
        self.unchecked += 0 if chunk.uncompressed_crc else messages

    def _take_inner(self, records: list[McapRecord], offset: int) -> int:
        """Keep what stood in a chunk; give the number of messages."""
        for record in records:
            self._announce(record)
        messages = [record for record in records if isinstance(record, Message)]
        for message in messages:
            tally = self._tallies.setdefault(message.channel_id, Tally())
            tally.add(message.log_time, message.sequence)
        if messages:
            self._groups.append(offset)
        return len(messages)

    def _announce(self, record: McapRecord) -> None:
        """Keep a description; the first one counts."""
        if isinstance(record, Schema):
            self.schemas.setdefault(record.id, record)
        elif isinstance(record, Channel):
            self.channels.setdefault(record.id, record)

    def _take_index(self, footer: Footer, end: int) -> None:
        """Take descriptions from the index as well, but only if its checksum is right."""
        start, crc = footer.summary_start, footer.summary_crc
        if crc and zlib.crc32(self.data[start : end - CRC_BYTES]) != crc:
            return
        while start and (found := read_record(self.data, start)) and start < end:
            self._announce(found.record)
            start = found.end

    def _end(self, offset: int) -> None:
        """Look at what stands behind the footer: the magic, and then nothing."""
        rest = bytes(self.data[offset:])
        self.is_finished = True
        if rest != MAGIC:
            self.losses.append(Loss(offset, len(rest), 'the end is damaged'))

    def _skip(self, start: int) -> int:
        """Pass over what makes no sense; give where it makes sense again."""
        for offset in candidates(self.data, start + 1):
            found = read_record(self.data, offset)
            if found is not None and self._is_trusted(found):
                self._lose(start, offset, self._problem(start))
                return offset
        self._take_cut(start)
        return len(self.data)

    def _is_trusted(self, found: Found) -> bool:
        """
        Tell whether a record found among damaged bytes is one, and not a part of another.

        A message outside a chunk agrees with almost any bytes: it is taken only in a file without
        chunks, and only if another record follows.

        """
        if not isinstance(found.record, _INNER):
            return True
        if self.chunks or not self._groups or not isinstance(found.record, Message):
            return False
        return self._fits(found) and found.record.channel_id in self.channels

    def _fits(self, found: Found) -> bool:
        """Tell whether a record follows a message outside a chunk: nothing else checks it."""
        if not isinstance(found.record, Message) or found.end == len(self.data):
            return True
        return read_record(self.data, found.end) is not None or is_cut_message(
            self.data, found.end
        )

    def _take_cut(self, start: int) -> None:
        """Take what is whole of a chunk that the end of the file cuts off."""
        records = unpack_cut_chunk(self.data, start)
        saved = self._take_inner(records, start)
        self.unchecked += saved
        if self.data[start] == Opcode.CHUNK and self._is_cut(start):
            problem = 'the last chunk is cut off' + (f', {saved} messages saved' if saved else '')
        elif self._is_in_index or self.data[start] == Opcode.MESSAGE_INDEX:
            problem = 'the index is cut off; it is made anew'
        else:
            problem = 'bytes that are no record, up to the end'
        self._lose(start, len(self.data), problem)

    def _is_cut(self, start: int) -> bool:
        head = self.data[start : start + HEAD.size]
        return len(head) < HEAD.size or start + HEAD.unpack(head)[1] >= len(self.data)

    def _problem(self, start: int) -> str:
        """Say what stands where no record can be read."""
        if self._is_in_index:
            return 'the index is damaged; it is made anew'
        if self.data[start] == Opcode.CHUNK:
            return 'a chunk whose length is wrong'
        return 'bytes that are no record'

    def _lose(self, start: int, end: int, problem: str) -> None:
        times_ns = chunk_times_ns(self.data, start)
        self.losses.append(Loss(start, end - start, problem, *times_ns))
