# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A process ends once and in order, whatever signals arrive, and with the one that started it."""

import subprocess
import sys
from pathlib import Path

import pytest
from processes import finish, run_process, start_process

START = """
import os, signal, sys, threading
from stickslip_ros.process import signals, stopping

def send(number):
    os.kill(os.getpid(), number)

def await_stop():
    stopping._stop.wait()

def work():
    {work}

sys.exit(signals.run('it', work, is_node={is_node}))
"""


def run_work(
    *work: str, is_node: bool = False, words: tuple[str, ...] = ()
) -> subprocess.CompletedProcess[str]:
    """Run a process that does these lines of work."""
    lines = '\n    '.join(work)
    program = START.format(work=lines, is_node=is_node)
    return run_process([*words, sys.executable, '-c', program])


@pytest.mark.parametrize(('is_node', 'status'), [(True, 0), (False, 130)])
def test_a_signal_before_there_is_anything_to_close_ends_at_once(is_node: bool, status: int):
    process = run_work('send(signal.SIGHUP)', 'threading.Event().wait()', is_node=is_node)
    assert process.returncode == status
    assert process.stderr == 'it: ended by SIGHUP before it had started\n'


def test_signals_that_come_together_ask_for_the_end_once():
    burst = 'for _ in range(70_000): send(signal.SIGINT); send(signal.SIGTERM)'
    process = run_work('signals.begin()', burst, 'await_stop()', 'return 7')
    assert (process.returncode, process.stderr) == (7, '')


def test_a_signal_that_the_system_gives_to_another_thread_is_heeded():
    there = 'signal.pthread_kill(threading.get_ident(), signal.SIGINT)'
    process = run_work('signals.begin()', there, 'await_stop()', 'return 7')
    assert (process.returncode, process.stderr) == (7, '')


def test_under_nohup_a_closed_terminal_ends_nothing():
    lines = ('send(signal.SIGHUP)', 'send(signal.SIGTERM)', 'threading.Event().wait()')
    process = run_work(*lines, words=('nohup',))
    assert process.stderr.splitlines()[-1] == 'it: ended by SIGTERM before it had started'


@pytest.mark.parametrize(
    ('is_node', 'limit', 'status', 'line'),
    [
        (True, 'GRACE_S', 3, 'not closed within 0.1 s; `stickslip recover` repairs a recording'),
        (
            False,
            'VERB_GRACE_S',
            130,
            'stopped during its work: the file being written is incomplete',
        ),
    ],
)
def test_work_that_heeds_nothing_is_cut_off(is_node: bool, limit: str, status: int, line: str):
    lines = (f'signals.{limit} = 0.1', 'signals.begin()', 'send(signal.SIGINT)')
    process = run_work(*lines, 'while True: pass', is_node=is_node)
    assert process.returncode == status
    assert process.stderr.startswith(f'it: {line}')


def test_work_that_was_done_gives_its_own_status():
    assert run_work('return 1').returncode == 1


def test_what_work_raises_is_told_and_gives_status_1():
    process = run_work('raise ZeroDivisionError')
    assert process.returncode == 1
    assert process.stderr.splitlines()[-1] == 'ZeroDivisionError'


@pytest.mark.parametrize(
    ('error', 'last_lines'),
    [
        ('OSError("Signal 1 ignored due to race condition")', []),
        ('OSError("disk")', ['OSError: disk']),
    ],
)
def test_that_the_interpreter_ignores_a_signal_as_well_is_no_news(error, last_lines):
    class_of = (
        f'Last = type("Last", (), {{"__del__": lambda self: (_ for _ in ()).throw({error})}})'
    )
    lines = (class_of, 'signals.begin()', 'send(signal.SIGINT)', 'await_stop()', 'Last()')
    process = run_work(*lines, 'return 7')
    assert process.returncode == 7
    assert process.stderr.splitlines()[-1:] == last_lines


DEMO = """
import sys
from pathlib import Path
from stickslip_ros.lab.cli import demo
sys.executable = sys.argv[1]
with demo._drive_process(Path('settings.yaml'), 1) as drive:
    drive.wait()
"""


def test_the_drive_of_a_killed_demo_ends(tmp_path: Path):
    drive = tmp_path / 'drive'
    drive.write_text('#!/bin/sh\necho started\nexec sleep 300\n')
    drive.chmod(0o700)
    demo = start_process([sys.executable, '-c', DEMO, drive], stdout=subprocess.PIPE)
    assert demo.stdout is not None
    assert demo.stdout.readline() == 'started\n'
    demo.kill()
    assert finish(demo)[0] == ''  # its end comes when the drive is gone too
