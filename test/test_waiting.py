# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Waits of tests end after the last progress, processes with their run, and no limit guesses."""

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import waiting
from processes import finish, is_gone, processor_ticks, progress_of, run_process, start_process
from waiting import GIVE_UP_S, wait_until

TESTS = Path(__file__).parent


class Clock:
    """A clock that goes on by what is slept, and by a second at least."""

    def __init__(self) -> None:
        self.now_s = 0.0

    def __call__(self) -> float:
        return self.now_s

    def pause(self, _: float) -> None:
        self.now_s += 1.0


def test_a_wait_without_progress_is_given_up_and_says_for_what():
    clock = Clock()
    assert wait_until(lambda: 'there', 'it') == 'there'
    with pytest.raises(TimeoutError, match=r'^waited for rain: no progress for 60 s$'):
        wait_until(lambda: False, 'rain', clock=clock, pause=clock.pause)
    assert clock.now_s == GIVE_UP_S + 1.0


def test_each_progress_starts_the_clock_again_and_the_last_is_told():
    clock = Clock()
    drops = lambda: min(int(clock.now_s // 50.0), 7)  # noqa: E731
    with pytest.raises(
        TimeoutError, match=r'^waited for rain: no progress for 60 s; the last .*7$'
    ):
        wait_until(lambda: False, 'rain', progress=drops, clock=clock, pause=clock.pause)
    assert clock.now_s == 7 * 50.0 + GIVE_UP_S + 1.0


WORKS = """
import subprocess, sys
subprocess.run([sys.executable, '-c', '''
print('works', flush=True)
input()
sum(range(3_000_000))
print('has worked', flush=True)
input()
'''])
"""


def test_the_work_of_a_child_of_a_process_is_its_progress():
    with start_process(
        [sys.executable, '-c', WORKS], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as process:
        progress = progress_of(process)
        assert process.stdout.readline() == 'works\n'
        before = progress()
        process.stdin.write('\n')
        process.stdin.flush()
        assert process.stdout.readline() == 'has worked\n'
        assert progress() > before
        assert progress() >= processor_ticks(process.pid)[process.pid] > 0
        process.communicate('\n')


def test_a_process_that_no_longer_works_is_killed_with_what_it_said(monkeypatch):
    monkeypatch.setattr(waiting, 'PROGRESS_S', 0.0)
    monkeypatch.setattr(waiting, 'GIVE_UP_S', 0.5)
    program = "import time; print('here', flush=True); time.sleep(3600)"
    with (
        pytest.raises(TimeoutError, match=r"the last was \d+; it said 'here\\n' and None"),
        start_process([sys.executable, '-c', program], stdout=subprocess.PIPE) as process,
    ):
        finish(process)
    assert process.returncode == -9


def test_a_process_is_run_to_its_end(capfd: pytest.CaptureFixture[str]):
    done = run_process([sys.executable, '-c', 'import sys; print(1); sys.exit("two")'])
    assert (done.returncode, done.stdout, done.stderr) == (1, '1\n', 'two\n')
    with pytest.raises(subprocess.CalledProcessError):
        run_process([sys.executable, '-c', 'import sys; sys.exit("three")'], check=True)
    assert capfd.readouterr().err == 'three\n'


STARTS = f"""
import os, sys
sys.path.insert(0, {str(TESTS)!r})
from processes import start_process
one = start_process(['sleep', '3600'])
print(one.pid, flush=True)
os.kill(os.getpid(), 9)
"""


def test_a_process_ends_with_the_one_that_was_killed():
    done = run_process([sys.executable, '-c', STARTS])
    wait_until(lambda: is_gone(int(done.stdout)), 'the end of the process')


LIMITS = {'timeout', 'timeout_s', 'timeout_seconds'}
WAITS = {'wait', 'join', 'result', 'wait_for', 'communicate', 'create_connection'}
OWN = {
    'waiting.py': 'the limit itself',
    'processes.py': 'looks again and again',
    'contact/test_ageing.py': 'a wait of the contact, in simulated time',
    'runtime/test_pacing.py': 'waits of the pacer',
    'ros/test_lockstep_of_a_node.py': 'tests of a time-out',
    'recording/killed_runs.py': 'the pace of a recording, and when it is killed',
    'ros/test_client.py': 'a test of a time-out',
    'lab/panel/browser.py': 'limits of the browser',
    'lab/panel/test_browser.py': 'limits of the browser',
    'lab/panel/test_browser_without_drive.py': 'limits of the browser',
}
"""Files that may name a time after which a wait ends, and why."""
MODULES = [path for path in sorted(TESTS.rglob('*.py')) if str(path.relative_to(TESTS)) not in OWN]


def limits_of(text: str) -> Iterator[int]:
    """Give the lines of a program in which a wait ends by a number or a constant of its own."""
    for node in ast.walk(ast.parse(text)):
        if not isinstance(node, ast.Call):
            continue
        name = ''
        if isinstance(node.func, ast.Attribute):
            name = node.func.attr
            if name == 'join' and isinstance(node.func.value, ast.Constant):
                continue  # of texts
        given = [each.value for each in node.keywords if each.arg in LIMITS]
        given += node.args[-1:] if name in WAITS or name == 'sleep' else []
        for each in given:
            if isinstance(each, ast.Call):
                continue  # is itself looked at
            numbers = [x.value for x in ast.walk(each) if isinstance(x, ast.Constant)]
            names = [x.id for x in ast.walk(each) if isinstance(x, ast.Name)]
            limits = any(isinstance(x, (int, float)) and x > 0 for x in numbers)
            if 'GIVE_UP_S' not in names and (limits or any(x.isupper() for x in names)):
                yield node.lineno


def test_no_limit_guesses_how_fast_the_machine_is():
    found = {path: [*limits_of(path.read_text(encoding='utf-8'))] for path in MODULES}
    told = [f'{path}:{line}' for path, lines in found.items() for line in lines]
    assert not told, 'use wait_until or run_process'


def test_a_limit_in_seconds_is_found():
    guesses = (
        'run(words, timeout=60)',
        'process.wait(2.5)',
        'thread.join(END_S)',
        'time.sleep(0.1)',
        'spin_until(there, what, timeout_s=2 * WAIT_S)',
    )
    for guess in guesses:
        assert [*limits_of(guess)] == [1], guess
    for each in ('thread.join()', 'event.wait(GIVE_UP_S)', "', '.join(NAMES)", 'time.sleep(0)'):
        assert [*limits_of(each)] == [], each
