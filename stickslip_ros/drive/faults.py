# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Faults of the drive that come and go while it runs."""

from stickslip_ros.contact.laws import COULOMB
from stickslip_ros.drive.build import separate_feet, set_ideal
from stickslip_ros.drive.division import divide_among_feet
from stickslip_ros.drive.records import ALL
from stickslip_ros.errors import OutOfRange
from stickslip_ros.kernels.record import Record
from stickslip_ros.parameters import Parameters


def apply_faults(
    plants: Record,
    states: Record,
    parameters: Parameters,
    *,
    dead_foot: int,
    runner_stuck: bool,
    amplifier_on: bool,
) -> None:
    """
    Give a drive the present faults, between two advances; all others end.

    A dead foot, 1 to 6, the two upper ones first, stays where it is and follows again from there
    when the fault ends; 0 is none. A runner that gets stuck loses its kinetic energy. Without
    power the voltage goes to the lowest.

    Raises
    ------
    OutOfRange
        If a foot dies under Coulomb's law, which then does not say how the feet share the load.

    """
    plant = plants[0]
    if dead_foot != plant.dead:
        change_dead_foot(plants, states, parameters, dead_foot)
    if runner_stuck and not plant.stuck:
        state = states[0]
        kinetic_j = 0.5 * plant.mass_kg * state.velocity_m_per_s * state.velocity_m_per_s
        state.sums.stuck_lost_j += kinetic_j
        state.velocity_m_per_s, state.pressed = 0.0, False
    plant.amplifier.on = amplifier_on
    plant.stuck = runner_stuck
    set_ideal(plant)


def change_dead_foot(
    plants: Record, states: Record, parameters: Parameters, dead_foot: int
) -> None:
    """Let a foot stand where it is, from 1, or none, 0; the one before goes on from its place."""
    plant, state = plants[0], states[0]
    if plant.contacts[ALL].law.number == COULOMB:
        limit = 'not 0 under the rigid law of Coulomb, which does not say how feet share a load'
        raise OutOfRange('fault.dead_foot', dead_foot, '', limit, 'take another contact.law')
    if not plant.separate:
        separate_feet(plants, parameters)
        divide_among_feet(plants, states)
    if plant.dead:
        follows_m = plant.ratios[plant.dead] * state.foot_m
        state.offsets_m[plant.dead] = _unbent(plant, state, plant.dead) - follows_m
    if dead_foot:
        state.offsets_m[dead_foot] = _unbent(plant, state, dead_foot)
    plant.dead = dead_foot


def _unbent(plant: Record, state: Record, foot: int) -> float:
    """Return where a foot is, m; of one that its load has bent, where it would be without."""
    if not plant.piezo.stack_n_per_m:
        return float(state.places_m[foot])
    ratio = 0.0 if foot == plant.dead else plant.ratios[foot]
    return float(state.offsets_m[foot] + ratio * state.foot_m)
