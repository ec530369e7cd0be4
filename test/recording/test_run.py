# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""One run: what it is asked and what it says is packed once, for a file and for who publishes."""

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

from stickslip_ros.errors import RecordingError
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request
from stickslip_ros.interface.feed import Packed
from stickslip_ros.parameters import Parameters
from stickslip_ros.recording import chunks
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.recorder import Recorder
from stickslip_ros.recording.run import ReportingBench, RunWriter
from stickslip_ros.recording.run_file import CHECKPOINT_FILE, PARAMETERS_FILE, info_json

BLOCK_NS = Parameters().block_ns
MOVE, NOTE = Request('sawtooth', (300.0, 1000.0, 2.0)), Request('tare_force')


def stored(path: Path) -> list[tuple[str, int, bytes]]:
    return [(name, each.log_time, each.data) for name, each in Recording(path).records()]


def test_the_same_messages_are_written_and_published_but_for_commands_and_what_is_latched(
    tmp_path: Path,
):
    published: list[Packed] = []
    with RunWriter(tmp_path / 'run.mcap', Parameters(), wait=True) as writer:
        run = ReportingBench(Parameters(), published.append, writer)
        run.update(BLOCK_NS, [MOVE, NOTE])
        for block in range(2, 12):
            run.update(block * BLOCK_NS)
    written = stored(tmp_path / 'run.mcap')
    assert [name for name, _, _ in written[:3]] == [
        '/stickslip_drive/info', '/stickslip_drive/status', '/command/sawtooth',
    ]  # fmt: skip
    assert [each[1:] for each in written[3:]] == [(each.time_ns, each.data) for each in published]
    assert published[0].key == 'request'


def test_a_recording_begins_with_the_status_last_published_and_ends_when_it_is_exchanged(tmp_path):
    run = ReportingBench(Parameters())
    run.update(BLOCK_NS, [MOVE])
    with RunWriter(tmp_path / 'run.mcap', Parameters(), wait=True) as writer:
        assert run.record(writer) is None
        run.update(2 * BLOCK_NS)
        assert run.record(None) is writer
        run.update(3 * BLOCK_NS, [MOVE])
    times = {at_ns for _, at_ns, _ in stored(tmp_path / 'run.mcap')}
    assert times == {BLOCK_NS, 2 * BLOCK_NS}
    ((_, _, status),) = Recording(tmp_path / 'run.mcap').messages(['/stickslip_drive/status'])
    assert status == run.status


def record_blocks(path: Path, values: Mapping[str, object], blocks: int) -> list[Path]:
    """Record a saw-tooth; return the files."""
    parameters = Parameters().updated(values)
    with RunWriter(path, parameters, wait=True) as writer:
        run = ReportingBench(parameters, writer=writer)
        run.accept(MOVE)
        for block in range(1, blocks + 1):
            run.update(block * BLOCK_NS)
    return writer.recorder.files


def test_of_a_run_that_fills_the_disk_the_file_is_named(tmp_path: Path, small_disk: Callable):
    small_disk(100_000)
    with pytest.raises(RecordingError, match=r'run\.mcap: cannot be written further .* make room'):
        record_blocks(tmp_path / 'run.mcap', {'record.compression': 'none'}, 10_000)


def test_a_part_ends_after_its_time(tmp_path: Path):
    values = {'record.split_duration': 0.02, 'record.flush_period': 0.02}
    files = record_blocks(tmp_path / 'run.mcap', values, 60)
    times = [Recording(file).series('position').time_s for file in files]
    assert [(round(each[0], 9), round(each[-1], 9)) for each in times] == [
        (0.001, 0.02), (0.021, 0.04), (0.041, 0.06),
    ]  # fmt: skip


def test_a_part_ends_with_the_block_that_brings_its_messages_to_their_size(tmp_path: Path):
    values = {'record.split_size': 50_000, 'record.chunk_size': 10_000}
    *full, _ = record_blocks(tmp_path / 'run.mcap', values, 100)
    assert len(full) > 2
    for file in full:
        messages = [
            each
            for name, each in Recording(file).records()
            if not name.endswith(('info', 'status'))
        ]
        last_ns = messages[-1].log_time
        before_bytes = sum(len(each.data) for each in messages if each.log_time < last_ns)
        assert before_bytes < 50_000 <= sum(len(each.data) for each in messages) + 100


def test_without_the_trace_a_file_holds_all_else_and_the_topic_goes_on(tmp_path: Path):
    full, less = (
        record_blocks(tmp_path / f'{name}.mcap', {'record.trace': name == 'full'}, 100)[0]
        for name in ('full', 'less')
    )
    told = '/stickslip_drive/info'  # has the parameters
    others = [each for each in stored(full) if each[0] not in {'/trace', told}]
    assert [each for each in stored(less) if each[0] != told] == others
    assert '/trace' not in Recording(less).types
    published: list[Packed] = []
    stand = Parameters().updated({'record.trace': False})
    run = ReportingBench(stand, published.append)
    for block in range(1, stand.trace_period_ns // BLOCK_NS + 1):
        run.update(block * BLOCK_NS)
    assert 'trace' in {each.key for each in published}


def test_every_part_carries_the_state_with_which_it_begins(tmp_path: Path):
    values = {'record.split_duration': 0.02, 'record.flush_period': 0.02}
    first, *others = record_blocks(tmp_path / 'run.mcap', values, 60)
    assert CHECKPOINT_FILE not in Recording(first).attachments
    assert CHECKPOINT_FILE not in Recording(tmp_path / 'run.mcap').attachments
    states = [Bench.restore(Recording(each).attachments[CHECKPOINT_FILE][1]) for each in others]
    assert [state.time_ns for state in states] == [20 * BLOCK_NS, 40 * BLOCK_NS]


def test_no_part_begins_while_the_queue_is_full(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    values = {'record.split_duration': 0.02, 'record.flush_period': 0.02}
    parameters = Parameters().updated({**values, 'record.queue_length': 10})
    saved: list[int] = []

    def save() -> bytes:
        saved.append(run.bench.time_ns)
        return b''

    with RunWriter(tmp_path / 'run.mcap', parameters) as writer:
        run = ReportingBench(parameters, writer=writer)
        monkeypatch.setattr(run, 'save', save)
        monkeypatch.setattr(Recorder, 'queued', 10)
        for block in range(1, 31):
            run.update(block * BLOCK_NS)
        assert saved == []
        monkeypatch.setattr(Recorder, 'queued', 9)
        run.update(31 * BLOCK_NS)
        run.update(32 * BLOCK_NS)
    assert saved == [30 * BLOCK_NS]


@pytest.fixture(scope='module')
def in_parts(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    """Record 0.1 s in parts of many chunks."""
    path = tmp_path_factory.mktemp('parts') / 'run.mcap'
    record_blocks(path, {'record.split_size': 50_000, 'record.chunk_size': 5_000}, 100)
    return Recording(path)


@pytest.mark.parametrize(
    'window_s', [(0.0, 0.02), (0.0137, 0.0711), (0.05, 0.05), (0.09, 7.0), (3.0, 4.0)]
)
def test_a_stretch_has_what_the_whole_has_there(in_parts, window_s):
    part, trace = in_parts.within(*window_s), in_parts.trace()
    pairs = [(part.series('position'), in_parts.series('position'))]
    pairs += [(each, trace[name]) for name, each in part.trace().items()]
    for found, whole in pairs:
        expected = whole.window(*window_s)
        assert found.time_s.tolist() == expected.time_s.tolist()
        assert found.value.tolist() == expected.value.tolist()
    assert part.trace().keys() in (set(), trace.keys())


def test_of_a_stretch_no_more_chunks_are_opened_than_it_takes(in_parts, monkeypatch):
    opened, unpack = [], chunks.unpack_chunk

    def noted(chunk: Any) -> bytes:
        opened.append(chunk)
        return unpack(chunk)

    monkeypatch.setattr(chunks, 'unpack_chunk', noted)
    in_parts.series('position')
    every = len(opened)
    opened.clear()
    in_parts.within(0.05, 0.051).series('position')
    assert 1 <= len(opened) <= 3 < every


def test_a_recording_tells_from_when_to_when_it_goes(in_parts: Recording, tmp_path: Path):
    assert in_parts.span_s == (0.0, 0.1)
    RunWriter(tmp_path / 'empty.mcap', Parameters()).close()
    assert all(math.isnan(each) for each in Recording(tmp_path / 'empty.mcap').span_s)


def test_stands_that_differ_in_the_sign_of_a_zero_have_texts_of_their_own(tmp_path: Path):
    stands = [Parameters().updated({'limits.soft_min': zero}) for zero in (0.0, -0.0)]
    assert stands[0] == stands[1]
    for stand, zero in zip(stands, ('0.0', '-0.0'), strict=True):
        assert f'"limits.soft_min": {zero},' in info_json(stand, 0)
        path = tmp_path / f'run{zero}.mcap'
        RunWriter(path, stand).close()
        assert f'soft_min: {zero}\n' in Recording(path).attachments[PARAMETERS_FILE][1].decode()
