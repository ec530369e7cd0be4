# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Bags of rosbag2's storage sqlite3: as others write them, and as nobody should."""

import re
import shlex
import shutil
import sqlite3
import sys
from collections.abc import Callable, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
import yaml
from processes import run_process
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from stickslip_ros.errors import RecordingError, StickSlipError
from stickslip_ros.interface import cdr
from stickslip_ros.message_types import FLOAT64, POINT_STAMPED
from stickslip_ros.recording import database
from stickslip_ros.recording.any_message import numbers_of
from stickslip_ros.recording.bag import METADATA_FILE
from stickslip_ros.recording.database import open_database
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.recover import recover

STORE = get_typestore(Stores.ROS2_JAZZY)
ROWS = 50
# As rosbag2 of Humble and before makes them, without definitions.
TABLES = """
CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
    serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);
CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL,
    timestamp INTEGER NOT NULL, data BLOB NOT NULL);
"""


def write_bag(folder: Path, plugin: StoragePlugin, first: int = 0, rows: int = ROWS) -> Path:
    """Write points and numbers, not in the order of time, as `ros2 bag record` does."""
    with Writer(folder, version=9, storage_plugin=plugin) as writer:
        point = writer.add_connection('/rig/x', POINT_STAMPED, typestore=STORE)
        number = writer.add_connection('/rig/v', FLOAT64, typestore=STORE)
        for row in range(first, first + rows):
            at_ns = 1000 * (row ^ 3)
            writer.write(point, at_ns, cdr.pack_stamped(at_ns, 'rig', (row, 0, 0)))
            writer.write(number, at_ns + 7, cdr.pack_float64(0.5 * row))
    return folder


def humble(
    path: Path, rows: Sequence[Sequence[Any]], kind: str = FLOAT64, more: Sequence[str] = ()
) -> Path:
    """Write a file of one topic, `/t`, by the schema before Iron."""
    with closing(sqlite3.connect(path)) as connection, connection:
        connection.executescript(TABLES)
        connection.execute("INSERT INTO topics VALUES (5, '/t', ?, 'cdr', '')", (kind,))
        connection.executemany('INSERT INTO messages VALUES (?, ?, ?, ?)', rows)
        for statement in more:
            connection.execute(statement)
    return path


def numbers(count: int = 3) -> list[tuple[int, int, int, bytes]]:
    return [(row + 1, 5, 100 * row, cdr.pack_float64(row + 0.5)) for row in range(count)]


def test_a_bag_of_either_storage_has_the_same_content(tmp_path, monkeypatch):
    monkeypatch.setattr(database, '_BLOCK_BYTES', 300)  # several blocks
    mcap = Recording(write_bag(tmp_path / 'mcap', StoragePlugin.MCAP))
    bag = write_bag(tmp_path / 'sqlite3', StoragePlugin.SQLITE3)
    for path in (bag, *bag.glob('*.db3')):
        recording = Recording(path)
        assert recording.channels == mcap.channels
        assert list(recording.messages()) == list(mcap.messages())
        assert list(recording.messages(['/rig/v'])) == list(mcap.messages(['/rig/v']))
        assert recording.span_s == mcap.span_s
        for topic, field in {'/rig/x': 'point.x', '/rig/v': 'data'}.items():
            found, expected = (numbers_of(each.files, topic, field) for each in (recording, mcap))
            assert [each.tolist() for each in found] == [each.tolist() for each in expected]


def test_a_bag_of_several_parts_is_one_recording(tmp_path: Path):
    bag = write_bag(tmp_path / 'a', StoragePlugin.SQLITE3)
    other = write_bag(tmp_path / 'b', StoragePlugin.SQLITE3, first=ROWS + 2)
    shutil.copy(other / 'b.db3', bag / 'b.db3')
    description = yaml.safe_load((bag / METADATA_FILE).read_text())
    [content] = description.values()
    content['relative_file_paths'] = ['a.db3', 'b.db3']
    (bag / METADATA_FILE).write_text(yaml.safe_dump(description))
    assert [each.messages for each in Recording(bag).channels] == [2 * ROWS] * 2
    assert Recording(bag).series('v').value[-1] == 0.5 * (2 * ROWS)


def test_a_directory_without_description_is_called_that_and_recover_describes_it(tmp_path: Path):
    bag = write_bag(tmp_path / 'a', StoragePlugin.SQLITE3)
    (bag / METADATA_FILE).unlink()
    told = re.escape(
        f'without {METADATA_FILE}, which rosbag2 writes at the end; name a file of it'
    )
    with pytest.raises(RecordingError, match=told):
        Recording(bag)
    assert recover(bag)[1] == bag / METADATA_FILE
    assert (
        yaml.safe_load((bag / METADATA_FILE).read_text())['rosbag2_bagfile_information'][
            'storage_identifier'
        ]
        == 'sqlite3'
    )
    assert [each.messages for each in Recording(bag).channels] == [ROWS] * 2


def test_a_file_without_definitions_is_read_by_the_types_of_this_machine(tmp_path, monkeypatch):
    rows = numbers()
    assert Recording(humble(tmp_path / 'a.db3', rows)).series('t').value.tolist() == [
        0.5,
        1.5,
        2.5,
    ]
    path = humble(tmp_path / 'b.db3', rows, 'my_msgs/msg/Reading')
    told = 'it lacks my_msgs/msg/Reading, which is not installed here; source the ROS 2 workspace'
    with pytest.raises(RecordingError, match=told):
        numbers_of([path], '/t', 'value.data')
    types = tmp_path / 'share/my_msgs/msg'
    types.mkdir(parents=True)
    (types / 'Reading.msg').write_text('# ours\nInner value # nested\nuint8 K=3\n')
    (types / 'Inner.msg').write_text('std_msgs/Float64 data\n')
    monkeypatch.setenv('AMENT_PREFIX_PATH', f'{tmp_path / "none"}:{tmp_path}')
    assert numbers_of([path], '/t', 'value.data.data')[1].tolist() == [0.5, 1.5, 2.5]


def test_nothing_is_written_beside_a_database_or_into_it(tmp_path: Path):
    path = humble(tmp_path / 'a b?#%.db3', numbers(), more=['PRAGMA user_version = 1'])
    with closing(sqlite3.connect(path)) as connection:
        connection.execute('PRAGMA journal_mode=WAL')  # emptied where it is closed
    content = path.read_bytes()
    assert len(list(Recording(path).messages())) == 3
    assert path.read_bytes() == content
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize('mode', ['WAL', 'DELETE'])
def test_what_a_recorder_has_not_yet_put_into_the_file_is_not_left_out(tmp_path: Path, mode: str):
    """Copied while the recorder runs, as after it was killed; the command of the refusal mends."""
    path = humble(tmp_path / 'live.db3', [], more=['PRAGMA user_version = 1'])
    copy = tmp_path / "it's a copy.db3"
    with closing(sqlite3.connect(path, isolation_level=None)) as connection:
        connection.execute(f'PRAGMA journal_mode={mode}')
        connection.execute('PRAGMA cache_size=1')
        connection.execute('BEGIN')
        connection.executemany('INSERT INTO messages VALUES (?, ?, ?, ?)', numbers(2000))
        if mode == 'WAL':
            connection.execute('COMMIT')
        for beside in tmp_path.glob('live.db3*'):
            shutil.copy(beside, copy.with_name(beside.name.replace('live.db3', copy.name)))
    with pytest.raises(
        RecordingError, match='its recorder runs, or was killed; end it'
    ) as refused:
        Recording(copy)
    command = shlex.split(str(refused.value).partition('join them: ')[2])
    run_process([sys.executable, *command[1:]], check=True)
    messages = list(Recording(copy).messages())
    assert len(messages) == (2000 if mode == 'WAL' else 0)


def test_a_large_database_is_read_in_blocks(tmp_path: Path):
    rows = [(at + 1, 5, at, bytes(1 << 20)) for at in range(10)]
    path = humble(tmp_path / 'a.db3', rows, 'x/msg/Blob')
    with open_database(path) as reader:
        sizes = [len(each.data) for each in reader.pieces()]
        small = [each.chunk_length for each in reader.get_summary().chunk_indexes]
    assert len(small) == len(sizes) > 2
    assert max(sizes) <= database._BLOCK_BYTES
    path = humble(tmp_path / 'b.db3', [(at + 1, 5, at, b'') for at in range(300_000)])
    with open_database(path) as reader:  # messages without content take room too
        assert max(len(each.data) for each in reader.pieces()) <= database._BLOCK_BYTES


def replaced(*statements: str) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        humble(path, numbers(), more=statements)

    return write


HOSTILE: dict[str, tuple[Callable[[Path], Any], str]] = {
    'another database': (
        replaced('DROP TABLE topics'), 'of ROS 2: table topics is missing; name a bag',
    ),
    'another table': (
        replaced('ALTER TABLE messages RENAME timestamp TO at'), 'no such column: timestamp',
    ),
    'a view': (
        replaced('DROP TABLE messages', 'CREATE VIEW messages AS WITH RECURSIVE n(k) AS '
                 "(SELECT 1 UNION ALL SELECT k + 1 FROM n) SELECT 5 AS topic_id, "
                 "k AS timestamp, x'00' AS data FROM n"),
        'messages is a view, or computed, not a plain table; name a bag',
    ),
    'a negative time': (
        replaced('UPDATE messages SET timestamp = -5 WHERE id = 2'), 'the time -5 ns, below 0 ns',
    ),
    'a time of text': (
        replaced("UPDATE messages SET timestamp = 'noon'"), 'of topic 5 is not a message',
    ),
    'data of text': (replaced("UPDATE messages SET data = 'x'"), 'message 1 of topic 5 is no'),
    'an unknown topic': (replaced('UPDATE messages SET topic_id = 6'), 'topic 6 is not a message'),
    'a topic twice': (
        replaced('DROP TABLE topics', 'CREATE TABLE topics(id, name, type, serialization_format)',
                 "INSERT INTO topics VALUES (5, '/a', 'b', 'cdr'), (5, '/c', 'd', 'cdr')"),
        "topic 5 is '/c' of type 'd'",
    ),
    'a view of definitions': (
        replaced('CREATE VIEW message_definitions AS SELECT 1'), 'message_definitions is a view',
    ),
    'a virtual table': (
        replaced('DROP TABLE messages', 'CREATE VIRTUAL TABLE messages USING '
                 'fts5(topic_id, timestamp, data)'), 'messages is a view, or computed',
    ),
    'a computed column': (
        replaced('DROP TABLE messages', 'CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id, '
                 'timestamp, data AS (zeroblob(9)))'), 'messages is a view, or computed',
    ),
    'a long default': (
        replaced('DROP TABLE messages', 'CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id, '
                 f"timestamp, data DEFAULT x'{'00' * 9000}')"), 'messages is a view, or computed',
    ),
    'a stray kind of topic': (replaced("UPDATE messages SET topic_id = 'x'"), 'topic None is not'),
    'a name of bytes': (
        replaced("UPDATE topics SET name = x'ff'"), r"topic 5 is b'\\xff' of type",
    ),
    'a name that is no text': (
        replaced("UPDATE topics SET name = CAST(x'ff' AS TEXT)"), 'it is damaged .*sqlite3',
    ),
    'a message without head': (
        replaced("UPDATE messages SET data = x'00'"), 'is too short',
    ),
}  # fmt: skip


@pytest.mark.parametrize('kind', HOSTILE)
def test_a_database_that_is_no_bag_is_refused(tmp_path: Path, kind: str):
    write, told = HOSTILE[kind]
    write(tmp_path / 'a.db3')
    with pytest.raises(StickSlipError, match=told):
        numbers_of(Recording(tmp_path / 'a.db3').files, '/t', 'data')


def test_a_damaged_database_is_refused_with_what_saves_it(tmp_path: Path):
    path = humble(tmp_path / 'a.db3', numbers(2000))
    content = path.read_bytes()
    told = rf'it is damaged \(.*; save the readable part with: sqlite3 {path} .recover'
    for damaged in (
        content[: len(content) // 2],
        content[:100],
        content[:20000] + bytes(4096) + content[24096:],
    ):
        path.write_bytes(damaged)
        with pytest.raises(RecordingError, match=told):
            Recording(path)
        with pytest.raises(RecordingError, match='save the readable part with: sqlite3'):
            recover(path)
