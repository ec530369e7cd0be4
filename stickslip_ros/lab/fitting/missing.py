# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
What a fitted stand may lack: each parameter that was not freed, tried by its slope.

Rao's score test: how far chi-square would fall if one more parameter were free, to first order and
with all the others following. A part that is off is tried by switching it on; it may only be
there, so that the test is one-sided.

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
"""What may be missing. Where it is off, a usual amount of it is switched on: a little damping told
less of 20 N s/m than a resonance that was not there."""
_BESIDE: Mapping[str, Mapping[str, float]] = {
    'actuator.resonance': {'actuator.damping_ratio': 0.1}
}
"""What is changed with it: a resonance that rings for long looks like no other."""
_SHARE = 3e-3  # by which a value that is there is changed
_RANK = 1e-5  # singular value, per largest, below which free parameters are not told apart
_TELLING = 10.0  # fall of chi-square from which a parameter is named
TELLING_SHARE = 0.05
"""The same as a share of what noise does not explain: chi-square above the number of readings."""


class Missing(NamedTuple):
    """A parameter that would make a fit better if it were free."""

    name: str
    chi_square: float  # before, of noise and sensor alone
    expected: float  # after, to first order
    moves: tuple[float, ...]  # how far the coordinates of the free parameters would move


class Trial(NamedTuple):
    """A second fit with more parameters free."""

    names: tuple[str, ...]  # which
    chi_square: float  # of the first fit, of noise and sensor alone
    found: float  # of this one
    values: tuple[float, ...]  # of the free parameters of the first, here


def missing_from(problem: Problem, place: Array) -> tuple[Missing, ...]:
    """Return what would make a fit better by more than chance, the most telling first."""
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
    """Return stands with a little more of what is not free, or with what is off, by its name."""
    flat, found = stand.flat(), dict[str, Parameters]()
    for name in _TRIED:
        value = float(flat[name])
        if name in free or not (value or name in TYPICAL):
            continue
        changes = {name: value * (1.0 + _SHARE)}
        if not value:
            changes = {name: TYPICAL[name], **_BESIDE.get(name, {})}
        with suppress(StickSlipError):  # a stand that cannot be lacks nothing
            found[name] = stand.updated(changes)
    return found
