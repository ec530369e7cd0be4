# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Ours against the algorithm of the paper, at the same accuracy."""

from collections.abc import Mapping

from benchmarks import rival
from benchmarks.case import (
    ACCURACY,
    PERIOD_S,
    Ours,
    cheapest,
    ours_at,
    standard_case,
    worst_error,
)
from benchmarks.clock import Program, in_turn
from benchmarks.outcome import Outcome, Row
from benchmarks.rival import HALVES, SIX, Grid, Loop, Rival, Springs
from benchmarks.sizes import Sizes
from stickslip_ros.arrays import Array
from stickslip_ros.parameters import Parameters

OURS, COMPILED, SIMD = 'ours', 'numba', 'numba, SIMD'
FINE = Grid(springs=1600, step_s=0.25e-6, fall_steps=64)
"""The paper's algorithm where it has converged: what ours must agree with."""

Contestant = tuple[str, str, Loop, Springs]


def run_equivalent(sizes: Sizes) -> Outcome:
    """Compare on the equivalent profile, of which few springs are enough."""
    parameters = standard_case()
    reference_n = Ours(standard_case({'sim.dt': sizes.converged_s}), sizes.cycles)()

    def forces_of(grid: Grid) -> Array:
        springs = rival.equal_springs(parameters, grid.springs, HALVES)
        return Rival(rival.vectorised, parameters, springs, grid, sizes.cycles)()

    grid = cheapest(sorted(_grids(sizes), key=Grid.cost), forces_of, reference_n)
    contestants = [
        (name, which, loop, rival.equal_springs(parameters, grid.springs, which))
        for name, which, loop in (
            (COMPILED, SIX, rival.compiled),
            (SIMD, HALVES, rival.vectorised),
        )
    ]
    rows = _race({}, parameters, contestants, grid, sizes, reference_n)
    apart = worst_error(forces_of(FINE), reference_n)
    agreement = (
        f"with {FINE.springs} springs a contact and {_words(FINE)} the paper's algorithm agrees "
        f'with the converged run of ours to {apart:.1e}'
    )
    notes = [*_notes(sizes), agreement]
    return Outcome('The algorithm of the paper, equivalent rough profile', rows, notes)


def run_line(sizes: Sizes) -> Outcome:
    """Compare on six different rough lines, with thousands of springs in contact."""
    changes: dict[str, object] = {'contact.profile': 'rough_line'}
    parameters = standard_case(changes)
    springs = rival.line_springs(parameters)
    reference_n = Ours(standard_case({**changes, 'sim.dt': sizes.converged_s}), sizes.cycles)()
    grids = [g._replace(springs=0) for g in _grids(sizes) if g.springs == sizes.springs[0]]

    def forces_of(grid: Grid) -> Array:
        return Rival(rival.vectorised, parameters, springs, grid, sizes.cycles)()

    grid = cheapest(sorted(grids, key=Grid.cost), forces_of, reference_n)
    contestants = [(SIMD, SIX, rival.vectorised, springs)]
    rows = _race(changes, parameters, contestants, grid, sizes, reference_n)
    return Outcome(
        'The algorithm of the paper, six different rough lines',
        rows,
        [*_notes(sizes), f'{len(springs.limit_n)} springs in contact, all six lines together'],
    )


def _grids(sizes: Sizes) -> list[Grid]:
    return [
        Grid(springs, step_s, fall_steps)
        for springs in sizes.springs
        for step_s in sizes.rival_steps_s
        for fall_steps in sizes.fall_steps
    ]


def _race(
    changes: Mapping[str, object],
    parameters: Parameters,
    contestants: list[Contestant],
    grid: Grid,
    sizes: Sizes,
    reference_n: Array,
) -> list[Row]:
    """Run ours and the rivals in turn; return a row for each."""
    ours, step_s = ours_at(changes, sizes.steps_s, sizes.cycles, reference_n)
    programs, forces_n = [Program(ours, ours.work_s)], [ours()]
    labels = [(OURS, '-', f'{step_s * 1e6:g} us')]
    for name, which, loop, springs in contestants:
        program = Rival(loop, parameters, springs, grid, sizes.cycles)
        programs.append(Program(program, sizes.cycles * PERIOD_S))
        forces_n.append(program())
        labels.append((name, f'{which}, {len(springs.limit_n)}', _words(grid)))
    times = in_turn(programs, sizes)
    return [
        {
            'program': label[0],
            'springs_stepped': label[1],
            'step': label[2],
            'times_real_time': 1.0 / times.median(i),
            **times.ratio(i),
            'worst_error': worst_error(forces_n[i], reference_n),
        }
        for i, label in enumerate(labels)
    ]


def _words(grid: Grid) -> str:
    return f'{grid.step_s * 1e6:g} us, {grid.fall_steps} a fall'


def _notes(sizes: Sizes) -> list[str]:
    return [
        f'every program at the cheapest setting whose worst error is at most {ACCURACY:g}',
        (
            f'ratio: time of a rival over time of ours, median of {sizes.rounds} turns, with the '
            'lowest and highest; ours keeps an energy balance, the rivals do not'
        ),
    ]
