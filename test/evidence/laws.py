# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""References of the rival friction laws: printed figures of a benchmark, and closed forms."""

import math

from evidence.closed_forms import LIMIT_PER_PRELOAD
from evidence.group import ROUNDING, Group, grid, printed

FAMILY, BY = 'Friction laws', 'test/evidence/laws.py'
COULOMB_N, STATIC_N, SIGMA_0, SIGMA_2, STRIBECK_M_PER_S = 1.0, 1.5, 1e5, 0.4, 1e-3
"""Canudas de Wit, Olsson, Astrom, Lischinsky (1995), for a unit mass."""
MASS_KG, TIME_S = 3e-3, 20e-3
TEXT = 'our own specification, case of Canudas de Wit et al. 1995'


def lugre_drift_m(mean_n: float, wave_n: float, **_: object) -> float:
    """Return the quasi-static drift of LuGre per cycle of force."""
    square, least, most = STATIC_N**2, mean_n - wave_n, mean_n + wave_n
    return STATIC_N / SIGMA_0 * math.log((square - least**2) / (square - most**2))


def stribeck_n(speed_m_per_s: float, **_: object) -> float:
    """Return the friction of steady sliding."""
    decay = math.exp(-((speed_m_per_s / STRIBECK_M_PER_S) ** 2))
    return COULOMB_N + (STATIC_N - COULOMB_N) * decay + SIGMA_2 * speed_m_per_s


def dahl_n(displacement_m: float, **_: object) -> float:
    """Return Dahl's friction on the first loading."""
    return COULOMB_N * (1.0 - math.exp(-SIGMA_0 * displacement_m / COULOMB_N))


def dahl_end_n(amplitude_m: float, **_: object) -> float:
    """Return Dahl's friction at the end of a steady loop."""
    return COULOMB_N * math.tanh(SIGMA_0 * amplitude_m / COULOMB_N)


def dahl_loss_j(amplitude_m: float, **_: object) -> float:
    """Return Dahl's loss per loop."""
    return 4.0 * COULOMB_N * (amplitude_m - dahl_end_n(amplitude_m) / SIGMA_0)


def way_m(load_n: float, preload_n: float) -> float:
    """Return how far a load pulls a free runner under Coulomb friction."""
    free_n = load_n - LIMIT_PER_PRELOAD * preload_n
    return 0.5 / MASS_KG * free_n * TIME_S**2 if free_n > 0.0 else 0.0


GROUPS = [
    *(
        printed(FAMILY, 'slip_start_s', figure, f'{TEXT}; v > vs', {'slip': slip})
        for slip, figure in enumerate(('7.438', '13.800', '20.163'), 1)
    ),
    *(
        printed(FAMILY, 'plateau_m', figure, TEXT, {'plateau': plateau})
        for plateau, figure in enumerate(('0.6363', '1.2726'), 1)
    ),
    printed(FAMILY, 'largest_friction_n', '1.477', TEXT, {}),
    Group(
        FAMILY, 'drift_per_cycle_m', lugre_drift_m,
        (1e-4, 'inertia and bristle damping at 0.25 Hz; falls as the square of it'),
        'LuGre: (Fs/sigma0) ln[(Fs^2 - F1^2)/(Fs^2 - F2^2)]', BY,
        grid(law=['lugre'], mean_n=[0.5], wave_n=[0.3]),
    ),
    Group(
        FAMILY, 'drift_per_cycle_m', 0.0,
        (1e-12, 'of the deflection Fs/sigma0: rounding of the position'),
        'EPM below z_ba: none (Dupont et al. 2002)', BY,
        grid(law=['epm'], mean_n=[0.5], wave_n=[0.3]), STATIC_N / SIGMA_0,
    ),
    Group(
        FAMILY, 'steady_friction_n', stribeck_n, ROUNDING,
        'Fc + (Fs - Fc) exp(-(v/vs)^2) + sigma2 v', BY,
        grid(law=['lugre', 'epm'], speed_m_per_s=[1e-4, 1e-3, 3e-3, 1e-2]),
    ),
    Group(
        FAMILY, 'virgin_friction_n', dahl_n, ROUNDING, 'Dahl: Fc (1 - exp(-sigma0 x/Fc))', BY,
        grid(law=['dahl'], displacement_m=[1e-6, 1e-5, 6e-5]), COULOMB_N,
    ),
    Group(
        FAMILY, 'loop_end_n', dahl_end_n, (1e-9, '30 cycles of settling'),
        'Dahl: Fc tanh(sigma0 X/Fc)', BY, grid(law=['dahl'], amplitude_m=[1.3e-5]),
    ),
    Group(
        FAMILY, 'loop_loss_j', dahl_loss_j,
        (1e-9, "Simpson's rule of the loss, 400 steps per leg"),
        'Dahl: 4 Fc [X - (Fc/sigma0) tanh(sigma0 X/Fc)]', BY,
        grid(law=['dahl'], amplitude_m=[1.3e-5]),
    ),
    Group(
        FAMILY, 'coulomb_way_m', way_m,
        (1e-8, 'of the way without friction: half a step of 0.6 us, out of 20 ms, squared'),
        'Coulomb: rest', BY, grid(preload_n=[0.5], load_n=[0.21]),
        0.5 / MASS_KG * 0.21 * TIME_S**2,
    ),
    Group(
        FAMILY, 'coulomb_friction_n', lambda preload_n, load_n: LIMIT_PER_PRELOAD * preload_n,
        ROUNDING, 'Coulomb: mu 2 sqrt2 F_p', BY, grid(preload_n=[0.5], load_n=[0.51]),
    ),
    Group(
        FAMILY, 'coulomb_way_m', way_m,
        (3e-4, 'half a step of 0.6 us without friction, times 5 for the small excess'),
        'Coulomb: (F_ext - mu 2 sqrt2 F_p) t^2/(2 m)', BY, grid(preload_n=[0.5], load_n=[0.51]),
    ),
]  # fmt: skip
