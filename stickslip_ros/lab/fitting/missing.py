# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Parameters missing from a fit: test each parameter that was not freed by its slope.

Rao's score test: the fall of chi-square with one more free parameter, to first order and with all
the others following. A part that is off is switched on for the test, which is then one-sided.

"""

from collections.abc import Collection, Mapping
from contextlib import suppress
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.errors import StickSlipError
from stickslip_ros.lab.fitting.free import TYPICAL
from stickslip_ros.lab.fitting.problem import Problem
from stickslip_ros.parameters import Parameters, spec_of

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
_BESIDE: Mapping[str, Mapping[str, float]] = {
    'actuator.resonance': {'actuator.damping_ratio': 0.1}
}
"""Parameters changed together: a resonance that rings for long has no rival."""
_SHARE = 3e-3  # relative change of a value
_RANK = 1e-5  # least singular value, per largest, of independent free parameters
_TELLING = 10.0  # least fall of chi-square of a missing parameter
TELLING_SHARE = 0.05
"""The same as a share of chi-square above the number of readings, which noise does not explain."""


class Missing(NamedTuple):
    """A parameter that would improve a fit if free."""

    name: str
    chi_square: float  # before, of noise and sensor alone
    expected: float  # after, to first order
    moves: tuple[float, ...]  # changes of the coordinates of the free parameters


class Trial(NamedTuple):
    """A second fit with more parameters free."""

    names: tuple[str, ...]
    chi_square: float  # of the first fit, of noise and sensor alone
    found: float  # of this fit
    values: tuple[float, ...]  # of the free parameters of the first fit


def missing_from(problem: Problem, place: Array) -> tuple[Missing, ...]:
    """Return the missing parameters that improve a fit by more than chance, the best first."""
    if not problem.has_traces:
        return ()
    stand = problem.stand(place)
    tried = _tried(stand, {one.name for one in problem.free})
    [here] = problem.predicted([stand])
    plain = replace(problem, allowance=None).measured_at(here)
    basis, triangle = np.linalg.qr(plain.slopes(place))
    follow = -np.linalg.pinv(triangle, rcond=_RANK) @ basis.T

    def unexplained(residual: Array) -> Array:
        return np.asarray(residual - basis @ (basis.T @ residual))

    left = unexplained(plain.whitened(here, None, place))
    before, found = float(left @ left), list[Missing]()
    for name, there in zip(tried, plain.predicted(list(tried.values())), strict=True):
        whole = plain.whitened(there, here, np.zeros(len(place)))
        slope = unexplained(whole)
        length, along = float(slope @ slope), -float(slope @ left)
        may_only_grow = not stand.flat()[name] and spec_of(name).minimum == 0.0
        if length > 0.0 and not (may_only_grow and along <= 0.0):
            moves = follow @ whole * (along / length)
            found.append(Missing(name, before, before - along**2 / length, tuple(moves.tolist())))
    least = max(_TELLING, TELLING_SHARE * (before - problem.count))
    telling = [each for each in found if each.chi_square - each.expected > least]
    return tuple(sorted(telling, key=lambda each: each.expected))


def _tried(stand: Parameters, free: Collection[str]) -> dict[str, Parameters]:
    """Return stands with a fixed parameter changed a little, or switched on, by its name."""
    flat, found = stand.flat(), dict[str, Parameters]()
    for name in _TRIED:
        value = float(flat[name])
        if name in free or not (value or name in TYPICAL):
            continue
        changes = {name: value * (1.0 + _SHARE)}
        if not value:
            changes = {name: TYPICAL[name], **_BESIDE.get(name, {})}
        with suppress(StickSlipError):  # an impossible stand is no candidate
            found[name] = stand.updated(changes)
    return found
