# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The search for the best periodic wave: CMA-ES on a spline and on every named shape.

A journal keeps the cost of each wave, so an interrupted search continues as if uninterrupted. The
gain is compared with the integration error, and the best wave is tested on unseen stands.

"""

import math
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from hashlib import sha256
from itertools import islice
from statistics import fmean
from typing import Any

import numpy as np

import stickslip_ros
from stickslip_ros.arrays import Array
from stickslip_ros.errors import OutOfRange
from stickslip_ros.extras import load_extra
from stickslip_ros.lab.design.objectives import COST_MAX, OBJECTIVES, WaveGoal, Worth, assess
from stickslip_ros.lab.design.shapes import CURVE_ROWS, SHAPES
from stickslip_ros.lab.design.steady_cycle import CHANGE
from stickslip_ros.lab.design.waves import SPLINE, PeriodicWave, Space
from stickslip_ros.lab.runs.batch import Interrupted, Pool, pool_of, run_courses
from stickslip_ros.lab.runs.courses import Course, bundle_for
from stickslip_ros.lab.runs.journal import Journal, JournalIdentity
from stickslip_ros.parameters import Parameters
from stickslip_ros.process.stopping import Stopped

COMPARED_SHAPE = 'sawtooth'  # the reference of a gain
PLAIN = 'sawtooth, plain'  # the saw-tooth at full voltage and the highest frequency and preload
SPREAD = 0.3  # standard deviation of the first generation, in the unit cube
_MARGIN = 0.02  # distance of the start from the walls of the cube
_EVALUATIONS_MAX = 1_000_000
_NUMBERS = 2**64  # numbers of a journal: hashes of wave, goal and stands
JOURNAL = JournalIdentity('optimise', stickslip_ros.__version__, _NUMBERS, '')
"""Identity of a journal of waves."""
FINER, STEADIER = 4, 10.0  # refinement of steps and rows, and of the steady state, in a check
_ERRORS, _GAIN = 5.0, 0.02  # a gain counts above 5 errors and above 2 %
UNSEEN, UNSEEN_SEED, UNSEEN_SPREAD = 4, 1000, 0.15
"""Unseen stands that differ by chance: number, added seed, spread."""
UNSEEN_CHANGES: Mapping[str, Mapping[str, object]] = {
    'damping 20 N s/m': {'runner.damping': 20.0},
    'damping 80 N s/m': {'runner.damping': 80.0},
    'amplifier of 200 kHz': {'amplifier.bandwidth': 200e3},
    'amplifier of 50 kHz': {'amplifier.bandwidth': 50e3},
    'piezo rings at 150 kHz': {'actuator.resonance': 150e3, 'actuator.damping_ratio': 0.1},
    'rough lines': {'contact.profile': 'rough_line', 'contact.line_seed': 101},
}
"""Changes of other unseen stands, by name."""


@dataclass(frozen=True)
class WaveSearch:
    """Settings of a search."""

    goal: WaveGoal
    stand: Parameters  # its amplifier limits the waves
    frequencies_hz: tuple[float, float]  # lowest and highest
    preloads_n: tuple[float, float]  # lowest and highest
    knots: int = 8
    """Knots of the spline, 6 to 16."""
    evaluations: int = 1000
    """Evaluations of each search."""
    seed: int = 0
    """Seed of the search."""
    judges: tuple[Parameters, ...] = ()  # stands whose mean cost counts; empty: the stand

    def __post_init__(self) -> None:
        """Refuse numbers out of range."""
        for name, value, least, most, hint in (
            ('number of evaluations', self.evaluations, 1, _EVALUATIONS_MAX, 'a spline needs 300'),
            ('seed', self.seed, 0, 2**32, 'take a natural number'),
        ):
            if not least <= value <= most:
                raise OutOfRange(name, value, '', f'not from {least} to {most}', hint)

    @property
    def spaces(self) -> dict[str, Space]:
        """The spaces of waves, by shape."""
        limits = self.stand, self.frequencies_hz, self.preloads_n, self.knots
        return {shape: Space(shape, *limits) for shape in (*SHAPES, SPLINE)}

    @property
    def total(self) -> int:
        """Total number of evaluations."""
        return (len(SHAPES) + 1) * self.evaluations

    def worths(
        self,
        wave: PeriodicWave,
        stands: Sequence[Parameters],
        curve_rows: int = CURVE_ROWS,
        change: float = CHANGE,
    ) -> Course[list[Worth]]:
        """Return the worth of a wave on stands, steady to ``change``."""
        rows = wave.rows(self.stand, backwards=self.goal.backwards, curve_rows=curve_rows)
        preload, worths = {'stand.preload': wave.preload_n}, list[Worth]()
        for stand in stands:
            worths.append((yield from assess(self.goal, stand.updated(preload), rows, change)))
        return worths

    def cost(self, wave: PeriodicWave) -> Course[float]:
        """Return the cost that a search minimises."""
        worths = yield from self.worths(wave, self.judges or (self.stand,))
        return fmean(worth.cost for worth in worths)

    def gain(self, value: float, rival: float) -> float:
        """Return the relative gain of a value over a rival; NaN for a rival of 0."""
        sign = 1.0 if OBJECTIVES[self.goal.objective].is_largest else -1.0
        return sign * (value - rival) / abs(rival) if rival else math.nan


@dataclass
class ShapeResult:
    """Intermediate result of the search of a shape."""

    wave: PeriodicWave  # the best one
    cost: float = COST_MAX  # its cost
    history: list[float] = field(default_factory=list)  # least cost after each evaluation
    value: float = math.nan  # of the objective; NaN without forward motion
    error: float = math.nan  # change of the value by a finer integration
    meets: bool = False  # whether the constraints are met


class SearchStopped(Stopped):
    """The search was stopped by Ctrl-C; ``wave`` is the best so far."""

    def __init__(self, wave: PeriodicWave, evaluations: int) -> None:
        super().__init__(f'stopped after {evaluations} evaluations')
        self.wave = wave


@dataclass(frozen=True)
class SearchResult:
    """The best wave of each shape, by name, and the gain of the best on other stands."""

    search: WaveSearch
    shapes: Mapping[str, ShapeResult]
    unseen: Mapping[str, float]  # gain on each unseen stand

    @property
    def best(self) -> str:
        """Name of the shape of least cost."""
        return min(self.shapes, key=lambda name: self.shapes[name].cost)

    def gain_of(self, name: str) -> float:
        """Return the relative gain of a shape over the best saw-tooth."""
        return self.search.gain(self.shapes[name].value, self.shapes[COMPARED_SHAPE].value)

    @property
    def errors(self) -> float:
        """The gain in multiples of the integration error of both waves."""
        best, rival = self.shapes[self.best], self.shapes[COMPARED_SHAPE]
        difference, error = abs(best.value - rival.value), best.error + rival.error
        return difference and (difference / error if error else math.inf)

    @property
    def counts(self) -> bool:
        """Whether the gain is significant: five errors, 2 %, constraints met."""
        is_met = self.shapes[self.best].meets
        return is_met and self.errors > _ERRORS and self.gain_of(self.best) > _GAIN


def optimise(
    search: WaveSearch,
    *,
    journal: Journal | None = None,
    workers: int = 0,
    scheduler: str = '',
    progress: Callable[[int, float], None] | None = None,
) -> SearchResult:
    """Search all shapes, check the results, and test the best wave on other stands."""
    spaces, done = search.spaces, 0
    shapes = {name: ShapeResult(space.wave(space.start)) for name, space in spaces.items()}
    try:
        with pool_of(workers, scheduler) as pool:
            for name, wave, cost in evaluations(search, spaces, pool, journal):
                found = shapes[name]
                if cost < found.cost:
                    found.wave, found.cost = wave, cost
                found.history.append(found.cost)
                done += 1
                if progress is not None:
                    progress(done, min(one.cost for one in shapes.values()))
            return _checked(search, shapes, pool)
    except Interrupted:
        best = min(shapes.values(), key=lambda one: one.cost)
        raise SearchStopped(best.wave, done) from None


def evaluations(
    search: WaveSearch, spaces: Mapping[str, Space], pool: Pool, journal: Journal | None = None
) -> Iterator[tuple[str, PeriodicWave, float]]:
    """Yield name, wave and cost, generation by generation, over all spaces at once."""
    asked_for = f'{stickslip_ros.__version__} {search.goal} {search.judges or search.stand}'
    going = {name: _generations(search, space) for name, space in spaces.items()}
    asked = {name: next(places) for name, places in going.items()}
    while any(asked.values()):
        todo = [(name, place) for name, places in asked.items() for place in places]
        waves = [spaces[name].wave(place) for name, place in todo]
        texts = [f'{asked_for} {spaces[name]} {place.tolist()}' for name, place in todo]
        known = _costs(search, dict(zip(texts, waves, strict=True)), pool, journal)
        costs = [known[text] for text in texts]
        yield from zip((name for name, _ in todo), waves, costs, strict=True)
        answers = iter(costs)
        for name, places in asked.items():
            if places:
                asked[name] = going[name].send(list(islice(answers, len(places))))


def _generations(search: WaveSearch, space: Space) -> Generator[list[Array], list[float], None]:
    """Request costs of the start, then of generations; restart after convergence of CMA-ES."""
    cma = load_extra('the search for a wave', 'cma')
    rng, start, left = np.random.default_rng(search.seed), space.start, search.evaluations - 1
    yield [start]
    if len(start) == 1:  # CMA-ES needs two dimensions; the space ignores the second
        start = np.append(start, 0.5)
    population = 4 + int(3.0 * np.log(len(start)))
    options = {
        'bounds': [0.0, 1.0],
        'randn': lambda *shape: rng.standard_normal(shape),
        'seed': np.nan,
        'verbose': -9,
    }
    while True:
        begin = np.clip(start, _MARGIN, 1.0 - _MARGIN)
        options['popsize'] = population
        strategy = cma.CMAEvolutionStrategy(begin, SPREAD, options)
        while not strategy.stop():
            asked = strategy.ask()
            costs = yield asked[:left]
            left -= len(costs)
            if len(costs) == population:
                strategy.tell(asked, costs)
        start, population = rng.random(len(start)), 2 * population


def _costs(
    search: WaveSearch, waves: Mapping[str, PeriodicWave], pool: Pool, journal: Journal | None
) -> dict[str, float]:
    """Return the costs of waves, from the journal where known."""
    numbers = {text: int(sha256(text.encode()).hexdigest(), 16) % _NUMBERS for text in waves}
    rows = journal.rows if journal else {}
    known: dict[str, Any] = {text: rows.get(n, {}).get('cost') for text, n in numbers.items()}
    todo = [text for text, c in known.items() if not isinstance(c, float) or not math.isfinite(c)]
    asked, bundle = [waves[text] for text in todo], bundle_for(search.stand)
    costs = run_courses(search.cost, asked, bundle, pool=pool)
    for text, cost in zip(todo, costs, strict=True):
        known[text] = cost
        if journal:
            journal.append(numbers[text], {'cost': cost})
    return known


def _checked(search: WaveSearch, searched: Mapping[str, ShapeResult], pool: Pool) -> SearchResult:
    """Check every shape and the plain saw-tooth; run the best and its rival on other stands."""
    space, bundle = search.spaces[COMPARED_SHAPE], bundle_for(search.stand)
    shapes = {**searched, PLAIN: ShapeResult(space.wave(space.start))}
    checks = run_courses(partial(check, search), list(shapes.values()), bundle, pool=pool)
    shapes = dict(zip(shapes, checks, strict=True))
    result = SearchResult(search, shapes, {})
    stands = unseen_stands(search)
    waves = shapes[result.best].wave, shapes[COMPARED_SHAPE].wave

    def gain_on(stand: Parameters) -> Course[float]:
        [best] = yield from search.worths(waves[0], [stand])
        [rival] = yield from search.worths(waves[1], [stand])
        return search.gain(best.value, rival.value)

    gains = run_courses(gain_on, list(stands.values()), bundle, pool=pool)
    return replace(result, unseen=dict(zip(stands, gains, strict=True)))


def check(search: WaveSearch, found: ShapeResult) -> Course[ShapeResult]:
    """Return a result with its value, and as error the change by 4 times finer integration."""
    stand, wave = search.stand, found.wave
    finer = stand.updated({'sim.dt': stand.sim.dt / FINER})
    [worth] = yield from search.worths(wave, [stand])
    [fine] = yield from search.worths(wave, [finer], FINER * CURVE_ROWS, CHANGE / STEADIER)
    error = abs(fine.value - worth.value)
    return replace(found, value=worth.value, error=error, meets=worth.meets)


def unseen_stands(search: WaveSearch) -> dict[str, Parameters]:
    """Return stands that no search has seen, by their change."""
    others = spread_stands(search.stand, UNSEEN + 1, UNSEEN_SPREAD, search.seed + UNSEEN_SEED)[1:]
    stands = {f'spread {number}': other for number, other in enumerate(others, start=1)}
    for name, changes in UNSEEN_CHANGES.items():
        if 'contact.profile' not in changes or search.stand.contact.profile == 'rough':
            stands[name] = search.stand.updated(changes)
    return stands


def spread_stands(stand: Parameters, count: int, spread: float, seed: int) -> list[Parameters]:
    """Return a stand, and others with random friction, mass, roughness and feet."""
    rng = np.random.default_rng(seed)
    names = ['contact.friction', 'runner.mass']
    if stand.contact.profile == 'rough' and stand.contact.prefactor:
        names.append('contact.prefactor')
    values, stands = stand.flat(), [stand]
    for number in range(1, count):
        factors = rng.uniform(1.0 - spread, 1.0 + spread, len(names))
        changes: dict[str, object] = {
            name: float(values[name]) * float(factor)
            for name, factor in zip(names, factors, strict=True)
        }
        stands.append(stand.updated({**changes, 'sim.seed': stand.sim.seed + seed + number}))
    return stands
