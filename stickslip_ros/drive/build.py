"""From parameters to the records of the kernels."""

import math

from stickslip_ros.contact.hemisphere import elasticity_of, profile_of
from stickslip_ros.contact.memory import relax
from stickslip_ros.contact.presliding import Presliding, presliding
from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.virgin import tabulate
from stickslip_ros.drive.records import Clock, Plant, State, Sums
from stickslip_ros.parameters import Parameters

UPPER_CONTACTS = 2
LOWER_CONTACTS = 4
UPPER_SHARE = math.sqrt(2.0) / 2.0
"""Normal force of an upper contact per preload, F_n1 / F_p (Eq. 19)."""
LOWER_SHARE = math.sqrt(2.0) / 4.0
"""Normal force of a lower contact per preload, F_n2 / F_p (Eq. 19)."""
SLEW_REFINEMENT = 32
"""Steps during a fall are so many times shorter: the feet cross the whole presliding range in
two microseconds, and their work is an integral over that range."""


def contacts_of(parameters: Parameters) -> list[Presliding]:
    """Return the six contacts, the two upper ones first, under the normal forces of Eq. 19."""
    shares = [UPPER_SHARE] * UPPER_CONTACTS + [LOWER_SHARE] * LOWER_CONTACTS
    contact = parameters.contact
    elasticity = elasticity_of(contact)
    return [
        presliding(
            profile_of(contact, index),
            elasticity,
            contact.friction,
            share * parameters.stand.preload,
        )
        for index, share in enumerate(shares)
    ]


def plant_of(parameters: Parameters) -> Plant:
    """Return the constant part of the drive."""
    attached = parameters.load_cell.contact == 'attached'
    return Plant(
        curve=tabulate(contacts_of(parameters)),
        mass_kg=parameters.runner.mass,
        damping_n_s_per_m=parameters.runner.damping,
        cell_n_per_m=parameters.load_cell.stiffness if attached else 0.0,
        gain_m_per_v=parameters.actuator.gain,
        rest_v=parameters.amplifier.voltage_initial,
        voltage_min_v=parameters.amplifier.voltage_min,
        voltage_max_v=parameters.amplifier.voltage_max,
        slew_v_per_s=parameters.amplifier.slew_rate,
        dt_s=parameters.sim.dt,
        slew_dt_s=parameters.sim.dt / SLEW_REFINEMENT,
    )


def state_at_rest(plant: Plant, stack: Array) -> State:
    """Return the drive at rest, with relaxed contacts; the stack is emptied."""
    return State(
        clock=Clock(0.0, 0, 0.0, 0.0),
        voltage_v=plant.rest_v,
        foot_m=0.0,
        position_m=0.0,
        velocity_m_per_s=0.0,
        memory=relax(stack, 0.0),
        sums=Sums(0.0, 0.0, 0.0, 0.0),
    )


def clock_at_start(state: State) -> Clock:
    """Return the clock of a wave that begins now."""
    return Clock(0.0, 0, state.position_m, state.sums.position_m_s)
