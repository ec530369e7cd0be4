"""
The runner and the springs that it meets: m x'' = -k x - c x' + F_r + F_ext (Eq. 20).

A load cell, fixed or touched, and end stops.

"""

import math

from stickslip_ros.contact.kernel import kernel
from stickslip_ros.contact.record import Record


@kernel
def cell_force(plant: Record, position_m: float) -> float:
    """
    Return the force in the load cell, N: k x where it is fixed, k (x - gap) where pressed.

    A load button that swings makes another one of it.

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
def wall_stiffness(plant: Record, position_m: float) -> float:
    """Return the stiffness of all one-sided springs that are pressed at a position, N/m."""
    walls = plant.walls
    stiffness = walls.cell_n_per_m if position_m > walls.gap_m else 0.0
    if position_m > walls.high_m or position_m < walls.low_m:
        stiffness += walls.stop_n_per_m
    return stiffness


@kernel
def next_wall(plant: Record, position_m: float, direction: float) -> float:
    """Return the next place in a direction at which a one-sided spring is touched or left, m."""
    walls = plant.walls
    nearest_m = direction * math.inf
    for place_m in (walls.gap_m, walls.low_m, walls.high_m):
        if 0.0 < direction * (place_m - position_m) < direction * (nearest_m - position_m):
            nearest_m = place_m
    return nearest_m


@kernel
def force_on_runner(plant: Record, position_m: float, contact_n: float, load_n: float) -> float:
    """Return load cell, end stops, contacts and external load together, N; damping is apart."""
    force_n = load_n - contact_n - plant.cell_n_per_m * position_m
    if plant.walls.exist:
        force_n -= wall_force(plant, position_m)
    return force_n
