"""Kernel: make six feet out of one that has stood for them all."""

from stickslip_ros.contact.kernel import entry_point, kernel
from stickslip_ros.contact.laws import MDR
from stickslip_ros.contact.memory import Memory, move
from stickslip_ros.contact.memory import U as TURN
from stickslip_ros.contact.memory_energy import lost_energy
from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.reaction import (
    ContactState,
    contact_lost,
    remembers_turns,
)
from stickslip_ros.contact.virgin import VirginCurve
from stickslip_ros.drive.feet import LOST, PLACE, contact_of, keep_state
from stickslip_ros.drive.records import DriveHistory, Plant
from stickslip_ros.drive.stages import FEET, GROUP, PART


@entry_point
def split_feet(plant: Plant, history: DriveHistory, whole: ContactState, foot_m: float) -> float:
    """
    Give each foot its share of the history of all; return the sum of their forces, N.

    Parameters
    ----------
    plant : Plant
        The drive.
    history : DriveHistory
        What all contacts remember together; what the feet remember is written.
    whole : ContactState
        All contacts together.
    foot_m : float
        Displacement of all feet, m.

    Notes
    -----
    The turning points of all contacts together are those of each, for all have shared one
    displacement. Followed along a foot's own virgin curve they give its force.

    """
    states = history.feet.states
    total_n, lost_j = 0.0, 0.0
    for foot in range(FEET):
        part = plant.feet.numbers[foot, PART]
        if remembers_turns(plant.contact, whole):
            curve = contact_of(plant, foot).curve
            stack = history.feet.stacks[foot]
            memory = replay(curve, history.contact.stack, whole.memory, stack)
            lost_j += lost_energy(curve, stack, memory)
        else:
            force_n = part * whole.memory.force_n
            if plant.contact.law.number == MDR:
                force_n = _share_springs(plant, history, foot)
            memory = Memory(whole.memory.u_m, force_n, 0, whole.memory.sense, 0.0, 0.0, 0.0)
        keep_state(
            states,
            foot,
            ContactState(memory, whole.on_springs, whole.preload_n, whole.bristle_m),
        )
        states[foot, PLACE] = foot_m
        total_n += memory.force_n
    lost_j = contact_lost(plant.contact, history.contact, whole) - lost_j
    for foot in range(FEET):
        states[foot, LOST] += plant.feet.numbers[foot, PART] * lost_j
    return total_n


@kernel
def replay(curve: VirginCurve, turns: Array, whole: Memory, stack: Array) -> Memory:
    """
    Lead a fresh contact along the turning points of another one; return its state.

    Parameters
    ----------
    curve : VirginCurve
        Of the contact that is led.
    turns : array, shape (CAPACITY, 3)
        Turning points of the other contact.
    whole : Memory
        State of the other contact.
    stack : array, shape (CAPACITY, 3)
        Receives the turning points of the contact that is led.

    """
    stack[0, :] = 0.0
    stack[0, TURN] = turns[0, TURN]
    memory = Memory(turns[0, TURN], 0.0, 0, 1.0, 0.0, 0.0, 0.0)
    for k in range(1, whole.depth + 2):
        u_m = turns[k, TURN] if k <= whole.depth else whole.u_m
        memory = move(curve, stack, memory, u_m)
    return memory


@kernel
def _share_springs(plant: Plant, history: DriveHistory, foot: int) -> float:
    """Give a foot its share of the springs of its group; return their force, N."""
    numbers = plant.feet.numbers
    group = int(numbers[foot, GROUP])
    count = 0.0
    for other in range(FEET):
        if numbers[other, GROUP] == numbers[foot, GROUP]:
            count += 1.0
    total_n = 0.0
    for k in range(history.contact.springs.shape[1]):
        history.feet.springs[foot, 0, k] = history.contact.springs[group, k] / count
        total_n += history.feet.springs[foot, 0, k]
    return total_n
