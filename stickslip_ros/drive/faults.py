"""Faults of the drive that come and go while it runs."""

from stickslip_ros.contact.laws import COULOMB
from stickslip_ros.contact.memory import Memory
from stickslip_ros.drive.build import with_ideal
from stickslip_ros.drive.feet import OFFSET, PLACE
from stickslip_ros.drive.feet_split import split_feet
from stickslip_ros.drive.records import DriveHistory, Plant, State
from stickslip_ros.drive.stages import RATIO
from stickslip_ros.errors import OutOfRange


def apply_faults(
    plant: Plant,
    history: DriveHistory,
    state: State,
    *,
    dead_foot: int,
    runner_stuck: bool,
    amplifier_on: bool,
) -> tuple[Plant, State]:
    """
    Return plant and state with the faults that there are now; those of before are mended.

    Parameters
    ----------
    plant, history, state
        The drive between two advances; the history is changed in place.
    dead_foot : int
        Foot that stays where it is, 1 to 6, the two upper ones first; 0 is none. A foot that is
        mended follows again from where it is.
    runner_stuck : bool
        Whether the runner does not move; what it had of kinetic energy is lost.
    amplifier_on : bool
        Whether the amplifier has power; without it the voltage goes to the lowest.

    Raises
    ------
    OutOfRange
        If a foot dies under Coulomb's law, which then does not say how the feet share the load.

    """
    if dead_foot != plant.feet.dead:
        plant, state = _change_dead_foot(plant, history, state, dead_foot)
    if runner_stuck and not plant.stuck:
        state = _stop_runner(plant, state)
    amplifier = plant.amplifier._replace(on=bool(amplifier_on))
    return with_ideal(plant._replace(amplifier=amplifier, stuck=bool(runner_stuck))), state


def _change_dead_foot(
    plant: Plant, history: DriveHistory, state: State, dead_foot: int
) -> tuple[Plant, State]:
    if plant.contact.law.number == COULOMB:
        limit = 'not 0 under the rigid law of Coulomb, which does not say how feet share a load'
        raise OutOfRange('fault.dead_foot', dead_foot, '', limit, 'take another contact.law')
    if not plant.feet.separate:
        plant, state = separate_feet(plant, history, state)
    states, mended = history.feet.states, plant.feet.dead
    if mended:
        foot = mended - 1
        follows_m = plant.feet.numbers[foot, RATIO] * state.foot_m
        states[foot, OFFSET] = states[foot, PLACE] - follows_m
    if dead_foot:
        states[dead_foot - 1, OFFSET] = states[dead_foot - 1, PLACE]
    return plant._replace(feet=plant.feet._replace(dead=int(dead_foot))), state


def separate_feet(plant: Plant, history: DriveHistory, state: State) -> tuple[Plant, State]:
    """Return a drive whose feet are moved one by one from now on, with the same force."""
    whole = state.contact
    total_n = split_feet(plant, history, whole, state.foot_m)
    memory = Memory(whole.memory.u_m, total_n, 0, 1.0, 0.0, 0.0, 0.0)
    plant = with_ideal(plant._replace(feet=plant.feet._replace(separate=True)))
    return plant, state._replace(contact=whole._replace(memory=memory))


def _stop_runner(plant: Plant, state: State) -> State:
    kinetic_j = 0.5 * plant.mass_kg * state.velocity_m_per_s * state.velocity_m_per_s
    sums = state.sums._replace(stuck_lost_j=state.sums.stuck_lost_j + kinetic_j)
    return state._replace(velocity_m_per_s=0.0, sums=sums)
