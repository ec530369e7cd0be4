"""The runner: one step of m x'' = -k x - c x' + F_r + F_ext (Eq. 20), by velocity Verlet."""

from stickslip_ros.contact.kernel import kernel
from stickslip_ros.contact.record import Record
from stickslip_ros.drive.walls import wall_force


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
