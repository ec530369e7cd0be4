"""What a wave is worth: six objectives, each a formula of its steady cycles."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from statistics import mean
from typing import Any

from stickslip_ros.contact.profile import Array
from stickslip_ros.drive.build import friction_limit_n
from stickslip_ros.errors import OutOfRange, UnknownName
from stickslip_ros.parameters import Parameters
from stickslip_ros.study.design.steady_cycle import CHANGE, SteadyCycle, measure
from stickslip_ros.study.zero_amplitude import STEP_MIN_M

WORTHLESS = 1e9
"""Cost of a wave that does not move the runner forwards."""
RELIABLE_CHANGE = 0.5
"""Share by which the load may change a reliable step."""
MISSED_SPEED = 4
"""Power with which a missed speed counts: more than a vibration gains by it."""
PENALTY_MAX = 1.02
"""Penalty up to which a constraint is met."""
LOAD_SHARE, PUSH_SHARE = 0.25, 0.02
"""Shares of the friction limit: the load of a speed over load, the pushes that a step stands."""
LOADS = 4
"""Loads at which a speed over load is looked at."""


@dataclass(frozen=True)
class Goal:
    """
    What a wave shall do best.

    Attributes
    ----------
    objective : str
        One of OBJECTIVES.
    load_n : float
        Load against the motion, N; 0 takes what the objective says.
    speed_m_per_s : float
        Speed that is asked for, m/s; for least vibration.
    backwards : bool
        Whether the runner shall go the other way.

    """

    objective: str
    load_n: float = 0.0
    speed_m_per_s: float = 0.0
    backwards: bool = False

    def __post_init__(self) -> None:
        """Refuse what cannot be meant."""
        if self.objective not in OBJECTIVES:
            hint = f'known are {", ".join(OBJECTIVES)}'
            raise UnknownName('objective', self.objective, hint)
        if not 0.0 <= self.load_n < math.inf:
            hint = 'it is against the motion, whatever its direction'
            raise OutOfRange('load', self.load_n, 'N', 'not a force from 0 N on', hint)
        needs_speed = self.objective == 'vibration'
        if not (0.0 < self.speed_m_per_s < math.inf if needs_speed else self.speed_m_per_s == 0.0):
            limit = 'not a speed above 0 m/s' if needs_speed else 'of no use to this objective'
            hint = 'the objective vibration needs one, the others have none'
            raise OutOfRange('speed', self.speed_m_per_s, 'm/s', limit, hint)


@dataclass(frozen=True)
class Objective:
    """
    A kind of goal.

    Attributes
    ----------
    unit : str
        Of its value.
    is_largest : bool
        Whether the largest value is the best.
    is_free : bool
        Whether the runner is free of the load cell.
    loads : callable
        From goal and friction limit (N) to the loads of its runs, N, against the motion.
    value : callable
        From the steady cycles of these runs; nan of a wave that does not go forwards.
    formula : str
        The value in words.
    penalty : callable
        From the goal and the cycles to a factor, 1 of a wave that meets the constraint.

    """

    unit: str
    is_largest: bool
    is_free: bool
    loads: Callable[[Goal, float], tuple[float, ...]]
    value: Callable[[Sequence[SteadyCycle]], float]
    formula: str
    penalty: Callable[[Goal, Sequence[SteadyCycle]], float] = lambda _, __: 1.0


@dataclass(frozen=True)
class Worth:
    """
    What a wave is worth.

    Attributes
    ----------
    value : float
        Of the objective; nan of a wave that does not go forwards.
    cost : float
        What a search makes small: the value, or its negative, times the penalty.
    meets : bool
        Whether it meets the constraint of its goal, to 1 %.
    cycle : SteadyCycle
        That of its first run.

    """

    value: float
    cost: float
    meets: bool
    cycle: SteadyCycle


def assess(
    goal: Goal,
    stand: Parameters,
    rows: Array,
    *,
    change: float = CHANGE,
    on_springs: bool = False,
    looks: bool = False,
) -> Worth:
    """
    Say what a wave is worth on a stand.

    Parameters
    ----------
    goal : Goal
        What it shall do.
    stand : Parameters
        The stand; the load cell is fixed, taken away or, if one-sided, touched, as the goal wants.
    rows : array, shape (n, 2)
        One cycle: time (s) and voltage (V).
    change, on_springs, looks
        Those of ``measure``.

    """
    objective = OBJECTIVES[goal.objective]
    sign = -1.0 if goal.backwards else 1.0
    on_stand = stand.updated(cell_of(goal, stand))
    how: dict[str, Any] = {'change': change, 'on_springs': on_springs, 'looks': looks}
    cycles = [
        _turned(measure(on_stand, rows, -sign * load_n, **how), sign)
        for load_n in objective.loads(goal, friction_limit_n(stand))
    ]
    value = objective.value(cycles)
    if not math.isfinite(value):
        return Worth(math.nan, WORTHLESS, meets=False, cycle=cycles[0])
    penalty = objective.penalty(goal, cycles)
    cost = -value if objective.is_largest else value * penalty
    return Worth(value, cost, penalty <= PENALTY_MAX, cycles[0])


def _turned(cycle: SteadyCycle, sign: float) -> SteadyCycle:
    """Return a cycle whose speed and force count in the direction of the goal."""
    return replace(cycle, speed_m_per_s=sign * cycle.speed_m_per_s, force_n=sign * cycle.force_n)


def cell_of(goal: Goal, stand: Parameters) -> Mapping[str, str | float]:
    """Return the load cell that a goal wants of a stand, as parameters."""
    if OBJECTIVES[goal.objective].is_free:
        return {'load_cell.contact': 'absent'}
    if stand.load_cell.contact == 'one_sided' and not goal.backwards:
        return {'load_cell.gap': 0.0}
    return {'load_cell.contact': 'attached'}


def _if_forwards(cycles: Sequence[SteadyCycle], value: float) -> float:
    """Return a value of a runner that makes net steps in every run, else nan."""
    return value if min(cycle.step_m for cycle in cycles) > STEP_MIN_M else math.nan


def _step(cycles: Sequence[SteadyCycle]) -> float:
    return _if_forwards(cycles[:1], cycles[0].step_m)


def _unreliable(_: Goal, cycles: Sequence[SteadyCycle]) -> float:
    step_m, *pushed_m = (cycle.step_m for cycle in cycles)
    change = max(abs(pushed - step_m) for pushed in pushed_m) / step_m
    return max(1.0, (change / RELIABLE_CHANGE) ** 2)


def _vibration(cycles: Sequence[SteadyCycle]) -> float:
    return _if_forwards(cycles, cycles[0].vibration_m_per_s)


def _too_slow(goal: Goal, cycles: Sequence[SteadyCycle]) -> float:
    return max(1.0, (goal.speed_m_per_s / cycles[0].speed_m_per_s) ** MISSED_SPEED)


def _energy(cycles: Sequence[SteadyCycle]) -> float:
    return _if_forwards(cycles, cycles[0].work_j / (cycles[0].step_m or math.nan))


def _flatness(cycles: Sequence[SteadyCycle]) -> float:
    speeds = [cycle.speed_m_per_s for cycle in cycles]
    return _if_forwards(cycles, (max(speeds) - min(speeds)) / (mean(speeds) or math.nan))


def _loads_up_to(goal: Goal, limit_n: float) -> tuple[float, ...]:
    load_n = goal.load_n or LOAD_SHARE * limit_n
    return tuple(load_n * share / (LOADS - 1) for share in range(LOADS))


def _pushes(goal: Goal, limit_n: float) -> tuple[float, ...]:
    push_n = goal.load_n or PUSH_SHARE * limit_n
    return 0.0, push_n, -push_n


OBJECTIVES: Mapping[str, Objective] = {
    'speed': Objective(
        unit='m/s',
        is_largest=True,
        is_free=True,
        loads=lambda goal, _: (goal.load_n,),
        value=lambda cycles: cycles[0].speed_m_per_s,
        formula='(x(t + T) - x(t)) / T against the load',
    ),
    'force': Objective(
        unit='N',
        is_largest=True,
        is_free=False,
        loads=lambda _, __: (0.0,),
        value=lambda cycles: cycles[0].force_n,
        formula='k (mean of x - mean of x_s)',
    ),
    'step': Objective(
        unit='m',
        is_largest=False,
        is_free=True,
        loads=_pushes,
        value=_step,
        formula='x(t + T) - x(t), of which a load of either sign changes no more than half',
        penalty=_unreliable,
    ),
    'vibration': Objective(
        unit='m/s',
        is_largest=False,
        is_free=True,
        loads=lambda goal, _: (goal.load_n,),
        value=_vibration,
        formula="rms of x' - mean of x' over a cycle, of a wave that is fast enough",
        penalty=_too_slow,
    ),
    'energy': Objective(
        unit='J/m',
        is_largest=False,
        is_free=True,
        loads=lambda goal, _: (goal.load_n,),
        value=_energy,
        formula='work of the feet in a cycle / (x(t + T) - x(t))',
    ),
    'flatness': Objective(
        unit='',
        is_largest=False,
        is_free=True,
        loads=_loads_up_to,
        value=_flatness,
        formula='(largest - smallest speed) / mean speed, over four loads from 0 on',
    ),
}
"""Objectives by name."""
