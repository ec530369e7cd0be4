"""
Closed forms written out independently of the code that they check.

The curves of a contact are given along the radius c of the sticking core, so that no equation
has to be solved: g, F_n and their integrals are sums of powers.

"""

from dataclasses import dataclass
from functools import lru_cache
from math import pi

import numpy as np

from stickslip_ros.contact.profile import Array

QUADRATURE_POINTS = 200
STRETCH = 10
"""Substitution theta = (pi/2) w^10: it turns theta^(n - 1) into a smooth integrand."""


@dataclass(frozen=True)
class PowerContact:
    """
    A contact of radius a under the profile g = sum Q_i |x|^n_i.

    Attributes
    ----------
    terms : tuple
        Prefactors Q_i, m^(1-n_i), and exponents n_i.
    normal_pa, shear_pa : float
        E* and G*, Pa.
    friction : float
        mu.
    radius_m : float
        Contact radius a, m.

    """

    terms: tuple[tuple[float, ...], tuple[float, ...]]
    normal_pa: float
    shear_pa: float
    friction: float
    radius_m: float

    def height(self, x_m: Array | float) -> Array:
        """Return g, m."""
        return np.asarray(sum(q * np.asarray(x_m) ** n for q, n in zip(*self.terms, strict=True)))

    def normal_force(self, radius_m: Array | float) -> Array:
        """Return F_n of a contact radius, N: 2 E* int (g(a) - g(x)) dx term by term."""
        area = sum(
            q * n / (n + 1.0) * np.asarray(radius_m) ** (n + 1.0)
            for q, n in zip(*self.terms, strict=True)
        )
        return np.asarray(2.0 * self.normal_pa * area)

    def displacement(self, core_m: Array | float) -> Array:
        """Return the virgin displacement at which the core has a radius, m."""
        ratio = self.friction * self.normal_pa / self.shear_pa
        return np.asarray(ratio * (self.height(self.radius_m) - self.height(core_m)))

    def force(self, core_m: Array | float) -> Array:
        """Return the virgin force at which the core has a radius, N (Jaeger, Ciavarella)."""
        whole = self.normal_force(self.radius_m)
        return np.asarray(self.friction * (whole - self.normal_force(core_m)))

    def loss_per_cycle(self, core_m: float) -> float:
        """
        Return the friction loss of a steady cycle whose amplitude leaves a core, J.

        Notes
        -----
        W = 8 [int_0^u* T_v du - T_v(u*) u*/2]; int F_n dg is a double sum of powers.

        """
        integral = (
            2.0
            * self.normal_pa
            * sum(
                q * n / (n + 1.0) * r * m * _power_step(self.radius_m, core_m, n + m + 1.0)
                for q, n in zip(*self.terms, strict=True)
                for r, m in zip(*self.terms, strict=True)
            )
        )
        whole_n = float(self.normal_force(self.radius_m))
        drop_m = float(self.height(self.radius_m) - self.height(core_m))
        ratio = self.friction * self.normal_pa / self.shear_pa
        energy_j = self.friction * ratio * (whole_n * drop_m - integral)
        half_j = 0.5 * float(self.force(core_m)) * float(self.displacement(core_m))
        return 8.0 * (energy_j - half_j)


def _power_step(outer: float, inner: float, exponent: float) -> float:
    return float((outer**exponent - inner**exponent) / exponent)


def hertz_depth(force_n: Array, normal_pa: float, radius_m: float) -> Array:
    """Return d = (9 F^2 / (16 E*^2 R))^(1/3), m."""
    return np.cbrt(9.0 * force_n**2 / (16.0 * normal_pa**2 * radius_m))


def hertz_radius(force_n: Array, normal_pa: float, radius_m: float) -> Array:
    """Return a = (3 F R / (4 E*))^(1/3), m."""
    return np.cbrt(3.0 * force_n * radius_m / (4.0 * normal_pa))


def hertz_force(depth_m: Array, normal_pa: float, radius_m: float) -> Array:
    """Return F = (4/3) E* sqrt(R) d^(3/2), N."""
    return np.asarray(4.0 / 3.0 * normal_pa * np.sqrt(radius_m) * depth_m**1.5)


def cattaneo_ratio(fraction: Array) -> Array:
    """Return T/(mu F_n) of a sphere at u/u_max (Cattaneo, Mindlin)."""
    return np.asarray(1.0 - (1.0 - fraction) ** 1.5)


def sphere_loss_ratio(fraction: Array) -> Array:
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
    slope = sum(q * n * x_m ** (n - 1.0) for q, n in zip(*contact.terms, strict=True))
    integrals = np.sum(weights * 2.0 * points * reach * slope / x_m, axis=1)
    return np.asarray(contact.normal_pa / pi * integrals)


@lru_cache(maxsize=1)
def unit_quadrature() -> tuple[Array, Array]:
    """Return points and weights of Gauss and Legendre on (0, 1)."""
    points, weights = np.polynomial.legendre.leggauss(QUADRATURE_POINTS)
    return 0.5 * (points + 1.0), 0.5 * weights
