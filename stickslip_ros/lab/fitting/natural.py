# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Natural coordinates of a fit: the ratios that a motion shows, and what gives them their scale.

A motion stays the same if stiffness, friction, mass and damping grow alike. In the logarithms of
friction, roughness, mass and damping the minimum is therefore a long curved valley: another
roughness is another stiffness k, which the others follow. Divided by k, and the damping by the
mass, they stay where they are, and the valley is straight.

"""

import math
from dataclasses import dataclass

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.drive.layout import contacts_of
from stickslip_ros.lab.fitting.free import Coordinate
from stickslip_ros.parameters import Parameters

_MASS, _DAMPING = 'runner.mass', 'runner.damping'  # which may be 0: it has no logarithm
_PER_STIFFNESS = 'contact.friction', _MASS
_STEP = 1e-5  # of the slopes of a map


@dataclass(frozen=True, eq=False)
class Natural:
    """
    The map between coordinates of free parameters and natural coordinates, both shape (free,).

    ``stand`` has the constants of its contacts and a preload.

    """

    stand: Parameters
    free: tuple[Coordinate, ...]

    def to(self, z: Array) -> Array:
        """Return natural coordinates."""
        place = z.copy()
        place[self._numbers(_DAMPING)] *= math.exp(-self._growth(z))
        place[self._numbers(*_PER_STIFFNESS)] -= self._log_stiffness(z)
        return place

    def back(self, place: Array) -> Array:
        """Return the coordinates of the free parameters."""
        z = place.copy()
        z[self._numbers(*_PER_STIFFNESS)] += self._log_stiffness(place)
        z[self._numbers(_DAMPING)] *= math.exp(self._growth(z))
        return z

    def settings(self, place: Array) -> dict[str, float]:
        """Return the values of the free parameters, by name."""
        pairs = zip(self.free, self.back(place).tolist(), strict=True)
        return {one.name: one.to_value(z) for one, z in pairs}

    def slopes(self, place: Array) -> Array:
        """Return the slopes of ``back``, shape (free, free)."""
        here = self.back(place)
        ends = [self.back(place + way) for way in _STEP * np.eye(len(place))]
        return np.column_stack([(end - here) / _STEP for end in ends])

    def _numbers(self, *names: str) -> list[int]:
        """Return the places of parameters, if they are free."""
        return [number for number, one in enumerate(self.free) if one.name in names]

    def _growth(self, z: Array) -> float:
        """Return the logarithm of the mass per that at the start; 0 if it is not free."""
        masses = [(self.free[number], float(z[number])) for number in self._numbers(_MASS)]
        return sum((x - mass.to_coordinate(mass.start) for mass, x in masses), 0.0)

    def _log_stiffness(self, z: Array) -> float:
        """Return the logarithm of the stiffness of all contacts; 0 if nothing free changes it."""
        contact = self.stand.contact
        chosen = [
            (one, float(z[k]))
            for k, one in enumerate(self.free)
            if one.name.startswith('contact.') and one.name not in _PER_STIFFNESS
        ]
        if not chosen or contact.law != 'mdr' or contact.profile == 'rough_line':
            return 0.0
        there = self.stand.updated({one.name: one.to_value(value) for one, value in chosen})
        return math.log(sum(each.stick_stiffness_n_per_m for each in contacts_of(there)))
