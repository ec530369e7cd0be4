"""From parameters to the records of the kernels."""

import math
from collections.abc import Sequence
from functools import lru_cache

from stickslip_ros.contact.bank import Group, spring_bank
from stickslip_ros.contact.hemisphere import elasticity_of, profile_of
from stickslip_ros.contact.kernel import in_python
from stickslip_ros.contact.laws import LAW_NUMBERS, FrictionLaw
from stickslip_ros.contact.presliding import Presliding, presliding
from stickslip_ros.contact.reaction import (
    ContactModel,
    fresh_history,
    onto_springs,
    relaxed,
)
from stickslip_ros.contact.springs import SpringBank
from stickslip_ros.contact.virgin import tabulate
from stickslip_ros.drive.amplifier import is_direct
from stickslip_ros.drive.feet_build import (
    equal_feet,
    fresh_feet,
    onto_springs_of_feet,
    with_curves,
    with_gains,
)
from stickslip_ros.drive.feet_split import split_feet
from stickslip_ros.drive.passes import LEFT, PASSES_MIN, fresh_passes
from stickslip_ros.drive.piezo import rest
from stickslip_ros.drive.records import Clock, DriveHistory, Plant, State, Sums
from stickslip_ros.drive.stages import Feet
from stickslip_ros.drive.stages_build import (
    amplifier_of,
    fresh_piezo,
    is_linear,
    piezo_of,
    slew_of,
    walls_of,
)
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
    """
    Return the constant part of the drive.

    Raises
    ------
    OutOfRange
        If feet differ under Coulomb's law, which then does not say how they share the load.

    """
    attached = parameters.load_cell.contact == 'attached'
    model, equal = _contacts(parameters)
    feet = with_gains(equal, parameters)
    cell_n_per_m = parameters.load_cell.stiffness if attached else 0.0
    amplifier, piezo, walls = amplifier_of(parameters), piezo_of(parameters), walls_of(parameters)
    stiffest_n_per_m = cell_n_per_m + walls.cell_n_per_m + walls.stop_n_per_m
    return with_ideal(
        Plant(
            contact=model,
            mass_kg=parameters.runner.mass,
            per_kg=1.0 / parameters.runner.mass,
            damping_n_s_per_m=parameters.runner.damping,
            cell_n_per_m=cell_n_per_m,
            gain_m_per_v=parameters.actuator.gain,
            rest_v=float(parameters.amplifier.voltage_initial),
            voltage_min_v=parameters.amplifier.voltage_min,
            voltage_max_v=parameters.amplifier.voltage_max,
            slew_v_per_s=slew_of(parameters),
            dt_s=min(parameters.sim.dt, longest_step_s(parameters, model, stiffest_n_per_m)),
            ideal=False,
            stuck=False,
            amplifier=amplifier,
            piezo=piezo,
            feet=feet,
            walls=walls,
        )
    )


def with_ideal(plant: Plant) -> Plant:
    """Return a plant that knows whether it is ideal."""
    feet_are_one = is_linear(plant.piezo) and not plant.feet.separate
    ideal = feet_are_one and in_python(is_direct)(plant) and not plant.stuck
    return plant._replace(ideal=ideal)


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
        Stiffness of load cell and end stops together, N/m.

    """
    law, mass_kg = model.law, parameters.runner.mass
    contact_n_per_m = max(float(model.curve.cells[0, 1]), law.bristle_n_per_m)
    omega_per_s = math.sqrt((cell_n_per_m + contact_n_per_m) / mass_kg)
    law_n_s_per_m = law.bristle_n_s_per_m + law.viscous_n_s_per_m
    gamma_per_s = (parameters.runner.damping + law_n_s_per_m) / mass_kg
    return PHASE_MAX / max(omega_per_s, gamma_per_s)


def contact_model(parameters: Parameters) -> ContactModel:
    """Return the constants of the six contacts; those of the last few stands are kept."""
    return _contacts(parameters)[0]


def _contacts(parameters: Parameters) -> tuple[ContactModel, Feet]:
    contact, law = parameters.contact, parameters.friction_law
    return _kept_contacts(Parameters(contact=contact, friction_law=law, stand=parameters.stand))


@lru_cache(maxsize=MODELS_KEPT)
def _kept_contacts(parameters: Parameters) -> tuple[ContactModel, Feet]:
    contacts = contacts_of(parameters)
    elasticity = elasticity_of(parameters.contact)
    stand = parameters.stand
    model = ContactModel(
        curve=tabulate(contacts),
        bank=bank_of(parameters),
        law=law_of(parameters, contacts),
        compliance=parameters.contact.friction * elasticity.cattaneo_mindlin,
        preload_n=stand.preload,
        preload_n_per_s=stand.preload_rate,
    )
    return model, equal_feet(contacts, groups_of(parameters), model.bank)


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
    contacts = contacts_of(there)
    model = plant.contact._replace(curve=tabulate(contacts), preload_n=preload_n)
    stiffest_n_per_m = plant.cell_n_per_m + plant.walls.cell_n_per_m + plant.walls.stop_n_per_m
    longest_s = longest_step_s(parameters, model, stiffest_n_per_m)
    return plant._replace(
        contact=model,
        dt_s=min(parameters.sim.dt, longest_s),
        feet=with_curves(plant.feet, contacts),
    )


def change_preload(
    plant: Plant, history: DriveHistory, state: State, parameters: Parameters, preload_n: float
) -> tuple[Plant, State]:
    """Return plant and state that go to another preload: the springs take over on the way."""
    if plant.feet.separate:
        contact = onto_springs_of_feet(plant, history.feet, state.contact)
    else:
        contact = onto_springs(plant.contact, history.contact, state.contact)
    return with_preload(plant, parameters, preload_n), state._replace(contact=contact)


def history_of(plant: Plant) -> DriveHistory:
    """Return the arrays in which a drive remembers, empty."""
    return DriveHistory(
        fresh_history(plant.contact), fresh_feet(plant.feet), fresh_piezo(), fresh_passes()
    )


def state_at_rest(plant: Plant, history: DriveHistory, preload_n: float) -> State:
    """Return the drive at rest, with relaxed contacts; the history is emptied."""
    contact = relaxed(history.contact, preload_n)
    history.feet.states[:] = 0.0
    if plant.feet.separate:
        split_feet(plant, history, contact, 0.0)
    rest(plant, history.piezo)
    history.passes[LEFT] = PASSES_MIN
    return State(
        clock=Clock(0.0, 0, 0.0, 0.0),
        voltage_v=plant.rest_v,
        foot_m=0.0,
        position_m=0.0,
        velocity_m_per_s=0.0,
        contact=contact,
        sums=Sums(0.0, 0.0, 0.0, 0.0, 0.0),
    )


def clock_at_start(state: State) -> Clock:
    """Return the clock of a wave that begins now."""
    return Clock(0.0, 0, state.position_m, state.sums.position_m_s)
