# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Kernel: the feet, as one or separate: indices, motion, and energy of their contacts."""

from stickslip_ros.contact.reaction import contact_lost, contact_stored
from stickslip_ros.drive.records import ALL
from stickslip_ros.kernels.kernel import kernel
from stickslip_ros.kernels.record import Record


@kernel
def active_contacts(plant: Record) -> range:
    """Return the indices of the contacts that the drive moves: ALL, or the separate ones."""
    return range(1, 1 + plant.moved) if plant.separate else range(ALL, 1)


@kernel
def ratio_of(plant: Record, k: int) -> float:
    """Return the way of a contact's feet per way of the nominal foot; 0 for a dead foot."""
    return plant.ratios[k] if k == ALL or k != plant.dead else 0.0


@kernel
def in_mean(plant: Record, k: int, value: float) -> float:
    """Return the contribution of a contact's feet to the mean of a value over all driven feet."""
    if is_guide(plant, k):
        return 0.0
    return value if k == ALL else value * plant.counts[k] / plant.driven


@kernel
def is_guide(plant: Record, k: int) -> bool:
    """Return whether a contact is a guide, at rest against the frame."""
    return bool(plant.ratios[k] == 0.0)


@kernel
def nominal_place(plant: Record, state: Record, k: int) -> float:
    """Return the displacement of the nominal foot of the actuator of a contact, m."""
    return state.late[plant.lates[k] - 1].foot_m if plant.lates[k] else state.foot_m


@kernel
def nominal_way(plant: Record, state: Record, stride: Record, k: int) -> tuple[float, float]:
    """Return velocity, m/s, and acceleration, m/s^2, of the nominal foot in this stride."""
    if plant.lates[k]:
        late = state.late[plant.lates[k] - 1]
        return late.speed, late.speeding
    return stride.path.speed, stride.path.speeding


@kernel
def wanted_place(plant: Record, state: Record, k: int) -> float:
    """Return the displacement of a contact's feet against the frame without load, m."""
    return state.offsets_m[k] + ratio_of(plant, k) * nominal_place(plant, state, k)


@kernel
def bends(plant: Record) -> bool:
    """Return whether the feet have a mass and their loads bend the stacks."""
    return bool(plant.piezo.stack_n_per_m > 0.0)


@kernel
def way_of(plant: Record, state: Record, stride: Record, k: int) -> tuple[float, float]:
    """Return velocity, m/s, and acceleration, m/s^2, of a contact's feet against the frame."""
    if bends(plant):
        return state.feet[k].speed, state.feet[k].speeding
    ratio, (speed, speeding) = ratio_of(plant, k), nominal_way(plant, state, stride, k)
    return ratio * speed, ratio * speeding


@kernel
def sliding_motion(
    plant: Record, state: Record, stride: Record, k: int
) -> tuple[float, float, float]:
    """
    Return velocity, m/s, acceleration, m/s^2, and direction of the runner against a foot.

    The direction takes an immediate reversal into account.

    """
    foot_speed, foot_speeding = way_of(plant, state, stride, k)
    speed = (stride.runner.speed - stride.sway.speed) - foot_speed
    speeding = (stride.runner.speeding - stride.sway.speeding) - foot_speeding
    turns_at_once = speed * speed < 2.0 * stride.slack_m * abs(speeding)
    return speed, speeding, speeding if turns_at_once else speed


@kernel
def mean_place(plant: Record, state: Record) -> float:
    """Return the mean displacement of all driven feet against the frame, m."""
    place_m = 0.0
    for k in active_contacts(plant):
        own_m = state.places_m[k] if bends(plant) else wanted_place(plant, state, k)
        place_m += in_mean(plant, k, own_m)
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
