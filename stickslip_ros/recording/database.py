# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A file of rosbag2's storage ``sqlite3``, read block by block as the chunks of an MCAP file."""

import shlex
import sqlite3
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from functools import lru_cache
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote

from mcap.opcode import Opcode
from mcap.records import Channel, ChunkIndex, Header, Schema, Statistics
from mcap.summary import Summary

from stickslip_ros.budget import (
    CHUNK_BYTES,
    DEFINITION_CHARACTERS,
    NAME_CHARACTERS,
    NAMES_MOST,
    OverBudget,
    size_of,
)
from stickslip_ros.errors import RecordingError, quoted
from stickslip_ros.process.stopping import is_stop_requested, stop_if_asked
from stickslip_ros.recording import chunks

DATABASE_MAGIC: Final = b'SQLite format 3\0'
_BLOCK_BYTES: Final = 1 << 22  # of messages that are read at once; a larger message is alone
_HEADS_BYTES: Final = chunks.RECORD_HEAD.size + chunks.MESSAGE_HEAD.size  # of each message
_TABLES: Final = 'topics', 'messages', 'message_definitions'
_STEPS: Final = 10_000  # of SQLite, after which it asks whether to go on
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
        for table in _plain_tables(self._connection):
            [[said]] = self._connection.execute(f'PRAGMA quick_check({table})').fetchmany(1)
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
        if missing := {'topics', 'messages'} - _plain_tables(connection):
            problem = f'it is not a bag of ROS 2: table {min(missing)} is missing'
            raise RecordingError(path, problem, 'name a bag')
        yield DatabaseReader(path, connection)


def _connected(path: Path) -> 'closing[sqlite3.Connection]':
    """Open a database so that none of its SQL is run, and its queries end."""
    uri = f'file:{quote(str(path))}?mode=ro&immutable=1'
    connection = sqlite3.connect(uri, uri=True, check_same_thread=False)
    connection.execute('PRAGMA trusted_schema=OFF')
    connection.execute('PRAGMA ignore_check_constraints=ON')
    calls = iter(range(1000 + size_of(path) // 100))
    connection.set_progress_handler(
        lambda: is_stop_requested() or next(calls, None) is None, _STEPS
    )
    return closing(connection)


def _plain_tables(connection: sqlite3.Connection) -> set[str]:
    """Return those of our tables that are there; refuse those that SQL in the file makes."""
    query = 'SELECT name, type, rootpage FROM sqlite_master WHERE name IN (?, ?, ?)'
    found = set[str]()
    for name, kind, page in connection.execute(query, _TABLES).fetchmany(len(_TABLES) + 1):
        columns = connection.execute(f'PRAGMA table_xinfo({name})').fetchall()
        if kind != 'table' or not page or name in found or any(map(_is_computed, columns)):
            raise OverBudget(f'{name} is a view, or computed, not a plain table', 'name a bag')
        found.add(name)
    return found


def _whole(column: str) -> str:
    """Return the term of a whole number; NULL if it is another value, however long."""
    return f"CASE typeof({column}) WHEN 'integer' THEN {column} END"


def _is_computed(column: Sequence[Any]) -> bool:
    """Return whether a column of `table_xinfo` is generated, or has a long default."""
    *_, default, _, hidden = column
    return bool(hidden) or len(default or '') > NAME_CHARACTERS.most


@lru_cache(maxsize=chunks.SUMMARIES_KEPT)
def _content_of(path: Path, size_bytes: int, _changed_ns: int) -> tuple[Summary, dict[int, int]]:
    """Return topics, blocks and counts, and the channel of each topic's id; do not change them."""
    summary, numbers, counts = Summary(), dict[int, int](), Counter[int]()
    texts: dict[str, str] = {}
    with _connected(path) as connection:
        cut = f'substr({{}}, 1, {NAME_CHARACTERS.most + 1})'.format
        if _TABLES[-1] in _plain_tables(connection):  # not before Iron
            text = f'substr(encoded_message_definition, 1, {DEFINITION_CHARACTERS.most + 1})'
            query = f'SELECT {cut("topic_type")}, {text} FROM {_TABLES[-1]}'
            for kind, text in connection.execute(f"{query} WHERE encoding = 'ros2msg'"):
                texts[kind] = str(text)
                NAMES_MOST.check(len(texts))
        query = f'SELECT {_whole("id")}, {cut("name")}, {cut("type")}'
        query += f', {cut("serialization_format")}'
        rows = connection.execute(f'{query} FROM topics ORDER BY rowid')
        for number, (key, name, kind, encoding) in enumerate(rows, 1):
            if key in numbers or not isinstance(name, str) or not isinstance(kind, str):
                raise ValueError(f'topic {quoted(key)} is {quoted(name)} of type {quoted(kind)}')
            NAMES_MOST.check(number)
            NAME_CHARACTERS.check(max(len(name), len(kind)))
            numbers[key] = number
            definition = str(texts.get(kind, '')).encode()
            summary.schemas[number] = Schema(number, definition, 'ros2msg', kind)
            summary.channels[number] = Channel(number, name, encoding, {}, number)
        blocks, room, held, before = summary.chunk_indexes, 0, 0, -(1 << 63) - 1
        query = f'SELECT rowid, {_whole("topic_id")}, {_whole("timestamp")}, length(data)'
        query += ', typeof(rowid) || typeof(data) FROM messages ORDER BY rowid'
        for row, topic, time_ns, size, kind in connection.execute(query):
            stop_if_asked()
            if topic not in numbers or time_ns is None or kind != 'integerblob':
                raise ValueError(f'message {row} of topic {quoted(topic)} is not a message')
            if time_ns < 0:
                raise ValueError(f'message {row} has the time {time_ns} ns, below 0 ns')
            if (held := held + size) > size_bytes or row <= before:
                raise ValueError(f'message {row} has {size} bytes that belong to others')
            CHUNK_BYTES.check(size)
            before, size = row, size + _HEADS_BYTES  # noqa: PLW2901
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
