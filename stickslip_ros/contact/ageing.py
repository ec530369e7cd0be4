# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Kernel: friction that remembers how long each spring has rested, and feels how fast it slips.

The rate-and-state law of Dieterich (1979) and Ruina (1983), cut off at low speeds; each spring has
a slip speed s and an age theta of its own:

    mu = mu0 + a ln((s + v_c)/(v0 + v_c)) + b ln(v0 theta/D_c),  theta' = 1 - s theta/D_c

A spring of stiffness k under a normal force f_z sticks up to mu f_z of s = 0. If it is pulled with
more, it slips, and its force says how fast. Against a runner of velocity v its slowness
1/(s + v_c) then changes as an age does, within some nanometres l = a f_z/k:

    d/dt 1/(s + v_c) = (1 - (v + v_c)/(s + v_c))/l

This is solved exactly for a constant velocity. A limit that rises leaves stuck springs as they
are; one that falls lets the springs above it slip until they meet it. Turning points know one
coefficient only: a contact that ages stays on its springs.

"""

import math
from typing import NamedTuple

from stickslip_ros.kernels.kernel import kernel
from stickslip_ros.kernels.record import FLAG, FLOAT, Record, kind

SMALL = 1e-5
"""(1 - e^-x)/x is 1 - x/2 below, to rounding."""

AGEING = kind(
    on=FLAG,  # Whether the coefficient changes at all
    # a/mu0 and b/mu0: growth of the coefficient per e-fold of velocity and of age, per mu0
    rate_share=FLOAT,
    age_share=FLOAT,
    distance_m=FLOAT,  # D_c, slip that renews a spring
    velocity_m_per_s=FLOAT,  # v0, at which steady sliding has mu0
    cutoff_m_per_s=FLOAT,  # v_c, below which velocities are not told apart
    rest_s=FLOAT,  # Age at the start
)
"""How the friction coefficient changes."""


class Slip(NamedTuple):
    """Force at the end, how long and how far a spring slipped, and what it lost."""

    force_n: float
    lasts_s: float
    way_m: float
    lost_j: float


@kernel
def ratio_at_rest(ageing: Record, age_s: float) -> float:
    """Return mu/mu0 of a spring of an age that sticks."""
    v0, v_c = ageing.velocity_m_per_s, ageing.cutoff_m_per_s
    ratio = 1.0 + ageing.rate_share * math.log(v_c / (v0 + v_c))
    return max(ratio + ageing.age_share * math.log(v0 * age_s / ageing.distance_m), 0.0)


@kernel
def older(ageing: Record, age_s: float, slip_m: float, time_s: float) -> float:
    """Return the age after a time of steady slip; of its share of D_c to the third power."""
    share = slip_m / ageing.distance_m
    mean = 1.0 + share * (0.5 + share / 6.0)
    return (age_s + time_s * mean) / (1.0 + share * mean)


@kernel
def slide(
    ageing: Record,
    age_s: float,
    force_n: float,
    limit_n: float,
    n_per_m: float,
    way_m: float,
    time_s: float,
) -> tuple[float, float, float]:
    """
    Move the runner against a spring: it slips on until it sticks, and slips anew.

    Parameters
    ----------
    ageing : record of AGEING
        Constants.
    age_s : float
        Its age.
    force_n : float
        Its force.
    limit_n : float
        mu0 times its normal force.
    n_per_m : float
        Its stiffness, above 0.
    way_m : float
        Way of the runner, at a constant velocity.
    time_s : float
        Time for it, above 0.

    Returns
    -------
    tuple of float
        Its force, N, its age, s, and its friction loss, J.

    """
    v, left_s, slid_m, lost_j = way_m / time_s, time_s, 0.0, 0.0
    sticks_n = limit_n * ratio_at_rest(ageing, age_s + time_s)
    if abs(force_n) > sticks_n:
        sense = 1.0 if force_n > 0.0 else -1.0
        age_then_s = older(ageing, age_s, max(sense * way_m, 0.0), time_s)
        sticks_n = limit_n * ratio_at_rest(ageing, age_then_s)
        on = slip(ageing, limit_n, n_per_m, sticks_n, sense * force_n, sense * v, time_s)
        force_n, slid_m, lost_j = sense * on.force_n, on.way_m, on.lost_j
        left_s = time_s - on.lasts_s
    if left_s > 0.0:
        force_n += n_per_m * v * left_s
        above_m = (abs(force_n) - sticks_n) / n_per_m
        if above_m > 0.0:
            speed = abs(v)
            anew = slip(ageing, limit_n, n_per_m, sticks_n, sticks_n, speed, above_m / speed)
            force_n = anew.force_n if v > 0.0 else -anew.force_n
            slid_m += anew.way_m
            lost_j += anew.lost_j
    return force_n, older(ageing, age_s, slid_m, time_s), lost_j


@kernel
def slip(
    ageing: Record,
    limit_n: float,
    n_per_m: float,
    sticks_n: float,
    force_n: float,
    v: float,
    time_s: float,
) -> Slip:
    """Let a spring slip, the way its force pulls it, for a time or until the runner stops it."""
    v_c, rate_n = ageing.cutoff_m_per_s, ageing.rate_share * limit_n
    end_n, lasts_s, mean_n = sticks_n, time_s if v > 0.0 else 0.0, 0.5 * (force_n + sticks_n)
    if rate_n > 0.0:
        lag_m = rate_n / n_per_m
        slowness = math.exp((sticks_n - force_n) / rate_n)  # v_c/(s + v_c)
        share = (v + v_c) * time_s / lag_m
        kept = math.exp(-share)
        renewed = (1.0 - kept) / share if abs(share) > SMALL else 1.0 - 0.5 * share
        later, lasts_s = slowness * kept + renewed * v_c * time_s / lag_m, time_s
        if later > 1.0 and v < 0.0:
            per_speed = (slowness - 1.0) / v
            grown = (v + v_c) * per_speed
            part = math.log1p(grown) / grown if abs(grown) > SMALL else 1.0 - 0.5 * grown
            later, lasts_s = 1.0, min(lag_m * per_speed * part, time_s)
        later = min(later, 1.0)
        end_n = sticks_n - rate_n * math.log(later)
        # Force and speed go straight: as much slips at each force as the speed there says.
        mean_n = force_n * (2.0 * later + slowness) + end_n * (later + 2.0 * slowness)
        mean_n /= 3.0 * (later + slowness)
    slid_m = v * lasts_s + (force_n - end_n) / n_per_m
    return Slip(end_n, lasts_s, slid_m, mean_n * slid_m)
