"""
The runner and the springs that it meets: m x'' = -k x - c x' + F_r + F_ext (Eq. 20).

A load cell, fixed or touched, and end stops. Short steps are those of velocity Verlet.

"""

from stickslip_ros.contact.kernel import in_python, kernel
from stickslip_ros.contact.record import Record
from stickslip_ros.drive.records import ALL

MARGIN_STEPS = 4.0
"""A wall is near if the runner could reach it in so many long steps."""


@kernel
def cell_force(plant: Record, position_m: float) -> float:
    """Return the force in the load cell, N: k x where it is fixed, k (x - gap) where pressed."""
    force_n = plant.cell_n_per_m * position_m
    if plant.walls.exist:
        force_n += plant.walls.cell_n_per_m * max(position_m - plant.walls.gap_m, 0.0)
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


def cell_energy(plant: Record, position_m: float) -> float:
    """Return the elastic energy of the load cell, J."""
    pressed_m = max(position_m - plant.walls.gap_m, 0.0)
    one_sided_j = 0.5 * plant.walls.cell_n_per_m * pressed_m * pressed_m
    return float(0.5 * plant.cell_n_per_m * position_m * position_m + one_sided_j)


def stops_energy(plant: Record, position_m: float) -> float:
    """Return the elastic energy of the end stops, J."""
    if plant.walls.stop_n_per_m == 0.0:
        return 0.0
    force_n = in_python(stops_force)(plant, position_m)
    return float(0.5 * force_n * force_n / plant.walls.stop_n_per_m)


@kernel
def is_near_wall(plant: Record, state: Record, load_n: float, h_s: float) -> bool:
    """Return whether a one-sided spring is touched, or could be within a few steps of h_s."""
    force_n = abs(load_n) + plant.contacts[ALL].curve.force_max_n
    force_n += abs(plant.cell_n_per_m * state.position_m)
    reach_m = MARGIN_STEPS * h_s * (abs(state.velocity_m_per_s) + h_s * force_n * plant.per_kg)
    below_m = state.position_m - plant.walls.nearest_low_m
    above_m = plant.walls.nearest_high_m - state.position_m
    return min(below_m, above_m) <= reach_m


@kernel
def force_far_from_walls(
    plant: Record, position_m: float, contact_n: float, load_n: float
) -> float:
    """Return fixed load cell, contacts and external load together, N; damping is apart."""
    return load_n - contact_n - plant.cell_n_per_m * position_m


@kernel
def force_on_runner(plant: Record, position_m: float, contact_n: float, load_n: float) -> float:
    """Return load cell, end stops, contacts and external load together, N; damping is apart."""
    force_n = force_far_from_walls(plant, position_m, contact_n, load_n)
    if plant.walls.exist:
        force_n -= wall_force(plant, position_m)
    return force_n


@kernel
def holding_force(
    plant: Record,
    position_m: float,
    middle_m_per_s: float,
    foot_m_per_s: float,
    load_n: float,
    dt_s: float,
) -> float:
    """Return the contact force with which the runner's next middle velocity is the feet's, N."""
    others_n = force_on_runner(plant, position_m, 0.0, load_n)
    drag_n = plant.damping_n_s_per_m * foot_m_per_s
    return others_n - drag_n + plant.mass_kg * (middle_m_per_s - foot_m_per_s) / dt_s


@kernel
def kick_before(plant: Record, velocity_m_per_s: float, force_n: float, dt_s: float) -> float:
    """Return the velocity in the middle of the step, with the damping of its beginning."""
    if plant.stuck:
        return 0.0
    drag_n = plant.damping_n_s_per_m * velocity_m_per_s
    return velocity_m_per_s + 0.5 * dt_s * (force_n - drag_n) / plant.mass_kg


@kernel
def kick_after(plant: Record, velocity_m_per_s: float, force_n: float, dt_s: float) -> float:
    """Return the velocity at the end of the step, with the damping of its end (implicit)."""
    if plant.stuck:
        return 0.0
    free_m_per_s = velocity_m_per_s + 0.5 * dt_s * force_n / plant.mass_kg
    return free_m_per_s / (1.0 + 0.5 * dt_s * plant.damping_n_s_per_m / plant.mass_kg)
