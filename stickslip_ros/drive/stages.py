"""Records of the stages between a command and the runner; all are off in the ideal drive."""

from typing import NamedTuple

from stickslip_ros.contact.profile import Array

FEET = 6
"""Hemispheres that hold the runner: the two upper ones first."""


class Amplifier(NamedTuple):
    """
    What an amplifier does besides keeping its range and its slew rate.

    Attributes
    ----------
    on : bool
        Whether it has power; without it the voltage goes to the lowest.
    resolution_v : float
        Step of the digital-to-analogue converter; 0 is none.
    tau_s : float
        Time constant of its first-order low-pass; 0 is none.

    """

    on: bool
    resolution_v: float
    tau_s: float


class Piezo(NamedTuple):
    """
    What a piezo does besides being proportional to its voltage.

    Attributes
    ----------
    linear : float
        Linear part of the hysteresis, relative to the gain; 1 without hysteresis.
    weight : float
        Weight of each play operator, relative to the gain.
    plays : int
        Number of play operators; 0 is no hysteresis.
    play_v : float
        Half width of the narrowest play; the others are 2, 3, ... times as wide.
    creep : float
        Growth of a displacement per decade of time; 0 is none.
    omega_per_s : float
        Angular frequency of the resonance; 0 is a massless piezo.
    damping_ratio : float
        Damping ratio of the resonance.

    """

    linear: float
    weight: float
    plays: int
    play_v: float
    creep: float
    omega_per_s: float
    damping_ratio: float


class Feet(NamedTuple):
    """
    The six feet, where they differ: each with a contact of its own.

    Attributes
    ----------
    separate : bool
        Whether they are moved one by one; otherwise ``Plant.contact`` is all of them together.
    dead : int
        Foot that does not move, from 1; 0 is none.
    cells : array, shape (groups, CELLS, 4)
        Virgin curves of one contact of each group of equal ones, on the grid of them all.
    springs : array, shape (5, 6, 1, springs)
        Spring bank of each foot: heights, normal and shear stiffness, area, slope.
    numbers : array, shape (6, 6)
        Per foot: columns SHARE to ENERGY_MAX.

    """

    separate: bool
    dead: int
    cells: Array
    springs: Array
    numbers: Array


SHARE, PART, GROUP, RATIO, FORCE_MAX, ENERGY_MAX = range(6)
"""Columns of ``Feet.numbers``: normal force per preload, share of all contacts in the friction
limit, row of ``Feet.cells``, displacement per mean displacement, force of full slip (N), integral
of the virgin force (J)."""


class Walls(NamedTuple):
    """
    One-sided springs that the runner may run into.

    Attributes
    ----------
    exist : bool
        Whether there are any.
    cell_n_per_m : float
        Stiffness of a load cell on which the runner presses from one side; 0 is none.
    gap_m : float
        Position at which the runner touches it.
    stop_n_per_m : float
        Stiffness of the end stops; 0 is none.
    low_m, high_m : float
        Places of the end stops.
    nearest_low_m, nearest_high_m : float
        Positions between which no spring is touched.

    """

    exist: bool
    cell_n_per_m: float
    gap_m: float
    stop_n_per_m: float
    low_m: float
    high_m: float
    nearest_low_m: float
    nearest_high_m: float


class FeetHistory(NamedTuple):
    """
    What the feet remember one by one.

    Attributes
    ----------
    stacks : array, shape (6, CAPACITY, 3)
        Turning points.
    springs : array, shape (6, 1, springs)
        Tangential forces of the springs, N.
    states : array, shape (6, 11)
        Per foot: columns U to OFFSET of ``feet``.

    """

    stacks: Array
    springs: Array
    states: Array
