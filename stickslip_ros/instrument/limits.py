"""Limits of amplifier and saw-tooth that several requests must keep."""

from stickslip_ros.drive.stages_build import slew_of
from stickslip_ros.errors import OutOfRange
from stickslip_ros.parameters import Parameters

FREQUENCY_MIN_HZ = 1e-3
FALL_SHARE_MAX = 0.5
"""A fall may take at most this share of the period, or the saw-tooth has no ramp left."""


def check_range(parameters: Parameters, name: str, voltage_v: float) -> None:
    """Refuse a voltage outside the range of the amplifier."""
    amplifier = parameters.amplifier
    if voltage_v > amplifier.voltage_max:
        limit = f"above the amplifier's {amplifier.voltage_max:g} V"
        mend = 'lower it or raise amplifier.voltage_max'
        raise OutOfRange(name, voltage_v, 'V', limit, mend)
    if voltage_v < amplifier.voltage_min:
        limit = f"below the amplifier's {amplifier.voltage_min:g} V"
        mend = 'raise it or lower amplifier.voltage_min'
        raise OutOfRange(name, voltage_v, 'V', limit, mend)


def check_amplitude(parameters: Parameters, name: str, amplitude_v: float) -> None:
    """Refuse a saw-tooth that is higher than the range of the amplifier, or has no height."""
    amplifier = parameters.amplifier
    range_v = amplifier.voltage_max - amplifier.voltage_min
    if amplitude_v > range_v:
        limit = f"above the amplifier's {range_v:g} V"
        mend = 'lower it or raise amplifier.voltage_max'
        raise OutOfRange(name, amplitude_v, 'V', limit, mend)
    if amplitude_v <= 0.0:
        mend = 'give it in volts peak to peak; the sign of the frequency is the direction'
        raise OutOfRange(name, amplitude_v, 'V', 'not above 0 V', mend)


def check_frequency(parameters: Parameters, amplitude_v: float, frequency_hz: float) -> None:
    """Refuse a frequency that amplifier or slew rate do not allow at this amplitude."""
    amplifier = parameters.amplifier
    if frequency_hz == 0.0:
        mend = 'give steps per second; the sign is the direction'
        raise OutOfRange('frequency', frequency_hz, 'Hz', 'not a frequency', mend)
    if abs(frequency_hz) < FREQUENCY_MIN_HZ:
        limit = f'below {FREQUENCY_MIN_HZ:g} Hz'
        mend = 'raise it, or ramp the voltage directly'
        raise OutOfRange('frequency', frequency_hz, 'Hz', limit, mend)
    if abs(frequency_hz) > amplifier.frequency_max:
        limit = f"above the amplifier's {amplifier.frequency_max:g} Hz"
        mend = 'lower it or raise amplifier.frequency_max'
        raise OutOfRange('frequency', frequency_hz, 'Hz', limit, mend)
    slew_v_per_s = slew_of(parameters)
    fastest_hz = FALL_SHARE_MAX * slew_v_per_s / amplitude_v
    if abs(frequency_hz) > fastest_hz:
        cause = 'slew_rate' if slew_v_per_s == amplifier.slew_rate else 'current_max'
        limit = f'above the {fastest_hz:.4g} Hz that amplifier.{cause} allows at this amplitude'
        raise OutOfRange('frequency', frequency_hz, 'Hz', limit, 'lower it or the amplitude')
