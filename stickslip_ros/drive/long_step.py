"""
Kernel: one long step of the drive on the memory of turning points.

The stiffness with which the contacts answer is known at the start of a step: it is the tangent of
the branch that lies ahead. With it the runner is a damped oscillator whose motion is known
exactly. What the tangent misses, the curvature of the branch, is small; it is looked up in the
middle and at the end of the step and enters by Simpson's rule. No step runs past a reversal of the
sliding, the closing of a loop, or a wall, where the stiffness jumps: their times are found
beforehand.

Fourth order, one motion of the contact per step, always forwards in time.

"""

import math
from typing import NamedTuple

from stickslip_ros.contact.kernel import kernel
from stickslip_ros.contact.memory import Branch, branch_towards, force_ahead, move, stiffness_on
from stickslip_ros.contact.record import Record
from stickslip_ros.drive.feet import arrest
from stickslip_ros.drive.ledger import book
from stickslip_ros.drive.oscillator import SIXTH, Propagator, propagator
from stickslip_ros.drive.piezo import foot_displacement
from stickslip_ros.drive.records import ALL
from stickslip_ros.drive.runner import force_on_runner, next_wall, wall_force, wall_stiffness

RESTING = 1e-3
"""A sliding velocity below this share of what the step will add to it is no motion yet, a loop
that closes within this share of the step closes at once, and a wall in this share of the way of
the step has been met."""
NEWTON_STEPS = 1
"""One is enough: with three the worst error of 120 cases changes in its eleventh digit."""


class Slide(NamedTuple):
    """
    The sliding of the runner against the feet at the start of a step.

    Attributes
    ----------
    speed, speeding : float
        Velocity, m/s, and acceleration, m/s^2.
    pull, pull_rate : float
        Acceleration by all but damping of the sliding and change of the contact force, m/s^2,
        and its growth, m/s^3.
    held_n_per_m : float
        Stiffness with which load cell and walls hold the runner in this step.
    gamma : float
        Damping over mass, 1/s.

    """

    speed: float
    speeding: float
    pull: float
    pull_rate: float
    held_n_per_m: float
    gamma: float


@kernel
def long_step(
    plant: Record, state: Record, rate_v_per_s: float, load_n: float, longest_s: float
) -> float:
    """Advance until a stiffness jumps, at most by a given time; return the time, s."""
    curve, memory = plant.contacts[ALL].curve, state.contacts[ALL].memory
    before_n, before_m = state.contact_n, memory.u_m
    foot_m_per_s = plant.gain_m_per_v * rate_v_per_s
    slide = _slide_now(plant, state, foot_m_per_s, load_n, longest_s)

    rests = abs(slide.speed) < RESTING * abs(slide.speeding) * longest_s
    direction = slide.speeding if rests else slide.speed
    if plant.track.on:
        arrest(plant, state, ALL, direction)
    branch = branch_towards(curve, memory, direction)
    tangent = stiffness_on(curve, branch, before_m)
    omega_squared = (slide.held_n_per_m + tangent) * plant.per_kg
    turns = not rests and slide.speed * slide.speeding < 0.0
    jerk = slide.pull_rate - omega_squared * slide.speed - slide.gamma * slide.speeding
    h_s = longest_s
    if turns:
        snap = -omega_squared * slide.speeding - slide.gamma * jerk
        crackle = -omega_squared * jerk - slide.gamma * snap
        h_s = time_to_turn(slide.speed, slide.speeding, jerk, snap, crackle, longest_s)
    h_s = time_to_close(branch, before_m, slide.speed, slide.speeding, h_s)
    if plant.walls.exist:
        speed_m_per_s = state.velocity_m_per_s
        h_s = time_to_wall(plant, state.position_m, speed_m_per_s, slide.speeding, jerk, h_s)

    half = propagator(omega_squared, slide.gamma, 0.5 * h_s)
    y_middle, w_middle, y_end, w_end = _oscillate(slide, omega_squared, half, h_s)

    # What the tangent misses, and a wall that was not met where it was expected.
    middle_n = force_ahead(curve, memory, branch, before_m + y_middle)
    missed_middle = (middle_n - before_n - tangent * y_middle) * plant.per_kg
    middle_m = state.position_m + 0.5 * h_s * foot_m_per_s + y_middle
    if plant.walls.exist:
        missed_middle += missed_by_walls(plant, slide.held_n_per_m, state.position_m, middle_m)
    y_end -= 4.0 * SIXTH * h_s * half.impulse * missed_middle

    voltage_v = state.voltage_v + rate_v_per_s * h_s
    foot_m = foot_displacement(plant, voltage_v)
    position_m = foot_m + before_m + y_end
    move(curve, memory, position_m - foot_m)

    missed_end = (memory.force_n - before_n - tangent * y_end) * plant.per_kg
    if plant.walls.exist:
        missed_end += missed_by_walls(plant, slide.held_n_per_m, state.position_m, position_m)
    w_end -= (SIXTH * h_s) * (4.0 * half.velocity * missed_middle + missed_end)
    w_middle -= (SIXTH * h_s) * missed_middle

    mean_n = (before_n + 4.0 * middle_n + memory.force_n) * SIXTH
    state.sums.feet_work_j -= mean_n * (foot_m - state.foot_m)
    book(
        plant, state, h_s, load_n, position_m, foot_m_per_s + w_end,
        middle_m, foot_m_per_s + w_middle,
    )  # fmt: skip
    state.voltage_v = voltage_v
    state.foot_m = foot_m
    state.position_m = position_m
    state.velocity_m_per_s = foot_m_per_s + w_end
    state.contact_n = memory.force_n
    return h_s


@kernel
def _slide_now(
    plant: Record, state: Record, foot_m_per_s: float, load_n: float, h_s: float
) -> Slide:
    """Return how the runner slides against the feet, and what pulls and holds it."""
    gamma = plant.damping_n_s_per_m * plant.per_kg
    drag_n = plant.damping_n_s_per_m * foot_m_per_s
    others_n = force_on_runner(plant, state.position_m, state.contact_n, load_n)
    pull = (others_n - drag_n) * plant.per_kg
    speed = state.velocity_m_per_s - foot_m_per_s
    speeding = pull - gamma * speed
    held_n_per_m = holding_stiffness(plant, state, speeding, h_s)
    pull_rate = -held_n_per_m * foot_m_per_s * plant.per_kg
    return Slide(speed, speeding, pull, pull_rate, held_n_per_m, gamma)


@kernel
def holding_stiffness(plant: Record, state: Record, speeding: float, h_s: float) -> float:
    """Return the stiffness with which load cell and walls hold the runner in a step, N/m."""
    held_n_per_m = plant.cell_n_per_m
    if plant.walls.exist:
        way_m = h_s * (state.velocity_m_per_s + 0.5 * h_s * speeding)
        held_n_per_m += wall_stiffness(plant, state.position_m + RESTING * way_m)
    return held_n_per_m


@kernel
def _oscillate(
    slide: Slide, omega_squared: float, half: Propagator, h_s: float
) -> tuple[float, float, float, float]:
    """Return sliding and its velocity in the middle and at the end: two half steps."""
    pull, pull_rate = slide.pull, slide.pull_rate
    y_middle = slide.speed * half.impulse + pull * half.step + pull_rate * half.ramp
    w_middle = slide.speed * half.velocity + pull * half.impulse + pull_rate * half.step
    pull_middle = pull + pull_rate * 0.5 * h_s - omega_squared * y_middle
    y_end = y_middle + w_middle * half.impulse + pull_middle * half.step + pull_rate * half.ramp
    w_end = w_middle * half.velocity + pull_middle * half.impulse + pull_rate * half.step
    return y_middle, w_middle, y_end, w_end


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
