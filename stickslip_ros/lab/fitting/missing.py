# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Suspects: effects that a stand may lack, tested by the change of the prediction with each.

The test is Rao's score test: the fall of chi-square, of noise and sensor alone, to first order, if
one more parameter is free and all others follow. A part that is off is switched on for the test.
Two suspects have no parameter: a cyclic error of the sensor, and a friction that changes along the
way, which changes the lengths of the steps.

"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from scipy.special import softmax

from stickslip_ros.arrays import Array
from stickslip_ros.drive.build import friction_limit_n
from stickslip_ros.errors import StickSlipError
from stickslip_ros.lab.experiments.experiment import Readout, Voltage
from stickslip_ros.lab.experiments.sensor_clock import falls_of
from stickslip_ros.lab.fitting.assumed import (
    FEET_NUMBER,
    shares_of_ranges,
    slopes_of_constants,
)
from stickslip_ros.lab.fitting.free import LOAD, OF_A_FALL, TINY, TYPICAL
from stickslip_ros.lab.fitting.metric import Allowance
from stickslip_ros.lab.fitting.problem import EFFECT, STEP, Predicted, Problem
from stickslip_ros.parameters import Parameters, spec_of, specs

_LITTLE = 0.01  # force that is switched on, per friction of all feet
_TRIED = tuple(
    name
    for name, spec in specs().items()
    if ((spec.cause or spec.typical) and not spec.substitute) or name == LOAD
)
"""Parameters that are tested."""
_TOGETHER: Mapping[str, Sequence[Mapping[str, float]]] = {
    'actuator.resonance': [
        {'actuator.resonance': TYPICAL['actuator.resonance'], 'actuator.damping_ratio': 0.1}
    ],
    'frame.resonance': [
        {'frame.resonance': hertz, 'frame.mass': 0.1, 'frame.damping_ratio': 0.1}
        for hertz in (1.5e3, 3e3, 5e3, 8e3)
    ],
}
"""
Parts with several parameters that may be off, by their first parameter.

With little damping, a resonance that was absent explained more than the true damping of 20 N s/m.
The resonances of a frame are damped so that neighbouring ones overlap.

"""
CYCLIC = {f'cyclic error of {1e9 * each:.4g} nm': each for each in (316.4e-9, 158.2e-9)}
"""Fringes of an interferometer with a helium-neon laser, by name: single and double pass, m."""
SENSOR_DRIFT = 'a drift of the sensor'
_WAYS = 6  # waves of friction along the way of a recording
_FALL_SHARE = 0.01  # first-order error of a fall, per excess of chi-square over the readings
_LEAST_SHARE = 0.3
"""Share of the least allowed errors in the test: with all of them, a ringing piezo was mistaken
for a rougher contact."""
_FAR = 20.0  # most change of a coordinate that is reported, in factors of e
_ODDS_LEAST = 1e-3  # least odds of a listed explanation
ODDS_SURE = 20.0  # least odds at which a cyclic error is solved for


Suspect: TypeAlias = tuple[str, Callable[[Problem], Array], bool]
"""Name of an effect, function of its columns of residuals, shape (n, k), and may_only_grow."""


class Missing(NamedTuple):
    """A suspect that would improve a fit."""

    name: str
    chi_square: float  # of the fit, of noise and sensor alone
    expected: float  # with the suspect free, to first order
    moves: tuple[float, ...]  # changes of the natural coordinates, at most _FAR each
    odds: float  # posterior odds of this explanation against all others and none

    @property
    def chance(self) -> float:
        """Posterior probability of this explanation."""
        return self.odds / (1.0 + self.odds)


def missing_from(problem: Problem, place: Array) -> tuple[Missing, ...]:
    """
    Return explanations of a misfit, the likeliest first: suspects, and the best one with another.

    Each suspect, each pair and no suspect have a posterior probability, from the fall of
    chi-square with the least errors of the model, less the cost of each number by Schwarz's
    criterion. The moves are those of a fit with all allowed errors of the model.

    """
    if not problem.has_traces:
        return ()
    stand = problem.stand(place)
    [here] = problem.predicted([stand])
    least = Allowance(*(_LEAST_SHARE * each for each in Allowance()))
    plain, tested = (replace(problem, allowance=each).measured_at(here) for each in (None, least))
    (basis, _), (basis_plain, _), (_, follow) = (
        _solved(each, place) for each in (tested, plain, problem)
    )
    left, left_plain = (
        _without(of, one.whitened(here)) for of, one in ((basis, tested), (basis_plain, plain))
    )
    suspects = list(_suspects(problem, stand, here, place))
    columns = [_without(basis, added(tested)) for _, added, _ in suspects]
    alone = [_fall(left, each, may_only_grow=suspects[k][2])[0] for k, each in enumerate(columns)]
    order = sorted(range(len(suspects)), key=lambda k: alone[k])
    forms = {suspects[k][0]: k for k in order}  # the best of each name
    falls: dict[tuple[int, ...], float] = {(k,): alone[k] for k in forms.values()}
    pairs = [(order[-1], k) for k in forms.values() if k != order[-1]]
    pair_falls = [_fall(left, np.hstack([columns[k] for k in each]))[0] for each in pairs]
    both = int(np.argmax(pair_falls))
    falls[pairs[both]] = pair_falls[both]
    sizes = {each: sum(columns[k].shape[1] for k in each) for each in falls}
    odds = _odds(falls, sizes, float(left @ left), problem.count)
    before, found = float(left_plain @ left_plain), list[Missing]()
    for each in sorted(
        (one for one in odds if odds[one] > _ODDS_LEAST), key=lambda one: -odds[one]
    ):
        whole, loose = (np.hstack([suspects[k][1](one) for k in each]) for one in (plain, problem))
        fall, amounts = _fall(left_plain, _without(basis_plain, whole))
        moves = tuple(np.clip(follow @ (loose @ amounts), -_FAR, _FAR).tolist())
        name = ' and '.join(suspects[k][0] for k in each)
        found.append(Missing(name, before, before - fall, moves, odds[each]))
    return tuple(found)


def _fall(left: Array, columns: Array, *, may_only_grow: bool = False) -> tuple[float, Array]:
    """Return the fall of chi-square by columns, 0 for the wrong sign, and their amounts."""
    amounts, *_ = np.linalg.lstsq(columns, -left, rcond=EFFECT)
    is_wrong = may_only_grow and amounts[0] <= 0.0
    fall = float(left @ left - np.sum((left + columns @ amounts) ** 2))
    return 0.0 if is_wrong else fall, np.asarray(amounts)


def _odds(
    falls: Mapping[tuple[int, ...], float],
    sizes: Mapping[tuple[int, ...], int],
    before: float,
    count: int,
) -> dict[tuple[int, ...], float]:
    """
    Return the posterior odds of each explanation against all others and none.

    ``sizes`` are their numbers of columns. The misfit of the best explanation scales the noise of
    all readings. In comparisons of two explanations, the falls have a first-order error too.

    """
    suspects = sum(len(each) == 1 for each in falls)
    noise = max((before - max(falls.values())) / count, 1.0)
    unit = max(noise, _FALL_SHARE * (before - count))
    costs = {
        each: sizes[each] * math.log(count) + 2.0 * len(each) * math.log(suspects)
        for each in falls
    }
    best = max(falls, key=lambda each: falls[each] / unit - costs[each])
    none = falls[best] * (1.0 / unit - 1.0 / noise)
    weights = [none, *(falls[each] / unit - costs[each] for each in falls)]
    shares = softmax(0.5 * np.array(weights))[1:]
    return dict(zip(falls, (shares / np.maximum(1.0 - shares, 1e-12)).tolist(), strict=True))


def _solved(problem: Problem, place: Array) -> tuple[Array, Array]:
    """Return a basis of the slopes, and the moves of the minimum per residual."""
    basis, triangle = np.linalg.qr(problem.slopes(place))
    return basis, -np.linalg.pinv(triangle, rcond=EFFECT) @ basis.T


def _without(basis: Array, columns: Array) -> Array:
    """Return the parts of columns that the free parameters do not explain."""
    return np.asarray(columns - basis @ (basis.T @ columns))


def _suspects(
    problem: Problem, stand: Parameters, here: Predicted, place: Array
) -> Iterator[Suspect]:
    stand = stand.updated(problem.settings_of_all)  # such as the preload
    tried = _stands(stand, {one.name for one in problem.free})
    predicted = problem.predicted([changed for _, changed in tried])
    for (name, _), there in zip(tried, predicted, strict=True):
        may_only_grow = name not in {LOAD, 'contact.friction_rate'} and not stand.value(name)
        yield name, partial(_columns, here, [there]), may_only_grow
    falls = [there for (name, _), there in zip(tried, predicted, strict=True) if name in OF_A_FALL]
    if len(falls) > 1:  # they act together
        yield OF_A_FALL[0], partial(_columns, here, falls), False
    yield FEET_NUMBER, lambda one: slopes_of_constants(one, place, [FEET_NUMBER]), False
    waves = (np.sin, np.cos)
    for name, fringe_m in CYCLIC.items():
        moved = [_moved(here, problem, partial(_cyclic, fringe_m, of)) for of in waves]
        yield name, partial(_columns, here, moved), False
    drifted = _moved(here, problem, lambda _, observed, __: observed.time_s)
    yield SENSOR_DRIFT, partial(_columns, here, [drifted]), False
    ways = [partial(_step_lengths, k, of) for k in range(1, _WAYS + 1) for of in waves]
    moved = [_moved(here, problem, each) for each in ways]
    yield 'friction by place', partial(_columns, here, moved), False


def _columns(here: Predicted, there: Sequence[Predicted], problem: Problem) -> Array:
    """Return the whitened differences of predictions from another, shape (n, k)."""
    return np.column_stack([problem.whitened(each, here) for each in there])


def _stands(stand: Parameters, free: set[str]) -> list[tuple[str, Parameters]]:
    """Return stands with a fixed parameter changed a little, or a part switched on."""
    guides = [f'feet.share[{k}]' for k, gain in enumerate(stand.feet.gain) if not gain]
    others = [name for name in shares_of_ranges(stand) if name != FEET_NUMBER]
    little_n = _LITTLE * friction_limit_n(stand)
    changes = list[tuple[str, Mapping[str, Any]]]()
    for name in dict.fromkeys((*_TRIED, *_TOGETHER, *guides, *others)):
        if name in free:
            continue
        if now := stand.value(name):
            changes.append((name, {name: now * math.exp(STEP)}))
        elif name in _TOGETHER:
            changes += [(name, part) for part in _TOGETHER[name]]
        elif spec_of(name).unit == 'N':
            changes.append((name, {name: little_n}))
        elif name in TYPICAL:
            changes.append((name, {name: TYPICAL[name]}))
    found = list[tuple[str, Parameters]]()
    for name, each in changes:
        with suppress(StickSlipError):  # an impossible stand is no suspect
            found.append((name, stand.updated(each)))
    return found


def _moved(
    here: Predicted, problem: Problem, added: Callable[[Voltage, Readout, Array], Array]
) -> Predicted:
    """Return a prediction with ``added``, nm, on its traces."""
    return [
        replace(model, values=model.values + 1e-9 * added(one.drive, each, model.values))
        if isinstance(one.drive, Voltage)
        else model
        for (one, each, _), model in zip(problem.observed, here, strict=True)
    ]


def _cyclic(
    fringe_m: float, of: Callable[[Array], Array], _: Voltage, __: Readout, model: Array
) -> Array:
    """Return the cyclic error of an interferometer, of size 1, without the noise of readings."""
    return of(2.0 * np.pi * model / fringe_m)


def _step_lengths(
    waves: int, of: Callable[[Array], Array], drive: Voltage, observed: Readout, model: Array
) -> Array:
    """Return the motion by steps whose length changes along the way."""
    falls_s = falls_of(drive)[0] + observed.sensor.late_s
    at = np.interp(falls_s, observed.time_s, model)
    sizes = of(2.0 * np.pi * waves * (at - model.min()) / max(np.ptp(model), TINY))
    over = np.searchsorted(falls_s, observed.time_s, side='right')
    return np.append(np.zeros(1), np.cumsum(sizes))[over]
