# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The search for a wave: evaluations per second, and what a second worker gains."""

from functools import partial

import numpy as np

from benchmarks.clock import Program, in_turn
from benchmarks.outcome import Outcome
from benchmarks.sizes import Sizes
from stickslip_ros.lab.design.objectives import WaveGoal
from stickslip_ros.lab.design.search import WaveSearch, evaluations
from stickslip_ros.lab.runs.batch import Pool, pool_of
from stickslip_ros.parameters import Parameters


def run(sizes: Sizes) -> Outcome:
    """Search with one worker and with two, in turns."""
    goal, limits = WaveGoal('force'), ((1000.0, 1000.0), (0.5, 0.5))
    search = WaveSearch(goal, Parameters(), *limits, evaluations=sizes.evaluations)

    def tried(pool: Pool) -> list[object]:
        return list(evaluations(search, search.spaces, pool))

    with pool_of(1) as one, pool_of(2) as two:
        programs = [Program(partial(tried, workers), search.total) for workers in (one, two)]
        times = in_turn(programs, sizes)
    efficiency = 0.5 * times.ratios(0, 1)
    return Outcome(
        'Evaluations of a search for a wave',
        [
            {
                'objective': goal.objective,
                'one_worker_per_s': 1.0 / times.median(0),
                'two_workers_per_s': 1.0 / times.median(1),
                'efficiency': float(np.median(efficiency)),
                'lowest': float(efficiency.min()),
                'highest': float(efficiency.max()),
            }
        ],
        notes=[
            f'0.5 N, 1 kHz, {sizes.evaluations} evaluations of each shape; splines of 8 knots',
            'efficiency of two workers, which wait for each other after a generation of all',
        ],
    )
