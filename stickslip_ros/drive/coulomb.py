# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Kernel: Coulomb's law; the runner rests on its feet or slides at the friction limit."""

import math

from stickslip_ros.contact.springs import friction_limit
from stickslip_ros.drive.contacts import move_contacts
from stickslip_ros.drive.long_step import time_to_turn
from stickslip_ros.drive.oscillator import propagator
from stickslip_ros.drive.records import ALL
from stickslip_ros.drive.runner import (
    RESTING,
    book,
    force_on_runner,
    holding_stiffness,
    time_to_wall,
)
from stickslip_ros.drive.stride import way_after
from stickslip_ros.kernels.kernel import noinline_kernel
from stickslip_ros.kernels.record import Record


@noinline_kernel
def take_rigid_stride(plant: Record, state: Record, stride: Record) -> None:
    """Move the runner with the feet, or let it slide at the friction limit."""
    path, load_n, longest_s = stride.path, stride.load_n, stride.longest_s
    per_kg = 0.0 if plant.stuck else plant.per_kg
    damping, start_m, speed = plant.damping_n_s_per_m, state.position_m, state.velocity_m_per_s
    limit_n = friction_limit(plant.contacts[ALL].bank, state.preload_n)
    others_n = force_on_runner(plant, start_m, 0.0, load_n)
    holding_n = others_n - damping * path.speed - plant.mass_kg * path.speeding
    against = speed - path.speed
    rests = abs(against) <= RESTING * limit_n * per_kg * longest_s and not plant.stuck
    h_s = longest_s
    foot_m = way_after(path, h_s)
    if rests and abs(holding_n) <= limit_n:
        pull_n = holding_n
        way_m, end_speed = foot_m, path.speed + h_s * path.speeding
        held_n_per_m = holding_stiffness(plant, state, path.speeding, h_s)
        end_n = holding_n - held_n_per_m * foot_m - damping * (end_speed - path.speed)
    else:
        pull_n = end_n = math.copysign(limit_n, holding_n if rests else against)
        gamma = damping * per_kg
        pull = force_on_runner(plant, start_m, pull_n, load_n) * per_kg
        speeding = pull - gamma * speed
        omega_squared = holding_stiffness(plant, state, speeding, h_s) * per_kg
        against_rate = speeding - path.speeding
        jerk = -omega_squared * speed - gamma * speeding
        snap = -omega_squared * speeding - gamma * jerk
        if against * against_rate < 0.0 and not rests:
            h_s = time_to_turn(against, against_rate, jerk, snap, 0.0, longest_s)
        if plant.walls.exist:
            h_s = time_to_wall(plant, start_m, speed, speeding, jerk, h_s)
        foot_m = way_after(path, h_s)
        whole = propagator(omega_squared, gamma, h_s)
        way_m = speed * whole.impulse + pull * whole.step
        end_speed = speed * whole.velocity + pull * whole.impulse
    position_m = start_m + way_m
    stride.lasts_s, stride.holding_n = h_s, end_n
    move_contacts(plant, state, stride, way_m, 0.0, h_s)
    state.sums.feet_work_j -= 0.5 * (pull_n + state.contact_n) * foot_m
    middle_m = start_m + 0.5 * way_m - 0.125 * h_s * (end_speed - speed)
    middle_speed = 1.5 * way_m / h_s - 0.25 * (speed + end_speed)
    book(plant, state, h_s, load_n, position_m, end_speed, middle_m, middle_speed)
    state.foot_m += foot_m
    state.position_m, state.velocity_m_per_s = position_m, end_speed
