"""
The drive: a voltage in, a runner motion out.

The voltage is piecewise linear, and its corners are known in advance: those of the command,
and the moment when a slewing amplifier has caught up. ``advance`` goes from corner to corner;
between two of them ``ride`` takes equal steps, so no step ever straddles a corner.

"""

import math

from stickslip_ros.contact.kernel import kernel
from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.reaction import History, react, remembers_turns
from stickslip_ros.drive.actuator import foot_displacement
from stickslip_ros.drive.amplifier import SETTLED_V, clamp, follow
from stickslip_ros.drive.glide import glide
from stickslip_ros.drive.ledger import book
from stickslip_ros.drive.records import Clock, Plant, State, Wave, at_voltage
from stickslip_ros.drive.runner import force_on_runner, holding_force, kick_after, kick_before
from stickslip_ros.drive.waveform import ramp_is_over, target

RAMP_START, RAMP_MEAN, RAMP_END = 0, 1, 2
"""Columns of the log of ramps: position after the fall, mean and final position, m."""
SLEW_REFINEMENT = 64
"""Steps during a fall are so many times shorter: the feet cross the whole presliding range in
two microseconds, and their work is an integral over that range."""
SLEW_STEPS_MIN = 6.0
"""Steps in which the feet of a slewing amplifier cross the presliding range, at least."""
VERLET_REFINEMENT = 8
"""Steps are so many times shorter on springs and for the rival laws, which are stepped by
velocity Verlet: second order, no look ahead."""
STEP_SLACK = 1e-9
"""Share of a step by which a stretch may exceed a whole number of steps, for rounding."""


@kernel
def step(
    plant: Plant, history: History, state: State, voltage_v: float, load_n: float, dt_s: float
) -> State:
    """Advance the drive by one step, at the end of which the piezo is at ``voltage_v``."""
    foot_m = foot_displacement(plant, voltage_v)

    before_n = force_on_runner(plant, state.position_m, state.contact.memory.force_n, load_n)
    middle_m_per_s = kick_before(plant, state.velocity_m_per_s, before_n, dt_s)
    position_m = state.position_m + dt_s * middle_m_per_s

    foot_m_per_s = (foot_m - state.foot_m) / dt_s
    holding_n = holding_force(plant, position_m, middle_m_per_s, foot_m_per_s, load_n, dt_s)
    contact = react(plant.contact, history, state.contact, position_m - foot_m, dt_s, holding_n)
    contact_n = contact.memory.force_n

    after_n = force_on_runner(plant, position_m, contact_n, load_n)
    velocity_m_per_s = kick_after(plant, middle_m_per_s, after_n, dt_s)

    sums = book(plant, state, foot_m, position_m, velocity_m_per_s, contact_n, load_n, dt_s)
    return State(state.clock, voltage_v, foot_m, position_m, velocity_m_per_s, contact, sums)


@kernel
def ride(
    plant: Plant,
    history: History,
    state: State,
    start_v: float,
    rate_v_per_s: float,
    load_n: float,
    stretch_s: float,
) -> State:
    """Advance along a straight stretch of the voltage, in equal steps."""
    longest_s = plant.dt_s
    if abs(rate_v_per_s) >= plant.slew_v_per_s:
        foot_m_per_s = plant.gain_m_per_v * abs(rate_v_per_s)
        travel_m = plant.contact.curve.limit_m / SLEW_STEPS_MIN
        longest_s = min(plant.dt_s / SLEW_REFINEMENT, travel_m / foot_m_per_s)
    if remembers_turns(plant.contact, state.contact):
        return _glide_along(
            plant, history, state, start_v, rate_v_per_s, load_n, stretch_s, longest_s
        )
    steps = max(1, math.ceil(VERLET_REFINEMENT * stretch_s / longest_s - STEP_SLACK))
    dt_s = stretch_s / steps
    for i in range(1, steps + 1):
        voltage_v = clamp(plant, start_v + rate_v_per_s * (i * dt_s))
        state = step(plant, history, state, voltage_v, load_n, dt_s)
    return state


@kernel
def _glide_along(
    plant: Plant,
    history: History,
    state: State,
    start_v: float,
    rate_v_per_s: float,
    load_n: float,
    stretch_s: float,
    longest_s: float,
) -> State:
    """Advance along a straight stretch in long steps, which also end where the sliding turns."""
    state = at_voltage(state, start_v)
    left_s = stretch_s
    while left_s > 0.0:
        h_s = left_s
        if left_s > longest_s:
            h_s = longest_s if left_s >= 2.0 * longest_s else 0.5 * left_s
        state, done_s = glide(plant, history, state, rate_v_per_s, load_n, h_s)
        left_s = left_s - done_s if done_s < left_s else 0.0
    return at_voltage(state, clamp(plant, start_v + rate_v_per_s * stretch_s))


@kernel
def advance(
    plant: Plant,
    history: History,
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
    history : History
        What the contacts remember; changed in place.
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
    while remaining_s > 0.0:
        target_v, slope_v_per_s, corner_s = target(wave, state.clock)
        start_v, rate_v_per_s, caught_s = follow(plant, state.voltage_v, target_v, slope_v_per_s)
        stretch_s = min(remaining_s, corner_s, caught_s)
        state = ride(plant, history, state, start_v, rate_v_per_s, load_n, stretch_s)
        gap_v = clamp(plant, target_v + slope_v_per_s * stretch_s) - state.voltage_v
        fall_is_over = caught_s < math.inf and abs(gap_v) <= SETTLED_V
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
