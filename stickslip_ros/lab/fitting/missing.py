# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
What a fitted stand may lack: each parameter that was not freed, tried by its slope.

Rao's score test: how far chi-square would fall if one more parameter were free, to first order and
with all the others following. A part that is switched off is tried by switching on a little of it;
it may only be there, so that the test is one-sided.

"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.errors import StickSlipError
from stickslip_ros.lab.fitting.problem import Problem
from stickslip_ros.parameters import Parameters, spec_of

_TRIED: Mapping[str, Mapping[str, float]] = {
    'contact.friction': {},
    'contact.prefactor': {},
    'contact.radius': {},
    'runner.mass': {},
    'runner.damping': {},
    'actuator.gain': {},
    'amplifier.slew_rate': {},
    'actuator.hysteresis': {'actuator.hysteresis': 0.02},
    'actuator.creep': {'actuator.creep': 0.003},
    'actuator.resonance': {'actuator.resonance': 3e5, 'actuator.damping_ratio': 0.1},
    'amplifier.bandwidth': {'amplifier.bandwidth': 5e5},
    'actuator.gain_tolerance': {'actuator.gain_tolerance': 0.01},
}
"""What may be missing, and what switches a little of it on where it is off."""
_SHARE = 3e-3  # by which a value that is there is changed
_TELLING = 10.0  # fall of chi-square from which a parameter is named
TELLING_SHARE = 0.02  # and as a share of it


class Missing(NamedTuple):
    """A parameter that would make a fit better if it were free."""

    name: str
    chi_square: float  # before, of noise and sensor alone
    expected: float  # after, to first order


def missing_from(problem: Problem, place: Array) -> tuple[Missing, ...]:
    """Return what would make a fit better by more than chance, the most telling first."""
    if not problem.has_traces:
        return ()
    stand = problem.stand(place)
    [here] = problem.predicted([stand])
    plain = Problem(**{**vars(problem), 'allowance': None}).measured_at(here)
    known = plain.slopes(place)
    missed = plain.whitened(here, None, place)
    names, stands = list[str](), list[Parameters]()
    for name, switched in _TRIED.items():
        value = stand.flat()[name]
        if name in {one.name for one in problem.free}:
            continue
        is_off = not value
        changes = switched if is_off and switched else {name: float(value) * (1.0 + _SHARE)}
        if is_off and not switched:
            continue
        try:
            stands.append(stand.updated(dict(changes)))
            names.append(name)
        except StickSlipError:  # a stand that cannot be lacks nothing
            continue
    basis = np.linalg.qr(known)[0]
    left = missed - basis @ (basis.T @ missed)
    before = float(left @ left)
    found = []
    for name, there in zip(names, plain.predicted(stands), strict=True):
        slope = plain.whitened(there, here, np.zeros(len(place)))
        slope -= basis @ (basis.T @ slope)
        length = float(slope @ slope)
        along = -float(slope @ left)
        may_only_grow = not stand.flat()[name] and spec_of(name).minimum == 0.0
        if length > 0.0 and not (may_only_grow and along <= 0.0):
            found.append(Missing(name, before, before - along**2 / length))
    least = max(_TELLING, TELLING_SHARE * before)
    telling = [each for each in found if each.chi_square - each.expected > least]
    return tuple(sorted(telling, key=lambda each: each.expected))
