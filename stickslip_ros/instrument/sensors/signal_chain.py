# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Kernels: the stages that the signal of a sensor goes through.

Low-pass filters are solved exactly from sample to sample. Hysteresis is made of play operators
(Prandtl-Ishlinskii). Last of all a sensor breaks down, subtracts its zero, and quantises.

"""

import math
from collections.abc import Mapping

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.drive.piezo import move_plays
from stickslip_ros.kernels.kernel import kernel
from stickslip_ros.kernels.record import COUNT, FLOAT, Field, Kind, Record, kind, record

WORKS, FROZEN, DROPPED_OUT = range(3)
CONDITIONS = {'none': WORKS, 'freeze': FROZEN, 'dropout': DROPPED_OUT}
"""Conditions of a sensor, after the words of ``fault.<sensor>``."""

_FINEST = 2.0**52
"""From this number of quantisation steps on, the reading itself has no finer digits."""
PLAYS = 16
"""Play operators of a loop; an even number, for which the weights below are exact."""

LOOP = kind(
    direct=FLOAT,  # Share of the input that passes without a loop
    weight=FLOAT,  # Share of the input that passes each play; 0 is no loop
    spacing=FLOAT,  # Between the half-widths of neighbouring plays, in the unit of the input
)
SENSOR_FAULT = kind(
    condition=COUNT,  # WORKS, FROZEN or DROPPED_OUT
    offset=FLOAT,  # Jump of the reading, in its unit
)
"""What is broken about a sensor."""


def sensor_kind(memory: Mapping[str, Field], **constants: Field) -> Kind:
    """Return the type of the records of a sensor: what all have, and what this one has besides."""
    return kind(
        noise=FLOAT,  # Standard deviation of the white noise of one sample
        gain=FLOAT,  # Share of the way that the low-pass goes to its input in one sample
        resolution=FLOAT,  # Quantisation step; 0 is none
        fault=SENSOR_FAULT,
        memory=kind(
            samples=COUNT,  # Samples of the trace that it has read
            level=FLOAT,  # Output of the low-pass
            standing=FLOAT,  # Value behind the display, before the zero is subtracted
            zero=FLOAT,  # Value that is shown as 0
            **memory,
        ),
        **constants,
    )


def low_pass_gain(bandwidth_hz: float, sample_rate_hz: float) -> float:
    """
    Return the share of the way that a first-order low-pass goes to its input in one sample.

    y' = 2 pi f_c (x - y), exact for an input that is constant between two samples; without a
    bandwidth it goes all the way.

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
def filtered(sensor: Record, value: float, noise: float) -> float:
    """Return what the low-pass makes of a value and white noise, of which the unit is given."""
    memory = sensor.memory
    memory.level += sensor.gain * (value + sensor.noise * noise - memory.level)
    return float(memory.level)


@kernel
def displayed(sensor: Record, value: float) -> float:
    """
    Return the reading: the value above the zero in whole steps, or not a number.

    A frozen sensor keeps the value that stands behind the display.

    """
    memory = sensor.memory
    if sensor.fault.condition != FROZEN:
        memory.standing = value
    if sensor.fault.condition == DROPPED_OUT:
        return np.nan
    above = memory.standing - memory.zero
    if abs(above) < _FINEST * sensor.resolution:
        return float(np.rint(above / sensor.resolution) * sensor.resolution)
    return float(above)
