"""
Kernel: a bank of springs with memory (Section 3.4 of the paper), for any history of the load.

Each spring sticks or slips on its own: q <- clip(q + G* dx du, -mu f_z, +mu f_z) with
f_z = E* dx (d - g). Springs that lose contact forget, springs that come into contact start
unloaded. This is the reference for the memory of turning points, and the way that the contact
goes while its normal force changes.

"""

from stickslip_ros.contact.kernel import kernel
from stickslip_ros.contact.memory import U
from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.record import COUNT, FLOAT, Kind, Record, kind

SPRINGS_IN_ALL = 128
"""Springs of all groups together: so many keep real time while the preload changes."""
GROUPS_MAX = 6
SLIP_SLACK = 1e-12
"""Share of the limit by which a sum of slipping springs may miss it, for rounding."""
SHIFT_ITERATIONS = 100


def bank_kind(springs: int) -> Kind:
    """
    Return the type of a bank with room for so many springs.

    Fields
    ------
    groups : int
        Groups of equal contacts, at most 6.
    first : array of int, shape (7,)
        Number of the first spring of each group; after the last group, of all springs.
    heights_m : array, shape (springs,)
        Depth at which a spring begins to press, rising within a group.
    normal_n_per_m, shear_n_per_m : array, shape (springs,)
        Stiffnesses, all contacts of a group together.
    area_n, slope_n_per_m : array, shape (springs,)
        Normal force of the group when a spring begins to press, and stiffness from there on: a
        table of the normal law.
    shares : array, shape (6,)
        Normal force of a group, all its contacts together, per preload.
    friction : float
        Friction coefficient mu.

    """
    per_spring = (FLOAT, (springs,))
    return kind(
        groups=COUNT,
        first=(COUNT, (GROUPS_MAX + 1,)),
        heights_m=per_spring,
        normal_n_per_m=per_spring,
        shear_n_per_m=per_spring,
        area_n=per_spring,
        slope_n_per_m=per_spring,
        shares=(FLOAT, (GROUPS_MAX,)),
        friction=FLOAT,
    )


BANK = bank_kind(SPRINGS_IN_ALL)


@kernel
def depth_at(bank: Record, group: int, preload_n: float) -> float:
    """Return the indentation depth of a group at a preload, m: the inverse normal law."""
    force_n = bank.shares[group] * preload_n
    low, high = bank.first[group], bank.first[group + 1] - 1
    while low < high:
        middle = (low + high + 1) // 2
        if bank.area_n[middle] <= force_n:
            low = middle
        else:
            high = middle - 1
    return bank.heights_m[low] + (force_n - bank.area_n[low]) / bank.slope_n_per_m[low]


@kernel
def drag(
    bank: Record, forces_n: Array, du_m: float, before_n: float, after_n: float
) -> tuple[float, float]:
    """
    Drag all springs, while the preload goes from one value to another.

    Parameters
    ----------
    bank : record of BANK
        Constants.
    forces_n : array, shape (springs,)
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
    for group in range(bank.groups):
        old_m = depth_at(bank, group, before_n)
        new_m = depth_at(bank, group, after_n) if after_n != before_n else old_m
        for i in range(bank.first[group], bank.first[group + 1]):
            height_m = bank.heights_m[i]
            stiffness = bank.friction * bank.normal_n_per_m[i]
            old_limit_n = stiffness * max(old_m - height_m, 0.0)
            limit_n = stiffness * max(new_m - height_m, 0.0)
            shear = bank.shear_n_per_m[i]
            trial_n = forces_n[i] + shear * du_m
            force_n = min(max(trial_n, -limit_n), limit_n)
            onset_n = min(max(trial_n, -old_limit_n), old_limit_n)
            if trial_n != force_n:
                lost_j += 0.5 * (onset_n + force_n) * (trial_n - force_n) / shear
            forces_n[i] = force_n
            total_n += force_n
    return total_n, lost_j


@kernel
def stored_in_springs(bank: Record, forces_n: Array) -> float:
    """Return the elastic energy of the springs, J."""
    energy_j = 0.0
    for i in range(bank.first[bank.groups]):
        if bank.shear_n_per_m[i] > 0.0:
            energy_j += 0.5 * forces_n[i] * forces_n[i] / bank.shear_n_per_m[i]
    return energy_j


@kernel
def friction_limit(bank: Record, preload_n: float) -> float:
    """Return the force of full slip at a preload, mu times the sum of the normal forces, N."""
    limit_n = 0.0
    for group in range(bank.groups):
        limit_n += bank.friction * bank.shares[group] * preload_n
    return limit_n


@kernel
def elongation(memory: Record, threshold_m: float) -> float:
    """Return the elongation that turning points give to a spring which slips at a threshold, m."""
    turns, depth, sense = memory.turns, memory.depth, memory.sense
    offset_m = memory.u_m - turns[depth, U]
    half_m = abs(offset_m) if depth == 0 else 0.5 * abs(offset_m)
    if threshold_m <= half_m:
        return sense * threshold_m
    for k in range(depth, 0, -1):
        outer_m = abs(turns[k, U] - turns[k - 1, U])
        if k > 1:
            outer_m *= 0.5
        if threshold_m <= outer_m:
            return -sense * threshold_m + memory.u_m - turns[k, U]
        sense = -sense
    return memory.u_m - turns[0, U]


@kernel
def take_over(
    bank: Record, compliance: float, memory: Record, preload_n: float, forces_n: Array
) -> None:
    """
    Load the springs as the turning points say, with the same sum of forces.

    Parameters
    ----------
    bank : record of BANK
        Constants.
    compliance : float
        mu C_M: presliding per depth.
    memory : record of MEMORY
        The turning points.
    preload_n : float
        Present preload, N.
    forces_n : array, shape (springs,)
        Receives the tangential forces.

    Notes
    -----
    A bank of few springs misses the continuum force by up to ``bank.BANK_ERROR``. A common
    displacement of all springs, found by bisection, takes that up: the force does not jump.

    """
    for group in range(bank.groups):
        depth_m = depth_at(bank, group, preload_n)
        for i in range(bank.first[group], bank.first[group + 1]):
            threshold_m = compliance * max(depth_m - bank.heights_m[i], 0.0)
            forces_n[i] = bank.shear_n_per_m[i] * elongation(memory, threshold_m)
    high_m = compliance * depth_at(bank, 0, preload_n)
    low_m = -high_m
    for _ in range(SHIFT_ITERATIONS):
        middle_m = 0.5 * (low_m + high_m)
        if _shifted_sum(bank, forces_n, preload_n, middle_m) < memory.force_n:
            low_m = middle_m
        else:
            high_m = middle_m
    drag(bank, forces_n, 0.5 * (low_m + high_m), preload_n, preload_n)


@kernel
def _shifted_sum(bank: Record, forces_n: Array, preload_n: float, shift_m: float) -> float:
    """Return what the sum of the forces would be after a common displacement, N."""
    total_n = 0.0
    for group in range(bank.groups):
        depth_m = depth_at(bank, group, preload_n)
        for i in range(bank.first[group], bank.first[group + 1]):
            pressed_m = max(depth_m - bank.heights_m[i], 0.0)
            limit_n = bank.friction * bank.normal_n_per_m[i] * pressed_m
            trial_n = forces_n[i] + bank.shear_n_per_m[i] * shift_m
            total_n += min(max(trial_n, -limit_n), limit_n)
    return total_n
