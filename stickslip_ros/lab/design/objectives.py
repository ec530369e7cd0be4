# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Six objectives of a wave, each a formula of its steady cycles."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from statistics import mean

from stickslip_ros.arrays import Array
from stickslip_ros.drive.build import friction_limit_n
from stickslip_ros.errors import OutOfRange, UnknownName
from stickslip_ros.lab.design.steady_cycle import CHANGE, SteadyCycle, measure
from stickslip_ros.lab.runs.courses import Course
from stickslip_ros.lab.runs.zero_amplitude import STEP_MIN_M
from stickslip_ros.parameters import Parameters

COST_MAX = 1e9  # cost of a wave without forward motion
RELIABLE_CHANGE = 0.5  # largest relative change of a step by the load
MISSED_SPEED = 4  # exponent of the penalty for a missed speed, above the gain in vibration
PENALTY_MAX = 1.02  # largest penalty of a met constraint
_LOAD_SHARE, _PUSH_SHARE = 0.25, 0.02
"""Shares of the friction limit: load of speed over load, pushes on a step."""

Cycles = Sequence[SteadyCycle]  # steady cycles under the loads of an objective


@dataclass(frozen=True)
class Objective:
    """An objective: the value of a wave, and the conditions of its runs."""

    unit: str  # of the value
    formula: str  # of the value, in words
    value: Callable[[Cycles], float]
    # Loads from the load of the goal and the friction limit, all in N:
    loads: Callable[[float, float], Sequence[float]] = lambda load_n, _: (load_n,)
    is_largest: bool = False  # maximise the value
    is_free: bool = True  # run without load cell
    penalty: Callable[[Cycles], float] = lambda _: 1.0  # above 1 for a missed constraint


def unreliability(cycles: Cycles) -> float:
    """Return the penalty of a step that a load changes by more than half."""
    step_m, *pushed_m = (cycle.step_m for cycle in cycles)
    change = max(abs(pushed - step_m) for pushed in pushed_m) / step_m
    return max(1.0, (change / RELIABLE_CHANGE) ** 2)


def flatness(cycles: Cycles) -> float:
    """Return the range of speeds per mean speed; NaN if the wave stops."""
    speeds = [cycle.speed_m_per_s for cycle in cycles]
    advances = min(cycle.step_m for cycle in cycles) > STEP_MIN_M
    return (max(speeds) - min(speeds)) / mean(speeds) if advances else math.nan


OBJECTIVES: Mapping[str, Objective] = {
    'speed': Objective(
        'm/s',
        '(x(t + T) - x(t)) / T against the load',
        lambda cycles: cycles[0].speed_m_per_s,
        is_largest=True,
    ),
    'force': Objective(
        'N',
        'k (mean of x - mean of x_s)',
        lambda cycles: cycles[0].force_n,
        is_largest=True,
        is_free=False,
    ),
    'step': Objective(
        'm',
        'x(t + T) - x(t), changed by at most half by a load of either sign',
        lambda cycles: cycles[0].step_m,
        lambda load_n, limit_n: [side * (load_n or _PUSH_SHARE * limit_n) for side in (0, 1, -1)],
        penalty=unreliability,
    ),
    'vibration': Objective(
        'm/s',
        "rms of x' - mean of x' over a cycle, at the required speed",
        lambda cycles: cycles[0].vibration_m_per_s,
    ),
    'energy': Objective(
        'J/m',
        'work of the feet in a cycle / (x(t + T) - x(t))',
        lambda cycles: cycles[0].work_j / cycles[0].step_m,
    ),
    'flatness': Objective(
        '',
        '(largest - smallest speed) / mean speed, over four loads from 0 on',
        flatness,
        lambda load_n, limit_n: [(load_n or _LOAD_SHARE * limit_n) * k / 3 for k in range(4)],
    ),
}
"""Objectives by name."""


@dataclass(frozen=True)
class WaveGoal:
    """One of OBJECTIVES, with constraints."""

    objective: str
    load_n: float = 0.0
    """Force against the motion; 0 is the default of the objective, N."""
    speed_m_per_s: float = 0.0
    """Least speed of the wave; 0 is any, m/s."""

    def __post_init__(self) -> None:
        """Refuse contradictory settings."""
        if self.objective not in OBJECTIVES:
            hint = f'known are {", ".join(OBJECTIVES)}'
            raise UnknownName('objective', self.objective, hint)
        if not 0.0 <= self.load_n < math.inf:
            hint = 'it is against the motion, whatever its direction'
            raise OutOfRange('load', self.load_n, 'N', 'not a force from 0 N on', hint)
        if self.load_n and not OBJECTIVES[self.objective].is_free:
            hint = 'the load cell holds the runner; leave the load away'
            raise OutOfRange('load', self.load_n, 'N', 'of no use to this objective', hint)
        speed_m_per_s, needs_speed = self.speed_m_per_s, self.objective == 'vibration'
        hint = 'vibration needs one, speed and force have none, of others it is a constraint'
        if not 0.0 <= speed_m_per_s < math.inf or (needs_speed and not speed_m_per_s):
            raise OutOfRange('speed', speed_m_per_s, 'm/s', 'not a speed above 0 m/s', hint)
        if speed_m_per_s and OBJECTIVES[self.objective].is_largest:
            limit = 'of no use to this objective'
            raise OutOfRange('speed', speed_m_per_s, 'm/s', limit, hint)


@dataclass(frozen=True)
class Worth:
    """The value of a wave on a stand."""

    value: float  # of the objective; NaN without forward motion
    cost: float  # minimised: the value, or its negative, times the penalty
    meets: bool  # whether the constraints are met, to 2 % of the penalty
    cycle: SteadyCycle  # of its first run


def assess(
    goal: WaveGoal, stand: Parameters, rows: Array, change: float = CHANGE
) -> Course[Worth]:
    """Return the worth of a wave on a stand, with the load cell that the goal needs."""
    objective = OBJECTIVES[goal.objective]
    on_stand, cycles = stand.updated(cell_of(goal, stand)), list[SteadyCycle]()
    for load_n in objective.loads(goal.load_n, friction_limit_n(stand)):
        cycles.append((yield from measure(on_stand, rows, load_n, change)))
    advances = objective.is_largest or cycles[0].step_m > STEP_MIN_M
    value = objective.value(cycles) if advances else math.nan
    if not math.isfinite(value):
        return Worth(math.nan, COST_MAX, meets=False, cycle=cycles[0])
    if objective.is_largest:
        return Worth(value, -value, meets=True, cycle=cycles[0])
    too_slow = max(1.0, (goal.speed_m_per_s / cycles[0].speed_m_per_s) ** MISSED_SPEED)
    penalty = objective.penalty(cycles) * too_slow
    return Worth(value, value * penalty, penalty <= PENALTY_MAX, cycles[0])


def cell_of(goal: WaveGoal, stand: Parameters) -> Mapping[str, str | float]:
    """Return the parameters of the load cell that a goal needs."""
    if OBJECTIVES[goal.objective].is_free:
        return {'load_cell.contact': 'absent'}
    if stand.load_cell.contact == 'one_sided':
        return {'load_cell.gap': 0.0}
    return {'load_cell.contact': 'attached'}
