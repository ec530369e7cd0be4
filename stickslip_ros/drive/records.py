# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Records of the drive: the plant hardly changes, the wave with a command, the state always.

All stages between a command and the runner are off in the ideal drive.

"""

from typing import NamedTuple

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.contact.reaction import CONTACT, CONTACT_STATE
from stickslip_ros.contact.travel import TRACK
from stickslip_ros.kernels.record import COUNT, FLAG, FLOAT, kind

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
TIME, VOLTAGE, FOOT, POSITION, FORCE = range(5)
"""Columns of a trace; a table of voltages has the first two."""
PLAYS_MAX = 64
DECADES = 6
"""Elements of creep."""

AMPLIFIER = kind(
    on=FLAG,  # Whether it has power; without it the voltage goes to the lowest
    resolution_v=FLOAT,  # Step of the digital-to-analogue converter; 0 is none
    tau_s=FLOAT,  # Time constant of its first-order low-pass; 0 is none
)
"""What an amplifier does besides keeping its range and its slew rate."""

PIEZO = kind(
    linear=FLOAT,  # Linear part of the hysteresis, relative to the gain; 1 without hysteresis
    weight=FLOAT,  # Weight of each play operator, relative to the gain
    plays=COUNT,  # Number of play operators, at most PLAYS_MAX; 0 is no hysteresis
    play_v=FLOAT,  # Half width of the narrowest play; the others are 2, 3, ... times as wide
    creep=FLOAT,  # Growth of a displacement per decade of time; 0 is none
    omega_per_s=FLOAT,  # Angular frequency of the resonance; 0 is a massless piezo
    damping_ratio=FLOAT,  # Damping ratio of the resonance
    # Mass of a foot on its stack, and the stiffness of that; 0 is a stack that no load bends
    foot_kg=FLOAT,
    stack_n_per_m=FLOAT,
)
"""What a piezo does besides being proportional to its voltage."""

WALLS = kind(
    exist=FLAG,  # Whether there are any
    # Stiffness of a load cell on which the runner presses from one side; 0 is none
    cell_n_per_m=FLOAT,
    gap_m=FLOAT,  # Position at which the runner touches it; inf where there is none
    stop_n_per_m=FLOAT,  # Stiffness of the end stops; 0 is none
    # Places of the end stops; -inf and inf where there are none
    low_m=FLOAT,
    high_m=FLOAT,
)
"""One-sided springs that the runner may run into."""

BUTTON = kind(
    exists=FLAG,  # Whether the load cell has one: a moving mass, pressed from one side
    mass_kg=FLOAT,
    n_per_m=FLOAT,  # Stiffness of the load cell, and viscous damping
    damping_n_s_per_m=FLOAT,
    gap_m=FLOAT,  # Way of the runner until it touches the button at rest
    restitution=FLOAT,  # Share of the velocity between both that an impact turns round
)
"""The load button of a one-sided load cell with a mass; without one it is a wall."""

FRAME = kind(
    exists=FLAG,  # Whether it is not rigid
    # Mass of the frame with its feet, and its inverse; 0 of a rigid one
    mass_kg=FLOAT,
    per_kg=FLOAT,
    held_n_per_m=FLOAT,  # Stiffness with which the table holds it, and viscous damping
    damping_n_s_per_m=FLOAT,
    feet_share=FLOAT,  # Share of the feet in that mass
    is_reference=FLAG,  # Whether the interferometer measures against it, not against the table
)
"""The frame that carries the feet."""

PLANT = kind(
    # m of Eq. 20, and its inverse
    mass_kg=FLOAT,
    per_kg=FLOAT,
    damping_n_s_per_m=FLOAT,  # c, viscous damping of the runner
    cell_n_per_m=FLOAT,  # k of Eq. 20, of a runner fixed to the load cell; 0 if it is not
    gain_m_per_v=FLOAT,  # Foot displacement per volt
    rest_v=FLOAT,  # Voltage at which the contacts are relaxed at the start
    # Range of the amplifier
    voltage_min_v=FLOAT,
    voltage_max_v=FLOAT,
    slew_v_per_s=FLOAT,  # Fastest change of its output
    dt_s=FLOAT,  # Longest step
    tread_s=FLOAT,  # Time below which the levels of the converter are not told apart
    # Whether the feet are one, and proportional to a voltage that consists of straight stretches,
    # and the runner moves: then long steps are exact
    ideal=FLAG,
    # Whether it is ideal and obeys the contact model: then all steps are long while turning points
    # hold its history
    only_long_steps=FLAG,
    stuck=FLAG,  # Whether the runner does not move
    separate=FLAG,  # Whether the feet are moved one by one, each with a contact of its own
    dead=COUNT,  # Foot that does not move, from 1; 0 is none
    # What is not ideal about them
    amplifier=AMPLIFIER,
    piezo=PIEZO,
    walls=WALLS,
    button=BUTTON,
    frame=FRAME,
    ratios=(FLOAT, (CONTACTS,)),  # Displacement of each foot per displacement of the mean foot
    parts=(FLOAT, (CONTACTS,)),  # Share of each contact in the friction limit of all
    groups=(COUNT, (CONTACTS,)),  # Group of equal contacts to which each belongs
    # All together, and each; the latter are valid where the feet are separate
    contacts=(CONTACT, (CONTACTS,)),
    track=TRACK,  # Lines under the feet, if roughness travels
)
"""Everything about the drive that does not change while it runs."""


class Wave(NamedTuple):
    """
    Commanded voltage: a ramp from ``start_v`` by ``rise_v``, repeated, then held at ``start_v``.

    With a table, the ramp is replaced by its rows.

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
    lead_s : float
        Time in the table up to which it is played only once, in the first cycle.
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
    lead_s: float = 0.0
    missed_share: float = 0.0
    missed_seed: int = 0


CLOCK = kind(
    # Time since the present ramp of the wave began. Times are counted per ramp, so that they never
    # lose digits, however long a run lasts.
    ramp_s=FLOAT,
    cycle=COUNT,  # Ramps of the wave that are over
    # Runner position at the start of the present ramp, when the fall before it was over
    start_m=FLOAT,
    # Integral of the runner position (``position_m_s`` of SUMS) when the present ramp began
    start_m_s=FLOAT,
)
"""Where the drive is in its wave."""

SUMS = kind(
    # Work that the feet and the external load have done on runner and contacts
    feet_work_j=FLOAT,
    load_work_j=FLOAT,
    damping_lost_j=FLOAT,  # Energy lost in the viscous damping
    position_m_s=FLOAT,  # Integral of the runner position over time
    stuck_lost_j=FLOAT,  # Kinetic energy that the runner had when it got stuck
    # Energy lost in the damping of frame and load button, and in impacts
    stand_lost_j=FLOAT,
)
"""Integrals over the whole run."""

PIEZO_STATE = kind(
    slewed_v=FLOAT,  # Output of the amplifier before its low-pass
    plays_at_rest_v=FLOAT,  # Sum of the plays at the start
    # Displacement after hysteresis; after creep
    static_m=FLOAT,
    driving_m=FLOAT,
    # Displacement after the resonance, and its velocity
    ring_m=FLOAT,
    ring_m_per_s=FLOAT,
    plays_v=(FLOAT, (PLAYS_MAX,)),  # Outputs of the plays
    crept_m=(FLOAT, (DECADES,)),  # Displacements that the elements of creep have taken in
    creep_shares=(FLOAT, (DECADES,)),  # Share of its way that each goes in the present step
)
"""What amplifier and piezo remember."""

FOOT_MOTION = kind(
    m_per_s=FLOAT,  # Its velocity against the frame
    # The rest is of the present step: a parabola that is its way, the ends of its halves
    speed=FLOAT,
    speeding=FLOAT,
    middle_m=FLOAT,
    middle_m_per_s=FLOAT,
    end_m=FLOAT,
    end_m_per_s=FLOAT,
    # Stiffness of its contact; its load before the step, how fast that grows; what this misses
    # in the middle, per mass
    stiffness=FLOAT,
    before_n=FLOAT,
    n_per_s=FLOAT,
    missed=FLOAT,
    load_n=FLOAT,  # Its load where its contact was looked up last
    # Branch on which its contact goes on: force = base_n + fold T_v(unfold (u - origin_m)) while
    # the argument of T_v is between 0 and room_m; 0 where no branch is known
    origin_m=FLOAT,
    base_n=FLOAT,
    fold=FLOAT,
    unfold=FLOAT,
    room_m=FLOAT,
)
"""A foot, or all as one. Its velocity and the way are of feet that bend their stacks."""

STATE = kind(
    clock=CLOCK,  # Place in the wave
    voltage_v=FLOAT,  # Output of the amplifier
    # Displacement of the contact points against the frame, x_s; where they differ, that of the
    # mean foot, and where stacks bend, what it would be without load
    foot_m=FLOAT,
    # The runner
    position_m=FLOAT,
    velocity_m_per_s=FLOAT,
    # The load button, and whether the runner presses on it
    button_m=FLOAT,
    button_m_per_s=FLOAT,
    pressed=FLAG,
    # The centre of mass of frame and feet: displacement, velocity
    centre_m=FLOAT,
    centre_m_per_s=FLOAT,
    contact_n=FLOAT,  # Force of all contacts; the runner feels its opposite
    preload_n=FLOAT,  # Present preload
    sums=SUMS,  # Energy and position integrals
    piezo=PIEZO_STATE,  # What amplifier and piezo remember
    feet=(FOOT_MOTION, (CONTACTS,)),
    # Displacement of each foot against the frame, and what of it does not follow the piezo
    places_m=(FLOAT, (CONTACTS,)),
    offsets_m=(FLOAT, (CONTACTS,)),
    # Passes that the loops over time may still make; below 0 the drive has given up
    passes_left=COUNT,
    passes_made=COUNT,  # Passes made since the start
    # All together, valid while the feet are moved as one, and each, valid while they are separate
    contacts=(CONTACT_STATE, (CONTACTS,)),
)
"""Everything that changes while the drive runs."""
