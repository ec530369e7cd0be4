"""Kernel: one short step of the drive, whatever its feet and its contacts are like."""

from stickslip_ros.contact.kernel import kernel
from stickslip_ros.contact.reaction import ContactState, react
from stickslip_ros.drive.feet import react_of_feet
from stickslip_ros.drive.ledger import book
from stickslip_ros.drive.records import DriveHistory, Plant, State
from stickslip_ros.drive.runner import force_on_runner, holding_force, kick_after, kick_before

VERLET_REFINEMENT = 8
"""Steps of velocity Verlet are so many times shorter than the long ones: second order, no look
ahead."""


@kernel
def step(
    plant: Plant,
    history: DriveHistory,
    state: State,
    voltage_v: float,
    foot_m: float,
    load_n: float,
    dt_s: float,
) -> State:
    """Advance the drive by one step, at the end of which piezo and feet are at given values."""
    before_n = force_on_runner(plant, state.position_m, state.contact.memory.force_n, load_n)
    middle_m_per_s = kick_before(plant, state.velocity_m_per_s, before_n, dt_s)
    if plant.stuck:
        middle_m_per_s = 0.0
    position_m = state.position_m + dt_s * middle_m_per_s

    foot_m_per_s = (foot_m - state.foot_m) / dt_s
    holding_n = holding_force(plant, position_m, middle_m_per_s, foot_m_per_s, load_n, dt_s)
    contact, work_j = _drag(plant, history, state, position_m, foot_m, dt_s, holding_n)

    after_n = force_on_runner(plant, position_m, contact.memory.force_n, load_n)
    velocity_m_per_s = kick_after(plant, middle_m_per_s, after_n, dt_s)
    if plant.stuck:
        velocity_m_per_s = 0.0

    sums = book(plant, state, position_m, velocity_m_per_s, work_j, load_n, dt_s)
    return State(state.clock, voltage_v, foot_m, position_m, velocity_m_per_s, contact, sums)


@kernel
def _drag(
    plant: Plant,
    history: DriveHistory,
    state: State,
    position_m: float,
    foot_m: float,
    dt_s: float,
    holding_n: float,
) -> tuple[ContactState, float]:
    """Return the contacts after a step, and the work that the feet have done in it, J."""
    if plant.feet.separate:
        return react_of_feet(plant, history.feet, state.contact, position_m, foot_m, dt_s)
    u_m = position_m - foot_m
    contact = react(plant.contact, history.contact, state.contact, u_m, dt_s, holding_n)
    mean_contact_n = 0.5 * (state.contact.memory.force_n + contact.memory.force_n)
    return contact, -(mean_contact_n * (foot_m - state.foot_m))
