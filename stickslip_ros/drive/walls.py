"""Kernel: the springs that the runner meets: the load cell, fixed or touched, and end stops."""

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
    """Tell whether a one-sided spring is touched, or could be within a few steps of h_s."""
    force_n = abs(load_n) + plant.contacts[ALL].curve.force_max_n
    force_n += abs(plant.cell_n_per_m * state.position_m)
    reach_m = MARGIN_STEPS * h_s * (abs(state.velocity_m_per_s) + h_s * force_n * plant.per_kg)
    below_m = state.position_m - plant.walls.nearest_low_m
    above_m = plant.walls.nearest_high_m - state.position_m
    return min(below_m, above_m) <= reach_m
