# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Kernels: the stages of a sensor's signal.

Low-pass filters are solved exactly from sample to sample. Hysteresis consists of play operators
(Prandtl-Ishlinskii). The last stages are faults, zero and quantisation.

"""

import math
from collections.abc import Mapping

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.drive.piezo import move_plays
from stickslip_ros.kernels.kernel import kernel
from stickslip_ros.kernels.record import COUNT, FLOAT, FieldType, Record, RecordKind, kind, record

WORKS, FROZEN, DROPPED_OUT = range(3)
CONDITIONS = {'none': WORKS, 'freeze': FROZEN, 'dropout': DROPPED_OUT}
"""Conditions of a sensor, by the choices of ``fault.<sensor>``."""

_FINEST = 2.0**52
"""Number of quantisation steps above which a floating-point reading has no finer digits."""
PLAYS = 16
"""Play operators of a loop; the weights below are exact for an even number. No parameter chooses
it."""

LOOP = kind(
    direct=FLOAT,  # Share of the input that passes without a loop
    weight=FLOAT,  # Share of the input that passes each play; 0: no loop
    spacing=FLOAT,  # Difference of the half-widths of neighbouring plays, in the input's unit
)
SENSOR_FAULT = kind(
    condition=COUNT,  # WORKS, FROZEN or DROPPED_OUT
    offset=FLOAT,  # Offset of the reading, in its unit
)
"""Fault of a sensor."""


def sensor_kind(memory: Mapping[str, FieldType], **constants: FieldType) -> RecordKind:
    """Return the record type of a sensor: the common fields and its own memory and constants."""
    return kind(
        noise=FLOAT,  # Standard deviation of the white noise of a sample
        gain=FLOAT,  # Share of the way that the low-pass goes to its input in a sample
        resolution=FLOAT,  # Quantisation step; 0: none
        fault=SENSOR_FAULT,
        memory=kind(
            samples=COUNT,  # Samples read so far
            level=FLOAT,  # Output of the low-pass
            standing=FLOAT,  # Value before zero and quantisation; a frozen sensor keeps it
            zero=FLOAT,  # Value that reads 0
            **memory,
        ),
        **constants,
    )


def low_pass_gain(bandwidth_hz: float, sample_rate_hz: float) -> float:
    """
    Return the share of the way that a first-order low-pass goes to its input in a sample.

    y' = 2 pi f_c (x - y), exact for a constant input between two samples; 1 without a bandwidth.

    """
    decay = math.exp(-2.0 * math.pi * bandwidth_hz / sample_rate_hz)
    return 1.0 - decay if bandwidth_hz > 0.0 else 1.0


def loop_of(opening: float, full_scale: float) -> Record:
    """
    Return the loop from -full_scale to full_scale with a gain of 1.

    Parameters
    ----------
    opening : float
        Distance of its branches in the middle, as a share of ``full_scale``; 0: no loop.
    full_scale : float
        Largest input, in its unit.

    Notes
    -----
    Play j of N has the half-width r_j = (j - 1/2) full_scale/N and the weight w. At the ends of
    the loop the plays give sum (full_scale - r_j) w = N w full_scale/2. In the middle the branches
    are 2 w sum min(r_j, full_scale - r_j) = N w full_scale/2 apart. So w is 2 opening/N, and the
    share 1 - opening passes directly, which is the gain after a reversal.

    """
    return record(
        LOOP, direct=1.0 - opening, weight=2.0 * opening / PLAYS, spacing=full_scale / PLAYS
    )


@kernel
def follow_loop(loop: Record, plays: Array, value: float) -> float:
    """Return the output of a loop for its next input; ``plays`` is changed in place."""
    total = move_plays(plays, len(plays), 0.5, loop.spacing, value)
    return float(loop.direct * value + loop.weight * total)


@kernel
def filter_value(sensor: Record, value: float, noise: float) -> float:
    """Return the output of the low-pass for a value with unit white noise."""
    memory = sensor.memory
    memory.level += sensor.gain * (value + sensor.noise * noise - memory.level)
    return float(memory.level)


@kernel
def display_value(sensor: Record, value: float) -> float:
    """
    Return the reading: the value minus the zero, quantised; NaN after a dropout.

    A frozen sensor keeps its last value.

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
