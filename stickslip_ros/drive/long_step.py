# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Kernel: long step of one or several drives on the memory of turning points.

The stiffness of the contacts is known at the start of a step: it is the tangent of the branch
ahead. With it the runner is a damped oscillator with an exactly known motion. The curvature of the
branch is small; its force is evaluated in the middle and at the end of the step and added by
Simpson's rule. A step ends at a reversal of the sliding, at the closing of a loop, or at a wall,
where the stiffness jumps; these times are computed beforehand.

The step has fourth order, moves the contact once, and never goes back in time.

A step is a long chain of dependent sums. So several drives go in parallel lanes: common
computations are loops that a processor does for four lanes at a time, and tables and turning
points are evaluated lane by lane. Each drive gets the same bits as alone.

"""

import math
from typing import Any

from stickslip_ros.contact.laws import MDR, bristles_after, bristles_towards
from stickslip_ros.contact.memory import Branch, branch_towards, force_ahead, move, stiffness_on
from stickslip_ros.contact.reaction import react_by_law
from stickslip_ros.contact.springs import friction_limit
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
from stickslip_ros.kernels.record import COUNT, FLOAT, Record, RecordKind, kind

LANES = 8
"""Drives computed together: 4 would take the same time, 16 twice the time. `run_in_lanes` never
passes more."""
_NEWTON_STEPS = 1
"""Newton's steps to a reversal: with three the worst error of 120 cases changes in digit 11."""
STEP_SLACK = 1e-9
"""Rounding of the number of steps in a stretch."""
SLEW_REFINEMENT = 64
"""Factor by which steps are shorter during a fall: the feet cross the whole presliding range in
two microseconds, and their work is an integral over that range."""
SLOPE_STEPS_MIN = 6.0
"""Least number of long steps in which feet on a steep slope cross the presliding range."""

_COUNTS = 'runs may_be_cut rests walled passes_left samples row'
FLOATS = (
    # Plant and load; gamma is damping per mass, 1/s
    'per_kg damping_n_s_per_m loss_s gamma cell_n_per_m gain_m_per_v rest_v load_n '
    # Stretch; remaining time of the sample
    'rate_v_per_s foot_m_per_s longest_s stretch_s left_s '
    'start_v target_v slope_v_per_s caught_s remaining_s '
    # State, as in STATE, and the force of the walls
    'voltage_v foot_m position_m velocity_m_per_s u_m contact_n wall_n '
    'feet_work_j load_work_j damping_lost_j sticking_lost_j position_m_s '
    # Step: velocity and acceleration of the sliding; acceleration without damping of the sliding
    # and without the change of the contact force, and its rate
    'h_s speed speeding pull pull_rate jerk held_n_per_m omega_squared tangent '
    # Branch ahead
    'origin_m force_n sense fold unfold reach_m '
    # Sliding, its velocity, position, force, in the middle and at the end; responses of half a
    # step
    'y_middle w_middle y_end w_end middle_m next_m next_foot_m middle_n end_n impulse decay '
    # Acceleration that tangent and walls miss
    'missed_middle missed_by_walls '
    # Force of contacts that lose energy, at the start
    'start_n '
    # Rival law: g sgn(v), its inverse (0 if it changes in a step), z sgn(v)/g, lag, dz/du
    'steady_m per_m bent lag rate '
)


def lanes_kind(lanes: int) -> RecordKind:
    """Return the type of the variables of long steps; each field has an element for each lane."""
    floats = dict.fromkeys(FLOATS.split(), (FLOAT, (lanes,)))
    return kind(**dict.fromkeys(_COUNTS.split(), (COUNT, (lanes,))), **floats)


one_lane, all_lanes = on_stack(lanes_kind(1)), on_stack(lanes_kind(LANES))


@kernel
def enter_lane(lanes: Record, i: int, plant: Record, state: Record, load_n: float) -> None:
    """Copy a drive into a lane, between two stretches."""
    lanes.runs[i], lanes.walled[i] = 1, plant.walls.exist
    lanes.per_kg[i], lanes.damping_n_s_per_m[i] = plant.per_kg, plant.damping_n_s_per_m
    lanes.loss_s[i], lanes.per_m[i] = plant.loss_s, 0.0
    lanes.gamma[i] = plant.damping_n_s_per_m * plant.per_kg
    lanes.cell_n_per_m[i], lanes.load_n[i] = plant.cell_n_per_m, load_n + plant.load_n
    lanes.gain_m_per_v[i], lanes.rest_v[i] = plant.gain_m_per_v, plant.rest_v
    lanes.foot_m[i], lanes.position_m[i] = state.foot_m, state.position_m
    lanes.velocity_m_per_s[i], lanes.contact_n[i] = state.velocity_m_per_s, state.contact_n
    lanes.u_m[i] = state.contacts[ALL].memory.u_m
    if plant.walls.exist:
        lanes.wall_n[i] = wall_force(plant, state.position_m)
    sums = state.sums
    lanes.feet_work_j[i], lanes.load_work_j[i] = sums.feet_work_j, sums.load_work_j
    lanes.damping_lost_j[i], lanes.position_m_s[i] = sums.damping_lost_j, sums.position_m_s
    lanes.sticking_lost_j[i] = sums.sticking_lost_j


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
    """Start a straight stretch of the voltage in a lane."""
    lanes.start_v[i] = lanes.voltage_v[i] = start_v
    lanes.stretch_s[i] = lanes.left_s[i] = stretch_s
    lanes.rate_v_per_s[i], lanes.foot_m_per_s[i] = rate_v_per_s, plant.gain_m_per_v * rate_v_per_s
    lanes.longest_s[i] = longest_on_slope(plant, rate_v_per_s)
    lanes.passes_left[i] = state.passes_left


@kernel
def end_stretch(lanes: Record, i: int, plant: Record, state: Record) -> None:
    """Copy the result of a lane to its drive."""
    voltage_v = lanes.start_v[i] + lanes.rate_v_per_s[i] * (lanes.stretch_s[i] - lanes.left_s[i])
    state.voltage_v = clamp(plant, voltage_v)
    state.foot_m, state.position_m = lanes.foot_m[i], lanes.position_m[i]
    state.velocity_m_per_s, state.contact_n = lanes.velocity_m_per_s[i], lanes.contact_n[i]
    sums = state.sums
    sums.feet_work_j, sums.load_work_j = lanes.feet_work_j[i], lanes.load_work_j[i]
    sums.damping_lost_j, sums.position_m_s = lanes.damping_lost_j[i], lanes.position_m_s[i]
    sums.sticking_lost_j = lanes.sticking_lost_j[i]
    state.passes_made += state.passes_left - lanes.passes_left[i]
    state.passes_left = lanes.passes_left[i]


@kernel
def longest_on_slope(plant: Record, rate_v_per_s: float) -> float:
    """Return the longest step along a straight voltage with proportional feet, s."""
    falls = abs(rate_v_per_s) >= plant.slew_v_per_s
    longest_s = plant.dt_s / SLEW_REFINEMENT if falls else plant.dt_s
    foot_m_per_s = plant.gain_m_per_v * abs(rate_v_per_s)
    travel_m = plant.presliding_m / SLOPE_STEPS_MIN
    return longest_s if foot_m_per_s * longest_s <= travel_m else travel_m / foot_m_per_s


@kernel
def long_steps(lanes: Record, drives: Any, plain: bool) -> None:
    """Advance every drive, a tuple of plants, states and more, until a stiffness jumps."""
    look_ahead(lanes, drives, plain)
    swing(lanes, drives, plain)
    arrive(lanes, drives, plain)


@kernel
def look_ahead(lanes: Record, drives: Any, plain: bool) -> None:
    """Find forces and stiffnesses of the runners in this step, and its length."""
    # Loops without a branch or a table are separate: only these are computed four lanes at a time.
    for i in range(len(lanes.h_s)):
        left_s, longest_s = lanes.left_s[i], lanes.longest_s[i]
        # The last two steps are equal: a short remainder would cost as much as a whole step.
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
            find_branch(lanes, i, drives[i][0][0], drives[i][1][0], plain)
    for i in range(len(lanes.h_s)):
        speed, speeding, h_s = lanes.speed[i], lanes.speeding[i], lanes.h_s[i]
        held_n_per_m, gamma, sense = lanes.held_n_per_m[i], lanes.gamma[i], lanes.sense[i]
        pull_rate = -held_n_per_m * lanes.foot_m_per_s[i] * lanes.per_kg[i]
        omega_squared = (held_n_per_m + lanes.tangent[i]) * lanes.per_kg[i]
        lanes.pull_rate[i], lanes.omega_squared[i] = pull_rate, omega_squared
        lanes.jerk[i] = pull_rate - omega_squared * speed - gamma * speeding
        # A cheap bound, so that most steps skip `cut_step`: wider than the 2.0 of `time_to_turn`.
        turns = (lanes.rests[i] == 0) & (speed * speeding < 0.0)
        turns = turns & (abs(speed) <= 2.1 * h_s * abs(speeding))
        gap_m = lanes.reach_m[i] - sense * (lanes.u_m[i] - lanes.origin_m[i])
        closes = gap_m < h_s * (sense * speed + 0.5 * h_s * (sense * speeding))
        lanes.may_be_cut[i] = turns | closes | (lanes.walled[i] != 0)
    for i in range(len(lanes.h_s)):
        if lanes.may_be_cut[i] and lanes.runs[i]:
            cut_step(lanes, i, drives[i][0][0])


@kernel
def find_branch(lanes: Record, i: int, plant: Record, state: Record, plain: bool) -> None:
    """Store the branch ahead, its tangent, and the stiffness of load cell and walls."""
    contact, memory = plant.contacts[ALL], state.contacts[ALL].memory
    direction = lanes.speeding[i] if lanes.rests[i] else lanes.speed[i]
    if plant.track.on:
        arrest(plant, state, ALL, direction)
    if plain or contact.law.number == MDR:
        ahead = branch_towards(contact.curve, memory, direction)
        lanes.tangent[i] = stiffness_on(contact.curve, ahead, lanes.u_m[i])
    else:
        ahead = Branch(memory.u_m, memory.force_n, memory.sense, 1.0, 1.0, math.inf)
        find_bristles(lanes, i, contact, state.contacts[ALL], direction)
    lanes.origin_m[i], lanes.force_n[i] = ahead.origin_m, ahead.force_n
    lanes.sense[i], lanes.reach_m[i] = ahead.sense, ahead.reach_m
    lanes.fold[i], lanes.unfold[i] = ahead.fold, ahead.unfold
    if not plain and plant.loss_s > 0.0:
        damping_n_s_per_m = plant.damping_n_s_per_m + plant.loss_s * lanes.tangent[i]
        lanes.gamma[i] = damping_n_s_per_m * plant.per_kg
        lanes.speeding[i] = lanes.pull[i] - lanes.gamma[i] * lanes.speed[i]
    lanes.held_n_per_m[i] = lanes.cell_n_per_m[i]
    if plant.walls.exist:
        state.position_m, state.velocity_m_per_s = lanes.position_m[i], lanes.velocity_m_per_s[i]
        lanes.held_n_per_m[i] = holding_stiffness(plant, state, lanes.speeding[i], lanes.h_s[i])


@kernel
def find_bristles(lanes: Record, i: int, contact: Record, own: Record, direction: float) -> None:
    """Store the tangent of a rival law in a direction, and its bristles if they turn."""
    if not lanes.per_m[i] * direction > 0.0:
        limit_n = friction_limit(contact.bank, own.preload_n)
        ahead = bristles_towards(contact.law, limit_n, own.bristle_m, direction)
        lanes.steady_m[i], lanes.bent[i], lanes.lag[i], lanes.rate[i] = ahead
        changes = contact.law.depends_on_rate or own.preload_n != contact.preload_n
        lanes.per_m[i] = 0.0 if changes else 1.0 / lanes.steady_m[i]
    lanes.tangent[i] = contact.law.bristle_n_per_m * max(lanes.rate[i], 0.0)


@kernel
def bend_bristles(lanes: Record, i: int, contact: Record, own: Record, u_m: float) -> None:
    """Move a contact of a rival law by half a step."""
    law, memory, steady_m = contact.law, own.memory, lanes.steady_m[i]
    way = lanes.per_m[i] * (u_m - memory.u_m)
    if way > 0.0:
        after = bristles_after(law, lanes.bent[i], lanes.lag[i], lanes.rate[i], way)
        lanes.bent[i], lanes.lag[i], lanes.rate[i], lost = after
        own.bristle_m = steady_m * lanes.bent[i]
        memory.u_m, memory.force_n = u_m, law.bristle_n_per_m * steady_m * lanes.bent[i]
        memory.lost_j += law.bristle_n_per_m * steady_m * steady_m * lost
    else:
        lanes.per_m[i] = 0.0
        react_by_law(contact, own, u_m, 0.5 * lanes.h_s[i], 0.0)


@kernel
def cut_step(lanes: Record, i: int, plant: Record) -> None:
    """Shorten the step to a reversal of the sliding, the closing of a loop, or a wall."""
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
    """Return the branch ahead of a lane."""
    origin_m, force_n, sense = lanes.origin_m[i], lanes.force_n[i], lanes.sense[i]
    return Branch(origin_m, force_n, sense, lanes.fold[i], lanes.unfold[i], lanes.reach_m[i])


@kernel
def swing(lanes: Record, drives: Any, plain: bool) -> None:
    """Move the runners on the tangents in two half steps; evaluate the contacts in the middle."""
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
            plant, own = drives[i][0][0], drives[i][1][0].contacts[ALL]
            contact, middle_m = plant.contacts[ALL], lanes.u_m[i] + lanes.y_middle[i]
            if plain or contact.law.number == MDR:
                branch = _branch(lanes, i)
                lanes.middle_n[i] = force_ahead(contact.curve, own.memory, branch, middle_m)
            else:
                bend_bristles(lanes, i, contact, own, middle_m)
                lanes.middle_n[i] = own.memory.force_n
            if not plain and plant.loss_s > 0.0:
                _lose_in_middle(lanes, i)
            if plant.walls.exist:
                missed_n = missed_by_walls(
                    plant, lanes.held_n_per_m[i], lanes.position_m[i], lanes.middle_m[i]
                )
                lanes.missed_by_walls[i] = missed_n * plant.per_kg


@kernel
def arrive(lanes: Record, drives: Any, plain: bool) -> None:
    """Move runners, feet and contacts to the end of the step, and add up the integrals."""
    for i in range(len(lanes.h_s)):
        h_s, y_middle = lanes.h_s[i], lanes.y_middle[i]
        missed_n = lanes.middle_n[i] - lanes.contact_n[i] - lanes.tangent[i] * y_middle
        missed_middle = missed_n * lanes.per_kg[i] + lanes.missed_by_walls[i]
        # Simpson's rule on the force beyond the tangent: it is 0 at the start, and at the end it
        # has not moved anything yet.
        y_end = lanes.y_end[i] - 4.0 * SIXTH * h_s * lanes.impulse[i] * missed_middle
        voltage_v = lanes.voltage_v[i] + lanes.rate_v_per_s[i] * h_s
        foot_m = lanes.gain_m_per_v[i] * (voltage_v - lanes.rest_v[i])
        # From feet and sliding, not from the last position, so rounding cannot separate the three.
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
            plant, state, next_m = drives[i][0][0], drives[i][1][0], lanes.next_m[i]
            contact, own = plant.contacts[ALL], state.contacts[ALL]
            memory, end_m = own.memory, next_m - lanes.next_foot_m[i]
            if plain or contact.law.number == MDR:
                move(contact.curve, memory, end_m)
            else:
                bend_bristles(lanes, i, contact, own, end_m)
                state.preload_n = own.preload_n
            lanes.u_m[i], lanes.end_n[i] = memory.u_m, memory.force_n
            if not plain and plant.loss_s > 0.0:
                lanes.start_n[i] = lanes.contact_n[i]
                curved_n = memory.force_n - lanes.start_n[i] - lanes.tangent[i] * lanes.y_end[i]
                lanes.w_end[i] -= plant.loss_s * curved_n * plant.per_kg
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
        # Exactly 0: a rounding remainder would be a step that does not move the clock.
        lanes.left_s[i] = left_s - h_s if h_s < left_s else 0.0
        lanes.passes_left[i] -= 1
        if not plain:
            lanes.w_end[i] = w_end
    for i in range(len(lanes.h_s)):
        if not plain and lanes.loss_s[i] > 0.0:
            _book_loss(lanes, i)


@kernel
def _lose_in_middle(lanes: Record, i: int) -> None:
    """Add the loss by the force beyond the tangent in the middle, as in `add_loss_in_middle`."""
    missed_n = lanes.middle_n[i] - lanes.contact_n[i] - lanes.tangent[i] * lanes.y_middle[i]
    lost = lanes.loss_s[i] * missed_n * lanes.per_kg[i]
    lanes.w_middle[i] -= lost
    lanes.y_end[i] -= 16.0 * SIXTH * lanes.impulse[i] * lost
    lanes.w_end[i] += 16.0 * SIXTH * (1.0 - lanes.decay[i]) * lost


@kernel
def _book_loss(lanes: Record, i: int) -> None:
    """Add the energy lost in sticking contacts, and the work of the feet, as `loss` does."""
    start_n, middle_n, end_n = lanes.start_n[i], lanes.middle_n[i], lanes.contact_n[i]
    lost_w = (4.0 * middle_n - 3.0 * start_n - end_n) * lanes.speed[i]
    lost_w += 4.0 * (end_n - start_n) * lanes.w_middle[i]
    lost_w += (start_n - 4.0 * middle_n + 3.0 * end_n) * lanes.w_end[i]
    lanes.sticking_lost_j[i] += SIXTH * lanes.loss_s[i] * lost_w
    lanes.feet_work_j[i] -= lanes.loss_s[i] * (end_n - start_n) * lanes.foot_m_per_s[i]
    lanes.gamma[i] = lanes.damping_n_s_per_m[i] * lanes.per_kg[i]


@kernel
def time_to_turn(
    speed: float, speeding: float, jerk: float, snap: float, crackle: float, longest_s: float
) -> float:
    """
    Return the time of zero sliding velocity, s, or the longest time.

    The arguments are the velocity and its derivatives; the first derivative decelerates.

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
    """Return the time at which the loop ahead closes, s; the longest time if never or at once."""
    gap_m = branch.reach_m - branch.sense * (u_m - branch.origin_m)
    speed, speeding = branch.sense * speed, branch.sense * speeding
    if gap_m >= longest_s * (speed + 0.5 * longest_s * speeding) or speed <= 0.0:
        return longest_s
    time_s = gap_m / speed
    return time_s if RESTING * longest_s < time_s < longest_s else longest_s
