# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Transfer the memory of contacts: to springs, to another friction, from all feet to each foot."""

from stickslip_ros.contact.laws import MDR
from stickslip_ros.contact.memory import U, move, set_memory
from stickslip_ros.contact.reaction import contact_lost, remembers_turns, switch_to_springs
from stickslip_ros.contact.springs import move_springs, stored_in_springs
from stickslip_ros.drive.feet import active_contacts, lost_in_contacts, wanted_place
from stickslip_ros.drive.records import ALL
from stickslip_ros.drive.travel import update_curves
from stickslip_ros.kernels.kernel import entry_point, kernel
from stickslip_ros.kernels.record import Record


@entry_point
def switch_all_to_springs(plants: Record, states: Record) -> None:
    """Let the springs of every contact take over from its turning points."""
    plant, state = plants[0], states[0]
    for k in active_contacts(plant):
        switch_to_springs(plant.contacts[k], state.contacts[k])


@entry_point
def slip_at_once(plants: Record, states: Record) -> None:
    """
    Let springs above their friction limit slip while the runner keeps its place.

    Their force falls with the limit, so the elastic energy that they give off is friction loss.
    Springs that age slip in the next steps, at the speed that their force gives them.

    """
    plant, state, total_n = plants[0], states[0], 0.0
    if plant.contacts[ALL].law.number != MDR or plant.contacts[ALL].ageing.on:
        return
    for k in active_contacts(plant):
        bank, own, memory = plant.contacts[k].bank, state.contacts[k], state.contacts[k].memory
        before_j = stored_in_springs(bank, own.springs)
        force_n, _ = move_springs(bank, own.springs, 0.0, own.preload_n, own.preload_n)
        lost_j = memory.lost_j + (before_j - stored_in_springs(bank, own.springs))
        set_memory(memory, memory.u_m, force_n, memory.sense, lost_j, 0.0)
        state.feet[k].load_n = force_n
        total_n += force_n
    state.contact_n = total_n


@entry_point
def lost_before_division(plants: Record, states: Record) -> float:
    """Return the friction loss in all contacts, J, by their present curves."""
    return lost_in_contacts(plants[0], states[0])


@entry_point
def divide_among_feet(plants: Record, states: Record, befores: Record, lost_j: float) -> None:
    """
    Give each foot its memory, position and force from the contact that it was part of.

    ``befores`` has the states and ``lost_j`` the friction loss before; the contacts of the feet
    are relaxed.

    Notes
    -----
    The feet of a contact have shared one displacement, so they have the same turning points. The
    force of a foot follows from these and from its own virgin curve.

    """
    plant, state, before = plants[0], states[0], befores[0]
    total_n = 0.0
    for k in active_contacts(plant):
        state.contacts[k].window_m = before.contacts[plant.parents[k]].window_m
    update_curves(plant, state)
    for k in active_contacts(plant):
        contact, whole = state.contacts[k], before.contacts[plant.parents[k]]
        contact.on_springs = whole.on_springs
        contact.preload_n = whole.preload_n
        contact.bristle_m = whole.bristle_m
        contact.slip_m_per_s = whole.slip_m_per_s
        if remembers_turns(plant.contacts[k], whole):
            _repeat_turns(plant.contacts[k].curve, contact.memory, whole.memory)
            lost_j -= contact_lost(plant.contacts[k], contact)
        else:
            force_n = _part_of(plant, k) * whole.memory.force_n
            if plant.contacts[ALL].law.number == MDR:
                force_n = _divide_springs(plant, state, whole, k)
            set_memory(contact.memory, whole.memory.u_m, force_n, whole.memory.sense, 0.0, 0.0)
        state.feet[k].load_n = contact.memory.force_n
        state.offsets_m[k] = before.offsets_m[plant.parents[k]]
        state.places_m[k] = wanted_place(plant, state, k)
        total_n += contact.memory.force_n
    for k in active_contacts(plant):
        state.contacts[k].memory.lost_j += plant.parts[k] * lost_j
    state.contact_n = total_n


@kernel
def _part_of(plant: Record, k: int) -> float:
    """Return the share of a foot in the friction limit of the contact that it was part of."""
    if plant.parents[k] == ALL:
        return plant.parts[k]
    whole = 0.0
    for other in active_contacts(plant):
        whole += plant.parts[other] if plant.parents[other] == plant.parents[k] else 0.0
    return plant.parts[k] / whole


@kernel
def _repeat_turns(curve: Record, memory: Record, whole: Record) -> None:
    """Move a fresh contact through the turning points of another one."""
    origin_m = whole.turns[0, U]
    memory.turns[0, U] = origin_m
    set_memory(memory, origin_m, 0.0, 1.0, 0.0, 0.0)
    for k in range(1, whole.depth + 1):
        move(curve, memory, whole.turns[k, U])
    move(curve, memory, whole.u_m)


@kernel
def _divide_springs(plant: Record, state: Record, whole: Record, k: int) -> float:
    """Give a foot its share of the spring forces of its group; return their sum, N."""
    count, group = 0.0, plant.groups[k]
    for other in active_contacts(plant):
        is_equal = plant.groups[other] == group and plant.parents[other] == plant.parents[k]
        count += 1.0 if is_equal else 0.0
    springs = plant.contacts[k].bank.first[1]
    total_n = 0.0
    for i in range(springs):
        force_n = whole.springs.forces_n[group * springs + i] / count
        state.contacts[k].springs.forces_n[i] = force_n
        state.contacts[k].springs.ages_s[i] = whole.springs.ages_s[group * springs + i]
        total_n += force_n
    return total_n
