# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Read rosbag2's storage ``sqlite3`` in blocks that look like chunks of MCAP."""

import shlex
import sqlite3
from collections import Counter
from collections.abc import Iterator
from contextlib import closing, contextmanager
from functools import lru_cache
from pathlib import Path
from typing import Final
from urllib.parse import quote

from mcap.opcode import Opcode
from mcap.records import Channel, ChunkIndex, Header, Schema, Statistics
from mcap.summary import Summary

from stickslip_ros import budget
from stickslip_ros.errors import RecordingError, quoted
from stickslip_ros.process.stopping import is_stop_requested, stop_if_asked
from stickslip_ros.recording import chunks

DATABASE_MAGIC: Final = b'SQLite format 3\0'
_BLOCK_BYTES: Final = 1 << 22  # messages read at once; a larger message is a block of its own
_HEADS_BYTES: Final = chunks.RECORD_HEAD.size + chunks.MESSAGE_HEAD.size  # of each message
_TABLES: Final = 'topics', 'messages', 'message_definitions'
_ROWS: Final = budget.NAMES_MOST.most + 1  # most rows read of topics and of definitions
_STEPS: Final = 10_000  # SQLite steps between two checks for a stop
_SIDE_FILES: Final = '-wal', '-journal'  # data not yet merged into the database
_JOIN: Final = 'import sqlite3; sqlite3.connect({!r}).execute("PRAGMA journal_mode=DELETE")'


class DatabaseReader(chunks.ChunkReader):
    """Reads the messages of a database; a row becomes a record with sequence number 0."""

    def __init__(self, path: Path, connection: sqlite3.Connection) -> None:
        self._path, self._connection, status = path, connection, path.stat()
        self._summary, self._numbers = _content_of(path, status.st_size, status.st_mtime_ns)

    def get_header(self) -> Header:
        """Return the header of an MCAP file of ROS 2."""
        return Header('ros2', 'rosbag2')

    def check(self) -> None:
        """Check the pages; the counts are counts of rows and need no check."""
        for table in _plain_tables(self._path, self._connection):
            [[result]] = self._connection.execute(f'PRAGMA quick_check({table})').fetchmany(1)
            if result != 'ok':
                raise ValueError(' '.join(str(result).split()))

    def _read(self, index: ChunkIndex, wanted: set[int] | None) -> chunks.ChunkMessages:
        data, first = bytearray(), index.chunk_start_offset
        query = 'SELECT topic_id, timestamp, data FROM messages WHERE rowid BETWEEN ? AND ?'
        for topic, time_ns, content in self._connection.execute(
            query, (first, first + index.chunk_length)
        ):
            number = self._numbers[topic]
            if wanted is None or number in wanted:
                size = chunks.MESSAGE_HEAD.size + len(content)
                data += chunks.RECORD_HEAD.pack(Opcode.MESSAGE, size)
                data += chunks.MESSAGE_HEAD.pack(number, 0, time_ns, time_ns) + content
        return chunks.unpack_messages(chunks.find_messages(bytes(data)))


@contextmanager
def open_database(path: Path) -> Iterator[DatabaseReader]:
    """Open a database read-only; refuse a database that its recorder has not closed."""
    path = path.resolve()
    for file in (path.with_name(path.name + ending) for ending in _SIDE_FILES):
        if file.exists() and file.stat().st_size:
            problem = f'its last messages are in {file.name}: its recorder runs, or was killed'
            command = shlex.quote(_JOIN.format(str(path)))
            raise RecordingError(path, problem, f'end it, then join them: python3 -c {command}')
    with _connected(path) as connection:
        if missing := {'topics', 'messages'} - _plain_tables(path, connection):
            problem = f'it is not a bag of ROS 2: table {min(missing)} is missing'
            raise RecordingError(path, problem, 'name a bag')
        yield DatabaseReader(path, connection)


def _connected(path: Path) -> 'closing[sqlite3.Connection]':
    """Open a database: its own SQL is not run, and the steps of a query are limited."""
    uri = f'file:{quote(str(path))}?mode=ro&immutable=1'
    connection = sqlite3.connect(uri, uri=True, check_same_thread=False)
    connection.executescript('PRAGMA trusted_schema=OFF; PRAGMA ignore_check_constraints=ON')
    # A query of a malformed file may never end: limit its steps by the size of the file.
    left = iter(range(1, 1000 + path.stat().st_size // 100))
    connection.set_progress_handler(lambda: is_stop_requested() or not next(left, 0), _STEPS)
    return closing(connection)


def _plain_tables(path: Path, connection: sqlite3.Connection) -> set[str]:
    """Return which of our tables the file has; refuse views and computed tables."""
    query = 'SELECT name, type, rootpage FROM sqlite_master WHERE name IN (?, ?, ?)'
    found = set[str]()
    for name, kind, page in connection.execute(query, _TABLES).fetchmany(len(_TABLES) + 1):
        computed = [  # each row would repeat a long default
            hidden or len(default or '') > budget.NAME_CHARACTERS.most
            for *_, default, _, hidden in connection.execute(f'PRAGMA table_xinfo({name})')
        ]
        if kind != 'table' or not page or name in found or any(computed):
            problem = f'{name} is a view, or computed, not a plain table'
            raise RecordingError(path, problem, 'name a bag')
        found.add(name)
    return found


def _whole(column: str) -> str:
    """Return SQL for a column's whole numbers; other values, however long, become NULL."""
    return f"CASE typeof({column}) WHEN 'integer' THEN {column} END"


def _take_topics(path: Path, connection: sqlite3.Connection, summary: Summary) -> dict[int, int]:
    """Add topics and definitions to a summary; return the channel of each topic's id."""
    numbers, texts = dict[int, int](), dict[str, str]()
    cut = f'substr({{}}, 1, {budget.NAME_CHARACTERS.most + 1})'.format
    if _TABLES[-1] in _plain_tables(path, connection):  # not before Iron
        most = budget.DEFINITION_MOST.most + 1
        query = f'SELECT {cut("topic_type")}, substr(encoded_message_definition, 1, {most})'
        query += f" FROM {_TABLES[-1]} WHERE encoding = 'ros2msg'"
        texts = dict(connection.execute(query).fetchmany(_ROWS))
        budget.NAMES_MOST.check(len(texts), path)
    query = f'SELECT {_whole("id")}, {cut("name")}, {cut("type")}, '
    query += f'{cut("serialization_format")} FROM topics ORDER BY rowid LIMIT {_ROWS}'
    for number, (key, name, kind, encoding) in enumerate(connection.execute(query), 1):
        if key in numbers or not isinstance(name, str) or not isinstance(kind, str):
            raise ValueError(f'topic {quoted(key)} is {quoted(name)} of type {quoted(kind)}')
        numbers[key] = number
        text = str(texts.get(kind, '')).encode()
        summary.schemas[number] = Schema(number, text, 'ros2msg', kind)
        summary.channels[number] = Channel(number, name, encoding, {}, number)
    chunks.check_names(path, summary)
    return numbers


@lru_cache(maxsize=chunks.SUMMARIES_KEPT)
def _content_of(path: Path, size_bytes: int, _changed_ns: int) -> tuple[Summary, dict[int, int]]:
    """Return summary and channel of each topic id; both are cached: do not change them."""
    summary, counts = Summary(), Counter[int]()
    with _connected(path) as connection:
        numbers = _take_topics(path, connection, summary)
        blocks, room, total_bytes = summary.chunk_indexes, 0, 0
        query = f'SELECT rowid, {_whole("topic_id")}, {_whole("timestamp")}, length(data)'
        query += ', typeof(rowid) || typeof(data) FROM messages ORDER BY rowid'
        for row, topic, time_ns, size, kind in connection.execute(query):
            stop_if_asked()
            if topic not in numbers or time_ns is None or kind != 'integerblob':
                raise ValueError(f'message {row} of topic {quoted(topic)} is not a message')
            if time_ns < 0:
                raise ValueError(f'message {row} has the time {time_ns} ns, below 0 ns')
            if (total_bytes := total_bytes + size) > size_bytes:
                raise ValueError(f'message {row} has {size} bytes that belong to others')
            budget.CHUNK_BYTES.check(size, path)
            size += _HEADS_BYTES  # noqa: PLW2901
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
