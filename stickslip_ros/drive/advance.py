# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Advance the drive under a wave: samples, stretches between corners of the voltage, and steps.

The voltage is piecewise linear. Its corners are known in advance: those of the command, and the
end of slewing. The drive takes its steps between two corners. An ideal drive takes long steps. A
rounded voltage, a nonlinear piezo, feet that differ, a stuck runner, a changing preload and
Coulomb's law need short steps, many of them in the presliding range. Their length follows from
the highest possible speed of the feet, so no step is repeated.

Passes of the time loops are counted. Every stretch and step must move the clock; if the clock
stands still, the loops end anyway, and the drive fails with its state.

"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.drive import delay
from stickslip_ros.drive.amplifier import (
    Stretch,
    clamp,
    has_caught_up,
    is_direct,
    is_fall_over,
    stretch_ahead,
    time_to_settle,
)
from stickslip_ros.drive.feet import bends, mean_place
from stickslip_ros.drive.frame import frame_place
from stickslip_ros.drive.long_step import (
    LANES,
    STEP_SLACK,
    all_lanes,
    begin_stretch,
    end_stretch,
    enter_lane,
    long_steps,
    longest_on_slope,
    one_lane,
)
from stickslip_ros.drive.piezo import fastest_m_per_s
from stickslip_ros.drive.records import ALL, CORNERS, FOOT, FORCE, POSITION, VOLTAGE, Wave
from stickslip_ros.drive.runner import cell_force
from stickslip_ros.drive.short_step import may_pass, pace_of, step
from stickslip_ros.drive.travel import update_curves
from stickslip_ros.drive.waveform import ramp_is_over, row_at
from stickslip_ros.errors import StickSlipError
from stickslip_ros.kernels.kernel import entry_point, kernel, with_types_kept
from stickslip_ros.kernels.record import Record

RAMP_START, RAMP_MEAN, RAMP_END = 0, 1, 2
"""Columns of the log of ramps: position after the fall, mean and final position, m."""
CROSSING_S = 4e-5
"""Feet after a low-pass or with a resonance move at most sim.dt/CROSSING_S of the presliding range
in a step: an eighth of it at the default of 5 us."""
CROSSING_STEPS_MIN = 2.0
"""Least number of steps in which these feet cross the presliding range."""
SETTLING, RINGING = 1.0, 4.5
"""Longest step in which the feet move on a parabola, per allowed share of the presliding range: in
time constants of the low-pass, and in inverse angular frequencies of the resonance."""
LANES_MIN = 4
"""Least number of drives for which lanes are faster, even with empty lanes."""
RATE_REFINEMENT = 2
"""Factor by which steps are shorter if friction depends on velocity; energy balances to 2e-4."""
GAP_SHARE = 0.03
"""Largest difference between the slip of the springs and the sliding of the runner in a step, as a
share of the presliding range: after a fall the friction drops within nanoseconds."""
BURST = 4
"""Steps of one length before the next length is chosen."""
PASSES_MIN = 100_000
"""Passes allowed for the shortest duration; the longest falls need a hundredth of them."""
PASSES_PER_STEP = 1_000
"""Passes added for each longest step in the duration."""
PASSES_PER_CROSSING = 50
"""Passes added for each sim.dt/CROSSING_S of the presliding range that the feet may cross; at most
1.3 were needed."""
CROSSING_PASSES_MAX = 1e8
"""Limit of these passes: a drive whose clock stands still gives up within seconds."""
PASSES_PER_ROW = 4
"""Passes added for each row of a waveform's table, and for each corner that a delayed actuator may
meet; 2 are needed."""


class VoltageHeld(StickSlipError):
    """The memory of delayed feet was full: the motion is right, but under a held voltage."""


@with_types_kept
@entry_point
def observe_ideal(
    plants: Record,
    states: Record,
    wave: Wave,
    load_n: float,
    sample_s: float,
    truth: Array,
    ramps: Array,
) -> bool:
    """Advance and sample like ``observe``, for a plain drive that ``takes_only_long_steps``."""
    _observe(one_lane(), ((plants, states, wave, load_n, sample_s, truth, ramps),), True)
    return needs_check(states[0])


@with_types_kept
@entry_point
def observe_long(
    plants: Record,
    states: Record,
    wave: Wave,
    load_n: float,
    sample_s: float,
    truth: Array,
    ramps: Array,
) -> bool:
    """Advance and sample like ``observe_ideal``, also with a loss or a rival law."""
    _observe(one_lane(), ((plants, states, wave, load_n, sample_s, truth, ramps),), False)
    return needs_check(states[0])


@entry_point
def observe_together(drives: tuple[Any, ...]) -> None:
    """Advance LANES drives, tuples of ``observe``'s arguments; negative sample times are idle."""
    _observe(all_lanes(), drives, True)


@entry_point
def observe_long_together(drives: tuple[Any, ...]) -> None:
    """Advance LANES drives like ``observe_together``, also with a loss or a rival law."""
    _observe(all_lanes(), drives, False)


@kernel
def _observe(lanes: Record, drives: tuple[Any, ...], plain: bool) -> None:
    """Advance the drives in long steps; ``plain`` omits the code of losses and rival laws."""
    active = 0
    for i in range(len(lanes.h_s)):
        plants, states, _, load_n, sample_s, _, _ = drives[i]
        if sample_s >= 0.0:
            update_curves(plants[0], states[0])
            enter_lane(lanes, i, plants[0], states[0], load_n)
            active += 1
    while active > 0:
        for i in range(len(lanes.h_s)):
            if lanes.runs[i] and (lanes.left_s[i] <= 0.0 or lanes.passes_left[i] < 0):
                lanes.runs[i] = _next_stretch(lanes, i, drives[i])
                active -= 1 - lanes.runs[i]
        # Finished lanes stay: the loops have a fixed length, and `runs` skips their tables.
        long_steps(lanes, drives, plain)


@kernel
def _next_stretch(lanes: Record, i: int, drive: tuple[Any, ...]) -> bool:
    """End the stretch of a lane, if any, and begin the next; return whether there is one."""
    plants, states, wave, _, sample_s, truth, ramps = drive
    plant, state, stretch_s = plants[0], states[0], lanes.stretch_s[i]
    if stretch_s > 0.0:
        end_stretch(lanes, i, plant, state)
        if state.passes_left < 0:
            return False
        ahead = Stretch(
            lanes.start_v[i],
            lanes.rate_v_per_s[i],
            lanes.target_v[i],
            lanes.slope_v_per_s[i],
            lanes.caught_s[i],
            stretch_s,
        )
        fall_is_over = has_caught_up(plant, ahead, state.voltage_v, stretch_s)
        advance_clock(wave, state, stretch_s, fall_is_over, ramps)
        lanes.remaining_s[i] -= stretch_s
    while not lanes.remaining_s[i] > 0.0:
        if lanes.samples[i] > 0:
            _sample(plant, state, truth, lanes.samples[i] - 1)
        if lanes.samples[i] == len(truth):
            return False
        lanes.samples[i] += 1
        lanes.remaining_s[i] = sample_s
        allow_passes(plant, state, wave, sample_s)
    if not may_pass(state):
        return False
    lanes.row[i] = row_at(wave.rows, state.clock.ramp_s, lanes.row[i])
    ahead = stretch_ahead(plant, wave, state.clock, state.voltage_v, lanes.row[i])
    lanes.target_v[i], lanes.slope_v_per_s[i] = ahead.target_v, ahead.slope_v_per_s
    lanes.caught_s[i], stretch_s = ahead.caught_s, min(lanes.remaining_s[i], ahead.lasts_s)
    begin_stretch(lanes, i, plant, state, ahead.start_v, ahead.rate_v_per_s, stretch_s)
    return True


@with_types_kept
@entry_point
def observe(
    plants: Record,
    states: Record,
    wave: Wave,
    load_n: float,
    sample_s: float,
    truth: Array,
    ramps: Array,
) -> bool:
    """
    Advance by a sample time for each row of ``truth``, and fill its columns except the first.

    Return whether the state ``needs_check``.

    Parameters
    ----------
    plants, states : array of one record of PLANT, of STATE
        The drive, whose state is changed in place.
    truth : array, shape (samples, 5)
        Receives voltage (V), foot (m), position (m), force in the load cell (N).
    ramps : array, shape (n, 3)
        Row ``cycle % n`` receives each finished ramp: position after the fall at its start, mean
        and final position, m.

    """
    plant, state = plants[0], states[0]
    drives = ((plants, states, wave, load_n, sample_s, truth, ramps),)
    update_curves(plant, state)
    row = 0
    for i in range(len(truth)):
        remaining_s = sample_s
        allow_passes(plant, state, wave, sample_s)
        while remaining_s > 0.0 and may_pass(state):
            before_v = state.voltage_v
            row = row_at(wave.rows, state.clock.ramp_s, row)
            slewed_v = state.piezo.slewed_v if plant.amplifier.tau_s > 0.0 else before_v
            ahead = stretch_ahead(plant, wave, state.clock, slewed_v, row)
            # With a full memory of corners the voltage is held, so that the motion stays right.
            if plant.delayed and delay.must_hold(plant, state, ahead.start_v, ahead.rate_v_per_s):
                ahead = Stretch(slewed_v, 0.0, slewed_v, 0.0, math.inf, ahead.lasts_s)
            settled_s = time_to_settle(plant, wave, before_v, ahead.start_v, ahead.rate_v_per_s)
            stretch_s = min(remaining_s, ahead.lasts_s, settled_s)
            if plant.delayed:
                stretch_s = min(stretch_s, delay.time_to_corner(plant, state))
            advance_stretch(drives, ahead.start_v, ahead.rate_v_per_s, stretch_s)
            if plant.delayed:
                delay.end_stretch(plant, state, ahead.start_v, ahead.rate_v_per_s, stretch_s)
            if state.passes_left < 0:
                return True
            if is_direct(plant):
                fall_is_over = has_caught_up(plant, ahead, state.voltage_v, stretch_s)
            else:
                fall_is_over = is_fall_over(plant, wave, state, row, before_v, stretch_s)
            advance_clock(wave, state, stretch_s, fall_is_over, ramps)
            remaining_s -= stretch_s
        _sample(plant, state, truth, i)
    return needs_check(state)


def observe_samples(
    plants: Record,
    states: Record,
    wave: Wave,
    load_n: float,
    sample_s: float,
    truth: Array,
    ramps: Array,
) -> None:
    """Advance and sample like ``observe``, with the fitting kernel; raises like `check_motion`."""
    observer = observe
    if takes_only_long_steps(plants, states):
        observer = observe_ideal if plants['plain'].item() else observe_long
    if observer(plants, states, wave, load_n, sample_s, truth, ramps):
        check_motion(states, load_n)


def advance(
    plants: Record, states: Record, wave: Wave, load_n: float, duration_s: float, ramps: Array
) -> None:
    """Advance by a duration; parameters and errors of ``observe_samples``."""
    observe_samples(plants, states, wave, load_n, duration_s, np.zeros((1, FORCE + 1)), ramps)


def observe_all(
    drives: Sequence[tuple[Record, Record, Wave, float, float, Array, Array]],
) -> None:
    """Advance at most LANES drives, tuples of arguments of ``observe_samples``."""
    lanes = [drive for drive in drives if takes_only_long_steps(*drive[:2])]
    if len(lanes) < LANES_MIN:
        lanes = []
    for drive in drives:
        if not any(drive is each for each in lanes):
            observe_samples(*drive)
    if lanes:
        idle = (*lanes[0][:4], -1.0, *lanes[0][5:])
        plain = all(drive[0]['plain'].item() for drive in lanes)
        observer = observe_together if plain else observe_long_together
        observer((*lanes, *[idle] * (LANES - len(lanes))))
        for drive in lanes:
            check_motion(drive[1], drive[3])


def takes_only_long_steps(plants: Record, states: Record) -> bool:
    """Return whether a drive, given as arrays of one record, now takes only long steps."""
    return bool(plants['only_long_steps'].item() and not states['contacts']['on_springs'][0, ALL])


@kernel
def advance_stretch(
    drives: tuple[Any, ...], start_v: float, rate_v_per_s: float, stretch_s: float
) -> None:
    """Advance the only drive, a tuple as in ``_observe``, along a straight voltage."""
    plants, states, _, load_n, _, _, _ = drives[0]
    plant, state = plants[0], states[0]
    if plant.only_long_steps and not state.contacts[ALL].on_springs:
        lanes = one_lane()
        enter_lane(lanes, 0, plant, state, load_n)
        begin_stretch(lanes, 0, plant, state, start_v, rate_v_per_s, stretch_s)
        while lanes.left_s[0] > 0.0 and lanes.passes_left[0] >= 0:
            long_steps(lanes, drives, False)
        end_stretch(lanes, 0, plant, state)
    else:
        take_short_steps(plant, state, start_v, rate_v_per_s, load_n, stretch_s)


@kernel
def take_short_steps(
    plant: Record,
    state: Record,
    start_v: float,
    rate_v_per_s: float,
    load_n: float,
    stretch_s: float,
) -> None:
    """Advance in short steps along a straight stretch of the voltage before the low-pass."""
    state.places_m[ALL] = state.foot_m
    left_s, input_v = stretch_s, start_v
    while left_s > 0.0 and may_pass(state):
        before_s = left_s
        dt_s, steps, left_s = _burst(plant, state, input_v, rate_v_per_s, stretch_s, left_s)
        pace = pace_of(plant, state, dt_s)
        from_v = clamp(plant, input_v)
        for i in range(1, steps + 1):
            # Count from the start of the burst: summed steps would move the corner by rounding.
            to_v = clamp(plant, input_v + rate_v_per_s * (i * dt_s))
            at_s = stretch_s - before_s + (i - 1) * dt_s
            step(plant, state, from_v, to_v, load_n, pace, at_s)
            from_v = to_v
        input_v = clamp(plant, start_v + rate_v_per_s * (stretch_s - left_s))
        state.piezo.slewed_v = input_v


@kernel
def _burst(
    plant: Record,
    state: Record,
    input_v: float,
    rate_v_per_s: float,
    stretch_s: float,
    left_s: float,
) -> tuple[float, int, float]:
    """Return length and number of the next equal steps, and the remaining time of the stretch."""
    if plant.ideal and abs(rate_v_per_s) >= plant.slew_v_per_s:
        longest_s = longest_on_slope(plant, rate_v_per_s)
    else:
        longest_s = _longest_in_burst(plant, state.piezo, state.voltage_v, input_v, rate_v_per_s)
    contact = plant.contacts[ALL]
    for j in range(plant.delayed):
        late = state.late[j]
        own_v = delay.late_voltage(plant, state, j, stretch_s - left_s)
        own_v_per_s = state.history.rate_v_per_s[late.corner]
        own_s = _longest_in_burst(plant, late.piezo, late.voltage_v, own_v, own_v_per_s)
        longest_s = min(longest_s, own_s)
    if contact.ageing.rate_share > 0.0:
        slip_m_per_s = state.contacts[1 if plant.separate else ALL].slip_m_per_s
        past_m_per_s = plant.gain_m_per_v * rate_v_per_s - state.velocity_m_per_s
        gap_m_per_s = abs(abs(past_m_per_s) - abs(slip_m_per_s))
        longest_s /= RATE_REFINEMENT
        longest_s = min(longest_s, GAP_SHARE * plant.presliding_m / gap_m_per_s)
    steps = max(1, math.ceil(left_s / longest_s - STEP_SLACK))
    dt_s = left_s / steps
    if steps <= BURST or (plant.ideal and not contact.ageing.on) or longest_s >= plant.dt_s:
        return dt_s, steps, 0.0
    return dt_s, BURST, left_s - BURST * dt_s


@kernel
def _longest_in_burst(
    plant: Record, memory: Record, voltage_v: float, input_v: float, rate_v_per_s: float
) -> float:
    """Return the longest step that resolves the next motion of an actuator, s."""
    piezo, tau_s, gain = plant.piezo, plant.amplifier.tau_s, plant.gain_m_per_v
    limit_m = plant.presliding_m
    share = min(plant.dt_s / CROSSING_S, 1.0 / CROSSING_STEPS_MIN)
    longest_s, fastest_v_per_s = plant.dt_s, rate_v_per_s
    if tau_s > 0.0:
        # The rate of the output stays between its present value and the rate of the input.
        output_v_per_s = (input_v - voltage_v) / tau_s
        if abs(output_v_per_s) > abs(rate_v_per_s):
            fastest_v_per_s = output_v_per_s
        settling_m = gain * tau_s * abs(output_v_per_s - rate_v_per_s)
        longest_s = _longest_on_parabola(settling_m, limit_m, SETTLING * share * tau_s, longest_s)
    speed_m_per_s = fastest_m_per_s(plant, memory, fastest_v_per_s)
    if piezo.omega_per_s > 0.0:
        rung_m = abs(memory.ring_m - memory.driving_m)
        rung_m += abs(memory.ring_m_per_s) / piezo.omega_per_s
        smooth_s = RINGING * share / piezo.omega_per_s
        longest_s = _longest_on_parabola(rung_m, limit_m, smooth_s, longest_s)
    travel_m = share * limit_m
    if speed_m_per_s * longest_s <= travel_m:
        return longest_s
    return travel_m / speed_m_per_s


@kernel
def _longest_on_parabola(
    size_m: float, limit_m: float, smooth_s: float, longest_s: float
) -> float:
    """
    Return the longest step in which a decaying motion of the feet is a parabola, s.

    The error of a parabola grows with the third power of the step. The limit is the error of a
    motion as large as the presliding range in a step of ``smooth_s``.

    """
    if size_m * longest_s**3 <= limit_m * smooth_s**3:
        return longest_s
    return smooth_s * (limit_m / size_m) ** (1.0 / 3.0)


@kernel
def advance_clock(
    wave: Wave, state: Record, stretch_s: float, fall_is_over: bool, ramps: Array
) -> None:
    """Advance the clock, and store a finished ramp."""
    clock = state.clock
    clock.ramp_s += stretch_s
    if fall_is_over and len(wave.rows) == 0:
        clock.start_m = state.position_m
    if ramp_is_over(wave, clock):
        cycle_s = wave.period_s - wave.lead_s
        lasted_s = wave.period_s if clock.cycle == 0 else cycle_s
        row = clock.cycle % len(ramps)
        ramps[row, RAMP_START] = clock.start_m
        ramps[row, RAMP_MEAN] = (state.sums.position_m_s - clock.start_m_s) / lasted_s
        ramps[row, RAMP_END] = state.position_m
        clock.ramp_s -= cycle_s
        clock.cycle += 1
        clock.start_m = state.position_m
        clock.start_m_s = state.sums.position_m_s


@kernel
def _sample(plant: Record, state: Record, truth: Array, i: int) -> None:
    truth[i, VOLTAGE] = state.voltage_v
    truth[i, FOOT] = mean_place(plant, state) if bends(plant) else state.foot_m
    reference_m = frame_place(plant, state) if plant.frame.is_reference else 0.0
    truth[i, POSITION] = state.position_m - reference_m
    if plant.button.exists:
        truth[i, FORCE] = plant.button.n_per_m * state.button_m
    else:
        truth[i, FORCE] = cell_force(plant, state.position_m)


@kernel
def allow_passes(plant: Record, state: Record, wave: Wave, duration_s: float) -> None:
    """Set the number of passes that the time loops may take for a duration; 0 after a failure."""
    if state.passes_left >= 0:
        rows = len(wave.rows) * (1.0 + duration_s / wave.period_s)
        range_v = plant.voltage_max_v - plant.voltage_min_v
        way_v = min(plant.slew_v_per_s * duration_s, (1.0 + rows) * range_v)
        crossings = plant.gain_m_per_v * way_v / plant.presliding_m
        passes = PASSES_MIN + PASSES_PER_STEP * duration_s / plant.dt_s
        passes += PASSES_PER_ROW * (rows + plant.delayed * CORNERS)
        crossing_passes = PASSES_PER_CROSSING * crossings * CROSSING_S / plant.dt_s
        state.passes_left = int(min(passes, 1e15) + min(crossing_passes, CROSSING_PASSES_MAX))


@kernel
def needs_check(state: Record) -> bool:
    """Return whether `check_motion` raises."""
    is_finite = math.isfinite(state.position_m + state.velocity_m_per_s)
    return bool(state.passes_left < 0 or not is_finite or state.history.is_full)


def check_motion(states: Record, load_n: float) -> None:
    """
    Raise StickSlipError with the state of a drive that has failed or whose motion is not finite.

    Raises VoltageHeld if the memory of delayed feet was full, so that the voltage was held.

    """
    if states['passes_left'].item() < 0:
        raise StickSlipError(
            f'time stands still after {states[0].passes_made} passes, {_place(states, load_n)}; '
            'bring sim.dt, bandwidth, resonance and preload nearer to their defaults, and report '
            'this line'
        )
    if not math.isfinite(states['position_m'].item() + states['velocity_m_per_s'].item()):
        raise StickSlipError(
            f'the motion is no longer finite, {_place(states, load_n)}; lower sim.dt, or bring '
            'mass, damping and stiffnesses nearer to each other'
        )
    if states['history']['is_full'].item():
        states['history']['is_full'] = False
        raise VoltageHeld(
            f'held at {states[0].voltage_v:.6g} V: feet.delay spans more than {CORNERS} corners '
            'of the voltage; shorten it, send fewer corners, or set amplifier.resolution to 0 V'
        )


def _place(states: Record, load_n: float) -> str:
    names = ('voltage_v', 'foot_m', 'position_m', 'velocity_m_per_s')
    voltage_v, foot_m, position_m, velocity_m_per_s = (states[name].item() for name in names)
    ramp_s, cycle, *_ = states['clock'].item()
    return (
        f'at {voltage_v!r} V, foot {foot_m!r} m, runner {position_m!r} m and '
        f'{velocity_m_per_s!r} m/s, load {load_n!r} N, {ramp_s!r} s into ramp {cycle}'
    )
