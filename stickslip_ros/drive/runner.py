# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The runner in a stride: m x'' = -k x - c x' + F_r + F_ext (Eq. 20).

Its springs are a load cell, attached or touched, and end stops.

"""

import math

from stickslip_ros.drive.oscillator import (
    SIXTH,
    add_at_end,
    add_in_middle,
    add_loss_at_end,
    add_loss_in_middle,
    swing_twice,
)
from stickslip_ros.drive.stride import way_after
from stickslip_ros.kernels.kernel import kernel
from stickslip_ros.kernels.record import Record

RESTING = 1e-3
"""Smallest share of a step that is resolved. A sliding velocity below this share of its change in
the step counts as rest, a loop that closes within this share closes at once, and a wall within
this share of the way counts as touched."""


@kernel
def cell_force(plant: Record, position_m: float) -> float:
    """
    Return the static force in the load cell, N: k x if attached, k (x - gap) if pressed.

    A swinging load button changes this force.

    """
    force_n = plant.cell_n_per_m * position_m
    if plant.walls.exist:
        force_n += plant.walls.cell_n_per_m * max(position_m - plant.walls.gap_m, 0.0)
    if plant.button.exists:
        force_n += plant.button.n_per_m * max(position_m - plant.button.gap_m, 0.0)
    return force_n


@kernel
def stops_force(plant: Record, position_m: float) -> float:
    """Return the force in the end stops, N; positive at the upper one."""
    walls = plant.walls
    pressed_m = max(position_m - walls.high_m, 0.0) + min(position_m - walls.low_m, 0.0)
    return walls.stop_n_per_m * pressed_m


@kernel
def wall_force(plant: Record, position_m: float) -> float:
    """Return the force in all one-sided springs, N."""
    pressed_m = max(position_m - plant.walls.gap_m, 0.0)
    return plant.walls.cell_n_per_m * pressed_m + stops_force(plant, position_m)


@kernel
def cell_energy(plant: Record, position_m: float) -> float:
    """Return the elastic energy of the load cell, J."""
    pressed_m = max(position_m - plant.walls.gap_m, 0.0)
    one_sided_j = 0.5 * plant.walls.cell_n_per_m * pressed_m * pressed_m
    return 0.5 * plant.cell_n_per_m * position_m * position_m + one_sided_j


@kernel
def stops_energy(plant: Record, position_m: float) -> float:
    """Return the elastic energy of the end stops, J."""
    if plant.walls.stop_n_per_m == 0.0:
        return 0.0
    force_n = stops_force(plant, position_m)
    return 0.5 * force_n * force_n / plant.walls.stop_n_per_m


@kernel
def force_on_runner(plant: Record, position_m: float, contact_n: float, load_n: float) -> float:
    """Return the force of load cell, end stops, contacts and external load, without damping, N."""
    force_n = load_n - contact_n - plant.cell_n_per_m * position_m
    if plant.walls.exist:
        force_n -= wall_force(plant, position_m)
    return force_n


@kernel
def holding_stiffness(plant: Record, state: Record, speeding: float, h_s: float) -> float:
    """Return the stiffness of load cell and walls on the runner in a step, N/m."""
    held_n_per_m, walls = plant.cell_n_per_m, plant.walls
    if walls.exist:
        way_m = h_s * (state.velocity_m_per_s + 0.5 * h_s * speeding)
        position_m = state.position_m + RESTING * way_m
        pressed_n_per_m = walls.cell_n_per_m if position_m > walls.gap_m else 0.0
        if position_m > walls.high_m or position_m < walls.low_m:
            pressed_n_per_m += walls.stop_n_per_m
        held_n_per_m += pressed_n_per_m
    return held_n_per_m


@kernel
def time_to_wall(
    plant: Record,
    position_m: float,
    speed: float,
    speeding: float,
    jerk: float,
    longest_s: float,
) -> float:
    """Return the time at which the runner meets or leaves a wall, s, or the longest time."""
    way_m = longest_s * (speed + 0.5 * longest_s * speeding)
    sense = 1.0 if way_m >= 0.0 else -1.0
    gap_m, touched_m = math.inf, RESTING * abs(way_m)
    for place_m in (plant.walls.gap_m, plant.walls.low_m, plant.walls.high_m):
        ahead_m = sense * (place_m - position_m)
        if touched_m < ahead_m < gap_m:
            gap_m = ahead_m
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
    """Return the wall force beyond the force of the stiffness at the start of a step, N."""
    grown_n = wall_force(plant, to_m) - wall_force(plant, from_m)
    return grown_n - (held_n_per_m - plant.cell_n_per_m) * (to_m - from_m)


@kernel
def feel(plant: Record, state: Record, stride: Record) -> None:
    """Compute the inverse mass that moves with the runner, and its acceleration; 0 if stuck."""
    runner, per_kg = stride.runner, 0.0 if plant.stuck else plant.per_kg
    stride.per_kg = per_kg = per_kg / (1.0 + stride.others_kg * per_kg)
    force_n = force_on_runner(plant, state.position_m, state.contact_n, stride.load_n)
    stride.pull = runner.pull = (force_n + stride.others_n) * per_kg
    runner.gamma = (plant.damping_n_s_per_m + stride.others_n_s_per_m) * per_kg
    runner.speed = state.velocity_m_per_s
    runner.speeding = runner.pull - runner.gamma * runner.speed


@kernel
def look_ahead(plant: Record, state: Record, stride: Record) -> None:
    """Compute the stiffness on the runner, its acceleration with all damping, and its rate."""
    runner = stride.runner
    runner.gamma += plant.loss_s * stride.tangent * stride.per_kg
    drag_along(plant, stride)
    runner.speeding = runner.pull - runner.gamma * runner.speed
    stride.held_n_per_m = holding_stiffness(plant, state, runner.speeding, stride.longest_s)
    held_n_per_m = stride.held_n_per_m + stride.others_n_per_m + stride.tangent
    runner.omega_squared = held_n_per_m * stride.per_kg
    runner.jerk = runner.pull_rate - runner.omega_squared * runner.speed
    runner.jerk = runner.jerk - runner.gamma * runner.speeding


@kernel
def drag_along(plant: Record, stride: Record) -> None:
    """Compute the contact force of feet and frame on a runner at rest, and its rates."""
    tangent, driven, pulled, sway = stride.tangent, stride.driven, stride.pulled, stride.sway
    stride.drive.speed = driven * pulled.speed + tangent * sway.speed
    stride.drive.speeding = driven * pulled.speeding + tangent * sway.speeding
    stride.runner.pull = stride.pull + plant.loss_s * stride.drive.speed * stride.per_kg
    rate_n_per_s = stride.drive.speed + plant.loss_s * stride.drive.speeding
    stride.runner.pull_rate = rate_n_per_s * stride.per_kg
    stride.runner.pull_jerk = stride.drive.speeding * stride.per_kg


@kernel
def cut(plant: Record, state: Record, stride: Record) -> None:
    """Shorten the stride to the time at which the runner meets or leaves a wall."""
    runner, lasts_s = stride.runner, stride.lasts_s
    if plant.walls.exist:
        stride.lasts_s = time_to_wall(
            plant, state.position_m, runner.speed, runner.speeding, runner.jerk, lasts_s
        )


@kernel
def swing(plant: Record, _state: Record, stride: Record) -> None:
    """Move the runner exactly on the stiffness ahead."""
    drag_along(plant, stride)
    swing_twice(stride.runner, 0.5 * stride.lasts_s)


@kernel
def pass_middle(plant: Record, state: Record, stride: Record) -> None:
    """Correct the motion by the forces of contacts and walls in the middle."""
    runner, h_s = stride.runner, stride.lasts_s
    curved = missed_acceleration(state, stride, runner.middle_m, 0.5 * h_s)
    add_in_middle(runner, -(curved + of_walls(plant, state, stride, runner.middle_m)), h_s)
    add_loss_in_middle(runner, -curved, plant.loss_s)


@kernel
def missed_acceleration(state: Record, stride: Record, way_m: float, time_s: float) -> float:
    """Return the acceleration by the contacts that their stiffness does not give, m/s^2."""
    missed_n = state.contact_n - stride.before_n - stride.tangent * way_m
    missed_n = missed_n + stride.driven * way_after(stride.pulled, time_s)
    return (missed_n + stride.tangent * way_after(stride.sway, time_s)) * stride.per_kg


@kernel
def of_walls(plant: Record, state: Record, stride: Record, way_m: float) -> float:
    """Return the acceleration by the walls that their stiffness does not give, m/s^2."""
    if not plant.walls.exist:
        return 0.0
    start_m = state.position_m
    walls_n = missed_by_walls(plant, stride.held_n_per_m, start_m, start_m + way_m)
    return walls_n * stride.per_kg


@kernel
def arrive(plant: Record, state: Record, stride: Record) -> None:
    """Correct the motion at the end, add the integrals, move runner and mean foot to the end."""
    runner, start_m, h_s = stride.runner, state.position_m, stride.lasts_s
    curved = missed_acceleration(state, stride, runner.end_m, h_s)
    add_at_end(runner, -(curved + of_walls(plant, state, stride, runner.end_m)), h_s)
    add_loss_at_end(runner, -curved, plant.loss_s)
    end_m, speed = start_m + runner.end_m, runner.end_m_per_s
    middle_m, middle_m_per_s = start_m + runner.middle_m, runner.middle_m_per_s
    book(plant, state, h_s, stride.load_n, end_m, speed, middle_m, middle_m_per_s)
    state.foot_m += way_after(stride.path, h_s)
    state.position_m, state.velocity_m_per_s = end_m, speed


@kernel
def book(
    plant: Record,
    state: Record,
    h_s: float,
    load_n: float,
    position_m: float,
    velocity_m_per_s: float,
    middle_m: float,
    middle_m_per_s: float,
) -> None:
    """Add a step to all integrals except the work of the feet, by Simpson's rule."""
    sums = state.sums
    v_0, v_half, v_1 = state.velocity_m_per_s, middle_m_per_s, velocity_m_per_s
    mean_square = (v_0 * v_0 + 4.0 * v_half * v_half + v_1 * v_1) * SIXTH
    mean_m = (state.position_m + 4.0 * middle_m + position_m) * SIXTH
    sums.load_work_j += load_n * (position_m - state.position_m)
    sums.damping_lost_j += plant.damping_n_s_per_m * mean_square * h_s
    sums.position_m_s += mean_m * h_s
