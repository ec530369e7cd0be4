"""
The drive: a voltage in, a runner motion out. One short step of it, whatever its parts are like.

The voltage moves the feet, the feet drag the contacts, and the contacts pull the runner.

"""

import math
from typing import NamedTuple

from stickslip_ros.contact.kernel import kernel
from stickslip_ros.contact.record import Record
from stickslip_ros.drive.amplifier import low_pass
from stickslip_ros.drive.feet import move_contacts
from stickslip_ros.drive.ledger import book
from stickslip_ros.drive.piezo import Ring, displace, prepare_piezo
from stickslip_ros.drive.runner import force_on_runner, holding_force, kick_after, kick_before

VERLET_REFINEMENT = 8
"""Steps of velocity Verlet are so many times shorter than the long ones: second order, no look
ahead."""


class Pace(NamedTuple):
    """
    What all steps of one length share.

    Attributes
    ----------
    dt_s : float
        Their length.
    settling : float
        Share of its way that the low-pass of the amplifier goes in one.
    ring : Ring
        What the resonance of the piezo does in one.

    """

    dt_s: float
    settling: float
    ring: Ring


@kernel
def pace_of(plant: Record, state: Record, dt_s: float) -> Pace:
    """Prepare steps of one length."""
    tau_s = plant.amplifier.tau_s
    settling = -math.expm1(-dt_s / tau_s) if tau_s > 0.0 else 1.0
    return Pace(dt_s, settling, prepare_piezo(plant, state.piezo, dt_s))


@kernel
def step(
    plant: Record, state: Record, from_v: float, to_v: float, load_n: float, pace: Pace
) -> None:
    """Advance by one short step, along a straight voltage before the amplifier's low-pass."""
    dt_s = pace.dt_s

    # Amplifier and feet.
    voltage_v = low_pass(plant, state.voltage_v, from_v, to_v, dt_s, pace.settling)
    foot_m = displace(plant, state.piezo, voltage_v, pace.ring, dt_s)
    foot_m_per_s = (foot_m - state.foot_m) / dt_s

    # Runner, up to the middle of the step.
    before_n = force_on_runner(plant, state.position_m, state.contact_n, load_n)
    middle_m_per_s = kick_before(plant, state.velocity_m_per_s, before_n, dt_s)
    position_m = state.position_m + dt_s * middle_m_per_s

    # Contacts.
    holding_n = holding_force(plant, position_m, middle_m_per_s, foot_m_per_s, load_n, dt_s)
    feet_work_j = move_contacts(plant, state, position_m, foot_m, dt_s, holding_n)

    # Runner, up to the end.
    after_n = force_on_runner(plant, position_m, state.contact_n, load_n)
    velocity_m_per_s = kick_after(plant, middle_m_per_s, after_n, dt_s)

    # Ledger.
    book(plant, state, position_m, velocity_m_per_s, feet_work_j, load_n, dt_s)
    state.voltage_v, state.foot_m = voltage_v, foot_m
    state.position_m, state.velocity_m_per_s = position_m, velocity_m_per_s
