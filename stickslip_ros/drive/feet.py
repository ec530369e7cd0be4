# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Kernel: the feet, as one or separate: indices, motion, and energy of their contacts."""

from stickslip_ros.contact.reaction import contact_lost, contact_stored
from stickslip_ros.drive.records import ALL, CONTACTS
from stickslip_ros.kernels.kernel import kernel
from stickslip_ros.kernels.record import Record


@kernel
def active_contacts(plant: Record) -> range:
    """Return the indices of the contacts that the drive moves: ALL, or each foot."""
    return range(1, CONTACTS) if plant.separate else range(ALL, 1)


@kernel
def ratio_of(plant: Record, k: int) -> float:
    """Return the way of a foot per way of the mean foot; 0 for a dead foot."""
    return plant.ratios[k] if k == ALL or k != plant.dead else 0.0


@kernel
def bends(plant: Record) -> bool:
    """Return whether the feet have a mass and their loads bend the stacks."""
    return bool(plant.piezo.stack_n_per_m > 0.0)


@kernel
def way_of(plant: Record, state: Record, path: Record, k: int) -> tuple[float, float]:
    """Return velocity, m/s, and acceleration, m/s^2, of a foot against the frame."""
    if bends(plant):
        return state.feet[k].speed, state.feet[k].speeding
    ratio = ratio_of(plant, k)
    return ratio * path.speed, ratio * path.speeding


@kernel
def sliding_motion(
    plant: Record, state: Record, stride: Record, k: int
) -> tuple[float, float, float]:
    """
    Return velocity, m/s, acceleration, m/s^2, and direction of the runner against a foot.

    The direction takes an immediate reversal into account.

    """
    foot_speed, foot_speeding = way_of(plant, state, stride.path, k)
    speed = (stride.runner.speed - stride.sway.speed) - foot_speed
    speeding = (stride.runner.speeding - stride.sway.speeding) - foot_speeding
    turns_at_once = speed * speed < 2.0 * stride.slack_m * abs(speeding)
    return speed, speeding, speeding if turns_at_once else speed


@kernel
def mean_place(plant: Record, state: Record) -> float:
    """Return the mean displacement of all feet against the frame, m."""
    place_m = 0.0
    for k in active_contacts(plant):
        own_m = state.offsets_m[k] + ratio_of(plant, k) * state.foot_m
        place_m += (state.places_m[k] if bends(plant) else own_m) / len(active_contacts(plant))
    return place_m


@kernel
def stored_in_contacts(plant: Record, state: Record) -> float:
    """Return the elastic energy in the contacts of all feet, J."""
    energy_j = 0.0
    for k in active_contacts(plant):
        energy_j += contact_stored(plant.contacts[k], state.contacts[k])
    return energy_j


@kernel
def lost_in_contacts(plant: Record, state: Record) -> float:
    """Return the friction loss in the contacts of all feet, J."""
    energy_j = 0.0
    for k in active_contacts(plant):
        energy_j += contact_lost(plant.contacts[k], state.contacts[k])
    return energy_j
