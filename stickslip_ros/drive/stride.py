# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A stride: a time without a jump of a stiffness, and the data that the parts of the drive share.

Each part is a module with some of these kernels of plant, state and stride:

- ``feel``: forces at the start;
- ``look_ahead``: stiffness ahead;
- ``cut``: time until this stiffness jumps;
- ``swing``: exact motion on this stiffness, to the middle and to the end;
- ``pass_middle``: correction by the forces in the middle;
- ``arrive``: correction by the forces at the end, and energy losses.

An absent part does nothing, and its fields stay 0.

"""

from stickslip_ros.drive.oscillator import SWING
from stickslip_ros.kernels.kernel import kernel, on_stack
from stickslip_ros.kernels.record import FLAG, FLOAT, Record, kind

WAY = kind(speed=FLOAT, speeding=FLOAT)
"""A parabola of time: initial velocity, m/s, and constant acceleration, m/s^2."""

STRIDE = kind(
    longest_s=FLOAT,  # Longest possible and actual duration
    lasts_s=FLOAT,
    passed_s=FLOAT,  # Time at which the contacts were evaluated last
    slack_m=FLOAT,  # Way within which a reversal counts as immediate
    load_n=FLOAT,  # External load
    holding_n=FLOAT,  # Force that would keep rigid contacts from sliding
    path=WAY,  # Mean foot without load
    feet=WAY,  # Mean of all feet against the frame
    # Frame, and its position at the start, in the middle and at the end; centre of mass of frame
    # and feet, and rate of the force on it
    sway=WAY,
    frame_m=FLOAT,
    frame_middle_m=FLOAT,
    frame_end_m=FLOAT,
    centre=SWING,
    grows_n_per_s=FLOAT,
    # Runner with all that moves with it, its inverse mass, and stiffness of load cell and stops
    runner=SWING,
    per_kg=FLOAT,
    held_n_per_m=FLOAT,
    pull=FLOAT,  # Its acceleration without damping and without loss in the contacts
    # Mass, damping, stiffness and force that other parts add to the runner
    others_kg=FLOAT,
    others_n_s_per_m=FLOAT,
    others_n_per_m=FLOAT,
    others_n=FLOAT,
    # Stiffness of the contacts on the runner, and on the mean foot; parabola of the feet that they
    # follow; rates of their force on a runner at rest; whether a contact may turn
    tangent=FLOAT,
    driven=FLOAT,
    pulled=WAY,
    drive=WAY,
    may_turn=FLAG,
    # Their force on the runner, and on the mean foot, at the start and in the middle
    before_n=FLOAT,
    middle_n=FLOAT,
    drag_n=FLOAT,
    middle_drag_n=FLOAT,
    # Viscous force of sticking contacts at the last evaluation, at the start and in the middle
    lag_n=FLOAT,
    start_lag_n=FLOAT,
    middle_lag_n=FLOAT,
    # Power of the contacts on delayed feet at the start and in the middle, and at the time at
    # which they were evaluated last
    before_w=FLOAT,
    middle_w=FLOAT,
    late_w=FLOAT,
    # Bent stacks: acceleration of the frame, and free motion of half the stride
    recoil=FLOAT,
    ring_m=FLOAT,
    ring_m_per_s=FLOAT,
)
"""Data that the parts share in a stride."""

new_stride = on_stack(STRIDE)


@kernel
def way_after(way: Record, time_s: float) -> float:
    """Return the way after a time, m."""
    return way_in(way.speed, way.speeding, time_s)


@kernel
def way_in(speed: float, speeding: float, time_s: float) -> float:
    """Return the way with a velocity, m/s, and an acceleration, m/s^2, in a time, m."""
    return time_s * (speed + 0.5 * time_s * speeding)
