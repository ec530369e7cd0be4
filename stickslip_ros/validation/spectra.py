"""Checks of random roughness: Hurst exponent, rms, and the two ways to sum a spectrum."""

from functools import lru_cache
from itertools import pairwise
from math import log, log10, pi

import numpy as np

from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.self_affine import (
    Spectrum,
    fit_hurst,
    line_spectrum,
    rough_line,
    rough_surface,
    surface_spectrum,
)
from stickslip_ros.validation.checks import ROUNDING, Check, Tolerance, compare
from stickslip_ros.validation.closed_forms import unit_quadrature
from stickslip_ros.validation.findings import Curve, Findings, Panel
from stickslip_ros.validation.rough_line import rough_line_checks, rough_line_panel
from stickslip_ros.validation.stand import RADIUS_M, RMS_HEIGHT_M

HURSTS = (0.3, 0.7, 0.9)
LENGTH_M = 2.0 * RADIUS_M
FIRST_PER_M = 2.0 * pi / LENGTH_M
LINE_POINTS, SURFACE_POINTS, SEED = 1 << 14, 512, 11
ROLL_OFF = 20.0
"""Roll-off of one of the spectra that are integrated, in waves per length."""
LINE_FIT = Tolerance(1e-9, 'only phases are random: the fit sees an exact power law')
RING_FIT = Tolerance(
    1e-2, 'a ring averages waves that differ by one per length: the first ones by 20 %'
)
QUADRATURE = Tolerance(1e-10, '200 points of Gauss per power law, in the logarithm of q')


def spectra() -> Findings:
    """Check lines and surfaces, their spectrum, and the contact under a rough line."""
    checks: list[Check] = []
    for hurst in HURSTS:
        checks += _realisations(hurst)
    checks += [*_mean_squares('no roll-off', 0.0), *_mean_squares('roll-off', ROLL_OFF)]
    checks += rough_line_checks()
    return Findings('Spectra', tuple(checks), (_panel(), rough_line_panel()))


def full_spectrum(hurst: float, points: int) -> Spectrum:
    """Return a spectrum that fills a grid from its first wave to its last."""
    return Spectrum(hurst, RMS_HEIGHT_M, FIRST_PER_M, FIRST_PER_M * points / 2.0)


@lru_cache(maxsize=len(HURSTS))
def line_and_surface(hurst: float) -> tuple[Array, Array]:
    """Return heights of a line and of a surface, m."""
    line_m = rough_line(full_spectrum(hurst, LINE_POINTS), LENGTH_M, LINE_POINTS, SEED)
    surface = full_spectrum(hurst, SURFACE_POINTS)
    return line_m, rough_surface(surface, LENGTH_M, SURFACE_POINTS, SEED)


def _realisations(hurst: float) -> list[Check]:
    line_m, surface_m = line_and_surface(hurst)
    shapes = (
        (f'line of {LINE_POINTS}', line_m, line_spectrum(line_m, LENGTH_M), LINE_FIT),
        (
            f'surface of {SURFACE_POINTS}^2',
            surface_m,
            surface_spectrum(surface_m, LENGTH_M),
            RING_FIT,
        ),
    )
    checks = []
    for dimensions, (shape, heights_m, spectrum, tolerance) in enumerate(shapes, start=1):
        found = fit_hurst(*spectrum, dimensions)
        rms_m = float(np.sqrt(np.mean(heights_m**2)))
        name, text = f'{shape}, H = {hurst:g}', 'what was asked for'
        checks += [
            compare(f'{name}: fitted H', text, hurst, found, '', tolerance),
            compare(f'{name}: rms', text, RMS_HEIGHT_M, rms_m, 'm', ROUNDING),
        ]
    return checks


def _mean_squares(words: str, roll_off: float) -> list[Check]:
    """Check Eq. 8 and the corrected Eq. 9 by quadrature: one mean square."""
    lower, upper = FIRST_PER_M, 1e4 * FIRST_PER_M
    knee = roll_off * FIRST_PER_M
    spectrum = Spectrum(0.7, RMS_HEIGHT_M, lower, upper, knee)
    edges = [lower, *([knee] if knee else []), upper]
    surface_m2 = line_m2 = 0.0
    points, weights = unit_quadrature()
    for low, high in pairwise(edges):
        octaves = log(high / low)
        waves = low * np.exp(octaves * points)
        steps = weights * octaves * waves
        surface_m2 += 2.0 * pi * float(np.sum(steps * waves * spectrum.density_2d(waves)))
        line_m2 += 2.0 * float(np.sum(steps * spectrum.density_1d(waves)))
    rms = 'square of the rms asked for'
    surface, line = '2 pi int q C_2D dq', '2 int C_1D dq'
    square_m2 = RMS_HEIGHT_M**2
    return [
        compare(f'{words}: {surface} (Eq. 8)', rms, square_m2, surface_m2, 'm^2', QUADRATURE),
        compare(f'{words}: {line} (Eq. 9, corrected)', rms, square_m2, line_m2, 'm^2', QUADRATURE),
        compare(f'{words}: line against surface', surface, surface_m2, line_m2, 'm^2', ROUNDING),
    ]


def _panel() -> Panel:
    curves = []
    for colour, hurst in enumerate(HURSTS):
        line_m, surface_m = line_and_surface(hurst)
        waves, density = line_spectrum(line_m, LENGTH_M)
        some = np.unique(np.logspace(0.0, log10(len(waves)), 60).astype(int)) - 1
        curves.append(
            Curve(f'line, H = {hurst:g}', waves[some], density[some] * 1e18, 'line', colour)
        )
        rings, ring_density = surface_spectrum(surface_m, LENGTH_M)
        some = np.unique(np.logspace(0.0, log10(len(rings)), 14).astype(int)) - 1
        from_surface = pi * rings[some] * ring_density[some] * 1e18
        curves.append(Curve('surface, pi q C_2D', rings[some], from_surface, 'points', colour))
    return Panel(
        'Spectrum of lines and surfaces of one rms',
        'wave number q (rad/m)',
        'C_1D (um^3)',
        tuple(curves),
        log_x=True,
        log_y=True,
    )
