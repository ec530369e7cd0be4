"""What an operator may ask of the drive, and the limits that every request must keep."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from stickslip_ros.drive.records import Wave
from stickslip_ros.drive.waveform import level, sawtooth
from stickslip_ros.errors import OutOfRange, UnknownName, WrongKind
from stickslip_ros.parameters import Parameters, Scalar, spec_of

STEPS_MAX = 2**31 - 1
FREQUENCY_MIN_HZ = 1e-3
FALL_SHARE_MAX = 0.5
"""A fall may take at most this share of the period, or the saw-tooth has no ramp left."""


@dataclass(frozen=True)
class Request:
    """
    What somebody asked for, not yet checked.

    Attributes
    ----------
    name : str
        One of ``REQUESTS``.
    values : tuple of float
        Its numbers, in the order of the topic; rows of a waveform one after another.
    settings : tuple of (str, value)
        Of ``fault``: full names of parameters ``fault.*`` and their new values.

    """

    name: str
    values: tuple[float, ...] = ()
    settings: tuple[tuple[str, Scalar], ...] = ()


@dataclass(frozen=True)
class Move:
    """A checked request for the piezo: the wave that it shall follow."""

    name: str
    wave: Wave


@dataclass(frozen=True)
class Load:
    """A checked request for an external force on the runner, N along +x."""

    force_n: float


@dataclass(frozen=True)
class Preload:
    """A checked request for another preload, N; the drive goes there at its preload rate."""

    force_n: float


@dataclass(frozen=True)
class Stop:
    """Hold the present voltage."""


@dataclass(frozen=True)
class Reset:
    """Go back to the state at the start: relaxed contacts, runner at 0, no load."""


Command = Move | Load | Preload | Stop | Reset


def check_request(request: Request, parameters: Parameters) -> Command:
    """
    Return the command that a request stands for.

    Parameters
    ----------
    request : Request
        Name and numbers as they came.
    parameters : Parameters
        Limits of amplifier and stand.

    Raises
    ------
    UnknownName
        If there is no such command.
    WrongKind
        If the numbers are too few, too many, or not finite.
    OutOfRange
        If a number is outside its limit.

    """
    if request.name not in _CHECKS:
        raise UnknownName('command', request.name, f'use {", ".join(_CHECKS)}')
    labels, check = _CHECKS[request.name]
    if len(request.values) != len(labels):
        expected = f'a list of {len(labels)} numbers' if labels else 'empty'
        mend = f'send [{", ".join(labels)}]'
        raise WrongKind(request.name, list(request.values[:8]), expected, mend)
    for label, value in zip(labels, request.values, strict=True):
        if not math.isfinite(value):
            name = _full_label(request.name, label)
            raise WrongKind(name, value, 'a finite number', 'send a number')
    return check(parameters, *request.values)


def _full_label(command: str, label: str) -> str:
    """Return the name of a number in a message: ``sawtooth amplitude``, but ``voltage``."""
    name = label.partition(' ')[0]
    return name if name == command else f'{command} {name}'


def _check_voltage(parameters: Parameters, voltage_v: float) -> Move:
    amplifier = parameters.amplifier
    if voltage_v > amplifier.voltage_max:
        limit = f"above the amplifier's {amplifier.voltage_max:g} V"
        mend = 'lower it or raise amplifier.voltage_max'
        raise OutOfRange('voltage', voltage_v, 'V', limit, mend)
    if voltage_v < amplifier.voltage_min:
        limit = f"below the amplifier's {amplifier.voltage_min:g} V"
        mend = 'raise it or lower amplifier.voltage_min'
        raise OutOfRange('voltage', voltage_v, 'V', limit, mend)
    return Move('voltage', level(voltage_v))


def _check_sawtooth(
    parameters: Parameters, amplitude_v: float, frequency_hz: float, steps: float
) -> Move:
    _check_amplitude(parameters, amplitude_v)
    _check_frequency(parameters, amplitude_v, frequency_hz)
    if not (steps == math.floor(steps) and 0 <= steps <= STEPS_MAX):
        limit = f'not a whole number from 0 to {STEPS_MAX}'
        raise OutOfRange('steps', steps, '', limit, 'round it; 0 runs until stopped')
    base_v = parameters.amplifier.voltage_min
    return Move('sawtooth', sawtooth(base_v, amplitude_v, frequency_hz, int(steps)))


def _check_amplitude(parameters: Parameters, amplitude_v: float) -> None:
    amplifier = parameters.amplifier
    range_v = amplifier.voltage_max - amplifier.voltage_min
    if amplitude_v > range_v:
        limit = f"above the amplifier's {range_v:g} V"
        mend = 'lower it or raise amplifier.voltage_max'
        raise OutOfRange('amplitude', amplitude_v, 'V', limit, mend)
    if amplitude_v <= 0.0:
        mend = 'give it in volts peak to peak; the sign of the frequency is the direction'
        raise OutOfRange('amplitude', amplitude_v, 'V', 'not above 0 V', mend)


def _check_frequency(parameters: Parameters, amplitude_v: float, frequency_hz: float) -> None:
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
    fastest_hz = FALL_SHARE_MAX * amplifier.slew_rate / amplitude_v
    if abs(frequency_hz) > fastest_hz:
        limit = f'above the {fastest_hz:.4g} Hz that amplifier.slew_rate allows at this amplitude'
        raise OutOfRange('frequency', frequency_hz, 'Hz', limit, 'lower it or the amplitude')


def _check_load(parameters: Parameters, force_n: float, *others: float) -> Load:
    for label, value in zip(_WRENCH[1:], others, strict=True):
        if value != 0.0:
            name, _, unit = label.partition(' ')
            mend = 'set it to 0: the runner moves along x only'
            raise OutOfRange(f'load {name}', value, unit, 'not 0', mend)
    limit_n = parameters.stand.load_limit
    if abs(force_n) > limit_n:
        limit = f'beyond the {limit_n:g} N that the stand allows'
        mend = 'lower it or raise stand.load_limit'
        raise OutOfRange('load force.x', force_n, 'N', limit, mend)
    return Load(force_n)


def _check_preload(parameters: Parameters, force_n: float) -> Preload:
    lowest_n = spec_of('stand.preload').minimum or 0.0
    limit_n = parameters.stand.preload_limit
    if force_n < lowest_n:
        limit = f'below the {lowest_n:g} N that hold the runner'
        raise OutOfRange('preload', force_n, 'N', limit, 'raise it')
    if force_n > limit_n:
        limit = f'above the {limit_n:g} N that the stand allows'
        raise OutOfRange('preload', force_n, 'N', limit, 'lower it or raise stand.preload_limit')
    return Preload(force_n)


_WRENCH = ('force.x N', 'force.y N', 'force.z N', 'torque.x N m', 'torque.y N m', 'torque.z N m')
_CHECKS: Mapping[str, tuple[tuple[str, ...], Callable[..., Command]]] = {
    'voltage': (('voltage V',), _check_voltage),
    'sawtooth': (('amplitude V', 'frequency Hz', 'steps'), _check_sawtooth),
    'load': (_WRENCH, _check_load),
    'preload': (('preload N',), _check_preload),
    'stop': ((), lambda _: Stop()),
    'reset': ((), lambda _: Reset()),
}
