# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Kernel: an actuator in a short step, from the voltage before its low-pass to its foot."""

from typing import NamedTuple

from stickslip_ros.drive.amplifier import low_pass
from stickslip_ros.drive.piezo import Ring, displace
from stickslip_ros.kernels.kernel import kernel
from stickslip_ros.kernels.record import Record


class Pace(NamedTuple):
    """Constants of steps of one length."""

    half_s: float  # Half the length
    slack_m: float  # Way within which a reversal counts as immediate
    settling: float  # Share of a change that passes the low-pass of the amplifier in half a step
    ring: Ring  # Free motion of the piezo in half a step


@kernel
def move_actuator(
    plant: Record,
    memory: Record,
    voltage_v: float,
    start_m: float,
    from_v: float,
    half_v: float,
    to_v: float,
    pace: Pace,
) -> tuple[float, float, float, float]:
    """
    Move amplifier and piezo in a step; return voltage, V, and displacement of the foot, m.

    Also return velocity at the start, m/s, and acceleration, m/s^2, of a foot on a parabola
    through start, middle and end.

    """
    half_s = pace.half_s
    voltage_v, middle_m = _move_half(plant, memory, voltage_v, from_v, half_v, pace)
    voltage_v, foot_m = _move_half(plant, memory, voltage_v, half_v, to_v, pace)
    speeding = ((foot_m - middle_m) - (middle_m - start_m)) / (half_s * half_s)
    speed = (foot_m - start_m) / (2.0 * half_s) - half_s * speeding
    return voltage_v, foot_m, speed, speeding


@kernel
def _move_half(
    plant: Record, memory: Record, voltage_v: float, from_v: float, to_v: float, pace: Pace
) -> tuple[float, float]:
    """Move amplifier and piezo in half a step; return voltage, V, and displacement, m."""
    after_v = low_pass(plant, voltage_v, from_v, to_v, pace.half_s, pace.settling)
    # Mean of the output less the mean of its chord; tau V' = U - V gives the mean of V.
    bow_v = 0.5 * (from_v + to_v - voltage_v - after_v)
    bow_v -= plant.amplifier.tau_s / pace.half_s * (after_v - voltage_v)
    return after_v, displace(plant, memory, after_v, bow_v, pace.ring, pace.half_s)
