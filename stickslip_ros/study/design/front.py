"""
Two objectives at once: the waves of which none is better in both (the Pareto front).

Two searches look for the best wave of either objective alone. The others make the larger of two
weighted losses small, with a little of their sum, so that no wave is left that is equal in one and
worse in the other: the augmented weighted Tchebycheff norm (Steuer, Choo, Math. Programming 26,
326, 1983), which also finds fronts that are not convex.

"""

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from stickslip_ros.errors import OutOfRange, StickSlipError
from stickslip_ros.stopping import Stopped
from stickslip_ros.study.batch import executor_of, run_batch
from stickslip_ros.study.design.answer import RIVAL, Order, check
from stickslip_ros.study.design.objectives import OBJECTIVES, WORTHLESS, Goal
from stickslip_ros.study.design.search import Found, Judge, Task, search
from stickslip_ros.study.design.waves import SPLINE, PeriodicWave, Space
from stickslip_ros.study.journal import Identity, Journal, Row, identify

SHAPES = (RIVAL, SPLINE)
"""What has a front."""
POINTS, POINTS_MIN, POINTS_MAX = 7, 3, 100
"""Searches of a front, where nobody says how many, and limits of their number."""
SUM_SHARE = 0.05
"""Share of the sum of both losses that is added to the larger one."""

Pair = tuple[float, float]


@dataclass(frozen=True)
class FrontOrder:
    """
    What two objectives are asked for.

    Attributes
    ----------
    first : Order
        The first objective, with stand, limits, budget of each search and seed.
    second : Goal
        The second objective.
    points : int
        Searches of each front, one for either objective alone included.

    """

    first: Order
    second: Goal
    points: int = POINTS

    def __post_init__(self) -> None:
        """Refuse one objective twice, what a front does not know, and fronts that are none."""
        twice, first = self.second.objective, self.first
        if twice == first.goal.objective:
            hint = f'take another one of {", ".join(OBJECTIVES)}'
            raise OutOfRange('second objective', twice, '', 'the first one too', hint)
        for name, value, unit, usual in (
            ('seconds', first.budget.seconds, 's', 0.0),
            ('number of seeds', first.seeds, '', 1),
        ):
            if value != usual:
                hint = 'the evaluations and one seed make it'
                raise OutOfRange(name, value, unit, 'of no use to two objectives', hint)
        if not POINTS_MIN <= self.points <= POINTS_MAX:
            limit = f'not from {POINTS_MIN} to {POINTS_MAX}'
            raise OutOfRange('number of points', self.points, '', limit, 'change --points')

    @property
    def goals(self) -> tuple[Goal, Goal]:
        """Both objectives."""
        return self.first.goal, self.second

    @property
    def orders(self) -> tuple[Order, Order]:
        """Both objectives, each as an order of its own."""
        return self.first, replace(self.first, goal=self.second)

    @property
    def evaluations(self) -> int:
        """Evaluations in all."""
        return len(SHAPES) * self.points * self.first.budget.evaluations

    def identity(self) -> Identity:
        """Return what a journal must share to belong to it."""
        settings = {
            'first': self.first.identity().digest,
            'second': repr(self.second),
            'points': self.points,
        }
        return identify('front', self.first.stand, self.evaluations, settings)


@dataclass(frozen=True)
class TradeOff:
    """
    What a place costs by two tasks together.

    Attributes
    ----------
    tasks : (Judge, Judge)
        The two; their space is the same.
    weight : float
        That of the first one, between 0 and 1.
    ideal, ranges : (float, float)
        Cost of each from which its loss is counted, and the rise of it that is a loss of 1.

    """

    tasks: tuple[Judge, Judge]
    weight: float
    ideal: Pair
    ranges: Pair

    @property
    def space(self) -> Space:
        """The waves that are tried."""
        return self.tasks[0].space

    def __call__(self, place: Sequence[float]) -> Row:
        """Return the cost of a place, as a row that a journal keeps."""
        costs = np.array([float(task(place)['cost']) for task in self.tasks])
        if costs.max() >= WORTHLESS:
            return {'cost': WORTHLESS}
        losses = (costs - self.ideal) / self.ranges
        larger = float(np.max(losses * (self.weight, 1.0 - self.weight)))
        return {'cost': larger + SUM_SHARE * float(losses.sum())}


@dataclass(frozen=True)
class Point:
    """
    A wave that keeps the constraints of both objectives.

    Attributes
    ----------
    wave : PeriodicWave
        The wave.
    values, errors : (float, float)
        Values of both objectives on the stand, and by how much finer steps and rows, or springs
        for turning points, change them.
    costs : (float, float)
        What a search makes small, of all stands together.

    """

    wave: PeriodicWave
    values: Pair
    errors: Pair
    costs: Pair

    def beats(self, other: 'Point') -> bool:
        """Return whether it is better in one objective and not worse in the other."""
        no_worse = all(a <= b for a, b in zip(self.costs, other.costs, strict=True))
        return no_worse and self.costs != other.costs

    def equals(self, other: 'Point') -> bool:
        """Return whether no value differs from that of the other by more than both errors."""
        both = zip(self.values, other.values, self.errors, other.errors, strict=True)
        return all(abs(a - b) <= a_error + b_error for a, b, a_error, b_error in both)


def find_fronts(
    order: FrontOrder,
    *,
    journal: Journal | None = None,
    workers: int = 0,
    scheduler: str = '',
    tell: Callable[[int], None] | None = None,
) -> dict[str, list[Point]]:
    """
    Search the fronts of saw-tooth and spline, and check every wave of them.

    Parameters
    ----------
    order : FrontOrder
        What is to be found.
    journal : Journal, optional
        Of ``order.identity()``; keeps every evaluation.
    workers, scheduler
        Those of ``run_batch``.
    tell : callable, optional
        Called with the number of evaluations.

    Returns
    -------
    dict
        The front of each shape that has one, by its name, the best of the first objective first.

    Raises
    ------
    StickSlipError
        If a stand is refused, a package is missing, or no wave was found that moves the runner
        and keeps the constraints.
    Stopped
        If Ctrl-C was pressed; the journal has what was finished.

    """
    with executor_of(workers, scheduler) as executor:
        searches = _Searches(order, executor, journal, tell)
        try:
            fronts = {shape: searches.front(shape) for shape in SHAPES}
        except Stopped as stop:
            said = f'stopped after {searches.evaluations} evaluations'
            raise Stopped(f'{said}; the same command goes on' if journal else said) from stop
    found = {shape: points for shape, points in fronts.items() if points}
    if not found:
        raise StickSlipError(
            'no wave was found that moves the runner and keeps the constraints of both '
            'objectives; ask for less, or give more evaluations'
        )
    return found


class _Searches:
    """The searches of all fronts, whose evaluations are numbered on."""

    def __init__(
        self,
        order: FrontOrder,
        executor: Executor,
        journal: Journal | None,
        tell: Callable[[int], None] | None,
    ) -> None:
        self.evaluations = 0
        self._order, self._executor = order, executor
        self._journal, self._tell = journal, tell

    def front(self, shape: str) -> list[Point]:
        """Search for either objective alone, then with weights from the first to the second."""
        first, second = (order.tasks[shape] for order in self._order.orders)
        found, tasks = [self._search(first), self._search(second)], (first, second)
        costs = self._run(partial(_costs, tasks), [one.place for one in found])
        ideal, worst = np.min(costs, axis=0), np.max(costs, axis=0)
        ranges = _range(ideal[0], worst[0]), _range(ideal[1], worst[1])
        place = found[0].place
        for weight in np.linspace(1.0, 0.0, self._order.points)[1:-1]:
            trade_off = TradeOff(tasks, float(weight), (ideal[0], ideal[1]), ranges)
            found.append(self._search(trade_off, place))
            place = found[-1].place
        points = self._run(partial(_point, self._order, tasks), found)
        return _undominated([point for point in points if point is not None])

    def _run(self, task: Callable[[Any], Any], cases: Sequence[Any]) -> list[Any]:
        return run_batch(task, cases, executor=self._executor)

    def _search(self, task: Judge, start: Sequence[float] | None = None) -> Found:
        first, done = self._order.first, self.evaluations

        def tell(evaluations: int, _: float) -> None:
            if self._tell is not None:
                self._tell(done + evaluations)

        found = search(
            task,
            first.budget,
            first.seed,
            self._executor,
            journal=self._journal,
            first=done,
            tell=tell,
            start=start,
        )
        self.evaluations = done + len(found.history)
        if found.stopped:
            raise Stopped
        return found


def _range(ideal: float, worst: float) -> float:
    """Return the rise of a cost that is a loss of 1: what the other end costs, or its size."""
    rise = float(worst - ideal)
    return rise if 0.0 < rise < 0.5 * WORTHLESS else abs(float(ideal))


def _costs(tasks: tuple[Task, Task], place: Sequence[float]) -> Pair:
    first, second = (float(task(place)['cost']) for task in tasks)
    return first, second


def _point(order: FrontOrder, tasks: tuple[Task, Task], found: Found) -> Point | None:
    """Return what a search has found; None of a wave that does not do what it shall."""
    (first, first_error), (second, second_error) = (check(one, found.wave) for one in order.orders)
    errors, costs = (first_error, second_error), _costs(tasks, found.place)
    is_good = first.meets and second.meets and np.isfinite(errors).all()
    if not is_good or max(costs) >= WORTHLESS:
        return None
    return Point(found.wave, (first.value, second.value), errors, costs)


def _undominated(points: Sequence[Point]) -> list[Point]:
    """Return the points that no other one beats, and one of those that are equal."""
    kept: list[Point] = []
    for one in sorted(points, key=lambda point: point.costs):
        if not any(other.beats(one) for other in points) and not any(map(one.equals, kept)):
            kept.append(one)
    return kept
