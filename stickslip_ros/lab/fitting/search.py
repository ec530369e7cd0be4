# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The search of a fit: the best of many places, and least squares from there.

In recordings the allowed errors of the model decrease during a search: steps that are a little too
short add up to a large misfit, and a search without an allowance ends elsewhere.

"""

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy import optimize
from scipy.stats import qmc

from stickslip_ros.arrays import Array
from stickslip_ros.errors import StickSlipError
from stickslip_ros.lab.experiments.experiment import Experiment, Seen, Voltage
from stickslip_ros.lab.experiments.sensor import KnownSensor
from stickslip_ros.lab.experiments.sensor_clock import lateness_of, sensor_near
from stickslip_ros.lab.fitting.metric import Allowance
from stickslip_ros.lab.fitting.problem import Problem
from stickslip_ros.lab.runs.batch import Progress, run_batch
from stickslip_ros.process.stopping import Stopped

LOOSE = Allowance(2e-8, 0.3), Allowance(4e-9, 0.05)
"""Allowed errors of the model in the first searches of traces: from starts up to 1.6 times off in
five parameters 6 of 6 searches found the truth, from up to 3.3 times off 9 of 12."""
TRIED = 64  # places that are tried before the searches
AROUND, FAR = 1.0, math.log(10.0)
"""Their largest distance from the start for recordings, and for numbers: e-folds, mostly."""
TRIED_SLOW_S = (2.5e-5, 8e-5, 2.5e-4)
"""Time constants of sensors that are tried too, 6 kHz to 640 Hz: a low-pass hides the ringing of
the runner, and a search without it ends elsewhere."""
FOLLOWED_MAX = 3  # most ends of loose searches that go on
READINGS_MAX = 10_000  # most readings of a quantity in a recording; more are thinned
SURELY = 1.2  # least factor of chi-square between a sensor on time and another that is preferred
APART = 0.05  # least distance of two minima
TOLERANCE = 1e-6
"""Relative change of sum of squares, or of coordinates, that ends a search: a thousandth of a
standard error."""
_IMPOSSIBLE = 1e9  # residual of a stand that no drive can make
_STEPS_MAX = 40  # most steps of a search that converges
_ROUNDS = 6  # most searches with more cycles, until they suffice at the minimum


@dataclass(frozen=True)
class Minimum:
    """The end of a search."""

    coordinates: tuple[float, ...]  # natural ones; none if the search met an impossible stand
    chi_square: float
    converged: bool
    evaluations: int  # stands tried

    @property
    def place(self) -> Array:
        """Natural coordinates of the minimum, shape (free,)."""
        return np.array(self.coordinates)


NOTHING = Minimum((), math.inf, converged=False, evaluations=0)


@contextmanager
def impossible() -> Iterator[None]:
    """Pass over a stand that no drive can make."""
    try:
        yield
    except Stopped:
        raise
    except StickSlipError:
        return


def best_of(searches: Sequence[Minimum]) -> Minimum:
    """Return the search that ended lowest."""
    return min(searches, key=lambda found: found.chi_square)


def distinct(searches: Sequence[Minimum]) -> list[Minimum]:
    """Return distant minima, the best first."""
    kept = list[Minimum]()
    for each in sorted(searches, key=lambda found: found.chi_square):
        is_new = all(np.max(np.abs(each.place - one.place)) > APART for one in kept)
        if each.coordinates and is_new:
            kept.append(each)
    return kept


def search(problem: Problem, start: Array) -> Minimum:
    """
    Search from a place by least squares: a trust region, with one-sided differences.

    Raises StickSlipError if the place is impossible.

    """
    if problem.has_traces and not problem.metrics:
        problem = problem.measured_at(problem.predicted_at(start))
    first = problem.residuals(start)

    def residuals(place: Array) -> Array:
        with impossible():
            return problem.residuals(place)
        return np.full_like(first, _IMPOSSIBLE)  # no drive goes there, nor does the search

    ended = optimize.least_squares(
        residuals,
        start,
        jac=problem.slopes,
        x_scale='jac',
        ftol=TOLERANCE,
        xtol=TOLERANCE,
        gtol=TOLERANCE**2,
        max_nfev=_STEPS_MAX,
    )
    within = problem.place_of(problem.values(ended.x))
    return Minimum(
        tuple(within.tolist()),
        2.0 * float(ended.cost),
        bool(ended.success),
        int(ended.nfev + len(start) * ended.njev),
    )


def search_all(
    problem: Problem, starts: int, seed: int, workers: int, progress: Progress | None = None
) -> list[tuple[Problem, Minimum]]:
    """
    Search from the start and from the best of TRIED places; return each end with its sensors.

    Raises StickSlipError if the start is impossible.

    """
    clear, unsure = (_thinned(with_clocks(problem, only_clear=each)) for each in (True, False))
    start = problem.start
    begins = [(clear, start)]
    tried = _tried(clear, unsure, seed, TRIED if starts > 1 else 0)
    if tried and tried[0][0] is not clear:
        begins.append(tried[0])
    begins += tried[1:starts]
    alone = [(replace(one, pool=None), place, place is start) for one, place in begins]
    stages = [LOOSE[0] if problem.has_traces else problem.allowance]
    ends = run_batch(partial(_descend, stages), alone, workers=workers, progress=progress)
    if problem.has_traces:  # the best go on
        kept = distinct([ended for _, ended in ends])[:FOLLOWED_MAX]
        best = [
            (_on_time(one, each.place), each.place, True) for one, each in ends if each in kept
        ]
        ends = run_batch(partial(_descend, [*LOOSE[1:], problem.allowance]), best, workers=workers)
    return [(replace(one, pool=problem.pool), ended) for one, ended in ends]


def with_clocks(problem: Problem, *, only_clear: bool) -> Problem:
    """Return the problem with the delays of the sensor clocks by the falls of the voltage."""

    def with_clock(one: Experiment) -> Experiment:
        found = lateness_of(one.seen[0], one.drive) if isinstance(one.drive, Voltage) else None
        is_late = found is not None and found.is_clear >= only_clear
        return one.sensed(late_s=found.late_s) if found is not None and is_late else one

    return replace(problem, experiments=tuple(map(with_clock, problem.experiments)), metrics=())


def _thinned(problem: Problem) -> Problem:
    """Return the problem with not too many readings in a recording."""
    return problem.with_seen(each.thinned(READINGS_MAX) for _, each, _ in problem.seen)


def _tried(
    problem: Problem, unsure: Problem, seed: int, count: int
) -> list[tuple[Problem, Array]]:
    """Return the start and places of a Latin hypercube, each with the sensors that suit it."""
    reach = AROUND if problem.has_traces else FAR
    shares = qmc.LatinHypercube(d=len(problem.free), seed=seed).random(count)
    variants = _with_other_sensors(problem, unsure)

    def suited(place: Array) -> tuple[float, Problem, Array]:
        rows = [(SURELY * _missed(one, place), one, place) for one in variants]
        return min([(_missed(problem, place), problem, place), *rows], key=lambda row: row[0])

    start = problem.start
    first, *others = map(suited, (start, *(start + reach * (2.0 * shares - 1.0))))
    others.sort(key=lambda row: row[0])
    return [(one, place) for missed, one, place in (first, *others) if math.isfinite(missed)]


def _with_other_sensors(problem: Problem, unsure: Problem) -> list[Problem]:
    """Return the problem with each of the other clocks and low-passes that are tried, once."""
    if not problem.has_traces:
        return []
    on_time = problem.with_seen(each.sensed(late_s=0.0) for _, each, _ in problem.seen)
    tried = [on_time, unsure, _slowed(unsure, TRIED_SLOW_S[0])]
    tried += [_slowed(problem, slow_s) for slow_s in TRIED_SLOW_S]
    by_sensors = dict[tuple[KnownSensor, ...], Problem]()
    for one in (problem, *tried):
        by_sensors.setdefault(tuple(each.sensor for _, each, _ in one.seen), one)
    _, *others = by_sensors.values()
    return others


def _missed(problem: Problem, place: Array) -> float:
    """Return chi-square of noise and sensor alone; infinity for an impossible stand."""
    with impossible():
        predicted = problem.predicted_at(place)
        whole = replace(problem, allowance=None).measured_at(predicted).whitened(predicted)
        return float(whole @ whole)
    return math.inf


def _slowed(problem: Problem, slow_s: float) -> Problem:
    """Return the problem with a low-pass of all sensors."""
    return problem.with_seen(each.sensed(slow_s=slow_s) for _, each, _ in problem.seen)


def _descend(
    stages: Sequence[Allowance | None], begin: tuple[Problem, Array, bool]
) -> tuple[Problem, Minimum]:
    """Search from a place with less and less allowed; refuse it, or pass over, if impossible."""
    problem, place, is_refused = begin
    with nullcontext() if is_refused else impossible():
        for stage in stages:
            ended = search(replace(problem, allowance=stage, metrics=()), place)
            place = ended.place
        return problem, ended
    return problem, NOTHING


def _on_time(problem: Problem, place: Array) -> Problem:
    """Return the problem with the sensors that fit the motion from sample to sample best."""
    stand, seen = problem.stand(place), list[Seen]()
    for one in problem.experiments:
        if isinstance(one.drive, Voltage):
            late_s, slow_s = sensor_near(one, stand, one.seen[0].sensor.late_s)
            first, *others = one.sensed(late_s=late_s).seen
            seen += [first.sensed(slow_s=slow_s), *others]
        else:
            seen += one.seen
    return problem.with_seen(seen)


def refine(problem: Problem, here: Minimum) -> tuple[Problem, list[Minimum], bool]:
    """Continue from a minimum with more cycles as long as its runs need them."""
    refined, steady = list[Minimum](), True
    for _ in range(_ROUNDS):
        longer, steady = problem.steady_at(here.place)
        if longer.experiments == problem.experiments:
            break
        problem, here = longer, search(longer, here.place)
        refined.append(here)
    return problem, refined, steady
