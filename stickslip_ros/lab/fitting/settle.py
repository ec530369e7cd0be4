# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Noise, outliers, sensors, and what the model still owes, from the residuals of a fit."""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.lab.experiments.experiment import Seen
from stickslip_ros.lab.experiments.sensor import (
    keeps_noise,
    lone_outliers,
    noise_of,
    rounding_of,
)
from stickslip_ros.lab.experiments.sensor_clock import LATE_MIN_S
from stickslip_ros.lab.fitting.metric import Allowance, slower
from stickslip_ros.lab.fitting.problem import FINEST, Problem, StandardErrors
from stickslip_ros.lab.fitting.search import Minimum, search

CLOSE_S, CLOSE_SHARE = 5e-7, 0.1
"""Least change of a clock, and of an allowed error, for another search."""
ROUNDS = 6  # most searches until noise, clocks and allowed errors are settled
_OWED_ROUNDS = 4  # updates of the allowed errors at a place
_OWED_MOST = 1e3  # largest factor of an update
SAID_SLOW_S = 2e-5  # least time constant of a sensor that is reported: 8 kHz, where a runner rings
_COARSE = 2.0
"""Factor of rounding as an error of readings: smaller noise does not dither the rounding, and
consecutive readings of a slow motion have the same error. Of 8 rigs with 1 nm of noise and digits
of 5 nm two failed their checks and one was off by 3.4 standard errors."""


def settle(
    problem: Problem, place: Array, least: Allowance, outliers: float
) -> tuple[Problem, list[Minimum]]:
    """
    Continue from a place with noise, clocks, outliers and allowed errors from the residuals.

    ``least`` are the least allowed errors.

    """
    found = list[Minimum]()
    for _ in range(ROUNDS):
        before = problem
        problem = _owing(_with_noise(problem, place, outliers), place, least)
        found.append(search(problem, place))
        place = found[-1].place
        if _is_settled(problem, before):
            break
    return problem, found


def _is_settled(problem: Problem, before: Problem) -> bool:
    now, then = (
        [x for _, each, _ in one.seen for x in (each.sensor.late_s, each.sensor.slow_s)]
        for one in (problem, before)
    )
    is_late = np.any(np.abs(np.subtract(now, then)) >= CLOSE_S)
    assert problem.allowance is not None
    assert before.allowance is not None
    ratios = np.log(np.divide(problem.allowance, before.allowance))
    return not (is_late or np.any(np.abs(ratios) > CLOSE_SHARE))


def _owing(problem: Problem, place: Array, least: Allowance) -> Problem:
    """Return the problem with the allowed errors, and the metrics, of the residuals at a place."""
    predicted = problem.predicted_at(place)
    problem = problem.measured_at(predicted)
    assert problem.allowance is not None
    residuals = [
        model.values - each.values
        for (_, each, _), model in zip(problem.seen, predicted, strict=True)
        if each.is_trace
    ]
    for _ in range(_OWED_ROUNDS):
        pairs = zip(problem.metrics, residuals, strict=True)
        squares, counts = np.sum([metric.owed(residual) for metric, residual in pairs], axis=0)
        likely = np.sqrt(squares / np.maximum(counts, 1e-9)).clip(1e-9, _OWED_MOST)
        sizes = np.maximum(likely * problem.allowance, least)
        factors = sizes / problem.allowance
        problem = replace(
            problem,
            allowance=Allowance(*sizes.tolist()),
            metrics=tuple(each.with_sizes(factors) for each in problem.metrics),
        )
    return problem


def _with_noise(problem: Problem, place: Array, outliers: float) -> Problem:
    """Return the problem with noise, sensors and outliers from the residuals at a place."""
    predicted = problem.predicted_at(place)
    metrics = iter(replace(problem, allowance=None).measured_at(predicted).metrics)
    seen, errors, missed = list[Seen](), list[float](), dict[str, list[float]]()
    for (_, each, noise), model in zip(problem.seen, predicted, strict=True):
        kept, error, residual = each, noise, model.values - each.values
        if each.is_trace:
            sizes, left = next(metrics).of_sensor(residual)
            kept, shown = _shown(each, left, sizes[2:4].tolist(), outliers)
            error = max(each.sigma or shown or noise, FINEST)
        elif each.sigma is None:
            missed.setdefault(each.quantity, []).append(float(residual[0]))
        seen.append(kept)
        errors.append(error)
    for number, each in enumerate(seen):
        if not each.is_trace and each.sigma is None:
            errors[number] = float(np.sqrt(np.mean(np.square(missed[each.quantity]))))
    found = StandardErrors(known=True, values=tuple(errors))
    return replace(problem.with_seen(seen), noise=found)


def _shown(
    each: Seen, left: Array, late_curved: list[float], outliers: float
) -> tuple[Seen, float]:
    """Return readings without outliers, with their sensor, and their noise; 0 if none shows."""
    late_s, slow_s = slower(each.sensor.slow_s, *late_curved)
    out = lone_outliers(left, outliers or math.inf)
    keeps, left, kept = 0.0, left[~out], each.without(out)
    rounding = rounding_of(kept.values)
    if slow_s:
        share = math.exp(-float(np.median(np.diff(each.time_s))) / slow_s)
        keeps = share if keeps_noise(left, share, rounding) else 0.0
    sensed = kept.sensed(
        late_s=each.sensor.late_s + late_s,
        slow_s=slow_s,
        noise_lasts_s=slow_s if keeps else 0.0,
    )
    return sensed, max(noise_of(left, keeps, rounding), _COARSE * rounding)


def notes_of(problem: Problem, least: Allowance) -> Iterator[str]:
    """Yield what was found about the sensors."""
    for one, each, noise in problem.seen:
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
                f'{name}: a motion that repeats in each fringe of {1e9 * sensor.fringe_m:.4g} nm '
                'counts as cyclic error of the interferometer, of the size of '
                f'{1e9 * sensor.cyclic_m:.2g} nm'
            )
        coarse = _COARSE * rounding_of(each.values) if not each.sigma else 0.0
        if each.unit == 'm' and least.reading_m < noise <= coarse:
            yield (
                f'{name} is rounded by more than its noise: the error of a reading is '
                f'{1e9 * noise:.2g} nm, as consecutive readings share it'
            )
        if sensor.slow_s > SAID_SLOW_S:
            shares = '; neighbouring readings share its noise' if sensor.noise_lasts_s else ''
            hertz = 0.5 / (math.pi * sensor.slow_s)
            yield f'{name}: its sensor is slow, as behind a low-pass of {hertz:.2g} Hz{shares}'
