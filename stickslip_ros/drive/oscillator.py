# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Kernel: exact motion of a damped oscillator in a step, as a power series."""

from typing import NamedTuple

from stickslip_ros.kernels.kernel import kernel
from stickslip_ros.kernels.record import FLOAT, Record, kind

SIXTH = 1.0 / 6.0
# 1/(n (n-1)) of the power series, because multiplication is many times faster than division.
C3, C4, C5, C6 = 1.0 / 6.0, 1.0 / 4.0, 1.0 / 20.0, 1.0 / 30.0
C7, C8, C9, C10, C11 = 1.0 / 42.0, 1.0 / 56.0, 1.0 / 72.0, 1.0 / 90.0, 1.0 / 110.0


class Propagator(NamedTuple):
    """Responses of an oscillator after a time h, from rest at zero."""

    velocity: float  # velocity after an initial velocity of 1
    # displacement after an initial velocity of 1 (velocity after an acceleration of 1), s
    impulse: float
    step: float  # displacement under a constant acceleration of 1 from outside, s^2
    ramp: float  # displacement under an acceleration that grows by 1 per second, s^3


SWING = kind(
    # At the start: velocity and its derivatives; force per mass and its derivatives
    speed=FLOAT,
    speeding=FLOAT,
    jerk=FLOAT,
    pull=FLOAT,
    pull_rate=FLOAT,
    pull_jerk=FLOAT,
    omega_squared=FLOAT,
    gamma=FLOAT,
    # Way from the start and velocity, in the middle and at the end
    middle_m=FLOAT,
    middle_m_per_s=FLOAT,
    end_m=FLOAT,
    end_m_per_s=FLOAT,
    # Responses of half the stride, as in Propagator; missed acceleration in the middle
    velocity=FLOAT,
    impulse=FLOAT,
    missed=FLOAT,
    curved=FLOAT,  # Part of it by contacts that lose energy
)
"""A body on a damped spring in a stride."""


@kernel
def propagator(omega_squared: float, gamma: float, h_s: float) -> Propagator:
    """
    Return the responses after a time of y'' + gamma y' + omega^2 y = p + q t, solved exactly.

    Notes
    -----
    Valid for omega h and gamma h up to about 1. The ramp response is a power series in h, whose
    eight further terms are exact to 1e-9 for omega h = 1. The other responses follow from it: step
    is its derivative, impulse = h - gamma step - omega^2 ramp, and so on.

    """
    z = omega_squared * h_s * h_s
    y = gamma * h_s
    b3 = C3
    b4 = -y * b3 * C4
    b5 = -(4.0 * y * b4 + z * b3) * C5
    b6 = -(5.0 * y * b5 + z * b4) * C6
    b7 = -(6.0 * y * b6 + z * b5) * C7
    b8 = -(7.0 * y * b7 + z * b6) * C8
    b9 = -(8.0 * y * b8 + z * b7) * C9
    b10 = -(9.0 * y * b9 + z * b8) * C10
    b11 = -(10.0 * y * b10 + z * b9) * C11
    even = 4.0 * b4 + 6.0 * b6 + 8.0 * b8 + 10.0 * b10
    odd = 3.0 * b3 + 5.0 * b5 + 7.0 * b7 + 9.0 * b9 + 11.0 * b11
    ramp = (b3 + b4 + b5 + b6 + b7 + b8 + b9 + b10 + b11) * h_s * h_s * h_s
    step = (even + odd) * h_s * h_s
    impulse = h_s - gamma * step - omega_squared * ramp
    return Propagator(1.0 - gamma * impulse - omega_squared * step, impulse, step, ramp)


@kernel
def swing_twice(body: Record, half_s: float) -> None:
    """Move a body exactly, in two halves, under a force that is a parabola of time."""
    omega_squared, gamma, speed = body.omega_squared, body.gamma, body.speed
    pull, pull_rate, pull_jerk = body.pull, body.pull_rate, body.pull_jerk
    half = propagator(omega_squared, gamma, half_s)
    # The response to an acceleration of t^2/2: a series of the time, as in the propagator.
    z, y = omega_squared * half_s * half_s, gamma * half_s
    c5 = -y / 5.0
    c6 = -(5.0 * y * c5 + z) / 30.0
    c7 = -(6.0 * y * c6 + z * c5) / 42.0
    c8 = -(7.0 * y * c7 + z * c6) / 56.0
    curved = (1.0 + c5 + c6 + c7 + c8) / 24.0 * (half_s * half_s) * (half_s * half_s)
    y_1 = speed * half.impulse + pull * half.step + pull_rate * half.ramp + pull_jerk * curved
    w_1 = speed * half.velocity + pull * half.impulse + pull_rate * half.step
    w_1 += pull_jerk * half.ramp
    pull_1 = pull + half_s * (pull_rate + 0.5 * half_s * pull_jerk) - omega_squared * y_1
    rate_1 = pull_rate + half_s * pull_jerk
    y_2 = y_1 + w_1 * half.impulse + pull_1 * half.step + rate_1 * half.ramp + pull_jerk * curved
    w_2 = w_1 * half.velocity + pull_1 * half.impulse + rate_1 * half.step + pull_jerk * half.ramp
    body.middle_m, body.middle_m_per_s, body.end_m, body.end_m_per_s = y_1, w_1, y_2, w_2
    body.velocity, body.impulse = half.velocity, half.impulse


@kernel
def add_in_middle(body: Record, missed: float, h_s: float) -> None:
    """Correct the motion by a missed acceleration in the middle, by Simpson's rule."""
    body.missed = missed
    body.middle_m_per_s += SIXTH * h_s * missed
    body.end_m += 4.0 * SIXTH * h_s * body.impulse * missed


@kernel
def add_at_end(body: Record, missed: float, h_s: float) -> None:
    """Correct the velocity at the end by a missed acceleration, by Simpson's rule."""
    body.end_m_per_s += SIXTH * h_s * (4.0 * body.velocity * body.missed + missed)


@kernel
def add_loss_in_middle(body: Record, curved: float, loss_s: float) -> None:
    """
    Correct the motion by the loss in the contacts: loss_s times the rate of their missed force.

    The missed force begins as the square of time. Its rate has the momentum of the force itself.

    """
    body.curved = curved
    body.middle_m_per_s += loss_s * curved
    body.end_m += 16.0 * SIXTH * loss_s * body.impulse * curved


@kernel
def add_loss_at_end(body: Record, curved: float, loss_s: float) -> None:
    """Correct the velocity at the end by the loss in the contacts."""
    decayed = 16.0 * SIXTH * (1.0 - body.velocity) * body.curved
    body.end_m_per_s += loss_s * (curved - decayed)
