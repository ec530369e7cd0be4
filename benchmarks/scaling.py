"""What the cost depends on: cycles, past reversals, springs, threads, set-up of a sweep."""

import math
import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from itertools import count

import numba
import numpy as np

from benchmarks.case import AMPLITUDE_M, FREQUENCY_HZ, PERIOD_S, PRELOAD_N, Ours, standard_case
from benchmarks.clock import Array, Program, in_turn
from benchmarks.outcome import Outcome, Row, Verdict
from benchmarks.sizes import Sizes
from stickslip_ros.contact.hemisphere import elasticity_of
from stickslip_ros.contact.memory import fresh_memory, move
from stickslip_ros.contact.record import Record, record
from stickslip_ros.contact.springs import move_springs, spring_bank, springs_kind
from stickslip_ros.drive.build import groups_of, plant_of
from stickslip_ros.drive.records import ALL
from stickslip_ros.parameters import Parameters
from stickslip_ros.runs.sawtooth_run import run_drive
from stickslip_ros.runs.sweep import Axis, Sweep, run_sweep

LARGEST, SMALLEST, PROBE = 0.9, 0.1, 0.05
"""Amplitudes of past reversals and of the probing motion, relative to full slip."""
PROBE_MOVES = 20_000
MOVES_PER_TURN = 8
DRAGS = 2000
EFFICIENCY = 0.85
SWEEP_CASES = 64
SHARING = 8
"""Cases of a sweep that have the same preload."""
GOLDEN_RATIO = 0.5 * (1.0 + math.sqrt(5.0))
SET_UP_SHARE = 0.15
CASE_COST = 1.2
LINEAR = 1.2
"""A cost that is constant but for noise changes by less than this factor."""


def run_cycles(sizes: Sizes) -> Outcome:
    """Time per cycle against the number of cycles: it does not depend on it."""
    programs = [
        Program(Ours(standard_case(), cycles), cycles * PERIOD_S) for cycles in sizes.scaling
    ]
    times = in_turn(programs, sizes)
    rows: list[Row] = [
        {'cycles': cycles, 'us_per_cycle': times.median(i) * PERIOD_S * 1e6, **times.ratio(i)}
        for i, cycles in enumerate(sizes.scaling)
    ]
    return Outcome(
        'Time per cycle against the number of cycles',
        rows,
        [_constant('time per cycle, largest over smallest', times.seconds)],
        [f'drive.advance, default step; ratio to {sizes.scaling[0]} cycles'],
    )


@numba.njit()
def remember(curve: Record, memory: Record, reversals: int) -> None:
    """Turn round many times, with ever smaller amplitudes."""
    sense = 1.0
    for i in range(reversals):
        share = LARGEST + (SMALLEST - LARGEST) * i / reversals
        move(curve, memory, sense * share * curve.limit_m)
        sense = -sense
    move(curve, memory, 0.0)


@numba.njit()
def probe(curve: Record, memory: Record, moves: int) -> None:
    """Go to and fro inside all that is remembered."""
    reach_m = PROBE * curve.limit_m
    for i in range(moves):
        phase = (i + MOVES_PER_TURN) % (4 * MOVES_PER_TURN)
        steps = abs(phase - 2 * MOVES_PER_TURN) - MOVES_PER_TURN
        move(curve, memory, reach_m * steps / MOVES_PER_TURN)


def run_reversals(sizes: Sizes) -> Outcome:
    """Time of one motion of the contact against the number of reversals that it has seen."""
    curve = plant_of(standard_case())[0].contacts[ALL].curve
    counts = (0, *sizes.scaling)
    programs, depths = [], []
    for reversals in counts:
        memory = fresh_memory()
        remember(curve, memory, reversals)
        depths.append(int(memory.depth))
        programs.append(Program(partial(probe, curve, memory, PROBE_MOVES), PROBE_MOVES))
    times = in_turn(programs, sizes)
    rows: list[Row] = [
        {
            'past_reversals': count,
            'remembered': depth,
            'ns_per_move': times.median(i) * 1e9,
            **times.ratio(i),
        }
        for i, (count, depth) in enumerate(zip(counts, depths, strict=True))
    ]
    return Outcome(
        'Time of one motion of the contact against its past',
        rows,
        [_constant('time per motion, largest over smallest', times.seconds)],
        ['contact.memory.move alone, to and fro; ratio to a contact without a past'],
    )


@numba.njit()
def shake(bank: Record, springs: Record, reach_m: float, drags: int) -> float:
    """Drag a bank of springs to and fro at constant preload."""
    total_n = 0.0
    for i in range(drags):
        force_n, _ = move_springs(
            bank, springs, reach_m if i % 2 else -reach_m, PRELOAD_N, PRELOAD_N
        )
        total_n += force_n
    return total_n


def run_springs(sizes: Sizes) -> Outcome:
    """Time against springs: linear in the bank, which serves changing loads; constant else."""
    parameters = standard_case()
    reach_m = 0.5 * plant_of(parameters)[0].contacts[ALL].curve.limit_m
    names: list[str] = []
    programs = []
    for springs in (n for n in sizes.scaling if n <= 1000):
        bank = spring_bank(
            groups_of(parameters.contact),
            elasticity_of(parameters.contact),
            parameters.contact.friction,
            PRELOAD_N,
            springs,
        )
        state = record(springs_kind(len(bank.heights_m)))
        names.append(f'bank of {bank.first[bank.groups]} springs, a step')
        programs.append(Program(partial(shake, bank, state, reach_m, DRAGS), DRAGS))
    shapes = ('smooth', 'rough', 'rough_line')
    for shape in shapes:
        ours = Ours(standard_case({'contact.profile': shape}), sizes.cycles)
        names.append(f'drive.advance, {shape}, a cycle')
        programs.append(Program(ours, sizes.cycles))
    times = in_turn(programs, sizes)
    first = len(names) - len(shapes)
    rows: list[Row] = [
        {'what': name, 'us': times.median(i) * 1e6, **times.ratio(i, 0 if i < first else first)}
        for i, name in enumerate(names)
    ]
    return Outcome(
        'Time against the number of springs',
        rows,
        [],
        [
            (
                'ratio to the smallest bank, or to the smooth profile; rough_line has six '
                'different contacts of thousands of springs, the others two kinds of a continuum'
            )
        ],
    )


def _twice(pool: ThreadPoolExecutor, job: Callable[[int], object]) -> list[object]:
    return list(pool.map(job, range(2)))


def run_threads(sizes: Sizes) -> Outcome:
    """Two independent drives, one after the other and on two threads."""
    load = os.getloadavg()[0]
    drives = [Ours(standard_case(), sizes.thread_cycles) for _ in range(2)]
    parameters = standard_case()

    def with_set_up(_: int) -> object:
        return run_drive(parameters, AMPLITUDE_M, FREQUENCY_HZ, sizes.thread_cycles)

    def advance(i: int) -> object:
        return drives[i]()

    rows: list[Row] = []
    efficiencies = []
    for name, job in (('drive.advance', advance), ('run_drive', with_set_up)):
        with ThreadPoolExecutor(1) as one, ThreadPoolExecutor(2) as two:
            programs = [Program(partial(_twice, pool, job), 2.0) for pool in (one, two)]
            times = in_turn(programs, sizes)
        efficiency = 0.5 * times.ratios(0, 1)
        efficiencies.append(float(np.median(efficiency)))
        rows.append(
            {
                'program': name,
                'one_worker_s': times.median(0),
                'two_workers_s': times.median(1),
                'cores': times.cores(1),
                'efficiency': efficiencies[-1],
                'lowest': float(efficiency.min()),
                'highest': float(efficiency.max()),
            }
        )
    return Outcome(
        'Two threads',
        rows,
        [Verdict('efficiency of two threads (aim)', EFFICIENCY, min(efficiencies))],
        [
            (
                f'{sizes.thread_cycles} cycles a job, two jobs; seconds per job; cores: what '
                'the two workers were given'
            ),
            f'load of the machine before: {load:.2g}; others on it lower the efficiency',
        ],
    )


def run_sweeps(sizes: Sizes) -> Outcome:
    """Sweeps on one thread against the drive alone, and how much of a case is its set-up."""
    drives = [
        Ours(standard_case(dict(case.values)), sizes.cycles)
        for case in _sweep(np.linspace(0.1, 1.0, SWEEP_CASES), 1, sizes.cycles).cases()
    ]
    programs = [Program(lambda: [drive() for drive in drives], SWEEP_CASES)]
    names = {1: 'a new preload for every case', SHARING: f'one for every {SHARING} cases'}
    preloads_n = _new_preloads()
    for sharing in names:
        for steps in (sizes.cycles, 1):

            def sweep(sharing: int = sharing, steps: int = steps) -> object:
                chosen_n = [next(preloads_n) for _ in range(SWEEP_CASES // sharing)]
                return run_sweep(_sweep(chosen_n, sharing, steps), workers=1)

            programs.append(Program(sweep, SWEEP_CASES))
    cpu_s = in_turn(programs, sizes).cpu_seconds
    rows: list[Row] = []
    verdicts: list[Verdict] = []
    for i, name in enumerate(names.values()):
        whole_s, one_step_s = cpu_s[1 + 2 * i], cpu_s[2 + 2 * i]
        share, ratios = float(np.median(one_step_s / whole_s)), whole_s / cpu_s[0]
        cost = float(np.median(ratios))
        rows.append(
            {
                'sweep': name,
                'cpu_ms_per_case': float(np.median(whole_s)) * 1e3,
                'set_up_ms': float(np.median(one_step_s)) * 1e3,
                'set_up_share': share,
                'ratio': cost,
                'ratio_low': float(ratios.min()),
                'ratio_high': float(ratios.max()),
            }
        )
        verdicts += [
            Verdict(f'share of set-up, {name}', SET_UP_SHARE, share, at_most=True),
            Verdict(f'cost over the drive alone, {name}', CASE_COST, cost, at_most=True),
        ]
    return Outcome(
        f'Sweeps of {SWEEP_CASES} cases of {sizes.cycles} steps, and their set-up',
        rows,
        verdicts,
        [
            'processor time; ratio: to drive.advance alone, over as many cycles at such preloads',
            'set-up: the same sweep with one step; new preloads in every turn, so none is kept',
        ],
    )


def _sweep(preloads_n: Iterable[float], sharing: int, steps: int) -> Sweep:
    """Return so many preloads, each with several dampings, at one stroke."""
    preloads = Axis('stand.preload', tuple(map(float, preloads_n)))
    dampings = Axis('runner.damping', tuple(float(i) for i in range(sharing)))
    return Sweep(Parameters(), (preloads, dampings), (FREQUENCY_HZ,), (AMPLITUDE_M,), steps)


def _new_preloads() -> Iterator[float]:
    """Give preloads from 0.1 to 1 N, evenly spread, none of them twice."""
    for i in count():
        yield 0.1 + 0.9 * (i * GOLDEN_RATIO % 1.0)


def _constant(words: str, seconds: Array) -> Verdict:
    medians = np.median(seconds, axis=1)
    return Verdict(words, LINEAR, float(medians.max() / medians.min()), at_most=True)
