# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Random surfaces, and what lines and surfaces show of the spectrum that they are made of."""

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.contact.roughness import Spectrum, wave_numbers


def rough_surface(spectrum: Spectrum, length_m: float, points: int, seed: int) -> Array:
    """
    Return one realisation of a square rough surface (Eqs 1 to 3).

    Parameters
    ----------
    spectrum : Spectrum
        What the surface is made of.
    length_m, points : float, int
        Side L, m, with which the surface is periodic, and the number of points along it.
    seed : int
        Seed of the phases, >= 0.

    Returns
    -------
    array, shape (points, points)
        Heights, m, of mean zero and exactly the asked rms; refused like those of `rough_line`.

    """
    spectrum.check_grid(length_m, points)
    power = spectrum.density_2d(_wave_numbers_2d(length_m, points))
    power[0, 0] = 0.0
    if points % 2 == 0:
        power[points // 2, :] = power[:, -1] = 0.0
    # The half that a real transform leaves out repeats all columns but the first.
    power *= spectrum.rms_height_m**2 / (2.0 * np.sum(power) - np.sum(power[:, 0]))
    phases = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, power.shape)
    middle = (points + 1) // 2
    phases[:-middle:-1, 0] = -phases[1:middle, 0]
    return np.fft.irfft2(points**2 * np.sqrt(power) * np.exp(1j * phases), (points, points))


def line_spectrum(heights_m: Array, length_m: float) -> tuple[Array, Array]:
    """
    Return wave numbers, rad/m, and the density C_1D, m^3, of a periodic line.

    Parameters
    ----------
    heights_m : array, shape (points,)
        Heights, m.
    length_m : float
        Length L, m.

    Notes
    -----
    C_1D = |B_1D|^2 L/(2 pi), Eq. 13 solved for it. A line that is not periodic, such as a
    measured one, needs a window first.

    """
    points = len(heights_m)
    wanted = slice(1, (points + 1) // 2)
    amplitudes = np.abs(np.fft.rfft(heights_m)[wanted]) / points
    waves = wave_numbers(length_m, points)[wanted]
    return waves, amplitudes**2 * (length_m / (2.0 * np.pi))


def surface_spectrum(heights_m: Array, length_m: float) -> tuple[Array, Array]:
    """
    Return wave numbers, rad/m, and the density C_2D, m^4, of a periodic square surface.

    Parameters
    ----------
    heights_m : array, shape (points, points)
        Heights, m.
    length_m : float
        Side L, m.

    Notes
    -----
    C_2D = |B_2D|^2 (L/(2 pi))^2 (Eq. 3), averaged over the waves of a ring, one wave per length
    wide; its wave number is the mean of theirs.

    """
    points = len(heights_m)
    density = np.abs(np.fft.rfft2(heights_m) / points**2) ** 2 * (length_m / (2.0 * np.pi)) ** 2
    waves = _wave_numbers_2d(length_m, points)
    rings = np.rint(waves * (length_m / (2.0 * np.pi))).astype(int).ravel()
    counts = np.bincount(rings)
    wanted = slice(1, (points + 1) // 2)
    mean_wave, mean_density = (
        np.asarray(np.bincount(rings, values.ravel())[wanted] / counts[wanted])
        for values in (waves, density)
    )
    return mean_wave, mean_density


def fit_hurst(wave_number_per_m: Array, density: Array, dimensions: int) -> float:
    """
    Return the Hurst exponent of a density.

    Parameters
    ----------
    wave_number_per_m, density : array
        Wave numbers inside the power law, rad/m, and C_1D or C_2D there; 0 is left out.
    dimensions : int
        1 for C_1D ~ q^(-2H-1), 2 for C_2D ~ q^(-2H-2).

    Notes
    -----
    Least squares of the logarithms. The waves of a line are weighted with 1/q, so that every
    octave counts alike; the rings of a surface are not, as the first ones average over octaves.

    """
    filled = density > 0.0
    wave = wave_number_per_m[filled]
    weights = wave ** (0.5 * dimensions - 1.0)
    slope, _ = np.polyfit(np.log(wave), np.log(density[filled]), 1, w=weights)
    return float(-0.5 * (slope + dimensions))


def _wave_numbers_2d(length_m: float, points: int) -> Array:
    """Return |q| of a real transform, rad/m, shape (points, points // 2 + 1)."""
    along = np.fft.fftfreq(points, length_m / points / (2.0 * np.pi))
    return np.asarray(np.hypot(along[:, np.newaxis], wave_numbers(length_m, points)))
