# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Records of the drive: its constants (plant), the commanded voltage (wave) and its state.

In the ideal drive all optional parts are off.

"""

from typing import NamedTuple

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.contact.reaction import CONTACT, CONTACT_STATE
from stickslip_ros.contact.travel import TRACK
from stickslip_ros.kernels.record import COUNT, FLAG, FLOAT, kind
from stickslip_ros.parameters import FEET_MAX

ENDLESS = 1 << 62
"""Cycles of a wave that runs until it is replaced."""
NO_ROWS: Array = np.empty((0, 2))
"""Empty table, of a wave without a table."""
ALL = 0
"""Index of all contacts together, which an ideal drive moves as one. Feet that move differently
are separate contacts with the indices from 1: one for each distinct motion, or one for each foot.
"""
CONTACTS = 1 + FEET_MAX
"""Contacts of ALL and of each foot; `FeetParameters.check_together` guards it and delays_s."""
CORNERS = 16384
"""Straight pieces of the voltage that are remembered for delayed feet. `check_corners` refuses a
wave that needs half of them, so any two waves fit; `must_hold` guards them in a step."""
TIME, VOLTAGE, FOOT, POSITION, FORCE = range(5)
"""Columns of a trace; a voltage table has the first two."""
PLAYS_MAX = 64
"""Most play operators; the bound of ``actuator.plays`` guards it."""
DECADES = 6
"""Number of creep elements; fixed."""

AMPLIFIER = kind(
    on=FLAG,  # Whether it has power; without power the voltage goes to the lowest
    resolution_v=FLOAT,  # Step of the digital-to-analogue converter; 0: none
    tau_s=FLOAT,  # Time constant of its first-order low-pass; 0: none
)
"""Constants of the amplifier other than range and slew rate."""

PIEZO = kind(
    linear=FLOAT,  # Linear part of the hysteresis, relative to the gain; 1 without hysteresis
    weight=FLOAT,  # Weight of each play operator, relative to the gain
    plays=COUNT,  # Number of play operators, at most PLAYS_MAX; 0: no hysteresis
    play_v=FLOAT,  # Half width of the narrowest play; the others are 2, 3, ... times as wide
    creep=FLOAT,  # Growth of a displacement per decade of time; 0: none
    omega_per_s=FLOAT,  # Angular frequency of the resonance; 0: massless piezo
    damping_ratio=FLOAT,  # Damping ratio of the resonance
    # Mass of a foot on its stack, and stiffness of the stack; 0: rigid stack
    foot_kg=FLOAT,
    stack_n_per_m=FLOAT,
)
"""Constants of a piezo other than its gain."""

WALLS = kind(
    exist=FLAG,  # Whether any wall exists
    # Stiffness of a load cell on which the runner presses from one side; 0: none
    cell_n_per_m=FLOAT,
    gap_m=FLOAT,  # Position at which the runner touches it; inf: never
    stop_n_per_m=FLOAT,  # Stiffness of the end stops; 0: none
    # Positions of the end stops; -inf and inf: none
    low_m=FLOAT,
    high_m=FLOAT,
)
"""Walls: one-sided springs that the runner may touch."""

BUTTON = kind(
    exists=FLAG,  # Whether the load cell is one-sided and has a moving mass
    mass_kg=FLOAT,
    n_per_m=FLOAT,  # Stiffness of the load cell, and viscous damping
    damping_n_s_per_m=FLOAT,
    gap_m=FLOAT,  # Position at which the runner touches the button at rest
    restitution=FLOAT,  # Coefficient of restitution of an impact
)
"""Load button of a one-sided load cell with a mass; without a mass the cell is a wall."""

FRAME = kind(
    exists=FLAG,  # Whether the frame can move
    # Mass of the frame with its feet, and its inverse; 0: rigid frame
    mass_kg=FLOAT,
    per_kg=FLOAT,
    held_n_per_m=FLOAT,  # Stiffness and viscous damping between frame and table
    damping_n_s_per_m=FLOAT,
    feet_share=FLOAT,  # Share of the feet in that mass
    is_reference=FLAG,  # Whether the interferometer measures against the frame
)
"""The frame that carries the feet."""

PLANT = kind(
    # m of Eq. 20, and its inverse
    mass_kg=FLOAT,
    per_kg=FLOAT,
    damping_n_s_per_m=FLOAT,  # c, viscous damping of the runner
    cell_n_per_m=FLOAT,  # k of Eq. 20 if the runner is fixed to the load cell; otherwise 0
    gain_m_per_v=FLOAT,  # Foot displacement per volt
    rest_v=FLOAT,  # Voltage at the start, with relaxed contacts
    # Range of the amplifier
    voltage_min_v=FLOAT,
    voltage_max_v=FLOAT,
    slew_v_per_s=FLOAT,  # Fastest change of its output
    dt_s=FLOAT,  # Longest step
    tread_s=FLOAT,  # Shortest time between levels of the converter; shorter ones become a line
    # Whether long steps are exact: equal feet, proportional to a piecewise linear voltage, and a
    # runner that can move
    ideal=FLAG,
    # Whether an ideal drive takes only long steps while no springs hold the history
    only_long_steps=FLAG,
    plain=FLAG,  # Whether the contacts follow the contact model and lose nothing by sticking
    stuck=FLAG,  # Whether the runner is stuck
    load_n=FLOAT,  # Constant external load
    # Whether contacts move separately, and their number; whether each foot is a contact
    separate=FLAG,
    moved=COUNT,
    divided=FLAG,
    driven=COUNT,  # Feet with a piezo, which are no guides
    dead=COUNT,  # Foot that does not move, from 1; 0: none
    presliding_m=FLOAT,  # Least presliding range of the contacts, which limits the steps
    # Optional parts
    amplifier=AMPLIFIER,
    piezo=PIEZO,
    walls=WALLS,
    button=BUTTON,
    frame=FRAME,
    # Of each contact: displacement per displacement of the nominal foot, number of feet, delayed
    # actuator from 1 (0: none), share in the total friction limit
    ratios=(FLOAT, (CONTACTS,)),
    counts=(FLOAT, (CONTACTS,)),
    lates=(COUNT, (CONTACTS,)),
    parts=(FLOAT, (CONTACTS,)),
    # Of each foot: contact from which it was divided, and its group of equal feet there
    parents=(COUNT, (CONTACTS,)),
    groups=(COUNT, (CONTACTS,)),
    # Delays of the delayed actuators, and their number
    delays_s=(FLOAT, (FEET_MAX,)),
    delayed=COUNT,
    # All contacts together, and the separate contacts
    contacts=(CONTACT, (CONTACTS,)),
    track=TRACK,  # Lines under the feet, if roughness travels
    loss_s=FLOAT,  # Viscous force of sticking contacts per rate of their elastic force; 0: no loss
)
"""Constants of the drive."""


class Wave(NamedTuple):
    """
    Commanded voltage: a ramp from ``start_v`` by ``rise_v``, repeated, then held at ``start_v``.

    With a table, the ramp is replaced by its rows.

    """

    start_v: float  # voltage at the start of each ramp, and after the last one
    rise_v: float = 0.0  # change along a ramp; negative for backward steps
    period_s: float = 1.0  # length of a ramp
    cycles: int = 0  # ramps before the hold; 0: a constant level, ENDLESS: no hold
    # table of times from 0 (s) and voltages (V), joined by straight lines; empty: no table
    rows: Array = NO_ROWS
    lead_s: float = 0.0  # time up to which the table is played only in the first cycle
    missed_share: float = 0.0  # share of the ramps that the amplifier skips
    missed_seed: int = 0  # seed that selects the skipped ramps


CLOCK = kind(
    # Time since the start of the present ramp; counted per ramp, so a long run loses no digits
    ramp_s=FLOAT,
    cycle=COUNT,  # Finished ramps of the wave
    # Runner position at the start of the present ramp, after the fall
    start_m=FLOAT,
    # Integral of the runner position (``position_m_s`` of SUMS) at the start of the present ramp
    start_m_s=FLOAT,
)
"""Position of the drive in its wave."""

SUMS = kind(
    # Work of the feet, and of the external load and an added mass, on runner and contacts
    feet_work_j=FLOAT,
    load_work_j=FLOAT,
    # Energy lost in the viscous damping of the runner, and of its sticking contacts
    damping_lost_j=FLOAT,
    sticking_lost_j=FLOAT,
    position_m_s=FLOAT,  # Integral of the runner position over time
    stuck_lost_j=FLOAT,  # Kinetic energy lost when the runner got stuck
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
    crept_m=(FLOAT, (DECADES,)),  # Displacements of the elements of creep
    creep_shares=(FLOAT, (DECADES,)),  # Share of its way that each element goes in a step
)
"""State of amplifier and piezo."""

DELAYED_ACTUATOR = kind(
    # Present piece of the remembered voltage, and the time since its start
    corner=COUNT,
    at_s=FLOAT,
    voltage_v=FLOAT,  # Output of its amplifier
    foot_m=FLOAT,  # Displacement of its nominal foot against the frame
    # Parabola of its way in the present step, and its end
    speed=FLOAT,
    speeding=FLOAT,
    end_m=FLOAT,
    piezo=PIEZO_STATE,
)
"""A delayed actuator: amplifier and piezo that follow the voltage of an earlier time."""

HISTORY = kind(
    newest=COUNT,  # Piece that ends now; the ring continues at its start
    is_full=FLAG,  # Whether the amplifier holds its voltage, because no piece was free
    lasted_s=(FLOAT, (CORNERS,)),
    start_v=(FLOAT, (CORNERS,)),
    rate_v_per_s=(FLOAT, (CORNERS,)),
)
"""Straight pieces of the voltage before the low-pass."""

FOOT_MOTION = kind(
    m_per_s=FLOAT,  # Velocity against the frame
    # The other fields belong to the present step: parabola of the way, middle and end
    speed=FLOAT,
    speeding=FLOAT,
    middle_m=FLOAT,
    middle_m_per_s=FLOAT,
    end_m=FLOAT,
    end_m_per_s=FLOAT,
    # Stiffness of its contact; load before the step, and its rate; acceleration missed in the
    # middle
    stiffness=FLOAT,
    before_n=FLOAT,
    n_per_s=FLOAT,
    missed=FLOAT,
    load_n=FLOAT,  # Load at the last evaluation of its contact
    # Branch ahead of its contact: force = base_n + fold T_v(unfold (u - origin_m)) while the
    # argument of T_v is between 0 and room_m; room_m 0: unknown branch
    origin_m=FLOAT,
    base_n=FLOAT,
    fold=FLOAT,
    unfold=FLOAT,
    room_m=FLOAT,
)
"""Motion of a foot, or of all feet as one; velocity and way are used if stacks bend."""

STATE = kind(
    clock=CLOCK,  # Position in the wave
    voltage_v=FLOAT,  # Output of the amplifier
    # Displacement of the nominal foot against the frame, x_s; without load, if stacks bend
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
    contact_n=FLOAT,  # Force of all contacts; the force on the runner is its opposite
    preload_n=FLOAT,  # Present preload
    sums=SUMS,  # Energy and position integrals
    piezo=PIEZO_STATE,
    history=HISTORY,
    late=(DELAYED_ACTUATOR, (FEET_MAX,)),
    feet=(FOOT_MOTION, (CONTACTS,)),
    # Displacement of each contact's feet against the frame, and the part that does not follow the
    # piezo
    places_m=(FLOAT, (CONTACTS,)),
    offsets_m=(FLOAT, (CONTACTS,)),
    # Passes left for the loops over time; below 0: the drive has failed
    passes_left=COUNT,
    passes_made=COUNT,  # Passes since the start
    # All contacts together, valid unless the feet are separate; each contact, valid if they are
    contacts=(CONTACT_STATE, (CONTACTS,)),
    # Elastic force of each contact at the start and in the middle of a stride, if contacts lose
    # energy
    starts_n=(FLOAT, (CONTACTS,)),
    middles_n=(FLOAT, (CONTACTS,)),
)
"""State of the drive."""
