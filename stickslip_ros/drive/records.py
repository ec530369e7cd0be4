"""Records of the drive's kernels: Plant hardly changes, Wave with a command, State always."""

from typing import NamedTuple

import numpy as np

from stickslip_ros.contact.kernel import kernel
from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.reaction import ContactModel, ContactState, History
from stickslip_ros.drive.stages import Amplifier, Feet, FeetHistory, Piezo, Walls

ENDLESS = 1 << 62
"""Cycles of a wave that runs until it is replaced."""
NO_ROWS: Array = np.empty((0, 2))
"""The table of a wave that has none."""


class Plant(NamedTuple):
    """
    Everything about the drive that does not change while it runs.

    Attributes
    ----------
    contact : ContactModel
        All six contacts together.
    mass_kg, per_kg : float
        m of Eq. 20, and its inverse.
    damping_n_s_per_m : float
        c, viscous damping of the runner.
    cell_n_per_m : float
        k of Eq. 20, of a runner fixed to the load cell; 0 if it is not.
    gain_m_per_v : float
        Foot displacement per volt.
    rest_v : float
        Voltage at which the contacts are relaxed at the start.
    voltage_min_v, voltage_max_v : float
        Range of the amplifier.
    slew_v_per_s : float
        Fastest change of its output.
    dt_s : float
        Longest step.
    ideal : bool
        Whether the feet are one, and proportional to a voltage that consists of straight
        stretches, and the runner moves: then long steps are exact.
    stuck : bool
        Whether the runner does not move.
    amplifier : Amplifier
        What is not ideal about the amplifier.
    piezo : Piezo
        What is not ideal about the piezo.
    feet : Feet
        The six feet, where they differ.
    walls : Walls
        One-sided load cell and end stops.

    """

    contact: ContactModel
    mass_kg: float
    per_kg: float
    damping_n_s_per_m: float
    cell_n_per_m: float
    gain_m_per_v: float
    rest_v: float
    voltage_min_v: float
    voltage_max_v: float
    slew_v_per_s: float
    dt_s: float
    ideal: bool
    stuck: bool
    amplifier: Amplifier
    piezo: Piezo
    feet: Feet
    walls: Walls


class DriveHistory(NamedTuple):
    """
    What the drive remembers, in arrays that kernels change in place.

    Attributes
    ----------
    contact : History
        All contacts together; valid while the feet are moved as one.
    feet : FeetHistory
        The feet one by one; valid while they are separate.
    piezo : array, shape (4, 64)
        Amplifier and piezo: rows SCALARS to SHARES of ``piezo``.
    passes : array of int, shape (2,)
        Passes of the loops over time: columns LEFT and MADE of ``passes``.

    """

    contact: History
    feet: FeetHistory
    piezo: Array
    passes: Array


class Wave(NamedTuple):
    """
    Commanded voltage: a ramp from ``start_v`` by ``rise_v``, repeated, then held at ``start_v``.

    With a table, the ramp is replaced by its rows, which are played once.

    Attributes
    ----------
    start_v : float
        Voltage at which each ramp starts, and which is held in the end.
    rise_v : float
        Change along a ramp; negative for steps backwards.
    period_s : float
        Length of a ramp.
    cycles : int
        Ramps before the hold; 0 is a level, ENDLESS never ends.
    rows : array, shape (n, 2)
        Table: times from 0 (s) and voltages (V), joined by straight lines; none if empty.
    missed_share : float
        Share of the ramps that the amplifier leaves out.
    missed_seed : int
        Which ones these are.

    """

    start_v: float
    rise_v: float = 0.0
    period_s: float = 1.0
    cycles: int = 0
    rows: Array = NO_ROWS
    missed_share: float = 0.0
    missed_seed: int = 0


class Clock(NamedTuple):
    """
    Where the drive is in its wave.

    Attributes
    ----------
    ramp_s : float
        Time since the present ramp of the wave began. Times are counted per ramp, so that
        they never lose digits, however long a run lasts.
    cycle : int
        Ramps of the wave that are over.
    start_m : float
        Runner position at the start of the present ramp, when the fall before it was over.
    start_m_s : float
        Integral of the runner position (``Sums.position_m_s``) when the present ramp began.

    """

    ramp_s: float
    cycle: int
    start_m: float
    start_m_s: float


class Sums(NamedTuple):
    """
    Integrals over the whole run.

    Attributes
    ----------
    feet_work_j, load_work_j : float
        Work that the feet and the external load have done on runner and contacts.
    damping_lost_j : float
        Energy lost in the viscous damping.
    position_m_s : float
        Integral of the runner position over time.
    stuck_lost_j : float
        Kinetic energy that the runner had when it got stuck.

    """

    feet_work_j: float
    load_work_j: float
    damping_lost_j: float
    position_m_s: float
    stuck_lost_j: float


class State(NamedTuple):
    """
    Everything that changes while the drive runs, but for the history of the contacts.

    Attributes
    ----------
    clock : Clock
        Place in the wave.
    voltage_v : float
        Output of the amplifier.
    foot_m : float
        Displacement of the contact points, x_s; where they differ, that of the mean foot.
    position_m, velocity_m_per_s : float
        The runner.
    contact : ContactState
        The contacts; of separate feet, their force together against the mean foot.
    sums : Sums
        Energy and position integrals.

    """

    clock: Clock
    voltage_v: float
    foot_m: float
    position_m: float
    velocity_m_per_s: float
    contact: ContactState
    sums: Sums


@kernel
def at_voltage(state: State, voltage_v: float) -> State:
    """Return a state with the amplifier's output at a voltage; the foot follows with a step."""
    return State(
        state.clock,
        voltage_v,
        state.foot_m,
        state.position_m,
        state.velocity_m_per_s,
        state.contact,
        state.sums,
    )
