"""
Kernel: how the contacts answer a relative motion, whatever law holds; one call for all.

With the contact model (MDR) there are two ways. At constant preload the memory of turning points
is exact and fast. While the preload changes, and until a full slip has wiped out what happened
meanwhile, a bank of springs is right; it takes over from the turning points with the same force,
and full slip is the same state for both. The rival laws know only the friction limit.

"""

from typing import NamedTuple

import numpy as np

from stickslip_ros.contact.kernel import kernel
from stickslip_ros.contact.laws import COULOMB, MDR, FrictionLaw, deflect
from stickslip_ros.contact.memory import Memory, U, fresh_stack, move, relax
from stickslip_ros.contact.memory_energy import lost_energy, stored_energy
from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.springs import (
    SLIP_SLACK,
    SpringBank,
    drag,
    friction_limit,
    stored_in_springs,
    take_over,
)
from stickslip_ros.contact.virgin import VirginCurve, virgin_energy

ARRIVAL_SLACK = 1e-6
"""Share of a step by which a preload may miss its end, for the rounding of many steps."""


class ContactModel(NamedTuple):
    """
    Constants of all contacts together.

    Attributes
    ----------
    curve : VirginCurve
        Tangential behaviour at the preload ``preload_n``.
    bank : SpringBank
        Springs for any preload.
    law : FrictionLaw
        Which law holds, and the constants of the rival laws.
    compliance : float
        mu C_M: presliding per depth.
    preload_n, preload_n_per_s : float
        Preload to go to, and how fast.

    """

    curve: VirginCurve
    bank: SpringBank
    law: FrictionLaw
    compliance: float
    preload_n: float
    preload_n_per_s: float


class History(NamedTuple):
    """
    What the contacts remember, in arrays that kernels change in place.

    Attributes
    ----------
    stack : array, shape (CAPACITY, 3)
        Turning points.
    springs : array, shape (groups, springs)
        Tangential forces of the spring bank, N.

    """

    stack: Array
    springs: Array


class ContactState(NamedTuple):
    """
    State of the contacts besides their history.

    Attributes
    ----------
    memory : Memory
        Displacement, force, friction loss, and the state of the stack.
    on_springs : bool
        Whether the spring bank, not the stack, holds the history.
    preload_n : float
        Present preload.
    bristle_m : float
        Deflection of the bristles of a rival law.

    """

    memory: Memory
    on_springs: bool
    preload_n: float
    bristle_m: float


def fresh_history(model: ContactModel) -> History:
    """Return the arrays of a history, empty."""
    return History(fresh_stack(), np.zeros_like(model.bank.heights_m))


def relaxed(history: History, preload_n: float) -> ContactState:
    """Empty a history and return contacts without shear at the displacement 0."""
    history.springs[:] = 0.0
    return ContactState(relax(history.stack, 0.0), False, float(preload_n), 0.0)


def onto_springs(model: ContactModel, history: History, state: ContactState) -> ContactState:
    """
    Return the state in which the springs have taken over from the stack, with the same force.

    A state that is on springs already, or of a rival law, is returned as it is.

    """
    if state.on_springs or model.law.number != MDR:
        return state
    memory = state.memory
    take_over(
        model.bank, model.compliance, history.stack, memory, state.preload_n, history.springs
    )
    lost_j = lost_energy(model.curve, history.stack, memory)
    memory = Memory(memory.u_m, memory.force_n, 0, memory.sense, lost_j, 0.0, 0.0)
    return ContactState(memory, True, state.preload_n, state.bristle_m)


@kernel
def react(
    model: ContactModel,
    history: History,
    state: ContactState,
    u_m: float,
    dt_s: float,
    holding_n: float,
) -> ContactState:
    """
    Return the contacts after one step.

    Parameters
    ----------
    model : ContactModel
        Constants.
    history : History
        Changed in place.
    state : ContactState
        State before.
    u_m : float
        Relative displacement of the runner against the feet at the end of the step, m.
    dt_s : float
        Time of the step, s.
    holding_n : float
        Force with which the runner would keep the velocity of the feet, N; for Coulomb's law.

    """
    if remembers_turns(model, state):
        return move_on_stack(model, history, state, u_m)
    preload_n = next_preload(model, state.preload_n, dt_s)
    if model.law.number == MDR:
        return _react_by_springs(model, history, state, u_m, preload_n)
    return _react_by_law(model, state, u_m, dt_s, holding_n, preload_n)


@kernel
def remembers_turns(model: ContactModel, state: ContactState) -> bool:
    """Tell whether the stack of turning points holds the history."""
    return model.law.number == MDR and not state.on_springs


@kernel
def move_on_stack(
    model: ContactModel, history: History, state: ContactState, u_m: float
) -> ContactState:
    """Return contacts that remember turning points after a monotonic motion to u_m."""
    memory = move(model.curve, history.stack, state.memory, u_m)
    return ContactState(memory, False, state.preload_n, state.bristle_m)


@kernel
def next_preload(model: ContactModel, preload_n: float, dt_s: float) -> float:
    """Return the preload after a step towards the wanted one, N."""
    largest_n = model.preload_n_per_s * dt_s
    gap_n = model.preload_n - preload_n
    if abs(gap_n) <= largest_n * (1.0 + ARRIVAL_SLACK):
        return model.preload_n
    return preload_n + (largest_n if gap_n > 0.0 else -largest_n)


@kernel
def _react_by_springs(
    model: ContactModel, history: History, state: ContactState, u_m: float, preload_n: float
) -> ContactState:
    """Drag the springs; hand back to the stack in the moment of full slip."""
    old = state.memory
    force_n, lost_j = drag(model.bank, history.springs, u_m - old.u_m, state.preload_n, preload_n)
    lost_j += old.lost_j
    slips = abs(force_n) >= (1.0 - SLIP_SLACK) * friction_limit(model.bank, preload_n)
    if not slips or preload_n != model.preload_n:
        memory = Memory(u_m, force_n, 0, old.sense, lost_j, 0.0, 0.0)
        return ContactState(memory, True, preload_n, state.bristle_m)
    sense = 1.0 if force_n > 0.0 else -1.0
    curve = model.curve
    history.stack[0, U] = u_m - sense * curve.limit_m
    virgin_loss_j = 2.0 * virgin_energy(curve, curve.limit_m) - curve.limit_m * curve.force_max_n
    memory = Memory(u_m, sense * curve.force_max_n, 0, sense, lost_j, virgin_loss_j, 0.0)
    return ContactState(memory, False, preload_n, state.bristle_m)


@kernel
def _react_by_law(
    model: ContactModel,
    state: ContactState,
    u_m: float,
    dt_s: float,
    holding_n: float,
    preload_n: float,
) -> ContactState:
    """Let a rival law answer."""
    old = state.memory
    du_m = u_m - old.u_m
    limit_n = friction_limit(model.bank, preload_n)
    bristle_m = state.bristle_m
    if model.law.number == COULOMB:
        force_n = min(max(holding_n, -limit_n), limit_n)
        lost_j = 0.5 * (old.force_n + force_n) * du_m
    else:
        bristle_m, force_n, lost_j = deflect(model.law, limit_n, bristle_m, du_m, dt_s)
    memory = Memory(u_m, force_n, 0, old.sense, old.lost_j + lost_j, 0.0, 0.0)
    return ContactState(memory, False, preload_n, bristle_m)


@kernel
def contact_lost(model: ContactModel, history: History, state: ContactState) -> float:
    """Return the friction loss since the start, J."""
    if model.law.number != MDR or state.on_springs:
        return state.memory.lost_j
    return lost_energy(model.curve, history.stack, state.memory)


@kernel
def contact_stored(model: ContactModel, history: History, state: ContactState) -> float:
    """Return the elastic energy in the contacts, J."""
    if model.law.number != MDR:
        return 0.5 * model.law.bristle_n_per_m * (state.bristle_m * state.bristle_m)
    if state.on_springs:
        return stored_in_springs(model.bank, history.springs)
    return stored_energy(model.curve, history.stack, state.memory)
