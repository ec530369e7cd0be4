# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Random surfaces, and the spectra of lines and surfaces."""

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.contact.roughness import Spectrum, wave_numbers


def rough_surface(spectrum: Spectrum, length_m: float, points: int, seed: int) -> Array:
    """Return heights, m, of a periodic square surface (Eqs 1 to 3), mean 0, exact rms."""
    spectrum.check_grid(length_m, points)
    power = spectrum.density_2d(_wave_numbers_2d(length_m, points))
    power[0, 0] = 0.0
    if points % 2 == 0:
        power[points // 2, :] = power[:, -1] = 0.0
    # The omitted half of a real transform repeats all columns except the first.
    power *= spectrum.rms_height_m**2 / (2.0 * np.sum(power) - np.sum(power[:, 0]))
    phases = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, power.shape)
    middle = (points + 1) // 2
    phases[:-middle:-1, 0] = -phases[1:middle, 0]
    return np.fft.irfft2(points**2 * np.sqrt(power) * np.exp(1j * phases), (points, points))


def line_spectrum(heights_m: Array, length_m: float) -> tuple[Array, Array]:
    """Return wave numbers, rad/m, and C_1D = |B_1D|^2 L/(2 pi), m^3 (Eq. 13), of a line."""
    points = len(heights_m)
    wanted = slice(1, (points + 1) // 2)
    amplitudes = np.abs(np.fft.rfft(heights_m)[wanted]) / points
    waves = wave_numbers(length_m, points)[wanted]
    return waves, amplitudes**2 * (length_m / (2.0 * np.pi))


def surface_spectrum(heights_m: Array, length_m: float) -> tuple[Array, Array]:
    """
    Return wave numbers, rad/m, and C_2D, m^4, of a periodic square surface.

    C_2D = |B_2D|^2 (L/(2 pi))^2 (Eq. 3), averaged with its wave numbers over rings one wave wide.

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
    Return the Hurst exponent of C_1D ~ q^(-2H-1) or C_2D ~ q^(-2H-2), by dimensions.

    Least squares of logarithms. Waves of a line have the weight 1/q, so octaves count equally;
    rings of a surface have equal weights, as the first rings average over octaves.

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
