# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Transfer the memory of contacts: from turning points to springs, from all feet to each foot."""

from stickslip_ros.contact.laws import MDR
from stickslip_ros.contact.memory import U, move, set_memory
from stickslip_ros.contact.reaction import contact_lost, remembers_turns, switch_to_springs
from stickslip_ros.drive.feet import active_contacts
from stickslip_ros.drive.records import ALL, CONTACTS
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
def divide_among_feet(plants: Record, states: Record) -> None:
    """
    Give each foot its memory, position and force from all contacts together.

    Notes
    -----
    All contacts have shared one displacement, so each has the same turning points. With them its
    own virgin curve gives the force of a foot.

    """
    plant, state = plants[0], states[0]
    whole = state.contacts[ALL]
    total_n, lost_j = 0.0, 0.0
    for k in range(1, CONTACTS):
        state.contacts[k].window_m = whole.window_m
    update_curves(plant, state)
    for k in range(1, CONTACTS):
        contact = state.contacts[k]
        contact.on_springs = whole.on_springs
        contact.preload_n = whole.preload_n
        contact.bristle_m = whole.bristle_m
        contact.slip_m_per_s = whole.slip_m_per_s
        if remembers_turns(plant.contacts[ALL], whole):
            _repeat_turns(plant.contacts[k].curve, contact.memory, whole.memory)
            lost_j += contact_lost(plant.contacts[k], contact)
        else:
            force_n = plant.parts[k] * whole.memory.force_n
            if plant.contacts[ALL].law.number == MDR:
                force_n = _divide_springs(plant, state, k)
            set_memory(contact.memory, whole.memory.u_m, force_n, whole.memory.sense, 0.0, 0.0)
        state.feet[k].load_n = contact.memory.force_n
        state.places_m[k] = state.foot_m
        state.offsets_m[k] = 0.0
        total_n += contact.memory.force_n
    lost_j = contact_lost(plant.contacts[ALL], whole) - lost_j
    for k in range(1, CONTACTS):
        state.contacts[k].memory.lost_j += plant.parts[k] * lost_j
    state.contact_n = total_n


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
def _divide_springs(plant: Record, state: Record, k: int) -> float:
    """Give a foot its share of the spring forces of its group; return their sum, N."""
    group = plant.groups[k]
    count = 0.0
    for other in range(1, CONTACTS):
        if plant.groups[other] == group:
            count += 1.0
    bank = plant.contacts[ALL].bank
    first = bank.first[group]
    total_n = 0.0
    for i in range(bank.first[group + 1] - first):
        force_n = state.contacts[ALL].springs.forces_n[first + i] / count
        state.contacts[k].springs.forces_n[i] = force_n
        state.contacts[k].springs.ages_s[i] = state.contacts[ALL].springs.ages_s[first + i]
        total_n += force_n
    return total_n
