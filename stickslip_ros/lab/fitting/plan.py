# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Plan the measurements that would reduce the errors of a fit most.

The fitted stand predicts each candidate; its slopes J, whitened as those of the fit, add J'J to
the information, with columns for the assumed constants. The candidate with the smallest volume of
the errors (D-optimal) comes first, then the best together with it. The expected errors are as true
as the fit.

"""

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.errors import OutOfRange, StickSlipError
from stickslip_ros.lab.experiments.experiment import (
    AtRest,
    Experiment,
    SawtoothSteps,
    Seen,
    Voltage,
)
from stickslip_ros.lab.experiments.predict import predict
from stickslip_ros.lab.fitting.assumed import slopes_of_constants
from stickslip_ros.lab.fitting.free import TINY
from stickslip_ros.lab.fitting.problem import StandardErrors
from stickslip_ros.lab.fitting.result import FitResult
from stickslip_ros.lab.runs.sawtooth_run import full_stroke_m
from stickslip_ros.parameters import Scalar

MOST = 20
_PRELOADS_N = (0.1, 0.2, 0.35, 0.5, 0.7, 1.0)
_WAVES = (
    *((share, hertz, 12) for hertz in (200.0, 600.0) for share in (0.4, 0.7, 1.0)),
    *((share, 250.0, 4) for share in (-0.1, -0.4)),
)
"""Shares of the range of the amplifier, below 0 of triangles, frequencies (Hz), and cycles."""
REST_S = 3e-3  # before and after a wave, for the ring-down
WEIGHED, PUSHED = 'runner.mass', 'holding_force_n'
BY_HAND = {WEIGHED: 0.01, PUSHED: 0.03}
"""Relative errors of a weighed mass, and of a force that a spring balance shows."""


class Candidate(NamedTuple):
    """A possible measurement: in words, as lines of ``stickslip command``, and itself."""

    words: str
    commands: tuple[str, ...]
    experiment: Experiment | None  # None of a weighing


@dataclass(frozen=True, eq=False)
class Plan:
    """Planned measurements, the best first."""

    names: tuple[str, ...]  # of the free parameters
    errors_now: Array  # relative standard errors, shape (free,)
    chosen: tuple[Candidate, ...]
    errors: Array  # expected after each measurement, shape (chosen, free)


def plan(fit: FitResult, count: int = 5) -> Plan:
    """
    Return the measurements that would reduce the errors of a fit most, each once.

    The candidates are readings as those of the fit under other preloads, voltages and
    frequencies, small triangles, and a weighed runner. Raises OutOfRange for an impossible number,
    or if the fit determines no parameter.

    """
    if not 1 <= count <= MOST:
        limit = f'not from 1 to {MOST}'
        raise OutOfRange('number of measurements', count, '', limit, 'take 5')
    whole = fit.uncertainty.whole_z  # of the assumed constants too, which all readings share
    finite = np.flatnonzero(np.isfinite(np.diag(whole)))
    known = finite[finite < len(fit.estimates)]
    if not len(known):
        hint = 'free parameters that the measurements depend on'
        raise OutOfRange('determined parameters', 0, '', 'too few', hint)
    inside, shown = np.ix_(finite, finite), slice(len(known))
    information = np.linalg.inv(whole[inside])
    gains = [(each, information_of(fit, each)[inside]) for each in candidates_of(fit)]
    chosen, errors = list[Candidate](), list[Array]()
    for _ in range(min(count, len(gains))):
        after = [np.linalg.inv(information + gain)[shown, shown] for _, gain in gains]
        best = int(np.argmin([np.linalg.slogdet(each)[1] for each in after]))
        candidate, gain = gains.pop(best)  # twice it would err alike
        information = information + gain
        chosen.append(candidate)
        errors.append(np.sqrt(np.diag(after[best])))
    estimates = [fit.estimates[k] for k in known]
    names = tuple(one.name for one in estimates)
    relative = np.array([one.slope(one.value) / max(one.value, TINY) for one in estimates])
    now = relative * fit.uncertainty.errors_z[known]
    return Plan(names, now, tuple(chosen), relative * np.array(errors))


def candidates_of(fit: FitResult) -> list[Candidate]:
    """Return possible measurements like those of a fit."""
    amplifier, found = fit.parameters.amplifier, list[Candidate]()
    top_v, has_traces = amplifier.voltage_max - amplifier.voltage_min, fit.problem.has_traces
    for preload_n in _PRELOADS_N:
        for share, hertz, cycles in _WAVES if has_traces else _WAVES[:-2]:
            volts, half_ms = round(abs(share) * top_v), 500.0 / hertz
            kind, command = 'saw-teeth', f'sawtooth {volts}V {hertz:g}Hz {cycles}'
            if share < 0.0:
                ends = f'{half_ms:g}ms {volts}V {2.0 * half_ms:g}ms 0V --cycles {cycles}'
                kind, command = 'triangles', f'waveform 0s 0V {ends}'
            words = f'{preload_n:g} N, {kind} of {volts} V, {hertz:g} Hz'
            one = _experiment(fit, preload_n, math.copysign(volts, share), hertz, cycles)
            found.append(Candidate(words, (f'preload {preload_n:g}N', command), one))
    if WEIGHED in {one.name for one in fit.estimates}:
        words = f'weigh the runner to {100.0 * BY_HAND[WEIGHED]:g} % (--known {WEIGHED}=...)'
        found.append(Candidate(words, (), None))
    if has_traces:
        words = 'push the runner with a spring balance until it slips, to '
        words += f'{100.0 * BY_HAND[PUSHED]:g} % ({PUSHED})'
        seen = (Seen(PUSHED, np.zeros(1)),)
        pushed = Experiment('planned', _like(fit)[0].settings, AtRest(), seen)
        found.append(Candidate(words, (), pushed))
    return found


def _experiment(
    fit: FitResult, preload_n: float, volts: float, hertz: float, cycles: int
) -> Experiment:
    """Return an experiment like those of the fit under a saw-tooth, or a triangle below 0 V."""
    stand, (like, error) = fit.parameters, _like(fit)
    settings: dict[str, Scalar] = {**like.settings, 'stand.preload': preload_n}
    if isinstance(like.drive, SawtoothSteps):
        stroke_m = min(volts * stand.actuator.gain, full_stroke_m(stand))
        drive = like.drive._replace(amplitude_m=stroke_m, frequency_hz=hertz, voltage_v=0.0)
        return Experiment('planned', settings, drive, like.seen, like.load_n)
    period_s = 1.0 / hertz
    ends_s = REST_S + period_s * np.arange(1, cycles + 1)
    fall_s = volts / stand.amplifier.slew_rate if volts > 0.0 else 0.5 * period_s
    times_s = np.column_stack((ends_s - fall_s, ends_s)).ravel()
    corners_s = np.concatenate(([0.0, REST_S], times_s, ends_s[-1:] + REST_S))
    corners_v = [0.0, 0.0, *[abs(volts), 0.0] * cycles, 0.0]
    voltage = Voltage(np.column_stack((corners_s, corners_v)))
    seen = like.seen[0]
    apart_s = float(np.median(np.diff(seen.time_s)))
    time_s: Array = np.arange(0.0, voltage.lasts_s, apart_s, dtype=np.float64)
    looked = Seen(seen.quantity, np.zeros(len(time_s)), time_s, error)
    return Experiment('planned', settings, voltage, (looked,), like.load_n)


def _like(fit: FitResult) -> tuple[Experiment, float]:
    """Return the experiment that candidates imitate, and its standard error."""
    for one, _, error in fit.problem.seen:
        if isinstance(one.drive, SawtoothSteps | Voltage):
            return one, error
    hint = 'fit a recording, forces or step lengths'
    raise OutOfRange('readings for a plan', 0, '', 'too few', hint)


def information_of(fit: FitResult, candidate: Candidate) -> Array:
    """Return the information on coordinates and constants, shape (free + constants, same)."""
    problem, place, constants = fit.problem, fit.found.place, list(fit.uncertainty.shares)
    added = np.zeros((len(place) + len(constants),) * 2)
    if candidate.experiment is None:
        number = [one.name for one in fit.estimates].index(WEIGHED)
        added[number, number] = BY_HAND[WEIGHED] ** -2
        return added
    stand = problem.stand(place)
    try:
        [found] = predict(stand, [candidate.experiment])
    except StickSlipError:  # an impossible measurement has no information
        return added
    [seen], [model] = candidate.experiment.seen, found
    one = replace(candidate.experiment, seen=(replace(seen, values=model.values),))
    error = _like(fit)[1] * np.sqrt(fit.uncertainty.variance_scale)
    if seen.quantity == PUSHED:
        error = BY_HAND[PUSHED] * abs(float(model.values[0]))
    noise = StandardErrors(True, (float(error),))
    planned = replace(problem, experiments=(one,), noise=noise, known={}).measured_at(found)
    slopes = planned.slopes(place) @ np.linalg.inv(fit.uncertainty.per_natural)
    if constants:
        slopes = np.hstack((slopes, slopes_of_constants(planned, place, constants)))
    return np.asarray(slopes.T @ slopes)
