# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""What was put is soon on the disk, by the clock; no message depends on it."""

import shutil
import time
from collections.abc import Callable
from functools import partial
from itertools import pairwise
from pathlib import Path

import pytest
from mcap.reader import make_reader
from mcap_records import rows_of
from waiting import wait_until

from stickslip_ros.errors import RecordingError
from stickslip_ros.interface import cdr
from stickslip_ros.interface.channels import Channel, Qos
from stickslip_ros.message_types import FLOAT64, UINT32
from stickslip_ros.recording.layout import FileForm
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.recorder import Recorder
from stickslip_ros.recording.recover import recover_file

MS_NS = 1_000_000
VOLTAGE = Channel('/voltage', FLOAT64, Qos(10))
STATUS = Channel('/status', UINT32, Qos(1, latched=True))


def chunks_in(path: Path) -> int:
    with path.open('rb') as stream:
        return len(make_reader(stream).get_summary().chunk_indexes)


def is_secured(recorder: Recorder, count: int) -> bool:
    return recorder.secured == count


def put_all(recorder: Recorder, times_ms: range) -> None:
    for time_ms in times_ms:
        recorder.put('/voltage', time_ms * MS_NS, cdr.pack_float64(time_ms), wait=True)


@pytest.mark.parametrize('compression', ['zstd', 'lz4', 'none'])
def test_what_waits_while_no_more_comes_can_be_recovered(tmp_path: Path, compression: str):
    form = FileForm(compression, flush_period_s=0.05)
    with Recorder(tmp_path / 'run.mcap', [STATUS, VOLTAGE], form=form) as recorder:
        recorder.put('/status', 0, cdr.pack_uint32(3))
        put_all(recorder, range(1, 4))
        wait_until(lambda: recorder.secured == 4, 'the disk')
        copy = tmp_path / 'copy.mcap'
        copy.write_bytes((tmp_path / 'run.mcap').read_bytes())
    recovery = recover_file(copy, tmp_path / 'recovered.mcap')
    assert (recovery.messages, recovery.lost_bytes) == (4, 0)
    recovered = [each for _, _, each in Recording(tmp_path / 'recovered.mcap').messages()]
    assert recovered == [3, 1.0, 2.0, 3.0]


def test_when_the_disk_is_written_to_changes_no_message(tmp_path: Path):
    form = FileForm(flush_period_s=0.05)
    with Recorder(tmp_path / 'hasty.mcap', [VOLTAGE], form=FileForm()) as recorder:
        put_all(recorder, range(100))
    with Recorder(tmp_path / 'halting.mcap', [VOLTAGE], form=form) as recorder:
        for start, end in pairwise(range(0, 101, 10)):
            put_all(recorder, range(start, end))
            wait_until(partial(is_secured, recorder, end), 'the disk')
    assert rows_of(tmp_path / 'halting.mcap') == rows_of(tmp_path / 'hasty.mcap')
    assert chunks_in(tmp_path / 'halting.mcap') > 9


def test_an_idle_recorder_leaves_its_file_alone(tmp_path: Path):
    path = tmp_path / 'run.mcap'
    with Recorder(path, [VOLTAGE], form=FileForm(flush_period_s=0.01)) as recorder:
        put_all(recorder, range(1))
        wait_until(lambda: recorder.secured == 1, 'the disk')
        before = path.stat().st_mtime_ns
        deadline_s = time.monotonic() + 0.1
        while time.monotonic() < deadline_s:
            assert path.stat().st_mtime_ns == before
    assert recorder.secured == recorder.written == 1


def move(path: Path) -> None:
    path.rename(path.with_name('moved.mcap'))


def replace_by_copy(path: Path) -> None:
    copy = path.with_name('copy.mcap')
    shutil.copy(path, copy)
    copy.replace(path)


@pytest.mark.parametrize('harm', [move, replace_by_copy])
@pytest.mark.parametrize('flush_period_s', [0.05, 1000.0], ids=['meanwhile', 'at the end'])
def test_a_file_that_does_not_stay_in_its_place_fails_the_recording(
    tmp_path: Path, harm: Callable[[Path], None], flush_period_s: float
):
    path = tmp_path / 'runs' / 'run.mcap'
    with Recorder(path, [VOLTAGE], form=FileForm(flush_period_s=flush_period_s)) as recorder:
        put_all(recorder, range(10))
        harm(path)
        put_all(recorder, range(10, 20))
        if flush_period_s < 1.0:
            wait_until(lambda: recorder.error is not None, 'the disk')
        else:
            assert recorder.error is None
    assert isinstance(recorder.error, RecordingError)
    assert 'it was deleted, moved or replaced while it was written' in str(recorder.error)


def test_a_part_that_does_not_stay_in_its_place_fails_the_recording(tmp_path: Path):
    form = FileForm(flush_period_s=0.1, in_parts=True)
    with Recorder(tmp_path / 'run.mcap', [VOLTAGE], form=form) as recorder:
        put_all(recorder, range(10))
        wait_until(lambda: recorder.secured > 0, 'the disk')
        move(tmp_path / 'run_0.mcap')
        recorder.begin_part(10 * MS_NS)
        put_all(recorder, range(10, 20))
    assert 'run_0.mcap: it was deleted, moved' in str(recorder.error)
