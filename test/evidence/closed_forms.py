# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Closed forms of the contact of the paper, written out independently of the code that they check.

The curves of a contact are given along the radius c of the sticking core, so that no equation
has to be solved: g, F_n and their integrals are sums of powers.

"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from math import pi
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

Array = NDArray[np.float64]

# Table 1 and Section 4.
YOUNG_PA = (210e9, 370e9)
POISSON = 0.3
FRICTION = 0.3
RADIUS_M = 0.5e-3
HURST = 0.7
RMS_HEIGHT_M = 1.1221e-6
PREFACTOR = 4.4478e-4
"""Q_1D, m^(1-H)."""
E_STAR_PA = 1.0 / sum((1.0 - POISSON**2) / young for young in YOUNG_PA)
"""Eq. 5."""
G_STAR_PA = 1.0 / sum((2.0 - POISSON) * 2.0 * (1.0 + POISSON) / (4.0 * y) for y in YOUNG_PA)
"""Eq. 6."""
UPPER_SHARE, LOWER_SHARE = math.sqrt(2.0) / 2.0, math.sqrt(2.0) / 4.0
"""F_n1/F_p and F_n2/F_p of Eq. 19."""
LIMIT_PER_PRELOAD = FRICTION * 2.0 * math.sqrt(2.0)
"""Full slip of all six contacts per preload: mu times the sum of Eq. 19."""

Terms: TypeAlias = tuple[tuple[float, float], ...]
"""Prefactors Q_i, m^(1-n_i), and exponents n_i, in pairs, of a profile g = sum Q_i |x|^n_i."""
CONE_SLOPE = 0.01
TERMS: dict[str, Terms] = {
    'smooth': ((1.0 / RADIUS_M, 2.0),),
    'rough': ((1.0 / RADIUS_M, 2.0), (PREFACTOR, HURST)),
    'cone': ((0.5 * pi * CONE_SLOPE, 1.0),),
}
"""Of the sphere, of the equivalent rough body (Eq. 18), and of a cone."""

QUADRATURE_POINTS = 200
STRETCH = 10
"""Substitution theta = (pi/2) w^10: it turns theta^(n - 1) into a smooth integrand."""


def height(terms: Terms, x_m: Array | float) -> Array:
    """Return g, m, at places x >= 0, m."""
    return np.asarray(sum(q * np.asarray(x_m) ** n for q, n in terms))


@dataclass(frozen=True)
class PowerContact:
    """A contact of the materials of the paper: the profile by its terms, and the radius a, m."""

    terms: Terms
    radius_m: float

    def normal_force(self, radius_m: Array | float) -> Array:
        """Return F_n of a contact radius, N: 2 E* int (g(a) - g(x)) dx term by term."""
        area_m2 = sum(q * n / (n + 1.0) * np.asarray(radius_m) ** (n + 1.0) for q, n in self.terms)
        return np.asarray(2.0 * E_STAR_PA * area_m2)

    def displacement(self, core_m: Array | float) -> Array:
        """Return the virgin displacement at which the core has a radius, m."""
        lowered_m = height(self.terms, self.radius_m) - height(self.terms, core_m)
        return np.asarray(FRICTION * E_STAR_PA / G_STAR_PA * lowered_m)

    def force(self, core_m: Array | float) -> Array:
        """Return the virgin force at which the core has a radius, N (Jaeger, Ciavarella)."""
        whole = self.normal_force(self.radius_m)
        return np.asarray(FRICTION * (whole - self.normal_force(core_m)))

    def loss_per_cycle(self, core_m: float) -> float:
        """
        Return the friction loss of a steady cycle whose amplitude leaves a core, J.

        Notes
        -----
        W = 8 [int_0^u* T_v du - T_v(u*) u*/2]; int T_v du follows from int F_n dg, which is a
        double sum of powers.

        """
        double_sum = sum(
            q * n / (n + 1.0) * r * m * self._power_step(core_m, n + m + 1.0)
            for q, n in self.terms
            for r, m in self.terms
        )
        reached_m, force_n = float(self.displacement(core_m)), float(self.force(core_m))
        whole_n = float(self.normal_force(self.radius_m))
        integral = 2.0 * E_STAR_PA * FRICTION * E_STAR_PA / G_STAR_PA * double_sum
        energy_j = FRICTION * (whole_n * reached_m - integral)
        return 8.0 * (energy_j - 0.5 * force_n * reached_m)

    def _power_step(self, core_m: float, exponent: float) -> float:
        return float((self.radius_m**exponent - core_m**exponent) / exponent)

    def core(self, displacement_m: float) -> float:
        """Return the radius of the core at a virgin displacement, m."""
        return _root(
            lambda core_m: float(self.displacement(core_m)) - displacement_m, 0.0, self.radius_m
        )

    def pull(self, displacement_m: float) -> float:
        """Return the virgin force at a displacement, N."""
        if displacement_m >= float(self.displacement(0.0)):
            return float(self.force(0.0))
        return float(self.force(self.core(displacement_m)))

    def along(self, turns_m: tuple[float, ...]) -> float:
        """Return the force at the last of turning points that each lie between those before, N."""
        force_n, before_m = 0.0, 0.0
        for k, turn_m in enumerate(turns_m):
            fold = 2.0 if k else 1.0
            swing_n = fold * self.pull(abs(turn_m - before_m) / fold)
            force_n, before_m = force_n + math.copysign(swing_n, turn_m - before_m), turn_m
        return force_n

    def cycle_loss(self, amplitude_m: float) -> float:
        """Return the friction loss of a steady cycle, J."""
        beyond_m = amplitude_m - float(self.displacement(0.0))
        if beyond_m >= 0.0:
            return self.loss_per_cycle(0.0) + 4.0 * float(self.force(0.0)) * beyond_m
        return self.loss_per_cycle(self.core(amplitude_m))


def _root(function: Callable[[float], float], low: float, high: float) -> float:
    return float(brentq(function, low, high, xtol=1e-30, rtol=8.9e-16))


@lru_cache(maxsize=64)
def contact_of(profile: str, force_n: float) -> PowerContact:
    """Return the contact of a body of TERMS under a normal force."""
    anyhow = PowerContact(TERMS[profile], 1e-3)
    radius_m = _root(lambda a_m: float(anyhow.normal_force(a_m)) - force_n, 0.0, 1e-3)
    return PowerContact(TERMS[profile], radius_m)


def hertz_depth(
    force_n: Array | float, normal_pa: float = E_STAR_PA, sphere_m: float = RADIUS_M
) -> Array:
    """Return d = (9 F^2 / (16 E*^2 R))^(1/3), m."""
    return np.asarray(np.cbrt(9.0 * force_n**2 / (16.0 * normal_pa**2 * sphere_m)))


def hertz_radius(force_n: Array) -> Array:
    """Return a = (3 F R / (4 E*))^(1/3), m."""
    return np.cbrt(3.0 * force_n * RADIUS_M / (4.0 * E_STAR_PA))


def hertz_force(depth_m: Array | float) -> Array:
    """Return F = (4/3) E* sqrt(R) d^(3/2), N."""
    return np.asarray(4.0 / 3.0 * E_STAR_PA * np.sqrt(RADIUS_M) * depth_m**1.5)


def sphere_loss_ratio(fraction: Array | float) -> Array:
    """Return the loss per cycle W/(mu F_n u_max) of a sphere at the amplitude u*/u_max."""
    rest = 1.0 - fraction
    energy = fraction - 0.4 * (1.0 - rest**2.5)
    return np.asarray(8.0 * (energy - 0.5 * fraction * (1.0 - rest**1.5)))


def hess_integral(exponent: float) -> float:
    """Return kappa(n) = n int_0^(pi/2) sin^(n-1) by quadrature: Hess's rule for r^n."""
    points, weights = unit_quadrature()
    angles = 0.5 * pi * points**STRETCH
    slopes = 0.5 * pi * STRETCH * points ** (STRETCH - 1)
    return float(np.sum(weights * slopes * exponent * np.sin(angles) ** (exponent - 1.0)))


def pressure(contact: PowerContact, radii_m: Array) -> Array:
    """Return the pressure under a contact, Pa: (E*/pi) int_r^a g'(x) dx / sqrt(x^2 - r^2)."""
    points, weights = unit_quadrature()
    reach = np.sqrt(contact.radius_m**2 - radii_m**2)[:, None]
    x_m = np.sqrt(radii_m[:, None] ** 2 + (reach * points**2) ** 2)
    slope = sum(q * n * x_m ** (n - 1.0) for q, n in contact.terms)
    integrals = np.sum(weights * 2.0 * points * reach * slope / x_m, axis=1)
    return np.asarray(E_STAR_PA / pi * integrals)


@lru_cache(maxsize=1)
def unit_quadrature() -> tuple[Array, Array]:
    """Return points and weights of Gauss and Legendre on (0, 1)."""
    points, weights = np.polynomial.legendre.leggauss(QUADRATURE_POINTS)
    return 0.5 * (points + 1.0), 0.5 * weights
