# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Kernel: the load button, the moving mass of a one-sided load cell.

m_c z'' + c_c z' + k z = push of the runner. Without contact the button swings freely. The runner
meets it in an impact; pressed, both move as one body until the push would become a pull.

"""

import math

from stickslip_ros.drive.long_step import time_to_turn
from stickslip_ros.drive.oscillator import SIXTH, propagator
from stickslip_ros.drive.runner import RESTING, force_on_runner
from stickslip_ros.kernels.kernel import kernel
from stickslip_ros.kernels.record import Record


@kernel
def feel(plant: Record, state: Record, stride: Record) -> None:
    """Compute contact, impact and separation of the button, and its forces on the runner."""
    button = plant.button
    if not button.exists:
        return
    per_kg, longest_s = 0.0 if plant.stuck else plant.per_kg, stride.longest_s
    force_n = force_on_runner(plant, state.position_m, state.contact_n, stride.load_n)
    force_n += stride.others_n
    damping_n_s_per_m = plant.damping_n_s_per_m + stride.others_n_s_per_m
    speed, own_speed = state.velocity_m_per_s, state.button_m_per_s
    gap_m = button.gap_m + state.button_m - state.position_m
    if state.pressed:
        own_n = button.n_per_m * state.button_m
        both_per_kg = per_kg / (1.0 + button.mass_kg * per_kg)
        both_n = force_n - own_n - (damping_n_s_per_m + button.damping_n_s_per_m) * speed
        push_n = own_n + button.damping_n_s_per_m * speed
        state.pressed = push_n + button.mass_kg * both_n * both_per_kg > 0.0
    elif speed > own_speed and gap_m <= RESTING * longest_s * (speed - own_speed):
        before_j = motion_energy(plant, state)
        per_impulse = per_kg + 1.0 / button.mass_kg
        impulse = (1.0 + button.restitution) * (speed - own_speed) / per_impulse
        speed -= impulse * per_kg
        own_speed += impulse / button.mass_kg
        own_n = button.n_per_m * state.button_m + button.damping_n_s_per_m * own_speed
        pressing = (force_n - damping_n_s_per_m * speed) * per_kg + own_n / button.mass_kg
        # No bounce if it would be over within a step.
        if pressing > 0.0 and 2.0 * (own_speed - speed) <= pressing * longest_s:
            impulse = (speed - own_speed) / per_impulse
            speed -= impulse * per_kg
            own_speed += impulse / button.mass_kg
            state.button_m, state.pressed = state.position_m - button.gap_m, True
        state.velocity_m_per_s, state.button_m_per_s = speed, own_speed
        state.sums.stand_lost_j += before_j - motion_energy(plant, state)
    if state.pressed:
        stride.others_kg += button.mass_kg
        stride.others_n_s_per_m += button.damping_n_s_per_m
        stride.others_n_per_m += button.n_per_m
        stride.others_n -= button.n_per_m * state.button_m


@kernel
def motion_energy(plant: Record, state: Record) -> float:
    """Return the kinetic energy of runner and load button, J."""
    runner_j = plant.mass_kg * state.velocity_m_per_s * state.velocity_m_per_s
    button_j = plant.button.mass_kg * state.button_m_per_s * state.button_m_per_s
    return 0.5 * (runner_j + button_j)


@kernel
def cut(plant: Record, state: Record, stride: Record) -> None:
    """Shorten the stride to the time at which runner and button meet or separate."""
    button, place_m, longest_s = plant.button, state.button_m, stride.lasts_s
    if not button.exists:
        return
    speed, speeding, jerk = stride.runner.speed, stride.runner.speeding, stride.runner.jerk
    stiffness, damping, mass_kg = button.n_per_m, button.damping_n_s_per_m, button.mass_kg
    if state.pressed:
        push_n = stiffness * place_m + damping * speed + mass_kg * speeding
        rate = stiffness * speed + damping * speeding + mass_kg * jerk
        if rate < 0.0 < push_n:
            bend = stiffness * speeding + damping * jerk
            stride.lasts_s = time_to_turn(push_n, rate, bend, 0.0, 0.0, longest_s)
        return
    own = -(stiffness * place_m + damping * state.button_m_per_s) / mass_kg
    jerk += (stiffness * state.button_m_per_s + damping * own) / mass_kg
    closing, closing_rate = speed - state.button_m_per_s, speeding - own
    gap_m = button.gap_m + place_m - state.position_m
    if gap_m > longest_s * (closing + 0.5 * longest_s * closing_rate):
        return
    root = math.sqrt(max(closing * closing + 2.0 * closing_rate * gap_m, 0.0))
    time_s = (root - closing) / closing_rate if closing < 0.0 else 2.0 * gap_m / (closing + root)
    slope = closing + time_s * (closing_rate + 0.5 * time_s * jerk)
    if slope > 0.0:
        way_m = time_s * (closing + 0.5 * time_s * (closing_rate + 2.0 * SIXTH * time_s * jerk))
        time_s -= (way_m - gap_m) / slope
    if RESTING * longest_s < time_s < longest_s:
        stride.lasts_s = time_s


@kernel
def arrive(plant: Record, state: Record, stride: Record) -> None:
    """Move the button, and add its damping loss."""
    button, runner, h_s = plant.button, stride.runner, stride.lasts_s
    if not button.exists:
        return
    if state.pressed:
        speed = runner.end_m_per_s
        square = runner.speed * runner.speed + speed * speed
        square += 4.0 * runner.middle_m_per_s * runner.middle_m_per_s
        state.sums.stand_lost_j += SIXTH * h_s * button.damping_n_s_per_m * square
        state.button_m = state.position_m - button.gap_m
        state.button_m_per_s = speed
        return
    place_m, velocity = state.button_m, state.button_m_per_s
    gamma = button.damping_n_s_per_m / button.mass_kg
    swing = propagator(button.n_per_m / button.mass_kg, gamma, h_s)
    pull = -button.n_per_m * place_m / button.mass_kg
    state.button_m = place_m + velocity * swing.impulse + pull * swing.step
    state.button_m_per_s = velocity * swing.velocity + pull * swing.impulse
    before, after = velocity * velocity, state.button_m_per_s * state.button_m_per_s
    lost_j = 0.5 * button.mass_kg * (before - after)
    lost_j += 0.5 * button.n_per_m * (place_m * place_m - state.button_m * state.button_m)
    state.sums.stand_lost_j += lost_j
