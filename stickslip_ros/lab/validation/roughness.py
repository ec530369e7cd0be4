# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Answers for roughness: Hess's rule, random lines and surfaces, spectra."""

from collections.abc import Callable, Mapping
from functools import lru_cache
from math import log, pi
from typing import Any

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.contact.roughness import Spectrum, hess_factor, rough_line, rough_prefactor_1d
from stickslip_ros.lab.validation.surfaces import (
    fit_hurst,
    line_spectrum,
    rough_surface,
    surface_spectrum,
)

LENGTH_M = 1e-3
RMS_HEIGHT_M = 1.1221e-6
FIRST_PER_M = 2.0 * pi / LENGTH_M
_LINE_POINTS, _SURFACE_POINTS, _SEED = 1 << 14, 512, 11


@lru_cache(maxsize=3)
def line_and_surface(hurst: float) -> tuple[Array, Array]:
    """Return heights, m, with spectra from the first wave to the last of their grids."""
    line, surface = (
        Spectrum(hurst, RMS_HEIGHT_M, FIRST_PER_M, FIRST_PER_M * points / 2.0)
        for points in (_LINE_POINTS, _SURFACE_POINTS)
    )
    line_m = rough_line(line, LENGTH_M, _LINE_POINTS, _SEED)
    return line_m, rough_surface(surface, LENGTH_M, _SURFACE_POINTS, _SEED)


def fitted_hurst(body: str, hurst: float) -> float:
    """Return the exponent of the spectrum of a random line or surface."""
    line_m, surface_m = line_and_surface(hurst)
    if body == 'line':
        return fit_hurst(*line_spectrum(line_m, LENGTH_M), 1)
    return fit_hurst(*surface_spectrum(surface_m, LENGTH_M), 2)


def rms_m(body: str, hurst: float) -> float:
    """Return the rms height of a random line or surface."""
    heights_m = line_and_surface(hurst)[0 if body == 'line' else 1]
    return float(np.sqrt(np.mean(heights_m**2)))


def mean_square_m2(body: str) -> float:
    """Return the integral of a spectrum: 2 pi int q C_2D dq (Eq. 8) or 2 int C_1D dq (Eq. 9)."""
    span = 1e4
    spectrum = Spectrum(0.7, RMS_HEIGHT_M, FIRST_PER_M, span * FIRST_PER_M)
    points, weights = np.polynomial.legendre.leggauss(200)
    waves = FIRST_PER_M * np.exp(0.5 * log(span) * (1.0 + points))
    steps = 0.5 * weights * log(span) * waves
    if body == 'line':
        return 2.0 * float(np.sum(steps * spectrum.density_1d(waves)))
    return 2.0 * pi * float(np.sum(steps * waves * spectrum.density_2d(waves)))


ANSWERS: Mapping[str, Callable[..., Any]] = {
    'hess_factor': hess_factor,
    'rough_prefactor_1d': rough_prefactor_1d,
    'fitted_hurst': fitted_hurst,
    'rms_m': rms_m,
    'mean_square_m2': mean_square_m2,
}
"""Functions by quantity; the name ends with the unit."""
