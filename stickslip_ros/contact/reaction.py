# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Kernel: reaction of a contact to a relative motion, under any law.

A contact stands for all contacts that share one displacement: the six of an ideal drive together,
or that of a single foot. The contact model (MDR) has two representations. At constant preload the
memory of turning points is exact and fast. While the preload changes, a bank of springs is used;
it takes over from the turning points with the same force, and hands back at full slip, which is
the same state for both. A contact that ages stays on its springs. The rival laws use only the
friction limit.

"""

import math

from stickslip_ros.contact.ageing import AGEING
from stickslip_ros.contact.laws import COULOMB, LAW, MDR, bristles_towards, deflect
from stickslip_ros.contact.memory import (
    MEMORY,
    U,
    lost_energy,
    move,
    set_memory,
    stored_energy,
)
from stickslip_ros.contact.springs import (
    BANK,
    SLIP_SLACK,
    SPRINGS_STATE,
    friction_limit,
    load_springs,
    move_springs,
    slide_springs,
    stored_in_springs,
)
from stickslip_ros.contact.virgin import CURVE, virgin_energy
from stickslip_ros.kernels.kernel import kernel, noinline_kernel
from stickslip_ros.kernels.record import FLAG, FLOAT, Record, kind

ARRIVAL_SLACK = 1e-6
"""Rounding of a preload at the end of its ramp, relative to a step."""

CONTACT = kind(
    curve=CURVE,  # Tangential behaviour at the preload ``preload_n``
    bank=BANK,  # Springs for any preload
    law=LAW,  # Number of the law, and constants of the rival laws
    ageing=AGEING,  # Change of the friction coefficient
    # Wanted preload, and its rate
    preload_n=FLOAT,
    preload_n_per_s=FLOAT,
)
"""Constants of a contact."""

CONTACT_STATE = kind(
    memory=MEMORY,  # Displacement, force, friction loss, and the turning points
    on_springs=FLAG,  # Whether the springs, not the turning points, hold the history
    preload_n=FLOAT,  # Present preload
    window_m=FLOAT,  # Displacement at which travelling roughness came to rest
    bristle_m=FLOAT,  # Deflection of the bristles of a rival law
    slip_m_per_s=FLOAT,  # Mean slip speed of ageing springs in the last step
    answered_n_per_m=FLOAT,  # Stiffness of the springs in the last step
    springs=SPRINGS_STATE,  # Forces of the springs
)
"""State of a contact."""


def relax(contacts: Record, preload_n: float) -> Record:
    """Initialise zeros of CONTACT_STATE as contacts without shear; return them."""
    contacts['memory']['sense'] = 1.0
    contacts['preload_n'] = preload_n
    return contacts


@kernel
def remembers_turns(contact: Record, state: Record) -> bool:
    """Return whether the turning points hold the history."""
    return contact.law.number == MDR and not state.on_springs


@noinline_kernel
def react(contact: Record, state: Record, u_m: float, dt_s: float, holding_n: float) -> None:
    """
    Move a contact in a step to the displacement u_m of the runner against the feet.

    The holding force would prevent sliding; only Coulomb's law uses it.

    """
    if remembers_turns(contact, state):
        move(contact.curve, state.memory, u_m)
        return
    if contact.law.number != MDR:
        react_by_law(contact, state, u_m, dt_s, holding_n)
        return
    preload_n = next_preload(contact, state.preload_n, dt_s)
    before_n, way_m = state.memory.force_n, u_m - state.memory.u_m
    if way_m != 0.0:
        state.memory.sense = 1.0 if way_m > 0.0 else -1.0
    _react_by_springs(contact, state, u_m, dt_s, preload_n)
    state.preload_n = preload_n
    if way_m != 0.0:
        answered_n_per_m = (state.memory.force_n - before_n) / way_m
        stick_n_per_m = stick_stiffness(contact, state)
        state.answered_n_per_m = min(max(answered_n_per_m, 0.0), stick_n_per_m)


@kernel
def stick_stiffness(contact: Record, state: Record) -> float:
    """Return the stiffness of springs without slip, N/m."""
    bank = contact.bank
    friction, compliance = bank.friction[0], bank.compliance[0]
    normal_n_per_m = 0.0
    for group in range(bank.groups):
        # G*/E* of the group relative to the first group, exactly 1 for feet of one material.
        softness = (bank.friction[group] * compliance) / (friction * bank.compliance[group])
        normal_n_per_m += softness * bank.slope_n_per_m[state.springs.last[group]]
    return normal_n_per_m * friction / compliance


@kernel
def answer_towards(contact: Record, state: Record, direction: float) -> float:
    """Return the present stiffness of springs or bristles in a direction, N/m."""
    if contact.law.number != MDR:
        limit_n = friction_limit(contact.bank, state.preload_n)
        _, _, _, rate = bristles_towards(contact.law, limit_n, state.bristle_m, direction)
        return contact.law.bristle_n_per_m * max(rate, 0.0)
    if direction * state.memory.sense >= 0.0:
        return state.answered_n_per_m
    return stick_stiffness(contact, state)


@kernel
def next_preload(contact: Record, preload_n: float, dt_s: float) -> float:
    """Return the preload after a step towards its target, N."""
    largest_n = contact.preload_n_per_s * dt_s
    gap_n = contact.preload_n - preload_n
    if abs(gap_n) <= largest_n * (1.0 + ARRIVAL_SLACK):
        return contact.preload_n
    return preload_n + (largest_n if gap_n > 0.0 else -largest_n)


@kernel
def _react_by_springs(
    contact: Record, state: Record, u_m: float, dt_s: float, preload_n: float
) -> None:
    """Move the springs; hand back to the turning points at full slip."""
    curve, memory, ageing = contact.curve, state.memory, contact.ageing
    du_m, before_n = u_m - memory.u_m, state.preload_n
    if ageing.on and dt_s > 0.0:
        force_n, lost_j = slide_springs(
            contact.bank, ageing, state.springs, du_m, before_n, preload_n, dt_s
        )
        slip_m = du_m - (force_n - memory.force_n) / stick_stiffness(contact, state)
        state.slip_m_per_s = slip_m / dt_s
    else:
        force_n, lost_j = move_springs(contact.bank, state.springs, du_m, before_n, preload_n)
    lost_j += memory.lost_j
    slips = abs(force_n) >= (1.0 - SLIP_SLACK) * friction_limit(contact.bank, preload_n)
    # In full slip each spring is at its limit, so one turning point describes all of them, but
    # only at constant preload and friction.
    state.on_springs = not slips or preload_n != contact.preload_n or ageing.on
    if state.on_springs:
        set_memory(memory, u_m, force_n, memory.sense, lost_j, 0.0)
        return
    sense = 1.0 if force_n > 0.0 else -1.0
    virgin_loss_j = 2.0 * virgin_energy(curve, curve.limit_m) - curve.limit_m * curve.force_max_n
    memory.turns[0, U] = u_m - sense * curve.limit_m
    set_memory(memory, u_m, sense * curve.force_max_n, sense, lost_j, virgin_loss_j)


@kernel
def react_by_law(
    contact: Record, state: Record, u_m: float, dt_s: float, holding_n: float
) -> None:
    """Move a contact by a rival law."""
    memory = state.memory
    du_m = u_m - memory.u_m
    state.preload_n = next_preload(contact, state.preload_n, dt_s)
    limit_n = friction_limit(contact.bank, state.preload_n)
    if contact.law.number == COULOMB:
        force_n = min(max(holding_n, -limit_n), limit_n)
        lost_j = force_n * du_m
    else:
        bristle_m, force_n, lost_j = deflect(contact.law, limit_n, state.bristle_m, du_m, dt_s)
        state.bristle_m = bristle_m
    sense = math.copysign(1.0, du_m) if du_m != 0.0 else memory.sense
    set_memory(memory, u_m, force_n, sense, memory.lost_j + lost_j, 0.0)


@kernel
def switch_to_springs(contact: Record, state: Record) -> None:
    """Let the springs take over from the turning points, with the same force."""
    if not remembers_turns(contact, state):
        return
    memory = state.memory
    load_springs(contact.bank, memory, state.preload_n, state.springs)
    lost_j = lost_energy(contact.curve, memory)
    set_memory(memory, memory.u_m, memory.force_n, memory.sense, lost_j, 0.0)
    state.on_springs = True


@kernel
def contact_lost(contact: Record, state: Record) -> float:
    """Return the friction loss since the start, J."""
    if not remembers_turns(contact, state):
        return state.memory.lost_j
    return lost_energy(contact.curve, state.memory)


@kernel
def contact_stored(contact: Record, state: Record) -> float:
    """Return the elastic energy in the contact, J."""
    if contact.law.number != MDR:
        return 0.5 * contact.law.bristle_n_per_m * (state.bristle_m * state.bristle_m)
    if state.on_springs:
        return stored_in_springs(contact.bank, state.springs)
    return stored_energy(contact.curve, state.memory)
