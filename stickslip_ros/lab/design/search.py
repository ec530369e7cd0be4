# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The search for the best periodic wave: CMA-ES on a spline and on every named shape.

The gain is compared with the integration error.

"""

import math
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice
from statistics import fmean
from typing import Any

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.drive.build import slew_of
from stickslip_ros.errors import OutOfRange
from stickslip_ros.extras import load_extra
from stickslip_ros.instrument.checks import FREQUENCY_MIN_HZ
from stickslip_ros.lab.design.objectives import COST_MAX, OBJECTIVES, WaveGoal, Worth, assess
from stickslip_ros.lab.design.shapes import CURVE_ROWS, SHAPES
from stickslip_ros.lab.design.steady_cycle import CHANGE
from stickslip_ros.lab.design.waves import KNOTS_MAX, KNOTS_MIN, SPLINE, PeriodicWave, knots_of
from stickslip_ros.lab.runs.batch import Interrupted, Pool, pool_of, run_courses
from stickslip_ros.lab.runs.courses import Course, bundle_for
from stickslip_ros.parameters import Parameters, spec_of
from stickslip_ros.process.stopping import Stopped

_SEARCHED = *SHAPES, SPLINE  # of the shapes that are searched
COMPARED_SHAPE = 'sawtooth'  # the reference of a gain
PLAIN = 'sawtooth, plain'  # the saw-tooth at full voltage and the highest frequency and preload
SPREAD = 0.3  # standard deviation of the first generation, in the unit cube
_MARGIN = 0.02  # distance of the start from the walls of the cube
SMALLEST = 0.02  # smallest voltage, as a share of the largest
SLEW_SHARE = 0.9  # largest share of a cycle for rise and fall at the slew rate
_EVALUATIONS_MAX = 1_000_000
FINER, STEADIER = 4, 10.0  # refinement of steps and rows, and of the steady state, in a check
_ERRORS, _GAIN = 5.0, 0.02  # a gain counts above 5 errors and above 2 %


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
        highest_hz, preload = self.stand.amplifier.frequency_max, spec_of('stand.preload')
        for name, unit, values, least, most in (
            ('number of knots', '', (self.knots,), KNOTS_MIN, KNOTS_MAX),
            ('number of evaluations', '', (self.evaluations,), 1, _EVALUATIONS_MAX),
            ('seed', '', (self.seed,), 0, 2**32),
            ('frequency', 'Hz', self.frequencies_hz, FREQUENCY_MIN_HZ, highest_hz),
            ('preload', 'N', self.preloads_n, preload.minimum or 0.0, preload.maximum or math.inf),
        ):
            for value in values:
                if not least <= value <= most:
                    limit = f'not from {least:.10g} to {most:.10g} {unit}'.rstrip()
                    raise OutOfRange(name, value, unit, limit, 'stay in these limits')
            if values[0] > values[-1]:
                limit = f'above the end of its range, {values[-1]:g} {unit}'
                raise OutOfRange(name, values[0], unit, limit, 'give the lower one first')

    @property
    def total(self) -> int:
        return len(_SEARCHED) * self.evaluations

    @property
    def _ranges(self) -> tuple[tuple[float, float], ...]:
        """Ranges of frequency, voltage share and preload."""
        return self.frequencies_hz, (SMALLEST, 1.0), self.preloads_n

    def start(self, shape: str) -> Array:
        """Return the place of the usual shape or saw-tooth spline, at the top of the ranges."""
        rises = self.knots // 2
        own = [1.0] * rises + [0.0] * (self.knots - rises) + [0.5] * self.knots
        if shape != SPLINE:
            traits = SHAPES[shape].traits.values()
            own = [(usual - low) / (high - low) for low, high, usual in traits]
        return np.array([*own, *(1.0 for low, high in self._ranges if low < high)])

    def wave(self, shape: str, place: Array) -> PeriodicWave:
        """Return the wave of a shape at a place in the unit cube of its numbers and settings."""
        shares = iter(place.tolist())
        values: Mapping[str, Any]
        if shape == SPLINE:
            values = knots_of(list(islice(shares, 2 * self.knots)))
        else:
            traits = SHAPES[shape].traits.items()
            values = {name: low + (high - low) * next(shares) for name, (low, high, _) in traits}
        frequency_hz, share, preload_n = (
            low * (high / low) ** next(shares) if low < high else low for low, high in self._ranges
        )
        steep_v = 0.5 * SLEW_SHARE * slew_of(self.stand) / frequency_hz
        largest_v = min(self.stand.amplifier.range_v, steep_v)
        return PeriodicWave(shape, values, share * largest_v, frequency_hz, preload_n)

    def worths(
        self,
        wave: PeriodicWave,
        stands: Sequence[Parameters],
        curve_rows: int = CURVE_ROWS,
        change: float = CHANGE,
    ) -> Course[list[Worth]]:
        """Return the worth of a wave on stands, steady to ``change``."""
        rows = wave.rows(self.stand, curve_rows)
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
    """The best wave of each shape, by name, and the plain saw-tooth."""

    search: WaveSearch
    shapes: Mapping[str, ShapeResult]

    @property
    def best(self) -> str:
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
    workers: int = 0,
    scheduler: str = '',
    progress: Callable[[int, float], None] | None = None,
) -> SearchResult:
    """Search all shapes, and check the results."""
    done = 0
    shapes = {name: ShapeResult(search.wave(name, search.start(name))) for name in _SEARCHED}
    try:
        with pool_of(workers, scheduler) as pool:
            for name, wave, cost in evaluations(search, _SEARCHED, pool):
                found = shapes[name]
                if cost < found.cost:
                    found.wave, found.cost = wave, cost
                done += 1
                if progress is not None:
                    progress(done, min(one.cost for one in shapes.values()))
            shapes[PLAIN] = ShapeResult(search.wave(COMPARED_SHAPE, search.start(COMPARED_SHAPE)))
            bundle, course_of = bundle_for(search.stand), partial(check, search)
            checks = run_courses(course_of, list(shapes.values()), bundle, pool=pool)
            return SearchResult(search, dict(zip(shapes, checks, strict=True)))
    except Interrupted:
        best = min(shapes.values(), key=lambda one: one.cost)
        raise SearchStopped(best.wave, done) from None


def evaluations(
    search: WaveSearch, names: Sequence[str], pool: Pool
) -> Iterator[tuple[str, PeriodicWave, float]]:
    """Yield shape, wave and cost, generation by generation, over all shapes at once."""
    going = {name: _generations(search, search.start(name)) for name in names}
    asked, bundle = (
        {name: next(places) for name, places in going.items()},
        bundle_for(search.stand),
    )
    while any(asked.values()):
        todo = [name for name, places in asked.items() for _ in places]
        waves = [search.wave(name, place) for name, places in asked.items() for place in places]
        costs = run_courses(search.cost, waves, bundle, pool=pool)
        yield from zip(todo, waves, costs, strict=True)
        answers = iter(costs)
        for name, places in asked.items():
            if places:
                asked[name] = going[name].send(list(islice(answers, len(places))))


def _generations(search: WaveSearch, start: Array) -> Generator[list[Array], list[float], None]:
    """Request costs of the start, then of generations; restart after convergence of CMA-ES."""
    cma = load_extra('the search for a wave', 'cma')
    rng, left = np.random.default_rng(search.seed), search.evaluations - 1
    yield [start]
    if len(start) == 1:  # CMA-ES needs two dimensions; the wave ignores the second
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


def check(search: WaveSearch, found: ShapeResult) -> Course[ShapeResult]:
    """Return a result with its value, and as error the change by 4 times finer integration."""
    stand, wave = search.stand, found.wave
    finer = stand.updated({'sim.dt': stand.sim.dt / FINER})
    [worth] = yield from search.worths(wave, [stand])
    [fine] = yield from search.worths(wave, [finer], FINER * CURVE_ROWS, CHANGE / STEADIER)
    error = abs(fine.value - worth.value)
    return replace(found, value=worth.value, error=error, meets=worth.meets)
