# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A drive that fails, hangs or never ends: it is told, and the process ends all the same."""

import signal
import sys
import threading
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from executables import end

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

def update(self, until_ns, requests=(), update=Bench.update):
    if until_ns > 300_000_000:
        hang()
    return update(self, until_ns, requests)

def watch(self):
    writer = self._session.worker.writer
    if writer and writer.recorder.secured >= {messages}:
        hang()

if {where!r} == 'drive':
    Bench.update, session.STOP_TIMEOUT_S = update, 0.1
else:
    StickSlipDrive._publish_diagnostics, signals.GRACE_S = watch, 0.5
values = 'record.on_start:=true', 'record.flush_period:=0.1', 'record.directory:={folder}'
words = ['drive', '--ros-args', *(word for value in values for word in ('-p', value))]
sys.exit(signals.run('drive', lambda: main(words), is_node=True))
"""
"""The executable, less patient, with a compiled kernel that never ends in one of its threads."""


def part_of(stand: Any, heard: list[Any], name: str, level: bytes) -> DiagnosticStatus:
    """Wait for a part of the diagnostics at a level; give it."""

    def found() -> list[DiagnosticStatus]:
        parts = [part for each in heard for part in each.status]
        return [part for part in parts if part.name.endswith(name) and part.level == level]

    stand.operator.spin_until(lambda: bool(found()), f'{name} at level {level!r}')
    return found()[-1]


@pytest.mark.parametrize('error', [StickSlipError, OSError])
@pytest.mark.filterwarnings('ignore::pytest.PytestUnhandledThreadExceptionWarning')
def test_a_failed_drive_is_told_and_its_node_goes_back_to_unconfigured(stand, error):
    def fail(*_: object) -> None:
        raise error(WHY)

    heard = stand.operator.listen('diagnostics')
    logged = stand.operator.listen_to_log()
    operator = stand.operator
    path = operator.set_recording(wanted=True).message
    operator.spin_for(0.05)
    stand.drive.session.bench.update = fail
    event = operator.wait_for_event('drive', 0)
    assert (event['number'], event['result'], event['message']) == (0, 'DRIVE_FAILED', WHY)
    assert part_of(stand, heard, 'drive', DiagnosticStatus.ERROR).message == f'stopped: {WHY}'
    operator.spin_until(lambda: stand.operator.state() == 'unconfigured', 'the error transition')
    operator.spin_until(lambda: f'the drive has stopped: {WHY}' in logged, 'the log')
    recording = Recording(path)
    assert {channel.gaps for channel in recording.channels} == {0}
    counts = {channel.topic: channel.messages for channel in recording.channels}
    assert counts['/stickslip_drive/event'] == 1
    assert stand.operator.change_state('configure')
    assert stand.operator.change_state('activate')
    operator.spin_until(lambda: stand.drive.session.bench.time_ns > 0, 'another tick')


def test_a_block_that_takes_too_long_is_told_while_it_lasts(stand: Any):
    heard = stand.operator.listen('diagnostics')
    logged = stand.operator.listen_to_log()
    bench, may_go_on = stand.drive.session.bench, threading.Event()
    update = bench.update

    def wait(*arguments: Any) -> Any:
        may_go_on.wait()
        return update(*arguments)

    bench.update = wait
    try:
        part = part_of(stand, heard, 'drive', DiagnosticStatus.ERROR)
        at_s = bench.time_ns * 1e-9
        assert part.message.startswith(f'the block at {at_s:.9g} s has not ended in ')
        stand.operator.spin_until(
            lambda: any(f'at {at_s:.9g} s has not ended' in line for line in logged), 'the log'
        )
    finally:
        may_go_on.set()
    heard.clear()
    assert part_of(stand, heard, 'drive', DiagnosticStatus.OK).message == 'running'


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
