# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Kernel: the piezo, from voltage to displacement of the mean foot.

Hysteresis: plays in parallel with a linear part (Prandtl-Ishlinskii), independent of the rate.
Creep: first-order elements, one for each decade of time. Resonance: a damped oscillator driven by
their output. The result is exact for a voltage that is linear in a step; only creep has a
relative error, 1e-5.

"""

import math
from typing import NamedTuple

from stickslip_ros.arrays import Array
from stickslip_ros.drive.records import DECADES
from stickslip_ros.kernels.kernel import kernel
from stickslip_ros.kernels.record import Record

CREEP_FASTEST_S = 1e-2
"""Time constant of the fastest element of creep; each next one is ten times slower."""
SMALL_ANGLE = 1e-4
"""Angle below which two terms of the series of sine and cosine are used."""


@kernel
def foot_displacement(plant: Record, voltage_v: float) -> float:
    """Return the displacement x_s of linear feet, m."""
    return plant.gain_m_per_v * (voltage_v - plant.rest_v)


class Ring(NamedTuple):
    """Free motion of an oscillator in a step, for unit displacement and unit velocity."""

    m_per_m: float  # Displacement after a displacement of 1
    m_per_m_per_s: float  # Displacement after a velocity of 1
    m_per_s_per_m: float  # Velocity after a displacement of 1
    m_per_s_per_m_per_s: float  # Velocity after a velocity of 1


@kernel
def free_ring(piezo_omega_per_s: float, damping_ratio: float, h_s: float) -> Ring:
    """
    Return the free motion of x'' + 2 D w x' + w^2 x = 0 after a time, in closed form.

    D is any damping ratio; the result for w = 0 is not used.

    """
    sigma = damping_ratio * piezo_omega_per_s
    omega_squared = piezo_omega_per_s * piezo_omega_per_s
    beta_squared = omega_squared - sigma * sigma
    beta = math.sqrt(abs(beta_squared))
    if beta * h_s < SMALL_ANGLE:
        decay, square = math.exp(-sigma * h_s), beta_squared * h_s * h_s
        even, odd = decay * (1.0 - square / 2.0), decay * h_s * (1.0 - square / 6.0)
    elif beta_squared > 0.0:
        decay = math.exp(-sigma * h_s)
        even, odd = decay * math.cos(beta * h_s), decay * math.sin(beta * h_s) / beta
    else:
        slow, fast = math.exp((beta - sigma) * h_s), math.exp(-(beta + sigma) * h_s)
        even, odd = 0.5 * (slow + fast), 0.5 * (slow - fast) / beta
    return Ring(even + sigma * odd, odd, -omega_squared * odd, even - sigma * odd)


@kernel
def prepare_piezo(plant: Record, memory: Record, h_s: float) -> Ring:
    """Compute the free motion and the shares of creep for steps of a length."""
    if plant.piezo.creep > 0.0:
        tau_s = CREEP_FASTEST_S
        for k in range(DECADES):
            memory.creep_shares[k] = -math.expm1(-h_s / tau_s)
            tau_s *= 10.0
    return free_ring(plant.piezo.omega_per_s, plant.piezo.damping_ratio, h_s)


@kernel
def displace(
    plant: Record, memory: Record, voltage_v: float, bow_v: float, ring: Ring, h_s: float
) -> float:
    """
    Return the displacement of the mean foot after a step to a voltage, m.

    The mean of the voltage is ``bow_v`` above the mean of its ends, which drives a resonance too.

    """
    static_m = hysteresis(plant, memory, voltage_v)
    driving_m = static_m
    if plant.piezo.creep > 0.0:
        driving_m += creep(plant, memory, static_m)
    memory.static_m = static_m
    foot_m = driving_m
    if plant.piezo.omega_per_s > 0.0 and plant.piezo.stack_n_per_m == 0.0:
        bow_m = plant.gain_m_per_v * bow_v
        memory.ring_m, memory.ring_m_per_s = swing_along(
            plant.piezo,
            memory.ring_m,
            memory.ring_m_per_s,
            memory.driving_m + bow_m,
            driving_m + bow_m,
            ring,
            h_s,
        )
        foot_m = memory.ring_m
    memory.driving_m = driving_m
    return foot_m


@kernel
def hysteresis(plant: Record, memory: Record, voltage_v: float) -> float:
    """Move the plays to a voltage; return the displacement, m."""
    piezo = plant.piezo
    if piezo.plays == 0:
        return foot_displacement(plant, voltage_v)
    total_v = move_plays(memory.plays_v, piezo.plays, 1.0, piezo.play_v, voltage_v)
    total_v -= memory.plays_at_rest_v
    linear_v = piezo.linear * (voltage_v - plant.rest_v)
    return plant.gain_m_per_v * (linear_v + piezo.weight * total_v)


@kernel
def move_plays(plays: Array, count: int, first: float, spacing: float, value: float) -> float:
    """
    Move play operators to a value; return the sum of their outputs.

    Play j = 0, 1, ... has the half-width (j + first) spacing. The first ``count`` outputs in
    ``plays`` are changed in place.

    """
    total = 0.0
    for j in range(count):
        half_width = (j + first) * spacing
        plays[j] = min(max(plays[j], value - half_width), value + half_width)
        total += plays[j]
    return total


@kernel
def creep(plant: Record, memory: Record, static_m: float) -> float:
    """Return the displacement by creep after a step of the length of ``prepare_piezo``, m."""
    mean_m = 0.5 * (memory.static_m + static_m)
    total_m = 0.0
    for k in range(DECADES):
        memory.crept_m[k] += memory.creep_shares[k] * (mean_m - memory.crept_m[k])
        total_m += memory.crept_m[k]
    return plant.piezo.creep * total_m


@kernel
def swing_along(
    piezo: Record,
    place_m: float,
    speed: float,
    start_m: float,
    driving_m: float,
    ring: Ring,
    h_s: float,
) -> tuple[float, float]:
    """Return position and speed of the oscillator after a step with a linear drive."""
    rate_m_per_s = (driving_m - start_m) / h_s
    lag_m = 2.0 * piezo.damping_ratio * rate_m_per_s / piezo.omega_per_s
    off_m = place_m - start_m + lag_m
    off_m_per_s = speed - rate_m_per_s
    after_m = ring.m_per_m * off_m + ring.m_per_m_per_s * off_m_per_s
    after_m_per_s = ring.m_per_s_per_m * off_m + ring.m_per_s_per_m_per_s * off_m_per_s
    return driving_m - lag_m + after_m, rate_m_per_s + after_m_per_s


@kernel
def fastest_m_per_s(plant: Record, memory: Record, rate_v_per_s: float) -> float:
    """Return an upper bound of the speed of the mean foot at a voltage rate, m/s."""
    piezo = plant.piezo
    slope = plant.gain_m_per_v * (piezo.linear + piezo.plays * piezo.weight)
    speed_m_per_s = slope * rate_v_per_s
    if piezo.omega_per_s == 0.0:
        return abs(speed_m_per_s)
    ringing_m_per_s = abs(memory.ring_m_per_s - speed_m_per_s)
    ringing_m_per_s += piezo.omega_per_s * abs(memory.ring_m - memory.driving_m)
    return abs(speed_m_per_s) + ringing_m_per_s


def rest_piezo(plant: Record, memory: Record) -> None:
    """
    Set a piezo at rest at the voltage of the start, without creep and ringing.

    The plays are as after a fall from the highest voltage, so the loop over the whole range is
    closed from the first reversal on.

    """
    memory.slewed_v = plant.rest_v
    for j in range(plant.piezo.plays):
        half_v = (j + 1) * plant.piezo.play_v
        memory.plays_v[j] = min(plant.rest_v + half_v, plant.voltage_max_v - half_v)
        memory.plays_at_rest_v += memory.plays_v[j]
