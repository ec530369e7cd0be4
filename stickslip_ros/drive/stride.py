# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A stride: the time in which no stiffness jumps, and what the parts of the drive tell each other.

Each part is a module with some of these verbs, each a kernel of plant, state and stride:

- ``feel``: what pulls on it now;
- ``look_ahead``: how stiff it will be;
- ``cut``: until when it stays so;
- ``swing``: its exact motion on that stiffness, to the middle and to the end;
- ``pass_middle``: what the stiffness has missed in the middle;
- ``arrive``: what it has missed at the end, and what was lost.

A part that the drive lacks does nothing: its fields stay 0.

"""

from stickslip_ros.drive.oscillator import SWING
from stickslip_ros.kernels.kernel import kernel, on_stack
from stickslip_ros.kernels.record import FLAG, FLOAT, Record, kind

WAY = kind(speed=FLOAT, speeding=FLOAT)
"""A parabola of time: velocity, m/s, and acceleration, m/s^2, which stays."""

STRIDE = kind(
    longest_s=FLOAT,  # How long it may last, and how long it does
    lasts_s=FLOAT,
    passed_s=FLOAT,  # How much of it the contacts have gone
    slack_m=FLOAT,  # Way by which a turn may come late
    load_n=FLOAT,  # External load
    holding_n=FLOAT,  # Force that would keep contacts from sliding which are rigid
    path=WAY,  # The mean foot as the voltage wants it
    feet=WAY,  # The mean of all feet against the frame, which feels it
    # The frame, and where it is now, in the middle and at the end; the centre of mass of frame and
    # feet, and how the force on it grows
    sway=WAY,
    frame_m=FLOAT,
    frame_middle_m=FLOAT,
    frame_end_m=FLOAT,
    centre=SWING,
    grows_n_per_s=FLOAT,
    # What moves as the runner, its inverse mass, and how stiffly load cell and stops hold it
    runner=SWING,
    per_kg=FLOAT,
    held_n_per_m=FLOAT,
    # What else moves with it, damps, holds and pulls it: a part adds its own
    others_kg=FLOAT,
    others_n_s_per_m=FLOAT,
    others_n_per_m=FLOAT,
    others_n=FLOAT,
    # Stiffness of the contacts against the runner, and how much of it goes which way with the
    # feet; how both let their pull on a runner at rest grow; whether one of them may turn
    tangent=FLOAT,
    driven=FLOAT,
    pulled=WAY,
    drive=WAY,
    may_turn=FLAG,
    # Their force on the runner, and that on the mean foot, before and in the middle
    before_n=FLOAT,
    middle_n=FLOAT,
    drag_n=FLOAT,
    middle_drag_n=FLOAT,
    # Of bent stacks: the acceleration of the frame, and how half of the stride rings
    recoil=FLOAT,
    ring_m=FLOAT,
    ring_m_per_s=FLOAT,
)
"""All that the parts tell each other in a stride."""

new_stride = on_stack(STRIDE)


@kernel
def way_on(way: Record, time_s: float) -> float:
    """Return the way on a parabola after a time, m."""
    return time_s * (way.speed + 0.5 * time_s * way.speeding)
