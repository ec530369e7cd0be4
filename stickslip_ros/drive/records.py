"""
Records of the drive: the plant hardly changes, the wave with a command, the state always.

All stages between a command and the runner are off in the ideal drive.

"""

from typing import NamedTuple

import numpy as np

from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.reaction import CONTACT, CONTACT_STATE
from stickslip_ros.contact.record import COUNT, FLAG, FLOAT, kind

ENDLESS = 1 << 62
"""Cycles of a wave that runs until it is replaced."""
NO_ROWS: Array = np.empty((0, 2))
"""The table of a wave that has none."""
FEET = 6
"""Hemispheres that hold the runner: the two upper ones first."""
ALL = 0
"""Number of all contacts together, which an ideal drive moves as one. Each foot, from 1 on, has a
number too; where the feet differ, the drive moves these."""
CONTACTS = 1 + FEET
PLAYS_MAX = 64
DECADES = 6
"""Elements of creep."""

AMPLIFIER = kind(on=FLAG, resolution_v=FLOAT, tau_s=FLOAT)
"""
What an amplifier does besides keeping its range and its slew rate.

Fields
------
on : bool
    Whether it has power; without it the voltage goes to the lowest.
resolution_v : float
    Step of the digital-to-analogue converter; 0 is none.
tau_s : float
    Time constant of its first-order low-pass; 0 is none.

"""

PIEZO = kind(
    linear=FLOAT,
    weight=FLOAT,
    plays=COUNT,
    play_v=FLOAT,
    creep=FLOAT,
    omega_per_s=FLOAT,
    damping_ratio=FLOAT,
)
"""
What a piezo does besides being proportional to its voltage.

Fields
------
linear : float
    Linear part of the hysteresis, relative to the gain; 1 without hysteresis.
weight : float
    Weight of each play operator, relative to the gain.
plays : int
    Number of play operators, at most PLAYS_MAX; 0 is no hysteresis.
play_v : float
    Half width of the narrowest play; the others are 2, 3, ... times as wide.
creep : float
    Growth of a displacement per decade of time; 0 is none.
omega_per_s : float
    Angular frequency of the resonance; 0 is a massless piezo.
damping_ratio : float
    Damping ratio of the resonance.

"""

WALLS = kind(
    exist=FLAG,
    cell_n_per_m=FLOAT,
    gap_m=FLOAT,
    stop_n_per_m=FLOAT,
    low_m=FLOAT,
    high_m=FLOAT,
    nearest_low_m=FLOAT,
    nearest_high_m=FLOAT,
)
"""
One-sided springs that the runner may run into.

Fields
------
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

PLANT = kind(
    mass_kg=FLOAT,
    per_kg=FLOAT,
    damping_n_s_per_m=FLOAT,
    cell_n_per_m=FLOAT,
    gain_m_per_v=FLOAT,
    rest_v=FLOAT,
    voltage_min_v=FLOAT,
    voltage_max_v=FLOAT,
    slew_v_per_s=FLOAT,
    dt_s=FLOAT,
    short_s=FLOAT,
    ideal=FLAG,
    only_long_steps=FLAG,
    stuck=FLAG,
    separate=FLAG,
    dead=COUNT,
    amplifier=AMPLIFIER,
    piezo=PIEZO,
    walls=WALLS,
    ratios=(FLOAT, (CONTACTS,)),
    parts=(FLOAT, (CONTACTS,)),
    groups=(COUNT, (CONTACTS,)),
    contacts=(CONTACT, (CONTACTS,)),
)
"""
Everything about the drive that does not change while it runs.

Fields
------
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
dt_s, short_s : float
    Longest of the long steps, and of the short ones of velocity Verlet.
ideal : bool
    Whether the feet are one, and proportional to a voltage that consists of straight stretches,
    and the runner moves: then long steps are exact.
only_long_steps : bool
    Whether it is ideal, obeys the contact model and meets no walls: then all steps are long while
    turning points hold its history.
stuck : bool
    Whether the runner does not move.
separate : bool
    Whether the feet are moving one by one, each with a contact of its own.
dead : int
    Foot that does not move, from 1; 0 is none.
amplifier, piezo, walls
    What is not ideal about them.
ratios : array, shape (CONTACTS,)
    Displacement of each foot per displacement of the mean foot.
parts : array, shape (CONTACTS,)
    Share of each contact in the friction limit of all.
groups : array of int, shape (CONTACTS,)
    Group of equal contacts to which each belongs.
contacts : array of records of CONTACT, shape (CONTACTS,)
    All together, and each; the latter are valid where the feet are separate.

"""


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


CLOCK = kind(ramp_s=FLOAT, cycle=COUNT, start_m=FLOAT, start_m_s=FLOAT)
"""
Where the drive is in its wave.

Fields
------
ramp_s : float
    Time since the present ramp of the wave began. Times are counted per ramp, so that they never
    lose digits, however long a run lasts.
cycle : int
    Ramps of the wave that are over.
start_m : float
    Runner position at the start of the present ramp, when the fall before it was over.
start_m_s : float
    Integral of the runner position (``position_m_s`` of SUMS) when the present ramp began.

"""

SUMS = kind(
    feet_work_j=FLOAT,
    load_work_j=FLOAT,
    damping_lost_j=FLOAT,
    position_m_s=FLOAT,
    stuck_lost_j=FLOAT,
)
"""
Integrals over the whole run.

Fields
------
feet_work_j, load_work_j : float
    Work that the feet and the external load have done on runner and contacts.
damping_lost_j : float
    Energy lost in the viscous damping.
position_m_s : float
    Integral of the runner position over time.
stuck_lost_j : float
    Kinetic energy that the runner had when it got stuck.

"""

PIEZO_STATE = kind(
    slewed_v=FLOAT,
    plays_at_rest_v=FLOAT,
    static_m=FLOAT,
    driving_m=FLOAT,
    ring_m=FLOAT,
    ring_m_per_s=FLOAT,
    plays_v=(FLOAT, (PLAYS_MAX,)),
    crept_m=(FLOAT, (DECADES,)),
    creep_shares=(FLOAT, (DECADES,)),
)
"""
What amplifier and piezo remember.

Fields
------
slewed_v : float
    Output of the amplifier before its low-pass.
plays_at_rest_v : float
    Sum of the plays at the start.
static_m, driving_m : float
    Displacement after hysteresis; after creep.
ring_m, ring_m_per_s : float
    Displacement after the resonance, and its velocity.
plays_v : array, shape (PLAYS_MAX,)
    Outputs of the plays.
crept_m : array, shape (DECADES,)
    Displacements that the elements of creep have taken in.
creep_shares : array, shape (DECADES,)
    Share of its way that each goes in the present step.

"""

STATE = kind(
    clock=CLOCK,
    voltage_v=FLOAT,
    foot_m=FLOAT,
    position_m=FLOAT,
    velocity_m_per_s=FLOAT,
    contact_n=FLOAT,
    preload_n=FLOAT,
    sums=SUMS,
    piezo=PIEZO_STATE,
    places_m=(FLOAT, (CONTACTS,)),
    offsets_m=(FLOAT, (CONTACTS,)),
    passes_left=COUNT,
    passes_made=COUNT,
    contacts=(CONTACT_STATE, (CONTACTS,)),
)
"""
Everything that changes while the drive runs.

Fields
------
clock : record of CLOCK
    Place in the wave.
voltage_v : float
    Output of the amplifier.
foot_m : float
    Displacement of the contact points, x_s; where they differ, that of the mean foot.
position_m, velocity_m_per_s : float
    The runner.
contact_n : float
    Force of all contacts; the runner feels its opposite.
preload_n : float
    Present preload.
sums : record of SUMS
    Energy and position integrals.
piezo : record of PIEZO_STATE
    What amplifier and piezo remember.
places_m, offsets_m : array, shape (CONTACTS,)
    Displacement of each foot, and what of it does not follow the piezo.
passes_left : int
    Passes that the loops over time may still make; below 0 the drive has given up.
passes_made : int
    Passes made since the start.
contacts : array of records of CONTACT_STATE, shape (CONTACTS,)
    All together, valid while the feet are moving as one, and each, valid while they are separate.

"""
