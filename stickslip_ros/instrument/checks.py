"""From requests to commands: what is asked for is checked here, once."""

import math
from collections.abc import Mapping

import numpy as np

from stickslip_ros.contact.profile import Array
from stickslip_ros.drive.waveform import level, sawtooth, table
from stickslip_ros.errors import OutOfRange, StickSlipError, UnknownName, WrongKind
from stickslip_ros.instrument.commands import (
    Check,
    ClearFaults,
    Command,
    EnableAmplifier,
    Jog,
    Load,
    Move,
    NoMove,
    Preload,
    Request,
    Reset,
    SetFaults,
    Stop,
    TareForce,
    Target,
    ZeroPosition,
)
from stickslip_ros.instrument.limits import check_amplitude, check_frequency, check_range
from stickslip_ros.parameters import Parameters, spec_of

STEPS_MAX = 2**31 - 1
ROWS_MAX = 1_000_000
ANY = '*'
"""Label of numbers of which there may be any count."""


class BeyondSoftLimit(StickSlipError):
    """A target outside the soft limits: no mistake of form, the stage would leave its range."""


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
    BeyondSoftLimit
        If a target lies outside the soft limits.

    """
    if request.name == 'fault':
        return _check_fault(request)
    if request.name not in CHECKS:
        known = ', '.join((*CHECKS, 'fault'))
        raise UnknownName('command', request.name, f'use {known}')
    labels, check = CHECKS[request.name]
    if labels == (ANY,):
        return check(parameters, _finite(request))
    if len(request.values) != len(labels):
        expected = f'a list of {len(labels)} numbers' if labels else 'empty'
        mend = f'send [{", ".join(labels)}]'
        raise WrongKind(request.name, list(request.values[:8]), expected, mend)
    for index, value in enumerate(request.values):
        if not math.isfinite(value):
            name = _full_label(request.name, labels[index])
            raise WrongKind(name, value, 'a finite number', 'send a number')
    return check(parameters, *request.values)


def _finite(request: Request) -> Array:
    """Return the numbers of a request at once: there may be many, and the drive waits for it."""
    numbers = np.asarray(request.values, dtype=float)
    bad = np.flatnonzero(~np.isfinite(numbers))
    if len(bad):
        index = int(bad[0])
        name = f'{request.name} number {index + 1}'
        raise WrongKind(name, float(numbers[index]), 'a finite number', 'send a number')
    return numbers


def _full_label(command: str, label: str) -> str:
    """Return the name of a number in a message: ``sawtooth amplitude``, but ``voltage``."""
    name = label.partition(' ')[0]
    return name if name == command else f'{command} {name}'


def _check_voltage(parameters: Parameters, voltage_v: float) -> Move:
    check_range(parameters, 'voltage', voltage_v)
    return Move('voltage', level(voltage_v))


def _check_sawtooth(
    parameters: Parameters, amplitude_v: float, frequency_hz: float, steps: float
) -> Move:
    check_amplitude(parameters, 'amplitude', amplitude_v)
    check_frequency(parameters, amplitude_v, frequency_hz)
    if not (steps == math.floor(steps) and 0 <= steps <= STEPS_MAX):
        limit = f'not a whole number from 0 to {STEPS_MAX}'
        raise OutOfRange('steps', steps, '', limit, 'round it; 0 runs until stopped')
    return _stepping('sawtooth', parameters, amplitude_v, frequency_hz, int(steps))


def _stepping(
    name: str, parameters: Parameters, amplitude_v: float, frequency_hz: float, steps: int
) -> Move:
    base_v = parameters.amplifier.voltage_min
    wave = sawtooth(base_v, amplitude_v, frequency_hz, steps)
    return Move(name, wave, 1 if frequency_hz > 0.0 else -1)


def _check_steps(parameters: Parameters, steps: float) -> Move | NoMove:
    if not (steps == math.floor(steps) and abs(steps) <= STEPS_MAX):
        limit = f'not a whole number from {-STEPS_MAX} to {STEPS_MAX}'
        raise OutOfRange('steps', steps, '', limit, 'round it; its sign is the direction')
    if steps == 0.0:
        return NoMove('steps')
    return steps_of('steps', parameters, int(steps))


def steps_of(name: str, parameters: Parameters, steps: int) -> Move:
    """
    Return the move that makes so many steps, at ``step.amplitude`` and ``step.frequency``.

    Raises
    ------
    OutOfRange
        If amplifier or slew rate do not allow these.

    """
    step = parameters.step
    frequency_hz = math.copysign(step.frequency, steps)
    check_amplitude(parameters, 'step.amplitude', step.amplitude)
    check_frequency(parameters, step.amplitude, frequency_hz)
    return _stepping(name, parameters, step.amplitude, frequency_hz, abs(steps))


def _check_jog(parameters: Parameters, frequency_hz: float) -> Jog:
    if frequency_hz == 0.0:
        return Jog(None, 0.0)
    amplitude_v = parameters.step.amplitude
    check_amplitude(parameters, 'step.amplitude', amplitude_v)
    check_frequency(parameters, amplitude_v, frequency_hz)
    return Jog(_stepping('jog', parameters, amplitude_v, frequency_hz, 0), frequency_hz)


def _check_waveform(parameters: Parameters, numbers: Array) -> Move:
    rows, rest = divmod(len(numbers), 2)
    if rest or not 2 <= rows <= ROWS_MAX:
        expected = f'2 to {ROWS_MAX} rows of time and voltage'
        raise WrongKind('waveform', numbers[:8].tolist(), expected, 'send [t0, V0, t1, V1, ...]')
    wave = numbers.reshape(rows, 2)
    if wave[0, 0] != 0.0:
        mend = 'let the first row be the start'
        raise OutOfRange('waveform time of row 1', float(wave[0, 0]), 's', 'not 0 s', mend)
    falls = np.flatnonzero(np.diff(wave[:, 0]) <= 0.0)
    if len(falls):
        row = int(falls[0]) + 1
        limit = f'not after that of row {row}, {wave[row - 1, 0]:g} s'
        mend = 'let the times rise'
        raise OutOfRange(f'waveform time of row {row + 1}', float(wave[row, 0]), 's', limit, mend)
    for row in (int(np.argmin(wave[:, 1])), int(np.argmax(wave[:, 1]))):
        check_range(parameters, f'waveform voltage of row {row + 1}', float(wave[row, 1]))
    return Move('waveform', table(wave))


def _check_position(parameters: Parameters, x_m: float, y_m: float, z_m: float) -> Target:
    for name, value in (('position y', y_m), ('position z', z_m)):
        if value != 0.0:
            mend = 'set it to 0: the runner moves along x only'
            raise OutOfRange(name, value, 'm', 'not 0', mend)
    limits = parameters.limits
    if limits.has_soft_limits and not limits.soft_min <= x_m <= limits.soft_max:
        raise BeyondSoftLimit(
            f'position x {x_m:g} m is outside the soft limits {limits.soft_min:g} to '
            f'{limits.soft_max:g} m; stay inside, or move limits.soft_min and limits.soft_max'
        )
    steps_of('position', parameters, 1)
    return Target(x_m)


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


def _check_enable(_: Parameters, wanted: float) -> EnableAmplifier:
    return EnableAmplifier(bool(wanted))


def _check_fault(request: Request) -> SetFaults:
    if request.values:
        mend = 'name the faults and their values'
        raise WrongKind('fault', list(request.values[:8]), 'without numbers', mend)
    for name, value in request.settings:
        if not spec_of(name).live:
            mend = 'name parameters fault.*, but not fault.schedule'
            raise UnknownName('fault', name, mend)
        spec_of(name).check(name, value)
    return SetFaults(dict(request.settings))


_WRENCH = ('force.x N', 'force.y N', 'force.z N', 'torque.x N m', 'torque.y N m', 'torque.z N m')
CHECKS: Mapping[str, tuple[tuple[str, ...], Check]] = {
    'voltage': (('voltage V',), _check_voltage),
    'sawtooth': (('amplitude V', 'frequency Hz', 'steps'), _check_sawtooth),
    'steps': (('steps',), _check_steps),
    'jog': (('frequency Hz',), _check_jog),
    'waveform': ((ANY,), _check_waveform),
    'position': (('x m', 'y m', 'z m'), _check_position),
    'load': (_WRENCH, _check_load),
    'preload': (('preload N',), _check_preload),
    'stop': ((), lambda _: Stop()),
    'reset': ((), lambda _: Reset()),
    'zero_position': ((), lambda _: ZeroPosition()),
    'tare_force': ((), lambda _: TareForce()),
    'enable_amplifier': (('wanted 0 or 1',), _check_enable),
    'clear_faults': ((), lambda _: ClearFaults()),
}
"""Labels of the numbers of each request, and its check."""
