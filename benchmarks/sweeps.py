# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Sweeps on one thread against the drive alone."""

from collections.abc import Iterable

import numpy as np

from benchmarks.case import AMPLITUDE_M, FREQUENCY_HZ, Ours, standard_case
from benchmarks.clock import Program, in_turn
from benchmarks.outcome import Outcome, Row, spread
from benchmarks.sizes import Sizes
from stickslip_ros.lab.runs.sweep import Axis, Sweep, run_sweep
from stickslip_ros.parameters import Parameters

CASES = 64
SHARING = 8
"""Cases of a sweep that have the same preload."""


def run(sizes: Sizes) -> Outcome:
    """Compare."""
    drives = [
        Ours(standard_case(dict(case.values)), sizes.cycles)
        for case in _sweep(np.linspace(0.1, 1.0, CASES), 1, sizes.cycles).cases()
    ]
    programs = [Program(lambda: [drive() for drive in drives], CASES)]
    names = {1: 'a new preload for every case', SHARING: f'one for every {SHARING} cases'}
    random = np.random.default_rng(1)
    for sharing in names:

        def sweep(sharing: int = sharing) -> object:
            new_n = random.uniform(0.1, 1.0, CASES // sharing)
            return run_sweep(_sweep(new_n, sharing, sizes.cycles), workers=1)

        programs.append(Program(sweep, CASES))
    cpu_s = in_turn(programs, sizes).cpu_seconds
    rows: list[Row] = []
    for name, whole_s in zip(names.values(), cpu_s[1:], strict=True):
        case_ms = float(np.median(whole_s)) * 1e3
        ratios = spread('ratio', whole_s / cpu_s[0], 'ratio_low', 'ratio_high')
        rows.append({'sweep': name, 'cpu_ms_per_case': case_ms, **ratios})
    return Outcome(
        f'Sweeps of {CASES} cases of {sizes.cycles} steps',
        rows,
        [
            'processor time; ratio: to drive.advance alone, over as many cycles at such preloads',
            'new preloads in every turn, so that no set-up is kept',
        ],
    )


def _sweep(preloads_n: Iterable[float], sharing: int, steps: int) -> Sweep:
    """Return so many preloads, each with several dampings, at one stroke."""
    preloads = Axis('stand.preload', tuple(map(float, preloads_n)))
    dampings = Axis('runner.damping', tuple(float(i) for i in range(sharing)))
    return Sweep(Parameters(), (preloads, dampings), (FREQUENCY_HZ,), (AMPLITUDE_M,), steps)
