"""Kernel: the damped oscillator y'' + gamma y' + omega^2 y = p + q t, solved exactly."""

from typing import NamedTuple

from stickslip_ros.contact.kernel import kernel

# 1/(n (n-1)) of the power series: a multiplication is many times faster than a division.
C3, C4, C5, C6, C7, C8, C9, C10, C11 = (
    1.0 / 6.0,
    1.0 / 4.0,
    1.0 / 20.0,
    1.0 / 30.0,
    1.0 / 42.0,
    1.0 / 56.0,
    1.0 / 72.0,
    1.0 / 90.0,
    1.0 / 110.0,
)


class Propagator(NamedTuple):
    """
    Responses of an oscillator after a time h, from rest at zero.

    Attributes
    ----------
    velocity : float
        Velocity after an initial velocity of 1.
    impulse : float
        Displacement after an initial velocity of 1 (velocity after an acceleration of 1), s.
    step : float
        Displacement under a constant acceleration of 1 from outside, s^2.
    ramp : float
        Displacement under an acceleration that grows by 1 per second, s^3.

    """

    velocity: float
    impulse: float
    step: float
    ramp: float


@kernel
def propagator(omega_squared: float, gamma: float, h_s: float) -> Propagator:
    """
    Return the responses after a time.

    Parameters
    ----------
    omega_squared : float
        Stiffness over mass, 1/s^2.
    gamma : float
        Damping over mass, 1/s.
    h_s : float
        Time, s; sqrt(omega_squared) h and gamma h up to about 1.

    Notes
    -----
    The ramp response is summed as a power series in h: its terms follow from the equation, and
    eight of them are exact to 1e-9 for omega h = 1. The others follow from it without a series:
    step is its derivative, impulse = h - gamma step - omega^2 ramp, and so on.

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
