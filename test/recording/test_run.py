"""One run: what it is asked and what it says is packed once, for a file and for who publishes."""

from pathlib import Path

import pytest

from stickslip_ros.errors import RecordingError
from stickslip_ros.instrument.commands import Request
from stickslip_ros.parameters import Parameters
from stickslip_ros.recording.feed import Packed
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.run import Run, RunWriter

BLOCK_NS = Parameters().block_ns
MOVE, NOTE = Request('sawtooth', (300.0, 1000.0, 2.0)), Request('tare_force')


def stored(path: Path) -> list[tuple[str, int, bytes]]:
    return [(name, each.log_time, each.data) for name, each in Recording(path).records()]


def test_the_same_messages_are_written_and_published_but_for_commands_and_what_is_latched(
    tmp_path: Path,
):
    published: list[Packed] = []
    with RunWriter(tmp_path / 'run.mcap', Parameters(), wait=True) as writer:
        run = Run(Parameters(), published.append, writer)
        run.update(BLOCK_NS, [MOVE, NOTE])
        for block in range(2, 12):
            run.update(block * BLOCK_NS)
    written = stored(tmp_path / 'run.mcap')
    assert [name for name, _, _ in written[:3]] == [
        '/stickslip_drive/info', '/stickslip_drive/status', '/command/sawtooth',
    ]  # fmt: skip
    assert [each[1:] for each in written[3:]] == [(each.time_ns, each.data) for each in published]
    assert published[0].key == 'request'


def test_a_recording_begins_with_the_status_last_published_and_ends_when_it_is_exchanged(
    tmp_path: Path,
):
    run = Run(Parameters())
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


def record_and_delete(path: Path) -> None:
    with RunWriter(path, Parameters(), wait=True) as writer:
        Run(Parameters(), writer=writer).update(BLOCK_NS)
        path.unlink()


def test_a_file_that_was_deleted_is_refused_at_the_end_of_its_context(tmp_path: Path):
    with pytest.raises(RecordingError, match='deleted, moved or replaced'):
        record_and_delete(tmp_path / 'run.mcap')
