# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A preload that changes within a step: the study of docs/studies/normal_motion.md."""

import os
from concurrent.futures import ThreadPoolExecutor
from itertools import product

import pandas as pd

from stickslip_ros import Bench, Parameters, Request

FULL = os.environ.get('STUDIES') == 'full'  # make studies
CYCLES, STAIRS = (200, 50) if FULL else (60, 5)
PERIOD_NS = 1_000_000  # 1 kHz
PRELOADS_N, SHARES = (
    ((0.1, 0.5, 1.0), (-0.2, -0.05, 0.0, 0.05, 0.2)) if FULL else ((0.1,), (-0.2, 0.0, 0.2))
)
KINDS = {'force (mN)': 'attached', 'free step (nm)': 'absent'}


def last_cycles(preload_n, share, load_cell):
    """Drive over 160 nm; return the force of the last cycle, mN, and the last ten steps, nm."""
    changes = {
        'stand.preload': preload_n,
        'stand.preload_rate': 1e4,
        'load_cell.contact': load_cell,
    }
    bench = Bench(Parameters().updated(changes))
    requests = [Request('sawtooth', (300.0, 1000.0, 0.0))]
    ramps = []  # position after the fall, mean and final position of each step, m
    for _ in range(CYCLES):
        for stair in range(STAIRS):
            now_n = preload_n * (1 + share * ((stair + 0.5) / STAIRS - 0.5))
            output = bench.update(
                bench.time_ns + PERIOD_NS // STAIRS, [*requests, Request('preload', (now_n,))]
            )
            requests = []
            ramps.extend(output.ramps)
    return 1e3 * bench.parameters.load_cell.stiffness * ramps[-1][1], 1e8 * (
        ramps[-1][2] - ramps[-11][2]
    )


def changes():
    """Return force and step for each preload and change, and their differences from no change."""
    cases = list(product(PRELOADS_N, SHARES, KINDS.values()))
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        found = dict(zip(cases, pool.map(lambda case: last_cycles(*case), cases), strict=True))
    table = pd.DataFrame(
        [
            {'preload (N)': n, 'change over the stroke': share}
            | {
                name: found[n, share, kind][number]
                for number, (name, kind) in enumerate(KINDS.items())
            }
            for n, share in product(PRELOADS_N, SHARES)
        ]
    )
    still = table[table['change over the stroke'] == 0].set_index('preload (N)')
    for name in KINDS:
        table[f'{name[:-5]}, change (%)'] = 100 * (
            table[name] / table['preload (N)'].map(still[name]) - 1
        )
    return table
