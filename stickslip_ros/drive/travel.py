# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Kernel: windows of travelling roughness, which follow a full slip when it comes to rest."""

from stickslip_ros.contact.memory import U, set_memory
from stickslip_ros.contact.reaction import remembers_turns
from stickslip_ros.contact.travel import place_of, tabulate_feet
from stickslip_ros.drive.feet import active_contacts, sliding_motion
from stickslip_ros.drive.records import ALL
from stickslip_ros.kernels.kernel import kernel, noinline_kernel
from stickslip_ros.kernels.record import Record

SLIPPING = 1e-9
"""Rounding of the presliding at full slip, relative."""


@kernel
def look_ahead(plant: Record, state: Record, stride: Record) -> None:
    """Move the window of each contact that turns after a full slip to its present place."""
    if plant.track.on:
        for k in active_contacts(plant):
            _, _, direction = sliding_motion(plant, state, stride, k)
            arrest(plant, state, k, direction)


@noinline_kernel
def arrest(plant: Record, state: Record, k: int, direction: float) -> None:
    """
    Move the window of a contact to its present place if its full slip ends.

    The force remains mu F_n. A change of the stored energy is booked as friction loss.

    """
    contact, own = plant.contacts[k], state.contacts[k]
    curve, memory = contact.curve, own.memory
    slipped_m = memory.sense * (memory.u_m - memory.turns[0, U])
    slips = memory.depth == 0 and slipped_m >= (1.0 - SLIPPING) * curve.limit_m
    if not slips or direction * memory.sense >= 0.0 or not remembers_turns(contact, own):
        return
    # energy_max_j: stored and lost energy of virgin loading to full slip.
    energy_j = memory.lost_j - memory.base_j + curve.energy_max_j
    own.window_m = memory.u_m
    update_curve(plant, state, k)
    memory.turns[0, U] = memory.u_m - memory.sense * curve.limit_m
    force_n, lost_j = memory.sense * curve.force_max_n, energy_j - curve.energy_max_j
    set_memory(memory, memory.u_m, force_n, memory.sense, lost_j, 0.0)


@kernel
def update_curve(plant: Record, state: Record, k: int) -> None:
    """Tabulate the virgin curve of a contact at the place of its window, if that has changed."""
    track, contact = plant.track, plant.contacts[k]
    place = place_of(track, state.contacts[k].window_m)
    if track.laid[k] != place:
        first, feet = 0, int(plant.counts[k])
        if k != ALL:
            for other in range(1, k):
                first += int(plant.counts[other])
        bank, preload_n = plant.contacts[ALL].bank, contact.preload_n
        tabulate_feet(track, bank, preload_n, contact.curve, first, first + feet, place)
        track.laid[k] = place


@kernel
def update_curves(plant: Record, state: Record) -> None:
    """Tabulate the virgin curves of all moved contacts, if roughness travels."""
    if plant.track.on:
        for k in active_contacts(plant):
            update_curve(plant, state, k)
