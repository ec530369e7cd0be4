# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The benchmarks run, rivals agree with ours, and the results have their shape; no timings."""

import json
from functools import partial
from typing import Any

import numpy as np
import pytest

from benchmarks import report, rival
from benchmarks.__main__ import BENCHMARKS, main
from benchmarks.case import ACCURACY, Ours, cheapest, standard_case, worst_error
from benchmarks.clock import Program, in_turn
from benchmarks.outcome import Outcome
from benchmarks.rival import HALVES, SIX, Grid, Rival
from benchmarks.sizes import TINY, Sizes
from benchmarks.wishes import WISHES, wishes_of
from stickslip_ros.drive.layout import contacts_of

CYCLES = 10
FEW_CYCLES = 3
GRID = Grid(springs=120, step_s=1e-6, fall_steps=16)
FINE_S = 1e-6
ROUNDING = 1e-8
"""Sums in another order differ by rounding, which the sliding amplifies a little."""
HEAD = {'date', 'machine', 'commit', 'versions', 'benchmarks'}
BENCHMARK = {'title', 'seconds', 'rows', 'notes'}


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


@pytest.mark.slow
@pytest.mark.usefixtures('compiled_kernels')
@pytest.mark.parametrize('name', sorted(BENCHMARKS))
def test_every_benchmark_runs_and_has_rows_as_those_that_are_kept(name, kept):
    benchmark = tiny(name)
    assert_is_a_benchmark(benchmark)
    assert benchmark['rows']
    for row in benchmark['rows']:
        assert all(row[key] > 0.0 for key in row if key.startswith(('ratio', 'times')))
        if name in ('speed', 'paper'):
            assert row.get('worst_error') is None or row['worst_error'] <= ACCURACY
        assert list(row) == list(kept['benchmarks'][name]['rows'][0])


def test_the_kept_results_have_the_shape_of_a_run_and_name_every_benchmark(kept):
    assert set(kept) == set(report.circumstances()) | {'benchmarks'} == HEAD
    assert list(kept['benchmarks']) == list(BENCHMARKS)
    for benchmark in kept['benchmarks'].values():
        assert_is_a_benchmark(benchmark)


def test_the_readme_shows_the_kept_results(kept):
    assert report.markdown_of(kept) in report.README.read_text(encoding='utf-8')


def test_every_wish_of_a_user_finds_its_numbers_in_the_kept_results(kept):
    assert [row['wish'] for row in wishes_of(kept)] == [wish.what for wish in WISHES]


def test_a_part_of_the_benchmarks_changes_no_kept_results(monkeypatch, tmp_path):
    monkeypatch.setitem(BENCHMARKS, 'speed', lambda sizes: Outcome(f'{sizes.cycles}', []))
    for name in ('RESULTS', 'README'):
        monkeypatch.setattr(report, name, tmp_path / name)
    main(['speed'])
    assert not list(tmp_path.iterdir())
    main(['speed', '--out', str(tmp_path / 'out.json')])
    told = json.loads((tmp_path / 'out.json').read_text(encoding='utf-8'))
    assert set(told) == HEAD
    assert told['benchmarks']['speed']['title'] == '200'


def test_the_algorithm_of_the_paper_agrees_with_ours(ours_n):
    assert worst_error(forces_of(rival.compiled, SIX), ours_n) <= ACCURACY


def test_equal_springs_stepped_once_and_every_way_of_compiling_give_the_same_forces():
    plain_n = forces_of(rival.compiled, SIX, FEW_CYCLES)
    for which in (SIX, HALVES):
        found_n = forces_of(rival.vectorised, which, FEW_CYCLES)
        assert worst_error(found_n, plain_n) <= ROUNDING


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
