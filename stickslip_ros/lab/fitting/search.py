# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The search of a fit: the best of many places, least squares from there, noise and sensors.

For recordings the allowed errors of the model decrease during a search: steps that are a little
too short add up to a large misfit, and a search without an allowance ends elsewhere. Noise,
clocks, outliers and allowed errors are then estimated from the residuals at a minimum.

"""

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy import optimize

from stickslip_ros.arrays import Array
from stickslip_ros.errors import StickSlipError
from stickslip_ros.lab.experiments.experiment import Readout, Voltage
from stickslip_ros.lab.experiments.sensor import keeps_noise, lone_outliers, noise_of, rounding_of
from stickslip_ros.lab.experiments.sensor_clock import (
    LATE_MIN_S,
    Lateness,
    lateness_of,
    sensor_near,
)
from stickslip_ros.lab.fitting.metric import DELAY_S, SHAPE_M, Allowance, slower
from stickslip_ros.lab.fitting.problem import EFFECT, FINEST, PRIOR, Predicted, Problem, largest_of
from stickslip_ros.lab.runs.batch import Progress, run_batch
from stickslip_ros.process.stopping import Stopped

LOOSE_ALLOWANCES = Allowance(2e-8, 0.3), Allowance(4e-9, 0.05)
"""Allowed errors of the model in the first searches of traces. From starts up to 1.6 times off in
five parameters, 6 of 6 searches found the truth; from up to 3.3 times off, 9 of 12."""
TRIED_PLACES = 64  # places that are tried before the searches
TRIED_SLOW_S = (2.5e-5, 8e-5, 2.5e-4)
"""Time constants of a sensor that are tried, 6 kHz to 640 Hz: a low-pass hides the ringing of the
runner, and a search without it ends elsewhere."""
FOLLOWED_MAX = 3  # most ends of loose searches that are continued
READINGS_MAX = 10_000  # most readings of a quantity in a recording; more are thinned
CERTAIN_FACTOR = 1.2  # least ratio of two chi-squares at which the larger one is rejected
DISTANCE_MIN = 0.05  # least distance of two minima
TOLERANCE = 1e-6
"""Relative change of the sum of squares, or of coordinates, that ends a search: a thousandth of a
standard error."""
_STEPS_OF_SEARCH = 40  # most steps of a search
ROUNDS, _CLOSE = 6, 0.1
"""Most searches until noise, clocks and allowed errors are settled, and least change of a clock,
per DELAY_S, and of an allowed error, as a share, that needs another search."""
_COARSE = 2.0
"""Factor of rounding as an error of readings: noise below the rounding does not dither it, so
consecutive readings of a slow motion share an error. Without the factor, of 8 rigs with 1 nm of
noise and digits of 5 nm two failed their checks and one was off by 3.4 standard errors."""


@dataclass(frozen=True)
class Minimum:
    """The end of a search."""

    coordinates: tuple[float, ...]  # natural; empty if the search met an impossible stand
    chi_square: float
    converged: bool
    evaluations: int  # stands tried

    @property
    def place(self) -> Array:
        """Natural coordinates of the minimum, shape (free,)."""
        return np.array(self.coordinates)


@contextmanager
def impossible() -> Iterator[None]:
    """Suppress the error of an impossible stand."""
    try:
        yield
    except Stopped:
        raise
    except StickSlipError:
        return


def distinct(searches: Sequence[Minimum]) -> list[Minimum]:
    """Return distant minima, the best first."""
    kept = list[Minimum]()
    ended = [each for each in searches if each.coordinates]
    for each in sorted(ended, key=lambda found: found.chi_square):
        if all(np.max(np.abs(each.place - one.place)) > DISTANCE_MIN for one in kept):
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
        return np.full_like(first, np.inf)  # the search avoids impossible stands

    ended = optimize.least_squares(
        residuals,
        start,
        jac=problem.slopes,
        x_scale='jac',
        ftol=TOLERANCE,
        xtol=TOLERANCE,
        gtol=TOLERANCE**2,
        max_nfev=_STEPS_OF_SEARCH,
    )
    within = problem.place_of(problem.values(ended.x))
    return Minimum(
        tuple(within.tolist()),
        2.0 * float(ended.cost),
        bool(ended.success),
        int(ended.nfev + len(start) * ended.njev),
    )


def search_all(
    problem: Problem, starts: int, workers: int, progress: Progress | None = None
) -> list[tuple[Problem, Minimum]]:
    """
    Search from the start and from the best of TRIED_PLACES; return each end with its sensors.

    Raises StickSlipError if the start is impossible.

    """
    clear, *others = _sensors_tried(problem)
    begins = [(clear, problem.start)]
    clear.predicted_at(problem.start)
    tried = _tried(clear, others, TRIED_PLACES if starts > 1 else 0)
    if tried and tried[0][0] is not clear:
        begins.append(tried[0])
    begins += tried[1:starts]
    alone = [(replace(one, pool=None), place) for one, place in begins]
    stages = [LOOSE_ALLOWANCES[0] if problem.has_traces else problem.allowance]
    ends = run_batch(partial(_descend, stages), alone, workers=workers, progress=progress)
    if problem.has_traces:  # continue from the best
        kept = distinct([ended for _, ended in ends])[:FOLLOWED_MAX]
        best = [(_on_time(one, each.place), each.place) for one, each in ends if each in kept]
        stages = [*LOOSE_ALLOWANCES[1:], problem.allowance]
        ends = run_batch(partial(_descend, stages), best, workers=workers)
    return [(replace(one, pool=problem.pool), ended) for one, ended in ends]


def _sensors_tried(problem: Problem) -> list[Problem]:
    """Return the problem with each clock and low-pass to try, the one with clear delays first."""
    found = [
        lateness_of(one.observed[0], one.drive) if isinstance(one.drive, Voltage) else Lateness()
        for one in problem.experiments
    ]

    def sensed(of: Problem, **known: float) -> Problem:
        return of.with_observed(each.sensed(**known) for _, each, _ in of.observed)

    def on_clocks(*, only_clear: bool) -> Problem:
        pairs = zip(problem.experiments, found, strict=True)
        late = (
            one.sensed(late_s=clock.late_s) if clock.is_clear or not only_clear else one
            for one, clock in pairs
        )
        of = replace(problem, experiments=tuple(late))
        return of.with_observed(each.thinned(READINGS_MAX) for _, each, _ in of.observed)

    clear = on_clocks(only_clear=True)
    if not problem.has_traces:
        return [clear]
    unsure = on_clocks(only_clear=False)
    tried = [clear, sensed(clear, late_s=0.0), unsure, sensed(unsure, slow_s=TRIED_SLOW_S[0])]
    tried += [sensed(clear, slow_s=slow_s) for slow_s in TRIED_SLOW_S]
    sensors = [[each.sensor for _, each, _ in one.observed] for one in tried]
    return [one for k, one in enumerate(tried) if sensors[k] not in sensors[:k]]


def _tried(
    problem: Problem, variants: Sequence[Problem], count: int
) -> list[tuple[Problem, Array]]:
    """Return the start and places of a Latin hypercube, each with its best sensors."""
    reach = 1.0 if problem.has_traces else PRIOR  # e-folds of logarithmic coordinates
    shares = np.empty((0, len(problem.free)))
    if count:
        from scipy.stats import qmc  # noqa: PLC0415 - a slow import

        shares = qmc.LatinHypercube(d=len(problem.free), seed=1).random(count)

    def suited(place: Array) -> tuple[float, Problem, Array]:
        rows = [(CERTAIN_FACTOR * _missed(one, place), one, place) for one in variants]
        return min([(_missed(problem, place), problem, place), *rows], key=lambda row: row[0])

    start = problem.start
    first, *others = map(suited, (start, *(start + reach * (2.0 * shares - 1.0))))
    others.sort(key=lambda row: row[0])
    return [(one, place) for missed, one, place in (first, *others) if math.isfinite(missed)]


def _missed(problem: Problem, place: Array) -> float:
    """Return chi-square of noise and sensor alone; infinity for an impossible stand."""
    with impossible():
        predicted = problem.predicted_at(place)
        whole = replace(problem, allowance=None).measured_at(predicted).whitened(predicted)
        return float(whole @ whole)
    return math.inf


def _descend(
    stages: Sequence[Allowance | None], begin: tuple[Problem, Array]
) -> tuple[Problem, Minimum]:
    """Search from a place with smaller and smaller allowances; skip impossible stands."""
    problem, place = begin
    ended = Minimum((), math.inf, converged=False, evaluations=0)
    with impossible():
        for stage in stages:
            ended = search(replace(problem, allowance=stage, metrics=()), place)
            place = ended.place
    return problem, ended


def _on_time(problem: Problem, place: Array) -> Problem:
    """Return the problem with the sensors that best fit the differences of readings."""
    stand, observed = problem.stand(place), list[Readout]()
    for one in problem.experiments:
        if isinstance(one.drive, Voltage):
            late_s, slow_s = sensor_near(one, stand, one.observed[0].sensor.late_s)
            first, *others = one.sensed(late_s=late_s).observed
            observed += [first.sensed(slow_s=slow_s), *others]
        else:
            observed += one.observed
    return problem.with_observed(observed)


def refine(problem: Problem, here: Minimum) -> tuple[Problem, list[Minimum], bool]:
    """Repeat the search from a minimum with more cycles until its runs are steady."""
    refined = list[Minimum]()
    while True:
        longer, steady = problem.steady_at(here.place)
        if longer is problem:
            return problem, refined, steady
        problem, here = longer, search(longer, here.place)
        refined.append(here)


def settle(problem: Problem, place: Array) -> tuple[Problem, list[Minimum]]:
    """Continue from a place with noise, clocks, outliers and allowed errors from the residuals."""
    found = list[Minimum]()
    for _ in range(ROUNDS):
        before = problem
        problem = _with_model_error(_with_noise(problem, place), place)
        found.append(search(problem, place))
        place = found[-1].place
        both = before, problem
        times_s = [
            [(each.sensor.late_s, each.sensor.slow_s) for _, each, _ in one.observed]
            for one in both
        ]
        sizes = np.log([one.allowance or one.noise for one in both])
        changes = np.diff(times_s, axis=0) / DELAY_S, np.diff(sizes, axis=0)
        if max(np.max(np.abs(each)) for each in changes) < _CLOSE:
            break
    return problem, found


def _with_model_error(problem: Problem, place: Array) -> Problem:
    """Return the problem with the allowed errors, and the metrics, of the residuals at a place."""
    if problem.allowance is None:
        return problem
    predicted = problem.predicted_at(place)
    problem = problem.measured_at(predicted)
    pairs = zip(problem.observed, predicted, strict=True)
    missed = [model.values - each.values for (_, each, _), model in pairs if each.is_trace]
    for _ in range(ROUNDS):
        assert problem.allowance is not None
        both = zip(problem.metrics, missed, strict=True)
        squares, counts = np.sum([one.model_error(each) for one, each in both], axis=0)
        likely = np.minimum(np.sqrt(squares / np.maximum(counts, 1e-9)), 1e3)
        sizes = np.maximum(likely * problem.allowance, Allowance())
        metrics = tuple(each.with_sizes(sizes / problem.allowance) for each in problem.metrics)
        problem = replace(problem, allowance=Allowance(*sizes.tolist()), metrics=metrics)
    return problem


def _with_noise(problem: Problem, place: Array) -> Problem:
    """Return the problem with noise, sensors and outliers from the residuals at a place."""
    predicted = problem.predicted_at(place)
    metrics = iter(replace(problem, allowance=None).measured_at(predicted).metrics)
    share, observed, errors = _share_missed(problem, predicted), list[Readout](), list[float]()
    for (_, each, noise), model in zip(problem.observed, predicted, strict=True):
        kept, error = each, noise
        if each.is_trace:
            sizes, left = next(metrics).of_sensor(model.values - each.values)
            kept, shown = _shown(each, left, sizes[2:4].tolist())
            error = max(each.sigma or shown or noise, FINEST)
        elif each.is_bare:  # one error is common to all such numbers
            error = share * largest_of(problem.experiments, each.quantity)
        observed.append(kept)
        errors.append(error)
    return replace(problem.with_observed(observed), noise=tuple(errors))


def _share_missed(problem: Problem, predicted: Predicted) -> float:
    """Return the estimated error of bare numbers, per largest number of their quantity."""
    pairs = zip(problem.observed, predicted, strict=True)
    missed = [
        (model.values - each.values) / largest_of(problem.experiments, each.quantity)
        for (_, each, _), model in pairs
        if each.is_bare
    ]
    degrees = len(missed) * (1.0 - len(problem.free) / problem.count)
    return max(float(np.sqrt(np.sum(np.square(missed)) / max(degrees, 1.0))), EFFECT)


def _shown(each: Readout, left: Array, late_curved: list[float]) -> tuple[Readout, float]:
    """Return readings without outliers, with their sensor, and their noise, or 0 if hidden."""
    late_s, slow_s = slower(each.sensor.slow_s, *late_curved)
    out = lone_outliers(left)
    keeps, left, kept = 0.0, left[~out], each.without(out)
    rounding = rounding_of(kept.values)
    if slow_s:
        share = math.exp(-float(np.median(np.diff(each.time_s))) / slow_s)
        keeps = share if keeps_noise(left, share, rounding) else 0.0
    sensed = kept.sensed(
        late_s=each.sensor.late_s + late_s, slow_s=slow_s, noise_lasts_s=slow_s if keeps else 0.0
    )
    return sensed, max(noise_of(left, keeps, rounding), _COARSE * rounding)


def notes_of(problem: Problem) -> Iterator[str]:
    """Yield notes on the sensors."""
    for one, each, noise in problem.observed:
        sensor, name = each.sensor, f'{one.origin}: {each.quantity}'
        if not each.is_trace:
            continue
        if abs(sensor.late_s) > LATE_MIN_S:
            yield f'{name}: its clock is about {1e3 * sensor.late_s:.3g} ms late'
        if each.left_out:
            count = len(each.values) + each.left_out
            yield f'{name}: {each.left_out} of {count} readings were left out as outliers'
        if sensor.undone_hz:
            yield f'{name}: the low-pass of its sensor, {sensor.undone_hz:g} Hz, was undone'
        if sensor.cyclic_m:
            yield (
                f'{name}: motion that repeats in each fringe of {1e9 * sensor.fringe_m:.4g} nm is '
                'fitted as a cyclic error of the interferometer, of about '
                f'{1e9 * sensor.cyclic_m:.2g} nm'
            )
        coarse = _COARSE * rounding_of(each.values) if not each.sigma else 0.0
        if each.unit == 'm' and SHAPE_M < noise <= coarse:
            yield (
                f'{name} is rounded by more than its noise, so consecutive readings share an '
                f'error; the error of a reading is {1e9 * noise:.2g} nm'
            )
        if sensor.slow_s > DELAY_S:
            shares = '; neighbouring readings share its noise' if sensor.noise_lasts_s else ''
            hertz = 0.5 / (math.pi * sensor.slow_s)
            yield f'{name}: its sensor is slow, like a low-pass of {hertz:.2g} Hz{shares}'
