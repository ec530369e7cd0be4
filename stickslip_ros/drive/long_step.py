# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Kernel: the long step of one or several drives on the memory of turning points.

The stiffness with which the contacts answer is known at the start of a step: it is the tangent of
the branch that lies ahead. With it the runner is a damped oscillator whose motion is known
exactly. What the tangent misses, the curvature of the branch, is small; it is looked up in the
middle and at the end of the step and enters by Simpson's rule. No step runs past a reversal of the
sliding, the closing of a loop, or a wall, where the stiffness jumps: their times are found
beforehand.

Fourth order, one motion of the contact per step, always forwards in time.

A step is a long chain of sums, each of which waits for the one before it. So several drives go in
lanes: what they compute alike stands in loops that a processor does for four at a time, tables and
turning points are looked up lane by lane between these. Each drive has the bits that it has alone.

"""

from typing import Any

from stickslip_ros.contact.memory import Branch, branch_towards, force_ahead, move, stiffness_on
from stickslip_ros.drive.amplifier import clamp
from stickslip_ros.drive.oscillator import SIXTH, propagator
from stickslip_ros.drive.records import ALL
from stickslip_ros.drive.runner import (
    RESTING,
    holding_stiffness,
    missed_by_walls,
    time_to_wall,
    wall_force,
)
from stickslip_ros.drive.travel import arrest
from stickslip_ros.kernels.kernel import kernel, on_stack
from stickslip_ros.kernels.record import COUNT, FLOAT, Kind, Record, kind

LANES = 8
"""Drives that go together: half as many take the same time, twice as many twice the time."""
_NEWTON_STEPS = 1
"""One is enough: with three the worst error of 120 cases changes in its eleventh digit."""
STEP_SLACK = 1e-9
"""Share of a step by which a stretch may exceed a whole number of steps, for rounding."""
SLEW_REFINEMENT = 64
"""Steps during a fall are so many times shorter: the feet cross the whole presliding range in
two microseconds, and their work is an integral over that range."""
SLOPE_STEPS_MIN = 6.0
"""Long steps in which feet that follow a steep slope cross the presliding range, at least."""

_COUNTS = 'runs may_be_cut rests walled passes_left samples row'
FLOATS = (
    # Of plant and load; gamma is damping per mass, 1/s
    'per_kg damping_n_s_per_m gamma cell_n_per_m gain_m_per_v rest_v load_n '
    # Of the stretch; what is left of the sample
    'rate_v_per_s foot_m_per_s longest_s stretch_s left_s '
    'start_v target_v slope_v_per_s caught_s remaining_s '
    # Of the state: as there, and the force of the walls
    'voltage_v foot_m position_m velocity_m_per_s u_m contact_n wall_n '
    'feet_work_j load_work_j damping_lost_j position_m_s '
    # Of the step: sliding of the runner against the feet, velocity, acceleration; acceleration by
    # all but damping of the sliding and change of the contact force, and its growth
    'h_s speed speeding pull pull_rate jerk held_n_per_m omega_squared tangent '
    # The branch ahead
    'origin_m force_n sense fold unfold reach_m '
    # Sliding, its velocity, place, force, in the middle and at the end; half a step's responses
    'y_middle w_middle y_end w_end middle_m next_m next_foot_m middle_n end_n impulse decay '
    # Acceleration that tangent and walls miss
    'missed_middle missed_by_walls '
)


def lanes_kind(lanes: int) -> Kind:
    """Return the type of what steps of so many drives need at hand; each field has their lanes."""
    floats = dict.fromkeys(FLOATS.split(), (FLOAT, (lanes,)))
    return kind(**dict.fromkeys(_COUNTS.split(), (COUNT, (lanes,))), **floats)


one_lane, all_lanes = on_stack(lanes_kind(1)), on_stack(lanes_kind(LANES))


@kernel
def enter_lane(lanes: Record, i: int, plant: Record, state: Record, load_n: float) -> None:
    """Put a drive into a lane, between two stretches."""
    gamma = plant.damping_n_s_per_m * plant.per_kg
    lanes.runs[i], lanes.walled[i] = 1, plant.walls.exist
    lanes.per_kg[i], lanes.damping_n_s_per_m[i] = plant.per_kg, plant.damping_n_s_per_m
    lanes.gamma[i], lanes.cell_n_per_m[i], lanes.load_n[i] = gamma, plant.cell_n_per_m, load_n
    lanes.gain_m_per_v[i], lanes.rest_v[i] = plant.gain_m_per_v, plant.rest_v
    lanes.foot_m[i], lanes.position_m[i] = state.foot_m, state.position_m
    lanes.velocity_m_per_s[i], lanes.contact_n[i] = state.velocity_m_per_s, state.contact_n
    lanes.u_m[i] = state.contacts[ALL].memory.u_m
    if plant.walls.exist:
        lanes.wall_n[i] = wall_force(plant, state.position_m)
    sums = state.sums
    lanes.feet_work_j[i], lanes.load_work_j[i] = sums.feet_work_j, sums.load_work_j
    lanes.damping_lost_j[i], lanes.position_m_s[i] = sums.damping_lost_j, sums.position_m_s


@kernel
def begin_stretch(
    lanes: Record,
    i: int,
    plant: Record,
    state: Record,
    start_v: float,
    rate_v_per_s: float,
    stretch_s: float,
) -> None:
    """Let the drive of a lane go along a straight stretch of the voltage."""
    lanes.start_v[i] = lanes.voltage_v[i] = start_v
    lanes.stretch_s[i] = lanes.left_s[i] = stretch_s
    lanes.rate_v_per_s[i], lanes.foot_m_per_s[i] = rate_v_per_s, plant.gain_m_per_v * rate_v_per_s
    lanes.longest_s[i] = longest_on_slope(plant, rate_v_per_s)
    lanes.passes_left[i] = state.passes_left


@kernel
def end_stretch(lanes: Record, i: int, plant: Record, state: Record) -> None:
    """Let a drive be where its lane has come to."""
    voltage_v = lanes.start_v[i] + lanes.rate_v_per_s[i] * (lanes.stretch_s[i] - lanes.left_s[i])
    state.voltage_v = clamp(plant, voltage_v)
    state.foot_m, state.position_m = lanes.foot_m[i], lanes.position_m[i]
    state.velocity_m_per_s, state.contact_n = lanes.velocity_m_per_s[i], lanes.contact_n[i]
    sums = state.sums
    sums.feet_work_j, sums.load_work_j = lanes.feet_work_j[i], lanes.load_work_j[i]
    sums.damping_lost_j, sums.position_m_s = lanes.damping_lost_j[i], lanes.position_m_s[i]
    state.passes_made += state.passes_left - lanes.passes_left[i]
    state.passes_left = lanes.passes_left[i]


@kernel
def longest_on_slope(plant: Record, rate_v_per_s: float) -> float:
    """Return the longest step along a straight voltage that the feet follow in proportion, s."""
    falls = abs(rate_v_per_s) >= plant.slew_v_per_s
    longest_s = plant.dt_s / SLEW_REFINEMENT if falls else plant.dt_s
    foot_m_per_s = plant.gain_m_per_v * abs(rate_v_per_s)
    travel_m = plant.contacts[ALL].curve.limit_m / SLOPE_STEPS_MIN
    return longest_s if foot_m_per_s * longest_s <= travel_m else travel_m / foot_m_per_s


@kernel
def long_steps(lanes: Record, drives: Any) -> None:
    """Let every drive, a tuple of plants, states and more, step until a stiffness jumps."""
    look_ahead(lanes, drives)
    swing(lanes, drives)
    arrive(lanes, drives)


@kernel
def look_ahead(lanes: Record, drives: Any) -> None:
    """Find what pulls and holds the runners in this step, and how long it is."""
    for i in range(len(lanes.h_s)):
        left_s, longest_s = lanes.left_s[i], lanes.longest_s[i]
        h_s = longest_s if left_s >= 2.0 * longest_s else 0.5 * left_s
        lanes.h_s[i] = h_s = h_s if left_s > longest_s * (1.0 + STEP_SLACK) else left_s
        others_n = lanes.load_n[i] - lanes.contact_n[i]
        others_n = others_n - lanes.cell_n_per_m[i] * lanes.position_m[i] - lanes.wall_n[i]
        drag_n = lanes.damping_n_s_per_m[i] * lanes.foot_m_per_s[i]
        pull = (others_n - drag_n) * lanes.per_kg[i]
        speed = lanes.velocity_m_per_s[i] - lanes.foot_m_per_s[i]
        speeding = pull - lanes.gamma[i] * speed
        lanes.pull[i], lanes.speed[i], lanes.speeding[i] = pull, speed, speeding
        lanes.rests[i] = abs(speed) < RESTING * abs(speeding) * h_s
    for i in range(len(lanes.h_s)):
        if lanes.runs[i]:
            find_branch(lanes, i, drives[i][0][0], drives[i][1][0])
    for i in range(len(lanes.h_s)):
        speed, speeding, h_s = lanes.speed[i], lanes.speeding[i], lanes.h_s[i]
        held_n_per_m, gamma, sense = lanes.held_n_per_m[i], lanes.gamma[i], lanes.sense[i]
        pull_rate = -held_n_per_m * lanes.foot_m_per_s[i] * lanes.per_kg[i]
        omega_squared = (held_n_per_m + lanes.tangent[i]) * lanes.per_kg[i]
        lanes.pull_rate[i], lanes.omega_squared[i] = pull_rate, omega_squared
        lanes.jerk[i] = pull_rate - omega_squared * speed - gamma * speeding
        turns = (lanes.rests[i] == 0) & (speed * speeding < 0.0)
        turns = turns & (abs(speed) <= 2.1 * h_s * abs(speeding))
        gap_m = lanes.reach_m[i] - sense * (lanes.u_m[i] - lanes.origin_m[i])
        closes = gap_m < h_s * (sense * speed + 0.5 * h_s * (sense * speeding))
        lanes.may_be_cut[i] = turns | closes | (lanes.walled[i] != 0)
    for i in range(len(lanes.h_s)):
        if lanes.may_be_cut[i] and lanes.runs[i]:
            cut_step(lanes, i, drives[i][0][0])


@kernel
def find_branch(lanes: Record, i: int, plant: Record, state: Record) -> None:
    """Note the branch that lies ahead, its tangent, and what holds the runner besides."""
    curve, memory = plant.contacts[ALL].curve, state.contacts[ALL].memory
    direction = lanes.speeding[i] if lanes.rests[i] else lanes.speed[i]
    if plant.track.on:
        arrest(plant, state, ALL, direction)
    ahead = branch_towards(curve, memory, direction)
    lanes.tangent[i] = stiffness_on(curve, ahead, lanes.u_m[i])
    lanes.origin_m[i], lanes.force_n[i] = ahead.origin_m, ahead.force_n
    lanes.sense[i], lanes.reach_m[i] = ahead.sense, ahead.reach_m
    lanes.fold[i], lanes.unfold[i] = ahead.fold, ahead.unfold
    lanes.held_n_per_m[i] = lanes.cell_n_per_m[i]
    if plant.walls.exist:
        state.position_m, state.velocity_m_per_s = lanes.position_m[i], lanes.velocity_m_per_s[i]
        lanes.held_n_per_m[i] = holding_stiffness(plant, state, lanes.speeding[i], lanes.h_s[i])


@kernel
def cut_step(lanes: Record, i: int, plant: Record) -> None:
    """End the step where sliding turns, a loop closes or a wall is met, if that is within it."""
    speed, speeding, jerk, h_s = lanes.speed[i], lanes.speeding[i], lanes.jerk[i], lanes.h_s[i]
    omega_squared, gamma = lanes.omega_squared[i], lanes.gamma[i]
    if not lanes.rests[i] and speed * speeding < 0.0:
        snap = -omega_squared * speeding - gamma * jerk
        crackle = -omega_squared * jerk - gamma * snap
        h_s = time_to_turn(speed, speeding, jerk, snap, crackle, h_s)
    h_s = time_to_close(_branch(lanes, i), lanes.u_m[i], speed, speeding, h_s)
    if plant.walls.exist:
        position_m, speed_m_per_s = lanes.position_m[i], lanes.velocity_m_per_s[i]
        h_s = time_to_wall(plant, position_m, speed_m_per_s, speeding, jerk, h_s)
    lanes.h_s[i] = h_s


@kernel
def _branch(lanes: Record, i: int) -> Branch:
    """Return the branch that lies ahead."""
    origin_m, force_n, sense = lanes.origin_m[i], lanes.force_n[i], lanes.sense[i]
    return Branch(origin_m, force_n, sense, lanes.fold[i], lanes.unfold[i], lanes.reach_m[i])


@kernel
def swing(lanes: Record, drives: Any) -> None:
    """Let the runners swing on the tangents, in two half steps, and look up what these miss."""
    for i in range(len(lanes.h_s)):
        speed, pull, pull_rate = lanes.speed[i], lanes.pull[i], lanes.pull_rate[i]
        h_s, omega_squared = lanes.h_s[i], lanes.omega_squared[i]
        half = propagator(omega_squared, lanes.gamma[i], 0.5 * h_s)
        y_middle = speed * half.impulse + pull * half.step + pull_rate * half.ramp
        w_middle = speed * half.velocity + pull * half.impulse + pull_rate * half.step
        pull = pull + pull_rate * 0.5 * h_s - omega_squared * y_middle
        y_end = y_middle + w_middle * half.impulse + pull * half.step + pull_rate * half.ramp
        w_end = w_middle * half.velocity + pull * half.impulse + pull_rate * half.step
        lanes.y_middle[i], lanes.w_middle[i] = y_middle, w_middle
        lanes.y_end[i], lanes.w_end[i] = y_end, w_end
        lanes.impulse[i], lanes.decay[i] = half.impulse, half.velocity
        lanes.middle_m[i] = lanes.position_m[i] + 0.5 * h_s * lanes.foot_m_per_s[i] + y_middle
    for i in range(len(lanes.h_s)):
        if lanes.runs[i]:
            plant, memory = drives[i][0][0], drives[i][1][0].contacts[ALL].memory
            middle_m, curve = lanes.u_m[i] + lanes.y_middle[i], plant.contacts[ALL].curve
            lanes.middle_n[i] = force_ahead(curve, memory, _branch(lanes, i), middle_m)
            if plant.walls.exist:
                missed_n = missed_by_walls(
                    plant, lanes.held_n_per_m[i], lanes.position_m[i], lanes.middle_m[i]
                )
                lanes.missed_by_walls[i] = missed_n * plant.per_kg


@kernel
def arrive(lanes: Record, drives: Any) -> None:
    """Bring runners, feet and contacts to the end of the step, and book it."""
    for i in range(len(lanes.h_s)):
        h_s, y_middle = lanes.h_s[i], lanes.y_middle[i]
        missed_n = lanes.middle_n[i] - lanes.contact_n[i] - lanes.tangent[i] * y_middle
        missed_middle = missed_n * lanes.per_kg[i] + lanes.missed_by_walls[i]
        y_end = lanes.y_end[i] - 4.0 * SIXTH * h_s * lanes.impulse[i] * missed_middle
        voltage_v = lanes.voltage_v[i] + lanes.rate_v_per_s[i] * h_s
        foot_m = lanes.gain_m_per_v[i] * (voltage_v - lanes.rest_v[i])
        position_m = foot_m + lanes.u_m[i] + y_end
        lanes.missed_middle[i], lanes.y_end[i] = missed_middle, y_end
        lanes.w_middle[i] -= (SIXTH * h_s) * missed_middle
        lanes.voltage_v[i] = voltage_v
        mean_m = (lanes.position_m[i] + 4.0 * lanes.middle_m[i] + position_m) * SIXTH
        lanes.position_m_s[i] += mean_m * h_s
        lanes.load_work_j[i] += lanes.load_n[i] * (position_m - lanes.position_m[i])
        lanes.next_m[i], lanes.next_foot_m[i] = position_m, foot_m
    for i in range(len(lanes.h_s)):
        if lanes.runs[i]:
            plant, memory = drives[i][0][0], drives[i][1][0].contacts[ALL].memory
            next_m = lanes.next_m[i]
            move(plant.contacts[ALL].curve, memory, next_m - lanes.next_foot_m[i])
            lanes.u_m[i], lanes.end_n[i] = memory.u_m, memory.force_n
            if plant.walls.exist:
                lanes.wall_n[i] = wall_force(plant, next_m)
                missed_n = missed_by_walls(
                    plant, lanes.held_n_per_m[i], lanes.position_m[i], next_m
                )
                lanes.missed_by_walls[i] = missed_n * plant.per_kg
    for i in range(len(lanes.h_s)):
        h_s, before_n, end_n = lanes.h_s[i], lanes.contact_n[i], lanes.end_n[i]
        missed_n = end_n - before_n - lanes.tangent[i] * lanes.y_end[i]
        missed = missed_n * lanes.per_kg[i] + lanes.missed_by_walls[i]
        missed = 4.0 * lanes.decay[i] * lanes.missed_middle[i] + missed
        w_end = lanes.w_end[i] - (SIXTH * h_s) * missed
        v_0, v_1 = lanes.velocity_m_per_s[i], lanes.foot_m_per_s[i] + w_end
        v_half = lanes.foot_m_per_s[i] + lanes.w_middle[i]
        mean_square = (v_0 * v_0 + 4.0 * v_half * v_half + v_1 * v_1) * SIXTH
        lanes.damping_lost_j[i] += lanes.damping_n_s_per_m[i] * mean_square * h_s
        mean_n = (before_n + 4.0 * lanes.middle_n[i] + end_n) * SIXTH
        lanes.feet_work_j[i] -= mean_n * (lanes.next_foot_m[i] - lanes.foot_m[i])
        lanes.foot_m[i], lanes.position_m[i] = lanes.next_foot_m[i], lanes.next_m[i]
        lanes.velocity_m_per_s[i], lanes.contact_n[i] = v_1, end_n
        left_s = lanes.left_s[i]
        lanes.left_s[i] = left_s - h_s if h_s < left_s else 0.0
        lanes.passes_left[i] -= 1


@kernel
def time_to_turn(
    speed: float, speeding: float, jerk: float, snap: float, crackle: float, longest_s: float
) -> float:
    """
    Return when the sliding velocity comes to zero, s; the longest time if it does not.

    It is given with its derivatives, the first of which slows it down.

    """
    time_s = -speed / speeding
    if time_s > 2.0 * longest_s:
        return longest_s
    for _ in range(_NEWTON_STEPS):
        t = time_s
        value = speed + t * (
            speeding + t * (0.5 * jerk + t * (SIXTH * snap + t * 0.25 * SIXTH * crackle))
        )
        slope = speeding + t * (jerk + t * (0.5 * snap + t * SIXTH * crackle))
        time_s -= value / slope
    return max(time_s, RESTING * longest_s) if 0.0 < time_s < longest_s else longest_s


@kernel
def time_to_close(
    branch: Branch, u_m: float, speed: float, speeding: float, longest_s: float
) -> float:
    """Return when the loop ahead closes, s; the longest time if it does not, or does at once."""
    gap_m = branch.reach_m - branch.sense * (u_m - branch.origin_m)
    speed, speeding = branch.sense * speed, branch.sense * speeding
    if gap_m >= longest_s * (speed + 0.5 * longest_s * speeding) or speed <= 0.0:
        return longest_s
    time_s = gap_m / speed
    return time_s if RESTING * longest_s < time_s < longest_s else longest_s
