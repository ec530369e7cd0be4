# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Short step of the drive, from voltage to runner motion, with any of its parts.

The voltage moves the feet, the feet drag the contacts, and the contacts pull the runner.

Short steps have fourth order like long steps, and allow any motion of the feet, also a different
one for each foot. The way of a foot in a step is a parabola through three positions; the contacts
are moved to its middle and to its end. A step is split where the runner turns against a foot,
where a loop closes, and where a wall is met.

"""

import math

from stickslip_ros.contact.laws import COULOMB, MDR
from stickslip_ros.drive import button, contacts, delay, frame, loss, runner, stacks, travel
from stickslip_ros.drive.actuator import Pace, move_actuator
from stickslip_ros.drive.coulomb import take_rigid_stride
from stickslip_ros.drive.piezo import prepare_piezo
from stickslip_ros.drive.records import ALL
from stickslip_ros.drive.stride import new_stride
from stickslip_ros.kernels.kernel import kernel
from stickslip_ros.kernels.record import Record

TURN_SLACK_S = 1.1e-4
"""A reversal within (sim.dt/TURN_SLACK_S)^3 of the presliding range counts as immediate: 1e-4 of
it at the default of 5 us. A hundredth of that gives the same errors of realistic stands with 9 %
more steps."""
LAW_SLACK = 1.0 / 64.0
"""Factor on this way under a rival law: its bristles may be twice as stiff after a reversal."""


@kernel
def pace_of(plant: Record, state: Record, dt_s: float) -> Pace:
    """Return the constants of steps of ``dt_s``."""
    half_s, tau_s = 0.5 * dt_s, plant.amplifier.tau_s
    settling = -math.expm1(-half_s / tau_s) if tau_s > 0.0 else 1.0
    slack_m = (plant.dt_s / TURN_SLACK_S) ** 3 * plant.presliding_m
    if plant.contacts[ALL].law.number != MDR:
        slack_m *= LAW_SLACK
    for j in range(plant.delayed):
        prepare_piezo(plant, state.late[j].piezo, half_s)
    return Pace(half_s, slack_m, settling, prepare_piezo(plant, state.piezo, half_s))


@kernel
def may_pass(state: Record) -> bool:
    """Count a pass of a loop over time; return whether it is allowed."""
    state.passes_left -= 1
    state.passes_made += 1
    return bool(state.passes_left >= 0)


@kernel
def step(
    plant: Record,
    state: Record,
    from_v: float,
    to_v: float,
    load_n: float,
    pace: Pace,
    at_s: float,
) -> None:
    """
    Advance by a short step with a linear voltage before the amplifier's low-pass.

    The step begins ``at_s`` after the start of the stretch.

    """
    # Amplifier and feet.
    voltage_v, foot_m, speed, speeding = move_actuator(
        plant,
        state.piezo,
        state.voltage_v,
        state.foot_m,
        from_v,
        0.5 * (from_v + to_v),
        to_v,
        pace,
    )
    if plant.delayed:
        delay.begin_step(plant, state, at_s, pace)

    # Contacts and runner.
    left_s = 2.0 * pace.half_s
    while left_s > 0.0 and may_pass(state):
        stride = new_stride()
        stride.longest_s = stride.lasts_s = left_s
        stride.slack_m, stride.load_n = pace.slack_m, load_n + plant.load_n
        stride.path.speed, stride.path.speeding = speed, speeding
        # Coulomb's contacts have no stiffness on which the runner could swing.
        if plant.contacts[ALL].law.number == COULOMB:
            take_rigid_stride(plant, state, stride)
        else:
            take_stride(plant, state, stride)
        if plant.delayed:
            delay.pass_stride(plant, state, stride.lasts_s)
        # Exactly 0: a rounding remainder would be a stride that does not move the clock.
        left_s = left_s - stride.lasts_s if stride.lasts_s < left_s else 0.0
        speed += stride.lasts_s * speeding
    state.voltage_v, state.foot_m = voltage_v, foot_m
    if plant.delayed:
        delay.end_step(plant, state)
    stacks.note_ringing(plant, state)


@kernel
def take_stride(plant: Record, state: Record, stride: Record) -> None:
    """Advance all parts until a stiffness jumps."""
    # Forces on each part at the start.
    button.feel(plant, state, stride)
    runner.feel(plant, state, stride)
    stacks.feel(plant, state, stride)
    frame.feel(plant, state, stride)

    # Stiffness of contacts and springs ahead ...
    travel.look_ahead(plant, state, stride)
    contacts.look_ahead(plant, state, stride)
    stacks.look_ahead(plant, state, stride)
    loss.look_ahead(plant, state, stride)
    runner.look_ahead(plant, state, stride)

    # ... and the time until it jumps.
    contacts.cut(plant, state, stride)
    runner.cut(plant, state, stride)
    button.cut(plant, state, stride)

    # Exact motion on that stiffness; the swinging feet act on the frame.
    stacks.swing(plant, state, stride)
    frame.feel(plant, state, stride)
    runner.swing(plant, state, stride)
    frame.swing(plant, state, stride)

    # Correction by the contact forces in the middle ...
    contacts.pass_middle(plant, state, stride)
    loss.follow_stick(plant, state, stride, 0.5 * stride.lasts_s)
    stride.middle_lag_n = stride.lag_n
    runner.pass_middle(plant, state, stride)
    frame.pass_middle(plant, state, stride)
    stacks.pass_middle(plant, state, stride)

    # ... and at the end.
    contacts.arrive(plant, state, stride)
    loss.follow_stick(plant, state, stride, stride.lasts_s)
    stacks.arrive(plant, state, stride)
    frame.arrive(plant, state, stride)
    runner.arrive(plant, state, stride)
    if plant.loss_s > 0.0:
        loss.book_loss(plant, state, stride)
    button.arrive(plant, state, stride)
