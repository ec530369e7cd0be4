"""
Kernel: the frame that carries the feet, a body on a damped spring between table and contacts.

M Y'' = F - k y - c y' with y = Y - r x_s: Y is the displacement of the centre of mass of frame and
feet, y that of the frame, x_s that of the mean foot against the frame, r the share of the feet in
the mass M of both, and F the force with which the contacts drag the feet along. Written for y it
has the term -r M x_s'' instead, which is infinite at each corner of the voltage.

"""

from typing import NamedTuple

from stickslip_ros.contact.kernel import kernel
from stickslip_ros.contact.record import Record
from stickslip_ros.drive.feet import Path, bends, mean_place, way_on
from stickslip_ros.drive.oscillator import SIXTH, Halves, swing_twice


class Sway(NamedTuple):
    """Displacement of the frame, m, its velocity, m/s, and acceleration, m/s^2."""

    frame_m: float
    speed: float
    speeding: float


@kernel
def sway_of(plant: Record, state: Record, mean: Path) -> Sway:
    """Return how the frame moves now, under a mean foot that goes on in a way."""
    frame = plant.frame
    if not frame.exists:
        return Sway(0.0, 0.0, 0.0)
    frame_m = frame_place(plant, state)
    speed = state.centre_m_per_s - frame.feet_share * mean.speed
    force_n = state.contact_n - holding_force(frame, frame_m, speed)
    return Sway(frame_m, speed, force_n * frame.per_kg - frame.feet_share * mean.speeding)


@kernel
def frame_place(plant: Record, state: Record) -> float:
    """Return the displacement of the frame against the table, m; 0 of a rigid one."""
    if not plant.frame.exists:
        return 0.0
    return state.centre_m - plant.frame.feet_share * mean_place(plant, state)


@kernel
def holding_force(frame: Record, frame_m: float, speed: float) -> float:
    """Return the force with which the table holds the frame back, N."""
    return frame.held_n_per_m * frame_m + frame.damping_n_s_per_m * speed


@kernel
def centre_ahead(
    plant: Record, state: Record, mean: Path, sway: Sway, n_per_s: float, half_s: float
) -> Halves:
    """Return the way of the centre of mass while the force of the contacts grows at a rate."""
    frame = plant.frame
    if not frame.exists:
        return Halves(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    share = frame.feet_share
    omega_squared, gamma = (
        frame.held_n_per_m * frame.per_kg,
        frame.damping_n_s_per_m * frame.per_kg,
    )
    speed = state.centre_m_per_s
    pull = sway.speeding + share * mean.speeding + gamma * speed
    rate = n_per_s * frame.per_kg + share * (omega_squared * mean.speed + gamma * mean.speeding)
    jerk = share * omega_squared * mean.speeding
    return swing_twice(omega_squared, gamma, half_s, speed, pull, rate, jerk)


@kernel
def frame_after(plant: Record, sway: Sway, mean: Path, centre_m: float, time_s: float) -> float:
    """Return the displacement of the frame when its centre of mass has gone a way, m."""
    return sway.frame_m + centre_m - plant.frame.feet_share * way_on(mean, time_s)


@kernel
def move_frame(
    plant: Record,
    state: Record,
    mean: Path,
    sway: Sway,
    centre: Halves,
    centre_m_per_s: float,
    h_s: float,
    before_n: float,
    middle_n: float,
) -> None:
    """
    Move the frame by a step, with the forces of the contacts before it and in its middle.

    Energy is booked by Simpson's rule: what its damping loses, and the work that the feet do as
    the table holds back a part of what accelerates them; stacks that bend do theirs elsewhere.

    """
    frame, half_s = plant.frame, 0.5 * h_s
    share, work_w, square = frame.feet_share, 0.0, 0.0
    for weight, time_s, centre_m, centre_w, contact_n in (
        (1.0, 0.0, 0.0, state.centre_m_per_s, before_n),
        (4.0, half_s, centre.middle_m, centre.middle_m_per_s, middle_n),
        (1.0, h_s, centre.end_m, centre_m_per_s, state.contact_n),
    ):
        foot_speed = mean.speed + time_s * mean.speeding
        speed = centre_w - share * foot_speed
        frame_m = frame_after(plant, sway, mean, centre_m, time_s)
        work_w += weight * foot_speed * (contact_n - holding_force(frame, frame_m, speed))
        square += weight * speed * speed
    if not bends(plant):
        state.sums.feet_work_j += SIXTH * h_s * share * work_w
    state.sums.stand_lost_j += SIXTH * h_s * frame.damping_n_s_per_m * square
    state.centre_m += centre.end_m
    state.centre_m_per_s = centre_m_per_s


@kernel
def frame_energy(plant: Record, state: Record) -> float:
    """Return the energy of the motion of the centre of mass, and of the spring of the frame, J."""
    frame, frame_m = plant.frame, frame_place(plant, state)
    motion_j = frame.mass_kg * state.centre_m_per_s * state.centre_m_per_s
    return 0.5 * (motion_j + frame.held_n_per_m * frame_m * frame_m)
