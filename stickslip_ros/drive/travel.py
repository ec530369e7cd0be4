# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Kernel: windows of roughness that travels, which follow a full slip when it comes to rest."""

from stickslip_ros.contact.memory import U, set_memory
from stickslip_ros.contact.reaction import remembers_turns
from stickslip_ros.contact.travel import lay, place_of
from stickslip_ros.drive.feet import goes_past, moving
from stickslip_ros.drive.records import ALL, FEET
from stickslip_ros.kernels.kernel import kernel, kernel_apart
from stickslip_ros.kernels.record import Record

SLIPPING = 1e-9
"""Share of the presliding by which a contact in full slip may miss it, for rounding."""


@kernel
def look_ahead(plant: Record, state: Record, stride: Record) -> None:
    """Let the windows of contacts that turn follow their slip."""
    if plant.track.on:
        for k in moving(plant):
            _, _, direction = goes_past(plant, state, stride, k)
            arrest(plant, state, k, direction)


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
