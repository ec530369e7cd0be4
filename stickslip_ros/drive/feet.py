"""
Kernel: the feet move their contacts, all as one or each its own, and divide what these remember.

To the rest of the drive they are one contact against the mean foot, with the sum of their forces.

"""

from typing import Any, NamedTuple

from stickslip_ros.contact.kernel import entry_point, kernel, kernel_apart
from stickslip_ros.contact.laws import MDR
from stickslip_ros.contact.memory import U, move, set_memory
from stickslip_ros.contact.reaction import (
    contact_lost,
    contact_stored,
    react,
    remembers_turns,
    switch_to_springs,
)
from stickslip_ros.contact.record import Record
from stickslip_ros.contact.travel import lay, place_of
from stickslip_ros.contact.virgin import virgin_force
from stickslip_ros.drive.records import ALL, CONTACTS, FEET

SLIPPING = 1e-9
"""Share of the presliding by which a contact in full slip may miss it, for rounding."""


class Path(NamedTuple):
    """How the mean foot goes on: velocity, m/s, and acceleration, m/s^2, which stays."""

    speed: float
    speeding: float


@kernel
def moving(plant: Record) -> range:
    """Return the numbers of the contacts that the drive moves: all as one, or each."""
    return range(1, CONTACTS) if plant.separate else range(ALL, 1)


@kernel
def ratio_of(plant: Record, k: int) -> float:
    """Return the way of a foot per way of the mean foot; a dead one stays."""
    return plant.ratios[k] if k == ALL or k != plant.dead else 0.0


@kernel
def bends(plant: Record) -> bool:
    """Return whether the feet have a mass, and their loads bend the stacks under them."""
    return bool(plant.piezo.stack_n_per_m > 0.0)


@kernel
def way_of(plant: Record, state: Record, path: Path, k: int) -> Path:
    """Return how a foot goes on against the frame."""
    if bends(plant):
        return Path(state.feet[k].speed, state.feet[k].speeding)
    ratio = ratio_of(plant, k)
    return Path(ratio * path.speed, ratio * path.speeding)


@kernel
def way_on(path: Any, time_s: float) -> float:
    """Return the way on a parabola of time, m: anything with a speed and a speeding."""
    return time_s * (path.speed + 0.5 * time_s * path.speeding)


@kernel
def mean_path(plant: Record, state: Record, path: Path) -> Path:
    """Return how all feet go on the average, which a frame feels: dead ones stay."""
    if not plant.frame.exists:
        return path
    speed, speeding = 0.0, 0.0
    for k in moving(plant):
        way = way_of(plant, state, path, k)
        speed += way.speed / len(moving(plant))
        speeding += way.speeding / len(moving(plant))
    return Path(speed, speeding)


@kernel
def mean_place(plant: Record, state: Record) -> float:
    """Return the displacement of all feet against the frame on the average, m."""
    place_m = 0.0
    for k in moving(plant):
        own_m = state.offsets_m[k] + ratio_of(plant, k) * state.foot_m
        place_m += (state.places_m[k] if bends(plant) else own_m) / len(moving(plant))
    return place_m


@kernel
def move_contacts(
    plant: Record,
    state: Record,
    position_m: float,
    foot_m: float,
    dt_s: float,
    holding_n: float,
    stays: bool,
) -> float:
    """
    Let all contacts answer; return the force with which they drag the mean foot back, N.

    Turning points remember nothing of a place where the contact only ``stays`` for a look: the
    middle of a step.

    Runner and mean foot are where they are against the frame at the end of the time. The work of
    the feet is that force times the way of the mean foot. The holding force would keep the
    contacts from sliding. Feet that bend their stacks are where ``places_m`` says, and the force
    is that with which the stacks drag.

    """
    drag_n, total_n, preload_n = 0.0, 0.0, 0.0
    for k in moving(plant):
        contact, foot, ratio = state.contacts[k], state.feet[k], ratio_of(plant, k)
        place_m = state.offsets_m[k] + ratio * foot_m
        if bends(plant):
            drag_n += ratio * plant.piezo.stack_n_per_m * (state.places_m[k] - place_m)
            place_m = state.places_m[k]
        u_m = position_m - place_m
        travel_m = foot.unfold * (u_m - foot.origin_m)
        if 0.0 <= travel_m < foot.room_m and (stays or foot.fold * contact.memory.sense > 0.0):
            foot.load_n = foot.base_n + foot.fold * virgin_force(plant.contacts[k].curve, travel_m)
            if not stays:
                contact.memory.u_m, contact.memory.force_n = u_m, foot.load_n
        else:
            react(plant.contacts[k], contact, u_m, dt_s, holding_n)
            foot.load_n, foot.room_m = contact.memory.force_n, 0.0
        state.places_m[k] = place_m
        if not bends(plant):
            drag_n += ratio * foot.load_n
        total_n += foot.load_n
        preload_n = contact.preload_n
    state.contact_n = total_n
    state.preload_n = preload_n
    return drag_n


@kernel_apart
def arrest(plant: Record, state: Record, k: int, direction: float) -> None:
    """
    Move the window of a contact that ends its full slip to where it is now.

    The force stays, mu F_n. What the springs store there more or less is a loss the less or more.

    """
    contact, own = plant.contacts[k], state.contacts[k]
    curve, memory = contact.curve, own.memory
    slipped_m = memory.sense * (memory.u_m - memory.turns[0, U])
    slips = memory.depth == 0 and slipped_m >= (1.0 - SLIPPING) * curve.limit_m
    if not slips or direction * memory.sense >= 0.0 or not remembers_turns(contact, own):
        return
    # Virgin loading to full slip, stored and lost together, is energy_max_j.
    energy_j = memory.lost_j - memory.base_j + curve.energy_max_j
    own.window_m = memory.u_m
    lay_contact(plant, state, k)
    memory.turns[0, U] = memory.u_m - memory.sense * curve.limit_m
    force_n, lost_j = memory.sense * curve.force_max_n, energy_j - curve.energy_max_j
    set_memory(memory, memory.u_m, force_n, memory.sense, lost_j, 0.0)


@kernel
def lay_contact(plant: Record, state: Record, k: int) -> None:
    """Tabulate the virgin curve of a contact where its window is, unless that is done."""
    track, contact = plant.track, plant.contacts[k]
    place = place_of(track, state.contacts[k].window_m)
    if track.laid[k] != place:
        first, last = (0, FEET) if k == ALL else (k - 1, k)
        bank, preload_n = plant.contacts[ALL].bank, contact.preload_n
        lay(track, bank, contact.compliance, preload_n, contact.curve, first, last, place)
        track.laid[k] = place


@kernel
def lay_contacts(plant: Record, state: Record) -> None:
    """Do so for each contact that the drive moves, if roughness travels."""
    if plant.track.on:
        for k in moving(plant):
            lay_contact(plant, state, k)


@kernel
def stored_by_feet(plant: Record, state: Record) -> float:
    """Return the elastic energy in the contacts of all feet, J."""
    energy_j = 0.0
    for k in moving(plant):
        energy_j += contact_stored(plant.contacts[k], state.contacts[k])
    return energy_j


@kernel
def lost_by_feet(plant: Record, state: Record) -> float:
    """Return the friction loss in the contacts of all feet, J."""
    energy_j = 0.0
    for k in moving(plant):
        energy_j += contact_lost(plant.contacts[k], state.contacts[k])
    return energy_j


@entry_point
def switch_all_to_springs(plants: Record, states: Record) -> None:
    """Let the springs of every contact take over from its turning points."""
    plant, state = plants[0], states[0]
    for k in moving(plant):
        switch_to_springs(plant.contacts[k], state.contacts[k])


@entry_point
def divide_among_feet(plants: Record, states: Record) -> None:
    """
    Give each foot its share of what all contacts together remember, its place, and its force.

    Notes
    -----
    The turning points of all contacts together are those of each, for all have shared one
    displacement. Followed along a foot's own virgin curve they give its force.

    """
    plant, state = plants[0], states[0]
    whole = state.contacts[ALL]
    total_n, lost_j = 0.0, 0.0
    for k in range(1, CONTACTS):
        state.contacts[k].window_m = whole.window_m
    lay_contacts(plant, state)
    for k in range(1, CONTACTS):
        contact = state.contacts[k]
        contact.on_springs = whole.on_springs
        contact.preload_n = whole.preload_n
        contact.bristle_m = whole.bristle_m
        contact.age_s, contact.slip_m_per_s = whole.age_s, whole.slip_m_per_s
        contact.friction_ratio = whole.friction_ratio
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
    """Repeat the turning points of another contact with a fresh one."""
    origin_m = whole.turns[0, U]
    memory.turns[0, U] = origin_m
    set_memory(memory, origin_m, 0.0, 1.0, 0.0, 0.0)
    for k in range(1, whole.depth + 1):
        move(curve, memory, whole.turns[k, U])
    move(curve, memory, whole.u_m)


@kernel
def _divide_springs(plant: Record, state: Record, k: int) -> float:
    """Give a foot its share of the springs of its group; return their force, N."""
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
        total_n += force_n
    return total_n
