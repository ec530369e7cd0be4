# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Fit traces with a decreasing allowance, and with estimated noise, clocks and slow sensors."""

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.lab.experiments.clocks import lone_outliers
from stickslip_ros.lab.experiments.experiment import (
    Experiment,
    Seen,
    Voltage,
    keeps_noise,
    noise_of,
    rounding_of,
)
from stickslip_ros.lab.experiments.sensor_clock import LATE_MIN_S, lateness_of, sensor_near
from stickslip_ros.lab.fitting.metric import Allowance, slower
from stickslip_ros.lab.fitting.problem import FINEST, Problem, StandardErrors
from stickslip_ros.lab.fitting.profile import profile
from stickslip_ros.lab.fitting.result import RULED_OUT_BY, Minimum
from stickslip_ros.lab.fitting.search import (
    FOLLOWED_MAX,
    LOOSE_EVALUATIONS_MAX,
    distinct,
    search,
    search_or_nothing,
)
from stickslip_ros.lab.runs.batch import run_batch

LOOSE = Allowance(2e-8, 0.3), Allowance(4e-9, 0.05)
"""Allowed errors of the model in the first searches of traces. Steps that are a little too short
add up to a large misfit, and a search without an allowance ends elsewhere: from starts up to 1.6
times off in five parameters 6 of 6 searches found the truth, from up to 3.3 times off 9 of 12."""
CLOSE_S = 5e-7  # least change of a clock for another search
ROUNDS_OF_NOISE = 5
TRIED_SLOW_S = (2.5e-5, 8e-5, 2.5e-4)
"""Time constants of sensors to try from the start if others leave too much: 6 kHz to 640 Hz. A
low-pass hides the ringing of the runner, and a search without it ends elsewhere."""
SAID_SLOW_S = 2e-5  # least time constant of a sensor that is reported: 8 kHz, where a runner rings
_COARSE = 2.0
"""Factor of rounding as an error of readings: smaller noise does not dither the rounding, and
consecutive readings of a slow motion have the same error. Of 8 rigs with 1 nm of noise and digits
of 5 nm two failed their checks and one was off by 3.4 standard errors."""
UNEXPLAINED = 10.0
"""Most chi-square per reading above 1, per root of the readings: noise comes to 4."""


def with_clocks(problem: Problem, *, only_clear: bool = True) -> Problem:
    """Return the problem with the delays of the sensor clocks by the falls of the voltage."""
    found = (
        lateness_of(one.seen[0], one.drive) if isinstance(one.drive, Voltage) else None
        for one in problem.experiments
    )
    shifts_s = (each.late_s if each and each.is_clear >= only_clear else 0.0 for each in found)
    return replace(problem, shifts_s=tuple(shifts_s))


def tightened(
    problem: Problem,
    searches: Sequence[Minimum],
    allowance: Allowance,
    outliers: float,
    workers: int,
    *,
    tries_sensors: bool = True,
) -> tuple[Problem, list[Minimum], tuple[Minimum, ...], tuple[str, ...]]:
    """
    Tighten the allowance stepwise; return the minima and the problem with its estimated noise.

    A search continues from each of the first minima down to no allowance. The best gives the
    noise, the outliers and the start of the last search, with the stated allowance. The others are
    continued with it too, as an allowance for errors of the model may leave two minima.

    """
    chains = run_batch(
        partial(to_plain, replace(problem, pool=None)), distinct(searches), workers=workers
    )
    unexplained = 1.0 + UNEXPLAINED / math.sqrt(problem.count)
    missed = min(chain[1][-1].chi_square for chain in chains)
    if tries_sensors and missed > unexplained * problem.count:
        by_falls_s = with_clocks(problem, only_clear=False).shifts_s
        sensors = [(problem.shifts_s, slow_s) for slow_s in TRIED_SLOW_S]
        sensors += [(by_falls_s, slow_s) for slow_s in (0.0, TRIED_SLOW_S[0])]
        if any(problem.shifts_s):
            sensors.append(((0.0,) * len(problem.shifts_s), 0.0))
        with_sensor = partial(_with_sensor, replace(problem, pool=None))
        chains += run_batch(with_sensor, sensors, workers=workers)
    chains.sort(key=lambda chain: chain[1][-1].chi_square)
    problem, found = replace(chains[0][0], pool=problem.pool), chains[0][1]
    [predicted] = problem.predicted([problem.stand(found[-1].place)])
    if grid := profile(problem.measured_at(predicted), found[-1].place):
        more = [search(problem, each, LOOSE_EVALUATIONS_MAX) for each in grid.best(1)]
        found += [each for each in more if each.chi_square < found[-1].chi_square]
    problem, more = refine_noise(problem, found[-1].place, allowance, outliers)
    found += more
    begins = [chain[-1].place for _, chain in chains[1:FOLLOWED_MAX]]
    if grid := profile(problem, found[-1].place):
        begins += grid.best(FOLLOWED_MAX)
    ends = [found[-1], *(search(problem, each, LOOSE_EVALUATIONS_MAX) for each in begins)]
    best, *others = distinct(ends, len(ends))
    if best is not found[-1]:
        found.append(best)
    notes = [
        f'{one.origin}: the clock of {one.seen[0].quantity} is about {1e3 * late_s:.3g} ms late'
        for one, late_s in zip(problem.experiments, problem.shifts_s, strict=True)
        if abs(late_s) > LATE_MIN_S
    ]
    notes += [
        f'{one.origin}: {each.left_out} of {len(each.values) + each.left_out} readings of '
        f'{each.quantity} were left out as outliers'
        for one in problem.experiments
        for each in one.seen
        if each.left_out
    ]
    for _, one, each, noise in problem.seen:
        if each.low_pass_hz:
            notes.append(
                f'{one.origin}: the low-pass of the sensor of {each.quantity}, '
                f'{each.low_pass_hz:g} Hz, was undone'
            )
        if each.cyclic_m:
            notes.append(
                f'{one.origin}: a motion that repeats in each fringe of '
                f'{1e9 * each.fringe_m:.4g} nm counts as cyclic error of the interferometer, '
                f'{1e9 * each.cyclic_m:.2g} nm'
            )
        if each.is_trace and each.unit == 'm' and noise < allowance.reading_m:
            notes.append(
                f'{one.origin}: {each.quantity} has a noise of {1e9 * noise:.2g} nm; the error of '
                f'a reading is {1e9 * allowance.reading_m:.2g} nm, that allowed for the model'
            )
        coarse = _COARSE * rounding_of(each.values) if each.is_trace and not each.sigma else 0.0
        if each.unit == 'm' and allowance.reading_m < noise <= coarse:
            notes.append(
                f'{one.origin}: {each.quantity} is rounded by more than its noise: the error of a '
                f'reading is {1e9 * noise:.2g} nm, as consecutive readings share it'
            )
        if each.slow_s > SAID_SLOW_S:
            text = (
                f'{one.origin}: the sensor of {each.quantity} is slow, as behind a low-pass of '
                f'{0.5 / (math.pi * each.slow_s):.2g} Hz'
            )
            if each.noise_lasts_s:
                text += '; its noise came before that: neighbouring readings share it'
            notes.append(text)
    rivals = [each for each in others if each.chi_square - best.chi_square < RULED_OUT_BY]
    return problem, found, tuple(rivals), tuple(notes)


def refine_noise(
    problem: Problem, place: Array, allowance: Allowance, outliers: float
) -> tuple[Problem, list[Minimum]]:
    """Continue from a place with noise, clocks and outliers estimated after each search."""
    found = list[Minimum]()
    for _ in range(ROUNDS_OF_NOISE):
        before_s = _sensors_of(problem)
        problem = _with_noise(replace(problem, allowance=None), place, outliers)
        problem = replace(problem, allowance=allowance, metrics=())
        problem = problem.measured_at(problem.predicted([problem.stand(place)])[0])
        found.append(search(problem, place))
        place = found[-1].place
        if np.all(np.abs(np.subtract(_sensors_of(problem), before_s)) < CLOSE_S):
            break
    return problem, found


def to_plain(problem: Problem, loose: Minimum) -> tuple[Problem, list[Minimum]]:
    """Continue from a loose minimum with a smaller allowance, then without; clocks follow."""
    problem, found = _on_time(problem, loose.place), [loose]
    for stage in (LOOSE[1], None):
        problem = replace(problem, allowance=stage, metrics=())
        found.append(search(problem, found[-1].place, LOOSE_EVALUATIONS_MAX))
    return problem, found[1:]


def _on_time(problem: Problem, place: Array) -> Problem:
    """Return the problem with the sensors that fit the motion from sample to sample best."""
    stand, shifts, experiments = problem.stand(place), list[float](), list[Experiment]()
    for number, one in enumerate(problem.experiments):
        late_s = 0.0
        if isinstance(one.drive, Voltage):
            late_s, slow_s = sensor_near(one, stand, problem.shift_s(number))
            first, *others = one.seen
            one = replace(one, seen=(replace(first, slow_s=slow_s), *others))  # noqa: PLW2901
        shifts.append(late_s)
        experiments.append(one)
    return replace(problem, experiments=tuple(experiments), shifts_s=tuple(shifts), metrics=())


def _sensors_of(problem: Problem) -> list[float]:
    """Return the delays of the clocks and the time constants of the sensors, s."""
    return [*problem.shifts_s, *(each.slow_s for _, _, each, _ in problem.seen)]


def _with_sensor(
    problem: Problem, sensor: tuple[tuple[float, ...], float]
) -> tuple[Problem, list[Minimum]]:
    """Search from the start with given delays and a common low-pass of all sensors."""
    shifts_s, slow_s = sensor
    experiments = (
        replace(one, seen=tuple(replace(each, slow_s=slow_s) for each in one.seen))
        for one in problem.experiments
    )
    problem = replace(problem, experiments=tuple(experiments), shifts_s=shifts_s, metrics=())
    loose = search_or_nothing(replace(problem, allowance=LOOSE[0]), problem.start)
    return to_plain(problem, loose)


def _with_noise(problem: Problem, place: Array, outliers: float) -> Problem:
    """Return the problem with noise, clocks and outliers from the residuals at a place."""
    [predicted] = problem.predicted([problem.stand(place)])
    problem = problem.measured_at(predicted)
    metrics, shifts = iter(problem.metrics), list(problem.shifts_s)
    experiments, errors = list[Experiment](), list[tuple[float, ...]]()
    missed_numbers: dict[str, list[float]] = {}
    for number, (one, known) in enumerate(
        zip(problem.experiments, problem.noise.values, strict=True)
    ):
        seen, noises = list[Seen](), list[float]()
        for each, found, noise in zip(one.seen, predicted[number], known, strict=True):
            if not each.is_trace:
                missed = float(found.values[0] - each.values[0])
                missed_numbers.setdefault(each.quantity, []).append(missed)
                seen.append(each)
                noises.append(noise)
                continue
            sizes, left = next(metrics).of_sensor(found.values - each.values)
            late_s, slow_s = slower(each.slow_s, *sizes[2:4].tolist())
            if not seen:
                shifts[number] += late_s
            out = lone_outliers(left, outliers or math.inf)
            keeps, rounding = 0.0, rounding_of(each.values[~out])
            if slow_s:
                period_s = float(np.median(np.diff(each.time_s)))
                share = math.exp(-period_s / slow_s)
                keeps = share if keeps_noise(left[~out], share, rounding) else 0.0
            kept = replace(
                each,
                values=each.values[~out],
                time_s=each.time_s[~out],
                left_out=each.left_out + int(out.sum()),
                slow_s=slow_s,
                noise_lasts_s=slow_s if keeps else 0.0,
            )
            seen.append(kept)
            shown = max(noise_of(left[~out], keeps, rounding), _COARSE * rounding)
            noises.append(max(each.sigma or shown or noise, FINEST))
        experiments.append(replace(one, seen=tuple(seen)))
        errors.append(tuple(noises))
    for number, one in enumerate(experiments):  # numbers without a given error
        errors[number] = tuple(
            noise
            if each.is_trace or each.sigma is not None
            else float(np.sqrt(np.mean(np.square(missed_numbers[each.quantity]))))
            for each, noise in zip(one.seen, errors[number], strict=True)
        )
    return replace(
        problem,
        experiments=tuple(experiments),
        noise=StandardErrors(known=True, values=tuple(errors)),
        shifts_s=tuple(shifts),
        metrics=(),
    )
