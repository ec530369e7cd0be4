# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Kernel: rival friction laws, to compare with the contact model.

Coulomb; Dahl (1968); LuGre (Canudas de Wit, Olsson, Astrom, Lischinsky 1995); elasto-plastic,
EPM (Dupont, Hayward, Armstrong, Altpeter 2002). CEIM (Edeler 2011) is missing because its
equations are not publicly available.

z is the deflection of the bristles, v the sliding velocity, g(v) = [Fc + (Fs - Fc)
exp(-(v/vs)^2)]/sigma0. If v is constant in a step, z/g follows from the way |du|/g alone. Its lag
behind steady sliding falls by exp(-|du|/g): it is 1 - z sgn(v)/g, in EPM a tabulated function of
that, and 1 where EPM's bristles are elastic. This exact solution is used, so stiff bristles cannot
make a step unstable.

"""

import math
from functools import lru_cache

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.kernels.kernel import kernel
from stickslip_ros.kernels.record import COUNT, FLAG, FLOAT, Record, kind
from stickslip_ros.parameters import LAWS

MDR, COULOMB, DAHL, LUGRE, EPM = range(len(LAWS))
SHORT_WAY = 0.25
"""Longest way of bristles, relative to g, for which Pade's fraction replaces the exponential, to
6e-10: that costs more than the rest of a law."""
EPM_CELLS, _FINE = 4096, 16
"""Cells of EPM's table, with an error of 4e-8 of g, and nodes per cell from which it is made."""

LAW = kind(
    number=COUNT,  # MDR, COULOMB, DAHL, LUGRE or EPM
    bristle_n_per_m=FLOAT,  # sigma0, stiffness of the bristles
    depends_on_rate=FLAG,  # Whether friction depends on velocity
    bristle_n_s_per_m=FLOAT,  # sigma1, damping of the bristles
    viscous_n_s_per_m=FLOAT,  # sigma2, viscous friction
    static_ratio=FLOAT,  # Fs/Fc, static over Coulomb friction, >= 1
    stribeck_m_per_s=FLOAT,  # vs, Stribeck velocity
    breakaway_ratio=FLOAT,  # z_ba/z_ss of EPM, in [0, 1): bristles deflected less are elastic
    bents=(FLOAT, (EPM_CELLS + 1,)),  # z/g of EPM beyond z_ba, at equal distances of the lag
)
"""Constants of a friction law."""


@kernel
def bristles_towards(
    law: Record, coulomb_n: float, z_m: float, v_m_per_s: float
) -> tuple[float, float, float, float]:
    """Return g(v) sgn(v), m, and for bristles there z sgn(v)/g, its lag, and dz/du."""
    steady_m = math.copysign(coulomb_n / law.bristle_n_per_m, v_m_per_s)
    if law.number != DAHL and law.static_ratio > 1.0:
        ratio = v_m_per_s / law.stribeck_m_per_s
        steady_m *= 1.0 + (law.static_ratio - 1.0) * math.exp(-ratio * ratio)
    bent = z_m / steady_m
    if law.number != EPM:
        return steady_m, bent, 1.0 - bent, 1.0 - bent
    if bent < law.breakaway_ratio:
        return steady_m, bent, 1.0, 1.0
    cell, end = 0, EPM_CELLS
    while end - cell > 1:
        middle = (cell + end) // 2
        cell, end = (middle, end) if law.bents[middle] < bent else (cell, middle)
    rise = law.bents[cell + 1] - law.bents[cell]
    lag = 1.0 - (cell + (bent - law.bents[cell]) / rise) / EPM_CELLS
    return steady_m, bent, lag, lag * rise * EPM_CELLS


@kernel
def bristles_after(
    law: Record, bent: float, lag: float, rate: float, way: float
) -> tuple[float, float, float, float]:
    """Return z sgn(v)/g, lag, dz/du and loss per sigma0 g^2 after a way |du|/g >= 0."""
    if law.number == EPM:
        start = max(bent, law.breakaway_ratio)
        way, bent = way - (start - bent), start
        if way <= 0.0:
            return start + way, 1.0, 1.0, 0.0
    odd = way * (60.0 + way * way)
    settled = 2.0 * odd / (120.0 + 12.0 * (way * way) + odd)
    rise = lag * (settled if way < SHORT_WAY else 1.0 - math.exp(-way))
    lag -= rise
    last = lag
    if law.number == EPM:
        place = (1.0 - lag) * EPM_CELLS
        cell = min(max(int(place), 0), EPM_CELLS - 1)
        slope = law.bents[cell + 1] - law.bents[cell]
        rise = law.bents[cell] + (place - cell) * slope - bent
        last *= slope * EPM_CELLS
    # The trapezoidal rule, corrected by the slopes at both ends.
    lost = (bent + 0.5 * rise) * (way - rise) + way * way * (rate - last) / 12.0
    return bent + rise, lag, last, lost


@kernel
def deflect(
    law: Record, coulomb_n: float, z_m: float, du_m: float, dt_s: float
) -> tuple[float, float, float]:
    """
    Move the bristles of Dahl, LuGre or EPM by du in a step of dt.

    Returns the deflection after the step (m), the friction force against du (N) and the friction
    loss (J).

    """
    if du_m == 0.0:
        return z_m, law.bristle_n_per_m * z_m, 0.0
    v_m_per_s = du_m / dt_s
    steady_m, bent, lag, rate = bristles_towards(law, coulomb_n, z_m, v_m_per_s)
    after, _, _, lost = bristles_after(law, bent, lag, rate, du_m / steady_m)
    damping_n = law.viscous_n_s_per_m * v_m_per_s
    if law.number != DAHL:
        damping_n += law.bristle_n_s_per_m * ((steady_m * after - z_m) / dt_s)
    lost_j = law.bristle_n_per_m * (steady_m * steady_m) * lost + damping_n * du_m
    return steady_m * after, law.bristle_n_per_m * (steady_m * after) + damping_n, lost_j


@lru_cache(maxsize=8)
def plastic_bents(breakaway_ratio: float) -> Array:
    """Return ``bents`` of EPM: log(lag) is integrated, less that of a straight dz/du."""
    plastic, places = 1.0 - breakaway_ratio, np.linspace(0.0, 1.0, EPM_CELLS * _FINE + 1)
    bents, left = breakaway_ratio + plastic * places, 1.0 - places
    pull = bents * (0.5 * np.pi * np.sinc(0.5 * left)) ** 2  # (1 - alpha) z/g per left^2
    terms = pull / (plastic + pull * left)
    grown = np.append(0.0, np.cumsum(terms[1:] + terms[:-1]) / (2 * EPM_CELLS * _FINE))
    return np.interp(places[::_FINE], 1.0 - left * np.exp(grown), bents)
