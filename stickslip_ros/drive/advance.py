"""
Kernel: the drive under a wave, from corner to corner of its voltage, from sample to sample.

The voltage is piecewise linear, and its corners are known in advance: those of the command, and
the moment when a slewing amplifier has caught up. Between two of them the drive takes steps, so no
step ever straddles a corner: long ones of ``glide_along`` while the drive is ideal, short ones of
``ride_through`` otherwise.

"""

import numpy as np

from stickslip_ros.contact.kernel import entry_point, kernel
from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.reaction import remembers_turns
from stickslip_ros.contact.record import Record
from stickslip_ros.drive.amplifier import (
    has_caught_up,
    is_direct,
    is_fall_over,
    slewed_voltage,
    stretch_ahead,
    time_to_settle,
)
from stickslip_ros.drive.glide import glide_along
from stickslip_ros.drive.passes import allow_passes, check_motion, may_pass
from stickslip_ros.drive.records import ALL, Wave
from stickslip_ros.drive.short_steps import ride_through
from stickslip_ros.drive.walls import cell_force
from stickslip_ros.drive.waveform import ramp_is_over

RAMP_START, RAMP_MEAN, RAMP_END = 0, 1, 2
"""Columns of the log of ramps: position after the fall, mean and final position, m."""
TIME, VOLTAGE, FOOT, POSITION, FORCE = range(5)
"""Columns of a trace."""


@entry_point
def observe_ideal(
    plants: Record,
    states: Record,
    wave: Wave,
    load_n: float,
    sample_s: float,
    truth: Array,
    ramps: Array,
) -> None:
    """Do what ``observe`` does, for a drive that ``takes_long_steps``."""
    plant, state = plants[0], states[0]
    for i in range(len(truth)):
        remaining_s = sample_s
        allow_passes(plant, state, len(wave.rows), sample_s)
        while remaining_s > 0.0 and may_pass(state):
            ahead = stretch_ahead(plant, wave, state.clock, state.voltage_v)
            stretch_s = min(remaining_s, ahead.lasts_s)
            glide_along(plant, state, ahead.start_v, ahead.rate_v_per_s, load_n, stretch_s)
            if state.passes_left < 0:
                return
            fall_is_over = has_caught_up(plant, ahead, state.voltage_v, stretch_s)
            tell_time(wave, state, stretch_s, fall_is_over, ramps)
            remaining_s -= stretch_s
        _write_down(plant, state, truth, i)


@entry_point
def observe(
    plants: Record,
    states: Record,
    wave: Wave,
    load_n: float,
    sample_s: float,
    truth: Array,
    ramps: Array,
) -> None:
    """
    Advance by one sample time per row of ``truth``, and fill its columns but the first.

    Parameters
    ----------
    plants, states : array of one record of PLANT, of STATE
        The drive; its state is changed in place.
    wave : Wave
        Commanded voltage.
    load_n : float
        External force on the runner, N.
    sample_s : float
        Time between two samples, s.
    truth : array, shape (samples, 5)
        Receives voltage (V), foot (m), position (m), force in the load cell (N).
    ramps : array, shape (n, 3)
        Row ``cycle % n`` receives each finished ramp: position at its start after the fall,
        mean and final position, m.

    """
    plant, state = plants[0], states[0]
    for i in range(len(truth)):
        remaining_s = sample_s
        allow_passes(plant, state, len(wave.rows), sample_s)
        while remaining_s > 0.0 and may_pass(state):
            before_v = state.voltage_v
            ahead = stretch_ahead(plant, wave, state.clock, slewed_voltage(plant, state))
            settled_s = time_to_settle(plant, wave, before_v, ahead.start_v, ahead.rate_v_per_s)
            stretch_s = min(remaining_s, ahead.lasts_s, settled_s)
            ride(plant, state, ahead.start_v, ahead.rate_v_per_s, load_n, stretch_s)
            if state.passes_left < 0:
                return
            if is_direct(plant):
                fall_is_over = has_caught_up(plant, ahead, state.voltage_v, stretch_s)
            else:
                fall_is_over = is_fall_over(plant, wave, state, before_v, stretch_s)
            tell_time(wave, state, stretch_s, fall_is_over, ramps)
            remaining_s -= stretch_s
        _write_down(plant, state, truth, i)


def observe_samples(
    plants: Record,
    states: Record,
    wave: Wave,
    load_n: float,
    sample_s: float,
    truth: Array,
    ramps: Array,
) -> None:
    """
    Do what ``observe`` does, by the kernel that is fit for it.

    Raises
    ------
    StickSlipError
        If the integration has failed.

    """
    kernel = observe_ideal if takes_long_steps(plants, states) else observe
    kernel(plants, states, wave, load_n, sample_s, truth, ramps)
    check_motion(states, load_n)


def advance(
    plants: Record, states: Record, wave: Wave, load_n: float, duration_s: float, ramps: Array
) -> None:
    """Advance by a duration, with parameters and errors of ``observe_samples``."""
    observe_samples(plants, states, wave, load_n, duration_s, np.empty((1, FORCE + 1)), ramps)


def takes_long_steps(plants: Record, states: Record) -> bool:
    """Tell whether a drive, given as arrays of one record, takes nothing but long steps now."""
    return bool(plants['glides'].item() and not states['contacts']['on_springs'][0, ALL])


@kernel
def ride(
    plant: Record,
    state: Record,
    start_v: float,
    rate_v_per_s: float,
    load_n: float,
    stretch_s: float,
) -> None:
    """Advance along a straight stretch of the voltage."""
    left_s = stretch_s
    if plant.ideal and remembers_turns(plant.contacts[ALL], state.contacts[ALL]):
        left_s = glide_along(plant, state, start_v, rate_v_per_s, load_n, stretch_s)
    if left_s > 0.0:
        start_v += rate_v_per_s * (stretch_s - left_s)
        ride_through(plant, state, start_v, rate_v_per_s, load_n, left_s)


@kernel
def tell_time(
    wave: Wave, state: Record, stretch_s: float, fall_is_over: bool, ramps: Array
) -> None:
    """Move the clock on, and write down a ramp that is over."""
    clock = state.clock
    clock.ramp_s += stretch_s
    if fall_is_over:
        clock.start_m = state.position_m
    if ramp_is_over(wave, clock):
        row = clock.cycle % len(ramps)
        ramps[row, RAMP_START] = clock.start_m
        ramps[row, RAMP_MEAN] = (state.sums.position_m_s - clock.start_m_s) / wave.period_s
        ramps[row, RAMP_END] = state.position_m
        clock.ramp_s -= wave.period_s
        clock.cycle += 1
        clock.start_m = state.position_m
        clock.start_m_s = state.sums.position_m_s


@kernel
def _write_down(plant: Record, state: Record, truth: Array, i: int) -> None:
    truth[i, VOLTAGE] = state.voltage_v
    truth[i, FOOT] = state.foot_m
    truth[i, POSITION] = state.position_m
    truth[i, FORCE] = cell_force(plant, state.position_m)
