# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The benchmarks run, rivals agree with ours, and the results have their shape; no timings."""

import json
import re
import shutil
from functools import lru_cache, partial
from typing import Any

import numpy as np
import pytest

from benchmarks import against, in_c, report, rival
from benchmarks.__main__ import BENCHMARKS, main
from benchmarks.case import ACCURACY, Ours, cheapest, standard_case, worst_error
from benchmarks.clock import Program, in_turn
from benchmarks.lugre import LUGRE, scipy_runner
from benchmarks.outcome import Outcome
from benchmarks.rival import HALVES, SIX, Grid, Rival
from benchmarks.sizes import TINY, Sizes
from benchmarks.wishes import WISHES, wishes_of
from stickslip_ros.drive.build import contacts_of

CYCLES = 10
FEW_CYCLES = 3
GRID = Grid(springs=120, step_s=1e-6, fall_steps=16)
FINE_S = 1e-6
ROUNDING = 1e-8
"""Sums in another order differ by rounding, which the sliding amplifies a little."""
HEAD = {'date', 'machine', 'commit', 'versions', 'benchmarks'}
BENCHMARK = {'title', 'seconds', 'rows', 'verdicts', 'notes'}
VERDICT = {'target', 'wanted', 'found', 'at_most', 'met'}


@lru_cache
def tiny(name: str) -> dict[str, Any]:
    """Run a benchmark, just to see that it does; give what the results would hold of it."""
    return report.entry_of(BENCHMARKS[name](TINY), 0.0)


@pytest.fixture(scope='module')
def kept():
    return json.loads(report.RESULTS.read_text(encoding='utf-8'))


@pytest.fixture(scope='module')
def ours_n():
    return Ours(standard_case({'sim.dt': FINE_S}), CYCLES)()


def forces_of(loop, which, cycles=CYCLES):
    parameters = standard_case()
    springs = rival.equal_springs(parameters, GRID.springs, which)
    return Rival(loop, parameters, springs, GRID, cycles)()


def assert_is_a_benchmark(benchmark):
    assert set(benchmark) == BENCHMARK
    assert len({tuple(row) for row in benchmark['rows']}) <= 1
    for verdict in benchmark['verdicts']:
        assert set(verdict) == VERDICT


@pytest.mark.slow
@pytest.mark.usefixtures('compiled_kernels')
@pytest.mark.parametrize('name', sorted(BENCHMARKS))
def test_every_benchmark_runs_and_has_rows_as_those_that_are_kept(name, kept):
    benchmark = tiny(name)
    assert_is_a_benchmark(benchmark)
    left_out = any(note.startswith('left out') for note in benchmark['notes'])
    assert benchmark['rows'] or left_out
    for row in benchmark['rows']:
        assert all(row[key] > 0.0 for key in row if key.startswith(('ratio', 'times')))
        assert left_out or list(row) == list(kept['benchmarks'][name]['rows'][0])


@pytest.mark.slow
@pytest.mark.parametrize('name', ['speed', 'c', 'lugre'])
def test_what_a_table_calls_accurate_is(name):
    for row in tiny(name)['rows']:
        assert row.get('worst_error') is None or row['worst_error'] <= ACCURACY


@pytest.mark.slow
def test_the_drive_in_c_gives_the_bits_of_ours():
    differences = {row['program']: row['difference'] for row in tiny('c')['rows']}
    exact = {in_c.AS_WRITTEN: 0.0, 'ours': 0.0}
    assert all(value <= exact.get(name, ROUNDING) for name, value in differences.items())


def test_a_machine_without_a_c_compiler_leaves_c_out(monkeypatch):
    monkeypatch.setattr(shutil, 'which', lambda name: None)
    outcome = in_c.run(TINY)
    assert outcome.rows == []
    assert outcome.notes == ['left out: no C compiler is on the path']


def test_the_kept_results_have_the_shape_of_a_run_and_name_every_benchmark(kept):
    assert set(kept) == set(report.circumstances()) | {'benchmarks'} == HEAD
    assert list(kept['benchmarks']) == list(BENCHMARKS)
    for benchmark in kept['benchmarks'].values():
        assert_is_a_benchmark(benchmark)


def test_the_readme_shows_the_kept_results(kept):
    assert report.markdown_of(kept) in report.README.read_text(encoding='utf-8')


def test_every_wish_of_a_user_finds_its_numbers_in_the_kept_results(kept):
    assert [row['wish'] for row in wishes_of(kept)] == [wish.what for wish in WISHES]


def test_writing_the_readme_twice_changes_nothing(kept, tmp_path):
    path = tmp_path / 'README.md'
    path.write_text(f'before\n{report.BEGIN}\nstale\n{report.END}\nafter\n', encoding='utf-8')
    report.write_readme(kept, path)
    once = path.read_text(encoding='utf-8')
    report.write_readme(kept, path)
    assert path.read_text(encoding='utf-8') == once
    assert once.startswith('before\n')
    assert once.endswith('after\n')
    assert 'stale' not in once


def test_a_part_of_the_benchmarks_changes_no_kept_results(monkeypatch, tmp_path):
    monkeypatch.setitem(BENCHMARKS, 'gym', lambda sizes: Outcome(f'{sizes.cycles}', []))
    for name in ('RESULTS', 'README'):
        monkeypatch.setattr(report, name, tmp_path / name)
    main(['gym'])
    assert not list(tmp_path.iterdir())
    main(['gym', '--out', str(tmp_path / 'out.json')])
    told = json.loads((tmp_path / 'out.json').read_text(encoding='utf-8'))
    assert set(told) == HEAD
    assert told['benchmarks']['gym']['title'] == '200'


def test_the_algorithm_of_the_paper_agrees_with_ours(ours_n):
    assert worst_error(forces_of(rival.compiled, SIX), ours_n) <= ACCURACY


def test_equal_springs_may_be_stepped_once():
    all_n = forces_of(rival.vectorised, SIX)
    assert worst_error(forces_of(rival.vectorised, HALVES), all_n) <= ROUNDING


def test_every_way_of_compiling_it_gives_the_same_forces():
    plain_n = forces_of(rival.compiled, SIX, FEW_CYCLES)
    assert worst_error(forces_of(rival.vectorised, SIX, FEW_CYCLES), plain_n) <= ROUNDING


def test_the_springs_of_the_rival_carry_the_friction_of_all_contacts():
    parameters = standard_case()
    wanted_n = sum(contact.max_force_n for contact in contacts_of(parameters))
    for which in (SIX, HALVES):
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
        'stickslip_ros/lab/cli/start.py': 'def stickslip():\n    sum(range(20_000_000))\n',
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
    path = tmp_path / 'stickslip_ros/lab/cli/start.py'
    path.write_text(path.read_text().replace('20_', '60_'))
    return tmp_path


@pytest.mark.slow
def test_a_tree_is_compared_with_a_commit_in_what_both_can_do(two_trees):
    commit = against.commit_of('HEAD', two_trees)
    outcome = against.run(commit, TINY, two_trees)
    rows = {row['what']: row for row in outcome.rows}
    assert set(rows) == {'simulate', 'drive, default step, a cycle'}
    assert float(rows['simulate']['ratio']) > 1.0
    left_out = [note for note in outcome.notes if 'left out' in note]
    assert len(left_out) == 2
    why = re.compile('this tree: status 1: (ModuleNotFound|Import)Error: ')
    assert all(why.search(note) for note in left_out)
    assert against.git(two_trees, 'worktree', 'list').count('\n') == 0
