# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Plugins of the test run: a second try of what failed, and a budget of processor seconds."""

import os
import re
import sys
from pathlib import Path

import pytest
import second_try
from processes import run_process

ONCE = """
from pathlib import Path
import pytest

def once(name):
    mark = Path(__file__).with_name(name)
    was_here = mark.exists()
    mark.touch()
    assert was_here, 'fails once'

def test_that_passes():
    pass

@pytest.mark.parametrize('name', ['a::b', 'c d'])
def test_that_fails_once(name):
    once(name.replace(':', ''))

@pytest.fixture
def broken_once():
    yield
    once('teardown')

def test_whose_end_fails_once(broken_once):
    pass
"""
ALWAYS = """
def test_that_fails_always():
    assert 'first' == 'second'
"""
SKIPS = """
import pytest
from pathlib import Path

def test_that_is_skipped_then():
    mark = Path(__file__).with_name('skips')
    if mark.exists():
        pytest.skip('is there')
    mark.touch()
    assert False
"""
CRASHES = """
import os

def test_that_ends_its_process():
    os._exit(1)
"""


def run_tests(folder: Path, *words: str, **files: str) -> tuple[int, list[str]]:
    """Run the tests of some files; return the exit status and the lines that were printed."""
    for name, text in files.items():
        (folder / f'test_{name}.py').write_text(text)
    (folder / 'pytest.ini').write_text('[pytest]\naddopts = -q -ra\n')
    command = [sys.executable, '-m', 'pytest', '-p', 'second_try', '--second-try', *words]
    own = {'PYTHONPATH': str(Path(__file__).parent), 'PYTEST_DISABLE_PLUGIN_AUTOLOAD': '1'}
    done = run_process(command, cwd=folder, env={**os.environ, **own})
    return done.returncode, done.stdout.splitlines()


XDIST = ('-p', 'xdist', '-n', '1', '--dist', 'loadfile')


def test_what_passes_then_is_named_before_the_closing_line_of_a_green_run(tmp_path: Path):
    status, lines = run_tests(tmp_path, *XDIST, once=ONCE)
    assert status == 0
    assert lines[-1].startswith('4 passed in ')
    assert sum(line.startswith('E ') and 'fails once' in line for line in lines) == 3
    assert sorted(lines[-4:-1]) == [
        'FLAKY: test_once.py::test_that_fails_once[a::b]',
        'FLAKY: test_once.py::test_that_fails_once[c d]',
        'FLAKY: test_once.py::test_whose_end_fails_once',
    ]


def test_what_fails_again_is_red_with_both_reports(tmp_path: Path):
    status, lines = run_tests(tmp_path, once=ONCE, always=ALWAYS)
    assert status == 1
    assert lines[-1].startswith('1 failed, 4 passed in ')
    assert sum(line.startswith('FLAKY: ') for line in lines) == 3
    assert sum("assert 'first' == 'second'" in line for line in lines if line[0:1] == '>') == 2


def test_what_is_skipped_then_has_not_passed(tmp_path: Path):
    status, lines = run_tests(tmp_path, skips=SKIPS)
    assert status == 1
    assert lines[-1].startswith('1 failed in ')


def test_a_file_that_cannot_be_read_and_a_worker_that_crashed_are_not_excused(tmp_path: Path):
    status, lines = run_tests(tmp_path, once=ONCE, broken='import nothing_that_is_there')
    assert status == 2
    assert '1 error' in lines[-1]
    (tmp_path / 'test_broken.py').unlink()
    words = (*XDIST, '--max-worker-restart=0')
    status, lines = run_tests(tmp_path, *words, crashes=CRASHES)
    assert status != 0
    assert not [line for line in lines if line.startswith('FLAKY: ')]


def test_many_failures_are_not_tried_again(tmp_path: Path):
    count = second_try.TRIED_MAX + 1
    many = f"""
import pytest
from pathlib import Path

@pytest.mark.parametrize('number', range({count}))
def test_that_fails_once(number):
    mark = Path(__file__).with_name(str(number))
    was_here = mark.exists()
    mark.touch()
    assert was_here
"""
    status, lines = run_tests(tmp_path, many=many)
    assert status == 1
    assert lines[-1].startswith(f'{count} failed in ')


WORKS = """
import subprocess, sys, time

WORK = 'import time\\nwhile time.process_time() < 0.3: pass'

def test_that_works_in_a_child():
    subprocess.run([sys.executable, '-c', WORK])

def test_that_sleeps():
    time.sleep(0.6)
"""


@pytest.mark.parametrize(
    ('budget', 'status', 'words'), [('0.01', 1, ()), ('0.01', 1, XDIST), ('600', 0, XDIST)]
)
def test_the_work_of_a_child_counts_towards_the_budget_and_a_wait_does_not(
    tmp_path: Path, budget: str, status: int, words: tuple[str, ...]
):
    (tmp_path / 'test_works.py').write_text(WORKS)
    (tmp_path / 'pytest.ini').write_text('[pytest]')
    command = [sys.executable, '-m', 'pytest', '-p', 'processor_time', f'--budget={budget}']
    own = {'PYTHONPATH': str(Path(__file__).parent), 'PYTEST_DISABLE_PLUGIN_AUTOLOAD': '1'}
    done = run_process([*command, *words], cwd=tmp_path, env={**os.environ, **own})
    assert done.returncode == status
    assert ('ABOVE BUDGET' in done.stdout) == bool(status)
    rows = re.findall(r'^ +([\d.]+) (?:test_works.py::)?(\w+)$', done.stdout, re.MULTILINE)
    spent = {name: float(seconds) for seconds, name in rows}
    assert spent['test_that_works_in_a_child'] >= 0.3
    assert spent.get('test_that_sleeps', 0.0) < 0.3
    assert spent['collecting'] > 0.0
    (total_s,) = re.findall(r'^ +([\d.]+) in all of a budget of ', done.stdout, re.MULTILINE)
    assert float(total_s) == pytest.approx(sum(spent.values()), abs=0.5)
