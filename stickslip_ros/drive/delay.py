# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Kernel: delayed actuators, for feet that fall one after another.

The drive remembers the straight pieces of its voltage, from before the low-pass. A delayed
actuator reads them later, and has an amplifier's low-pass and a piezo of its own. A stretch of the
drive ends where a delayed actuator meets a corner, so its voltage is straight in each step too.

"""

from stickslip_ros.drive.actuator import Pace, move_actuator
from stickslip_ros.drive.amplifier import SETTLED_V, clamp
from stickslip_ros.drive.records import CORNERS
from stickslip_ros.drive.stride import way_in
from stickslip_ros.kernels.kernel import kernel, noinline_kernel
from stickslip_ros.kernels.record import Record

PIECE_OVER_S = 1e-15
"""Remaining time of a piece that counts as 0."""
PIECE_MAX_S = 1.0
"""Length from which a piece ends, so that sums of times lose no digits in a long hold."""


@kernel
def time_to_corner(plant: Record, state: Record) -> float:
    """Return the time until a delayed actuator meets a corner, s; the delay if there is none."""
    lasts_s = plant.delays_s[0]
    for j in range(plant.delayed):
        late = state.late[j]
        lasts_s = min(lasts_s, state.history.lasted_s[late.corner] - late.at_s)
    return lasts_s


@kernel
def late_voltage(plant: Record, state: Record, j: int, time_s: float) -> float:
    """Return the input of a delayed actuator's low-pass after a time, V."""
    late, history = state.late[j], state.history
    start_v, rate_v_per_s = history.start_v[late.corner], history.rate_v_per_s[late.corner]
    return clamp(plant, start_v + rate_v_per_s * (late.at_s + time_s))


@kernel
def _continues(history: Record, start_v: float, rate_v_per_s: float) -> bool:
    """Return whether a stretch lengthens the newest piece."""
    newest = history.newest
    end_v = history.start_v[newest] + history.rate_v_per_s[newest] * history.lasted_s[newest]
    is_straight = rate_v_per_s == history.rate_v_per_s[newest]
    is_straight = is_straight and abs(start_v - end_v) <= SETTLED_V
    return bool(is_straight and history.lasted_s[newest] < PIECE_MAX_S)


@noinline_kernel
def must_hold(plant: Record, state: Record, start_v: float, rate_v_per_s: float) -> bool:
    """Return whether only the piece for a held voltage is free; the hold lasts for this call."""
    history = state.history
    if not history.is_full and not _continues(history, start_v, rate_v_per_s):
        for j in range(plant.delayed):
            used = (history.newest - state.late[j].corner) % CORNERS + 1
            history.is_full |= used >= CORNERS - 1
    return bool(history.is_full)


@noinline_kernel
def end_stretch(
    plant: Record, state: Record, start_v: float, rate_v_per_s: float, stretch_s: float
) -> None:
    """Remember a stretch of the voltage, and advance the delayed actuators along the history."""
    history = state.history
    newest = history.newest
    if _continues(history, start_v, rate_v_per_s):
        history.lasted_s[newest] += stretch_s
    else:
        history.newest = newest = (newest + 1) % CORNERS
        history.start_v[newest], history.rate_v_per_s[newest] = start_v, rate_v_per_s
        history.lasted_s[newest] = stretch_s
    for j in range(plant.delayed):
        late = state.late[j]
        late.at_s += stretch_s
        is_over = history.lasted_s[late.corner] - late.at_s <= PIECE_OVER_S
        if is_over and late.corner != newest:
            late.corner, late.at_s = (late.corner + 1) % CORNERS, 0.0


@noinline_kernel
def begin_step(plant: Record, state: Record, at_s: float, pace: Pace) -> None:
    """Move the delayed actuators in a step, ``at_s`` after the start of the stretch."""
    half_s = pace.half_s
    for j in range(plant.delayed):
        late = state.late[j]
        from_v = late_voltage(plant, state, j, at_s)
        half_v = late_voltage(plant, state, j, at_s + half_s)
        to_v = late_voltage(plant, state, j, at_s + 2.0 * half_s)
        late.voltage_v, late.end_m, late.speed, late.speeding = move_actuator(
            plant, late.piezo, late.voltage_v, late.foot_m, from_v, half_v, to_v, pace
        )


@noinline_kernel
def pass_stride(plant: Record, state: Record, lasts_s: float) -> None:
    """Move the delayed feet to the end of a stride."""
    for j in range(plant.delayed):
        late = state.late[j]
        late.foot_m += way_in(late.speed, late.speeding, lasts_s)
        late.speed += lasts_s * late.speeding


@noinline_kernel
def end_step(plant: Record, state: Record) -> None:
    """Set the delayed feet to the exact end of the step."""
    for j in range(plant.delayed):
        state.late[j].foot_m = state.late[j].end_m


def rest_late(plant: Record, state: Record) -> None:
    """Start the delayed actuators from rest at the voltage of the start."""
    longest_s = 2.0 * float(plant.delays_s.max())
    state.history.start_v[0], state.history.lasted_s[0] = plant.rest_v, longest_s
    for j in range(plant.delayed):
        late = state.late[j]
        late.voltage_v, late.at_s = plant.rest_v, longest_s - plant.delays_s[j]
        late.piezo = state.piezo
