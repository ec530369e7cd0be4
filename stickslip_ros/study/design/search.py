"""
The search for the wave that does best: CMA-ES, generation by generation.

The same seed asks for the same places whatever computes them, so what a journal holds is not
computed again, and an interrupted search goes on as if it had not been.

"""

import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from stickslip_ros.contact.profile import Array
from stickslip_ros.errors import OutOfRange, UnknownName
from stickslip_ros.parameters import Parameters
from stickslip_ros.study.batch import Interrupted, run_batch
from stickslip_ros.study.design.objectives import WORTHLESS, Goal, assess
from stickslip_ros.study.design.waves import PeriodicWave, Space
from stickslip_ros.study.extras import load_extra
from stickslip_ros.study.journal import Journal, Row

PURPOSE = 'the search for a wave'
SPREAD = 0.3
"""Standard deviation of the first generation, in the unit cube."""
MARGIN = 0.02
"""Distance of the first place from the walls of the cube."""
EVALUATIONS_MAX = 1_000_000
RULES: dict[str, Callable[[Sequence[float]], float]] = {
    'mean': lambda costs: float(np.mean(costs)),
    'worst': max,
}
"""What several stands have to say about a wave."""
Tell = Callable[[int, float], None]
"""Receives the number of evaluations and the least cost so far."""


@dataclass(frozen=True)
class Budget:
    """Evaluations of a search, and seconds after which it asks for no other generation."""

    evaluations: int = 1000
    seconds: float = 0.0

    def __post_init__(self) -> None:
        """Refuse budgets that are none."""
        if not 1 <= self.evaluations <= EVALUATIONS_MAX:
            limit = f'not from 1 to {EVALUATIONS_MAX}'
            hint = 'a spline wants some hundred'
            raise OutOfRange('number of evaluations', self.evaluations, '', limit, hint)
        if not 0.0 <= self.seconds < float('inf'):
            raise OutOfRange('seconds', self.seconds, 's', 'not a time', '0 is without limit')


@dataclass(frozen=True)
class Found:
    """
    What a search has found.

    Attributes
    ----------
    wave : PeriodicWave
        The best one.
    place : list of float
        Where it lies in its space.
    cost : float
        Its cost.
    history : list of float
        Least cost after each evaluation.
    stopped : bool
        Whether Ctrl-C ended it before its budget.

    """

    wave: PeriodicWave
    place: list[float]
    cost: float
    history: list[float]
    stopped: bool = False


class Judge(Protocol):
    """What says of the places of a space what they cost."""

    @property
    def space(self) -> Space:
        """The waves that are tried."""

    def __call__(self, place: Sequence[float]) -> Row:
        """Return the cost of a place, as a row that a journal keeps."""


@dataclass(frozen=True)
class Task:
    """What a place of a space costs: by one stand, or by a rule for several."""

    space: Space
    goal: Goal
    stands: tuple[Parameters, ...]
    rule: str = 'mean'

    def __post_init__(self) -> None:
        """Refuse rules that nobody knows."""
        if self.rule not in RULES:
            raise UnknownName('rule', self.rule, f'known are {", ".join(RULES)}')

    def __call__(self, place: Sequence[float]) -> Row:
        """Return the cost of a place, as a row that a journal keeps."""
        wave = self.space.wave(place)
        rows = wave.rows(self.space.stand, backwards=self.goal.backwards)
        costs = [assess(self.goal, wave.under(stand), rows).cost for stand in self.stands]
        return {'cost': RULES[self.rule](costs)}


class _Evaluations:
    """Costs of one generation after the other, from the journal where it has them."""

    def __init__(
        self, task: Judge, budget: Budget, executor: Executor, journal: Journal | None, first: int
    ) -> None:
        self.history: list[float] = []
        self.place: Array = task.space.start
        self.cost = WORTHLESS
        self._task, self._executor = task, executor
        self._journal, self._first = journal, first
        self._most = budget.evaluations
        self._end_s = time.monotonic() + budget.seconds if budget.seconds else float('inf')

    @property
    def may_go_on(self) -> bool:
        """Whether the budget has something left."""
        return len(self.history) < self._most and time.monotonic() < self._end_s

    def costs(self, places: Sequence[Array]) -> list[float]:
        """Return the costs of places; those beyond the budget are not computed, and worthless."""
        first = self._first + len(self.history)
        places = places[: self._most - len(self.history)]
        known = self._journal.rows if self._journal else {}
        todo = [number for number in range(len(places)) if first + number not in known]
        rows = {n: known[first + n] for n in range(len(places)) if n not in todo}
        try:
            cases = [places[number].tolist() for number in todo]
            done = enumerate(run_batch(self._task, cases, executor=self._executor))
            rows |= {todo[number]: row for number, row in done}
        except Interrupted as interrupted:
            rows |= {todo[number]: row for number, row in interrupted.rows.items()}
            raise
        finally:
            for number in sorted(rows):
                self._keep(first + number, places[number], rows[number], number in todo)
        return [float(rows[number]['cost']) for number in range(len(places))]

    def _keep(self, index: int, place: Array, row: Row, is_new: bool) -> None:
        if is_new and self._journal:
            self._journal.append(index, row)
        cost = float(row['cost'])
        if cost < self.cost:
            self.cost, self.place = cost, place
        self.history.append(self.cost)


def search(
    task: Judge,
    budget: Budget,
    seed: int,
    executor: Executor,
    *,
    journal: Journal | None = None,
    first: int = 0,
    tell: Tell | None = None,
    start: Sequence[float] | None = None,
) -> Found:
    """
    Look for the wave of least cost, from the start of a space on.

    Parameters
    ----------
    task : Judge
        What is searched, and what a place of it costs.
    budget : Budget
        When to end. The same evaluations and seed give the same wave; seconds do not.
    seed : int
        Of the random numbers.
    executor : Executor
        Of ``executor_of``.
    journal : Journal, optional
        Holds evaluations, numbered from ``first`` on.
    tell : callable, optional
        Called after each generation.
    start : sequence of float, optional
        Place to begin at; by default that of the space.

    Raises
    ------
    MissingExtra
        If the package ``cma`` is not installed.

    """
    evaluations = _Evaluations(task, budget, executor, journal, first)
    begin = task.space.start if start is None else np.array(start)
    stopped = False
    try:
        for _ in _generations(evaluations, begin, seed):
            if tell is not None:
                tell(len(evaluations.history), evaluations.cost)
    except Interrupted:
        stopped = True
    wave = task.space.wave(evaluations.place)
    return Found(wave, evaluations.place.tolist(), evaluations.cost, evaluations.history, stopped)


def _generations(evaluations: _Evaluations, start: Array, seed: int) -> Iterator[None]:
    """Evaluate the start, then generation by generation; from anew where CMA-ES has converged."""
    cma = load_extra(PURPOSE, 'cma')
    rng = np.random.default_rng(seed)
    evaluations.costs([start])
    yield
    if len(start) == 1:  # CMA-ES wants two dimensions: a space ignores the second one
        start = np.append(start, 0.5)
    population, place = 4 + int(3.0 * np.log(len(start))), start
    while True:
        strategy = cma.CMAEvolutionStrategy(
            np.clip(place, MARGIN, 1.0 - MARGIN),
            SPREAD,
            {
                'bounds': [0.0, 1.0],
                'popsize': population,
                'randn': lambda *shape: rng.standard_normal(shape),
                'seed': np.nan,
                'verbose': -9,
            },
        )
        while not strategy.stop():
            if not evaluations.may_go_on:
                return
            asked = strategy.ask()
            costs = evaluations.costs(asked)
            if len(costs) == len(asked):
                strategy.tell(asked, costs)
            yield
        place, population = rng.random(len(start)), 2 * population
