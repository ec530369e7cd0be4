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
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from scipy.stats import chi2

from stickslip_ros.arrays import Array
from stickslip_ros.drive.build import friction_limit_n
from stickslip_ros.errors import StickSlipError
from stickslip_ros.lab.experiments.experiment import Seen, Voltage
from stickslip_ros.lab.experiments.sensor_clock import falls_of
from stickslip_ros.lab.fitting.assumed import FEET_NUMBER, slopes_of_constants
from stickslip_ros.lab.fitting.free import LOAD, LOG_MAX, OF_A_FALL, TINY, TYPICAL
from stickslip_ros.lab.fitting.problem import EFFECT, STEP, Predicted, Problem
from stickslip_ros.parameters import Parameters, Scalar

_TRIED = (
    *('contact.friction', 'contact.prefactor', 'contact.radius', 'runner.mass', 'actuator.gain'),
    *('amplifier.slew_rate', *TYPICAL),
)
"""Parameters that may have another value."""
_LITTLE = 0.01
"""Growth of friction per e-fold of velocity, or of time at rest; share of the normal force that a
guide has; load per friction."""
_SWITCHED_ON: tuple[Mapping[str, Scalar], ...] = (
    *({name: value} for name, value in TYPICAL.items() if name != 'actuator.resonance'),
    {'actuator.resonance': TYPICAL['actuator.resonance'], 'actuator.damping_ratio': 0.1},
    *(
        {'frame.resonance': hertz, 'frame.mass': 0.1, 'frame.damping_ratio': 0.1}
        for hertz in (1.5e3, 3e3, 5e3, 8e3)
    ),
    {'contact.friction_rate': _LITTLE},
    {'contact.friction_ageing': _LITTLE},
)
"""
Parts that may be off, by their first parameter, each with a usual value.

A little damping showed less of 20 N s/m than a resonance that was not there. One that rings for
long has no rival; those of a frame are damped as broadly as they are apart.

"""
CYCLIC = {f'cyclic error of {1e9 * each:.4g} nm': each for each in (316.4e-9, 158.2e-9)}
"""Fringes of an interferometer with a helium-neon laser, by name: single and double pass, m."""
_WAYS = 6  # waves of friction along the way of a recording
_FALL_SHARE = 0.01  # error of a fall to first order, per chi-square
TELLING_SHARE = 0.05
"""Least fall as a share of chi-square above the number of readings, which noise does not
explain."""
CHANCE, ODDS_SURE = 1e-4, 20.0  # largest chance of a fall that tells, least odds of a sure suspect


Suspect: TypeAlias = tuple[str, Callable[[Problem], Array], bool]
"""What may be missing: its name, what it adds to residuals, shape (n, k), if it may only grow."""


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
    for name, added, may_only_grow in _suspects(problem, stand, here, place):
        whole = added(plain)
        slopes, count = _without(basis, whole), whole.shape[1]
        amounts, *_ = np.linalg.lstsq(slopes, -left, rcond=EFFECT)
        fall = before - float(np.sum((left + slopes @ amounts) ** 2))
        fall -= math.log(problem.count) * (count - 1)  # as by the criterion of Schwarz
        if fall < max(chi2.isf(CHANCE, 1), least) or (may_only_grow and amounts[0] <= 0.0):
            continue
        moves = tuple((follow @ (added(problem) @ amounts)).tolist())
        one = Missing(name, before, before - fall, moves, 0.0)
        if name not in found or one.expected < found[name].expected:
            found[name] = one
    ranked = sorted(found.values(), key=lambda each: each.expected)
    return tuple(each._replace(odds=_odds(each, ranked, problem.count)) for each in ranked)


def _solved(problem: Problem, place: Array) -> tuple[Array, Array]:
    """Return a basis of the slopes, and how the minimum follows residuals."""
    basis, triangle = np.linalg.qr(problem.slopes(place))
    return basis, -np.linalg.pinv(triangle, rcond=EFFECT) @ basis.T


def _without(basis: Array, columns: Array) -> Array:
    """Return what the free parameters do not explain."""
    return np.asarray(columns - basis @ (basis.T @ columns))


def _odds(one: Missing, ranked: Sequence[Missing], count: int) -> float:
    """Return the odds of a suspect against the best other, or none; a slope errs by a share."""
    rival = min([each.expected for each in ranked if each is not one], default=one.chi_square)
    unit = max(ranked[0].expected / count, _FALL_SHARE * one.chi_square, 1.0)
    return math.exp(min(0.5 * (rival - one.expected) / unit, LOG_MAX))


def _suspects(
    problem: Problem, stand: Parameters, here: Predicted, place: Array
) -> Iterator[Suspect]:
    tried = _stands(stand, {one.name for one in problem.free})
    flat = stand.flat()
    predicted = problem.predicted([changed for _, changed in tried])
    for (name, _), there in zip(tried, predicted, strict=True):
        may_only_grow = name not in {LOAD, 'contact.friction_rate'} and not flat.get(name, 0.0)
        yield name, partial(_columns, here, [there]), may_only_grow
    falls = [there for (name, _), there in zip(tried, predicted, strict=True) if name in OF_A_FALL]
    if len(falls) > 1:  # they act together
        yield OF_A_FALL[0], partial(_columns, here, falls), False
    yield FEET_NUMBER, lambda one: slopes_of_constants(one, place, [FEET_NUMBER]), False
    waves = (np.sin, np.cos)
    for name, fringe_m in CYCLIC.items():
        moved = [_moved(here, problem, partial(_cyclic, fringe_m, of)) for of in waves]
        yield name, partial(_columns, here, moved), False
    ways = [partial(_step_lengths, k, of) for k in range(1, _WAYS + 1) for of in waves]
    moved = [_moved(here, problem, each) for each in ways]
    yield 'friction by place', partial(_columns, here, moved), False


def _columns(here: Predicted, there: Sequence[Predicted], problem: Problem) -> Array:
    """Return the residuals of predictions less another, shape (n, k)."""
    return np.column_stack([problem.whitened(each, here) for each in there])


def _stands(stand: Parameters, free: set[str]) -> list[tuple[str, Parameters]]:
    """Return stands with a fixed parameter changed a little, or a part switched on."""
    flat, feet = stand.flat(), stand.feet
    fixed = [name for name in _TRIED if name not in free and flat[name]]
    changes: list[tuple[str, Mapping[str, Any]]]
    changes = [(name, {name: float(flat[name]) * math.exp(STEP)}) for name in fixed]
    parts = [(next(iter(part)), part) for part in _SWITCHED_ON]
    changes += [(name, part) for name, part in parts if not flat[name] and name not in free]
    if LOAD not in free:
        changes.append((LOAD, {LOAD: flat[LOAD] + _LITTLE * friction_limit_n(stand)}))
    if all(feet.gain):
        share = _LITTLE * float(np.dot(feet.count, feet.share))
        guide = {'count': 1, 'share': share, 'radius': feet.radius[0]}
        rows = ((key, (*each, guide.get(key, 0.0))) for key, each in vars(feet).items())
        changes.append(('a guide', {f'feet.{key}': each for key, each in rows}))
    found = list[tuple[str, Parameters]]()
    for name, each in changes:
        with suppress(StickSlipError):  # an impossible stand is no suspect
            found.append((name, stand.updated(each)))
    return found


def _moved(
    here: Predicted, problem: Problem, added: Callable[[Voltage, Seen, Array], Array]
) -> Predicted:
    """Return a prediction with something added to its traces, nm."""
    return [
        replace(model, values=model.values + 1e-9 * added(one.drive, each, model.values))
        if isinstance(one.drive, Voltage)
        else model
        for (one, each, _), model in zip(problem.seen, here, strict=True)
    ]


def _cyclic(
    fringe_m: float, of: Callable[[Array], Array], _: Voltage, seen: Seen, __: Array
) -> Array:
    """Return the cyclic error of an interferometer, of size 1."""
    return of(2.0 * np.pi * seen.values / fringe_m)


def _step_lengths(
    waves: int, of: Callable[[Array], Array], drive: Voltage, seen: Seen, model: Array
) -> Array:
    """Return the motion by steps whose length changes along the way."""
    falls_s = falls_of(drive)[0] + seen.sensor.late_s
    at = np.interp(falls_s, seen.time_s, model)
    sizes = of(2.0 * np.pi * waves * (at - model.min()) / max(np.ptp(model), TINY))
    over = np.searchsorted(falls_s, seen.time_s, side='right')
    return np.append(np.zeros(1), np.cumsum(sizes))[over]
