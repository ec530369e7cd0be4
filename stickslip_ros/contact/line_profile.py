"""A rough parabola on a grid of springs: the profile of Eq. 14, one spring per point."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.self_affine import Spectrum, rough_line
from stickslip_ros.errors import OutOfRange


@dataclass(frozen=True, eq=False)
class LineProfile:
    """
    Profile given by its height at the place of every spring.

    The order of the springs matters to nothing at constant load, so heights are sorted once,
    and sums over what is pressed become differences of prefix sums.

    Attributes
    ----------
    spacing_m : float
        Distance dx of the springs, m.
    heights_m : array, shape (springs,)
        Heights above the lowest point, m, in the order of the springs.

    """

    spacing_m: float
    heights_m: Array

    @cached_property
    def limit_m(self) -> float:
        """Depth at which the contact reaches an end of the line, m: deeper ones are refused."""
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
        """Sum of all compressions when the spring of each sorted height is just touched."""
        return np.arange(len(self._sorted_m)) * self._sorted_m - self._sums_m[:-1]

    def springs_in_contact(self, depth_m: Array | float) -> Array:
        """
        Return the number of springs below a depth >= 0, m (any shape), as floats.

        Raises
        ------
        OutOfRange
            If the contact reaches an end of the line.

        """
        depth = np.asarray(depth_m, dtype=float)
        self._check(float(np.max(depth, initial=0.0)))
        return np.asarray(np.searchsorted(self._sorted_m, depth, side='left'), dtype=float)

    def half_width(self, depth_m: Array | float) -> Array:
        """Return half the length of the springs in contact at a depth, m; refuses like above."""
        return np.asarray(0.5 * self.spacing_m * self.springs_in_contact(depth_m))

    def pressed_area_at(self, depth_m: Array | float) -> Array:
        """Return half the sum of (d - g_i)+ dx at a depth, m^2; refuses like above."""
        springs = self.springs_in_contact(depth_m)
        sums_m = self._sums_m[springs.astype(np.intp)]
        return np.asarray(0.5 * self.spacing_m * (springs * np.asarray(depth_m) - sums_m))

    def depth_for(self, area_m2: float) -> float:
        """
        Return the depth at which the pressed area has a value, m.

        Raises
        ------
        OutOfRange
            If the contact reaches an end of the line.

        Notes
        -----
        The sum of the compressions is linear between two sorted heights: exact to rounding.

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
            mend = 'lengthen contact.line_length or lower the load'
            raise OutOfRange('indentation of the rough line', depth_m, 'm', limit, mend)


def line_profile(heights_m: Array, spacing_m: float) -> LineProfile:
    """
    Return the profile of any line, measured or made.

    Parameters
    ----------
    heights_m : array, shape (springs,)
        Heights, m, from any zero; larger is farther from the other body.
    spacing_m : float
        Distance of the springs, m.

    """
    return LineProfile(spacing_m, heights_m - np.min(heights_m))


def rough_line_profile(
    spectrum: Spectrum, radius_m: float, length_m: float, points: int, seed: int
) -> LineProfile:
    """
    Return one rough parabola g(x) = x^2/R + h(x) (Eq. 14).

    Parameters
    ----------
    spectrum : Spectrum
        Of the random line h.
    radius_m : float
        Radius R of the sphere, m.
    length_m : float
        Length of the line, m; it is centred below the sphere.
    points : int
        Number of springs.
    seed : int
        Seed of the line.

    Raises
    ------
    OutOfRange
        If the grid does not resolve the spectrum.

    """
    spacing_m = length_m / points
    x_m = line_places(length_m, points)
    return line_profile(
        x_m**2 / radius_m + rough_line(spectrum, length_m, points, seed), spacing_m
    )


def line_places(length_m: float, points: int) -> Array:
    """Return the places of the springs, m: the middles of equal cells from -L/2 to L/2."""
    return (np.arange(points, dtype=np.float64) + 0.5) * (length_m / points) - 0.5 * length_m
