# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Kernel: friction that depends on the age and the slip speed of each spring.

The rate-and-state law of Dieterich (1979) and Ruina (1983), cut off at low speeds. Each spring has
its own slip speed s and age theta:

    mu = mu0 + a ln((s + v_c)/(v0 + v_c)) + b ln(v0 theta/D_c),  theta' = 1 - s theta/D_c

A spring of stiffness k under a normal force f_z sticks up to mu f_z at s = 0. Under a larger force
it slips, at a speed that follows from the force. Against a runner of velocity v its slowness
1/(s + v_c) changes like an age, within some nanometres l = a f_z/k:

    d/dt 1/(s + v_c) = (1 - (v + v_c)/(s + v_c))/l

This is solved exactly for a constant velocity. If the friction limit rises, stuck springs stay as
they are; if it falls, the springs above it slip until they meet it. Turning points need a constant
coefficient, so a contact that ages stays on its springs.

"""

import math
from typing import NamedTuple

from stickslip_ros.kernels.kernel import kernel
from stickslip_ros.kernels.record import FLAG, FLOAT, Record, kind

SMALL = 1e-5
"""Below this x, (1 - e^-x)/x is 1 - x/2 to rounding."""

AGEING = kind(
    on=FLAG,  # Whether the coefficient changes
    # a/mu0 and b/mu0: relative growth of the coefficient per e-fold of velocity and of age
    rate_share=FLOAT,
    age_share=FLOAT,
    distance_m=FLOAT,  # D_c, slip that renews a spring
    velocity_m_per_s=FLOAT,  # v0, at which steady sliding has mu0
    cutoff_m_per_s=FLOAT,  # v_c, below which velocity has no effect
    rest_s=FLOAT,  # Age at the start
)
"""Constants of a friction coefficient that changes."""


class Slip(NamedTuple):
    """Force at the end of a slip, its duration, way and friction loss."""

    force_n: float
    lasts_s: float
    way_m: float
    lost_j: float


@kernel
def ratio_at_rest(ageing: Record, age_s: float) -> float:
    """Return mu/mu0 of a stuck spring of an age."""
    v0, v_c = ageing.velocity_m_per_s, ageing.cutoff_m_per_s
    ratio = 1.0 + ageing.rate_share * math.log(v_c / (v0 + v_c))
    return max(ratio + ageing.age_share * math.log(v0 * age_s / ageing.distance_m), 0.0)


@kernel
def age_after(ageing: Record, age_s: float, slip_m: float, time_s: float) -> float:
    """Return the age after a steady slip, s; third order in slip/D_c."""
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
    Move the runner against a spring, which may slip, stick, and slip again.

    The limit is mu0 times the normal force of the spring; stiffness and time are above 0, and the
    velocity is constant. Returns force, N, age, s, and friction loss, J, of the spring.

    """
    v, left_s, slid_m, lost_j = way_m / time_s, time_s, 0.0, 0.0
    sticks_n = limit_n * ratio_at_rest(ageing, age_s + time_s)
    if abs(force_n) > sticks_n:
        sense = 1.0 if force_n > 0.0 else -1.0
        end_age_s = age_after(ageing, age_s, max(sense * way_m, 0.0), time_s)
        sticks_n = limit_n * ratio_at_rest(ageing, end_age_s)
        first = slip(ageing, limit_n, n_per_m, sticks_n, sense * force_n, sense * v, time_s)
        force_n, slid_m, lost_j = sense * first.force_n, first.way_m, first.lost_j
        left_s = time_s - first.lasts_s
    if left_s > 0.0:
        force_n += n_per_m * v * left_s
        above_m = (abs(force_n) - sticks_n) / n_per_m
        if above_m > 0.0:
            speed = abs(v)
            second = slip(ageing, limit_n, n_per_m, sticks_n, sticks_n, speed, above_m / speed)
            force_n = second.force_n if v > 0.0 else -second.force_n
            slid_m += second.way_m
            lost_j += second.lost_j
    return force_n, age_after(ageing, age_s, slid_m, time_s), lost_j


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
    """Let a spring slip in the direction of its force, for a time or until it sticks."""
    v_c, rate_n = ageing.cutoff_m_per_s, ageing.rate_share * limit_n
    end_n, lasts_s, mean_n = sticks_n, time_s if v > 0.0 else 0.0, 0.5 * (force_n + sticks_n)
    if rate_n > 0.0:
        lag_m = rate_n / n_per_m
        slowness = math.exp((sticks_n - force_n) / rate_n)  # v_c/(s + v_c)
        share = (v + v_c) * time_s / lag_m
        kept = math.exp(-share)
        renewed = (1.0 - kept) / share if abs(share) > SMALL else 1.0 - 0.5 * share
        end_slowness, lasts_s = slowness * kept + renewed * v_c * time_s / lag_m, time_s
        if end_slowness > 1.0 and v < 0.0:
            per_speed = (slowness - 1.0) / v
            grown = (v + v_c) * per_speed
            part = math.log1p(grown) / grown if abs(grown) > SMALL else 1.0 - 0.5 * grown
            end_slowness, lasts_s = 1.0, min(lag_m * per_speed * part, time_s)
        end_slowness = min(end_slowness, 1.0)
        end_n = sticks_n - rate_n * math.log(end_slowness)
        # Mean force, weighted with the speed; force and speed change linearly.
        mean_n = force_n * (2.0 * end_slowness + slowness)
        mean_n += end_n * (end_slowness + 2.0 * slowness)
        mean_n /= 3.0 * (end_slowness + slowness)
    slid_m = v * lasts_s + (force_n - end_n) / n_per_m
    return Slip(end_n, lasts_s, slid_m, mean_n * slid_m)
