"""The commanded voltage: saw-teeth of either direction, levels."""

import math

from stickslip_ros.contact.kernel import kernel
from stickslip_ros.drive.records import ENDLESS, Clock, Wave

CORNER_S = 1e-15
"""A corner nearer than this has been reached: rounding, no time of the drive."""


def level(voltage_v: float) -> Wave:
    """Return the wave that jumps to a voltage and stays there."""
    return Wave(float(voltage_v), 0.0, 1.0, 0)


def sawtooth(base_v: float, amplitude_v: float, frequency_hz: float, steps: int) -> Wave:
    """
    Return a saw-tooth between ``base_v`` and ``base_v + amplitude_v``.

    Parameters
    ----------
    base_v : float
        Lower end, V.
    amplitude_v : float
        Peak to peak, V, >= 0.
    frequency_hz : float
        Ramps per second; positive ramps rise slowly and fall at once (forwards), negative
        ones fall slowly and rise at once (backwards, starting from the upper end).
    steps : int
        Number of ramps; 0 repeats until replaced.

    """
    forwards = frequency_hz > 0.0
    return Wave(
        start_v=float(base_v if forwards else base_v + amplitude_v),
        rise_v=float(math.copysign(amplitude_v, frequency_hz)),
        period_s=1.0 / abs(frequency_hz),
        cycles=int(steps) if steps > 0 else ENDLESS,
    )


@kernel
def target(wave: Wave, clock: Clock) -> tuple[float, float, float]:
    """Return the commanded voltage (V), its slope (V/s) and the time to its next corner (s)."""
    if clock.cycle >= wave.cycles:
        return wave.start_v, 0.0, math.inf
    slope_v_per_s = wave.rise_v / wave.period_s
    return wave.start_v + slope_v_per_s * clock.ramp_s, slope_v_per_s, wave.period_s - clock.ramp_s


@kernel
def ramp_is_over(wave: Wave, clock: Clock) -> bool:
    """Tell whether the present ramp has come to its corner."""
    return clock.cycle < wave.cycles and wave.period_s - clock.ramp_s <= CORNER_S
