"""Kernel: advance the drive sample by sample and write down the truth."""

from stickslip_ros.contact.kernel import entry_point
from stickslip_ros.contact.profile import Array
from stickslip_ros.drive.plant import advance
from stickslip_ros.drive.records import DriveHistory, Plant, State, Wave
from stickslip_ros.drive.walls import cell_force
from stickslip_ros.instrument.reports import FOOT, FORCE, POSITION, VOLTAGE


@entry_point
def observe(
    plant: Plant,
    history: DriveHistory,
    state: State,
    wave: Wave,
    load_n: float,
    sample_s: float,
    truth: Array,
    ramps: Array,
) -> State:
    """
    Advance by one sample time per row of ``truth``, and fill its columns but the first.

    Parameters
    ----------
    plant, history, state, wave, load_n, ramps
        As for ``drive.plant.advance``.
    sample_s : float
        Time between two samples, s.
    truth : array, shape (samples, 5)
        Receives voltage (V), foot (m), position (m), force in the load cell (N).

    """
    for i in range(len(truth)):
        state = advance(plant, history, state, wave, load_n, sample_s, ramps)
        truth[i, VOLTAGE] = state.voltage_v
        truth[i, FOOT] = state.foot_m
        truth[i, POSITION] = state.position_m
        truth[i, FORCE] = cell_force(plant, state.position_m)
    return state
