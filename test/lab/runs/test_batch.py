# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Many runs at once: same results whoever computes them, and none lost on the way."""

import dataclasses
import json
import re
import sys
import threading
from collections.abc import Iterator
from functools import partial

import pytest
from distributed import Client, LocalCluster
from waiting import GIVE_UP_S

import stickslip_ros
from stickslip_ros.errors import OutOfRange, RecordingError
from stickslip_ros.lab.runs import batch
from stickslip_ros.lab.runs.batch import ClusterError, Interrupted, run_batch, run_courses
from stickslip_ros.lab.runs.journal import Journal
from stickslip_ros.lab.runs.sweep import Sweep, SweepCase, case_course
from stickslip_ros.parameters import Parameters

# Dask warns where making its folder takes more than a second.
pytestmark = pytest.mark.filterwarnings('ignore:Creating scratch directories:UserWarning')
CASES = list(range(20))
STUDY = 'a study', len(CASES)


def third(case: int) -> dict:
    return {'case': case, 'third': case / 3.0, 'even': case % 2 == 0, 'name': f'no. {case}'}


ROWS = [third(case) for case in CASES]


class Counting:
    """The task, and what it was called with."""

    def __init__(self) -> None:
        self.cases: list[int] = []

    def __call__(self, case: int) -> dict:
        self.cases.append(case)
        return third(case)


def stop_at(number: int):
    """Return a progress callback that acts as Ctrl-C does, once."""

    def progress(done: int, total: int) -> None:
        if done == number:
            raise KeyboardInterrupt

    return progress


@pytest.mark.parametrize('workers', [0, 1, 2, 7])
def test_rows_come_in_the_order_of_the_cases(workers):
    assert run_batch(third, CASES, workers=workers) == ROWS


def test_a_case_that_ends_first_does_not_come_first():
    second_is_done = threading.Event()

    def task(case: int) -> dict:
        if case == 0:
            assert second_is_done.wait(GIVE_UP_S)
        second_is_done.set()
        return third(case)

    assert run_batch(task, CASES[:2], workers=2) == ROWS[:2]


class Taken(list):
    """Cases, and how many of them were taken."""

    taken = 0

    def __getitem__(self, index):
        self.taken += 1
        return super().__getitem__(index)


def test_few_cases_are_submitted_at_a_time_however_many_there_are(monkeypatch):
    monkeypatch.setattr(batch, 'SUBMITTED_MAX', 3)
    cases = Taken(CASES)
    waiting = []
    rows = run_batch(
        third, cases, workers=2, progress=lambda done, _: waiting.append(cases.taken - done)
    )
    assert rows == ROWS
    assert cases.taken == len(CASES)
    assert max(waiting) == 2  # the third has just ended


def test_no_cases_are_no_rows():
    assert run_batch(third, []) == []


def test_progress_is_told_from_the_journal_on(tmp_path):
    with Journal(tmp_path / 'j', *STUDY) as journal:
        for case in (3, 4, 5):
            journal.append(case, third(case))
        told = []
        run_batch(third, CASES, journal=journal, progress=lambda *both: told.append(both))
    assert told == [(done, 20) for done in range(3, 21)]


def test_what_the_journal_holds_is_not_run_again(tmp_path):
    with Journal(tmp_path / 'j', *STUDY) as journal:
        for case in (0, 7, 19):
            journal.append(case, third(case))
    task = Counting()
    with Journal(tmp_path / 'j', *STUDY) as journal:
        assert run_batch(task, CASES, journal=journal, workers=2) == ROWS
    assert sorted(task.cases) == [case for case in CASES if case not in {0, 7, 19}]
    with Journal(tmp_path / 'j', *STUDY) as journal:
        assert run_batch(task, CASES, journal=journal) == ROWS
    assert len(task.cases) == 17


def test_ctrl_c_keeps_what_is_done_and_the_next_call_goes_on(tmp_path):
    path = tmp_path / 'j'
    with Journal(path, *STUDY) as journal, pytest.raises(Interrupted) as caught:
        run_batch(third, CASES, journal=journal, workers=2, progress=stop_at(5))
    done = len(caught.value.rows)
    assert 5 <= done <= 20
    assert str(caught.value) == (
        f'stopped after {done} of 20 cases; they are in {path}, the same command goes on'
    )
    task = Counting()
    with Journal(path, *STUDY) as journal:
        assert journal.rows == caught.value.rows
        assert run_batch(task, CASES, journal=journal) == ROWS
    assert len(task.cases) == 20 - done


def test_ctrl_c_between_a_line_and_its_note_writes_the_line_again_and_counts_it_once(tmp_path):
    class Interrupting(Journal):
        lines = 0

        def _write(self, content):
            super()._write(content)
            self.lines += 1
            if self.lines == 3:  # the header, the first case, this one
                raise KeyboardInterrupt

    path = tmp_path / 'journal'
    with Interrupting(path, *STUDY) as journal, pytest.raises(Interrupted) as caught:
        run_batch(third, CASES, journal=journal, workers=1)
    kept = [json.loads(line)['case'] for line in path.read_bytes().splitlines()[1:]]
    assert len(kept) == len(set(kept)) + 1
    assert str(caught.value).startswith(f'stopped after {len(set(kept))} of')
    with Journal(path, *STUDY) as journal:
        assert journal.rows == {case: third(case) for case in kept}


def test_ctrl_c_waits_for_the_case_that_has_begun_and_begins_no_other():
    begun, go_on = threading.Event(), threading.Event()
    task = Counting()

    def slow(case: int) -> dict:
        if case == 3:
            begun.set()
            assert go_on.wait(GIVE_UP_S)
        return task(case)

    def progress(done: int, total: int) -> None:
        if done == 3:
            assert begun.wait(GIVE_UP_S)
            go_on.set()
            raise KeyboardInterrupt

    with pytest.raises(Interrupted) as caught:
        run_batch(slow, CASES, workers=1, progress=progress)
    assert {0, 1, 2, 3} <= set(caught.value.rows) == set(task.cases)
    assert str(caught.value).startswith('stopped after')
    assert 'they are in' not in str(caught.value)


def test_a_case_that_is_refused_ends_the_batch_and_loses_nothing(tmp_path):
    def picky(case: int) -> dict:
        if case == 12:
            raise OutOfRange('case', case, '', 'above the maximum 11', 'lower it')
        return third(case)

    with Journal(tmp_path / 'j', *STUDY) as journal:
        with pytest.raises(OutOfRange, match='case 12 is above'):
            run_batch(picky, CASES, journal=journal, workers=1)
        assert set(journal.rows) >= set(range(12))
        assert 12 not in journal.rows


@pytest.mark.parametrize('workers', [-1, 1025])
def test_a_number_of_workers_has_limits(workers):
    with pytest.raises(OutOfRange, match=f'number of workers {workers} is not from 0 to 1024'):
        run_batch(third, CASES, workers=workers)


def test_a_journal_cut_at_any_byte_goes_on_from_the_last_whole_line(tmp_path):
    path = tmp_path / 'j'
    with Journal(path, *STUDY) as journal:
        for case in range(3):
            journal.append(case, third(case))
    whole = path.read_bytes()
    for length in range(len(whole) + 1):
        path.write_bytes(whole[:length])
        with Journal(path, *STUDY) as journal:
            kept = max(whole[:length].count(b'\n') - 1, 0)
            assert journal.rows == dict(enumerate(ROWS[:kept]))
            for case in range(kept, 3):
                journal.append(case, third(case))
        assert path.read_bytes() == whole


HEADER = b'{"journal": "stickslip_ros", "study": "a study", "cases": %d}\n'


@pytest.mark.parametrize(
    'content',
    [b'something', b'a\nb\n', b'[1]\n', HEADER % 21, HEADER.replace(b'a s', b'b s') % 20],
)
def test_a_file_of_another_study_or_of_none_is_refused_and_left_as_it_was(tmp_path, content):
    path = tmp_path / 'j'
    with Journal(path, *STUDY):
        assert path.read_bytes() == HEADER % len(CASES)
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=r'is no journal, or one of another .* --fresh, or'):
        Journal(path, *STUDY)
    assert path.read_bytes() == content
    with Journal(path, *STUDY, fresh=True) as journal:
        assert journal.rows == {}


@pytest.mark.parametrize('line', ['{', '3', '{"case": 1}', '{"case": 20, "row": {}}', ''])
def test_a_damaged_line_is_refused_by_its_number(tmp_path, line):
    path = tmp_path / 'j'
    with Journal(path, *STUDY) as journal:
        journal.append(1, third(1))
    path.write_text(f'{path.read_text()}{line}\n')
    with pytest.raises(RecordingError, match='line 3 is damaged'):
        Journal(path, *STUDY)


def test_a_journal_is_written_by_one_process_at_a_time(tmp_path):
    in_use = 'is in use by another run; wait for it'
    path = tmp_path / 'j'
    with Journal(path, *STUDY), pytest.raises(RecordingError, match=in_use):
        Journal(path, *STUDY, fresh=True)
    with Journal(path, *STUDY) as journal:
        assert journal.rows == {}


def test_a_journal_that_cannot_be_made_is_refused(tmp_path):
    (tmp_path / 'file').write_text('')
    with pytest.raises(RecordingError, match='cannot be written'):
        Journal(tmp_path / 'file' / 'j', *STUDY)


def test_a_full_disk_loses_one_line_at_most(tmp_path, monkeypatch):
    path = tmp_path / 'j'
    with Journal(path, *STUDY) as journal:
        journal.append(0, third(0))
        with monkeypatch.context() as patch:
            patch.setattr('stickslip_ros.lab.runs.journal.os.write', lambda file, line: 3)
            with pytest.raises(RecordingError, match='the disk is full; make room'):
                run_batch(third, CASES, journal=journal)
    with Journal(path, *STUDY) as journal:
        assert journal.rows == {0: third(0)}


@pytest.fixture(scope='module')
def scheduler() -> Iterator[str]:
    """Give the address of a cluster of two processes."""
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=':0') as local:
        yield local.scheduler_address


def drive(count: int):
    """Return a task of the package, which workers can import, and its cases."""
    cases = [SweepCase((), case * 160e-9 / count, 1000.0) for case in range(count)]
    return partial(case_course, Sweep(Parameters(), (), (1000.0,), (0.0,), 10)), cases


def test_a_cluster_of_two_processes_gives_the_same_to_the_bit(scheduler, tmp_path, monkeypatch):
    monkeypatch.setattr(batch, 'SUBMITTED_MAX', 5)
    task, cases = drive(12)
    with Journal(tmp_path / 'j', 'a study', 12) as journal:
        there = run_courses(task, cases, 5, journal=journal, scheduler=scheduler)
        assert journal.rows == dict(enumerate(there))
    here = run_courses(task, cases, 1, workers=1)
    assert json.dumps(there) == json.dumps(here)


def test_ctrl_c_leaves_a_cluster_and_keeps_what_is_done(scheduler):
    task, cases = drive(40)
    with pytest.raises(Interrupted) as caught:
        run_courses(task, cases, 1, scheduler=scheduler, progress=stop_at(4))
    assert 4 <= len(caught.value.rows) <= 40
    assert len(run_courses(task, cases[:2], 1, scheduler=scheduler)) == 2


def test_a_scheduler_that_clears_up_is_asked_again_and_at_last_given_up(scheduler, monkeypatch):
    connect = Client._ensure_connected
    failed: list[Client] = []

    async def fail_twice(client, timeout=None):
        await connect(client, timeout)
        if client not in failed[:2] and len(failed) < 2:
            failed.append(client)
            raise AssertionError

    async def fail(client, timeout=None):
        raise AssertionError

    monkeypatch.setattr(Client, '_ensure_connected', fail_twice)
    assert run_batch(third, CASES, scheduler=scheduler) == ROWS
    assert len(failed) == 2
    monkeypatch.setattr(Client, '_ensure_connected', fail)
    monkeypatch.setattr(batch, 'CONNECT_S', 0.2)
    with pytest.raises(ClusterError, match='still clears up another batch; try again in a minute'):
        run_batch(third, CASES, scheduler=scheduler)


def test_a_case_that_is_refused_on_a_cluster_says_why(scheduler):
    task, cases = drive(2)
    wrong = [dataclasses.replace(cases[1], amplitude_m=1.0)]
    with pytest.raises(OutOfRange, match=r'above the 1\.6e-07 m that the amplifier reaches'):
        run_courses(task, wrong, 1, scheduler=scheduler)


def test_workers_of_another_version_are_refused(scheduler, monkeypatch):
    version = re.escape(stickslip_ros.__version__)
    monkeypatch.setattr(stickslip_ros, '__version__', '99')
    with pytest.raises(
        ClusterError, match=rf'need stickslip_ros 99, some have {version}; install'
    ):
        run_batch(third, CASES, scheduler=scheduler)


@pytest.mark.parametrize(
    ('address', 'message'),
    [('tcp://127.0.0.1:1', 'does not answer'), ('nonsense://x', 'unknown address scheme')],
)
def test_a_scheduler_that_does_not_answer_is_refused(address, message, monkeypatch):
    monkeypatch.setattr(batch, 'CONNECT_S', 0.1)
    with pytest.raises(ClusterError) as caught:
        run_batch(third, CASES, scheduler=address)
    assert message in str(caught.value)
    assert 'start one with: dask scheduler' in str(caught.value)


def test_a_cluster_without_workers_is_refused(monkeypatch):
    with LocalCluster(n_workers=0, dashboard_address=':0') as local:
        address = local.scheduler_address
        monkeypatch.setattr(batch, 'WORKERS_S', 1.0)
        with pytest.raises(ClusterError, match=f'no worker after 1 s; .*dask worker {address}'):
            run_batch(third, CASES, scheduler=address)


def test_a_cluster_that_has_lost_its_last_worker_ends_the_batch(monkeypatch):
    task, cases = drive(12)
    monkeypatch.setattr(batch, 'SUBMITTED_MAX', 2)
    monkeypatch.setattr(batch, 'WORKERS_S', 1.0)
    with LocalCluster(n_workers=1, processes=False, dashboard_address=':0') as local:

        def lose_workers(done: int, _: int) -> None:
            if done == 2:
                local.scale(0)

        told = r'has had no worker for 1 s; start it again, then the same command: what is done is'
        with pytest.raises(ClusterError, match=told):
            run_courses(task, cases, 1, scheduler=local.scheduler_address, progress=lose_workers)


def test_dask_is_imported_only_when_asked_for(monkeypatch):
    monkeypatch.setitem(sys.modules, 'distributed', None)
    assert run_batch(third, CASES) == ROWS
