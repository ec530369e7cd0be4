"""
The drive: a voltage in, a runner motion out.

The voltage is piecewise linear, and its corners are known in advance: those of the command,
and the moment when a slewing amplifier has caught up. ``advance`` goes from corner to corner;
between two of them ``ride`` takes steps, so no step ever straddles a corner: long ones of
``glide_along`` while the drive is ideal, short ones otherwise. In each of them the voltage moves
the feet, the feet drag the contacts, and the contacts pull the runner.

"""

import math

from stickslip_ros.contact.kernel import entry_point, kernel
from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.reaction import remembers_turns
from stickslip_ros.drive.actuation import longest_on_slope, ride_through, slewed_voltage
from stickslip_ros.drive.amplifier import (
    SETTLED_V,
    clamp,
    follow,
    is_direct,
    is_fall_over,
    time_to_settle,
    wanted,
)
from stickslip_ros.drive.glide import glide_along
from stickslip_ros.drive.passes import allow_passes, has_given_up, may_pass
from stickslip_ros.drive.records import Clock, DriveHistory, Plant, State, Wave
from stickslip_ros.drive.waveform import ramp_is_over

RAMP_START, RAMP_MEAN, RAMP_END = 0, 1, 2
"""Columns of the log of ramps: position after the fall, mean and final position, m."""


@kernel
def ride(
    plant: Plant,
    history: DriveHistory,
    state: State,
    start_v: float,
    rate_v_per_s: float,
    load_n: float,
    stretch_s: float,
) -> State:
    """Advance along a straight stretch of the voltage."""
    left_s = stretch_s
    if plant.ideal and remembers_turns(plant.contact, state.contact):
        longest_s = longest_on_slope(plant, rate_v_per_s)
        state, left_s = glide_along(
            plant, history, state, start_v, rate_v_per_s, load_n, stretch_s, longest_s
        )
    if left_s > 0.0:
        start_v += rate_v_per_s * (stretch_s - left_s)
        state = ride_through(plant, history, state, start_v, rate_v_per_s, load_n, left_s)
    return state


@entry_point
def advance(
    plant: Plant,
    history: DriveHistory,
    state: State,
    wave: Wave,
    load_n: float,
    duration_s: float,
    ramps: Array,
) -> State:
    """
    Advance the drive by a duration under a wave and a constant external load.

    Parameters
    ----------
    plant : Plant
        The drive.
    history : DriveHistory
        What contacts and piezo remember; changed in place.
    state : State
        State before.
    wave : Wave
        Commanded voltage.
    load_n : float
        External force on the runner, N.
    duration_s : float
        Time to advance, s.
    ramps : array, shape (n, 3)
        Row ``cycle % n`` receives each finished ramp: position at its start after the fall,
        mean and final position, m.

    """
    remaining_s = duration_s
    allow_passes(plant, history, len(wave.rows), duration_s)
    while remaining_s > 0.0 and may_pass(history):
        target_v, slope_v_per_s, corner_s = wanted(plant, wave, state.clock)
        output_v = slewed_voltage(plant, history, state)
        start_v, rate_v_per_s, caught_s = follow(
            plant, output_v, target_v, slope_v_per_s, state.clock.ramp_s
        )
        before_v = state.voltage_v
        settled_s = time_to_settle(plant, wave, before_v, start_v, rate_v_per_s)
        stretch_s = min(remaining_s, corner_s, caught_s, settled_s)
        state = ride(plant, history, state, start_v, rate_v_per_s, load_n, stretch_s)
        if has_given_up(history):
            return state
        if is_direct(plant):
            gap_v = clamp(plant, target_v + slope_v_per_s * stretch_s) - state.voltage_v
            fall_is_over = caught_s < math.inf and abs(gap_v) <= SETTLED_V
        else:
            fall_is_over = is_fall_over(plant, wave, state, before_v, stretch_s)
        state = tell_time(wave, state, stretch_s, fall_is_over, ramps)
        remaining_s -= stretch_s
    return state


@kernel
def tell_time(
    wave: Wave, state: State, stretch_s: float, fall_is_over: bool, ramps: Array
) -> State:
    """Move the clock on, and write down a ramp that is over."""
    clock = state.clock
    ramp_s = clock.ramp_s + stretch_s
    start_m = state.position_m if fall_is_over else clock.start_m
    clock = Clock(ramp_s, clock.cycle, start_m, clock.start_m_s)
    if ramp_is_over(wave, clock):
        row = clock.cycle % len(ramps)
        ramps[row, RAMP_START] = clock.start_m
        ramps[row, RAMP_MEAN] = (state.sums.position_m_s - clock.start_m_s) / wave.period_s
        ramps[row, RAMP_END] = state.position_m
        clock = Clock(
            ramp_s - wave.period_s, clock.cycle + 1, state.position_m, state.sums.position_m_s
        )
    return State(
        clock,
        state.voltage_v,
        state.foot_m,
        state.position_m,
        state.velocity_m_per_s,
        state.contact,
        state.sums,
    )
