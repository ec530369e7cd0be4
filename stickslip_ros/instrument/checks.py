# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Check the numbers of commands against amplifier and stand; return their wave or value."""

import math
from collections.abc import Mapping

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.drive.amplifier import corners_within
from stickslip_ros.drive.build import slew_of, tread_s
from stickslip_ros.drive.records import CORNERS, Wave
from stickslip_ros.drive.waveform import level, sawtooth, table
from stickslip_ros.errors import OutOfRange, StickSlipError, UnknownName, WrongKind
from stickslip_ros.parameters import Parameters, Scalar, is_fault, spec_of, specs

STEPS_MAX = 2**31 - 1
ROWS_MAX = 1_000_000
FREQUENCY_MIN_HZ = 1e-3
FALL_SHARE_MAX = 0.5
"""Largest share of the period that a fall may take."""


class BeyondSoftLimit(StickSlipError):
    """A target is outside the soft limits."""


def check_voltage(parameters: Parameters, voltage_v: float) -> Wave:
    """Return a wave of constant voltage."""
    check_range(parameters, 'voltage', voltage_v)
    return level(voltage_v)


def check_sawtooth(
    parameters: Parameters, amplitude_v: float, frequency_hz: float, steps: float
) -> Wave:
    """Return a saw-tooth from the lower end of the range; 0 steps run until stopped."""
    if not (steps == math.floor(steps) and 0 <= steps <= STEPS_MAX):
        limit = f'not a whole number from 0 to {STEPS_MAX}'
        raise OutOfRange('steps', steps, '', limit, 'give a whole number; 0 runs until stopped')
    return _sawtooth_wave(parameters, 'amplitude', amplitude_v, frequency_hz, int(steps))


def check_steps(parameters: Parameters, steps: float) -> Wave | None:
    """Return a wave of a signed number of steps; None for 0."""
    if not (steps == math.floor(steps) and abs(steps) <= STEPS_MAX):
        limit = f'not a whole number from {-STEPS_MAX} to {STEPS_MAX}'
        raise OutOfRange('steps', steps, '', limit, 'round it; its sign is the direction')
    return steps_wave(parameters, int(steps)) if steps else None


def steps_wave(parameters: Parameters, steps: int) -> Wave:
    """
    Return a wave of a number of steps at ``step.amplitude`` and ``step.frequency``.

    Raises OutOfRange if amplifier or slew rate do not allow them.

    """
    return _stepping(parameters, math.copysign(parameters.step.frequency, steps), abs(steps))


def check_jog(parameters: Parameters, frequency_hz: float) -> Wave | None:
    """Return a wave of endless steps; None to end them."""
    return None if frequency_hz == 0.0 else _stepping(parameters, frequency_hz, 0)


def _stepping(parameters: Parameters, frequency_hz: float, steps: int) -> Wave:
    amplitude_v = parameters.step.amplitude
    return _sawtooth_wave(parameters, 'step.amplitude', amplitude_v, frequency_hz, steps)


def _sawtooth_wave(
    parameters: Parameters, name: str, amplitude_v: float, frequency_hz: float, steps: int
) -> Wave:
    check_amplitude(parameters, name, amplitude_v)
    check_frequency(parameters, amplitude_v, frequency_hz)
    base_v = parameters.amplifier.voltage_min
    return check_corners(parameters, sawtooth(base_v, amplitude_v, frequency_hz, steps))


def check_waveform(parameters: Parameters, numbers: Array, cycles: int = 1) -> Wave:
    """
    Return a wave that plays rows of time and voltage, given as a flat list.

    ``cycles`` is the number of plays; 0 repeats until replaced. A repeated wave must be closed.

    """
    rows, rest = divmod(len(numbers), 2)
    if rest or not 2 <= rows <= ROWS_MAX:
        expected = f'2 to {ROWS_MAX} rows of time and voltage'
        raise WrongKind('waveform', numbers[:8].tolist(), expected, 'send [t0, V0, t1, V1, ...]')
    wave = numbers.reshape(rows, 2)
    if wave[0, 0] != 0.0:
        hint = 'start the table at 0 s'
        raise OutOfRange('waveform time of row 1', float(wave[0, 0]), 's', 'not 0 s', hint)
    falls = np.flatnonzero(np.diff(wave[:, 0]) <= 0.0)
    if len(falls):
        row = int(falls[0]) + 1
        limit = f'not after that of row {row}, {wave[row - 1, 0]:g} s'
        hint = 'use rising times'
        raise OutOfRange(f'waveform time of row {row + 1}', float(wave[row, 0]), 's', limit, hint)
    for row in (int(np.argmin(wave[:, 1])), int(np.argmax(wave[:, 1]))):
        check_range(parameters, f'waveform voltage of row {row + 1}', float(wave[row, 1]))
    if cycles != 1:
        check_repetition(parameters, wave, cycles)
    return check_corners(parameters, table(wave, cycles))


def check_repetition(parameters: Parameters, wave: Array, cycles: int) -> None:
    """Refuse a repeated table that does not end at its first voltage, or is too fast."""
    if not 0 <= cycles <= STEPS_MAX:
        limit = f'not from 0 to {STEPS_MAX}'
        raise OutOfRange('waveform cycles', cycles, '', limit, '0 repeats until replaced')
    (_, first_v), (period_s, last_v) = wave[0], wave[-1]
    if first_v != last_v:
        limit = f'not the first voltage, {first_v:g} V, although the waveform repeats'
        hint = 'end a cycle at its first voltage; write a jump as a steep slope'
        raise OutOfRange('last waveform voltage', float(last_v), 'V', limit, hint)
    shortest_s = 1.0 / parameters.amplifier.frequency_max
    if period_s < shortest_s:
        limit = f'below 1/amplifier.frequency_max, {shortest_s:.4g} s'
        raise OutOfRange('waveform period', float(period_s), 's', limit, 'lengthen the cycle')


def check_corners(parameters: Parameters, wave: Wave) -> Wave:
    """Return a wave; refuse more corners than feet with a delay can remember."""
    feet = parameters.feet
    delay_s = max((s for s, gain in zip(feet.delay, feet.gain, strict=True) if gain), default=0.0)
    if not delay_s:
        return wave
    step_v, most = parameters.amplifier.resolution, CORNERS // 2
    tread = tread_s(parameters) if step_v else 0.0
    corners = round(corners_within(wave, delay_s, slew_of(parameters), step_v, tread))
    if corners > most:
        limit = f'above the {most} that are remembered for the longest feet.delay, {delay_s:g} s'
        hint = 'shorten it, send a lower frequency or fewer rows'
        hint += ', or set amplifier.resolution to 0 V' * (step_v > 0.0)
        raise OutOfRange('corners of the voltage', corners, '', limit, hint)
    return wave


def check_position(parameters: Parameters, x_m: float) -> float:
    """Return the target of the position reading, m; steps must be possible."""
    limits = parameters.limits
    if limits.has_soft_limits and not limits.soft_min <= x_m <= limits.soft_max:
        raise BeyondSoftLimit(
            f'position x {x_m:g} m is outside the soft limits {limits.soft_min:g} to '
            f'{limits.soft_max:g} m; stay inside, or move limits.soft_min and limits.soft_max'
        )
    parameters.check_travel('position x', x_m)
    check_jog(parameters, parameters.step.frequency)
    return x_m


def fastest_steps_m_per_s(parameters: Parameters) -> float:
    """Return the largest velocity, of steps as long as the stroke, m/s."""
    return parameters.actuator.gain * parameters.step.amplitude * parameters.step.frequency


def check_velocity(parameters: Parameters, name: str, velocity_m_per_s: float) -> float:
    """Refuse a velocity that steps cannot reach; steps must be possible."""
    fastest = fastest_steps_m_per_s(parameters)
    if abs(velocity_m_per_s) > fastest:
        limit = f'above the largest velocity of steps, {fastest:.4g} m/s'
        hint = 'lower it or raise step.frequency'
        raise OutOfRange(name, velocity_m_per_s, 'm/s', limit, hint)
    check_jog(parameters, parameters.step.frequency)
    return velocity_m_per_s


def check_load(parameters: Parameters, force_n: float) -> float:
    """Return the external force along +x, N."""
    limit_n = parameters.stand.load_limit
    if abs(force_n) > limit_n:
        limit = f'beyond the {limit_n:g} N that the stand allows'
        hint = 'lower it or raise stand.load_limit'
        raise OutOfRange('load force.x', force_n, 'N', limit, hint)
    return force_n


def check_preload(parameters: Parameters, force_n: float) -> float:
    """Return the wanted preload, N."""
    lowest_n = spec_of('stand.preload').minimum or 0.0
    limit_n = parameters.stand.preload_limit
    if force_n < lowest_n:
        limit = f'below the {lowest_n:g} N that hold the runner'
        raise OutOfRange('preload', force_n, 'N', limit, 'raise it')
    if parameters.contact.travel:
        limit = f'a change from {parameters.stand.preload:g} N, excluded by contact.travel'
        raise OutOfRange('preload', force_n, 'N', limit, 'set contact.travel to 0')
    if force_n > limit_n:
        limit = f'above the {limit_n:g} N that the stand allows'
        raise OutOfRange('preload', force_n, 'N', limit, 'lower it or raise stand.preload_limit')
    return force_n


def check_faults(parameters: Parameters, settings: Mapping[str, Scalar]) -> Mapping[str, Scalar]:
    """Return full names of parameters ``fault.*`` and their new values."""
    for name in settings:
        if not is_fault(name):
            hint = 'name parameters fault.*, but not fault.schedule'
            raise UnknownName('fault', name, hint)
    parameters.updated(settings)
    return settings


def check_live(parameters: Parameters, settings: Mapping[str, Scalar]) -> Mapping[str, Scalar]:
    """Return full names of live parameters other than faults, and their new values."""
    for name in settings:
        if is_fault(name) or not spec_of(name).live:
            live = (each for each, spec in specs().items() if spec.live and not is_fault(each))
            raise UnknownName('live parameter', name, f'use {", ".join(live)}')
    _check_drive(parameters, parameters.updated(settings))
    return settings


def _check_drive(before: Parameters, after: Parameters) -> None:
    """Refuse another friction or mass where the memory of the contacts does not allow it."""
    law, feet = before.contact.law, before.feet
    own_friction = law != 'mdr' and any(feet.friction)
    old, new = before.flat(), after.flat()
    for name, reason, excludes in (
        ('contact.friction', 'contact.travel', before.contact.travel),
        ('contact.friction', 'feet.guide_friction', feet.guide_friction),
        ('contact.friction', f'feet.friction under contact.law {law}', own_friction),
        ('runner.mass', 'stand.weight', before.stand.weight),
    ):
        if excludes and new[name] != old[name]:
            unit = spec_of(name).unit
            was = f'{old[name]:g} {unit}'.rstrip()
            limit = f'a change from {was}, excluded by {reason} while the drive runs'
            raise OutOfRange(name, new[name], unit, limit, 'deactivate the drive, then set it')


def check_range(parameters: Parameters, name: str, voltage_v: float) -> None:
    """Refuse a voltage outside the range of the amplifier."""
    amplifier = parameters.amplifier
    if voltage_v > amplifier.voltage_max:
        limit = f"above the amplifier's {amplifier.voltage_max:g} V"
        hint = 'lower it or raise amplifier.voltage_max'
        raise OutOfRange(name, voltage_v, 'V', limit, hint)
    if voltage_v < amplifier.voltage_min:
        limit = f"below the amplifier's {amplifier.voltage_min:g} V"
        hint = 'raise it or lower amplifier.voltage_min'
        raise OutOfRange(name, voltage_v, 'V', limit, hint)


def check_amplitude(parameters: Parameters, name: str, amplitude_v: float) -> None:
    """Refuse an amplitude that is above the range of the amplifier, or not positive."""
    range_v = parameters.amplifier.range_v
    if amplitude_v > range_v:
        limit = f"above the amplifier's {range_v:g} V"
        hint = 'lower it or raise amplifier.voltage_max'
        raise OutOfRange(name, amplitude_v, 'V', limit, hint)
    if amplitude_v <= 0.0:
        hint = 'raise it; a negative frequency goes backwards'
        raise OutOfRange(name, amplitude_v, 'V', 'not above 0 V', hint)


def check_frequency(parameters: Parameters, amplitude_v: float, frequency_hz: float) -> None:
    """Refuse a frequency that the amplifier does not allow at this amplitude."""
    amplifier = parameters.amplifier
    if frequency_hz == 0.0:
        hint = 'give steps per second; the sign is the direction'
        raise OutOfRange('frequency', frequency_hz, 'Hz', 'not a frequency', hint)
    if abs(frequency_hz) < FREQUENCY_MIN_HZ:
        limit = f'below {FREQUENCY_MIN_HZ:g} Hz'
        hint = 'raise it, or ramp the voltage directly'
        raise OutOfRange('frequency', frequency_hz, 'Hz', limit, hint)
    if abs(frequency_hz) > amplifier.frequency_max:
        limit = f"above the amplifier's {amplifier.frequency_max:g} Hz"
        hint = 'lower it or raise amplifier.frequency_max'
        raise OutOfRange('frequency', frequency_hz, 'Hz', limit, hint)
    slew_v_per_s = slew_of(parameters)
    fastest_hz = FALL_SHARE_MAX * slew_v_per_s / amplitude_v
    if abs(frequency_hz) > fastest_hz:
        cause = 'slew_rate' if slew_v_per_s == amplifier.slew_rate else 'current_max'
        limit = f'above the {fastest_hz:.4g} Hz that amplifier.{cause} allows at this amplitude'
        raise OutOfRange('frequency', frequency_hz, 'Hz', limit, 'lower it or the amplitude')
