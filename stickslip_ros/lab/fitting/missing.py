# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
What a fit may lack: each suspect is tested by what it would add to the prediction.

Rao's score test: the fall of chi-square, of noise and sensor alone, with one more parameter free,
to first order and with all the others following. A part that is off is switched on for the test.
Two suspects have no parameter: a cyclic error of the sensor, and a friction that changes along the
way, which shows in the lengths of the steps.

"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import chi2

from stickslip_ros.arrays import Array
from stickslip_ros.drive.build import friction_limit_n
from stickslip_ros.errors import StickSlipError
from stickslip_ros.lab.experiments.experiment import Seen, Voltage
from stickslip_ros.lab.experiments.sensor_clock import falls_of
from stickslip_ros.lab.fitting.assumed import FEET_NUMBER, slopes_of_constants
from stickslip_ros.lab.fitting.free import LOAD, OF_A_FALL, TYPICAL
from stickslip_ros.lab.fitting.problem import Predicted, Problem
from stickslip_ros.parameters import Parameters, Scalar

_TRIED = (
    'contact.friction',
    'contact.prefactor',
    'contact.radius',
    'runner.mass',
    'runner.damping',
    'actuator.gain',
    'amplifier.slew_rate',
    'actuator.hysteresis',
    'actuator.creep',
    'actuator.resonance',
    'actuator.damping_ratio',
    'amplifier.bandwidth',
    'actuator.gain_tolerance',
)
"""Parameters that may be missing. A part that is off gets a usual value: a little damping showed
less of 20 N s/m than a resonance that was not there."""
_BESIDE: Mapping[str, Mapping[str, Scalar]] = {
    'actuator.resonance': {'actuator.damping_ratio': 0.1}
}
"""Parameters changed together: a resonance that rings for long has no rival."""
_FRAMES_HZ = 1.5e3, 3e3, 5e3, 8e3
_FRAME: Mapping[str, float] = {'frame.mass': 0.1, 'frame.damping_ratio': 0.1}
"""Resonances of a frame that are tried, damped as broadly as they are apart."""
_GROWTH, _GUIDE_SHARE, _LOAD_SHARE = 0.01, 0.02, 0.01
"""Growth of friction per e-fold of velocity, or of time at rest; share of the normal force that a
guide has; load per friction."""
CYCLIC = {f'cyclic error of {1e9 * each:.4g} nm': each for each in (316.4e-9, 158.2e-9)}
"""Fringes of an interferometer with a helium-neon laser, by name: single and double pass, m."""
PLACE = 'friction by place'
_RATE = 'contact.friction_rate'
_OF_FEET = 'count', 'share', 'weight', 'radius', 'gain', 'delay'
_WAYS = 6  # waves of friction along the way of a recording
_SHARE = 3e-3  # relative change of a value
_RANK = 1e-5  # least singular value, per largest, of independent free parameters
_FALL_SHARE = 0.01  # error of a fall to first order, per chi-square
_CHANCE = 1e-4  # largest chance of a fall that tells
TELLING_SHARE = 0.05
"""Least fall as a share of chi-square above the number of readings, which noise does not
explain."""


class Missing(NamedTuple):
    """A suspect that would improve a fit."""

    name: str
    chi_square: float  # before, of noise and sensor alone
    expected: float  # after, to first order
    moves: tuple[float, ...]  # changes of the natural coordinates of the free parameters
    odds: float  # against the best of the other suspects, or none; below 1 for those


def missing_from(problem: Problem, place: Array) -> tuple[Missing, ...]:
    """
    Return the suspects that improve a fit by more than chance, the best first.

    The values would move as in a fit with what the model owes.

    """
    if not problem.has_traces:
        return ()
    stand = problem.stand(place)
    [here] = problem.predicted([stand])
    plain = replace(problem, allowance=None).measured_at(here)
    basis, _ = _solved(plain, place)
    _, follow = _solved(problem, place)
    left = _without(basis, plain.whitened(here))
    before, found = float(left @ left), dict[str, Missing]()
    least = TELLING_SHARE * (before - problem.count)
    for suspect in _suspects(problem, stand, here, place):
        whole = suspect.added(plain)
        slopes, count = _without(basis, whole), whole.shape[1]
        amounts, *_ = np.linalg.lstsq(slopes, -left, rcond=_RANK)
        fall = before - float(np.sum((left + slopes @ amounts) ** 2))
        fall -= math.log(problem.count) * (count - 1)  # as by the criterion of Schwarz
        if fall < max(chi2.isf(_CHANCE, 1), least) or (
            suspect.may_only_grow and amounts[0] <= 0.0
        ):
            continue
        moves = tuple((follow @ (suspect.added(problem) @ amounts)).tolist())
        one = Missing(suspect.name, before, before - fall, moves, 0.0)
        if suspect.name not in found or one.expected < found[suspect.name].expected:
            found[suspect.name] = one
    ranked = sorted(found.values(), key=lambda each: each.expected)
    return tuple(each._replace(odds=_odds(each, ranked, problem.count)) for each in ranked)


def _solved(problem: Problem, place: Array) -> tuple[Array, Array]:
    """Return a basis of the slopes, and how the minimum follows residuals."""
    basis, triangle = np.linalg.qr(problem.slopes(place))
    return basis, -np.linalg.pinv(triangle, rcond=_RANK) @ basis.T


def _without(basis: Array, columns: Array) -> Array:
    """Return what the free parameters do not explain."""
    return np.asarray(columns - basis @ (basis.T @ columns))


def _odds(one: Missing, ranked: Sequence[Missing], count: int) -> float:
    """Return the odds of a suspect against the best other, or none; a slope errs by a share."""
    rival = min([each.expected for each in ranked if each is not one], default=one.chi_square)
    unit = max(ranked[0].expected / count, _FALL_SHARE * one.chi_square, 1.0)
    return math.exp(float(np.clip(0.5 * (rival - one.expected) / unit, -700.0, 700.0)))


class Suspect(NamedTuple):
    """What may be missing: its name, what it adds to residuals (n, k), and if it has one sign."""

    name: str
    added: Callable[[Problem], Array]
    may_only_grow: bool = False


def _suspects(
    problem: Problem, stand: Parameters, here: Predicted, place: Array
) -> Iterator[Suspect]:
    tried = _stands(stand, {one.name for one in problem.free})
    flat = stand.flat()
    predicted = problem.predicted([changed for _, changed in tried])
    for (name, _), there in zip(tried, predicted, strict=True):
        may_only_grow = name not in {LOAD, _RATE} and not flat.get(name, 0.0)
        yield Suspect(name, partial(_columns, here, [there]), may_only_grow)
    falls = [there for (name, _), there in zip(tried, predicted, strict=True) if name in OF_A_FALL]
    if len(falls) > 1:  # they act together
        yield Suspect(OF_A_FALL[0], partial(_columns, here, falls))
    yield Suspect(FEET_NUMBER, lambda one: slopes_of_constants(one, place, [FEET_NUMBER]))
    for name, columns in _of_position(problem, here):
        moved = [_moved(here, problem, each) for each in columns]
        yield Suspect(name, partial(_columns, here, moved))


def _columns(here: Predicted, there: Sequence[Predicted], problem: Problem) -> Array:
    """Return the residuals of predictions less another, shape (n, k)."""
    return np.column_stack([problem.whitened(each, here) for each in there])


def _stands(stand: Parameters, free: set[str]) -> list[tuple[str, Parameters]]:
    """Return stands with a fixed parameter changed a little, or a part switched on."""
    flat, feet = stand.flat(), stand.feet
    changes = list[tuple[str, Mapping[str, Any]]]()
    for name in _TRIED:
        value = float(flat[name])
        if name in free:
            continue
        if value:
            changes.append((name, {name: value * (1.0 + _SHARE)}))
        elif name in TYPICAL:
            changes.append((name, {name: TYPICAL[name], **_BESIDE.get(name, {})}))
    resonance = 'frame.resonance'
    if not flat[resonance]:
        changes += [(resonance, {resonance: hertz, **_FRAME}) for hertz in _FRAMES_HZ]
    for name in (_RATE, 'contact.friction_ageing'):
        if name not in free and not flat[name]:
            changes.append((name, {name: _GROWTH}))
    if LOAD not in free:
        changes.append((LOAD, {LOAD: flat[LOAD] + _LOAD_SHARE * friction_limit_n(stand)}))
    if all(feet.gain):
        normal = sum(count * share for count, share in zip(feet.count, feet.share, strict=True))
        guide = 1, _GUIDE_SHARE * normal, 0.0, feet.radius[0], 0.0, 0.0
        pairs = zip(_OF_FEET, guide, strict=True)
        changes.append(('a guide', {f'feet.{key}': (*getattr(feet, key), x) for key, x in pairs}))
    found = list[tuple[str, Parameters]]()
    for name, each in changes:
        with suppress(StickSlipError):  # an impossible stand is no suspect
            found.append((name, stand.updated(each)))
    return found


def _of_position(problem: Problem, here: Predicted) -> Iterator[tuple[str, list[list[Array]]]]:
    """Yield suspects that depend on the position: for each column what each trace would gain."""
    traces = [
        (one.drive, each, model.values)
        for (one, each, _), model in zip(problem.seen, here, strict=True)
        if isinstance(one.drive, Voltage)
    ]
    for name, fringe_m in CYCLIC.items():
        phases = [2.0 * np.pi * each.values / fringe_m for _, each, _ in traces]
        yield name, [[of(phase) for phase in phases] for of in (np.sin, np.cos)]
    ways = [(wave, of) for wave in range(1, _WAYS + 1) for of in (np.sin, np.cos)]
    yield PLACE, [[_step_lengths(*trace, wave, of) for trace in traces] for wave, of in ways]


def _step_lengths(
    drive: Voltage, seen: Seen, model: Array, waves: int, of: Callable[[Array], Array]
) -> Array:
    """Return the motion by steps whose length changes along the way."""
    falls_s = falls_of(drive)[0] + seen.sensor.late_s
    at = np.interp(falls_s, seen.time_s, model)
    sizes = of(2.0 * np.pi * waves * (at - model.min()) / max(np.ptp(model), 1e-12))
    over = np.searchsorted(falls_s, seen.time_s, side='right')
    return np.append(np.zeros(1), np.cumsum(sizes))[over]


def _moved(here: Predicted, problem: Problem, column: Sequence[Array]) -> Predicted:
    """Return a prediction with a column added to its traces."""
    added, scale = iter(column), 1e-9
    return [
        replace(model, values=model.values + scale * next(added)) if each.is_trace else model
        for (_, each, _), model in zip(problem.seen, here, strict=True)
    ]
