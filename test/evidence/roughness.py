# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""References of roughness: Hess's rule, the prefactor of Pohrt and Popov, what was asked for."""

from math import pi

from evidence.closed_forms import HURST, RADIUS_M, RMS_HEIGHT_M, hess_integral
from evidence.group import ROUNDING, Group, grid

BY = 'test/evidence/roughness.py'
HURSTS = (0.3, 0.7, 0.9)
STRETCHED = 1e-10, '200 points of Gauss on a stretched variable'
LINE_FIT = 1e-9, 'only phases are random: the fit sees an exact power law'
RING_FIT = 1e-2, 'a ring averages waves that differ by one per length: the first ones by 20 %'
QUADRATURE = 1e-10, '200 points of Gauss, in the logarithm of q'
SQUARES = {'surface': '2 pi int q C_2D dq (Eq. 8)', 'line': '2 int C_1D dq (Eq. 9, corrected)'}


def prefactor(rms_height_m: float, hurst: float, radius_m: float) -> float:
    """Return Q_1D by Eqs 16 and 17 in one, kappa cancelled."""
    length_m = 2.0 * radius_m
    slope = (2.0 * (hurst + 1.0) / (1.9412 * length_m)) ** (hurst + 1.0)
    return slope * (hurst + 1.0) * length_m / (2.0 * hurst) * rms_height_m


GROUPS = [
    *(
        Group(
            'Roughness', 'hess_factor', factor, ROUNDING, f"Hess's rule, exact: {body}", BY,
            grid(exponent=[exponent]),
        )
        for body, exponent, factor in (
            ('cone', 1, pi / 2.0), ('sphere', 2, 2.0), ('r^4', 4, 8.0 / 3.0)
        )
    ),
    Group(
        'Roughness', 'hess_factor', hess_integral, STRETCHED, "Hess's rule by quadrature", BY,
        grid(exponent=[0.1, 0.4, 0.7, 1.3, 2.8, 3.6]),
    ),
    Group(
        'Roughness', 'rough_prefactor_1d', prefactor, ROUNDING, 'Eqs 16 and 17 in one', BY,
        grid(rms_height_m=[RMS_HEIGHT_M], hurst=[HURST], radius_m=[RADIUS_M]),
    ),
    *(
        Group(
            'Spectra', 'fitted_hurst', lambda body, hurst: hurst, tolerance, 'what is asked for',
            'request', grid(body=[body], hurst=HURSTS), version='',
        )
        for body, tolerance in (('line', LINE_FIT), ('surface', RING_FIT))
    ),
    Group(
        'Spectra', 'rms_m', RMS_HEIGHT_M, ROUNDING, 'what is asked for', 'request',
        grid(body=['line', 'surface'], hurst=HURSTS), version='',
    ),
    *(
        Group(
            'Spectra', 'mean_square_m2', RMS_HEIGHT_M**2, QUADRATURE,
            f'square of the rms; {integral}', 'request',
            grid(body=[body]), version='',
        )
        for body, integral in SQUARES.items()
    ),
]  # fmt: skip
