"""Profiles of the one-dimensional foundation: what every profile can tell, and power laws."""

import functools
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

NEWTON_ITERATIONS = 60
"""Enough for any start: the function is convex in log-log, so Newton's steps cannot cycle."""
NEWTON_TOLERANCE = 1e-15


class Profile(Protocol):
    """
    A rigid indenter on the elastic foundation, as far as the contact needs to know it.

    Depths count from the first touch. Whatever its shape, a profile is described by how much of
    it touches at a depth: at constant load the order of the springs does not matter.

    """

    def __hash__(self) -> int:
        """Return a hash, by which what was solved for a profile is kept."""

    def half_width(self, depth_m: Array | float) -> Array:
        """Return half the length in contact, m, at a depth >= 0 (any shape); a for one patch."""

    def pressed_area_at(self, depth_m: Array | float) -> Array:
        """Return half the integral of (d - g)+ dx, m^2, at a depth d >= 0 (any shape)."""

    def depth_for(self, area_m2: float) -> float:
        """
        Return the depth at which the pressed area has a value > 0, m.

        Raises
        ------
        OutOfRange
            If the profile is too short for it.

        """


@dataclass(frozen=True)
class PowerProfile:
    """
    Profile g(x) = sum_i Q_i |x|^n_i of a rigid indenter on the elastic foundation.

    Attributes
    ----------
    prefactors : tuple of float
        Q_i > 0, m^(1 - n_i).
    exponents : tuple of float
        n_i > 0.

    """

    prefactors: tuple[float, ...]
    exponents: tuple[float, ...]

    def height(self, x_m: Array | float) -> Array:
        """Return g at the places x, m (any shape); the smallest indentation that reaches x."""
        return _power_sum(np.asarray(x_m, dtype=float), self.prefactors, self.exponents)

    def radius_at_height(self, height_m: Array | float) -> Array:
        """Return x >= 0 with g(x) = height, m (any shape): the contact radius of Eq. 25."""
        return _solve_power_sum(height_m, self.prefactors, self.exponents)

    def half_width(self, depth_m: Array | float) -> Array:
        """Return the contact radius at a depth, m."""
        return self.radius_at_height(depth_m)

    def pressed_area_at(self, depth_m: Array | float) -> Array:
        """Return half the integral of (d - g)+ dx at a depth, m^2."""
        return self.pressed_area(self.radius_at_height(depth_m))

    def depth_for(self, area_m2: float) -> float:
        """Return the depth at which the pressed area has a value, m."""
        return float(self.height(self.radius_at_area(area_m2)))

    def pressed_area(self, radius_m: Array | float) -> Array:
        """
        Return int_0^a (g(a) - g(x)) dx, m^2 (any shape); the normal force is 2 E* times it.

        Notes
        -----
        With g(a) = d this is the bracket of Eq. 24, sum of n_i/(n_i + 1) Q_i a^(n_i + 1).

        """
        return _power_sum(np.asarray(radius_m, dtype=float), *self._area_terms())

    def radius_at_area(self, area_m2: Array | float) -> Array:
        """Return the contact radius a with a given pressed area, m: the inverse of Eq. 24."""
        return _solve_power_sum(area_m2, *self._area_terms())

    def _area_terms(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        terms = zip(self.prefactors, self.exponents, strict=True)
        return tuple(q * n / (n + 1.0) for q, n in terms), tuple(n + 1.0 for n in self.exponents)


def smooth_profile(radius_m: float) -> PowerProfile:
    """Return the profile x^2/R of a smooth sphere (Eq. 7: the parabola of radius R/2)."""
    return PowerProfile((1.0 / radius_m,), (2.0,))


def rough_profile(radius_m: float, prefactor: float, hurst: float) -> PowerProfile:
    """
    Return the equivalent rough profile x^2/R + Q_1D |x|^H (Eq. 18).

    Parameters
    ----------
    radius_m : float
        Radius R of the sphere, m.
    prefactor : float
        Q_1D, m^(1-H); 0 gives the smooth sphere.
    hurst : float
        Hurst exponent H, in (0, 1].

    """
    if prefactor == 0.0:
        return smooth_profile(radius_m)
    return PowerProfile((1.0 / radius_m, prefactor), (2.0, hurst))


def _power_sum(x: Array, prefactors: tuple[float, ...], exponents: tuple[float, ...]) -> Array:
    terms = zip(prefactors, exponents, strict=True)
    return np.asarray(sum(q * np.abs(x) ** n for q, n in terms))


def _solve_power_sum(
    total: Array | float, prefactors: tuple[float, ...], exponents: tuple[float, ...]
) -> Array:
    """
    Return x >= 0 with sum_i Q_i x^n_i = total, by Newton's method in log x and log total.

    In these coordinates the sum is convex and its slope lies between the smallest and the
    largest exponent, so the iteration converges from any start.

    """
    target = np.asarray(total, dtype=float)
    positive = target > 0.0
    log_target = np.log(np.where(positive, target, 1.0))
    # No term alone may exceed the total: the smallest single-term solution is an upper bound.
    terms = list(zip(prefactors, exponents, strict=True))
    log_x = functools.reduce(np.minimum, [(log_target - np.log(q)) / n for q, n in terms])
    for _ in range(NEWTON_ITERATIONS):
        values = [q * np.exp(n * log_x) for q, n in terms]
        sums = functools.reduce(np.add, values)
        slopes = [n * v for v, (_, n) in zip(values, terms, strict=True)]
        slope = functools.reduce(np.add, slopes) / sums
        change = (np.log(sums) - log_target) / slope
        log_x = log_x - change
        if (np.abs(change) < NEWTON_TOLERANCE * (1.0 + np.abs(log_x))).all():
            break
    return np.where(positive, np.exp(log_x), 0.0)
