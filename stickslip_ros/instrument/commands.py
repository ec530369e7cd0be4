# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Commands of an operator: a table with a row for each command.

Topics and services, recording, replay and documentation follow from the row.

"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from itertools import cycle
from typing import Any, NamedTuple, Protocol

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.errors import OutOfRange, UnknownName, WrongKind
from stickslip_ros.instrument import checks
from stickslip_ros.instrument.closed_loop import Goal, Observation
from stickslip_ros.instrument.joints import NO_JOINTS, Joints, check_joints
from stickslip_ros.instrument.motion import Motion
from stickslip_ros.instrument.reports import Identity, Result, Status
from stickslip_ros.instrument.sensing import Sensing
from stickslip_ros.instrument.stand import SimulatedStand
from stickslip_ros.instrument.trajectory import check_trajectory
from stickslip_ros.message_types import (
    FLOAT64,
    FLOAT64_ARRAY,
    INT32,
    JOINT_STATE,
    POINT_STAMPED,
    SET_BOOL,
    TRIGGER,
    WRENCH_STAMPED,
)
from stickslip_ros.parameters import FaultParameters, Parameters, Scalar, checked_arguments
from stickslip_ros.parameters.declaration import CONVERTERS
from stickslip_ros.units import NANO

WAVEFORM_ROWS_MAX = 100_000
"""Most rows of a message; a measured voltage that is replayed from a file may be longer."""
FAULT, LIVE = 'fault', 'parameters'
"""Commands that take names and values instead of numbers."""
JOINT = 'joint'
"""Command that takes joints instead of numbers."""
TRAJECTORY = 'trajectory'
"""Command that takes settings and numbers."""


@checked_arguments
@dataclass(frozen=True)
class Request:
    """A request that is not yet checked."""

    name: str  # a name in COMMANDS
    # numbers in the order of the topic, in SI units or with units of their own; rows of a
    # waveform one after another. Long sequences are an ``array.array``
    values: 'Sequence[float]' = ()
    # of ``fault`` and ``parameters``: full names of parameters and their new values; of
    # ``trajectory``: degree, start and tolerances, see `check_trajectory`
    settings: tuple[tuple[str, Scalar], ...] = ()
    stamp_ns: int = 0  # stamp in the header of its message; 0: none
    frame_id: str = ''  # of vectors: their frame; empty: that of the command
    joints: Joints = NO_JOINTS  # of ``joint``: the set points
    cycles: int = 1  # of ``waveform``: number of plays; 0 repeats until replaced
    tag: str = ''  # word of its sender, repeated in its events; empty: none

    def __post_init__(self) -> None:
        """Convert single numbers and quantities such as ``10V``."""
        values: Any = self.values
        values = (values,) if isinstance(values, str | float | int) else values
        if isinstance(values, tuple | list) and any(isinstance(each, str) for each in values):
            labels = COMMANDS[self.name].numbers if self.name in COMMANDS else ()
            units = cycle([each.partition(' ')[2] for each in labels or ('',)])
            values = tuple(map(CONVERTERS[float], cycle([self.name]), values, units))
        object.__setattr__(self, 'values', values)

    @property
    def size(self) -> int:
        """Count of numbers and characters, as a measure of its memory."""
        texts = self.frame_id, self.tag, *self.joints.names
        return len(self.values) + sum(map(len, (*texts, *self.joints)))


class TimedRequest(NamedTuple):
    """A request and the simulated time at which it is due or took effect, ns."""

    time_ns: int
    request: Request


class Instrument(Protocol):
    """The part of a ``Bench`` that commands use; they cannot import it, since it imports them."""

    stand: SimulatedStand
    sensing: Sensing
    motion: Motion
    faults: FaultParameters

    def observe_powered(self) -> Observation: ...
    def change_preload(self, command: Identity, preload_n: float) -> None: ...
    def end_move(self, why: str) -> None: ...
    def reset(self, why: str) -> None: ...
    def enable(self, *, wanted: bool) -> None: ...
    def apply_faults(self, faults: FaultParameters) -> None: ...
    def change_parameters(self, values: Mapping[str, Scalar]) -> None: ...


class Accepted(NamedTuple):
    """A checked request."""

    command: Identity  # identity of the command
    value: Any  # result of the check: a wave, a position, a force; None without numbers


@dataclass(frozen=True)
class Command:
    """A row of the table of commands."""

    name: str  # name in requests and events
    # type of the topic ``command/NAME`` or of the service ``~/NAME``; empty: neither
    interface: str
    numbers: tuple[str, ...]  # numbers and their units; for a table, those of a row
    # takes the parameters of the stand and the numbers; returns their meaning, or refuses
    check: Callable[..., Any]
    # carries out the checked request. Returns DONE, or None if its end is reported later
    act: Callable[[Instrument, Accepted], Result | None]
    text: str  # meaning, for the documentation
    # for vectors: their parameter of ``frame_id.*``; only the first number may differ from 0
    frame: str = ''
    is_table: bool = False  # whether it takes any number of rows

    @property
    def has_topic(self) -> bool:
        """Whether it comes by a topic, where ``fault.command_delay`` applies."""
        return '/msg/' in self.interface

    @property
    def has_service(self) -> bool:
        """Whether it comes by its own service."""
        return '/srv/' in self.interface


def check_request(request: Request, parameters: Parameters) -> Any:
    """
    Check a request; return its wave, position or force, or None for commands without numbers.

    Raises UnknownName if the command is not known; WrongKind if the numbers are too few, too many,
    or not finite; OutOfRange if a number is outside its limit, or a vector has another frame;
    BeyondSoftLimit if a target is outside the soft limits.

    """
    command = COMMANDS.get(request.name)
    if command is None:
        near = get_close_matches(request.name, COMMANDS, 1)
        raise UnknownName('command', request.name, f'use {", ".join(near or COMMANDS)}')
    if command.name == TRAJECTORY:
        return command.check(parameters, _all_finite(request), dict(request.settings))
    if command.is_table:
        return command.check(parameters, _all_finite(request), request.cycles)
    if command.name in (FAULT, LIVE):
        _refuse_numbers(request, 'give names and values')
        return command.check(parameters, dict(request.settings))
    if command.name == JOINT:
        _refuse_numbers(request, 'give names, positions, velocities')
        return command.check(parameters, request.joints)
    if command.frame:
        frame_id = getattr(parameters.frame_id, command.frame)
        if request.frame_id not in ('', frame_id):
            limit = f'not {frame_id}, the frame of the drive'
            hint = 'transform it, leave the frame empty, or change frame_id.*'
            raise OutOfRange(f'{request.name} frame', request.frame_id, '', limit, hint)
    return command.check(parameters, *_numbers_of(request, command))


def _all_finite(request: Request) -> Array:
    """Return the numbers of a request as an array, which is fast for long tables."""
    numbers = np.asarray(request.values, dtype=float)
    bad = np.flatnonzero(~np.isfinite(numbers))
    if len(bad):
        index = int(bad[0])
        name = f'{request.name} number {index + 1}'
        raise WrongKind(name, float(numbers[index]), 'a finite number', 'send a number')
    return numbers


def _refuse_numbers(request: Request, hint: str) -> None:
    if request.values:
        raise WrongKind(request.name, list(request.values[:8]), 'without numbers', hint)


def _numbers_of(request: Request, command: Command) -> Sequence[float]:
    """Return the numbers of a request; for a vector only x."""
    labels, values = command.numbers, request.values
    if len(values) != len(labels):
        expected = f'a list of {len(labels)} numbers' if labels else 'empty'
        hint = f'send [{", ".join(labels)}]'
        raise WrongKind(request.name, list(values[:8]), expected, hint)
    for label, value in zip(labels, values, strict=True):
        if not math.isfinite(value):
            name = number_name(request.name, label)
            raise WrongKind(name, value, 'a finite number', 'send a number')
    if not command.frame:
        return values
    for label, value in zip(labels[1:], values[1:], strict=True):
        if value != 0.0:
            name, unit = number_name(request.name, label), label.partition(' ')[2]
            hint = 'set it to 0: the runner moves along x only'
            raise OutOfRange(name, value, unit, 'not 0', hint)
    return values[:1]


def number_name(command: str, label: str) -> str:
    """Return the name of a number in a message, as ``sawtooth amplitude`` or ``voltage``."""
    name = label.partition(' ')[0]
    return name if name == command else f'{command} {name}'


def _any(_: Parameters, *numbers: float) -> float | None:
    """Accept every number."""
    return numbers[0] if numbers else None


def start_move(bench: Instrument, accepted: Accepted) -> Result | None:
    """Start a move; without a wave it is done at once."""
    if accepted.value is None:
        return Result.DONE
    bench.motion.start(accepted.command, accepted.value, bench.observe_powered())
    return None


def jog(bench: Instrument, accepted: Accepted) -> None:
    """Start stepping, change its rate, or end it."""
    bench.motion.jog(accepted.command, accepted.value, bench.observe_powered())


def approach(bench: Instrument, accepted: Accepted) -> None:
    """Start a closed-loop move to a position."""
    bench.motion.approach(accepted.command, Goal(accepted.value), bench.observe_powered())


def follow_trajectory(bench: Instrument, accepted: Accepted) -> None:
    """Start a closed-loop move along a trajectory from the present position."""
    now = bench.observe_powered()
    begun = accepted.value.begin(bench.stand.parameters, now.time_ns * NANO, now.position_m)
    goal = Goal(begun.end.position_m, trajectory=begun)
    bench.motion.approach(accepted.command, goal, now)


def pursue(bench: Instrument, accepted: Accepted) -> None:
    """Set position or velocity of the closed loop; a message without either changes nothing."""
    if accepted.value is not None:
        bench.motion.pursue(accepted.command, accepted.value, bench.observe_powered())


def set_load(bench: Instrument, accepted: Accepted) -> Result:
    """Set the external force on the runner."""
    bench.stand.load_n = accepted.value
    return Result.DONE


def ramp_preload(bench: Instrument, accepted: Accepted) -> None:
    """Start a change of the preload."""
    bench.change_preload(accepted.command, accepted.value)


def stop(bench: Instrument, accepted: Accepted) -> Result:
    """End the running move at the present voltage; a tag is the reason."""
    bench.end_move(accepted.command.tag or f'stopped by command {accepted.command.number}')
    return Result.DONE


def reset(bench: Instrument, accepted: Accepted) -> Result:
    """Return to the state at the start, but keep the time."""
    bench.reset(f'reset by command {accepted.command.number}')
    return Result.DONE


def zero_position(bench: Instrument, accepted: Accepted) -> Result:
    """Make the present position reading 0; a closed loop ends, as its target would shift."""
    if bench.motion.status_bits & Status.CLOSED_LOOP:
        bench.end_move(f'position zeroed by command {accepted.command.number}')
    bench.motion.forget_start()
    bench.sensing.interferometer.zero()
    return Result.DONE


def tare_force(bench: Instrument, _: Accepted) -> Result:
    """Make the present force reading 0."""
    bench.sensing.load_cell.zero()
    return Result.DONE


def enable_amplifier(bench: Instrument, accepted: Accepted) -> Result:
    """Switch the amplifier on or off."""
    bench.enable(wanted=bool(accepted.value))
    return Result.DONE


def clear_faults(bench: Instrument, _: Accepted) -> Result:
    """End every fault; scheduled faults still come at their times."""
    bench.apply_faults(FaultParameters(schedule=bench.faults.schedule))
    return Result.DONE


def set_parameters(bench: Instrument, accepted: Accepted) -> Result:
    """Change live parameters by name."""
    bench.change_parameters(accepted.value)
    return Result.DONE


def set_faults(bench: Instrument, accepted: Accepted) -> Result:
    """Start or end faults by name."""
    bench.apply_faults(Parameters(fault=bench.faults).updated(accepted.value).fault)
    return Result.DONE


# fmt: off
_ROWS = (
    Command('voltage', FLOAT64, ('voltage V',), checks.check_voltage, start_move,
            'direct piezo voltage, V (scan mode); the amplifier slews to it'),
    Command('sawtooth', FLOAT64_ARRAY, ('amplitude V', 'frequency Hz', 'steps'),
            checks.check_sawtooth, start_move,
            '[amplitude V, frequency Hz (its sign is the direction), steps (0: until stopped)]'),
    Command('steps', INT32, ('steps',), checks.check_steps, start_move,
            'signed number of steps at step.amplitude and step.frequency; 0 does nothing'),
    Command('jog', FLOAT64, ('frequency Hz',), checks.check_jog, jog,
            'signed steps per second; stops after jog.timeout without a new message; 0 stops'),
    Command('waveform', FLOAT64_ARRAY, ('time s', 'voltage V'), checks.check_waveform, start_move,
            'rows of time s, voltage V; times rise from 0, straight lines in between; at most '
            f'{WAVEFORM_ROWS_MAX} rows; played once; the size of a first axis labelled cycle is '
            'another number of plays (0: until stopped)', is_table=True),
    Command('position', POINT_STAMPED, ('x m', 'y m', 'z m'), checks.check_position, approach,
            'closed loop: point.x, m; coarse steps, then fine scan, then hold; y and z must be 0; '
            'in frame_id.stage, or no frame',
            frame='stage'),
    Command(JOINT, JOINT_STATE, ('position m', 'velocity m/s', 'effort N'),
            check_joints, pursue,
            'sim.joint_name in closed loop: position, m, or without a position velocity, m/s; '
            'empty and .nan are not commanded, effort is refused'),
    Command('load', WRENCH_STAMPED, ('force.x N', 'force.y N', 'force.z N',
                                     'torque.x N m', 'torque.y N m', 'torque.z N m'),
            checks.check_load, set_load,
            'external force on the runner, N: force.x, positive along +x; all others must be 0; '
            'in frame_id.runner, or no frame',
            frame='runner'),
    Command('preload', FLOAT64, ('preload N',), checks.check_preload, ramp_preload,
            'preload F_p, N; it changes at stand.preload_rate'),
    Command('stop', TRIGGER, (), _any, stop,
            'end the running move and hold the present voltage'),
    Command('reset', TRIGGER, (), _any, reset,
            'relaxed contacts, runner at 0, no load, voltage as at the start; time continues'),
    Command('zero_position', TRIGGER, (), _any, zero_position,
            'make the present position reading 0'),
    Command('tare_force', TRIGGER, (), _any, tare_force,
            'make the present force reading 0'),
    Command('enable_amplifier', SET_BOOL, ('wanted 0 or 1',), _any, enable_amplifier,
            'amplifier on or off; without power the piezo goes to the lowest voltage and moves '
            'are refused'),
    Command('clear_faults', TRIGGER, (), _any, clear_faults,
            'end every fault, by parameter or schedule'),
    Command(TRAJECTORY, '', ('time s', 'position m', 'velocity m/s', 'acceleration m/s2'),
            check_trajectory, follow_trajectory,
            'closed loop along a trajectory, by the action', is_table=True),
    Command(FAULT, '', (), checks.check_faults, set_faults,
            'faults by name and value, by parameter or schedule'),
    Command(LIVE, '', (), checks.check_live, set_parameters,
            'live parameters by name and value, at the time of their change'),
)
# fmt: on
COMMANDS: Mapping[str, Command] = {command.name: command for command in _ROWS}
"""All commands by name; in lockstep, the commands of a block are carried out in this order."""


def typed_command(name: str) -> Command:
    """Return a command by its name or the first word of it, as ``zero``; or UnknownName."""
    offered = {each.name: each for each in COMMANDS.values() if each.interface}
    by_word = {each.partition('_')[0]: command for each, command in offered.items()}
    if name not in offered and name not in by_word:
        raise UnknownName('command', name, f'use {", ".join(offered)}')
    return {**by_word, **offered}[name]
