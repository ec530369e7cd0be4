"""Kernel: look along the branch on which a contact moves on, without moving it."""

import math
from typing import NamedTuple

from stickslip_ros.contact.kernel import kernel
from stickslip_ros.contact.memory import FORCE, U, loop_length
from stickslip_ros.contact.record import Record
from stickslip_ros.contact.virgin import virgin_force, virgin_stiffness


class Branch(NamedTuple):
    """
    A stretch of the force-displacement curve: T = force + sense fold T_v(travel / fold).

    Attributes
    ----------
    origin_m, force_n : float
        Turning point from which it starts; force 0 on the virgin curve.
    sense : float
        +1 or -1: its direction.
    fold, unfold : float
        2 on a Masing branch, 1 on the virgin curve; and its inverse.
    reach_m : float
        Travel at which it ends, because a loop closes.

    """

    origin_m: float
    force_n: float
    sense: float
    fold: float
    unfold: float
    reach_m: float


@kernel
def present_branch(memory: Record) -> Branch:
    """Return the branch on which the contact is."""
    turns, depth, sense = memory.turns, memory.depth, memory.sense
    if depth == 0:
        return Branch(turns[0, U], 0.0, sense, 1.0, 1.0, math.inf)
    return Branch(turns[depth, U], turns[depth, FORCE], sense, 2.0, 0.5, loop_length(turns, depth))


@kernel
def branch_towards(curve: Record, memory: Record, direction: float) -> Branch:
    """Return the branch along which the contact goes if it moves in a direction now."""
    present = present_branch(memory)
    travel_m = abs(memory.u_m - present.origin_m)
    if direction * memory.sense >= 0.0 or travel_m <= present.fold * curve.core_m:
        return present
    reach_m = 2.0 * travel_m if memory.depth == 0 else travel_m
    return Branch(memory.u_m, memory.force_n, -memory.sense, 2.0, 0.5, reach_m)


@kernel
def stiffness_on(curve: Record, branch: Branch, u_m: float) -> float:
    """Return the tangent stiffness of a branch at a displacement, N/m."""
    return virgin_stiffness(curve, abs(u_m - branch.origin_m) * branch.unfold)


@kernel
def force_ahead(curve: Record, memory: Record, branch: Branch, u_m: float) -> float:
    """Return the force at a displacement near the branch, N, as if the contact had gone there."""
    travel_m = branch.sense * (u_m - branch.origin_m)
    if 0.0 <= travel_m < branch.reach_m:
        folded_n = branch.fold * virgin_force(curve, travel_m * branch.unfold)
        return branch.force_n + branch.sense * folded_n
    return _force_after_closing(curve, memory, u_m)


@kernel
def _force_after_closing(curve: Record, memory: Record, u_m: float) -> float:
    """Return the force at a displacement that lies beyond the closing of at least one loop, N."""
    direction = 1.0 if u_m > memory.u_m else -1.0
    turns, depth = memory.turns, memory.depth
    if direction != memory.sense:
        depth = max(depth - 1, 0)
    while depth > 0 and direction * (u_m - turns[depth, U]) >= loop_length(turns, depth):
        depth = max(depth - 2, 0)
    offset_m = u_m - turns[depth, U]
    if depth == 0:
        return math.copysign(virgin_force(curve, abs(offset_m)), offset_m)
    return turns[depth, FORCE] + direction * 2.0 * virgin_force(curve, 0.5 * abs(offset_m))
