# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Counts and times of a file are suspect: rows are whole, or the exit status says otherwise."""

import shutil
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import yaml
from mcap.data_stream import RecordBuilder
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    McapRecord,
    Message,
    MessageIndex,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
)
from mcap.stream_reader import StreamReader
from mcap_records import foreign_numbers, rewritten

from stickslip_ros.instrument.commands import Request
from stickslip_ros.lab.cli.main import main
from stickslip_ros.lab.measurements.run_result import SawtoothRun
from stickslip_ros.parameters import Parameters
from stickslip_ros.recording.bag import METADATA_ROOT, write_metadata
from stickslip_ros.recording.chunks import MAGIC
from stickslip_ros.recording.run import ReportingBench, RunWriter

Run = tuple[SawtoothRun, Path]
Lie = Callable[[list[Any]], list[Any]]
CHUNK_BYTES = 9000
YEAR_NS, MS_NS = 31_536_000_000_000_000, 1_000_000


def assembled(source: Path, target: Path, data_lie: Lie = list, summary_lie: Lie = list) -> Path:
    """Write the records of a file anew, without checksums, after lies about them."""
    with source.open('rb') as stream:
        records = list(StreamReader(stream, emit_chunks=True).records)
    end = next(place for place, each in enumerate(records) if isinstance(each, DataEnd))
    content, indexes = MAGIC, list[McapRecord]()
    for each in data_lie(records[:end]):
        written, at = encoded(each), len(content)
        content += written
        match each:
            case Chunk():
                indexes.append(
                    ChunkIndex(
                        chunk_length=len(written),
                        chunk_start_offset=at,
                        compression=each.compression,
                        compressed_size=len(each.data),
                        message_end_time=each.message_end_time,
                        message_index_length=0,
                        message_index_offsets={},
                        message_start_time=each.message_start_time,
                        uncompressed_size=each.uncompressed_size,
                    )
                )
            case MessageIndex():
                last = indexes[-1]
                assert isinstance(last, ChunkIndex)
                last.message_index_length += len(written)
                last.message_index_offsets[each.channel_id] = at
            case Attachment():
                indexes.append(
                    AttachmentIndex(
                        create_time=each.create_time,
                        data_size=len(each.data),
                        length=len(written),
                        log_time=each.log_time,
                        media_type=each.media_type,
                        name=each.name,
                        offset=at,
                    )
                )
            case Metadata():
                indexes.append(MetadataIndex(length=len(written), name=each.name, offset=at))
    described = [each for each in records[end:] if isinstance(each, Schema | Channel | Statistics)]
    summary = b''.join(map(encoded, summary_lie([*described, *indexes])))
    content += encoded(DataEnd(0))
    target.write_bytes(content + summary + encoded(Footer(len(content), 0, 0)) + MAGIC)
    return target


def encoded(record: McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    return bytes(builder.end())


def of_kind(kind: type, change: Callable[[Any], list[Any]], only: int | None = None) -> Lie:
    """Change all records of a kind, or the one at a place among them."""

    def lie(records: list[Any]) -> list[Any]:
        places = [place for place, each in enumerate(records) if isinstance(each, kind)]
        chosen = places if only is None else places[only : only + 1 or None]
        changed = [change(each) if k in chosen else [each] for k, each in enumerate(records)]
        return [each for group in changed for each in group]

    return lie


def index_rows(change: Callable[[list[Any]], list[Any]]) -> Lie:
    """Change the rows of every message index that has several."""

    def lie(index: MessageIndex) -> list[MessageIndex]:
        is_long = len(index.records) > 1
        return [replace(index, records=change(index.records)) if is_long else index]

    return of_kind(MessageIndex, lie)


def chunk(number: int | None, **changed: Any) -> Lie:
    """Change the index of one chunk, or of all."""
    return of_kind(ChunkIndex, lambda each: [replace(each, **changed)], number)


def five_more(said: Statistics) -> dict[str, Any]:
    return {'message_count': said.message_count + 5}


def counted(change: Callable[[Statistics], dict[str, Any]]) -> Lie:
    return of_kind(Statistics, lambda each: [replace(each, **change(each))])


def fewer(said: Statistics) -> dict[str, Any]:
    counts = {key: count - min(count, 1) for key, count in said.channel_message_counts.items()}
    return {'channel_message_counts': counts, 'message_count': sum(counts.values())}


DROPPED = Counter[int]()
"""Rows of each channel that ``without_last`` has left out, and ``not_counted`` forgets."""


def without_last(index: MessageIndex) -> list[MessageIndex]:
    DROPPED[index.channel_id] += 1
    return [replace(index, records=index.records[:-1])]


def not_counted(said: Statistics) -> dict[str, Any]:
    counts = {key: count - DROPPED[key] for key, count in said.channel_message_counts.items()}
    DROPPED.clear()
    return {'channel_message_counts': counts, 'message_count': sum(counts.values())}


HARMLESS: dict[str, Lie] = {
    'all rows lead to the first message': index_rows(
        lambda rows: [(time_ns, rows[0][1]) for time_ns, _ in rows]
    ),
    'a row leads into a message': index_rows(
        lambda rows: [(rows[0][0], rows[0][1] + 1), *rows[1:]]
    ),
}
"""Lies of indexes that count right, but lead elsewhere."""
LIES: dict[str, tuple[Lie, Lie, int, str]] = {
    # lies about the data and about the summary; exit status of a reading verb, and its words
    'a row is left out': (index_rows(lambda rows: rows[:-1]), list, 1, 'statistics count'),
    'the index of a topic is there twice': (
        of_kind(MessageIndex, lambda each: [each, each], 4), list, 1, 'statistics count',
    ),
    'too many are counted': (list, counted(five_more), 1, 'statistics count'),
    'too few are counted': (list, counted(fewer), 1, 'statistics count'),
    'a chunk is listed twice': (
        list, of_kind(ChunkIndex, lambda each: [each, each], 2), 2, 'or inside another chunk',
    ),
    'a chunk is not listed': (list, of_kind(ChunkIndex, lambda _: [], 2), 2, 'chunks'),
    'chunks announce another time': (
        list, chunk(None, message_start_time=0, message_end_time=0), 2, 'announces 0 ns to 0 ns',
    ),
    'a chunk says that it is empty': (list, chunk(2, message_index_offsets={}), 2, 'do not match'),
    'a row is left out and not counted': (
        of_kind(MessageIndex, without_last), counted(not_counted), 1, 'its index lists others',
    ),
}  # fmt: skip


@pytest.fixture(scope='module')
def told(recorded_run: Run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Give a recording of a dozen chunks that does not lie."""
    path = tmp_path_factory.mktemp('counts') / 'told.mcap'
    return rewritten(recorded_run[1], path, chunk_size=CHUNK_BYTES)


@pytest.mark.parametrize('kind', LIES)
def test_a_file_that_lies_about_its_messages_gives_no_shorter_table(told, tmp_path, kind, capsys):
    data_lie, summary_lie, status, words = LIES[kind]
    path, table = tmp_path / 'lies.mcap', tmp_path / 'lies.csv'
    assembled(told, path, data_lie, summary_lie)
    for verb in (
        ('export', str(path), '-o', str(table)),
        ('export', str(path), '-o', str(table), '--readings'),
        ('plot', str(path), '-o', str(tmp_path / 'lies.png')),
        ('compare', str(told), str(path)),
    ):
        assert main(verb) == status, verb
        assert words in capsys.readouterr().err
    assert not table.exists()


@pytest.mark.parametrize('lie', [list, *HARMLESS.values()], ids=['none', *HARMLESS])
def test_an_index_that_leads_elsewhere_changes_no_row(told: Path, tmp_path: Path, lie: Lie):
    path = assembled(told, tmp_path / 'same.mcap', lie)
    assert rows_of_table(path) == rows_of_table(told)


def rows_of_table(path: Path, *words: str) -> list[tuple[str, ...]]:
    table = path.with_suffix('.csv')
    assert main(['export', str(path), '-o', str(table), *words]) == 0
    return [tuple(line.split(',')) for line in table.read_text().splitlines()[1:]]


@pytest.mark.parametrize('kind', [each for each in LIES if 'chunk' not in each])
def test_what_lies_is_recovered_whole_and_counted_anew(told, tmp_path, kind, capsys):
    data_lie, summary_lie, *_ = LIES[kind]
    path = assembled(told, tmp_path / 'lies.mcap', data_lie, summary_lie)
    is_of_statistics = 'counted' in kind
    assert main(['recover', str(path)]) == is_of_statistics
    if is_of_statistics:
        assert 'messages' in capsys.readouterr().out
    assert rows_of_table(tmp_path / 'lies.recovered.mcap') == rows_of_table(told)


@pytest.mark.parametrize('kind', ['a row is left out', 'too few are counted'])
def test_info_and_replay_do_not_repeat_a_wrong_count(told: Path, tmp_path: Path, kind: str):
    data_lie, summary_lie, status, _ = LIES[kind]
    path = str(assembled(told, tmp_path / 'lies.mcap', data_lie, summary_lie))
    assert main(['info', path]) == main(['replay', path]) == status


def moved(*times_ns: int) -> Callable[[list[tuple[str, Message]]], list[tuple[str, Message]]]:
    """Add copies of the last position at other times."""

    def change(rows: list[tuple[str, Message]]) -> list[tuple[str, Message]]:
        topic, last = [row for row in rows if row[0].endswith('/position')][-1]
        more = [
            (topic, replace(last, log_time=each, publish_time=each, sequence=last.sequence + k))
            for k, each in enumerate(times_ns, 1)
        ]
        return [*rows, *more]

    return change


def recorded(path: Path, last_ms: int, origin_ns: int = 0, **changed: Any) -> Path:
    """Record a stand that holds a voltage."""
    names = {f'record.{name}': value for name, value in changed.items()}
    bench = ReportingBench(Parameters().updated(names), time_origin_ns=origin_ns)
    parameters = bench.bench.parameters
    with RunWriter(path, parameters, wait=True, time_origin_ns=origin_ns) as writer:
        bench.record(writer)
        bench.accept(Request('voltage', (10.0,)))
        for number in range(1, last_ms + 1):
            bench.update(number * MS_NS)
    return path


@pytest.fixture(scope='module')
def late(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Give a recording without trace that begins a year after the zero of its clock."""
    path = tmp_path_factory.mktemp('counts') / 'late.mcap'
    return recorded(path, 30, YEAR_NS, trace=False)


@pytest.mark.parametrize(
    'times_ns',
    [
        (2 * YEAR_NS, 3 * YEAR_NS, 3 * YEAR_NS, 290 * YEAR_NS),
        (0, 0, YEAR_NS - 1),
        (0, 9 * YEAR_NS),
    ],
    ids=['ages later', 'twice before the run', 'both'],
)
def test_a_message_of_another_time_is_exported_and_told(
    late: Path, tmp_path: Path, times_ns: tuple[int, ...], capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
):  # fmt: skip
    monkeypatch.setattr('stickslip_ros.lab.measurements.recorded.STRETCH_BYTES', 2 * CHUNK_BYTES)
    path = rewritten(late, tmp_path / 'far.mcap', moved(*times_ns), chunk_size=CHUNK_BYTES)
    expected = rows_of_table(late, '--readings')
    capsys.readouterr()
    rows = rows_of_table(path, '--readings')
    assert 'some times are probably wrong' in capsys.readouterr().out
    assert len(rows) == len(expected) + len(times_ns)
    added_s = sorted((each - YEAR_NS) * 1e-9 for each in times_ns)
    for row in expected:
        rows.remove(row)
    assert [float(row[0]) for row in rows] == pytest.approx(added_s, rel=1e-12)
    for words in (
        ('info', str(path)),
        ('plot', str(path), '-o', str(tmp_path / 'far.png')),
        ('compare', str(late), str(path)),
    ):
        assert main(words) == 0
        shown = ' '.join(capsys.readouterr().out.split())
        assert 'some times are probably wrong' in shown


def test_a_trace_whose_blocks_are_logged_before_their_rows_loses_none_of_them_in_silence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    def early(rows: list[tuple[str, Message]]) -> list[tuple[str, Message]]:
        earlier = {'/trace': 30 * MS_NS}
        moved = [
            (topic, replace(each, log_time=max(each.log_time - earlier.get(topic, 0), 0)))
            for topic, each in rows
        ]
        return sorted(moved, key=lambda row: row[1].log_time)

    monkeypatch.setattr('stickslip_ros.lab.measurements.recorded.STRETCH_BYTES', 2 * CHUNK_BYTES)
    path = recorded(tmp_path / 'run.mcap', 100)
    rewritten(path, tmp_path / 'early.mcap', early, chunk_size=CHUNK_BYTES)
    assert len(rows_of_table(path)) == 5000
    assert main(['export', str(tmp_path / 'early.mcap'), '-o', str(tmp_path / 'early.csv')]) == 1
    assert 'rows of /trace are not at the times of their blocks' in capsys.readouterr().err


def bag_of(folder: Path, *files: Path) -> Path:
    """Make a bag of copies of files, in this order."""
    folder.mkdir()
    parts = [folder / f'run_{number}.mcap' for number in range(len(files))]
    for file, part in zip(files, parts, strict=True):
        shutil.copyfile(file, part)
    write_metadata(folder, parts)
    return folder


def test_parts_of_other_runs_are_refused(told, late, tmp_path, capsys):
    theirs = foreign_numbers(tmp_path / 'theirs.mcap', [(50 * YEAR_NS, 0, 1.5)])
    for number, files in enumerate([(told, late), (late, told), (told, theirs), (theirs, told)]):
        bag = bag_of(tmp_path / f'bag{number}', *files)
        assert main(['export', str(bag), '-o', str(tmp_path / 'bag.csv')]) == 2
        assert 'it is of another run than run_0.mcap' in capsys.readouterr().err


@pytest.mark.parametrize(
    ('listed', 'words'),
    [
        ([0, 1, 1, 2], 'lists run_1.mcap 2 times'),
        ([0, 2], 'it is part 2 in the place of part 1'),
        ([0, 2, 1], 'it is part 2 in the place of part 1'),
    ],
)
def test_parts_that_are_not_listed_once_and_in_order_are_refused(tmp_path, listed, words, capsys):
    path = tmp_path / 'run'
    recorded(path, 50, format='bag', split_duration=0.02, flush_period=0.01)
    assert len(rows_of_table(path, '--readings')) > 40
    description = yaml.safe_load((path / 'metadata.yaml').read_text())
    names = description[METADATA_ROOT]['relative_file_paths']
    description[METADATA_ROOT]['relative_file_paths'] = [names[each] for each in listed]
    (path / 'metadata.yaml').write_text(yaml.safe_dump(description))
    assert main(['export', str(path), '-o', str(tmp_path / 'bag.csv')]) == 2
    assert words in capsys.readouterr().err
