# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A drive that fails, hangs or never ends: it is told, and the process ends all the same."""

import signal
import sys
import threading
from typing import Any

import pytest
from executables import end
from reports import ERROR, OK, Reports

from stickslip_ros.errors import RecordingError, StickSlipError
from stickslip_ros.process.signals import CUT
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.recover import recover

pytestmark = pytest.mark.usefixtures('frequent_diagnostics')

WHY = 'the force on foot 3 is not finite'
MESSAGES = 500
"""What is on the disk when the executor hangs."""
HANGS = """
import sys
import numba, numpy
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.process import signals
from stickslip_ros.runtime import session
from stickslip_ros.ros.node import StickSlipDrive, main

@numba.njit(nogil=True)
def spin(counts):
    while counts[0] >= 0:
        counts[1] += 1

spin(numpy.array([-1, 0]))  # compiled now: a stop would end it later

def hang():
    print('hangs', flush=True)
    spin(numpy.zeros(2, dtype=numpy.int64))

def update_blocks(self, blocks, update_blocks=Bench.update_blocks):
    if self.time_ns >= 300_000_000:
        hang()
    return update_blocks(self, blocks)

def watch(self):
    writer = self._session.worker.writer
    if writer and writer.recorder.secured >= {messages}:
        hang()

if {where!r} == 'drive':
    Bench.update_blocks, session.STOP_TIMEOUT_S = update_blocks, 0.1
else:
    StickSlipDrive._publish_diagnostics, signals.GRACE_S = watch, 0.5
values = 'record.on_start:=true', 'record.flush_period:=0.1', 'record.directory:={folder}'
words = ['drive', '--ros-args', *(word for value in values for word in ('-p', value))]
sys.exit(signals.run('drive', lambda: main(words), is_node=True))
"""
"""The executable, less patient, with a compiled kernel that never ends in one of its threads."""


@pytest.mark.parametrize('error', [StickSlipError, OSError])
@pytest.mark.filterwarnings('ignore::pytest.PytestUnhandledThreadExceptionWarning')
def test_a_failed_drive_is_told_and_its_node_goes_back_to_unconfigured(stand, error, capfd):
    def fail(*_: object) -> None:
        raise error(WHY)

    operator, reports = stand.operator, Reports(stand)
    path = operator.set_recording(wanted=True).message
    operator.spin_for(0.05)
    stand.drive.session.bench.update_blocks = fail
    event = operator.wait_for_event('drive', 0)
    assert (event['number'], event['result'], event['message']) == (0, 'DRIVE_FAILED', WHY)
    part = reports.await_part('drive', lambda part: part.level == ERROR)
    assert part.message == f'stopped: {WHY}'
    operator.spin_until(lambda: stand.operator.state() == 'unconfigured', 'the error transition')
    assert f'the drive has stopped: {WHY}' in capfd.readouterr().err
    recording = Recording(path)
    assert {channel.gaps for channel in recording.channels} == {0}
    counts = {channel.topic: channel.messages for channel in recording.channels}
    assert counts['/stickslip_drive/event'] == 1
    assert stand.operator.change_state('configure')
    assert stand.operator.change_state('activate')
    operator.spin_until(lambda: stand.drive.session.bench.time_ns > 0, 'another tick')


def test_a_block_that_takes_too_long_is_told_while_it_lasts(stand: Any, capfd):
    reports = Reports(stand)
    bench, may_go_on = stand.drive.session.bench, threading.Event()
    update_blocks = bench.update_blocks

    def wait(*arguments: Any) -> Any:
        may_go_on.wait()
        return update_blocks(*arguments)

    bench.update_blocks = wait
    try:
        part = reports.await_part('drive', lambda part: part.level == ERROR)
        told = f'the block at {bench.time_ns * 1e-9:.9g} s has not ended in '
        assert part.message.startswith(told)
        assert told in capfd.readouterr().err
    finally:
        may_go_on.set()
    reports.heard.clear()
    reports.await_part('drive', lambda part: (part.level, part.message) == (OK, 'running'))


@pytest.mark.parametrize('where', ['drive', 'executor'])
def test_a_kernel_that_never_ends_does_not_keep_the_process(start, tmp_path, where):
    program = HANGS.format(where=where, folder=tmp_path, messages=MESSAGES)
    process = start(sys.executable, '-c', program)
    assert process.stdout.readline() == 'hangs\n'
    status, errors = end(process, signal.SIGINT, signal.SIGTERM)
    assert status == CUT
    assert 'drive: ' in errors.splitlines()[-1]
    assert 'stickslip recover' in errors.splitlines()[-1]
    [path] = tmp_path.glob('*.mcap')
    if where == 'executor':
        with pytest.raises(RecordingError, match='stickslip recover'):
            Recording(path)
        _, path = recover(path)
    counts = {channel.topic: channel.messages for channel in Recording(path).channels}
    assert sum(counts.values()) >= (MESSAGES if where == 'executor' else 1)
    assert counts['/position'] > 0
