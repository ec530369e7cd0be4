# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Kernel: memory of a frictional contact at constant load, as a stack of turning points.

At constant normal force a contact remembers only the displacements at which its motion turned and
that no larger loop has wiped out (Masing, Madelung). From a turning point (u*, T*) the force
follows T* -+ 2 T_v(|u - u*|/2). When a loop closes, the older branch continues as if the loop had
not happened. The result is the exact force of infinitely many springs.

The stack is bounded. When it is full, the pairs of turning points with the smallest effect are
forgotten. The signed force error of each turning point is known and kept below ``error_n``, which
starts at zero and grows only when a pair is forgotten.

"""

import math
from typing import NamedTuple

from stickslip_ros.arrays import Array
from stickslip_ros.contact.virgin import virgin_energy, virgin_force, virgin_stiffness
from stickslip_ros.kernels.kernel import kernel
from stickslip_ros.kernels.record import COUNT, FLOAT, Record, RecordKind, kind, record

CAPACITY = 1024
"""Turning points that a stack holds; `push_turn` forgets pairs before it overflows."""
FORGET_START = 1e-12
"""First force error allowed for a forgotten pair, relative to the maximal force; then fourfold."""

U, TURN_FORCE, TURN_ERROR = 0, 1, 2
"""Columns of ``turns``: displacement (m), force (N), known force error (N)."""


def memory_kind(capacity: int) -> RecordKind:
    """Return the type of a memory of a number of turning points."""
    return kind(
        u_m=FLOAT,  # Relative displacement of the runner against the feet, m
        force_n=FLOAT,  # Sum of the spring forces T, N; the runner feels -T
        depth=COUNT,  # Turning points on the stack; row 0 of ``turns`` is the virgin origin
        sense=FLOAT,  # +1 or -1: direction of the current branch
        # Friction loss up to the start of the current stretch of the current branch, J
        lost_j=FLOAT,
        # Loss of the current branch from its turning point to the start of that stretch, J
        base_j=FLOAT,
        error_n=FLOAT,  # Bound of the force error from forgotten turning points, N
        turns=(FLOAT, (capacity, 3)),  # The stack
    )


MEMORY = memory_kind(CAPACITY)


def fresh_memory(u_m: float = 0.0, capacity: int = CAPACITY) -> Record:
    """Return the memory of a contact without history at a displacement, m."""
    memory = record(memory_kind(capacity), u_m=u_m, sense=1.0)
    memory.turns[0, U] = u_m
    return memory


@kernel
def set_memory(
    memory: Record, u_m: float, force_n: float, sense: float, lost_j: float, base_j: float
) -> None:
    """Clear all turning points, and set displacement, force, direction and losses."""
    memory.u_m = u_m
    memory.force_n = force_n
    memory.depth = 0
    memory.sense = sense
    memory.lost_j = lost_j
    memory.base_j = base_j
    memory.error_n = 0.0


@kernel
def move(curve: Record, memory: Record, u_m: float) -> None:
    """Move a contact monotonically to u_m; O(1) amortised."""
    if (u_m - memory.u_m) * memory.sense < 0.0:
        reverse(curve, memory, u_m)
    while memory.depth > 0 and memory.sense * (u_m - memory.turns[memory.depth, U]) >= loop_length(
        memory.turns, memory.depth
    ):
        close_loop(curve, memory)
    if memory.depth == 0:
        memory.force_n = follow_virgin(curve, memory, u_m)
    else:
        # Masing's rule: the virgin curve at twice its size, from the turning point.
        travel_m = memory.sense * (u_m - memory.turns[memory.depth, U])
        folded_n = memory.sense * 2.0 * virgin_force(curve, 0.5 * travel_m)
        memory.force_n = memory.turns[memory.depth, TURN_FORCE] + folded_n
    memory.u_m = u_m


@kernel
def follow_virgin(curve: Record, memory: Record, u_m: float) -> float:
    """Return the force on the virgin curve, N; in full slip its origin moves along."""
    offset_m = u_m - memory.turns[0, U]
    memory.sense = 1.0 if offset_m >= 0.0 else -1.0
    slip_m = max(abs(offset_m) - curve.limit_m, 0.0)
    memory.turns[0, U] += memory.sense * slip_m
    memory.lost_j += slip_m * curve.force_max_n
    travel_m = memory.sense * (u_m - memory.turns[0, U])
    return memory.sense * virgin_force(curve, travel_m)


@kernel
def loop_length(turns: Array, depth: int) -> float:
    """Return the travel after which the loop of a turning point is closed, m."""
    length_m = abs(turns[depth, U] - turns[depth - 1, U])
    # The first turning point is on the virgin curve: its loop closes at the mirrored point.
    return 2.0 * length_m if depth == 1 else length_m


@kernel
def branch_loss(curve: Record, depth: int, travel_m: float) -> float:
    """Return the friction loss on a branch, from its turning point on, J."""
    if depth == 0:
        force_n = virgin_force(curve, travel_m)
        return 2.0 * virgin_energy(curve, travel_m) - travel_m * force_n
    half_m = 0.5 * travel_m
    force_n = virgin_force(curve, half_m)
    return 4.0 * virgin_energy(curve, half_m) - 2.0 * half_m * force_n


@kernel
def reverse(curve: Record, memory: Record, u_m: float) -> None:
    """Reverse: push a turning point unless the branch is still in its linear core."""
    travel_m = abs(memory.u_m - memory.turns[memory.depth, U])
    # In its core a branch is straight, so a reversal goes back on it without loss.
    core_m = curve.core_m if memory.depth == 0 else 2.0 * curve.core_m
    if travel_m > core_m:
        push_turn(curve, memory)
        return
    crosses = memory.sense * (u_m - memory.turns[memory.depth, U]) < 0.0
    if memory.depth == 0 or not crosses:
        return
    memory.lost_j -= memory.base_j
    memory.sense = -memory.sense
    resume_branch(curve, memory, memory.depth - 1)


@kernel
def push_turn(curve: Record, memory: Record) -> None:
    """Push the present point on the stack and start a branch in the other direction."""
    turns = memory.turns
    if memory.depth + 1 == turns.shape[0]:
        forget_pairs(curve, memory)
    depth = memory.depth
    travel_m = abs(memory.u_m - turns[depth, U])
    memory.lost_j = memory.lost_j + branch_loss(curve, depth, travel_m) - memory.base_j
    turns[depth + 1, U] = memory.u_m
    turns[depth + 1, TURN_FORCE] = memory.force_n
    turns[depth + 1, TURN_ERROR] = turns[depth, TURN_ERROR]
    memory.depth = depth + 1
    memory.sense = -memory.sense
    memory.base_j = 0.0


@kernel
def close_loop(curve: Record, memory: Record) -> None:
    """Wipe out the innermost loop and resume the branch that it interrupted."""
    depth = memory.depth
    loop_j = branch_loss(curve, depth, loop_length(memory.turns, depth))
    memory.lost_j = memory.lost_j + loop_j - memory.base_j
    # Both ends of a closed loop are forgotten: the force continues as without the loop.
    resume_branch(curve, memory, max(depth - 2, 0))


@kernel
def resume_branch(curve: Record, memory: Record, older: int) -> None:
    """Continue on an older branch, from the turning point after it."""
    travel_m = abs(memory.turns[older + 1, U] - memory.turns[older, U])
    memory.base_j = branch_loss(curve, older, travel_m)
    memory.depth = older


@kernel
def forget_pairs(curve: Record, memory: Record) -> None:
    """Halve a full stack by forgetting the pairs of turning points with the smallest effect."""
    turns = memory.turns
    half = turns.shape[0] // 2
    allowance_n = FORGET_START * curve.force_max_n
    depth = memory.depth
    while depth > half and allowance_n < math.inf:
        depth = _sweep(curve, turns, depth, allowance_n)
        allowance_n *= 4.0
    depth = min(depth, half)  # with NaN forces nothing is forgotten
    memory.force_n = memory.force_n + turns[depth, TURN_ERROR] - turns[memory.depth, TURN_ERROR]
    memory.depth = depth
    memory.error_n = max(memory.error_n, 2.0 * allowance_n / 4.0)


@kernel
def _sweep(curve: Record, turns: Array, depth: int, allowance_n: float) -> int:
    """
    Drop pairs of inner turning points while the force errors stay within the allowance.

    Without the points j and j+1 the branches j-1 and j+2 are joined. Virgin forces give the change
    of the force on branch j+2. A pair is dropped only if this change, and the sum of all changes
    so far, are within the allowance.

    """
    kept = 1
    shift_n = 0.0
    j = 2
    while j <= depth:
        change_n = 0.0
        forgets = j + 2 <= depth
        if forgets:
            outer_m = 0.5 * abs(turns[j, U] - turns[kept, U])
            middle_m = 0.5 * abs(turns[j + 1, U] - turns[j, U])
            inner_m = 0.5 * abs(turns[j + 2, U] - turns[j + 1, U])
            forces_n = (
                virgin_force(curve, outer_m - middle_m + inner_m)
                - virgin_force(curve, outer_m)
                + virgin_force(curve, middle_m)
                - virgin_force(curve, inner_m)
            )
            change_n = 2.0 * forces_n * (1.0 if turns[j, U] > turns[kept, U] else -1.0)
            total_n = turns[j + 2, TURN_ERROR] + shift_n + change_n
            forgets = abs(change_n) <= allowance_n and abs(total_n) <= allowance_n
        if forgets:
            shift_n += change_n
            j += 2
        else:
            kept += 1
            turns[kept, U] = turns[j, U]
            turns[kept, TURN_FORCE] = turns[j, TURN_FORCE] + shift_n
            turns[kept, TURN_ERROR] = turns[j, TURN_ERROR] + shift_n
            j += 1
    return kept


class Branch(NamedTuple):
    """A branch of the force-displacement curve: T = force + sense fold T_v(travel / fold)."""

    # turning point at its start; force 0 on the virgin curve
    origin_m: float
    force_n: float
    sense: float  # direction, +1 or -1
    # 2 on a Masing branch, 1 on the virgin curve; and the inverse
    fold: float
    unfold: float
    reach_m: float  # travel at which a loop closes and the branch ends


@kernel
def branch_towards(curve: Record, memory: Record, direction: float) -> Branch:
    """Return the branch of a motion in a direction from the present point."""
    turns, depth, sense = memory.turns, memory.depth, memory.sense
    origin_m, fold = turns[depth, U], 1.0 if depth == 0 else 2.0
    travel_m = abs(memory.u_m - origin_m)
    if direction * sense < 0.0 and travel_m > fold * curve.core_m:
        reach_m = 2.0 * travel_m if depth == 0 else travel_m
        return Branch(memory.u_m, memory.force_n, -sense, 2.0, 0.5, reach_m)
    if depth == 0:
        return Branch(origin_m, 0.0, sense, 1.0, 1.0, math.inf)
    return Branch(origin_m, turns[depth, TURN_FORCE], sense, 2.0, 0.5, loop_length(turns, depth))


@kernel
def stiffness_on(curve: Record, branch: Branch, u_m: float) -> float:
    """Return the tangent stiffness of a branch at a displacement, N/m."""
    return virgin_stiffness(curve, abs(u_m - branch.origin_m) * branch.unfold)


@kernel
def force_ahead(curve: Record, memory: Record, branch: Branch, u_m: float) -> float:
    """Return the force after a motion to a displacement, N, without changing the memory."""
    travel_m = branch.sense * (u_m - branch.origin_m)
    if 0.0 <= travel_m < branch.reach_m:
        folded_n = branch.fold * virgin_force(curve, travel_m * branch.unfold)
        return branch.force_n + branch.sense * folded_n
    return force_after_closing(curve, memory, u_m)


@kernel
def force_after_closing(curve: Record, memory: Record, u_m: float) -> float:
    """Return the force after a motion that closes at least one loop, N."""
    direction = 1.0 if u_m > memory.u_m else -1.0
    turns, depth = memory.turns, memory.depth
    if direction != memory.sense:
        depth = max(depth - 1, 0)
    while depth > 0 and direction * (u_m - turns[depth, U]) >= loop_length(turns, depth):
        depth = max(depth - 2, 0)
    offset_m = u_m - turns[depth, U]
    if depth == 0:
        return math.copysign(virgin_force(curve, abs(offset_m)), offset_m)
    return turns[depth, TURN_FORCE] + direction * 2.0 * virgin_force(curve, 0.5 * abs(offset_m))


@kernel
def lost_energy(curve: Record, memory: Record) -> float:
    """Return the friction loss since the start, J."""
    travel_m = abs(memory.u_m - memory.turns[memory.depth, U])
    return memory.lost_j + branch_loss(curve, memory.depth, travel_m) - memory.base_j


@kernel
def stored_energy(curve: Record, memory: Record) -> float:
    """
    Return the elastic energy in the springs, J; O(depth).

    Notes
    -----
    An element that slips at w has the density p(w) = -T_v''(w) and the elongation e(w). Between
    two half loop widths e = +-w + (u - u_k); beyond the largest e = u - u_0. The energy is the
    integral of p e^2 / 2.

    """
    turns = memory.turns
    half_m = 0.5 * memory.sense * (memory.u_m - turns[memory.depth, U])
    if memory.depth == 0:
        half_m *= 2.0
    energy_j = _energy_between(curve, 0.0, half_m, 1.0, 0.0)
    sense = memory.sense
    for k in range(memory.depth, 0, -1):
        outer_m = 0.5 * abs(turns[k, U] - turns[k - 1, U])
        if k == 1:
            outer_m *= 2.0
        energy_j += _energy_between(curve, half_m, outer_m, -sense, memory.u_m - turns[k, U])
        sense = -sense
        half_m = outer_m
    return energy_j + _energy_between(curve, half_m, curve.limit_m, 0.0, memory.u_m - turns[0, U])


@kernel
def _energy_between(
    curve: Record, inner_m: float, outer_m: float, slope: float, shift_m: float
) -> float:
    """Return the energy of the elements inner < w < outer with elongation slope w + shift, J."""
    moments = _moments(curve, outer_m)
    inner = _moments(curve, inner_m)
    return 0.5 * (
        slope * slope * (moments[2] - inner[2])
        + 2.0 * slope * shift_m * (moments[1] - inner[1])
        + shift_m * shift_m * (moments[0] - inner[0])
    )


@kernel
def _moments(curve: Record, w_m: float) -> tuple[float, float, float]:
    """Return the integrals of p, p w and p w^2 from 0 to w, with p = -T_v''."""
    force_n = virgin_force(curve, w_m)
    stiffness = virgin_stiffness(curve, w_m)
    energy_j = virgin_energy(curve, w_m)
    return (
        curve.cells[0, 1] - stiffness,
        force_n - w_m * stiffness,
        2.0 * (w_m * force_n - energy_j) - w_m * w_m * stiffness,
    )


@kernel
def elongation(memory: Record, threshold_m: float) -> float:
    """Return the elongation of a spring that slips at a threshold, m, from the turning points."""
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
