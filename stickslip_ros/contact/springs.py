"""
Kernel: a bank of springs with memory (Section 3.4 of the paper), for any history of the load.

Each spring sticks or slips on its own: q <- clip(q + G* dx du, -mu f_z, +mu f_z) with
f_z = E* dx (d - g). Springs that lose contact forget, springs that come into contact start
unloaded. This is the reference for the memory of turning points, and the way that the contact
goes while its normal force changes.

A bank has few springs, chosen well: the order of the springs does not matter, so neighbours in
height, not in place, are joined. Each joined spring has the stiffness of its class and the mean
height of it, and with these the bank has the exact normal force at every class boundary. At a
given preload its depth is solved for the bank itself, so that full slip is exactly mu F_n.

"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from stickslip_ros.contact.elasticity import Elasticity
from stickslip_ros.contact.kernel import kernel
from stickslip_ros.contact.memory import Memory, U
from stickslip_ros.contact.profile import Array, Profile

SPRINGS = 64
"""Springs per group of equal contacts. Against the continuum the force is then exact to
BANK_ERROR of its maximum, from a twentieth of the largest preload on."""
BANK_ERROR = 2.5e-3
GRADING = 2.0
"""Class boundaries grow like this power of their number: fine where small preloads press."""
SLIP_SLACK = 1e-12
"""Share of the limit by which a sum of slipping springs may miss it, for rounding."""
SHIFT_ITERATIONS = 100


class Group(NamedTuple):
    """
    Equal contacts: a profile, how many there are, and their share of the preload.

    Attributes
    ----------
    profile : Profile
        The indenter.
    contacts : int
        How many.
    share : float
        Normal force of one per preload.

    """

    profile: Profile
    contacts: int
    share: float


class SpringBank(NamedTuple):
    """
    Constants of the springs of all contacts.

    Attributes
    ----------
    heights_m : array, shape (groups, springs)
        Depth at which a spring begins to press, rising along a row.
    normal_n_per_m, shear_n_per_m : array, shape (groups, springs)
        Stiffnesses, all contacts of a group together.
    area_n, slope_n_per_m : array, shape (groups, springs)
        Normal force when a spring begins to press, and stiffness from there on: a table of the
        normal law.
    shares : array, shape (groups,)
        Normal force of a group, all its contacts together, per preload.
    friction : float
        Friction coefficient mu.

    """

    heights_m: Array
    normal_n_per_m: Array
    shear_n_per_m: Array
    area_n: Array
    slope_n_per_m: Array
    shares: Array
    friction: float


def spring_bank(
    groups: Sequence[Group],
    elasticity: Elasticity,
    friction: float,
    preload_max_n: float,
    springs: int = SPRINGS,
) -> SpringBank:
    """
    Choose the springs of a drive.

    Parameters
    ----------
    groups : sequence of Group
        The contacts.
    elasticity : Elasticity
        Effective moduli.
    friction : float
        Friction coefficient mu.
    preload_max_n : float
        Largest preload that the bank can carry, N.
    springs : int
        Springs per group.

    Raises
    ------
    OutOfRange
        If a profile is too short for the largest preload.

    """
    rows = [_classes(group, elasticity, preload_max_n, springs) for group in groups]
    heights_m, widths_m = (np.array(column) for column in zip(*rows, strict=True))
    normal = 2.0 * elasticity.normal_pa * widths_m
    slope = np.cumsum(normal, axis=1)
    steps_n = slope[:, :-1] * np.diff(heights_m, axis=1)
    area_n = np.concatenate((np.zeros((len(groups), 1)), np.cumsum(steps_n, axis=1)), axis=1)
    return SpringBank(
        heights_m=heights_m,
        normal_n_per_m=normal,
        shear_n_per_m=2.0 * elasticity.shear_pa * widths_m,
        area_n=area_n,
        slope_n_per_m=slope,
        shares=np.array([group.contacts * group.share for group in groups]),
        friction=friction,
    )


def _classes(
    group: Group, elasticity: Elasticity, preload_max_n: float, springs: int
) -> tuple[Array, Array]:
    """Return mean height and half width of each class of springs, all contacts together."""
    profile = group.profile
    area_m2 = group.share * preload_max_n / (2.0 * elasticity.normal_pa)
    deepest_m = profile.depth_for(area_m2)
    bounds_m = deepest_m * (np.arange(springs + 1) / springs) ** GRADING
    half_width_m = profile.half_width(bounds_m)
    areas_m2 = profile.pressed_area_at(bounds_m)
    widths_m = np.diff(half_width_m)
    gained_m2 = np.diff(areas_m2) - half_width_m[:-1] * np.diff(bounds_m)
    heights_m = bounds_m[1:] - gained_m2 / np.where(widths_m > 0.0, widths_m, 1.0)
    return heights_m, group.contacts * widths_m


@kernel
def depth_at(bank: SpringBank, group: int, preload_n: float) -> float:
    """Return the indentation depth of a group at a preload, m: the inverse normal law."""
    force_n = bank.shares[group] * preload_n
    low, high = 0, bank.area_n.shape[1] - 1
    while low < high:
        middle = (low + high + 1) // 2
        if bank.area_n[group, middle] <= force_n:
            low = middle
        else:
            high = middle - 1
    rest_n = force_n - bank.area_n[group, low]
    return bank.heights_m[group, low] + rest_n / bank.slope_n_per_m[group, low]


@kernel
def drag(
    bank: SpringBank, forces_n: Array, du_m: float, before_n: float, after_n: float
) -> tuple[float, float]:
    """
    Drag all springs, while the preload goes from one value to another.

    Parameters
    ----------
    bank : SpringBank
        Constants.
    forces_n : array, shape (groups, springs)
        Tangential forces; changed in place.
    du_m : float
        Change of the relative displacement, m.
    before_n, after_n : float
        Preload at the beginning and at the end, N.

    Returns
    -------
    tuple of float
        Sum of the tangential forces, N, and friction loss, J.

    """
    total_n = 0.0
    lost_j = 0.0
    for group in range(forces_n.shape[0]):
        old_m = depth_at(bank, group, before_n)
        new_m = depth_at(bank, group, after_n) if after_n != before_n else old_m
        for i in range(forces_n.shape[1]):
            height_m = bank.heights_m[group, i]
            stiffness = bank.friction * bank.normal_n_per_m[group, i]
            old_limit_n = stiffness * max(old_m - height_m, 0.0)
            limit_n = stiffness * max(new_m - height_m, 0.0)
            shear = bank.shear_n_per_m[group, i]
            trial_n = forces_n[group, i] + shear * du_m
            force_n = min(max(trial_n, -limit_n), limit_n)
            onset_n = min(max(trial_n, -old_limit_n), old_limit_n)
            if trial_n != force_n:
                lost_j += 0.5 * (onset_n + force_n) * (trial_n - force_n) / shear
            forces_n[group, i] = force_n
            total_n += force_n
    return total_n, lost_j


@kernel
def stored_in_springs(bank: SpringBank, forces_n: Array) -> float:
    """Return the elastic energy of the springs, J."""
    energy_j = 0.0
    for group in range(forces_n.shape[0]):
        for i in range(forces_n.shape[1]):
            if bank.shear_n_per_m[group, i] > 0.0:
                energy_j += 0.5 * forces_n[group, i] ** 2 / bank.shear_n_per_m[group, i]
    return energy_j


@kernel
def friction_limit(bank: SpringBank, preload_n: float) -> float:
    """Return the force of full slip at a preload, mu times the sum of the normal forces, N."""
    limit_n = 0.0
    for group in range(len(bank.shares)):
        limit_n += bank.friction * bank.shares[group] * preload_n
    return limit_n


@kernel
def elongation(stack: Array, memory: Memory, threshold_m: float) -> float:
    """Return the elongation that turning points give to a spring which slips at a threshold, m."""
    offset_m = memory.u_m - stack[memory.depth, U]
    half_m = abs(offset_m) if memory.depth == 0 else 0.5 * abs(offset_m)
    sense = memory.sense
    if threshold_m <= half_m:
        return sense * threshold_m
    for k in range(memory.depth, 0, -1):
        outer_m = abs(stack[k, U] - stack[k - 1, U])
        if k > 1:
            outer_m *= 0.5
        if threshold_m <= outer_m:
            return -sense * threshold_m + memory.u_m - stack[k, U]
        sense = -sense
    return memory.u_m - stack[0, U]


@kernel
def take_over(
    bank: SpringBank,
    compliance: float,
    stack: Array,
    memory: Memory,
    preload_n: float,
    forces_n: Array,
) -> None:
    """
    Load the springs as the turning points say, with the same sum of forces.

    Parameters
    ----------
    bank : SpringBank
        Constants.
    compliance : float
        mu C_M: presliding per depth.
    stack, memory
        State of the turning points.
    preload_n : float
        Present preload, N.
    forces_n : array, shape (groups, springs)
        Receives the tangential forces.

    Notes
    -----
    A bank of few springs misses the continuum force by up to BANK_ERROR. A common displacement
    of all springs, found by bisection, takes that up: the force of the drive does not jump.

    """
    for group in range(forces_n.shape[0]):
        depth_m = depth_at(bank, group, preload_n)
        for i in range(forces_n.shape[1]):
            threshold_m = compliance * max(depth_m - bank.heights_m[group, i], 0.0)
            stretch_m = elongation(stack, memory, threshold_m)
            forces_n[group, i] = bank.shear_n_per_m[group, i] * stretch_m
    low_m, high_m = (
        -compliance * depth_at(bank, 0, preload_n),
        compliance * depth_at(bank, 0, preload_n),
    )
    for _ in range(SHIFT_ITERATIONS):
        middle_m = 0.5 * (low_m + high_m)
        if _shifted_sum(bank, forces_n, preload_n, middle_m) < memory.force_n:
            low_m = middle_m
        else:
            high_m = middle_m
    drag(bank, forces_n, 0.5 * (low_m + high_m), preload_n, preload_n)


@kernel
def _shifted_sum(bank: SpringBank, forces_n: Array, preload_n: float, shift_m: float) -> float:
    """Return what the sum of the forces would be after a common displacement, N."""
    total_n = 0.0
    for group in range(forces_n.shape[0]):
        depth_m = depth_at(bank, group, preload_n)
        for i in range(forces_n.shape[1]):
            pressed_m = max(depth_m - bank.heights_m[group, i], 0.0)
            limit_n = bank.friction * bank.normal_n_per_m[group, i] * pressed_m
            trial_n = forces_n[group, i] + bank.shear_n_per_m[group, i] * shift_m
            total_n += min(max(trial_n, -limit_n), limit_n)
    return total_n
