# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Whatever happened to a file: what is whole of it comes back, and what is lost is told."""

import dataclasses
import json
import re
from collections.abc import Callable, Iterator
from functools import cache
from io import BytesIO
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.records import Chunk, Message
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap_records import Row, foreign_notes, records_of, rows_of
from memory import memory_limited_to
from rosbags.highlevel import AnyReader
from rosbags.interfaces import ConnectionExtRosbag2
from rosbags.rosbag2 import Reader

from stickslip_ros.errors import RecordingError
from stickslip_ros.interface.channels import Channel
from stickslip_ros.recording.bag import METADATA_FILE
from stickslip_ros.recording.chunks import MAGIC
from stickslip_ros.recording.layout import FileForm
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.recorder import Recorder
from stickslip_ros.recording.recover import RECOVERY_RECORD, Recovery, recover, recover_file

MS_NS = 1_000_000
COMPRESSIONS = ['zstd', 'lz4', 'none']
PART_NS = 5 * MS_NS
CHUNK_BYTES = 1000
SPLIT = FileForm(chunk_size_bytes=CHUNK_BYTES, in_parts=True)
HOLE_BYTES = 1 << 28
BAG = FileForm(chunk_size_bytes=CHUNK_BYTES, bag=True)


@pytest.fixture(scope='module')
def files(tmp_path_factory, channels, run) -> dict[str, Path]:
    """Give the run of 20 ms in small chunks, by compression."""
    folder = tmp_path_factory.mktemp('whole')
    paths = {name: folder / f'{name}.mcap' for name in COMPRESSIONS}
    for name, path in paths.items():
        with Recorder(
            path,
            channels,
            metadata={'stickslip_run': {'seed': '7'}},
            attachments={'parameters.yaml': ('application/yaml', b'seed: 7\n')},
            form=FileForm(name, chunk_size_bytes=CHUNK_BYTES),
        ) as recorder:
            for each in run:
                recorder.put(*each, wait=True)
    return paths


@pytest.fixture(scope='module', params=COMPRESSIONS)
def whole(request: pytest.FixtureRequest, files: dict[str, Path]) -> Path:
    return files[request.param]


@pytest.fixture(scope='module')
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp('place')


def chunks_of(content: bytes) -> list[tuple[int, int, int]]:
    """Give where each chunk begins and ends, and how many messages it has."""
    reader = StreamReader(BytesIO(content), emit_chunks=True)
    chunks = [each for each in reader.records if isinstance(each, Chunk)]
    counts = [sum(isinstance(each, Message) for each in breakup_chunk(chunk)) for chunk in chunks]
    places = [(start, end) for start, end, kind in records_of(content) if kind == Opcode.CHUNK]
    return [(*place, count) for place, count in zip(places, counts, strict=True)]


def recover_bytes(content: bytes, place: Path) -> tuple[Recovery, list[Row]]:
    """Recover a file of these bytes; the original must not change."""
    source, output = place / 'source.mcap', place / 'output.mcap'
    output.unlink(missing_ok=True)
    source.write_bytes(content)
    recovery = recover_file(source, output)
    assert source.read_bytes() == content
    if recovery.is_whole:
        assert not output.exists()
        return recovery, rows_of(source)
    rows = rows_of(output)
    assert recovery.messages == len(rows)
    return recovery, rows


def cuts_of(content: bytes) -> Iterator[tuple[Opcode, int]]:
    """Give a cut in the middle, one byte before the end, and at the end of every record."""
    for start, end, kind in records_of(content):
        cuts = ((start + end) // 2, end - 1, end)
        yield from ((kind, cut) for cut in cuts if cut < len(content))


def test_a_whole_file_is_left_alone(whole: Path, place: Path):
    recovery, rows = recover_bytes(whole.read_bytes(), place)
    assert recovery.is_whole
    assert (recovery.messages, recovery.lost_bytes, recovery.losses) == (len(rows), 0, [])


def test_a_cut_in_any_record_saves_every_chunk_before_it(whole: Path, place: Path):
    content, expected = whole.read_bytes(), rows_of(whole)
    chunks = chunks_of(content)
    assert len(chunks) > 4
    [(_, header_end, _), *_] = records_of(content)
    seen = set()
    for kind, cut in cuts_of(content):
        if kind == Opcode.HEADER and cut < header_end:
            with pytest.raises(RecordingError, match='it ends before its first record'):
                recover_bytes(content[:cut], place)
            continue
        _, rows = recover_bytes(content[:cut], place)
        seen.add(kind)
        safe = sum(messages for _, end, messages in chunks if end <= cut)
        assert rows[:safe] == expected[:safe]
        assert rows == expected[: len(rows)]
    assert seen >= set(Opcode) - {Opcode.HEADER, Opcode.MESSAGE}


@cache
def contents_of(path: Path) -> tuple[bytes, list[Row], list[Any], list[Any]]:
    """Return the bytes of a whole file, its rows, chunks and records."""
    content = path.read_bytes()
    return content, rows_of(path), chunks_of(content), [*records_of(content)]


@settings(derandomize=True, deadline=None, max_examples=200)
@given(data=st.data())
def test_flipped_bits_lose_their_chunk_and_change_nothing(files: dict, place: Path, data):
    """
    Each row that comes back is one that was put, what was not hit comes back, and a loss is told.

    Where a length or a kind of record was hit, that holds for what stands before it, and where
    the first chunk was hit, and there is no index that describes the topics too, for nothing.

    """
    whole = files[data.draw(st.sampled_from(COMPRESSIONS))]
    undamaged, expected, chunks, records = contents_of(whole)
    content = bytearray(undamaged)
    hits = data.draw(st.lists(st.integers(0, len(content) - 1), min_size=1, max_size=3))
    for hit in hits:
        content[hit] ^= data.draw(st.integers(1, 255))
    if is_unfinished := data.draw(st.booleans(), 'is_unfinished'):
        del content[chunks[-1][1] :]
    try:
        recovery, rows = recover_bytes(bytes(content), place)
    except RecordingError:
        rows = []
    else:
        assert rows == expected or recovery.losses
    heads = [start for start, _, _ in records if any(start <= hit < start + 9 for hit in hits)]
    until = min(heads, default=len(content))
    index_start = next(start for start, _, kind in records if kind == Opcode.DATA_END)
    first_start, first_end, _ = chunks[0]
    if any(first_start <= hit < first_end for hit in hits) and (
        is_unfinished or min(hits) < len(MAGIC) or max(hits) >= index_start
    ):
        until = 0
    done = 0
    for start, end, messages in chunks:
        if end <= until and not any(start <= hit < end for hit in hits):
            assert set(expected[done : done + messages]) <= set(rows)
        done += messages
    assert set(rows) <= set(expected)
    assert rows == sorted(rows, key=expected.index)


def flipped(content: bytes, at: int, bit: int = 0x01) -> bytes:
    return content[:at] + bytes([content[at] ^ bit]) + content[at + 1 :]


def in_chunks(*numbers: int) -> Callable[[bytes], bytes]:
    """Give the damage of a bit near the end of chunks."""

    def damage(content: bytes) -> bytes:
        for _, end, _ in [chunks_of(content)[number] for number in numbers]:
            content = flipped(content, end - 10)
        return content

    return damage


def unfinished(content: bytes, whole: bytes) -> bytes:
    return content[: chunks_of(whole)[-1][1]]


DAMAGES: dict[str, tuple[Callable[[bytes], bytes], set[int] | None, str]] = {
    # what is done to the file, lost chunks (None: from the third one on), the problem
    'in a chunk': (in_chunks(2), {2}, ''),
    'in two chunks': (in_chunks(2, 4), {2, 4}, ''),
    'in the chunk that announces the topics': (in_chunks(0), {0}, ''),
    'in the length of a chunk': (
        lambda each: flipped(each, chunks_of(each)[2][0] + 2, 0x10), None, 'a length',
    ),
    'in the kind of a chunk': (
        lambda each: flipped(each, chunks_of(each)[2][0], 0x08), {2}, 'kind',
    ),
    'in the kind of a message index': (
        lambda each: flipped(each, chunks_of(each)[2][1], 0x08), set(), 'kind',
    ),
    'in a chunk of an unfinished file': (
        lambda each: unfinished(in_chunks(2)(each), each), {2}, '',
    ),
    'in an attachment': (
        lambda each: flipped(each, each.index(b'seed: 7')),
        set(), 'attachment damaged .*checksum',
    ),
    'in metadata': (lambda each: flipped(each, each.index(b'seed\x01'), 0x02), set(), 'metadata'),
    'in the index': (
        lambda each: flipped(each, each.rindex(b'/stand/position') + 8), set(), 'its index',
    ),
    'in the index and in the chunk that announces the topics': (
        lambda each: flipped(in_chunks(0)(each), each.rindex(b'/stand/position') + 8),
        {*range(99)}, 'is not described',
    ),
    'at the end': (lambda each: unfinished(each, each), set(), 'its end is missing'),
}  # fmt: skip


@pytest.mark.parametrize('name', DAMAGES)
def test_damage_loses_what_it_hits_and_says_so(files: dict, place: Path, name: str):
    damage, lost, problem = DAMAGES[name]
    whole = files['zstd']
    chunks, expected = chunks_of(whole.read_bytes()), rows_of(whole)
    recovery, rows = recover_bytes(damage(whole.read_bytes()), place)
    numbers = [number for number, (*_, count) in enumerate(chunks) for _ in range(count)]
    is_lost = [each >= 2 if lost is None else each in lost for each in numbers]
    kept = [row for row, gone in zip(expected, is_lost, strict=True) if not gone]
    assert rows == kept
    assert re.search(problem, ''.join(each.problem for each in recovery.losses))
    assert recovery.counted in {len(expected), None}
    if lost is None:
        first, last = recovery.losses[0], recovery.losses[-1]
        assert first.offset == chunks[2][0]
        assert last.offset + last.size_bytes == recovery.size_bytes
    elif rows:
        for loss, number in zip(recovery.losses, sorted(lost), strict=False):
            start, end, _ = chunks[number]
            assert (loss.offset, loss.size_bytes) == (start, end - start)
    if lost == {2}:
        gaps = {each.topic: each.gaps for each in Recording(place / 'output.mcap').channels}
        topics = [topic for (topic, *_), each in zip(expected, is_lost, strict=True) if each]
        assert gaps['/stand/position'] == topics.count('/stand/position') > 0
    if name == 'in an attachment':
        recording = Recording(place / 'output.mcap')
        assert (recording.attachments, recording.metadata['stickslip_run']) == ({}, {'seed': '7'})


def test_a_recovered_file_is_a_recording_that_says_what_became_of_it(whole: Path, place: Path):
    content = whole.read_bytes()
    cut = chunks_of(content)[2][1]
    recovery, _ = recover_bytes(content[:cut], place)
    recording = Recording(place / 'output.mcap')
    assert recording.metadata['stickslip_run'] == {'seed': '7'}
    assert recording.attachments['parameters.yaml'] == ('application/yaml', b'seed: 7\n')
    record = recording.metadata[RECOVERY_RECORD]
    assert json.loads(record['source']) == 'source.mcap'
    assert json.loads(record['size_bytes']) == cut
    assert json.loads(record['losses']) == [dataclasses.asdict(each) for each in recovery.losses]


def test_a_recovered_file_keeps_topics_and_opens_in_rosbags(whole, place, channels):
    content = whole.read_bytes()
    _, rows = recover_bytes(content[: len(content) // 2], place)
    with AnyReader([place / 'output.mcap']) as reader:
        assert {each.topic: each.msgtype for each in reader.connections} == {
            each.topic: each.type_name for each in channels
        }
        [status] = [each for each in reader.connections if each.topic == '/stand/drive/status']
        assert isinstance(status.ext, ConnectionExtRosbag2)
        assert status.ext.offered_qos_profiles[0].durability.name == 'TRANSIENT_LOCAL'
        assert reader.message_count == len(rows)


def test_a_recovered_file_is_whole(whole: Path, place: Path):
    content = whole.read_bytes()
    recover_bytes(content[: len(content) // 2], place)
    again = (place / 'output.mcap').read_bytes()
    assert recover_bytes(again, place)[0].is_whole


@pytest.mark.parametrize('profile', ['ros2', 'x-camera'])
def test_a_file_of_another_program_without_chunks_is_recovered_too(place: Path, profile: str):
    path = foreign_notes(place / 'foreign.mcap', profile, use_chunking=False)
    content, expected = path.read_bytes(), rows_of(path)
    cut = content.index(b'{"n": 7}')
    _, rows = recover_bytes(content[:cut], place)
    assert rows == expected[:7]
    with (place / 'output.mcap').open('rb') as stream:
        assert make_reader(stream).get_header().profile == profile


def test_chunks_without_checksums_are_recovered(place: Path):
    path = foreign_notes(place / 'foreign.mcap', chunk_size=100, enable_crcs=False)
    content, expected = path.read_bytes(), rows_of(path)
    (_, _, first), *_, (start, end, _) = chunks_of(content)
    _, rows = recover_bytes(content[: (start + end) // 2], place)
    assert len(expected) > len(rows) >= first
    assert rows == expected[: len(rows)]


def test_a_wrong_length_among_messages_without_chunks_changes_none(place: Path):
    """Nothing tells where the next message begins: those behind it are lost, and counted."""
    path = foreign_notes(place / 'foreign.mcap', use_chunking=False)
    content, expected = bytearray(path.read_bytes()), rows_of(path)
    content[content.index(b'{"n": 4}') - 30] ^= 0x40
    recovery, rows = recover_bytes(bytes(content), place)
    assert rows == expected[:4]
    assert recovery.lost_bytes > 0


@pytest.mark.parametrize('is_behind_all', [True, False])
def test_a_file_with_a_hole_much_larger_than_the_memory_is_read(files, tmp_path, is_behind_all):
    """A full disk may leave a hole; mapped into the memory, it can kill whoever reads it."""
    content, expected = files['zstd'].read_bytes(), rows_of(files['zstd'])
    source, output = tmp_path / 'source.mcap', tmp_path / 'output.mcap'
    _, (_, cut, _), (behind, _, _), *_ = chunks_of(content)
    with source.open('wb') as stream:
        stream.write(content[:cut])
        stream.truncate(HOLE_BYTES)
        if not is_behind_all:
            stream.seek(HOLE_BYTES)
            stream.write(content[behind:])
    with memory_limited_to(HOLE_BYTES // 4):
        recovery = recover_file(source, output)
    rows = rows_of(output)
    assert rows == expected[: len(rows)]
    assert 0 < len(rows) < len(expected)
    assert recovery.losses[0].offset == cut
    assert recovery.lost_bytes > HOLE_BYTES - len(content)


@pytest.mark.parametrize(
    ('content', 'refusal'),
    [
        (b'', 'it is empty'),
        (MAGIC, 'it ends before its first record'),
        (b'time,position\n' * 20, 'it is not an MCAP file'),
        (b'SQLite format 3\0' + bytes(84), 'save the readable part with: sqlite3'),
    ],
    ids=['empty', 'magic', 'text', 'sqlite3'],
)
def test_a_file_in_which_nothing_can_be_read_is_refused(tmp_path, content, refusal):
    with pytest.raises(RecordingError, match=refusal):
        recover_bytes(content, tmp_path)
    assert [each.name for each in tmp_path.iterdir()] == ['source.mcap']


def test_nothing_is_overwritten(files: dict, tmp_path: Path):
    source, output = tmp_path / 'source.mcap', tmp_path / 'output.mcap'
    source.write_bytes(files['zstd'].read_bytes()[:-9])
    output.write_bytes(b'precious')
    with pytest.raises(RecordingError, match='exists and is not overwritten; choose another'):
        recover_file(source, output)
    assert output.read_bytes() == b'precious'


def test_a_copy_that_does_not_fit_on_the_disk_is_taken_away(files, tmp_path, small_disk):
    source, output = tmp_path / 'source.mcap', tmp_path / 'output.mcap'
    source.write_bytes(files['none'].read_bytes()[:-9])
    small_disk(1000)
    with pytest.raises(RecordingError, match='File too large'):
        recover_file(source, output)
    assert [*tmp_path.iterdir()] == [source]


@pytest.fixture
def bag(tmp_path, channels, run, record_in_parts) -> Path:
    recorder = record_in_parts(tmp_path / 'run', channels, run, PART_NS, form=BAG)
    assert len(recorder.files) == 4
    return recorder.path


@pytest.fixture
def cut_bag(bag: Path) -> Path:
    """Give a bag whose process was killed: the last part is cut, nothing describes it."""
    (bag / METADATA_FILE).unlink()
    last = bag / 'run_3.mcap'
    last.write_bytes(last.read_bytes()[:-1000])
    return bag


def content_of(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def texts_of(path: Path) -> list[str]:
    return list(map(str, Recording(path).messages()))


def test_a_whole_bag_is_left_alone(bag: Path):
    before = content_of(bag)
    recoveries, written = recover(bag)
    assert written is None
    assert all(each.is_whole for each in recoveries)
    assert content_of(bag) == before


def test_a_bag_whose_description_is_missing_gets_one(bag: Path):
    before = content_of(bag)
    (bag / METADATA_FILE).unlink()
    _, written = recover(bag)
    assert written == bag / METADATA_FILE
    assert content_of(bag) == before


def test_a_bag_that_was_cut_off_is_recovered_beside_itself(cut_bag: Path, recorded: Path):
    before = content_of(cut_bag)
    recoveries, written = recover(cut_bag)
    assert written == cut_bag.with_name('run.recovered')
    assert content_of(cut_bag) == before
    assert [each.is_whole for each in recoveries] == [True, True, True, False]
    expected = texts_of(recorded)
    back = texts_of(written)
    assert expected[: len(back)] == back
    assert len(back) > 0.7 * len(expected)


def test_the_directory_in_which_one_is_may_be_the_bag(cut_bag: Path, monkeypatch):
    monkeypatch.chdir(cut_bag)
    _, written = recover(Path())
    assert written == cut_bag.with_name('run.recovered')


def test_the_recovered_bag_opens_in_rosbags(cut_bag: Path):
    _, written = recover(cut_bag)
    names = [f'run.recovered_{number}.mcap' for number in range(4)]
    described = yaml.safe_load((written / METADATA_FILE).read_text())
    assert described['rosbag2_bagfile_information']['relative_file_paths'] == names
    with Reader(written) as reader:
        assert reader.message_count == sum(1 for _ in reader.messages())


def test_a_part_of_which_nothing_is_left_keeps_its_number(cut_bag: Path):
    (cut_bag / 'run_3.mcap').write_bytes(b'')
    recoveries, written = recover(cut_bag)
    assert [each.messages > 0 for each in recoveries] == [True, True, True, False]
    assert [part.name for part in Recording(written).files][-1] == 'run.recovered_3.mcap'


def test_a_run_in_parts_is_recovered_by_the_name_that_they_share(
    tmp_path: Path,
    channels: list[Channel],
    run: list,
    recorded: Path,
    record_in_parts: Callable[..., Recorder],
):
    path = record_in_parts(tmp_path / 'run.mcap', channels, run, PART_NS, form=SPLIT).path
    part = tmp_path / 'run_1.mcap'
    part.write_bytes(part.read_bytes()[:-1000])
    _, written = recover(path)
    assert written == tmp_path / 'run.recovered.mcap'
    assert set(texts_of(written)) <= set(texts_of(recorded))
    assert len(Recording(written).files) == 4


def test_the_copy_goes_where_it_is_wanted(cut_bag: Path, tmp_path: Path):
    _, written = recover(cut_bag, tmp_path / 'where')
    assert written == tmp_path / 'where'
    assert len(Recording(written).files) == 4


@pytest.mark.parametrize('name', ['missing', 'missing.mcap'])
def test_what_is_not_there_is_refused(tmp_path: Path, name: str):
    with pytest.raises(RecordingError, match='No such file'):
        recover(tmp_path / name)


def test_a_directory_without_a_recording_is_refused(tmp_path: Path):
    with pytest.raises(RecordingError, match='without a recording'):
        recover(tmp_path)


@pytest.mark.parametrize(
    'names',
    [
        ('free.mcap', 'steps.mcap'),
        ('run_7.mcap', 'run_8.mcap'),
        ('run_20261124T170142_123456.mcap', 'run_20261124T170142_123457.mcap'),
    ],
)
def test_a_directory_of_several_recordings_is_no_bag(tmp_path: Path, recorded: Path, names):
    folder = tmp_path / 'runs'
    folder.mkdir()
    for name in names:
        (folder / name).write_bytes(recorded.read_bytes())
    before = content_of(folder)
    for read in (recover, Recording):
        with pytest.raises(RecordingError, match='2 recordings, which are not the parts of one'):
            read(folder)
    assert content_of(folder) == before
