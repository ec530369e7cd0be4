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

import math
from typing import Any

from stickslip_ros.contact.kernel import kernel, kernel_apart, on_stack
from stickslip_ros.contact.memory import Branch, branch_towards, force_ahead, move, stiffness_on
from stickslip_ros.contact.record import COUNT, FLOAT, Kind, Record, kind
from stickslip_ros.drive.feet import arrest
from stickslip_ros.drive.ledger import in_step
from stickslip_ros.drive.oscillator import SIXTH, propagator
from stickslip_ros.drive.records import ALL
from stickslip_ros.drive.runner import (
    next_wall,
    pull_on_runner,
    wall_force,
    wall_stiffness,
)

LANES = 8
"""Drives that go together: with four it takes twice the time, with more no less."""
RESTING = 1e-3
"""A sliding velocity below this share of what the step will add to it is no motion yet, a loop
that closes within this share of the step closes at once, and a wall in this share of the way of
the step has been met."""
NEWTON_STEPS = 1
"""One is enough: with three the worst error of 120 cases changes in its eleventh digit."""
STEP_SLACK = 1e-9
"""Share of a step by which a stretch may exceed a whole number of steps, for rounding."""


def lanes_kind(lanes: int) -> Kind:
    """Return the type of what steps of so many drives need at hand; each field has their lanes."""
    each, counts = (FLOAT, (lanes,)), (COUNT, (lanes,))
    return kind(
        runs=counts,  # Whether there is a drive that goes on
        # What a step needs of the plant and the load; damping over mass, 1/s
        per_kg=each,
        damping_n_s_per_m=each,
        gamma=each,
        cell_n_per_m=each,
        gain_m_per_v=each,
        rest_v=each,
        walled=counts,
        load_n=each,
        # What it changes of the state; force of the walls
        voltage_v=each,
        foot_m=each,
        position_m=each,
        velocity_m_per_s=each,
        u_m=each,
        contact_n=each,
        wall_n=each,
        feet_work_j=each,
        load_work_j=each,
        damping_lost_j=each,
        position_m_s=each,
        passes_left=counts,
        # The stretch: its slope, longest step, length, what is left of it; its start, what the
        # amplifier is told there, when it catches up
        rate_v_per_s=each,
        longest_s=each,
        stretch_s=each,
        left_s=each,
        start_v=each,
        target_v=each,
        slope_v_per_s=each,
        caught_s=each,
        # What is left of the sample; samples begun
        remaining_s=each,
        samples=counts,
        # The step: its length, whether it may be cut; sliding of the runner against the feet,
        # velocity and acceleration; acceleration by all but damping of the sliding and change of
        # the contact force, and its growth; stiffness of cell and walls
        h_s=each,
        may_be_cut=counts,
        rests=counts,
        speed=each,
        speeding=each,
        pull=each,
        pull_rate=each,
        held_n_per_m=each,
        jerk=each,
        # Tangent and branch ahead
        tangent=each,
        omega_squared=each,
        origin_m=each,
        force_n=each,
        sense=each,
        fold=each,
        unfold=each,
        reach_m=each,
        # Sliding and its velocity in the middle and at the end; half a step's response
        y_middle=each,
        w_middle=each,
        y_end=each,
        w_end=each,
        impulse=each,
        decay=each,
        # Places of runner and feet in the middle and at the end
        middle_m=each,
        next_m=each,
        next_foot_m=each,
        # Force of the contacts there; acceleration that tangent and walls miss
        middle_n=each,
        end_n=each,
        missed_middle=each,
        missed_by_walls=each,
    )


one_lane, all_lanes = on_stack(lanes_kind(1)), on_stack(lanes_kind(LANES))


@kernel
def enter_lane(lanes: Record, i: int, plant: Record, state: Record, load_n: float) -> None:
    """Put a drive into a lane, between two stretches."""
    gamma = plant.damping_n_s_per_m * plant.per_kg
    lanes.runs[i] = 1
    lanes.per_kg[i], lanes.damping_n_s_per_m[i], lanes.gamma[i] = (
        plant.per_kg,
        plant.damping_n_s_per_m,
        gamma,
    )
    lanes.cell_n_per_m[i], lanes.walled[i] = plant.cell_n_per_m, plant.walls.exist
    lanes.gain_m_per_v[i], lanes.rest_v[i] = plant.gain_m_per_v, plant.rest_v
    lanes.load_n[i], lanes.voltage_v[i], lanes.foot_m[i] = load_n, state.voltage_v, state.foot_m
    lanes.position_m[i], lanes.velocity_m_per_s[i] = state.position_m, state.velocity_m_per_s
    lanes.u_m[i], lanes.contact_n[i] = state.contacts[ALL].memory.u_m, state.contact_n
    if plant.walls.exist:
        lanes.wall_n[i] = wall_force(plant, state.position_m)
    sums = state.sums
    lanes.feet_work_j[i], lanes.load_work_j[i] = sums.feet_work_j, sums.load_work_j
    lanes.damping_lost_j[i], lanes.position_m_s[i] = sums.damping_lost_j, sums.position_m_s


@kernel
def begin_stretch(
    lanes: Record,
    i: int,
    state: Record,
    start_v: float,
    rate_v_per_s: float,
    longest_s: float,
    stretch_s: float,
) -> None:
    """Let the drive of a lane go along a straight stretch of the voltage."""
    lanes.start_v[i] = lanes.voltage_v[i] = start_v
    lanes.rate_v_per_s[i], lanes.longest_s[i] = rate_v_per_s, longest_s
    lanes.stretch_s[i] = lanes.left_s[i] = stretch_s
    lanes.passes_left[i] = state.passes_left


@kernel
def end_stretch(lanes: Record, i: int, state: Record, voltage_v: float) -> None:
    """Give a drive at the end of its stretch what it has become; the voltage is clamped."""
    lanes.voltage_v[i] = state.voltage_v = voltage_v
    state.foot_m, state.position_m = lanes.foot_m[i], lanes.position_m[i]
    state.velocity_m_per_s, state.contact_n = lanes.velocity_m_per_s[i], lanes.contact_n[i]
    sums = state.sums
    sums.feet_work_j, sums.load_work_j = lanes.feet_work_j[i], lanes.load_work_j[i]
    sums.damping_lost_j, sums.position_m_s = lanes.damping_lost_j[i], lanes.position_m_s[i]
    state.passes_made += state.passes_left - lanes.passes_left[i]
    state.passes_left = lanes.passes_left[i]


@kernel
def long_steps(lanes: Record, plants: Any, states: Any) -> None:
    """Let every drive take one step, until a stiffness jumps, along its stretch."""
    drives = range(len(lanes.h_s))
    _slide(lanes)
    for i in drives:
        if lanes.runs[i]:
            _look_ahead(lanes, i, plants[i][0], states[i][0])
    _may_be_cut(lanes)
    for i in drives:
        if lanes.may_be_cut[i] and lanes.runs[i]:
            _cut(lanes, i, plants[i][0])
    _oscillate(lanes)
    for i in drives:
        if lanes.runs[i]:
            _look_up_middle(lanes, i, plants[i][0], states[i][0])
    _go(lanes)
    for i in drives:
        if lanes.runs[i]:
            _move_contact(lanes, i, plants[i][0], states[i][0])
    _arrive(lanes)


@kernel
def _slide(lanes: Record) -> None:
    """Note how the runner slides against the feet, what pulls it, and the longest step."""
    for i in range(len(lanes.h_s)):
        left_s, longest_s = lanes.left_s[i], lanes.longest_s[i]
        h_s = longest_s if left_s >= 2.0 * longest_s else 0.5 * left_s
        lanes.h_s[i] = h_s = h_s if left_s > longest_s * (1.0 + STEP_SLACK) else left_s
        foot_m_per_s = lanes.gain_m_per_v[i] * lanes.rate_v_per_s[i]
        others_n = pull_on_runner(
            lanes.cell_n_per_m[i], lanes.position_m[i], lanes.contact_n[i], lanes.load_n[i]
        )
        drag_n = lanes.damping_n_s_per_m[i] * foot_m_per_s
        pull = (others_n - lanes.wall_n[i] - drag_n) * lanes.per_kg[i]
        speed = lanes.velocity_m_per_s[i] - foot_m_per_s
        speeding = pull - lanes.gamma[i] * speed
        lanes.pull[i], lanes.speed[i], lanes.speeding[i] = pull, speed, speeding
        lanes.rests[i] = abs(speed) < RESTING * abs(speeding) * h_s


@kernel
def _look_ahead(lanes: Record, i: int, plant: Record, state: Record) -> None:
    """Note the branch that lies ahead, its tangent, and what holds the runner besides."""
    curve, memory = plant.contacts[ALL].curve, state.contacts[ALL].memory
    direction = lanes.speeding[i] if lanes.rests[i] else lanes.speed[i]
    if plant.track.on:
        arrest(plant, state, ALL, direction)
    branch = branch_towards(curve, memory, direction)
    lanes.tangent[i] = stiffness_on(curve, branch, lanes.u_m[i])
    lanes.origin_m[i], lanes.force_n[i], lanes.sense[i] = (
        branch.origin_m,
        branch.force_n,
        branch.sense,
    )
    lanes.fold[i], lanes.unfold[i], lanes.reach_m[i] = branch.fold, branch.unfold, branch.reach_m
    lanes.held_n_per_m[i] = lanes.cell_n_per_m[i]
    if plant.walls.exist:
        way_m = lanes.h_s[i] * (lanes.velocity_m_per_s[i] + 0.5 * lanes.h_s[i] * lanes.speeding[i])
        place_m = lanes.position_m[i] + RESTING * way_m
        lanes.held_n_per_m[i] += wall_stiffness(plant, place_m)


@kernel
def _may_be_cut(lanes: Record) -> None:
    """Note whether the step may have to end early: sliding turns, a loop closes, a wall is met."""
    for i in range(len(lanes.h_s)):
        speed, speeding, h_s, sense = (
            lanes.speed[i],
            lanes.speeding[i],
            lanes.h_s[i],
            lanes.sense[i],
        )
        foot_m_per_s = lanes.gain_m_per_v[i] * lanes.rate_v_per_s[i]
        pull_rate = -lanes.held_n_per_m[i] * foot_m_per_s * lanes.per_kg[i]
        omega_squared = (lanes.held_n_per_m[i] + lanes.tangent[i]) * lanes.per_kg[i]
        lanes.pull_rate[i], lanes.omega_squared[i] = pull_rate, omega_squared
        lanes.jerk[i] = pull_rate - omega_squared * speed - lanes.gamma[i] * speeding
        turns = (lanes.rests[i] == 0) & (speed * speeding < 0.0)
        turns = turns & (abs(speed) <= 2.1 * h_s * abs(speeding))
        gap_m = lanes.reach_m[i] - sense * (lanes.u_m[i] - lanes.origin_m[i])
        closes = gap_m < h_s * (sense * speed + 0.5 * h_s * (sense * speeding))
        lanes.may_be_cut[i] = turns | closes | (lanes.walled[i] != 0)


@kernel_apart
def _cut(lanes: Record, i: int, plant: Record) -> None:
    """End the step where the stiffness jumps."""
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
    return Branch(
        lanes.origin_m[i],
        lanes.force_n[i],
        lanes.sense[i],
        lanes.fold[i],
        lanes.unfold[i],
        lanes.reach_m[i],
    )


@kernel
def _oscillate(lanes: Record) -> None:
    """Note sliding and its velocity in the middle and at the end: two half steps."""
    for i in range(len(lanes.h_s)):
        speed, pull, pull_rate, h_s = (
            lanes.speed[i],
            lanes.pull[i],
            lanes.pull_rate[i],
            lanes.h_s[i],
        )
        omega_squared = lanes.omega_squared[i]
        half = propagator(omega_squared, lanes.gamma[i], 0.5 * h_s)
        y_middle = speed * half.impulse + pull * half.step + pull_rate * half.ramp
        w_middle = speed * half.velocity + pull * half.impulse + pull_rate * half.step
        pull_middle = pull + pull_rate * 0.5 * h_s - omega_squared * y_middle
        y_end = (
            y_middle + w_middle * half.impulse + pull_middle * half.step + pull_rate * half.ramp
        )
        w_end = w_middle * half.velocity + pull_middle * half.impulse + pull_rate * half.step
        lanes.y_middle[i], lanes.w_middle[i], lanes.y_end[i], lanes.w_end[i] = (
            y_middle,
            w_middle,
            y_end,
            w_end,
        )
        lanes.impulse[i], lanes.decay[i] = half.impulse, half.velocity
        foot_m_per_s = lanes.gain_m_per_v[i] * lanes.rate_v_per_s[i]
        lanes.middle_m[i] = lanes.position_m[i] + 0.5 * h_s * foot_m_per_s + y_middle


@kernel
def _look_up_middle(lanes: Record, i: int, plant: Record, state: Record) -> None:
    """Note the force in the middle, and what walls do that were not met where expected."""
    curve, memory = plant.contacts[ALL].curve, state.contacts[ALL].memory
    middle_m = lanes.u_m[i] + lanes.y_middle[i]
    lanes.middle_n[i] = force_ahead(curve, memory, _branch(lanes, i), middle_m)
    if plant.walls.exist:
        lanes.missed_by_walls[i] = missed_by_walls(
            plant, lanes.held_n_per_m[i], lanes.position_m[i], lanes.middle_m[i]
        )


@kernel
def _go(lanes: Record) -> None:
    """Note where runner and feet are at the end."""
    for i in range(len(lanes.h_s)):
        h_s, y_middle = lanes.h_s[i], lanes.y_middle[i]
        missed_n = lanes.middle_n[i] - lanes.contact_n[i] - lanes.tangent[i] * y_middle
        missed_middle = missed_n * lanes.per_kg[i] + lanes.missed_by_walls[i]
        y_end = lanes.y_end[i] - 4.0 * SIXTH * h_s * lanes.impulse[i] * missed_middle
        voltage_v = lanes.voltage_v[i] + lanes.rate_v_per_s[i] * h_s
        foot_m = lanes.gain_m_per_v[i] * (voltage_v - lanes.rest_v[i])
        position_m = foot_m + lanes.u_m[i] + y_end
        lanes.missed_middle[i], lanes.y_end[i], lanes.voltage_v[i] = (
            missed_middle,
            y_end,
            voltage_v,
        )
        lanes.next_m[i], lanes.next_foot_m[i] = position_m, foot_m


@kernel
def _move_contact(lanes: Record, i: int, plant: Record, state: Record) -> None:
    """Move the contact to the end, and note its force and that of the walls."""
    memory = state.contacts[ALL].memory
    move(plant.contacts[ALL].curve, memory, lanes.next_m[i] - lanes.next_foot_m[i])
    lanes.u_m[i], lanes.end_n[i] = memory.u_m, memory.force_n
    if plant.walls.exist:
        lanes.wall_n[i] = wall_force(plant, lanes.next_m[i])
        lanes.missed_by_walls[i] = missed_by_walls(
            plant, lanes.held_n_per_m[i], lanes.position_m[i], lanes.next_m[i]
        )


@kernel
def _arrive(lanes: Record) -> None:
    """Book the step, and let its end be the start of the next one."""
    for i in range(len(lanes.h_s)):
        h_s, missed_middle = lanes.h_s[i], lanes.missed_middle[i]
        before_n, middle_n, end_n = lanes.contact_n[i], lanes.middle_n[i], lanes.end_n[i]
        missed_n = end_n - before_n - lanes.tangent[i] * lanes.y_end[i]
        missed_end = missed_n * lanes.per_kg[i] + lanes.missed_by_walls[i]
        foot_m_per_s = lanes.gain_m_per_v[i] * lanes.rate_v_per_s[i]
        w_end = lanes.w_end[i] - (SIXTH * h_s) * (
            4.0 * lanes.decay[i] * missed_middle + missed_end
        )
        w_middle = lanes.w_middle[i] - (SIXTH * h_s) * missed_middle
        velocity_m_per_s = foot_m_per_s + w_end
        mean_n = (before_n + 4.0 * middle_n + end_n) * SIXTH
        load_work_j, damping_lost_j, position_m_s = in_step(
            h_s, lanes.load_n[i], lanes.damping_n_s_per_m[i],
            lanes.position_m[i], lanes.middle_m[i], lanes.next_m[i],
            lanes.velocity_m_per_s[i], foot_m_per_s + w_middle, velocity_m_per_s,
        )  # fmt: skip
        lanes.feet_work_j[i] -= mean_n * (lanes.next_foot_m[i] - lanes.foot_m[i])
        lanes.load_work_j[i] += load_work_j
        lanes.damping_lost_j[i] += damping_lost_j
        lanes.position_m_s[i] += position_m_s
        lanes.foot_m[i], lanes.position_m[i] = lanes.next_foot_m[i], lanes.next_m[i]
        lanes.velocity_m_per_s[i], lanes.contact_n[i] = velocity_m_per_s, end_n
        left_s = lanes.left_s[i]
        lanes.left_s[i] = left_s - h_s if h_s < left_s else 0.0
        lanes.passes_left[i] -= 1


@kernel
def holding_stiffness(plant: Record, state: Record, speeding: float, h_s: float) -> float:
    """Return the stiffness with which load cell and walls hold the runner in a step, N/m."""
    held_n_per_m = plant.cell_n_per_m
    if plant.walls.exist:
        way_m = h_s * (state.velocity_m_per_s + 0.5 * h_s * speeding)
        held_n_per_m += wall_stiffness(plant, state.position_m + RESTING * way_m)
    return held_n_per_m


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
    for _ in range(NEWTON_STEPS):
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
    time_s -= (time_s * (speed + 0.5 * time_s * speeding) - gap_m) / (speed + time_s * speeding)
    return time_s if RESTING * longest_s < time_s < longest_s else longest_s


@kernel
def time_to_wall(
    plant: Record,
    position_m: float,
    speed: float,
    speeding: float,
    jerk: float,
    longest_s: float,
) -> float:
    """Return when the runner meets or leaves a wall, s; the longest time if it does not."""
    way_m = longest_s * (speed + 0.5 * longest_s * speeding)
    sense = 1.0 if way_m >= 0.0 else -1.0
    gap_m = sense * (next_wall(plant, position_m + RESTING * way_m, sense) - position_m)
    if gap_m >= sense * way_m:
        return longest_s
    speed, speeding, jerk = sense * speed, sense * speeding, sense * jerk
    time_s = 2.0 * gap_m / (speed + math.sqrt(max(speed * speed + 2.0 * speeding * gap_m, 0.0)))
    slope = speed + time_s * (speeding + 0.5 * time_s * jerk)
    if slope > 0.0:
        way_m = time_s * (speed + 0.5 * time_s * (speeding + SIXTH * 2.0 * time_s * jerk))
        time_s -= (way_m - gap_m) / slope
    return time_s if RESTING * longest_s < time_s < longest_s else longest_s


@kernel
def missed_by_walls(plant: Record, held_n_per_m: float, from_m: float, to_m: float) -> float:
    """Return the acceleration by walls that their stiffness at the start of a step misses."""
    grown_n = wall_force(plant, to_m) - wall_force(plant, from_m)
    return (grown_n - (held_n_per_m - plant.cell_n_per_m) * (to_m - from_m)) * plant.per_kg
