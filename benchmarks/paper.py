"""Ours against the algorithm of the paper, at the same accuracy."""

from benchmarks import rival
from benchmarks.case import (
    ACCURACY,
    PERIOD_S,
    Ours,
    cheapest,
    last_error,
    ours_at,
    standard_case,
    worst_error,
)
from benchmarks.clock import Array, Program, in_turn
from benchmarks.outcome import Outcome, Row, Verdict
from benchmarks.rival import GROUPS, HALVES, SIX, Grid, Rival, Springs
from benchmarks.sizes import Sizes
from stickslip_ros.parameters import Parameters

FEW = 50
"""Springs of a contact in the kernel that the targets name."""
OURS = 'ours'
COMPILED, SIMD = 'numba', 'numba, SIMD'
NUMPY, IN_PLACE = 'NumPy', 'NumPy, in place'
LOOPS = {
    COMPILED: rival.compiled,
    SIMD: rival.vectorised,
    NUMPY: rival.all_springs_at_once,
    IN_PLACE: rival.all_springs_in_place,
}
SLOW = (NUMPY, IN_PLACE)
FINE = Grid(springs=1600, step_s=0.25e-6, fall_steps=64)
"""The paper's algorithm where it has converged: what ours must agree with."""
TARGETS = {COMPILED: 10.0, SIMD: 10.0, NUMPY: 500.0, IN_PLACE: 500.0}
LINE_TARGETS = {COMPILED: 100.0, SIMD: 100.0, NUMPY: 500.0, IN_PLACE: 500.0}
NUMPY_AIM = 2000.0

Contestant = tuple[str, str, Grid, Springs]


def run_equivalent(sizes: Sizes) -> Outcome:
    """Compare on the equivalent profile, of which few springs are enough."""
    parameters = standard_case()
    reference_n = Ours(standard_case({'sim.dt': sizes.converged_s}), sizes.cycles)()
    grid = _accurate_grid(parameters, sizes, reference_n)
    few = grid._replace(springs=FEW)
    wanted = [
        (COMPILED, SIX, few), (COMPILED, SIX, grid), (COMPILED, GROUPS, grid),
        (SIMD, GROUPS, grid), (SIMD, HALVES, grid), (NUMPY, SIX, grid), (IN_PLACE, HALVES, grid),
    ]  # fmt: skip
    contestants = [
        (loop, which, g, rival.equal_springs(parameters, g.springs, which))
        for loop, which, g in wanted
    ]
    rows = _race({}, parameters, contestants, sizes, reference_n)
    return Outcome(
        'The algorithm of the paper, equivalent rough profile',
        rows,
        _verdicts(rows, TARGETS),
        [*_notes(sizes), _agreement(parameters, reference_n, sizes)],
    )


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
    contestants = [(loop, SIX, grid, springs) for loop in LOOPS]
    rows = _race(changes, parameters, contestants, sizes, reference_n)
    return Outcome(
        'The algorithm of the paper, six different rough lines',
        rows,
        _verdicts(rows, LINE_TARGETS),
        [*_notes(sizes), f'{len(springs.limit_n)} springs in contact, all six lines together'],
    )


def _grids(sizes: Sizes) -> list[Grid]:
    return [
        Grid(springs, step_s, fall_steps)
        for springs in sizes.springs
        for step_s in sizes.rival_steps_s
        for fall_steps in sizes.fall_steps
    ]


def _accurate_grid(parameters: Parameters, sizes: Sizes, reference_n: Array) -> Grid:
    """Return the cheapest grid that is as accurate as ACCURACY."""

    def forces_of(grid: Grid) -> Array:
        springs = rival.equal_springs(parameters, grid.springs, HALVES)
        return Rival(rival.vectorised, parameters, springs, grid, sizes.cycles)()

    return cheapest(sorted(_grids(sizes), key=Grid.cost), forces_of, reference_n)


def _race(
    changes: dict[str, object],
    parameters: Parameters,
    contestants: list[Contestant],
    sizes: Sizes,
    reference_n: Array,
) -> list[Row]:
    """Run ours and the rivals in turn; return a row for each."""
    ours, step_s = ours_at(changes, sizes.steps_s, sizes.cycles, reference_n)
    programs = [Program(ours, ours.work_s)]
    labels = [(OURS, '-', f'{step_s * 1e6:g} us')]
    errors = [ours()]
    for loop, which, grid, springs in contestants:
        cycles = sizes.numpy_cycles if loop in SLOW else sizes.cycles
        program = Rival(LOOPS[loop], parameters, springs, grid, cycles)
        programs.append(Program(program, cycles * PERIOD_S))
        labels.append((loop, f'{which}, {len(springs.limit_n)}', _words(grid)))
        # NumPy runs fewer cycles: its error is that of its compiled twin in all of them.
        twin = Rival(rival.vectorised, parameters, springs, grid, sizes.cycles)
        errors.append(twin() if loop in SLOW else program())
    times = in_turn(programs, sizes)
    return [
        {
            'program': label[0],
            'springs_stepped': label[1],
            'step': label[2],
            'times_real_time': 1.0 / times.median(i),
            **times.ratio(i),
            'error': last_error(errors[i], reference_n),
            'worst_error': worst_error(errors[i], reference_n),
        }
        for i, label in enumerate(labels)
    ]


def _words(grid: Grid) -> str:
    return f'{grid.step_s * 1e6:g} us, {grid.fall_steps} a fall'


def _verdicts(rows: list[Row], targets: dict[str, float]) -> list[Verdict]:
    verdicts = []
    for row in rows[1:]:
        program, ratio = str(row['program']), float(row['ratio'])
        words = f'times faster than {program}, {row["springs_stepped"]} springs'
        verdicts.append(Verdict(words, targets[program], ratio))
        if program in SLOW:
            verdicts.append(Verdict(f'{words} (aim)', NUMPY_AIM, ratio))
    return verdicts


def _notes(sizes: Sizes) -> list[str]:
    return [
        (
            f'every program at the cheapest setting whose worst error is at most {ACCURACY:g} '
            f'(the row of {FEW} springs a contact has the same time step and its own error)'
        ),
        (
            f'NumPy runs {sizes.numpy_cycles} cycles, the others {sizes.cycles}: times are per '
            'simulated second, and its error is that of the compiled twin over all cycles'
        ),
        (
            f'ratio: time of a rival over time of ours, median of {sizes.rounds} turns, with the '
            'lowest and highest; ours keeps an energy balance, the rivals do not'
        ),
    ]


def _agreement(parameters: Parameters, reference_n: Array, sizes: Sizes) -> str:
    """Say how far the converged runs of both are apart."""
    springs = rival.equal_springs(parameters, FINE.springs, HALVES)
    cycles = min(sizes.cycles, len(reference_n))
    forces_n = Rival(rival.vectorised, parameters, springs, FINE, cycles)()
    apart = worst_error(forces_n, reference_n)
    return (
        f"with {FINE.springs} springs a contact and {_words(FINE)} the paper's algorithm agrees "
        f'with the converged run of ours to {apart:.1e}'
    )
