# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Kernel: a bank of springs with memory (Section 3.4 of the paper), for any history of the load.

Each spring sticks or slips on its own: q <- clip(q + G* dx du, -mu f_z, +mu f_z) with
f_z = E* dx (d - g). Springs that lose contact forget their force; springs that come into contact
start unloaded. The bank is the reference for the memory of turning points, and it computes the
contact while the normal force changes.

The order of the springs does not matter, so springs of similar height are joined into classes. A
joined spring has the stiffness of its class and its mean height, so the normal force of the bank
is exact at every class boundary. The depth at a preload is solved for the bank itself, so full
slip is exactly mu F_n.

"""

import math
from collections.abc import Sequence
from functools import cache, lru_cache
from typing import NamedTuple

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.contact.ageing import ratio_at_rest, slide
from stickslip_ros.contact.mdr import Elasticity
from stickslip_ros.contact.memory import elongation
from stickslip_ros.contact.profile import Profile
from stickslip_ros.kernels.kernel import kernel, noinline_kernel
from stickslip_ros.kernels.record import COUNT, FLOAT, Record, RecordKind, kind, record
from stickslip_ros.parameters import FEET_MAX

SPRINGS_IN_ALL = 128
"""Springs of all groups together; with this number a changing preload runs in real time.
`_kept_bank` divides them among the groups."""
GROUPS_MAX = FEET_MAX  # guarded by `FeetParameters.check_together`
SLIP_SLACK = 1e-12
"""Rounding of a sum of slipping springs, relative to the limit."""
SHIFT_ITERATIONS = 100
SPRINGS = 64
"""Springs per group of equal contacts. The force then agrees with the continuum to BANK_ERROR of
its maximum, from a twentieth of the largest preload on."""
BANK_ERROR = 2.5e-3
"""Error with SPRINGS springs; it is 1.5e-2 with 21 springs, as for six different rough lines."""
GRADING = 2.0
"""Power with which class boundaries grow, so classes are fine for small preloads."""
CLASSES_KEPT = 32
"""Groups whose classes are kept for the next drive; they fit any preload up to the largest."""


@cache
def bank_kind(springs: int) -> RecordKind:
    """Return the type of a bank with room for a number of springs."""
    per_spring = (FLOAT, (springs,))
    return kind(
        groups=COUNT,  # Groups of equal contacts, at most GROUPS_MAX
        # Index of the first spring of each group; after the last group, the number of springs
        first=(COUNT, (GROUPS_MAX + 1,)),
        heights_m=per_spring,  # Depth at which a spring begins to press, rising within a group
        # Growth of the friction limit with the depth, mu E* dx, all contacts of a group together
        limit_n_per_m=per_spring,
        # Their tangential stiffness G* dx and its inverse; 0 without a spring
        shear_n_per_m=per_spring,
        per_shear_m_per_n=per_spring,
        # Normal law as a table: force of the group when a spring begins to press, and stiffness
        # from there on
        area_n=per_spring,
        slope_n_per_m=per_spring,
        # Normal force of a group: its share of the preload, and its share of the weight
        shares=(FLOAT, (GROUPS_MAX,)),
        weights_n=(FLOAT, (GROUPS_MAX,)),
        # Friction coefficient mu of a group, and mu C_M, its presliding per depth
        friction=(FLOAT, (GROUPS_MAX,)),
        compliance=(FLOAT, (GROUPS_MAX,)),
    )


BANK = bank_kind(SPRINGS_IN_ALL)


def springs_kind(springs: int) -> RecordKind:
    """Return the type of the state of a number of springs."""
    per_spring = (FLOAT, (springs,))
    return kind(
        forces_n=per_spring,  # Tangential forces; 0 for springs without a normal force
        losses_j=per_spring,  # Friction losses in the last step
        ages_s=per_spring,  # Ages, if the contact ages
        last=(COUNT, (GROUPS_MAX,)),  # Highest spring of each group pressed in the last step
    )


SPRINGS_STATE = springs_kind(SPRINGS_IN_ALL)


class Group(NamedTuple):
    """Equal contacts."""

    profile: Profile  # the indenter
    elasticity: Elasticity  # effective moduli
    friction: float  # friction coefficient mu
    contacts: int  # number of contacts
    share: float  # normal force of each per preload
    weight_n: float = 0.0  # normal force of each without preload, N


def spring_bank(groups: Sequence[Group], preload_max_n: float, springs: int = SPRINGS) -> Record:
    """
    Choose a number of springs for each group of a drive, for preloads up to the largest.

    A record of BANK has room for SPRINGS_IN_ALL.

    Raises OutOfRange if a profile is too short for the largest preload.

    """
    rows = [_classes(group._replace(friction=0.0), preload_max_n, springs) for group in groups]
    heights_m, widths_m = (np.array(column) for column in zip(*rows, strict=True))
    moduli = [(group.elasticity.normal_pa, group.elasticity.shear_pa) for group in groups]
    normal_pa, shear_pa = np.array(moduli).T[:, :, np.newaxis]
    friction = np.array([group.friction for group in groups])
    normal = 2.0 * normal_pa * widths_m
    slope = np.cumsum(normal, axis=1)
    steps_n = slope[:, :-1] * np.diff(heights_m, axis=1)
    area_n = np.concatenate((np.zeros((len(groups), 1)), np.cumsum(steps_n, axis=1)), axis=1)
    return bank_of_rows(
        heights_m,
        friction[:, np.newaxis] * normal,
        2.0 * shear_pa * widths_m,
        area_n,
        slope,
        shares=[group.contacts * group.share for group in groups],
        weights_n=[group.contacts * group.weight_n for group in groups],
        slips=(friction, friction * [each.elasticity.cattaneo_mindlin for each in groups]),
    )


def bank_of_rows(
    heights_m: Array,
    limit_n_per_m: Array,
    shear_n_per_m: Array,
    area_n: Array,
    slope_n_per_m: Array,
    *,
    shares: Sequence[float],
    weights_n: Sequence[float],
    slips: tuple[Array, Array],
) -> Record:
    """
    Return a bank whose springs lie in arrays of shape (groups, springs of each group).

    ``slips`` are friction and compliance of each group.

    """
    (groups, springs), size = heights_m.shape, heights_m.size
    bank = record(bank_kind(max(size, SPRINGS_IN_ALL)), groups=groups, first=size)
    bank.first[:groups] = springs * np.arange(groups)
    per_spring = {
        'heights_m': heights_m,
        'limit_n_per_m': limit_n_per_m,
        'shear_n_per_m': shear_n_per_m,
        'area_n': area_n,
        'slope_n_per_m': slope_n_per_m,
    }
    for name, rows in per_spring.items():
        bank[name][:size] = rows.ravel()
    stiff = bank.shear_n_per_m > 0.0
    np.divide(1.0, bank.shear_n_per_m, out=bank.per_shear_m_per_n, where=stiff)
    bank.shares[:groups], bank.weights_n[:groups] = shares, weights_n
    bank.friction[:groups], bank.compliance[:groups] = slips
    return bank


@lru_cache(maxsize=CLASSES_KEPT)
def _classes(group: Group, preload_max_n: float, springs: int) -> tuple[Array, Array]:
    """Return mean height and half width of each class of springs, read-only."""
    profile = group.profile
    normal_n = group.share * preload_max_n + group.weight_n
    area_m2 = normal_n / (2.0 * group.elasticity.normal_pa)
    deepest_m = profile.depth_for(area_m2)
    bounds_m = deepest_m * (np.arange(springs + 1) / springs) ** GRADING
    half_width_m = profile.half_width(bounds_m)
    areas_m2 = profile.pressed_area_at(bounds_m)
    widths_m = np.diff(half_width_m)
    gained_m2 = np.diff(areas_m2) - half_width_m[:-1] * np.diff(bounds_m)
    heights_m = bounds_m[1:] - gained_m2 / np.where(widths_m > 0.0, widths_m, 1.0)
    return heights_m, group.contacts * widths_m


@kernel
def last_pressed(bank: Record, group: int, preload_n: float, near: int) -> int:
    """Return the highest spring of a group that a preload presses, searching from ``near``."""
    force_n = bank.shares[group] * preload_n + bank.weights_n[group]
    last = min(max(near, bank.first[group]), bank.first[group + 1] - 1)
    while last > bank.first[group] and bank.area_n[last] > force_n:
        last -= 1
    while last + 1 < bank.first[group + 1] and bank.area_n[last + 1] <= force_n:
        last += 1
    return last


@kernel
def depth_of(bank: Record, group: int, preload_n: float, last: int) -> float:
    """Return the indentation depth of a group with a known highest pressed spring, m."""
    force_n = bank.shares[group] * preload_n + bank.weights_n[group]
    return bank.heights_m[last] + (force_n - bank.area_n[last]) / bank.slope_n_per_m[last]


@kernel
def depth_at(bank: Record, group: int, preload_n: float) -> float:
    """Return the indentation depth of a group at a preload, m: the inverse normal law."""
    return depth_of(
        bank, group, preload_n, last_pressed(bank, group, preload_n, bank.first[group])
    )


@kernel
def _press(
    bank: Record, springs: Record, group: int, before_n: float, after_n: float
) -> tuple[int, float, float]:
    """Update the highest pressed spring; return the highest one moved, old and new depth, m."""
    last = last_pressed(bank, group, before_n, springs.last[group])
    old_m = new_m = depth_of(bank, group, before_n, last)
    springs.last[group] = last
    if after_n != before_n:
        springs.last[group] = last_pressed(bank, group, after_n, last)
        new_m = depth_of(bank, group, after_n, springs.last[group])
        last = max(last, springs.last[group])
    return last, old_m, new_m


@kernel
def move_springs(
    bank: Record, springs: Record, du_m: float, before_n: float, after_n: float
) -> tuple[float, float]:
    """
    Move the runner by du against all springs, while the preload changes from before to after.

    Returns the sum of the tangential forces, N, and the friction loss, J.

    """
    total_n = 0.0
    lost_j = 0.0
    for group in range(bank.groups):
        last, old_m, new_m = _press(bank, springs, group, before_n, after_n)
        own = slice(bank.first[group], last + 1)
        move_group(bank, springs, own, du_m, old_m, new_m)
        force_n, loss_j = _sums(springs.forces_n[own], springs.losses_j[own])
        total_n += force_n
        lost_j += loss_j
    return total_n, lost_j


@kernel
def drag_springs(
    bank: Record,
    springs: Record,
    change_m: float,
    before_n: float,
    after_n: float,
    rig_n_per_m: float,
) -> float:
    """
    Move the far end of a rig that pulls all springs; return the sum of the tangential forces, N.

    The runner moves by the change less the growth of the force per stiffness of the rig, found by
    bisection.

    """
    held_n, limit_n = 0.0, friction_limit(bank, after_n)
    for i in range(bank.first[bank.groups]):
        held_n += springs.forces_n[i]
    low_m = change_m - (limit_n - held_n) / rig_n_per_m
    high_m = change_m + (limit_n + held_n) / rig_n_per_m
    for _ in range(SHIFT_ITERATIONS):
        du_m = 0.5 * (low_m + high_m)
        grown_n = _shifted_sum(bank, springs.forces_n, after_n, du_m) - held_n
        if du_m + grown_n / rig_n_per_m < change_m:
            low_m = du_m
        else:
            high_m = du_m
    force_n, _ = move_springs(bank, springs, 0.5 * (low_m + high_m), before_n, after_n)
    return force_n


@noinline_kernel
def slide_springs(
    bank: Record,
    ageing: Record,
    springs: Record,
    du_m: float,
    before_n: float,
    after_n: float,
    dt_s: float,
) -> tuple[float, float]:
    """Move against springs that age, like ``move_springs``; a new contact has the age 0."""
    total_n = 0.0
    lost_j = 0.0
    for group in range(bank.groups):
        last, old_m, new_m = _press(bank, springs, group, before_n, after_n)
        own = range(bank.first[group], last + 1)
        youngest_s = math.inf
        for i in own:
            # It was not pressed before this step, so its contact is new.
            if not old_m > bank.heights_m[i]:
                springs.ages_s[i] = 0.0
            youngest_s = min(youngest_s, springs.ages_s[i])
        # A force that sticks in the youngest contact sticks in each and needs no logarithm.
        all_stick = ratio_at_rest(ageing, youngest_s + dt_s)
        for i in own:
            limit_n = bank.limit_n_per_m[i] * max(new_m - bank.heights_m[i], 0.0)
            shear, force_n, age_s = bank.shear_n_per_m[i], springs.forces_n[i], springs.ages_s[i]
            trial_n = force_n + shear * du_m
            if max(abs(force_n), abs(trial_n)) <= all_stick * limit_n:
                force_n, age_s = trial_n, age_s + dt_s
            else:
                force_n, age_s, loss_j = slide(ageing, age_s, force_n, limit_n, shear, du_m, dt_s)
                lost_j += loss_j
            springs.forces_n[i], springs.ages_s[i] = force_n, age_s
            total_n += force_n
    return total_n, lost_j


@kernel
def move_group(
    bank: Record, springs: Record, own: slice, du_m: float, old_m: float, new_m: float
) -> None:
    """
    Move against the springs of a group, up to the highest pressed one, while its depth changes.

    The loop has no sums, so a processor computes several springs at a time.

    """
    heights_m, limit_n_per_m = bank.heights_m[own], bank.limit_n_per_m[own]
    shear_n_per_m, per_shear_m_per_n = bank.shear_n_per_m[own], bank.per_shear_m_per_n[own]
    forces_n, losses_j = springs.forces_n[own], springs.losses_j[own]
    for i in range(len(heights_m)):
        limit_n = limit_n_per_m[i] * max(new_m - heights_m[i], 0.0)
        old_limit_n = limit_n_per_m[i] * max(old_m - heights_m[i], 0.0)
        trial_n = forces_n[i] + shear_n_per_m[i] * du_m
        force_n = min(max(trial_n, -limit_n), limit_n)
        onset_n = min(max(trial_n, -old_limit_n), old_limit_n)
        losses_j[i] = 0.5 * (onset_n + force_n) * (trial_n - force_n) * per_shear_m_per_n[i]
        forces_n[i] = force_n


@kernel
def _sums(forces_n: Array, losses_j: Array) -> tuple[float, float]:
    """Return both sums, four springs at a time, in the same order on every processor."""
    a_n = b_n = c_n = d_n = 0.0
    a_j = b_j = c_j = d_j = 0.0
    fours = len(forces_n) // 4
    for i in range(fours):
        k = 4 * i
        a_n += forces_n[k]
        b_n += forces_n[k + 1]
        c_n += forces_n[k + 2]
        d_n += forces_n[k + 3]
        a_j += losses_j[k]
        b_j += losses_j[k + 1]
        c_j += losses_j[k + 2]
        d_j += losses_j[k + 3]
    for i in range(4 * fours, len(forces_n)):
        a_n += forces_n[i]
        a_j += losses_j[i]
    return (a_n + b_n) + (c_n + d_n), (a_j + b_j) + (c_j + d_j)


@kernel
def stored_in_springs(bank: Record, springs: Record) -> float:
    """Return the elastic energy of the springs, J."""
    energy_j = 0.0
    for i in range(bank.first[bank.groups]):
        energy_j += 0.5 * springs.forces_n[i] * springs.forces_n[i] * bank.per_shear_m_per_n[i]
    return energy_j


@kernel
def friction_limit(bank: Record, preload_n: float) -> float:
    """Return the force of full slip at a preload, mu times the sum of the normal forces, N."""
    limit_n = 0.0
    for group in range(bank.groups):
        limit_n += bank.friction[group] * bank.shares[group] * preload_n
        limit_n += bank.friction[group] * bank.weights_n[group]
    return limit_n


@kernel
def load_springs(bank: Record, memory: Record, preload_n: float, springs: Record) -> None:
    """
    Set the spring forces from the turning points, with the same total force.

    The force of the bank differs from the continuum's by up to BANK_ERROR. A common displacement
    of all springs, found by bisection, removes the difference, so the force does not jump.

    """
    forces_n = springs.forces_n
    high_m = 0.0
    for group in range(bank.groups):
        depth_m, compliance = depth_at(bank, group, preload_n), bank.compliance[group]
        high_m = max(high_m, compliance * depth_m)
        for i in range(bank.first[group], bank.first[group + 1]):
            threshold_m = compliance * max(depth_m - bank.heights_m[i], 0.0)
            forces_n[i] = bank.shear_n_per_m[i] * elongation(memory, threshold_m)
    low_m = -high_m
    # Bisection, since the sum has a kink for each spring that begins to slip.
    for _ in range(SHIFT_ITERATIONS):
        middle_m = 0.5 * (low_m + high_m)
        if _shifted_sum(bank, forces_n, preload_n, middle_m) < memory.force_n:
            low_m = middle_m
        else:
            high_m = middle_m
    move_springs(bank, springs, 0.5 * (low_m + high_m), preload_n, preload_n)


@kernel
def _shifted_sum(bank: Record, forces_n: Array, preload_n: float, shift_m: float) -> float:
    """Return the sum of the forces after a common displacement, N."""
    total_n = 0.0
    for group in range(bank.groups):
        depth_m = depth_at(bank, group, preload_n)
        for i in range(bank.first[group], bank.first[group + 1]):
            pressed_m = max(depth_m - bank.heights_m[i], 0.0)
            limit_n = bank.limit_n_per_m[i] * pressed_m
            trial_n = forces_n[i] + bank.shear_n_per_m[i] * shift_m
            total_n += min(max(trial_n, -limit_n), limit_n)
    return total_n
