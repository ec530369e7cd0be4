"""
Kernel: six feet that are not moved as one, each with a contact and a memory of its own.

Everything about foot i lies in row i of a few arrays; ``contact_of`` and ``state_of`` make of it
what the kernels of one contact take. To the rest of the drive the feet are one contact against the
mean foot, with the sum of their forces.

"""

from stickslip_ros.contact.kernel import kernel
from stickslip_ros.contact.laws import FrictionLaw
from stickslip_ros.contact.memory import Memory
from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.reaction import (
    ContactModel,
    ContactState,
    History,
    contact_lost,
    contact_stored,
    react,
)
from stickslip_ros.contact.springs import SpringBank
from stickslip_ros.contact.virgin import VirginCurve
from stickslip_ros.drive.records import Plant
from stickslip_ros.drive.stages import (
    ENERGY_MAX,
    FEET,
    FORCE_MAX,
    GROUP,
    PART,
    RATIO,
    SHARE,
    FeetHistory,
)

U, FORCE, DEPTH, SENSE, LOST, BASE, ERROR, ON_SPRINGS, BRISTLE, PLACE, OFFSET = range(11)
"""Columns of ``FeetHistory.states``: the Memory of a foot; 1 if springs hold its history; the
deflection of its bristles; its displacement and what of that does not follow the piezo, m."""


def plain_contact_of(plant: Plant, foot: int) -> ContactModel:
    """Return the constants of the contact of one foot; outside of kernels."""
    whole, feet = plant.contact, plant.feet
    numbers, springs = feet.numbers, feet.springs
    part = numbers[foot, PART]
    curve = VirginCurve(
        feet.cells[int(numbers[foot, GROUP])],
        whole.curve.cells_per_m,
        whole.curve.core_m,
        whole.curve.limit_m,
        numbers[foot, FORCE_MAX],
        numbers[foot, ENERGY_MAX],
    )
    bank = SpringBank(
        springs[0, foot],
        springs[1, foot],
        springs[2, foot],
        springs[3, foot],
        springs[4, foot],
        numbers[foot, SHARE : SHARE + 1],
        whole.bank.friction,
    )
    law = FrictionLaw(
        whole.law.number,
        whole.law.bristle_n_per_m * part,
        whole.law.bristle_n_s_per_m * part,
        whole.law.viscous_n_s_per_m * part,
        whole.law.static_ratio,
        whole.law.stribeck_m_per_s,
        whole.law.breakaway_ratio,
    )
    return ContactModel(curve, bank, law, whole.compliance, whole.preload_n, whole.preload_n_per_s)


def plain_state_of(states: Array, foot: int, preload_n: float) -> ContactState:
    """Return the state of the contact of one foot; outside of kernels."""
    memory = Memory(
        float(states[foot, U]),
        float(states[foot, FORCE]),
        int(states[foot, DEPTH]),
        float(states[foot, SENSE]),
        float(states[foot, LOST]),
        float(states[foot, BASE]),
        float(states[foot, ERROR]),
    )
    return ContactState(
        memory, bool(states[foot, ON_SPRINGS] > 0.0), preload_n, float(states[foot, BRISTLE])
    )


contact_of = kernel(plain_contact_of)
state_of = kernel(plain_state_of)


@kernel
def keep_state(states: Array, foot: int, contact: ContactState) -> None:
    """Write down the state of the contact of one foot."""
    memory = contact.memory
    states[foot, U] = memory.u_m
    states[foot, FORCE] = memory.force_n
    states[foot, DEPTH] = memory.depth
    states[foot, SENSE] = memory.sense
    states[foot, LOST] = memory.lost_j
    states[foot, BASE] = memory.base_j
    states[foot, ERROR] = memory.error_n
    states[foot, ON_SPRINGS] = 1.0 if contact.on_springs else 0.0
    states[foot, BRISTLE] = contact.bristle_m


@kernel
def place_of(plant: Plant, states: Array, foot: int, foot_m: float) -> float:
    """Return the displacement of one foot when the mean foot is at ``foot_m``, m."""
    ratio = 0.0 if foot + 1 == plant.feet.dead else plant.feet.numbers[foot, RATIO]
    return float(states[foot, OFFSET] + ratio * foot_m)


@kernel
def react_of_feet(
    plant: Plant,
    history: FeetHistory,
    whole: ContactState,
    position_m: float,
    foot_m: float,
    dt_s: float,
) -> tuple[ContactState, float]:
    """
    Drag every contact; return all of them as one, and the work that the feet have done, J.

    Parameters
    ----------
    plant : Plant
        The drive.
    history : FeetHistory
        Changed in place.
    whole : ContactState
        All contacts as one, before.
    position_m, foot_m : float
        Runner and mean foot at the end of the step.
    dt_s : float
        Time of the step, s.

    """
    states = history.states
    total_n, work_j, on_springs = 0.0, 0.0, False
    preload_n, bristle_m = whole.preload_n, 0.0
    for foot in range(FEET):
        place_m = place_of(plant, states, foot, foot_m)
        model = contact_of(plant, foot)
        own = History(history.stacks[foot], history.springs[foot])
        before = state_of(states, foot, whole.preload_n)
        after = react(model, own, before, position_m - place_m, dt_s, 0.0)
        mean_n = 0.5 * (before.memory.force_n + after.memory.force_n)
        work_j -= mean_n * (place_m - states[foot, PLACE])
        keep_state(states, foot, after)
        states[foot, PLACE] = place_m
        total_n += after.memory.force_n
        bristle_m += plant.feet.numbers[foot, PART] * after.bristle_m
        on_springs = on_springs or after.on_springs
        if after.preload_n != whole.preload_n:
            preload_n = after.preload_n
    memory = Memory(position_m - foot_m, total_n, 0, 1.0, 0.0, 0.0, 0.0)
    return ContactState(memory, on_springs, preload_n, bristle_m), work_j


@kernel
def stored_by_feet(plant: Plant, history: FeetHistory, preload_n: float) -> float:
    """Return the elastic energy in the contacts of all feet, J."""
    energy_j = 0.0
    for foot in range(FEET):
        own = History(history.stacks[foot], history.springs[foot])
        state = state_of(history.states, foot, preload_n)
        energy_j += contact_stored(contact_of(plant, foot), own, state)
    return energy_j


@kernel
def lost_by_feet(plant: Plant, history: FeetHistory, preload_n: float) -> float:
    """Return the friction loss in the contacts of all feet, J."""
    energy_j = 0.0
    for foot in range(FEET):
        own = History(history.stacks[foot], history.springs[foot])
        state = state_of(history.states, foot, preload_n)
        energy_j += contact_lost(contact_of(plant, foot), own, state)
    return energy_j
