# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Kernel: the frame that carries the feet, a mass on a damped spring.

M Y'' = F - k y - c y' with y = Y - r x_s: Y is the displacement of the centre of mass of frame and
feet, y that of the frame, x_s that of the mean foot against the frame, r the share of the feet in
the mass M of both, and F the force of the contacts on the feet. An equation for y would have the
term -r M x_s'', which is infinite at each corner of the voltage.

"""

from stickslip_ros.drive.feet import active_contacts, bends, in_mean, mean_place, way_of
from stickslip_ros.drive.oscillator import SIXTH, add_at_end, add_in_middle, swing_twice
from stickslip_ros.drive.stride import way_after
from stickslip_ros.kernels.kernel import kernel
from stickslip_ros.kernels.record import Record


@kernel
def feel(plant: Record, state: Record, stride: Record) -> None:
    """Compute position, velocity and acceleration of the frame from the motion of the feet."""
    frame, feet, sway = plant.frame, stride.feet, stride.sway
    if not frame.exists:
        return
    feet.speed = feet.speeding = 0.0
    for k in active_contacts(plant):
        speed, speeding = way_of(plant, state, stride, k)
        feet.speed += in_mean(plant, k, speed)
        feet.speeding += in_mean(plant, k, speeding)
    stride.frame_m = frame_place(plant, state)
    sway.speed = state.centre_m_per_s - frame.feet_share * feet.speed
    force_n = state.contact_n + stride.lag_n - holding_force(frame, stride.frame_m, sway.speed)
    sway.speeding = force_n * frame.per_kg - frame.feet_share * feet.speeding


@kernel
def frame_place(plant: Record, state: Record) -> float:
    """Return the displacement of the frame against the table, m; 0 if it is rigid."""
    if not plant.frame.exists:
        return 0.0
    return state.centre_m - plant.frame.feet_share * mean_place(plant, state)


@kernel
def holding_force(frame: Record, frame_m: float, speed: float) -> float:
    """Return the force of spring and damper between table and frame, N."""
    return frame.held_n_per_m * frame_m + frame.damping_n_s_per_m * speed


@kernel
def jerk_of_frame(plant: Record, stride: Record) -> float:
    """Return the rate of the frame's acceleration, m/s^3; 0 if it is rigid."""
    n_per_s = stride.tangent * stride.runner.speed - stride.drive.speed
    n_per_s -= holding_force(plant.frame, stride.sway.speed, stride.sway.speeding)
    return n_per_s * plant.frame.per_kg


@kernel
def frame_speed(plant: Record, stride: Record, centre_m_per_s: float, time_s: float) -> float:
    """Return the velocity of the frame after a time of the stride, m/s; 0 if it is rigid."""
    foot_speed = stride.feet.speed + time_s * stride.feet.speeding
    return centre_m_per_s - plant.frame.feet_share * foot_speed


@kernel
def swing(plant: Record, state: Record, stride: Record) -> None:
    """Move the centre of mass exactly under a linearly growing contact force."""
    frame, feet, centre, half_s = plant.frame, stride.feet, stride.centre, 0.5 * stride.lasts_s
    stride.grows_n_per_s = stride.tangent * stride.runner.speed - stride.drive.speed
    if not frame.exists:
        return
    share, omega_squared = frame.feet_share, frame.held_n_per_m * frame.per_kg
    gamma, speed = frame.damping_n_s_per_m * frame.per_kg, state.centre_m_per_s
    rate = omega_squared * feet.speed + gamma * feet.speeding
    centre.omega_squared, centre.gamma, centre.speed = omega_squared, gamma, speed
    centre.pull = stride.sway.speeding + share * feet.speeding + gamma * speed
    centre.pull_rate = stride.grows_n_per_s * frame.per_kg + share * rate
    centre.pull_jerk = share * omega_squared * feet.speeding
    swing_twice(centre, half_s)
    stride.frame_middle_m = stride.frame_m + centre.middle_m - share * way_after(feet, half_s)


@kernel
def pass_middle(plant: Record, _state: Record, stride: Record) -> None:
    """Correct the motion by the contact force in the middle."""
    frame, centre, h_s = plant.frame, stride.centre, stride.lasts_s
    if not frame.exists:
        return
    missed_n = stride.middle_n - stride.before_n - 0.5 * h_s * stride.grows_n_per_s
    missed_n += stride.middle_lag_n - stride.start_lag_n
    add_in_middle(centre, missed_n * frame.per_kg, h_s)
    feet_m = frame.feet_share * way_after(stride.feet, h_s)
    stride.frame_end_m = stride.frame_m + centre.end_m - feet_m


@kernel
def arrive(plant: Record, state: Record, stride: Record) -> None:
    """
    Move the frame to the end of the stride.

    The damping loss and the work of the feet on the frame are added by Simpson's rule; the work
    of bending stacks is added elsewhere.

    """
    frame, feet, centre, h_s = plant.frame, stride.feet, stride.centre, stride.lasts_s
    if not frame.exists:
        return
    missed_n = state.contact_n - stride.before_n - h_s * stride.grows_n_per_s
    missed_n += stride.lag_n - stride.start_lag_n
    add_at_end(centre, missed_n * frame.per_kg, h_s)
    share, work_w, square = frame.feet_share, 0.0, 0.0
    start_n, middle_n = stride.before_n + stride.start_lag_n, stride.middle_n + stride.middle_lag_n
    for weight, time_s, frame_m, centre_w, contact_n in (
        (1.0, 0.0, stride.frame_m, centre.speed, start_n),
        (4.0, 0.5 * h_s, stride.frame_middle_m, centre.middle_m_per_s, middle_n),
        (1.0, h_s, stride.frame_end_m, centre.end_m_per_s, state.contact_n + stride.lag_n),
    ):
        foot_speed = feet.speed + time_s * feet.speeding
        speed = frame_speed(plant, stride, centre_w, time_s)
        work_w += weight * foot_speed * (contact_n - holding_force(frame, frame_m, speed))
        square += weight * speed * speed
    if not bends(plant):
        state.sums.feet_work_j += SIXTH * h_s * share * work_w
    state.sums.stand_lost_j += SIXTH * h_s * frame.damping_n_s_per_m * square
    state.centre_m += centre.end_m
    state.centre_m_per_s = centre.end_m_per_s


@kernel
def frame_energy(plant: Record, state: Record) -> float:
    """Return kinetic energy of the centre of mass plus spring energy of the frame, J."""
    frame, frame_m = plant.frame, frame_place(plant, state)
    motion_j = frame.mass_kg * state.centre_m_per_s * state.centre_m_per_s
    return 0.5 * (motion_j + frame.held_n_per_m * frame_m * frame_m)
