# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A recording beside a disk that stands still: commands are kept, lost readings are named."""

import shutil
from pathlib import Path

from held_disk import HeldDisk
from mcap_records import foreign_numbers, rows_of
from waiting import wait_until

from stickslip_ros.instrument.commands import Request
from stickslip_ros.interface import cdr
from stickslip_ros.interface.channels import Channel, Qos
from stickslip_ros.message_types import FLOAT64, INT32, STRING
from stickslip_ros.parameters import Parameters
from stickslip_ros.recording.gaps import gaps_of
from stickslip_ros.recording.layout import FileForm
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.recorder import Recorder
from stickslip_ros.recording.recover import recover_file
from stickslip_ros.recording.requests import recorded_requests
from stickslip_ros.recording.run import ReportingBench, RunWriter

MS_NS = 1_000_000
VOLTAGE = Channel('/voltage', FLOAT64, Qos(10))
EVENT = Channel('/event', STRING, Qos(10))
QUEUE = 10


def record_beside(disk: HeldDisk, path: Path, readings: int, after: int) -> Recorder:
    """
    Hold the disk at 0 ms, put a reading and an event each ms, then readings when it is back.

    ``killed.mcap`` beside the file is what is left of it if the process is killed at the end.

    """
    form, channels = FileForm(flush_period_s=0.01), [VOLTAGE, EVENT]
    recorder = Recorder(path, channels, queue_length=QUEUE, kept=['/event'], form=form)
    disk.hold()
    recorder.put('/voltage', 0, cdr.pack_float64(0.0))
    disk.wait_for_writer()
    for ms in range(1, readings + 1):
        recorder.put('/voltage', ms * MS_NS, cdr.pack_float64(ms))
        assert recorder.put('/event', ms * MS_NS, cdr.pack_string(str(ms)))
    disk.release()
    for ms in range(readings + 1, readings + 1 + after):
        assert recorder.put('/voltage', ms * MS_NS, cdr.pack_float64(ms), wait=True)
    wait_until(lambda: not recorder.queued and recorder.secured == recorder.written, 'the disk')
    shutil.copy(path, path.with_name('killed.mcap'))
    recorder.close()
    return recorder


def test_kept_messages_are_never_dropped_and_stand_in_the_order_of_their_times(
    tmp_path: Path, held_disk: HeldDisk
):
    recorder = record_beside(held_disk, tmp_path / 'run.mcap', readings=100, after=20)
    rows = rows_of(tmp_path / 'run.mcap')
    events = [row for row in rows if row[0] == '/event']
    assert [sequence for _, _, sequence, _ in events] == list(range(100))
    assert [cdr.unpack(STRING, data) for *_, data in events] == [str(ms) for ms in range(1, 101)]
    times = [at_ns for _, at_ns, _, _ in rows]
    assert times == sorted(times)
    assert recorder.losses == f'{recorder.dropped} dropped: {recorder.dropped} of /voltage'
    assert recorder.dropped == 100 - QUEUE // 2


def test_a_loss_at_the_end_reaches_to_the_end(tmp_path: Path, held_disk: HeldDisk):
    record_beside(held_disk, tmp_path / 'run.mcap', readings=100, after=0)
    [gap] = gaps_of(Recording(tmp_path / 'run.mcap'))
    assert gap == 'lacks 95 messages of /voltage between 0.005 s and 0.1 s'


def test_a_topic_of_which_all_is_lost_lacks_it_from_begin_to_end(tmp_path, held_disk):
    path = tmp_path / 'run.mcap'
    channels = [VOLTAGE, EVENT, Channel('/steps', INT32, Qos(1))]
    recorder = Recorder(path, channels, queue_length=1, kept=['/event'])
    held_disk.hold()
    recorder.put('/event', MS_NS, cdr.pack_string(''))
    held_disk.wait_for_writer()
    recorder.put('/voltage', 2 * MS_NS, cdr.pack_float64(0.0))
    recorder.put('/steps', 3 * MS_NS, cdr.pack_int32(1))
    recorder.put('/event', 4 * MS_NS, cdr.pack_string(''))
    held_disk.release()
    recorder.close()
    assert gaps_of(Recording(path)) == ['lacks 1 messages of /steps between 0.001 s and 0.004 s']


def test_a_gap_is_told_of_the_file_and_by_sequence_numbers_alone_of_a_recovered_one(
    tmp_path: Path, held_disk: HeldDisk
):
    record_beside(held_disk, tmp_path / 'run.mcap', readings=100, after=20)
    told = ['lacks 95 messages of /voltage between 0.005 s and 0.101 s']
    assert gaps_of(Recording(tmp_path / 'run.mcap')) == told
    recover_file(tmp_path / 'killed.mcap', tmp_path / 'recovered.mcap')
    recovered = Recording(tmp_path / 'recovered.mcap')
    assert 'stickslip_recorder' not in recovered.metadata
    assert gaps_of(recovered) == told


def test_numbers_of_another_program_are_a_gap_too_and_a_whole_file_has_none(tmp_path: Path):
    rows = [(0, 3, 0.0), (MS_NS, 4, 0.0), (2 * MS_NS, 7, 0.0)]
    foreign_numbers(tmp_path / 'lossy.mcap', rows)
    foreign_numbers(tmp_path / 'whole.mcap', rows[:2])
    assert gaps_of(Recording(tmp_path / 'lossy.mcap')) == [
        'lacks 2 messages of /u between 0.001 s and 0.002 s'
    ]
    assert gaps_of(Recording(tmp_path / 'whole.mcap')) == []


def test_a_run_keeps_each_command_event_and_status_whatever_it_loses(tmp_path, held_disk):
    parameters = Parameters().updated({'record.queue_length': QUEUE})
    writer = RunWriter(tmp_path / 'run.mcap', parameters)
    run = ReportingBench(parameters)
    held_disk.hold()
    run.record(writer)
    held_disk.wait_for_writer()
    for ms in range(200):
        run.update(run.bench.time_ns + MS_NS, [Request('voltage', (float(ms % 90),))])
    held_disk.release()
    writer.close()
    recording = Recording(tmp_path / 'run.mcap')
    asked = [(each.time_ns, each.request.values) for each in recorded_requests(recording)]
    assert asked == [(ms * MS_NS, (float(ms % 90),)) for ms in range(200)]
    counts = {each.topic: each.messages for each in recording.channels}
    assert counts['/stickslip_drive/event'] == 200
    lossy = {gap.split()[4] for gap in gaps_of(recording)}
    assert lossy == {'/position', '/force', '/voltage', '/trace', '/joint_states'}
