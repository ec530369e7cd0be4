"""Kernels: low-pass filters of a sensor, solved exactly from sample to sample."""

import math

from stickslip_ros.contact.kernel import kernel
from stickslip_ros.contact.record import FLOAT, Record, kind, record

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
