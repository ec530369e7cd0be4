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
exact solution is used, so stiff bristles cannot make a step unstable.

"""

import math

from stickslip_ros.kernels.kernel import kernel
from stickslip_ros.kernels.record import COUNT, FLOAT, Record, kind
from stickslip_ros.parameters import LAWS

MDR, COULOMB, DAHL, LUGRE, EPM = range(len(LAWS))
SHARE_MIN = 1e-6
"""Least plastic share of a step that ends beyond steady sliding."""


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
    if law.number == DAHL:
        return coulomb_n / law.bristle_n_per_m
    ratio = v_m_per_s / law.stribeck_m_per_s
    decay = math.exp(-ratio * ratio)
    return coulomb_n * (1.0 + (law.static_ratio - 1.0) * decay) / law.bristle_n_per_m


@kernel
def plastic_share(law: Record, z_m: float, v_m_per_s: float, steady_m: float) -> float:
    """Return alpha: 0 for elastic bristles, 1 for sliding bristles; always 1 except in EPM."""
    if law.number != EPM:
        return 1.0
    if z_m * v_m_per_s <= 0.0:
        return 0.0
    breakaway_m = law.breakaway_ratio * steady_m
    size_m = abs(z_m)
    if size_m <= breakaway_m:
        return 0.0
    if size_m >= steady_m:
        return 1.0
    middle_m = 0.5 * (steady_m + breakaway_m)
    return 0.5 + 0.5 * math.sin(math.pi * (size_m - middle_m) / (steady_m - breakaway_m))


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
    steady_m = steady_deflection(law, coulomb_n, v_m_per_s)
    # Second order for EPM: the plastic share at the middle of the elastic motion.
    share = plastic_share(law, z_m + 0.5 * du_m, v_m_per_s, steady_m)
    after_m = z_m + du_m
    if share > 0.0 or abs(after_m) > steady_m:
        share = max(share, SHARE_MIN)
        end_m = math.copysign(steady_m, du_m) / share
        after_m = end_m + (z_m - end_m) * math.exp(-share * abs(du_m) / steady_m)
        largest_m = max(steady_m, abs(z_m))  # a long step of EPM would overshoot
        after_m = min(max(after_m, -largest_m), largest_m)
    rate_m_per_s = (after_m - z_m) / dt_s
    damping_n = law.bristle_n_s_per_m * rate_m_per_s if law.number != DAHL else 0.0
    damping_n += law.viscous_n_s_per_m * v_m_per_s
    middle_n = 0.5 * law.bristle_n_per_m * (z_m + after_m)
    lost_j = middle_n * (du_m - (after_m - z_m)) + damping_n * du_m
    return after_m, law.bristle_n_per_m * after_m + damping_n, lost_j
