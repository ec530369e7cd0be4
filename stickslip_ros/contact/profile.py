# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Profiles of rigid indenters on the one-dimensional foundation: power laws and lines of springs.

A profile is described by the part of it that touches at a depth, counted from the first touch; the
order of the springs does not matter at constant load.

"""

from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.contact.power_sums import power_sum, solve_power_sum
from stickslip_ros.errors import OutOfRange


@dataclass(frozen=True)
class PowerProfile:
    """Profile g(x) = sum_i Q_i |x|^n_i of a rigid indenter on the elastic foundation."""

    prefactors: tuple[float, ...]  # Q_i > 0, m^(1 - n_i)
    exponents: tuple[float, ...]  # n_i > 0

    def height(self, x_m: Array | float) -> Array:
        """Return g(x), m (any shape): the smallest indentation that reaches x."""
        return power_sum(np.asarray(x_m, dtype=float), self.prefactors, self.exponents)

    def half_width(self, depth_m: Array | float) -> Array:
        """Return x >= 0 with g(x) = depth, m (any shape): the contact radius of Eq. 25."""
        return solve_power_sum(depth_m, self.prefactors, self.exponents)

    def pressed_area_at(self, depth_m: Array | float) -> Array:
        """Return half the integral of (d - g)+ dx at a depth, m^2."""
        return self.pressed_area(self.half_width(depth_m))

    def depth_for(self, area_m2: float) -> float:
        """Return the depth of a pressed area > 0, m."""
        return float(self.height(self.radius_at_area(area_m2)))

    def pressed_area(self, radius_m: Array | float) -> Array:
        """
        Return int_0^a (g(a) - g(x)) dx, m^2 (any shape): the normal force over 2 E*.

        Notes
        -----
        For g(a) = d it is the bracket of Eq. 24, the sum of n_i/(n_i + 1) Q_i a^(n_i + 1).

        """
        return power_sum(np.asarray(radius_m, dtype=float), *self._area_terms())

    def radius_at_area(self, area_m2: Array | float) -> Array:
        """Return the contact radius a of a pressed area, m: the inverse of Eq. 24."""
        return solve_power_sum(area_m2, *self._area_terms())

    def _area_terms(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        terms = zip(self.prefactors, self.exponents, strict=True)
        return tuple(q * n / (n + 1.0) for q, n in terms), tuple(n + 1.0 for n in self.exponents)


def smooth_profile(radius_m: float) -> PowerProfile:
    """Return the profile x^2/R of a smooth sphere (Eq. 7: the parabola of radius R/2)."""
    return PowerProfile((1.0 / radius_m,), (2.0,))


def rough_profile(radius_m: float, prefactor: float, hurst: float) -> PowerProfile:
    """
    Return the equivalent rough profile x^2/R + Q_1D |x|^H (Eq. 18).

    Q_1D is in m^(1-H), and 0 gives the smooth sphere; H is in (0, 1].

    """
    if prefactor == 0.0:
        return smooth_profile(radius_m)
    return PowerProfile((1.0 / radius_m, prefactor), (2.0, hurst))


@dataclass(frozen=True, eq=False)
class LineProfile:
    """Profile given by the height at every spring; sums over pressed springs are prefix sums."""

    spacing_m: float  # distance dx of the springs, m
    heights_m: Array  # heights above the lowest point, m, in the order of the springs

    @cached_property
    def limit_m(self) -> float:
        """Depth at which the contact reaches an end of the line, m; larger depths are refused."""
        return float(min(self.heights_m[0], self.heights_m[-1]))

    @cached_property
    def _sorted_m(self) -> Array:
        return np.sort(self.heights_m)

    @cached_property
    def _sums_m(self) -> Array:
        """Sum of the n lowest heights at index n; shape (springs + 1,)."""
        return np.concatenate(([0.0], np.cumsum(self._sorted_m)))

    @cached_property
    def _totals_m(self) -> Array:
        """Sum of all compressions at the depth of each sorted height."""
        return np.arange(len(self._sorted_m)) * self._sorted_m - self._sums_m[:-1]

    def springs_in_contact(self, depth_m: Array | float) -> Array:
        """
        Return the number of springs below a depth >= 0, m (any shape), as floats.

        Raises OutOfRange if the contact reaches an end of the line.

        """
        depth = np.asarray(depth_m, dtype=float)
        self._check(float(np.max(depth, initial=0.0)))
        return np.asarray(np.searchsorted(self._sorted_m, depth, side='left'), dtype=float)

    def half_width(self, depth_m: Array | float) -> Array:
        """Return half the length in contact at a depth, m; OutOfRange beyond ``limit_m``."""
        return np.asarray(0.5 * self.spacing_m * self.springs_in_contact(depth_m))

    def pressed_area_at(self, depth_m: Array | float) -> Array:
        """Return half the sum of (d - g_i)+ dx at a depth, m^2; OutOfRange beyond ``limit_m``."""
        springs = self.springs_in_contact(depth_m)
        sums_m = self._sums_m[springs.astype(np.intp)]
        return np.asarray(0.5 * self.spacing_m * (springs * np.asarray(depth_m) - sums_m))

    def depth_for(self, area_m2: float) -> float:
        """
        Return the depth of a pressed area > 0, m; OutOfRange beyond ``limit_m``.

        Exact to rounding, because the sum of compressions is linear between sorted heights.

        """
        total_m = 2.0 * area_m2 / self.spacing_m
        springs = int(np.searchsorted(self._totals_m, total_m, side='left'))
        depth_m = float((total_m + self._sums_m[springs]) / max(springs, 1))
        self._check(depth_m)
        return depth_m

    def _check(self, depth_m: float) -> None:
        if depth_m > self.limit_m:
            limit = (
                f'beyond {self.limit_m:.6g} m, at which the contact reaches an end of the line: '
                'profile too short for the load'
            )
            hint = 'lengthen contact.line_length or lower the load'
            raise OutOfRange('indentation of the rough line', depth_m, 'm', limit, hint)


Profile: TypeAlias = PowerProfile | LineProfile


def line_profile(heights_m: Array, spacing_m: float) -> LineProfile:
    """
    Return the profile of a measured or computed line of heights, shape (springs,).

    Heights have any zero; larger heights are farther from the other body.

    """
    return LineProfile(spacing_m, heights_m - np.min(heights_m))
