"""The benchmarks run, rivals agree with ours, and the results have their shape; no timings."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from benchmarks import against, in_c, report, rival
from benchmarks.__main__ import BENCHMARKS, LONG, main
from benchmarks.case import ACCURACY, Ours, cheapest, standard_case, worst_error
from benchmarks.clock import Program, in_turn
from benchmarks.lugre import LUGRE, scipy_runner
from benchmarks.rival import GROUPS, HALVES, SIX, Grid, Rival
from benchmarks.sizes import TINY, Sizes
from benchmarks.wishes import WISHES, wishes_of
from stickslip_ros.drive.build import contacts_of

pytestmark = pytest.mark.timeout(900)  # a cold cache of kernels, then all that TIMEOUT_S allows

ROOT = Path(__file__).resolve().parents[1]
TIMEOUT_S = 240.0
"""For all processes together; less than what pytest allows, so that it is told what they said."""
TAIL_CHARACTERS = 8000
APART = ['node-recording', 'node-lockstep', 'node-latency', 'node-drift', 'node-panel', *LONG]
"""Benchmarks that are run in a process of their own."""
CYCLES = 10
FEW_CYCLES = 3
GRID = Grid(springs=120, step_s=1e-6, fall_steps=16)
FINE_S = 1e-6
ROUNDING = 1e-8
"""Sums in another order differ by rounding, which the sliding amplifies a little."""
CIRCUMSTANCES = {'date', 'machine', 'commit', 'versions'}
HEAD = CIRCUMSTANCES | {'benchmarks', 'long'}
BENCHMARK = {'title', 'seconds', 'rows', 'verdicts', 'notes'}
VERDICT = {'target', 'wanted', 'found', 'at_most', 'met'}


@contextmanager
def apart(names, out, log):
    """Run benchmarks in a process, which leaves no processes of its own behind when it fails."""
    words = ['-u', '-X', 'faulthandler', '-m', 'benchmarks', '--tiny', '--out', str(out), *names]
    with log.open('wb') as said:
        process = subprocess.Popen(
            [sys.executable, *words], cwd=ROOT, stdout=said, stderr=said, start_new_session=True
        )
    try:
        yield process
    finally:
        if process.poll() != 0:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def failure_of(process, log, end_s):
    """Wait for a process; return what went wrong and what it said last, if it was not well."""
    try:
        status = process.wait(max(0.0, end_s - time.monotonic()))
    except subprocess.TimeoutExpired:
        process.send_signal(signal.SIGABRT)  # the fault handler says where it stood
        process.wait()
        status = f'not ended after {TIMEOUT_S:g} s'
    if status == 0:
        return ''
    said = log.read_text(encoding='utf-8', errors='replace')[-TAIL_CHARACTERS:]
    return f'{process.args}: {status}\n{said}'


@pytest.fixture(scope='module')
def parts(tmp_path_factory, compiled_kernels):
    """Run all benchmarks, half of those that mostly wait for their processes beside the rest."""
    folder = tmp_path_factory.mktemp('benchmarks')
    groups = [[name for name in BENCHMARKS if name not in APART], APART]
    assert {name for group in groups for name in group} == set(BENCHMARKS) | set(LONG)
    files = [folder / f'{number}.json' for number in range(len(groups))]
    logs = [file.with_suffix('.log') for file in files]
    with ExitStack() as stack:
        end_s = time.monotonic() + TIMEOUT_S
        running = [
            stack.enter_context(apart(*each)) for each in zip(groups, files, logs, strict=True)
        ]
        failures = [
            failure_of(process, log, end_s) for process, log in zip(running, logs, strict=True)
        ]
    assert not any(failures), '\n'.join(failures)
    return [json.loads(file.read_text(encoding='utf-8')) for file in files]


@pytest.fixture(scope='module')
def results(parts):
    first, apart = parts
    assert first['long'] == {}
    return first | {'benchmarks': first['benchmarks'] | apart['benchmarks']}


@pytest.fixture(scope='module')
def ours_n():
    return Ours(standard_case({'sim.dt': FINE_S}), CYCLES)()


def forces_of(loop, which, cycles=CYCLES):
    parameters = standard_case()
    springs = rival.equal_springs(parameters, GRID.springs, which)
    return Rival(loop, parameters, springs, GRID, cycles)()


@pytest.fixture(scope='module')
def long_results(parts):
    return parts[-1] | {'benchmarks': {}}


def assert_has_the_documented_shape(results):
    assert set(results) == HEAD
    for benchmark in results['benchmarks'].values():
        assert_is_a_benchmark(benchmark, BENCHMARK)
    for benchmark in results['long'].values():
        assert_is_a_benchmark(benchmark, BENCHMARK | CIRCUMSTANCES)


def assert_is_a_benchmark(benchmark, keys):
    assert set(benchmark) == keys
    assert len({tuple(row) for row in benchmark['rows']}) <= 1
    for verdict in benchmark['verdicts']:
        assert set(verdict) == VERDICT


@pytest.mark.parametrize('name', sorted(BENCHMARKS))
def test_every_benchmark_runs_and_has_rows(results, name):
    benchmark = results['benchmarks'][name]
    left_out = any(note.startswith('left out') for note in benchmark['notes'])
    assert benchmark['rows'] or left_out
    for row in benchmark['rows']:
        assert all(row[key] > 0.0 for key in row if key.startswith(('ratio', 'times')))


@pytest.mark.parametrize('name', ['speed', 'c', 'lugre', 'octave'])
def test_what_a_table_calls_accurate_is(results, name):
    for row in results['benchmarks'][name]['rows']:
        assert row.get('worst_error') is None or row['worst_error'] <= ACCURACY


def test_the_drive_in_c_gives_the_bits_of_ours(results):
    differences = {row['program']: row['difference'] for row in results['benchmarks']['c']['rows']}
    exact = {in_c.AS_WRITTEN: 0.0, 'ours': 0.0}
    assert all(value <= exact.get(name, ROUNDING) for name, value in differences.items())


def test_a_machine_without_a_c_compiler_leaves_c_out(monkeypatch):
    monkeypatch.setattr(shutil, 'which', lambda name: None)
    outcome = in_c.run(TINY)
    assert outcome.rows == []
    assert outcome.notes == ['left out: no C compiler is on the path']


def test_the_results_of_a_run_have_the_documented_shape(results):
    assert_has_the_documented_shape(results)


@pytest.mark.parametrize('name', sorted(LONG))
def test_every_long_benchmark_runs_and_says_when_and_where(long_results, name):
    assert_has_the_documented_shape(long_results)
    assert long_results['long'][name]['rows']


def test_short_and_long_benchmarks_are_told_apart(parts):
    assert {name for part in parts for name in part['benchmarks']} == set(BENCHMARKS)
    assert {name for part in parts for name in part['long']} == set(LONG)


def test_the_kept_results_have_that_shape_and_name_every_benchmark():
    kept = json.loads(report.RESULTS.read_text(encoding='utf-8'))
    assert_has_the_documented_shape(kept)
    assert list(kept['benchmarks']) == list(BENCHMARKS)
    assert set(kept['long']) <= set(LONG)


def test_the_readme_shows_the_kept_results():
    kept = json.loads(report.RESULTS.read_text(encoding='utf-8'))
    assert report.markdown_of(kept) in report.README.read_text(encoding='utf-8')


def test_every_wish_of_a_user_finds_its_numbers_in_the_kept_results():
    kept = json.loads(report.RESULTS.read_text(encoding='utf-8'))
    assert [row['wish'] for row in wishes_of(kept)] == [wish.what for wish in WISHES]


def test_the_kept_tables_can_be_printed(capsys):
    main(['--kept'])
    told = capsys.readouterr().out
    kept = json.loads(report.RESULTS.read_text(encoding='utf-8'))
    assert all(f'{name}: ' in told for name in kept['benchmarks'] | kept['long'])


def test_writing_the_readme_twice_changes_nothing(results, tmp_path):
    path = tmp_path / 'README.md'
    path.write_text(f'before\n{report.BEGIN}\nstale\n{report.END}\nafter\n', encoding='utf-8')
    report.write_readme(results, path)
    once = path.read_text(encoding='utf-8')
    report.write_readme(results, path)
    assert path.read_text(encoding='utf-8') == once
    assert once.startswith('before\n')
    assert once.endswith('after\n')
    assert 'stale' not in once


def test_long_results_stay_until_they_are_measured_again(results, long_results, tmp_path):
    path, readme = tmp_path / 'results.json', tmp_path / 'README.md'
    readme.write_text(f'{report.BEGIN}\n{report.END}\n', encoding='utf-8')
    report.write_results(results, path)
    report.keep(long_results, is_whole=False, path=path, readme=readme)
    report.keep(results, is_whole=True, path=path, readme=readme)
    kept = json.loads(path.read_text(encoding='utf-8'))
    assert kept == results | {'long': long_results['long']}
    assert report.markdown_of(kept) in readme.read_text(encoding='utf-8')


def test_a_part_of_the_benchmarks_changes_no_kept_results(results, tmp_path):
    path = tmp_path / 'results.json'
    report.keep(results, is_whole=False, path=path, readme=path)
    assert not path.exists()


def test_the_algorithm_of_the_paper_agrees_with_ours(ours_n):
    assert worst_error(forces_of(rival.compiled, SIX), ours_n) <= ACCURACY


@pytest.mark.parametrize('which', [GROUPS, HALVES])
def test_equal_springs_may_be_stepped_once(which):
    all_n = forces_of(rival.vectorised, SIX)
    assert worst_error(forces_of(rival.vectorised, which), all_n) <= ROUNDING


@pytest.mark.parametrize(
    'loop', [rival.vectorised, rival.all_springs_at_once, rival.all_springs_in_place]
)
def test_every_way_of_writing_it_gives_the_same_forces(loop):
    plain_n = forces_of(rival.compiled, SIX, FEW_CYCLES)
    assert worst_error(forces_of(loop, SIX, FEW_CYCLES), plain_n) <= ROUNDING


def test_the_springs_of_the_rival_carry_the_friction_of_all_contacts():
    parameters = standard_case()
    wanted_n = sum(contact.max_force_n for contact in contacts_of(parameters))
    for which in (SIX, GROUPS, HALVES):
        limits_n = rival.equal_springs(parameters, GRID.springs, which).limit_n
        assert np.sum(limits_n) == pytest.approx(wanted_n, rel=ROUNDING)
    lines = standard_case({'contact.profile': 'rough_line'})
    assert np.sum(rival.line_springs(lines).limit_n) == pytest.approx(wanted_n, rel=ROUNDING)


def test_thousands_of_springs_of_rough_lines_agree_with_ours():
    parameters = standard_case({'contact.profile': 'rough_line', 'sim.dt': FINE_S})
    springs = rival.line_springs(parameters)
    assert len(springs.limit_n) > 6 * 1000
    forces_n = Rival(rival.vectorised, parameters, springs, GRID, FEW_CYCLES)()
    assert worst_error(forces_n, Ours(parameters, FEW_CYCLES)()) <= ACCURACY


def test_lugre_in_scipy_agrees_with_ours():
    parameters = standard_case({**LUGRE, 'sim.dt': FINE_S})
    ours_n = Ours(parameters, FEW_CYCLES)()
    assert worst_error(ours_n, scipy_runner(parameters, FEW_CYCLES)('LSODA', 1e-6)) <= ACCURACY


def test_programs_run_in_turn_and_are_warmed_up():
    calls: list[str] = []
    programs = [Program(partial(calls.append, name), 1.0) for name in 'ab']
    times = in_turn(programs, Sizes(rounds=2, least_s=0.0))
    assert ''.join(calls) == 'ab' + 'abab'
    assert times.seconds.shape == (2, 2)


def test_the_first_accurate_setting_is_taken_and_else_the_last():
    reference_n = np.array([1.0, 2.0])
    tried = {3: reference_n * 1.5, 2: reference_n * (1.0 + 0.5 * ACCURACY), 1: reference_n}
    assert cheapest([3, 2, 1], tried.get, reference_n) == 2
    assert cheapest([3], tried.get, reference_n) == 3


def test_an_unknown_benchmark_is_refused(capsys):
    with pytest.raises(SystemExit):
        main(['no-such'])
    assert 'no benchmark no-such' in capsys.readouterr().err


def test_an_unknown_commit_is_refused(capsys):
    with pytest.raises(SystemExit):
        main(['--against', 'no-such'])
    assert 'no commit no-such' in capsys.readouterr().err


@pytest.fixture
def two_trees(tmp_path):
    """Give a repository whose commit simulates and has no node; its tree takes longer."""
    files = {
        'stickslip_ros/__init__.py': '',
        'benchmarks/__init__.py': '',
        'stickslip_ros/entry.py': 'def stickslip():\n    sum(range(20_000_000))\n',
        'benchmarks/case.py': 'standard_case, Ours = dict, lambda *_: lambda: sum(range(9999))\n',
    }
    for name, text in files.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    identity = ('-c', 'user.name=test', '-c', 'user.email=test@localhost')
    against.git(tmp_path, 'init', '--quiet')
    against.git(tmp_path, 'add', '.')
    against.git(tmp_path, *identity, 'commit', '--quiet', '--message', 'The older one')
    path = tmp_path / 'stickslip_ros/entry.py'
    path.write_text(path.read_text().replace('20_', '60_'))
    return tmp_path


def test_a_tree_is_compared_with_a_commit_in_what_both_can_do(two_trees):
    commit = against.commit_of('HEAD', two_trees)
    outcome = against.run(commit, TINY, two_trees)
    rows = {row['what']: row for row in outcome.rows}
    assert set(rows) == {'simulate', 'drive, default step, a cycle', 'drive, sim.dt=5e-6, a cycle'}
    assert float(rows['simulate']['ratio']) > 1.0
    left_out = [note for note in outcome.notes if 'left out' in note]
    assert len(left_out) == 2
    why = re.compile('this tree: status 1: (ModuleNotFound|Import)Error: ')
    assert all(why.search(note) for note in left_out)
    assert against.git(two_trees, 'worktree', 'list').count('\n') == 0


def test_the_octave_script_is_named_after_its_function():
    script = Path(report.FOLDER, 'paper_algorithm.m')
    assert script.read_text(encoding='utf-8').startswith('function paper_algorithm(')
