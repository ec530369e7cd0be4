"""The search for a wave: evaluations per second, and what a second worker gains."""

from collections.abc import Mapping
from functools import partial

import numpy as np

from benchmarks.clock import Program, in_turn
from benchmarks.outcome import Outcome, Row
from benchmarks.sizes import Sizes
from stickslip_ros.design.objectives import WaveGoal
from stickslip_ros.design.search import WaveSearch, evaluations
from stickslip_ros.parameters import Parameters
from stickslip_ros.runs.batch import Pool, pool_of

RINGS: Mapping[str, object] = {'actuator.resonance': 150e3, 'actuator.damping_ratio': 0.1}
CASES: tuple[tuple[str, Mapping[str, object]], ...] = (
    ('force', {}),
    ('speed', {}),
    ('step', {}),
    ('speed', RINGS),
)


def _tried(search: WaveSearch, pool: Pool) -> list[object]:
    return list(evaluations(search, [(space, 0) for space in search.spaces.values()], pool))


def run(sizes: Sizes) -> Outcome:
    """Search with one worker and with two, in turns."""
    rows: list[Row] = []
    for objective, changes in CASES:
        stand = Parameters().updated(changes)
        search = WaveSearch(
            WaveGoal(objective), stand, (1000.0, 1000.0), (0.5, 0.5), evaluations=sizes.evaluations
        )
        with pool_of(1) as one, pool_of(2) as two:
            programs = [
                Program(partial(_tried, search, workers), search.total) for workers in (one, two)
            ]
            times = in_turn(programs, sizes)
        efficiency = 0.5 * times.ratios(0, 1)
        rows.append(
            {
                'objective': objective,
                'piezo': 'rings at 150 kHz' if changes else 'massless',
                'one_worker_per_s': 1.0 / times.median(0),
                'two_workers_per_s': 1.0 / times.median(1),
                'efficiency': float(np.median(efficiency)),
                'lowest': float(efficiency.min()),
                'highest': float(efficiency.max()),
            }
        )
    return Outcome(
        'Evaluations of a search for a wave',
        rows,
        notes=[
            f'0.5 N, 1 kHz, {sizes.evaluations} evaluations of each shape; splines of 8 knots',
            'efficiency of two workers, which wait for each other after a generation of all',
        ],
    )
