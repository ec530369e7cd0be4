"""Checks of the way from a rough surface to a profile: Hess's rule, Eqs 16 and 17."""

import math

import numpy as np

from stickslip_ros.contact.roughness import hess_factor, rough_prefactor_1d
from stickslip_ros.validation.checks import (
    ROUNDING,
    Check,
    Tolerance,
    compare,
    compare_printed,
    compare_worst,
)
from stickslip_ros.validation.closed_forms import hess_integral
from stickslip_ros.validation.findings import Curve, Findings, Panel
from stickslip_ros.validation.stand import HURST, RADIUS_M, RMS_HEIGHT_M

EXPONENTS = np.linspace(0.1, 4.0, 40, dtype=np.float64)
QUADRATURE = Tolerance(1e-10, '200 points of Gauss on a stretched variable')


def roughness() -> Findings:
    """Check Hess's factor and the prefactor of the rough profile."""
    return Findings('Roughness', (*_hess(), *_prefactor()), (_panel(),))


def _hess() -> list[Check]:
    exact = ((1.0, 'cone', math.pi / 2.0), (2.0, 'sphere', 2.0), (4.0, 'r^4', 8.0 / 3.0))
    checks = [
        compare(
            f'kappa({n:g}), {shape}', "Hess's rule, exact", value, hess_factor(n), '', ROUNDING
        )
        for n, shape, value in exact
    ]
    return [
        *checks,
        compare_printed('kappa(0.7)', 'reference table', '1.419818', hess_factor(HURST), ''),
        compare_worst(
            'kappa(n), n = 0.1 to 4',
            "Hess's rule by quadrature",
            [hess_integral(n) for n in EXPONENTS],
            [hess_factor(n) for n in EXPONENTS],
            '',
            QUADRATURE,
        ),
    ]


def _prefactor() -> list[Check]:
    ours = rough_prefactor_1d(RMS_HEIGHT_M, HURST, RADIUS_M)
    length_m = 2.0 * RADIUS_M
    slope = (2.0 * (HURST + 1.0) / (1.9412 * length_m)) ** (HURST + 1.0)
    cancelled = slope * (HURST + 1.0) * length_m / (2.0 * HURST) * RMS_HEIGHT_M
    return [
        compare_printed(
            'Q_1D for h = 1.1221 um, H = 0.7', 'reference table', '4.44782e-4', ours, 'm^0.3'
        ),
        compare_printed(
            'Q_1D as the paper prints it', 'paper, Section 4', '4.4478e-4', ours, 'm^0.3'
        ),
        compare(
            'Q_1D with kappa cancelled', 'Eqs 16 and 17 in one', cancelled, ours, 'm^0.3', ROUNDING
        ),
    ]


def _panel() -> Panel:
    some = EXPONENTS[::3]
    return Panel(
        "Hess's rule: from r^n to kappa |x|^n",
        'exponent n',
        'kappa(n)',
        (
            Curve('package', EXPONENTS, np.array([hess_factor(n) for n in EXPONENTS])),
            Curve('quadrature', some, np.array([hess_integral(n) for n in some]), 'points', 1),
        ),
    )
