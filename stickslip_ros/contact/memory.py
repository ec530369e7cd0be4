"""
Kernel: the memory of a frictional contact at constant load, as a stack of turning points.

A contact whose normal force is constant remembers only the displacements at which its motion
turned, and of these only the ones that no larger loop has wiped out (Masing, Madelung). From a
turning point (u*, T*) the force runs along T* -+ 2 T_v(|u - u*|/2); where a loop closes, the
older branch goes on as if the loop had never been. This is the exact force of infinitely many
springs, at a cost that does not depend on how many there are.

The stack is bounded. When it is full, the pairs of turning points that matter least are
forgotten; the signed force error of that is known and kept for each turning point, and it is
steered so that it never exceeds ``Memory.error_n``, which starts at zero and grows only when
a pair is forgotten.

"""

import math
from typing import NamedTuple

import numpy as np

from stickslip_ros.contact.kernel import kernel
from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.virgin import VirginCurve, virgin_energy, virgin_force

CAPACITY = 1024
"""Turning points that a stack holds."""
FORGET_START = 1e-12
"""First allowance for a forgotten pair, relative to the maximal force; quadrupled as needed."""

U, FORCE, ERROR = 0, 1, 2
"""Columns of the stack: displacement (m), force (N), known force error (N)."""


class Memory(NamedTuple):
    """
    State of the contact besides its stack of turning points.

    Attributes
    ----------
    u_m : float
        Relative displacement of the runner against the feet, m.
    force_n : float
        Sum of the spring forces T, N; the runner feels -T.
    depth : int
        Turning points on the stack; row 0 of the stack is the virgin origin.
    sense : float
        +1 or -1: the direction in which the current branch runs.
    lost_j : float
        Friction loss up to the start of the current stretch of the current branch, J.
    base_j : float
        Loss of the current branch from its turning point to the start of that stretch, J.
    error_n : float
        Bound of the force error by forgotten turning points, N.

    """

    u_m: float
    force_n: float
    depth: int
    sense: float
    lost_j: float
    base_j: float
    error_n: float


def fresh_stack() -> Array:
    """Return an empty stack of turning points, shape (CAPACITY, 3)."""
    return np.zeros((CAPACITY, 3))


def relax(stack: Array, u_m: float) -> Memory:
    """Empty the stack and return the state of a contact brought together at u_m without shear."""
    stack[:] = 0.0
    stack[0, U] = u_m
    return Memory(float(u_m), 0.0, 0, 1.0, 0.0, 0.0, 0.0)


@kernel
def move(curve: VirginCurve, stack: Array, memory: Memory, u_m: float) -> Memory:
    """
    Return the state after a monotonic motion to u_m; O(1) amortised.

    Parameters
    ----------
    curve : VirginCurve
        The operator.
    stack : array, shape (CAPACITY, 3)
        Turning points; changed in place.
    memory : Memory
        State before.
    u_m : float
        New displacement, m.

    """
    if (u_m - memory.u_m) * memory.sense < 0.0:
        memory = _reverse(curve, stack, memory, u_m)
    while memory.depth > 0 and memory.sense * (u_m - stack[memory.depth, U]) >= loop_length(
        stack, memory.depth
    ):
        memory = _close_loop(curve, stack, memory)
    if memory.depth == 0:
        memory = _follow_virgin(curve, stack, memory, u_m)
    return Memory(
        u_m,
        _branch_force(curve, stack, memory, u_m),
        memory.depth,
        memory.sense,
        memory.lost_j,
        memory.base_j,
        memory.error_n,
    )


@kernel
def _branch_force(curve: VirginCurve, stack: Array, memory: Memory, u_m: float) -> float:
    """Return the force at u_m on the current branch, N."""
    travel_m = memory.sense * (u_m - stack[memory.depth, U])
    if memory.depth == 0:
        return memory.sense * virgin_force(curve, travel_m)
    half_n = virgin_force(curve, 0.5 * travel_m)
    return stack[memory.depth, FORCE] + memory.sense * 2.0 * half_n


@kernel
def loop_length(stack: Array, depth: int) -> float:
    """Return the travel after which the loop of a turning point is closed, m."""
    length_m = abs(stack[depth, U] - stack[depth - 1, U])
    return 2.0 * length_m if depth == 1 else length_m


@kernel
def branch_loss(curve: VirginCurve, depth: int, travel_m: float) -> float:
    """Return the friction loss on a branch, from its turning point on, J."""
    if depth == 0:
        force_n = virgin_force(curve, travel_m)
        return 2.0 * virgin_energy(curve, travel_m) - travel_m * force_n
    half_m = 0.5 * travel_m
    force_n = virgin_force(curve, half_m)
    return 4.0 * virgin_energy(curve, half_m) - 2.0 * half_m * force_n


@kernel
def _reverse(curve: VirginCurve, stack: Array, memory: Memory, u_m: float) -> Memory:
    """Turn round: remember the turning point, unless the branch is still in its linear core."""
    travel_m = abs(memory.u_m - stack[memory.depth, U])
    core_m = curve.core_m if memory.depth == 0 else 2.0 * curve.core_m
    if travel_m > core_m:
        return _push(curve, stack, memory)
    crosses = memory.sense * (u_m - stack[memory.depth, U]) < 0.0
    if memory.depth == 0 or not crosses:
        return memory
    older = memory.depth - 1
    resumed_j = branch_loss(curve, older, abs(stack[older + 1, U] - stack[older, U]))
    lost_j = memory.lost_j - memory.base_j
    return Memory(
        memory.u_m, memory.force_n, older, -memory.sense, lost_j, resumed_j, memory.error_n
    )


@kernel
def _push(curve: VirginCurve, stack: Array, memory: Memory) -> Memory:
    """Put the present point on the stack and start a branch in the other direction."""
    if memory.depth + 1 == len(stack):
        memory = _forget(curve, stack, memory)
    depth = memory.depth
    travel_m = abs(memory.u_m - stack[depth, U])
    lost_j = memory.lost_j + branch_loss(curve, depth, travel_m) - memory.base_j
    stack[depth + 1, U] = memory.u_m
    stack[depth + 1, FORCE] = memory.force_n
    stack[depth + 1, ERROR] = stack[depth, ERROR]
    return Memory(
        memory.u_m, memory.force_n, depth + 1, -memory.sense, lost_j, 0.0, memory.error_n
    )


@kernel
def _close_loop(curve: VirginCurve, stack: Array, memory: Memory) -> Memory:
    """Wipe out the innermost loop and resume the branch that it interrupted."""
    depth = memory.depth
    length_m = loop_length(stack, depth)
    lost_j = memory.lost_j + branch_loss(curve, depth, length_m) - memory.base_j
    older = max(depth - 2, 0)
    resumed_j = branch_loss(curve, older, abs(stack[older + 1, U] - stack[older, U]))
    return Memory(
        memory.u_m, memory.force_n, older, memory.sense, lost_j, resumed_j, memory.error_n
    )


@kernel
def _follow_virgin(curve: VirginCurve, stack: Array, memory: Memory, u_m: float) -> Memory:
    """Prepare the virgin curve: in full slip, past its end, its origin slides along."""
    offset_m = u_m - stack[0, U]
    sense = 1.0 if offset_m >= 0.0 else -1.0
    slip_m = max(abs(offset_m) - curve.limit_m, 0.0)
    stack[0, U] += sense * slip_m
    lost_j = memory.lost_j + slip_m * curve.force_max_n
    return Memory(memory.u_m, memory.force_n, 0, sense, lost_j, memory.base_j, memory.error_n)


@kernel
def _forget(curve: VirginCurve, stack: Array, memory: Memory) -> Memory:
    """Halve a full stack by forgetting the pairs of turning points that matter least."""
    allowance_n = FORGET_START * curve.force_max_n
    depth = memory.depth
    while depth > len(stack) // 2 and allowance_n < math.inf:
        depth = _sweep(curve, stack, depth, allowance_n)
        allowance_n *= 4.0
    depth = min(depth, len(stack) // 2)  # of forces that are no numbers nothing is forgotten
    force_n = memory.force_n + stack[depth, ERROR] - stack[memory.depth, ERROR]
    error_n = max(memory.error_n, 2.0 * allowance_n / 4.0)
    return Memory(memory.u_m, force_n, depth, memory.sense, memory.lost_j, memory.base_j, error_n)


@kernel
def _sweep(curve: VirginCurve, stack: Array, depth: int, allowance_n: float) -> int:
    """
    Drop pairs of inner turning points, keeping each known force error within the allowance.

    Forgetting the points j and j+1 joins the branches j-1 and j+2. The force on the latter
    changes by an amount that three virgin forces give; a pair is forgotten only if that
    amount, and the sum of all such amounts up to here, stay within the allowance.

    """
    kept = 1
    shift_n = 0.0
    j = 2
    while j <= depth:
        change_n = 0.0
        forgets = j + 2 <= depth
        if forgets:
            outer_m = 0.5 * abs(stack[j, U] - stack[kept, U])
            middle_m = 0.5 * abs(stack[j + 1, U] - stack[j, U])
            inner_m = 0.5 * abs(stack[j + 2, U] - stack[j + 1, U])
            forces_n = (
                virgin_force(curve, outer_m - middle_m + inner_m)
                - virgin_force(curve, outer_m)
                + virgin_force(curve, middle_m)
                - virgin_force(curve, inner_m)
            )
            change_n = 2.0 * forces_n * (1.0 if stack[j, U] > stack[kept, U] else -1.0)
            total_n = stack[j + 2, ERROR] + shift_n + change_n
            forgets = abs(change_n) <= allowance_n and abs(total_n) <= allowance_n
        if forgets:
            shift_n += change_n
            j += 2
        else:
            kept += 1
            stack[kept, U] = stack[j, U]
            stack[kept, FORCE] = stack[j, FORCE] + shift_n
            stack[kept, ERROR] = stack[j, ERROR] + shift_n
            j += 1
    return kept
