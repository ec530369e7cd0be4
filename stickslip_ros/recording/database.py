# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A file of rosbag2's storage ``sqlite3``, read block by block as the chunks of an MCAP file."""

import shlex
import sqlite3
from collections import Counter
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from functools import lru_cache
from pathlib import Path
from typing import Final
from urllib.parse import quote

from mcap.opcode import Opcode
from mcap.records import Channel, ChunkIndex, Header, Schema, Statistics
from mcap.summary import Summary

from stickslip_ros.errors import RecordingError, quoted
from stickslip_ros.process.stopping import stop_if_asked
from stickslip_ros.recording import chunks

DATABASE_MAGIC: Final = b'SQLite format 3\0'
_BLOCK_BYTES: Final = 1 << 22  # of messages that are read at once; a larger message is alone
_TABLES: Final = "SELECT name FROM sqlite_master WHERE type = 'table' AND rootpage > 0"
"""Query of all tables but views, which may have no end."""
_SIDE_FILES: Final = '-wal', '-journal'  # what a recorder has not yet put into the file
_JOIN: Final = 'import sqlite3; sqlite3.connect({!r}).execute("PRAGMA journal_mode=DELETE")'


class DatabaseReader(chunks.ChunkReader):
    """Reads the messages of a database; a row becomes a record with sequence number 0."""

    def __init__(self, path: Path, connection: sqlite3.Connection) -> None:
        self._connection, status = connection, path.stat()
        self._summary, self._numbers = _content_of(path, status.st_size, status.st_mtime_ns)

    def get_header(self) -> Header:
        """Return the head of an MCAP file of ROS 2."""
        return Header('ros2', 'rosbag2')

    def check(self) -> None:
        """Check the pages; all counts are those of the rows."""
        [[said]] = self._connection.execute('PRAGMA quick_check(1)')
        if said != 'ok':
            raise ValueError(' '.join(str(said).split()))

    def _read(self, index: ChunkIndex, wanted: set[int] | None) -> chunks.ChunkMessages:
        data, first = bytearray(), index.chunk_start_offset
        last = -1 if index is chunks.WHOLE_FILE else first + index.chunk_length  # no messages
        query = 'SELECT topic_id, timestamp, data FROM messages WHERE rowid BETWEEN ? AND ?'
        for topic, time_ns, content in self._connection.execute(query, (first, last)):
            number = self._numbers[topic]
            if wanted is None or number in wanted:
                size = chunks.MESSAGE_HEAD.size + len(content)
                data += chunks.RECORD_HEAD.pack(Opcode.MESSAGE, size)
                data += chunks.MESSAGE_HEAD.pack(number, 0, time_ns, time_ns) + content
        return chunks.find_messages(bytes(data))


@contextmanager
def open_database(path: Path) -> Iterator[DatabaseReader]:
    """Open a database, which is never written to; refuse one that its recorder has not closed."""
    path = path.resolve()
    for beside in (path.with_name(path.name + ending) for ending in _SIDE_FILES):
        if beside.exists() and beside.stat().st_size:
            problem = f'its last messages are in {beside.name}: its recorder runs, or was killed'
            command = shlex.quote(_JOIN.format(str(path)))
            raise RecordingError(path, problem, f'end it, then join them: python3 -c {command}')
    with _connected(path) as connection:
        names = {name for (name,) in connection.execute(_TABLES)}
        if missing := {'topics', 'messages'} - names:
            problem = f'it is not a bag of ROS 2: table {min(missing)} is missing'
            raise RecordingError(path, problem, 'name a bag')
        yield DatabaseReader(path, connection)


def _connected(path: Path) -> 'closing[sqlite3.Connection]':
    uri = f'file:{quote(str(path))}?mode=ro&immutable=1'
    return closing(sqlite3.connect(uri, uri=True, check_same_thread=False))


@lru_cache(maxsize=chunks.SUMMARIES_KEPT)
def _content_of(path: Path, *_version: int) -> tuple[Summary, dict[int, int]]:
    """Return topics, blocks and counts, and the channel of each topic's id; do not change them."""
    summary, numbers, counts = Summary(), dict[int, int](), Counter[int]()
    texts: dict[str, str] = {}
    with _connected(path) as connection:
        with suppress(sqlite3.OperationalError):  # before Iron there is no such table
            query = 'SELECT topic_type, encoded_message_definition FROM message_definitions'
            texts = dict(connection.execute(f"{query} WHERE encoding = 'ros2msg'"))
        query = 'SELECT id, name, type, serialization_format FROM topics ORDER BY rowid'
        for number, (key, name, kind, encoding) in enumerate(connection.execute(query), 1):
            if key in numbers or not isinstance(name, str) or not isinstance(kind, str):
                raise ValueError(f'topic {quoted(key)} is {quoted(name)} of type {quoted(kind)}')
            numbers[key] = number
            text = str(texts.get(kind, '')).encode()
            summary.schemas[number] = Schema(number, text, 'ros2msg', kind)
            summary.channels[number] = Channel(number, name, encoding, {}, number)
        blocks, room = summary.chunk_indexes, 0
        kinds = 'typeof(rowid) || typeof(timestamp) || typeof(data)'
        query = f'SELECT rowid, topic_id, timestamp, length(data), {kinds} FROM messages'
        for row, topic, time_ns, size, kind in connection.execute(f'{query} ORDER BY rowid'):
            stop_if_asked()
            if topic not in numbers or kind != 'integerintegerblob':
                raise ValueError(f'message {row} of topic {quoted(topic)} is not a message')
            if time_ns < 0:
                raise ValueError(f'message {row} has the time {time_ns} ns, below 0 ns')
            if room < size or not blocks:
                blocks.append(ChunkIndex(0, row, '', 0, 0, 1, {}, time_ns, 0))
                room = _BLOCK_BYTES
            block, room = blocks[-1], room - size
            block.chunk_length = row - block.chunk_start_offset
            block.message_start_time = min(block.message_start_time, time_ns)
            block.message_end_time = max(block.message_end_time, time_ns)
            block.message_index_offsets[numbers[topic]] = 0
            block.uncompressed_size += size
            counts[numbers[topic]] += 1
    first_ns = min((each.message_start_time for each in blocks), default=0)
    last_ns = max((each.message_end_time for each in blocks), default=0)
    total, topics = counts.total(), len(numbers)
    summary.statistics = Statistics(
        0, topics, dict(counts), len(blocks), total, last_ns, first_ns, 0, topics
    )
    return summary, numbers
