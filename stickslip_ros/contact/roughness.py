# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Roughness: random self-affine lines (Eqs 1 and 9 to 13), and the equivalent axisymmetric body.

Two equations of the paper are corrected. Eq. 9 has a q too many: <h^2> of a line is 2 int C_1D dq,
from which Eq. 10 follows. The root of Eq. 13 covers both factors: B_1D = sqrt((2 pi/L) C_1D). The
equivalent body follows from Hess's factor and the Pohrt-Popov rule (Eqs 16 and 17).

"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stickslip_ros.arrays import Array
from stickslip_ros.errors import OutOfRange

_ROUNDING = 1e-9
"""Relative rounding of a computed cut-off at the resolution of a grid."""
WAVES_MIN = 2
"""Least number of waves of a line; a single wave has no exponent."""
POHRT_POPOV = 1.9412
"""Constant of the Pohrt-Popov rule, Eq. 16."""


@dataclass(frozen=True)
class Spectrum:
    """
    Isotropic power spectrum of a self-affine roughness.

    Raises
    ------
    OutOfRange
        If H is outside (0, 1], the height not positive, or the wave numbers out of order.

    """

    hurst: float  # Hurst exponent H, in (0, 1]
    rms_height_m: float  # root mean square of the heights, m
    # lowest and highest wave number, rad/m
    lower_cutoff_per_m: float
    upper_cutoff_per_m: float

    def __post_init__(self) -> None:
        if not 0.0 < self.hurst <= 1.0:
            hint = 'take one such as 0.7'
            raise OutOfRange('Hurst exponent', self.hurst, '', 'outside (0, 1]', hint)
        _check_positive('rms height', self.rms_height_m, 'm')
        _check_positive('lower cut-off', self.lower_cutoff_per_m, 'rad/m')
        lower, upper = self.lower_cutoff_per_m, self.upper_cutoff_per_m
        if not lower < upper < math.inf:
            limit = f'not above the lower cut-off, {lower:.6g} rad/m'
            raise OutOfRange('upper cut-off', upper, 'rad/m', limit, 'raise it or lower the other')

    @property
    def plateau_m4(self) -> float:
        """
        C_2D at the lower cut-off q_l, m^4, from 2 pi int q C_2D dq = rms^2 (Eq. 8).

        The integral of q is q_l^2 (1 - (q_u/q_l)^(-2H))/(2H).

        """
        lower, exponent = self.lower_cutoff_per_m, 2.0 * self.hurst
        falling = lower**2 * -math.expm1(-exponent * math.log(self.upper_cutoff_per_m / lower))
        return self.rms_height_m**2 / (2.0 * math.pi * (falling / exponent))

    def density_2d(self, wave_number_per_m: Array | float) -> Array:
        """Return C_2D, m^4, at wave numbers, rad/m (any shape); 0 outside the cut-offs (Eq. 1)."""
        wave = np.asarray(wave_number_per_m, dtype=float)
        inside = self._contains(wave)
        lower = self.lower_cutoff_per_m
        steps = np.maximum(np.where(inside, wave, lower) / lower, 1.0)
        return np.where(inside, self.plateau_m4 * steps ** (-2.0 * self.hurst - 2.0), 0.0)

    def density_1d(self, wave_number_per_m: Array | float) -> Array:
        """Return C_1D = pi q C_2D, m^3, at wave numbers, rad/m; any shape (Eq. 10)."""
        wave = np.asarray(wave_number_per_m, dtype=float)
        return np.pi * wave * self.density_2d(wave)

    def check_grid(self, length_m: float, points: int) -> None:
        """
        Refuse a grid that does not resolve the spectrum.

        Raises OutOfRange if the longest wave is longer than the grid, if the shortest wave is
        shorter than two spacings, or if there are fewer than two waves between the cut-offs.

        """
        _check_positive('length', length_m, 'm')
        first, last = 2.0 * math.pi / length_m, math.pi * points / length_m
        lower, upper = self.lower_cutoff_per_m, self.upper_cutoff_per_m
        if lower < first * (1.0 - _ROUNDING):
            limit = f'below {first:.6g} rad/m, one wave in the length of {length_m:.6g} m'
            raise OutOfRange('lower cut-off', lower, 'rad/m', limit, 'raise it or the length')
        if upper > last * (1.0 + _ROUNDING):
            limit = f'above {last:.6g} rad/m, two of the {points} points per wave'
            raise OutOfRange('upper cut-off', upper, 'rad/m', limit, 'lower it or add points')
        waves = wave_numbers(length_m, points)[: (points + 1) // 2]
        if np.count_nonzero(self._contains(waves)) < WAVES_MIN:
            limit = f'less than {WAVES_MIN} grid waves above the lower one, {lower:.6g} rad/m'
            hint = 'raise it or lengthen the grid'
            raise OutOfRange('upper cut-off', upper, 'rad/m', limit, hint)

    def _contains(self, wave: Array) -> NDArray[np.bool_]:
        low = wave >= self.lower_cutoff_per_m * (1.0 - _ROUNDING)
        return np.asarray(low & (wave <= self.upper_cutoff_per_m * (1.0 + _ROUNDING)))


def rough_line(spectrum: Spectrum, length_m: float, points: int, seed: int) -> Array:
    """
    Return one realisation of a rough line, heights of mean 0, m, shape (points,) (Eqs 11 to 13).

    Raises OutOfRange if the grid does not resolve the spectrum.

    Notes
    -----
    Amplitudes B_1D are fixed; only phases are random. A common factor scales the amplitudes: the
    sum of their squares, which replaces the integral of Eq. 9, is the square of the rms. So every
    realisation has exactly this rms, to rounding. The shortest wave of the grid, two points long,
    has no amplitude, because its phase is not free.

    """
    power = line_power(spectrum, length_m, points)
    phases = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, len(power))
    return np.fft.irfft(points * np.sqrt(power) * np.exp(1j * phases), points)


def line_power(spectrum: Spectrum, length_m: float, points: int) -> Array:
    """Return the squares of B_1D of `rough_line`, m^2; raises OutOfRange like `rough_line`."""
    spectrum.check_grid(length_m, points)
    power = spectrum.density_1d(wave_numbers(length_m, points))
    power[(points + 1) // 2 :] = 0.0
    power *= spectrum.rms_height_m**2 / (2.0 * np.sum(power))
    return power


def wave_numbers(length_m: float, points: int) -> Array:
    """Return the wave numbers of a real transform, rad/m, shape (points // 2 + 1,)."""
    return (2.0 * np.pi / length_m) * np.arange(points // 2 + 1, dtype=np.float64)


def _check_positive(name: str, value: float, unit: str) -> None:
    if not 0.0 < value < math.inf:
        raise OutOfRange(name, value, unit, f'not above 0 {unit}', 'give a positive number')


def hess_factor(exponent: float) -> float:
    """
    Return Hess's factor kappa(n), n > 0, from the profile Q r^n to the one-dimensional profile.

    g(x) = |x| int_0^|x| f'(r) / sqrt(x^2 - r^2) dr of f = Q r^n is kappa(n) Q |x|^n with
    kappa(n) = (sqrt(pi)/2) n Gamma(n/2) / Gamma((n+1)/2); kappa(1) = pi/2, kappa(2) = 2.

    """
    ratio = math.gamma(exponent / 2.0) / math.gamma((exponent + 1.0) / 2.0)
    return 0.5 * math.sqrt(math.pi) * exponent * ratio


def rough_prefactor_3d(rms_height_m: float, hurst: float, radius_m: float) -> float:
    """
    Return Q_3D, m^(1-H), of the axisymmetric body Q_3D r^H of a rough surface (Eq. 16).

    H is in (0, 1]; the system length is L = 2 R, with the radius R of the sphere.

    """
    length_m = 2.0 * radius_m
    slope = math.pow(2.0 * (hurst + 1.0) / (POHRT_POPOV * length_m), hurst + 1.0)
    return slope * (hurst + 1.0) * length_m / (2.0 * hurst * hess_factor(hurst)) * rms_height_m


def rough_prefactor_1d(rms_height_m: float, hurst: float, radius_m: float) -> float:
    """Return Q_1D = kappa(H) Q_3D of the one-dimensional profile Q_1D |x|^H, m^(1-H) (Eq. 17)."""
    return hess_factor(hurst) * rough_prefactor_3d(rms_height_m, hurst, radius_m)
