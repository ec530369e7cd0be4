# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Kernel: rival friction laws, to compare with the contact model.

Coulomb; Dahl (1968); LuGre (Canudas de Wit, Olsson, Astrom, Lischinsky 1995); elasto-plastic,
EPM (Dupont, Hayward, Armstrong, Altpeter 2002). CEIM (Edeler 2011) is missing because its
equations are not publicly available.

z is the deflection of the bristles, v the sliding velocity, g(v) = [Fc + (Fs - Fc)
exp(-(v/vs)^2)]/sigma0. If v and the coefficient of z are constant in a step,
z' = v (1 - alpha z sgn(v)/g) has the solution z -> z_ss + (z - z_ss) exp(-alpha |v| dt/g). This
exact solution is used, so stiff bristles cannot make a step unstable; EPM's alpha changes with z.

"""

import math

from stickslip_ros.kernels.kernel import kernel
from stickslip_ros.kernels.record import COUNT, FLOAT, Record, kind
from stickslip_ros.parameters import LAWS

MDR, COULOMB, DAHL, LUGRE, EPM = range(len(LAWS))
SHORT_WAY = 0.25
"""Longest way of bristles, relative to g, for which Pade's fraction replaces the exponential: that
costs more than the rest of a law."""

LAW = kind(
    number=COUNT,  # MDR, COULOMB, DAHL, LUGRE or EPM
    bristle_n_per_m=FLOAT,  # sigma0, stiffness of the bristles
    bristle_n_s_per_m=FLOAT,  # sigma1, damping of the bristles
    viscous_n_s_per_m=FLOAT,  # sigma2, viscous friction
    static_ratio=FLOAT,  # Fs/Fc, static over Coulomb friction, >= 1
    stribeck_m_per_s=FLOAT,  # vs, Stribeck velocity
    breakaway_ratio=FLOAT,  # z_ba/z_ss of EPM, in [0, 1): bristles deflected less are elastic
)
"""Constants of a friction law."""


@kernel
def steady_deflection(law: Record, coulomb_n: float, v_m_per_s: float) -> float:
    """Return g(v) = |z_ss|, the deflection of steady sliding, m."""
    if law.number == DAHL or law.static_ratio <= 1.0:
        return coulomb_n / law.bristle_n_per_m
    ratio = v_m_per_s / law.stribeck_m_per_s
    stribeck = (law.static_ratio - 1.0) * math.exp(-ratio * ratio)
    return coulomb_n * (1.0 + stribeck) / law.bristle_n_per_m


@kernel
def plastic_share(law: Record, bent: float) -> float:
    """Return alpha at z sgn(v)/g: 0 if bristles are elastic, 1 if they slide; 1 except in EPM."""
    if law.number != EPM:
        return 1.0
    place = (bent - law.breakaway_ratio) * (1.0 / (1.0 - law.breakaway_ratio))
    if not 0.0 < place < 1.0:
        return 1.0 if place > 0.0 else 0.0
    return 0.5 - 0.5 * math.cos(math.pi * place)


@kernel
def bend(law: Record, bent: float) -> float:
    """Return dz/du at z sgn(v)/g, 1 - alpha z sgn(v)/g."""
    return 1.0 - plastic_share(law, bent) * bent


@kernel
def follow_plastic_share(law: Record, bent: float, way: float) -> tuple[float, float]:
    """Return EPM's z sgn(v)/g after a way |du|/g, and its middle above the chord; Runge-Kutta."""
    first = bend(law, bent)
    second = bend(law, bent + 0.5 * way * first)
    third = bend(law, bent + 0.5 * way * second)
    last = bend(law, bent + way * third)
    after = bent + way * (first + 2.0 * (second + third) + last) / 6.0
    return min(after, max(1.0, bent)), way * (first - last) / 8.0


@kernel
def decay_over(way: float) -> float:
    """Return exp(-way) of a way >= 0; for short ways by Pade's fraction, to 6e-10."""
    if way > SHORT_WAY:
        return math.exp(-way)
    even, odd = 120.0 + 12.0 * way * way, way * (60.0 + way * way)
    return (even - odd) / (even + odd)


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
    per_s = 1.0 / dt_s
    v_m_per_s = du_m * per_s
    sense, steady_m = math.copysign(1.0, du_m), steady_deflection(law, coulomb_n, v_m_per_s)
    per_m = 1.0 / steady_m
    bent, way = sense * (per_m * z_m), per_m * abs(du_m)
    if law.number == EPM and way < 1.0:
        after, bow = follow_plastic_share(law, bent, way)
    else:  # Dahl and LuGre; in EPM the drive takes no such steps
        decay = decay_over(0.5 * way)
        after = 1.0 + (bent - 1.0) * decay * decay
        bow = 1.0 + (bent - 1.0) * decay - 0.5 * (bent + after)
    after_m = sense * (steady_m * after)
    damping_n = law.viscous_n_s_per_m * v_m_per_s
    if law.number != DAHL:
        damping_n += law.bristle_n_s_per_m * per_s * (after_m - z_m)
    middle_n = 0.5 * law.bristle_n_per_m * (z_m + after_m)
    lost_j = middle_n * (du_m - (after_m - z_m)) + damping_n * du_m
    lost_j += 2.0 / 3.0 * law.bristle_n_per_m * (steady_m * bow) * abs(du_m)  # Simpson's rule
    return after_m, law.bristle_n_per_m * after_m + damping_n, lost_j
