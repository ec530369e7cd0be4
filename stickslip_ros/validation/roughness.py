"""Checks of roughness: from a rough surface to a profile, and random lines and surfaces."""

from itertools import pairwise
from math import log, log10, pi

import numpy as np
from numpy.typing import NDArray

from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.roughness import (
    Spectrum,
    fit_hurst,
    hess_factor,
    line_spectrum,
    rough_line,
    rough_prefactor_1d,
    rough_surface,
    surface_spectrum,
)
from stickslip_ros.validation.checks import (
    ROUNDING,
    Curve,
    Family,
    Measured,
    Panel,
    Tolerance,
    measures,
    printed,
    shared,
)
from stickslip_ros.validation.references import (
    HURST,
    RADIUS_M,
    RMS_HEIGHT_M,
    hess_integral,
    unit_quadrature,
)
from stickslip_ros.validation.springs import rough_line_checks, rough_line_panel

EXPONENTS = np.linspace(0.1, 4.0, 40, dtype=np.float64)
STRETCHED = Tolerance(1e-10, '200 points of Gauss on a stretched variable')
EXACT, TABLE = "Hess's rule, exact", 'reference table'


@measures(
    ('kappa(1), cone', EXACT, '', ROUNDING),
    ('kappa(2), sphere', EXACT, '', ROUNDING),
    ('kappa(4), r^4', EXACT, '', ROUNDING),
    ('kappa(0.7)', TABLE, '', printed('1.419818')),
    ('kappa(n), n = 0.1 to 4', "Hess's rule by quadrature", '', STRETCHED),
)
def _hess() -> Measured:
    return (
        (pi / 2.0, hess_factor(1.0)),
        (2.0, hess_factor(2.0)),
        (8.0 / 3.0, hess_factor(4.0)),
        hess_factor(HURST),
        ([hess_integral(n) for n in EXPONENTS], [hess_factor(n) for n in EXPONENTS]),
    )


@measures(
    ('Q_1D for h = 1.1221 um, H = 0.7', TABLE, 'm^0.3', printed('4.44782e-4')),
    ('Q_1D as the paper prints it', 'paper, Section 4', 'm^0.3', printed('4.4478e-4')),
    ('Q_1D with kappa cancelled', 'Eqs 16 and 17 in one', 'm^0.3', ROUNDING),
)
def _prefactor() -> Measured:
    ours = rough_prefactor_1d(RMS_HEIGHT_M, HURST, RADIUS_M)
    length_m = 2.0 * RADIUS_M
    slope = (2.0 * (HURST + 1.0) / (1.9412 * length_m)) ** (HURST + 1.0)
    return ours, ours, (slope * (HURST + 1.0) * length_m / (2.0 * HURST) * RMS_HEIGHT_M, ours)


def _hess_panel() -> Panel:
    some = EXPONENTS[::3]
    curves = (
        Curve('package', EXPONENTS, np.array([hess_factor(n) for n in EXPONENTS])),
        Curve('quadrature', some, np.array([hess_integral(n) for n in some]), 'points', 1),
    )
    return Panel("Hess's rule: from r^n to kappa |x|^n", 'exponent n', 'kappa(n)', curves)


ROUGHNESS = Family('Roughness', (_hess, _prefactor), (_hess_panel,))


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
ASKED, SQUARE = 'what was asked for', 'square of the rms asked for'
SURFACE, LINE = '2 pi int q C_2D dq', '2 int C_1D dq'


@shared
def line_and_surface(hurst: float) -> tuple[Array, Array]:
    """Return heights, m, whose spectra fill their grids from the first wave to the last."""
    line, surface = (
        Spectrum(hurst, RMS_HEIGHT_M, FIRST_PER_M, FIRST_PER_M * points / 2.0)
        for points in (LINE_POINTS, SURFACE_POINTS)
    )
    line_m = rough_line(line, LENGTH_M, LINE_POINTS, SEED)
    return line_m, rough_surface(surface, LENGTH_M, SURFACE_POINTS, SEED)


@measures(
    (f'line of {LINE_POINTS}, H = {{:g}}: fitted H', ASKED, '', LINE_FIT),
    (f'line of {LINE_POINTS}, H = {{:g}}: rms', ASKED, 'm', ROUNDING),
    (f'surface of {SURFACE_POINTS}^2, H = {{:g}}: fitted H', ASKED, '', RING_FIT),
    (f'surface of {SURFACE_POINTS}^2, H = {{:g}}: rms', ASKED, 'm', ROUNDING),
    each=HURSTS,
)
def _realisations(hurst: float) -> Measured:
    line_m, surface_m = line_and_surface(hurst)
    return (
        (hurst, fit_hurst(*line_spectrum(line_m, LENGTH_M), 1)),
        (RMS_HEIGHT_M, np.sqrt(np.mean(line_m**2))),
        (hurst, fit_hurst(*surface_spectrum(surface_m, LENGTH_M), 2)),
        (RMS_HEIGHT_M, np.sqrt(np.mean(surface_m**2))),
    )


@measures(
    (f'{{}}: {SURFACE} (Eq. 8)', SQUARE, 'm^2', QUADRATURE),
    (f'{{}}: {LINE} (Eq. 9, corrected)', SQUARE, 'm^2', QUADRATURE),
    ('{}: line against surface', SURFACE, 'm^2', ROUNDING),
    each=(('no roll-off', 0.0), ('roll-off', ROLL_OFF)),
)
def _mean_squares(_words: str, roll_off: float) -> Measured:
    """Compare Eq. 8 and the corrected Eq. 9 by quadrature: one mean square."""
    lower, upper, knee = FIRST_PER_M, 1e4 * FIRST_PER_M, roll_off * FIRST_PER_M
    spectrum = Spectrum(0.7, RMS_HEIGHT_M, lower, upper, knee)
    surface_m2 = line_m2 = 0.0
    points, weights = unit_quadrature()
    for low, high in pairwise([lower, *([knee] if knee else []), upper]):
        octaves = log(high / low)
        waves = low * np.exp(octaves * points)
        steps = weights * octaves * waves
        surface_m2 += 2.0 * pi * float(np.sum(steps * waves * spectrum.density_2d(waves)))
        line_m2 += 2.0 * float(np.sum(steps * spectrum.density_1d(waves)))
    square_m2 = RMS_HEIGHT_M**2
    return (square_m2, surface_m2), (square_m2, line_m2), (surface_m2, line_m2)


def _spectrum_panel() -> Panel:
    curves = []
    for colour, hurst in enumerate(HURSTS):
        line_m, surface_m = line_and_surface(hurst)
        waves, density = line_spectrum(line_m, LENGTH_M)
        some = _spread(60, len(waves))
        line = Curve(f'line, H = {hurst:g}', waves[some], density[some] * 1e18, 'line', colour)
        rings, density = surface_spectrum(surface_m, LENGTH_M)
        some = _spread(14, len(rings))
        line_density = pi * rings[some] * density[some] * 1e18
        curves += [line, Curve('surface, pi q C_2D', rings[some], line_density, 'points', colour)]
    title = 'Spectrum of lines and surfaces of one rms'
    return Panel(title, 'wave number q (rad/m)', 'C_1D (um^3)', curves, log_x=True, log_y=True)


def _spread(count: int, length: int) -> NDArray[np.intp]:
    """Return places in an array that are equally far apart on a logarithmic axis."""
    return np.unique(np.logspace(0.0, log10(length), count).astype(np.intp)) - 1


SPECTRA = Family(
    'Spectra',
    (_realisations, _mean_squares, rough_line_checks),
    (_spectrum_panel, rough_line_panel),
)
