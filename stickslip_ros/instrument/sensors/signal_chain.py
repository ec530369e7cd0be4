"""
Kernels: the stages that the signal of a sensor goes through.

Low-pass filters are solved exactly from sample to sample. Hysteresis is made of play operators
(Prandtl-Ishlinskii). Last of all a sensor breaks down, subtracts its zero, and quantises.

"""

import math

import numpy as np

from stickslip_ros.contact.kernel import kernel
from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.record import COUNT, FLOAT, Kind, Record, kind, record
from stickslip_ros.drive.piezo import move_plays

WORKS, FROZEN, DROPPED_OUT = range(3)
CONDITIONS = {'none': WORKS, 'freeze': FROZEN, 'dropout': DROPPED_OUT}
"""Conditions of a sensor, after the words of ``fault.<sensor>``."""

FINEST = 2.0**52
"""From this number of quantisation steps on, the reading itself has no finer digits."""
PLAYS = 16
"""Play operators of a loop; an even number, for which the weights below are exact."""

SWING = kind(stay=FLOAT, gather=FLOAT, fall=FLOAT, keep=FLOAT)
"""
What a second-order low-pass keeps of its distance from the input after one sample.

Fields
------
stay, gather : float
    Share of the distance that is left, and what a velocity adds to it.
fall, keep : float
    Velocity that a distance gives, and share of the velocity that is left. Velocities are divided
    by the undamped angular frequency, so that they have the unit of the reading.

"""

LOOP = kind(direct=FLOAT, weight=FLOAT, spacing=FLOAT)
"""
Constants of a loop.

Fields
------
direct : float
    Share of the input that passes without a loop.
weight : float
    Share of the input that passes each play; 0 is no loop.
spacing : float
    Distance between the half-widths of neighbouring plays, in the unit of the input.

"""

FAULT = kind(
    condition=COUNT,  # WORKS, FROZEN or DROPPED_OUT
    offset=FLOAT,  # Jump of the reading, in its unit
)
"""What is broken about a sensor."""


def sensor_kind(constants: Kind, own: Kind) -> Kind:
    """Return the type of the records of a kind of sensor."""
    memory = kind(
        samples=COUNT,  # Samples of the trace that it has read
        standing=FLOAT,  # Value behind the display, before the zero is subtracted
        zero=FLOAT,  # Value that is shown as 0
        own=own,
    )
    return kind(constants=constants, fault=FAULT, memory=memory)


def low_pass_gain(bandwidth_hz: float, sample_rate_hz: float) -> float:
    """
    Return the share of the way that a first-order low-pass goes to its input in one sample.

    Parameters
    ----------
    bandwidth_hz : float
        Corner frequency f_c, Hz; 0 is no low-pass, which goes all the way.
    sample_rate_hz : float
        Rate of the samples, Hz.

    Notes
    -----
    y' = 2 pi f_c (x - y), exact for an input that is constant between two samples.

    """
    decay = math.exp(-2.0 * math.pi * bandwidth_hz / sample_rate_hz)
    return 1.0 - decay if bandwidth_hz > 0.0 else 1.0


def swing_of(resonance_hz: float, damping_ratio: float, sample_rate_hz: float) -> Record:
    """
    Return one sample of a second-order low-pass.

    Parameters
    ----------
    resonance_hz : float
        Undamped frequency f_0, Hz; above 0.
    damping_ratio : float
        Damping ratio zeta; above 1 nothing swings.
    sample_rate_hz : float
        Rate of the samples, Hz.

    Notes
    -----
    y'' + 2 zeta w y' + w^2 (y - x) = 0 with w = 2 pi f_0, exact for an input that is constant
    between two samples.

    """
    angle = 2.0 * math.pi * resonance_hz / sample_rate_hz
    even, odd = _even_and_odd(damping_ratio, angle)
    return record(
        SWING,
        stay=even + damping_ratio * odd,
        gather=odd,
        fall=-odd,
        keep=even - damping_ratio * odd,
    )


def _even_and_odd(zeta: float, angle: float) -> tuple[float, float]:
    """Return exp(-zeta a) cos(q a) and exp(-zeta a) sin(q a)/q with q^2 = 1 - zeta^2."""
    root = math.sqrt(abs((1.0 - zeta) * (1.0 + zeta)))
    turn = root * angle
    if zeta < 1.0:
        decay = math.exp(-zeta * angle)
        return decay * math.cos(turn), decay * math.sin(turn) / root
    # The slow one of the two exponentials, written without a difference of near numbers.
    slow = math.exp(-angle / (zeta + root))
    odd = -math.expm1(-2.0 * turn) / (2.0 * root) if root > 0.0 else angle
    return slow * (1.0 + math.exp(-2.0 * turn)) / 2.0, slow * odd


@kernel
def swing(setup: Record, level: float, speed: float, target: float) -> tuple[float, float]:
    """Return level and speed of a second-order low-pass after one sample at an input."""
    distance = level - target
    return (
        target + setup.stay * distance + setup.gather * speed,
        setup.fall * distance + setup.keep * speed,
    )


def loop_of(opening: float, full_scale: float) -> Record:
    """
    Return the loop that goes from -full_scale to full_scale with a gain of 1.

    Parameters
    ----------
    opening : float
        Distance of its branches in the middle, as a share of ``full_scale``; 0 is no loop.
    full_scale : float
        Largest input, in its unit.

    Notes
    -----
    Play j of N has the half-width r_j = (j - 1/2) full_scale/N. All weights are w. At the ends
    of the loop the plays give sum (full_scale - r_j) w = N w full_scale/2, in the middle its
    branches are 2 w sum min(r_j, full_scale - r_j) = N w full_scale/2 apart. So w is
    2 opening/N, and 1 - opening passes directly: this is the gain right after a reversal.

    """
    return record(
        LOOP, direct=1.0 - opening, weight=2.0 * opening / PLAYS, spacing=full_scale / PLAYS
    )


@kernel
def follow(loop: Record, plays: Array, value: float) -> float:
    """Return what the loop makes of its next input; ``plays`` is changed in place."""
    total = move_plays(plays, len(plays), 0.5, loop.spacing, value)
    return float(loop.direct * value + loop.weight * total)


@kernel
def displayed(fault: Record, memory: Record, value: float, resolution: float) -> float:
    """
    Return the reading: the value above the zero in whole steps, or not a number.

    A frozen sensor keeps the value that stands behind the display.

    """
    if fault.condition != FROZEN:
        memory.standing = value
    if fault.condition == DROPPED_OUT:
        return np.nan
    above = memory.standing - memory.zero
    if abs(above) < FINEST * resolution:
        return float(np.rint(above / resolution) * resolution)
    return float(above)
