"""
Kernel: the load button, the moving mass of a load cell on which the runner presses from one side.

m_c z'' + c_c z' + k z = push of the runner. Apart, the button swings freely. Where the runner
meets it there is an impact; pressed, both are one body until the push would become a pull.

"""

import math
from typing import NamedTuple

from stickslip_ros.contact.kernel import kernel
from stickslip_ros.contact.record import Record
from stickslip_ros.drive.long_step import RESTING, time_to_turn
from stickslip_ros.drive.oscillator import SIXTH, propagator


class Body(NamedTuple):
    """What moves as the runner: inverse mass, viscous damping, stiffness behind the button."""

    per_kg: float
    damping_n_s_per_m: float
    button_n_per_m: float


@kernel
def body_of(plant: Record, state: Record) -> Body:
    """Return the runner alone or with the button; one that is stuck has no inverse mass."""
    button, per_kg = plant.button, 0.0 if plant.stuck else plant.per_kg
    if not state.pressed:
        return Body(per_kg, plant.damping_n_s_per_m, 0.0)
    damping_n_s_per_m = plant.damping_n_s_per_m + button.damping_n_s_per_m
    return Body(per_kg / (1.0 + button.mass_kg * per_kg), damping_n_s_per_m, button.n_per_m)


@kernel
def meet_button(plant: Record, state: Record, force_n: float, longest_s: float) -> None:
    """Let runner and button part or meet, under the force on the runner without damping."""
    button, per_kg = plant.button, 0.0 if plant.stuck else plant.per_kg
    speed = state.velocity_m_per_s
    if state.pressed:
        body = body_of(plant, state)
        whole_n = force_n - button.n_per_m * state.button_m - body.damping_n_s_per_m * speed
        push_n = button.n_per_m * state.button_m + button.damping_n_s_per_m * speed
        state.pressed = push_n + button.mass_kg * whole_n * body.per_kg > 0.0
        return
    closing = speed - state.button_m_per_s
    gap_m = button.gap_m + state.button_m - state.position_m
    if closing <= 0.0 or gap_m > RESTING * longest_s * closing:
        return
    before_j = _motion_energy(plant, state)
    per_impulse = per_kg + 1.0 / button.mass_kg
    impulse = (1.0 + button.restitution) * closing / per_impulse
    speed -= impulse * per_kg
    own_speed = state.button_m_per_s + impulse / button.mass_kg
    own_n = button.n_per_m * state.button_m + button.damping_n_s_per_m * own_speed
    pressing = (force_n - plant.damping_n_s_per_m * speed) * per_kg + own_n / button.mass_kg
    # A bounce that would be over within a step is none.
    if pressing > 0.0 and 2.0 * (own_speed - speed) <= pressing * longest_s:
        impulse = (speed - own_speed) / per_impulse
        speed -= impulse * per_kg
        own_speed += impulse / button.mass_kg
        state.button_m, state.pressed = state.position_m - button.gap_m, True
    state.velocity_m_per_s, state.button_m_per_s = speed, own_speed
    state.sums.stand_lost_j += before_j - _motion_energy(plant, state)


@kernel
def _motion_energy(plant: Record, state: Record) -> float:
    runner_j = plant.mass_kg * state.velocity_m_per_s * state.velocity_m_per_s
    button_j = plant.button.mass_kg * state.button_m_per_s * state.button_m_per_s
    return 0.5 * (runner_j + button_j)


@kernel
def time_to_meet(
    plant: Record, state: Record, speeding: float, jerk: float, longest_s: float
) -> float:
    """Return when runner and button meet or part, s; the longest time if they do not."""
    button, speed, place_m = plant.button, state.velocity_m_per_s, state.button_m
    stiffness, damping, mass_kg = button.n_per_m, button.damping_n_s_per_m, button.mass_kg
    if state.pressed:
        push_n = stiffness * place_m + damping * speed + mass_kg * speeding
        rate = stiffness * speed + damping * speeding + mass_kg * jerk
        if rate >= 0.0 or push_n <= 0.0:
            return longest_s
        return time_to_turn(
            push_n, rate, stiffness * speeding + damping * jerk, 0.0, 0.0, longest_s
        )
    own = -(stiffness * place_m + damping * state.button_m_per_s) / mass_kg
    jerk += (stiffness * state.button_m_per_s + damping * own) / mass_kg
    closing, closing_rate = speed - state.button_m_per_s, speeding - own
    gap_m = button.gap_m + place_m - state.position_m
    root = math.sqrt(max(closing * closing + 2.0 * closing_rate * gap_m, 0.0))
    if gap_m > longest_s * (closing + 0.5 * longest_s * closing_rate):
        return longest_s
    time_s = (root - closing) / closing_rate if closing < 0.0 else 2.0 * gap_m / (closing + root)
    slope = closing + time_s * (closing_rate + 0.5 * time_s * jerk)
    if slope > 0.0:
        way_m = time_s * (closing + 0.5 * time_s * (closing_rate + 2.0 * SIXTH * time_s * jerk))
        time_s -= (way_m - gap_m) / slope
    return time_s if RESTING * longest_s < time_s < longest_s else longest_s


@kernel
def move_button(
    plant: Record, state: Record, h_s: float, position_m: float, speed: float, middle_speed: float
) -> None:
    """Move the button by a step, with a runner that comes to a position and a speed."""
    button = plant.button
    if state.pressed:
        square = state.velocity_m_per_s * state.velocity_m_per_s + speed * speed
        square += 4.0 * middle_speed * middle_speed
        state.sums.stand_lost_j += SIXTH * h_s * button.damping_n_s_per_m * square
        state.button_m, state.button_m_per_s = position_m - button.gap_m, speed
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
