# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Faults of the drive that may change while it runs."""

from stickslip_ros.contact.laws import COULOMB
from stickslip_ros.drive.build import divide_feet, set_ideal
from stickslip_ros.drive.feet import nominal_place
from stickslip_ros.drive.layout import NO_LAW_OF_SHARES
from stickslip_ros.drive.records import ALL
from stickslip_ros.errors import OutOfRange
from stickslip_ros.kernels.kernel import in_python
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
    Set the present faults of a drive, and end all others.

    A dead foot, counted from 1 in the order of the groups, stays in place, and moves on from there
    when the fault ends; 0: none. A runner that gets stuck loses its kinetic energy. Without power
    the voltage falls to the lowest.

    Raises OutOfRange if a foot dies under Coulomb's law, which does not define how feet share the
    load.

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
    """Stop a foot, counted from 1, or none with 0; release the previously dead foot."""
    plant, state = plants[0], states[0]
    if plant.contacts[ALL].law.number == COULOMB:
        hint = 'take another contact.law'
        raise OutOfRange('fault.dead_foot', dead_foot, '', NO_LAW_OF_SHARES, hint)
    parameters.feet.check_foot('fault.dead_foot', dead_foot)
    if not plant.divided:
        divide_feet(plants, states, parameters)
    if plant.dead:
        follows_m = plant.ratios[plant.dead] * _nominal(plant, state, plant.dead)
        state.offsets_m[plant.dead] = _unbent(plant, state, plant.dead) - follows_m
    if dead_foot:
        state.offsets_m[dead_foot] = _unbent(plant, state, dead_foot)
    plant.dead = dead_foot


def _unbent(plant: Record, state: Record, foot: int) -> float:
    """Return the position of a foot without load, m."""
    if not plant.piezo.stack_n_per_m:
        return float(state.places_m[foot])
    ratio = 0.0 if foot == plant.dead else plant.ratios[foot]
    return float(state.offsets_m[foot] + ratio * _nominal(plant, state, foot))


def _nominal(plant: Record, state: Record, foot: int) -> float:
    """Return the displacement of the nominal foot of a foot's actuator, m."""
    return float(in_python(nominal_place)(plant, state, foot))
