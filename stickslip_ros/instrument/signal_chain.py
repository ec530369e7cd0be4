"""
Kernels: the stages that the signal of a sensor goes through.

Low-pass filters are solved exactly from sample to sample. Hysteresis is made of play operators
(Prandtl-Ishlinskii). Last of all a sensor breaks down, subtracts its zero, and quantises.

"""

import math

import numpy as np

from stickslip_ros.contact.kernel import kernel
from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.record import COUNT, FLOAT, Record, kind, record
from stickslip_ros.drive.piezo import move_plays

WORKS, FROZEN, DROPPED_OUT = range(3)
CONDITIONS = {'none': WORKS, 'freeze': FROZEN, 'dropout': DROPPED_OUT}
"""Conditions of a sensor, after the words of ``fault.interferometer`` and ``fault.load_cell``."""

FINEST = 2.0**52
"""From this number of quantisation steps on, the reading itself has no finer digits."""
PLAYS = 16
"""Play operators of a loop; an even number, for which the weights below are exact."""

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

FAULT = kind(condition=COUNT, offset=FLOAT)
"""
What is broken about a sensor.

Fields
------
condition : int
    WORKS, FROZEN or DROPPED_OUT.
offset : float
    Jump of the reading, in its unit.

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
def standing(fault: Record, before: float, value: float) -> float:
    """Return the value that stands behind the display: a frozen sensor keeps the one before."""
    return before if fault.condition == FROZEN else value


@kernel
def displayed(fault: Record, value: float, zero: float, resolution: float) -> float:
    """Return the reading: ``value`` above ``zero`` in whole steps, or not a number."""
    if fault.condition == DROPPED_OUT:
        return np.nan
    above = value - zero
    if abs(above) < FINEST * resolution:
        return float(np.rint(above / resolution) * resolution)
    return above
