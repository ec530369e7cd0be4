"""From parameters to the records of the kernels."""

import math
from collections.abc import Sequence
from functools import lru_cache

from stickslip_ros.contact.bank import Group, spring_bank
from stickslip_ros.contact.hemisphere import elasticity_of, profile_of
from stickslip_ros.contact.laws import LAW_NUMBERS, FrictionLaw
from stickslip_ros.contact.presliding import Presliding, presliding
from stickslip_ros.contact.reaction import (
    ContactModel,
    History,
    fresh_history,
    onto_springs,
    relaxed,
)
from stickslip_ros.contact.springs import SpringBank
from stickslip_ros.contact.virgin import tabulate
from stickslip_ros.drive.records import Clock, Plant, State, Sums
from stickslip_ros.parameters import Parameters

UPPER_CONTACTS = 2
LOWER_CONTACTS = 4
UPPER_SHARE = math.sqrt(2.0) / 2.0
"""Normal force of an upper contact per preload, F_n1 / F_p (Eq. 19)."""
LOWER_SHARE = math.sqrt(2.0) / 4.0
"""Normal force of a lower contact per preload, F_n2 / F_p (Eq. 19)."""
PHASE_MAX = 1.1
"""Longest step times the largest angular frequency, or rate of damping. The steps are series in
both; up to here the energy balances to a few 1e-3."""
MODELS_KEPT = 64
"""Contact models kept for the next drive: a sweep over amplitudes has one for each preload."""
SPRINGS_IN_ALL = 128
"""Springs of all groups together: so many keep real time while the preload changes."""


def groups_of(parameters: Parameters) -> list[Group]:
    """Return the groups of equal contacts (Eq. 19); rough lines are all different."""
    counts = ((UPPER_CONTACTS, UPPER_SHARE), (LOWER_CONTACTS, LOWER_SHARE))
    if parameters.contact.profile != 'rough_line':
        return [Group(profile_of(parameters.contact), count, share) for count, share in counts]
    shares = [share for count, share in counts for _ in range(count)]
    return [Group(profile_of(parameters.contact, i), 1, share) for i, share in enumerate(shares)]


def contacts_of(parameters: Parameters) -> list[Presliding]:
    """Return the six contacts, the two upper ones first, under the normal forces of Eq. 19."""
    elasticity = elasticity_of(parameters.contact)
    friction = parameters.contact.friction
    contacts: list[Presliding] = []
    for group in groups_of(parameters):
        force_n = group.share * parameters.stand.preload
        contact = presliding(group.profile, elasticity, friction, force_n)
        contacts += [contact] * group.contacts
    return contacts


def plant_of(parameters: Parameters) -> Plant:
    """Return the constant part of the drive."""
    attached = parameters.load_cell.contact == 'attached'
    model = contact_model(parameters)
    cell_n_per_m = parameters.load_cell.stiffness if attached else 0.0
    return Plant(
        contact=model,
        mass_kg=parameters.runner.mass,
        per_kg=1.0 / parameters.runner.mass,
        damping_n_s_per_m=parameters.runner.damping,
        cell_n_per_m=cell_n_per_m,
        gain_m_per_v=parameters.actuator.gain,
        rest_v=parameters.amplifier.voltage_initial,
        voltage_min_v=parameters.amplifier.voltage_min,
        voltage_max_v=parameters.amplifier.voltage_max,
        slew_v_per_s=parameters.amplifier.slew_rate,
        dt_s=min(parameters.sim.dt, longest_step_s(parameters, model, cell_n_per_m)),
    )


def longest_step_s(parameters: Parameters, model: ContactModel, cell_n_per_m: float) -> float:
    """
    Return the longest step that resolves the fastest motion of the runner, s.

    Parameters
    ----------
    parameters : Parameters
        Mass and damping of the runner.
    model : ContactModel
        The contacts; they are stiffest while everything sticks.
    cell_n_per_m : float
        Stiffness of the load cell, N/m.

    """
    law, mass_kg = model.law, parameters.runner.mass
    contact_n_per_m = max(float(model.curve.cells[0, 1]), law.bristle_n_per_m)
    omega_per_s = math.sqrt((cell_n_per_m + contact_n_per_m) / mass_kg)
    law_n_s_per_m = law.bristle_n_s_per_m + law.viscous_n_s_per_m
    gamma_per_s = (parameters.runner.damping + law_n_s_per_m) / mass_kg
    return PHASE_MAX / max(omega_per_s, gamma_per_s)


def contact_model(parameters: Parameters) -> ContactModel:
    """Return the constants of the six contacts; those of the last few stands are kept."""
    contact, law = parameters.contact, parameters.friction_law
    return _contact_model(Parameters(contact=contact, friction_law=law, stand=parameters.stand))


@lru_cache(maxsize=MODELS_KEPT)
def _contact_model(parameters: Parameters) -> ContactModel:
    contacts = contacts_of(parameters)
    elasticity = elasticity_of(parameters.contact)
    stand = parameters.stand
    return ContactModel(
        curve=tabulate(contacts),
        bank=bank_of(parameters),
        law=law_of(parameters, contacts),
        compliance=parameters.contact.friction * elasticity.cattaneo_mindlin,
        preload_n=stand.preload,
        preload_n_per_s=stand.preload_rate,
    )


def bank_of(parameters: Parameters) -> SpringBank:
    """Return springs that carry any preload that the drive may come to."""
    stand = parameters.stand
    groups = groups_of(parameters)
    return spring_bank(
        groups,
        elasticity_of(parameters.contact),
        parameters.contact.friction,
        max(stand.preload_limit, stand.preload, stand.preload_end),
        springs=SPRINGS_IN_ALL // len(groups),
    )


def law_of(parameters: Parameters, contacts: Sequence[Presliding]) -> FrictionLaw:
    """Return the friction law; a bristle stiffness of 0 is that of the sticking contacts."""
    setting = parameters.friction_law
    stick_n_per_m = sum(contact.stick_stiffness_n_per_m for contact in contacts)
    return FrictionLaw(
        number=LAW_NUMBERS[parameters.contact.law],
        bristle_n_per_m=setting.bristle_stiffness or stick_n_per_m,
        bristle_n_s_per_m=setting.bristle_damping,
        viscous_n_s_per_m=setting.viscous,
        static_ratio=setting.static_ratio,
        stribeck_m_per_s=setting.stribeck_velocity,
        breakaway_ratio=setting.breakaway_ratio,
    )


def with_preload(plant: Plant, parameters: Parameters, preload_n: float) -> Plant:
    """Return a plant that goes to another preload; its virgin curve is the one of the new load."""
    there = parameters.updated({'stand.preload': preload_n})
    model = plant.contact._replace(curve=tabulate(contacts_of(there)), preload_n=preload_n)
    longest_s = longest_step_s(parameters, model, plant.cell_n_per_m)
    return plant._replace(contact=model, dt_s=min(parameters.sim.dt, longest_s))


def change_preload(
    plant: Plant, history: History, state: State, parameters: Parameters, preload_n: float
) -> tuple[Plant, State]:
    """Return plant and state that go to another preload: the springs take over on the way."""
    contact = onto_springs(plant.contact, history, state.contact)
    return with_preload(plant, parameters, preload_n), state._replace(contact=contact)


def history_of(plant: Plant) -> History:
    """Return the arrays in which a drive remembers, empty."""
    return fresh_history(plant.contact)


def state_at_rest(plant: Plant, history: History, preload_n: float) -> State:
    """Return the drive at rest, with relaxed contacts; the history is emptied."""
    return State(
        clock=Clock(0.0, 0, 0.0, 0.0),
        voltage_v=plant.rest_v,
        foot_m=0.0,
        position_m=0.0,
        velocity_m_per_s=0.0,
        contact=relaxed(history, preload_n),
        sums=Sums(0.0, 0.0, 0.0, 0.0),
    )


def clock_at_start(state: State) -> Clock:
    """Return the clock of a wave that begins now."""
    return Clock(0.0, 0, state.position_m, state.sums.position_m_s)
