# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Energy balance of the drive, with independent terms, so their sum tests the integration."""

from typing import NamedTuple

from stickslip_ros.drive.feet import lost_in_contacts, stored_in_contacts
from stickslip_ros.drive.frame import frame_energy
from stickslip_ros.drive.runner import cell_energy, stops_energy
from stickslip_ros.drive.stacks import stacks_energy
from stickslip_ros.drive.travel import update_curves
from stickslip_ros.kernels.kernel import entry_point
from stickslip_ros.kernels.record import Record


class EnergyLedger(NamedTuple):
    """Energy of the drive since its start, J."""

    feet_work_j: float  # Work of the feet
    load_work_j: float  # Work of the external load, and kinetic energy of a mass added in motion
    # Kinetic energy of the runner; energy of the load cell and of the contact springs
    kinetic_j: float
    cell_j: float
    contact_stored_j: float
    contact_lost_j: float  # Losses by slip in the contacts, and by viscous damping
    damping_lost_j: float
    sticking_lost_j: float = 0.0  # Energy lost in contacts that stick
    stops_j: float = 0.0  # Energy in the springs of the end stops
    stuck_lost_j: float = 0.0  # Kinetic energy lost when the runner got stuck
    # Energy of the frame: motion of its centre of mass, feet included, and its spring
    frame_j: float = 0.0
    # Energy of bent stacks, and of feet that move against the centre of mass
    stacks_j: float = 0.0
    # Energy lost in the damping of frame, feet and load button, and in impacts
    stand_lost_j: float = 0.0

    @property
    def residual_j(self) -> float:
        """Energy put in minus energy found, J: the error of the integration."""
        found_j = self.kinetic_j + self.cell_j + self.contact_stored_j + self.stops_j
        found_j += self.frame_j + self.stacks_j
        lost_j = self.contact_lost_j + self.damping_lost_j + self.sticking_lost_j
        lost_j += self.stuck_lost_j + self.stand_lost_j
        return self.feet_work_j + self.load_work_j - found_j - lost_j


@entry_point
def take_ledger(plants: Record, states: Record) -> EnergyLedger:
    """Return the balance of a drive, from arrays of one plant and one state."""
    plant, state, sums = plants[0], states[0], states[0].sums
    update_curves(plant, state)
    button_j = plant.button.mass_kg * state.button_m_per_s * state.button_m_per_s
    button_j = 0.5 * (button_j + plant.button.n_per_m * state.button_m * state.button_m)
    return EnergyLedger(
        feet_work_j=sums.feet_work_j,
        load_work_j=sums.load_work_j,
        kinetic_j=0.5 * plant.mass_kg * state.velocity_m_per_s * state.velocity_m_per_s,
        cell_j=cell_energy(plant, state.position_m) + button_j,
        contact_stored_j=stored_in_contacts(plant, state),
        contact_lost_j=lost_in_contacts(plant, state),
        damping_lost_j=sums.damping_lost_j,
        sticking_lost_j=sums.sticking_lost_j,
        stops_j=stops_energy(plant, state.position_m),
        stuck_lost_j=sums.stuck_lost_j,
        frame_j=frame_energy(plant, state),
        stacks_j=stacks_energy(plant, state),
        stand_lost_j=sums.stand_lost_j,
    )
