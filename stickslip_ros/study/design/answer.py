"""
The answer: the best wave beside the saw-tooth and every named shape at the same limits.

Each shape is searched as long as the spline, in its own parameters. Whether a gain counts is
decided against the error of the integration, and on seeds and stands that no search has seen.

"""

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from stickslip_ros.errors import OutOfRange
from stickslip_ros.parameters import Parameters
from stickslip_ros.study.batch import Interrupted, executor_of, run_batch
from stickslip_ros.study.design.objectives import OBJECTIVES, WORTHLESS, Goal, Worth, assess
from stickslip_ros.study.design.search import Budget, Found, Task, Tell, search
from stickslip_ros.study.design.shapes import CURVE_ROWS, SHAPES
from stickslip_ros.study.design.steady_cycle import CHANGE
from stickslip_ros.study.design.waves import SPLINE, PeriodicWave, Space
from stickslip_ros.study.journal import Identity, Journal, identify

RIVAL = 'sawtooth'
"""The shape against which a gain is counted."""
PLAIN = 'sawtooth, plain'
FINER, STEADIER = 4, 10.0
"""Factors of steps and rows, and of the steady state, in a check."""
ERRORS, GAIN = 5.0, 0.02
"""A gain counts above so many errors, and above this share."""
UNSEEN_SEED = 1000
"""Added to the seed of the stands that no search has seen."""
UNSEEN, UNSEEN_SPREAD = 4, 0.15
"""How many of them differ in friction, roughness and mass, and by up to which share."""
DAMPINGS_N_S_PER_M = (5.0, 20.0)
"""Damping that others of them have besides, N s/m."""
LINES = (101, 201)
"""Seeds of the rough lines of others."""


@dataclass(frozen=True)
class Order:
    """
    What is to be found, and how long to look.

    Attributes
    ----------
    goal : Goal
        Objective, load, speed, direction.
    stand : Parameters
        The stand, which gives the limits of amplifier and piezo.
    frequencies_hz, preloads_n, knots
        Those of ``Space``.
    budget : Budget
        Of each search.
    seed, seeds : int
        First seed, and with how many of them each search is repeated.
    stands, spread, rule : int, float, str
        Number of stands that judge a wave, how far they differ, and how their costs become one.

    """

    goal: Goal
    stand: Parameters
    frequencies_hz: tuple[float, float]
    preloads_n: tuple[float, float]
    knots: int = 8
    budget: Budget = field(default_factory=Budget)
    seed: int = 0
    seeds: int = 1
    stands: int = 1
    spread: float = UNSEEN_SPREAD
    rule: str = 'mean'

    def __post_init__(self) -> None:
        """Refuse numbers of nothing."""
        for name, value, most in (('seeds', self.seeds, 100), ('stands', self.stands, 1000)):
            if not 1 <= value <= most:
                limit = f'not from 1 to {most}'
                raise OutOfRange(f'number of {name}', value, '', limit, 'change it')
        if not 0.0 <= self.spread <= 0.5:
            raise OutOfRange('spread', self.spread, '', 'not from 0 to 0.5', 'it is a share')
        if self.seed < 0:
            raise OutOfRange('seed', self.seed, '', 'below 0', 'take a natural number')

    @property
    def tasks(self) -> dict[str, Task]:
        """What each shape is searched for."""
        stands = tuple(spread_stands(self.stand, self.stands, self.spread, self.seed))
        return {
            shape: Task(
                Space(shape, self.stand, self.frequencies_hz, self.preloads_n, self.knots),
                self.goal,
                stands,
                self.rule,
            )
            for shape in (*SHAPES, SPLINE)
        }

    @property
    def evaluations(self) -> int:
        """Evaluations in all."""
        return (len(SHAPES) + 1) * self.seeds * self.budget.evaluations

    def identity(self) -> Identity:
        """Return what a journal must share to belong to it."""
        settings = {
            name: value if isinstance(value, int | float | str | tuple) else repr(value)
            for name, value in vars(self).items()
            if name != 'stand'
        }
        return identify('optimise', self.stand, self.evaluations, settings)


@dataclass(frozen=True)
class Entry:
    """
    A shape at its best.

    Attributes
    ----------
    wave : PeriodicWave
        Its best wave.
    value : float
        Value of the objective; nan if it does not move the runner forwards.
    error : float
        By how much finer steps and rows, or springs for turning points, change it.
    meets : bool
        Whether it meets the constraint of the goal.
    costs : tuple of float
        Least cost that each seed has found.
    history : list of float
        Least cost after each evaluation, of the best seed.

    """

    wave: PeriodicWave
    value: float
    error: float
    meets: bool
    costs: tuple[float, ...]
    history: list[float]


@dataclass(frozen=True)
class Answer:
    """
    What the searches have found.

    Attributes
    ----------
    order : Order
        What was asked for.
    entries : mapping
        Shapes at their best, by name; PLAIN is the saw-tooth at full voltage and the highest
        frequency.
    unseen : mapping
        Gain on each stand that no search has seen, by what is different there.
    stopped : bool
        Whether Ctrl-C ended the searches; then nothing is checked.

    """

    order: Order
    entries: Mapping[str, Entry]
    unseen: Mapping[str, float]
    stopped: bool = False

    @property
    def best(self) -> str:
        """Name of the shape of least cost."""
        return min(self.entries, key=lambda name: min(self.entries[name].costs))

    @property
    def gain(self) -> float:
        """Share by which the best wave is better than the saw-tooth at its best."""
        return self.gain_of(self.best)

    def gain_of(self, name: str) -> float:
        """Return the share by which a shape is better than the saw-tooth at its best."""
        return gain_over(self.order.goal, self.entries[name].value, self.entries[RIVAL].value)

    @property
    def errors(self) -> float:
        """The gain as a multiple of the error of the integration, of both waves together."""
        best, rival = self.entries[self.best], self.entries[RIVAL]
        if best.wave == rival.wave:
            return 0.0
        error = best.error + rival.error
        return abs(best.value - rival.value) / error if error else float('inf')

    @property
    def counts(self) -> bool:
        """Whether the gain is real: above five errors and 2 %, of a wave that meets the goal."""
        is_met = self.entries[self.best].meets
        return is_met and self.errors > ERRORS and self.gain > GAIN


def gain_over(goal: Goal, value: float, rival: float) -> float:
    """Return the share by which a value is better than another; nan without one."""
    sign = 1.0 if OBJECTIVES[goal.objective].is_largest else -1.0
    return sign * (value - rival) / abs(rival) if rival else float('nan')


def optimise(
    order: Order,
    *,
    journal: Journal | None = None,
    workers: int = 0,
    scheduler: str = '',
    tell: Tell | None = None,
) -> Answer:
    """
    Search every shape and the spline, check what was found, and try it elsewhere.

    Parameters
    ----------
    order : Order
        What is to be found.
    journal : Journal, optional
        Of ``order.identity()``; keeps every evaluation.
    workers, scheduler
        Those of ``run_batch``.
    tell : callable, optional
        Called with the number of evaluations and the least cost so far.

    Raises
    ------
    StickSlipError
        If a stand is refused, or a package is missing.

    """
    found: dict[str, list[Found]] = {}
    with executor_of(workers, scheduler) as executor:
        try:
            for name, one in _searches(order, executor, journal, tell):
                found.setdefault(name, []).append(one)
                if one.stopped:
                    return _unchecked(order, found)
            entries = _checked(order, found, executor)
            answer = Answer(order, entries, {})
            return replace(answer, unseen=_elsewhere(answer, executor))
        except Interrupted:
            return _unchecked(order, found)


def _searches(
    order: Order, executor: Executor, journal: Journal | None, tell: Tell | None
) -> Iterator[tuple[str, Found]]:
    """Search every shape with every seed."""
    done, least = 0, WORTHLESS

    def tell_all(evaluations: int, cost: float) -> None:
        if tell is not None:
            tell(done + evaluations, min(least, cost))

    for name, task in order.tasks.items():
        for seed in range(order.seed, order.seed + order.seeds):
            one = search(
                task, order.budget, seed, executor, journal=journal, first=done, tell=tell_all
            )
            done, least = done + order.budget.evaluations, min(least, one.cost)
            yield name, one


def _unchecked(order: Order, found: Mapping[str, Sequence[Found]]) -> Answer:
    """Return what there is after Ctrl-C: costs in place of values."""
    sign = -1.0 if OBJECTIVES[order.goal.objective].is_largest else 1.0
    entries = {
        name: _entry(searches, sign * _best_of(searches).cost, float('nan'), False)
        for name, searches in found.items()
    }
    return Answer(order, entries, {}, stopped=True)


def _best_of(searches: Sequence[Found]) -> Found:
    return min(searches, key=lambda one: one.cost)


def _entry(searches: Sequence[Found], value: float, error: float, meets: bool) -> Entry:
    best = _best_of(searches)
    costs = tuple(one.cost for one in searches)
    return Entry(best.wave, value, error, meets, costs, best.history)


def _checked(
    order: Order, found: Mapping[str, Sequence[Found]], executor: Executor
) -> dict[str, Entry]:
    """Return the best of every shape with its error, and the plain saw-tooth beside them."""
    plain = order.tasks[RIVAL].space.plain
    everything = {**found, PLAIN: [Found(plain, [], WORTHLESS, [])]}
    waves = [_best_of(searches).wave for searches in everything.values()]
    checked = run_batch(partial(check, order), waves, executor=executor)
    return {
        name: _entry(searches, worth.value, error, worth.meets)
        for (name, searches), (worth, error) in zip(everything.items(), checked, strict=True)
    }


def check(order: Order, wave: PeriodicWave) -> tuple[Worth, float]:
    """
    Return what a wave is worth on the stand of an order, and the error of its value.

    The error is the largest change by steps and rows four times as fine, in a state ten times as
    steady, and by springs in place of turning points.

    """
    stand = wave.under(order.stand)
    backwards = order.goal.backwards
    rows = wave.rows(order.stand, backwards=backwards)
    worth = assess(order.goal, stand, rows)
    finer = stand.updated({'sim.dt': stand.sim.dt / FINER})
    fine_rows = wave.rows(order.stand, backwards=backwards, curve_rows=FINER * CURVE_ROWS)
    others = (
        assess(order.goal, finer, fine_rows, change=CHANGE / STEADIER),
        assess(order.goal, stand, rows, on_springs=True),
    )
    return worth, float(np.max([abs(other.value - worth.value) for other in others]))


def _elsewhere(answer: Answer, executor: Executor) -> dict[str, float]:
    """Return the gain of the best wave on stands that no search has seen."""
    goal, best = answer.order.goal, answer.entries[answer.best].wave
    rival = answer.entries[RIVAL].wave
    stands = unseen_stands(answer.order)
    cases = [(wave, stand) for stand in stands.values() for wave in (best, rival)]
    values = run_batch(partial(_value_on, answer.order), cases, executor=executor)
    pairs = zip(values[::2], values[1::2], strict=True)
    return {name: gain_over(goal, *pair) for name, pair in zip(stands, pairs, strict=True)}


def _value_on(order: Order, case: tuple[PeriodicWave, Parameters]) -> float:
    wave, stand = case
    rows = wave.rows(order.stand, backwards=order.goal.backwards)
    return assess(order.goal, wave.under(stand), rows).value


def unseen_stands(order: Order) -> dict[str, Parameters]:
    """Return stands that differ from those of the searches, by what is different."""
    stand, seed = order.stand, order.seed + UNSEEN_SEED
    spread = max(order.spread, UNSEEN_SPREAD)
    others = spread_stands(stand, UNSEEN + 1, spread, seed)[1:]
    stands = {f'spread {number}': other for number, other in enumerate(others, start=1)}
    for damping in DAMPINGS_N_S_PER_M:
        damped = stand.runner.damping + damping
        stands[f'damping {damped:g} N s/m'] = stand.updated({'runner.damping': damped})
    if stand.contact.profile == 'rough':
        for line in LINES:
            changes = {'contact.profile': 'rough_line', 'contact.line_seed': line}
            stands[f'rough lines from {line} on'] = stand.updated(changes)
    return stands


def spread_stands(stand: Parameters, count: int, spread: float, seed: int) -> list[Parameters]:
    """Return a stand, and others whose friction, mass, roughness and feet differ by chance."""
    rng = np.random.default_rng(seed)
    stands = [stand]
    names = ['contact.friction', 'runner.mass']
    if stand.contact.profile == 'rough' and stand.contact.prefactor:
        names.append('contact.prefactor')
    values = stand.flat()
    for number in range(1, count):
        factors = rng.uniform(1.0 - spread, 1.0 + spread, len(names))
        changes: dict[str, object] = {
            name: float(values[name]) * float(factor)
            for name, factor in zip(names, factors, strict=True)
        }
        stands.append(stand.updated({**changes, 'sim.seed': stand.sim.seed + seed + number}))
    return stands
