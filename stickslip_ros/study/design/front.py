"""
Two objectives at once: the waves of which none is better in both (the Pareto front).

The ends of the front are the best waves of either objective. Between them a search makes the
larger of two weighted losses small, with a little of their sum, so that no wave is left that is
equal in one and worse in the other: the augmented weighted Tchebycheff norm (Steuer, Choo, Math.
Programming 26, 326, 1983), which also finds fronts that are not convex.

"""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from stickslip_ros.errors import OutOfRange, WrongKind
from stickslip_ros.stopping import Stopped
from stickslip_ros.study.batch import executor_of, run_batch
from stickslip_ros.study.design.answer import RIVAL, Order, check
from stickslip_ros.study.design.objectives import OBJECTIVES, WORTHLESS, Goal
from stickslip_ros.study.design.search import Found, Judge, search
from stickslip_ros.study.design.waves import SPLINE, PeriodicWave, Space
from stickslip_ros.study.journal import Identity, Journal, Row, identify

SHAPES = (RIVAL, SPLINE)
"""What has a front."""
POINTS_MIN, POINTS_MAX = 3, 100
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
        Searches of a front, its ends included.

    """

    first: Order
    second: Goal
    points: int = 7

    def __post_init__(self) -> None:
        """Refuse one objective twice, and fronts that are none."""
        if self.second.objective == self.first.goal.objective:
            hint = f'take another one of {", ".join(OBJECTIVES)}'
            raise WrongKind('second objective', self.second.objective, 'the same again', hint)
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
        Least cost of each, and how far it rises along the front.

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
    A wave and what it is worth.

    Attributes
    ----------
    wave : PeriodicWave
        The wave.
    values, errors : (float, float)
        Values of both objectives, and by how much finer steps and rows, or springs for turning
        points, change them.
    costs : (float, float)
        What a search makes small.

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
        The points of each front by the name of its shape, the best of the first objective first.

    Raises
    ------
    StickSlipError
        If a stand is refused, or a package is missing.
    Stopped
        If Ctrl-C was pressed; the journal has what was finished.

    """
    with executor_of(workers, scheduler) as executor:
        found = _Searches(order, executor, journal, tell)
        waves = {shape: [one.wave for one in found.along_front(shape)] for shape in SHAPES}
        return {
            shape: _undominated(run_batch(partial(_point, order), each, executor=executor))
            for shape, each in waves.items()
        }


class _Searches:
    """The searches of all fronts, whose evaluations are numbered on."""

    def __init__(
        self,
        order: FrontOrder,
        executor: Executor,
        journal: Journal | None,
        tell: Callable[[int], None] | None,
    ) -> None:
        self._order, self._executor = order, executor
        self._journal, self._tell = journal, tell
        self._done = 0

    def along_front(self, shape: str) -> Iterator[Found]:
        """Search both ends, and between them from one end to the other."""
        first, second = (order.tasks[shape] for order in self._order.orders)
        ends = [self._search(task) for task in (first, second)]
        ideal = ends[0].cost, ends[1].cost
        worst = (float(first(ends[1].place)['cost']), float(second(ends[0].place)['cost']))
        ranges = (_range(ideal[0], worst[0]), _range(ideal[1], worst[1]))
        yield from ends
        place = ends[0].place
        for weight in np.linspace(1.0, 0.0, self._order.points)[1:-1]:
            trade_off = TradeOff((first, second), float(weight), ideal, ranges)
            found = self._search(trade_off, place)
            place = found.place
            yield found

    def _search(self, task: Judge, start: Sequence[float] | None = None) -> Found:
        budget, seed, done = self._order.first.budget, self._order.first.seed, self._done

        def tell(evaluations: int, _: float) -> None:
            if self._tell is not None:
                self._tell(done + evaluations)

        found = search(
            task,
            budget,
            seed,
            self._executor,
            journal=self._journal,
            first=done,
            tell=tell,
            start=start,
        )
        self._done += budget.evaluations
        if found.stopped:
            number = done + len(found.history)
            raise Stopped(f'stopped after {number} evaluations; the same command goes on')
        return found


def _range(ideal: float, worst: float) -> float:
    """Return how far a cost rises along a front; its size, where one end is worthless or both."""
    rise = worst - ideal
    return rise if 0.0 < rise < 0.5 * WORTHLESS else abs(ideal)


def _point(order: FrontOrder, wave: PeriodicWave) -> Point:
    (first, first_error), (second, second_error) = (check(one, wave) for one in order.orders)
    errors = first_error, second_error
    return Point(wave, (first.value, second.value), errors, (first.cost, second.cost))


def _undominated(points: Sequence[Point]) -> list[Point]:
    """Return the points that no other one beats, and one of those that are equal."""
    kept: list[Point] = []
    for one in sorted(points, key=lambda point: point.costs):
        if not any(other.beats(one) for other in points) and not any(map(one.equals, kept)):
            kept.append(one)
    return kept
