# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A recorder never holds up its caller, and what it loses can be proved from the file."""

import sys
from collections.abc import Callable
from pathlib import Path
from threading import Thread
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_records import rows_of
from processes import run_process

from stickslip_ros.errors import RecordingError, UnknownName
from stickslip_ros.interface import cdr
from stickslip_ros.interface.channels import Channel, Qos
from stickslip_ros.message_types import FLOAT64, INT32, STRING
from stickslip_ros.recording.layout import FileForm
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.recorder import Recorder

Run = list[tuple[str, int, bytes]]
VOLTAGE = Channel('/voltage', FLOAT64, Qos(10))
STEPS = Channel('/steps', INT32, Qos(10))
NOISE = np.random.default_rng(1).bytes(1000)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / 'run.mcap'


def sequences(path: Path, topic: str) -> list[int]:
    with path.open('rb') as stream:
        return [message.sequence for _, _, message in make_reader(stream).iter_messages(topic)]


def stored(path: Path) -> Run:
    with path.open('rb') as stream:
        return [
            (channel.topic, message.log_time, message.data)
            for _, channel, message in make_reader(stream).iter_messages(log_time_order=False)
        ]


def test_messages_are_stored_as_they_were_put(path: Path, channels: list[Channel], run: Run):
    with Recorder(path, channels) as recorder:
        taken = [recorder.put(*each) for each in run]
    assert all(taken)
    assert stored(path) == run
    assert (recorder.written, recorder.dropped, recorder.queued) == (len(run), 0, 0)


@pytest.mark.parametrize('compression', ['zstd', 'lz4', 'none'])
def test_messages_do_not_depend_on_the_queue(tmp_path, channels, run, compression):
    files = []
    for queue_length in (2, 3, 10_000):
        path = tmp_path / f'{queue_length}.mcap'
        form = FileForm(compression, chunk_size_bytes=700)
        with Recorder(path, channels, queue_length=queue_length, form=form) as recorder:
            for each in run:
                assert recorder.put(*each, wait=True)
        files.append(rows_of(path))
    assert files[0] == files[1] == files[2]


def test_a_full_queue_drops_and_the_missing_number_proves_it(path: Path, unshared: None):
    with Recorder(path, [VOLTAGE, STEPS], queue_length=4) as recorder:
        taken = [recorder.put('/voltage', 0, cdr.pack_float64(each)) for each in range(7)]
        assert (recorder.queued, recorder.queue_peak, recorder.dropped) == (4, 4, 3)
        assert recorder.put('/steps', 1, cdr.pack_int32(1), wait=True)
        assert recorder.put('/voltage', 1, cdr.pack_float64(7.0), wait=True)
    assert taken == [True] * 4 + [False] * 3
    assert recorder.queue_peak == 4
    assert sequences(path, '/voltage') == [0, 1, 2, 3, 7]
    recording = Recording(path)
    assert {each.topic: each.gaps for each in recording.channels} == {'/voltage': 3, '/steps': 0}


def test_losses_at_the_end_leave_no_gap_so_the_file_says_their_number(path: Path, unshared: None):
    with Recorder(path, [VOLTAGE], queue_length=2) as recorder:
        for _ in range(5):
            recorder.put('/voltage', 0, cdr.pack_float64(1.0))
    closing = Recording(path).metadata['stickslip_recorder']
    assert closing == {'written': '2', 'dropped /voltage': '3'}


@pytest.mark.parametrize('queue_length', [1, 2, 7])
def test_threads_that_wait_for_room_lose_nothing(path: Path, queue_length: int):
    topics = [f'/t{index}' for index in range(4)]
    channels = [Channel(topic, INT32, Qos(1)) for topic in topics]

    def put_all(topic: str) -> None:
        for value in range(200):
            recorder.put(topic, 0, cdr.pack_int32(value), wait=True)

    with Recorder(path, channels, queue_length=queue_length) as recorder:
        threads = [Thread(target=put_all, args=(topic,)) for topic in topics]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert recorder.queue_peak <= queue_length
    for topic in topics:
        values = [cdr.unpack(INT32, data) for name, _, data in stored(path) if name == topic]
        assert values == list(range(200))


def test_time_may_stand_but_not_run_backwards(path: Path):
    with Recorder(path, [VOLTAGE, STEPS]) as recorder:
        recorder.put('/voltage', 5, cdr.pack_float64(1.0))
        recorder.put('/steps', 5, cdr.pack_int32(1))
        with pytest.raises(RecordingError, match='4 ns comes after one of 5 ns'):
            recorder.put('/steps', 4, cdr.pack_int32(2))
    assert sequences(path, '/steps') == [0]


def test_a_topic_that_was_not_announced_is_refused(path: Path):
    with Recorder(path, [VOLTAGE]) as recorder, pytest.raises(UnknownName, match='/voltage'):
        recorder.put('/force', 0, b'')


def test_a_folder_that_cannot_be_made_is_refused(path: Path):
    path.write_bytes(b'a file, not a folder')
    with pytest.raises(RecordingError, match='choose another folder'):
        Recorder(path / 'run.mcap', [VOLTAGE])


@pytest.mark.parametrize(
    ('channels', 'compression', 'refusal'),
    [
        ([Channel('/x', 'std_msgs/msg/Bool', Qos(1))], 'zstd', 'std_msgs/msg/Bool'),
        ([VOLTAGE, VOLTAGE], 'zstd', '/voltage is named twice'),
        ([VOLTAGE], 'zip', "compression 'zip' is not known; take one of zstd, lz4, none"),
    ],
    ids=['type', 'topic', 'compression'],
)
def test_a_wrong_request_makes_no_file(path: Path, channels, compression: str, refusal: str):
    with pytest.raises((RecordingError, UnknownName), match=refusal):
        Recorder(path, channels, form=FileForm(compression))
    assert not path.exists()


def test_a_head_that_cannot_be_written_leaves_no_file(path: Path, small_disk: Callable):
    small_disk(1000)
    with pytest.raises(RecordingError, match='cannot be begun'):
        Recorder(path, [VOLTAGE], attachments={'big': ('text/plain', bytes(2000))})
    assert not path.exists()


def test_a_full_disk_stops_the_writing_and_is_told(path: Path, small_disk: Callable):
    channel = Channel('/event', STRING, Qos(1))
    small_disk(20_000)
    recorder = Recorder(path, [channel], form=FileForm('none', chunk_size_bytes=5000))
    puts = 0
    while recorder.put('/event', 0, NOISE, wait=True):
        puts += 1
    recorder.close()
    assert isinstance(recorder.error, OSError)
    assert not recorder.put('/event', 0, NOISE)
    assert recorder.written + recorder.dropped == puts + 2
    assert recorder.queued == 0


def test_a_disk_that_fills_up_at_the_end_is_told(path: Path, small_disk: Callable):
    recorder = Recorder(path, [VOLTAGE])
    small_disk(path.stat().st_size + 100)
    recorder.put('/voltage', 0, cdr.pack_float64(1.0))
    recorder.close()
    assert isinstance(recorder.error, OSError)
    with pytest.raises(RecordingError, match='stickslip recover'):
        Recording(path)


def test_data_that_cannot_be_written_is_told_and_frees_whoever_waits(path: Path):
    no_bytes: Any = 'not bytes'
    recorder = Recorder(path, [VOLTAGE], queue_length=1)
    recorder.put('/voltage', 0, no_bytes)
    while recorder.put('/voltage', 0, cdr.pack_float64(1.0), wait=True):
        pass
    recorder.close()
    assert isinstance(recorder.error, TypeError)


def test_closing_twice_changes_nothing(path: Path):
    recorder = Recorder(path, [VOLTAGE])
    recorder.close()
    before = path.read_bytes()
    recorder.close()
    assert path.read_bytes() == before


def test_what_comes_after_the_end_is_dropped_and_counted(path: Path):
    recorder = Recorder(path, [VOLTAGE])
    recorder.close()
    assert not recorder.put('/voltage', 0, cdr.pack_float64(1.0))
    assert not recorder.put('/voltage', 0, cdr.pack_float64(1.0), wait=True)
    assert (recorder.written, recorder.dropped) == (0, 2)


def test_a_recorder_that_nobody_closed_is_finished_when_python_ends(path: Path):
    program = f"""
from stickslip_ros.interface.channels import Channel, Qos
from stickslip_ros.recording.layout import FileForm
from stickslip_ros.recording.recorder import Recorder
from stickslip_ros.interface import cdr
recorder = Recorder({str(path)!r}, [Channel('/voltage', 'std_msgs/msg/Float64', Qos(1))])
recorder.put('/voltage', 3, cdr.pack_float64(1.5))
raise SystemExit(7)
"""
    assert run_process([sys.executable, '-c', program]).returncode == 7
    assert list(Recording(path).messages()) == [('/voltage', 3, 1.5)]
