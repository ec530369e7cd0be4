"""
Kernel: the piezo, from its voltage to the displacement of the mean foot, step by step.

Hysteresis: plays in parallel with a linear part (Prandtl-Ishlinskii), so it does not depend on the
rate. Creep: first-order elements, one for each decade of time. Resonance: a damped oscillator
that is driven by what the two make of the voltage. All of it is exact for a voltage which is
straight within a step, but for what creep (1e-5 of itself) sees of the way within one step.

"""

import math
from typing import NamedTuple

from stickslip_ros.contact.kernel import kernel
from stickslip_ros.contact.profile import Array
from stickslip_ros.drive.plays import drag_plays
from stickslip_ros.drive.records import Plant

SCALARS, PLAYS, CREPT, SHARES = range(4)
"""Rows of ``DriveHistory.piezo``: single numbers; outputs of the plays (V); displacements that the
elements of creep have taken in (m); share of its way that each goes in the present step."""
SLEWED_V, PLAYS_AT_REST_V, STATIC_M, DRIVING_M, RING_M, RING_M_PER_S = range(6)
"""Columns of the row SCALARS: amplifier before its low-pass; sum of the plays at the start;
displacement after hysteresis; after creep; after the resonance, and its velocity."""
COLUMNS = 64
"""Columns of ``DriveHistory.piezo``: no more plays than that."""
DECADES = 6
"""Elements of creep."""
CREEP_FASTEST_S = 1e-2
"""Time constant of the fastest element of creep; each of the others is ten times slower."""
SMALL_ANGLE = 1e-4
"""Below this sine and cosine are two terms of their series."""


class Ring(NamedTuple):
    """
    What a free oscillator makes of displacement and velocity in one step.

    Attributes
    ----------
    m_per_m, m_per_m_per_s : float
        Displacement after a displacement of 1, and after a velocity of 1.
    m_per_s_per_m, m_per_s_per_m_per_s : float
        The same for the velocity.

    """

    m_per_m: float
    m_per_m_per_s: float
    m_per_s_per_m: float
    m_per_s_per_m_per_s: float


@kernel
def free_ring(piezo_omega_per_s: float, damping_ratio: float, h_s: float) -> Ring:
    """
    Return the free motion of x'' + 2 D w x' + w^2 x = 0 after a time, in closed form.

    Parameters
    ----------
    piezo_omega_per_s : float
        w, 1/s; 0 returns what nobody uses.
    damping_ratio : float
        D, of any size.
    h_s : float
        Time, s; of any length.

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
def prepare_step(plant: Plant, memory: Array, h_s: float) -> Ring:
    """Compute what all steps of one length share: the ring, and the shares of creep."""
    if plant.piezo.creep > 0.0:
        tau_s = CREEP_FASTEST_S
        for k in range(DECADES):
            memory[SHARES, k] = -math.expm1(-h_s / tau_s)
            tau_s *= 10.0
    return free_ring(plant.piezo.omega_per_s, plant.piezo.damping_ratio, h_s)


@kernel
def displace(plant: Plant, memory: Array, voltage_v: float, ring: Ring, h_s: float) -> float:
    """
    Return the displacement of the mean foot after a step, m.

    Parameters
    ----------
    plant : Plant
        The drive.
    memory : array, shape (4, COLUMNS)
        Changed in place.
    voltage_v : float
        Output of the amplifier at the end of the step.
    ring : Ring
        Of ``prepare_step``.
    h_s : float
        Time of the step, s.

    """
    static_m = hysteresis(plant, memory, voltage_v)
    driving_m = static_m
    if plant.piezo.creep > 0.0:
        driving_m += creep(plant, memory, static_m)
    memory[SCALARS, STATIC_M] = static_m
    foot_m = driving_m
    if plant.piezo.omega_per_s > 0.0:
        foot_m = _swing(plant, memory, driving_m, ring, h_s)
    memory[SCALARS, DRIVING_M] = driving_m
    return foot_m


@kernel
def hysteresis(plant: Plant, memory: Array, voltage_v: float) -> float:
    """Return the displacement that belongs to a voltage, by the plays' memory, m."""
    piezo = plant.piezo
    if piezo.plays == 0:
        return plant.gain_m_per_v * (voltage_v - plant.rest_v)
    total_v = drag_plays(memory[PLAYS], piezo.plays, 1.0, piezo.play_v, voltage_v)
    total_v -= memory[SCALARS, PLAYS_AT_REST_V]
    linear_v = piezo.linear * (voltage_v - plant.rest_v)
    return float(plant.gain_m_per_v * (linear_v + piezo.weight * total_v))


@kernel
def creep(plant: Plant, memory: Array, static_m: float) -> float:
    """Return the displacement by creep after a step of the prepared length, m."""
    mean_m = 0.5 * (memory[SCALARS, STATIC_M] + static_m)
    total_m = 0.0
    for k in range(DECADES):
        memory[CREPT, k] += memory[SHARES, k] * (mean_m - memory[CREPT, k])
        total_m += memory[CREPT, k]
    return float(plant.piezo.creep * total_m)


@kernel
def _swing(plant: Plant, memory: Array, driving_m: float, ring: Ring, h_s: float) -> float:
    """Return the displacement of the oscillator after a step in which its drive was straight."""
    start_m = memory[SCALARS, DRIVING_M]
    rate_m_per_s = (driving_m - start_m) / h_s
    lag_m = 2.0 * plant.piezo.damping_ratio * rate_m_per_s / plant.piezo.omega_per_s
    off_m = memory[SCALARS, RING_M] - start_m + lag_m
    off_m_per_s = memory[SCALARS, RING_M_PER_S] - rate_m_per_s
    after_m = ring.m_per_m * off_m + ring.m_per_m_per_s * off_m_per_s
    after_m_per_s = ring.m_per_s_per_m * off_m + ring.m_per_s_per_m_per_s * off_m_per_s
    memory[SCALARS, RING_M] = driving_m - lag_m + after_m
    memory[SCALARS, RING_M_PER_S] = rate_m_per_s + after_m_per_s
    return float(driving_m - lag_m + after_m)


@kernel
def fastest_m_per_s(plant: Plant, memory: Array, rate_v_per_s: float) -> float:
    """Return a bound of the speed of the mean foot while the voltage has a rate, m/s."""
    piezo = plant.piezo
    slope = plant.gain_m_per_v * (piezo.linear + piezo.plays * piezo.weight)
    speed_m_per_s = slope * abs(rate_v_per_s)
    if piezo.omega_per_s > 0.0:
        off_m = memory[SCALARS, RING_M] - memory[SCALARS, DRIVING_M]
        rung_m = abs(off_m) + abs(memory[SCALARS, RING_M_PER_S]) / piezo.omega_per_s
        speed_m_per_s = 2.0 * speed_m_per_s + piezo.omega_per_s * rung_m
    return float(speed_m_per_s)


def rest(plant: Plant, memory: Array) -> None:
    """
    Bring a piezo to rest at the voltage of the start, without creep and ringing.

    Its plays are where a fall from the highest voltage leaves them, so that the loop over the
    whole range is closed from its first turn on.

    """
    memory[:] = 0.0
    memory[SCALARS, SLEWED_V] = plant.rest_v
    for j in range(plant.piezo.plays):
        half_v = (j + 1) * plant.piezo.play_v
        memory[PLAYS, j] = min(plant.rest_v + half_v, plant.voltage_max_v - half_v)
        memory[SCALARS, PLAYS_AT_REST_V] += memory[PLAYS, j]
