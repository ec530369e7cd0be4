# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Output of the instrument: readings, events, status."""

import json
from dataclasses import dataclass
from enum import Enum, IntFlag
from types import NoneType
from typing import Any, NamedTuple

from stickslip_ros.arrays import Array
from stickslip_ros.parameters import TRUTH, Parameters

FIRST_READING = TRUTH.index('foot') + 1
"""First column of a trace with sensor readings; the columns before it are true values."""


def trace_columns(parameters: Parameters) -> tuple[str, ...]:
    """Return the columns of a trace, with units: true values, then a reading for each sensor."""
    readings = (f'{each.reading}[{each.unit}]' for each in parameters.sensors)
    return 't[s]', 'voltage[V]', 'foot[m]', *readings


class Result(Enum):
    """Result of a command: the name is the word in ``~/event``, the value its meaning."""

    DONE = 'completed'
    ABORTED = 'ended early: replaced by another move, stopped or reset'
    INVALID_PARAMETER = 'refused; the message gives value, limit, unit and remedy'
    RANGE_LIMIT_REACHED = 'stopped or refused at a soft limit'
    END_STOP_REACHED = 'closed loop failed: the runner makes no progress'
    FOLLOWING_LIMIT_REACHED = 'closed loop failed: too far from its set point'
    CORNER_LIMIT_REACHED = 'voltage held: `feet.delay` remembers no more corners'
    TIMEOUT = 'closed loop failed: not in position within closed_loop.timeout'
    NO_SENSOR = 'closed loop failed: the position reading is not a number'
    AMPLIFIER_DISABLED = 'refused or stopped: the amplifier is off'
    RECORDING_FAILED = 'full disk or lost file: recording has stopped, the drive continues'
    DRIVE_FAILED = 'the drive has stopped, and the node becomes unconfigured'


class Status(IntFlag):
    """Status bits of the drive; usual controllers do not have bits from 24 on."""

    text: str

    def __new__(cls, bits: int, text: str = '') -> 'Status':
        """Create a bit with its meaning; combinations of bits have none."""
        status = int.__new__(cls, bits)
        status._value_ = bits
        status.text = text
        return status

    MOVING = 1 << 0, 'a move is running; 0 while closed loop holds its target'
    CLOSED_LOOP = 1 << 1, 'closed loop moves to its target or holds it'
    MOVE_DELAYED = 1 << 4, 'a command has arrived but has not yet taken effect'
    SENSOR_PRESENT = 1 << 5, 'the position reading is a number'
    IS_REFERENCED = 1 << 7, 'the zero of position was set by ~/zero_position'
    END_STOP_REACHED = 1 << 8, 'the last move ended because the runner made no progress'
    RANGE_LIMIT_REACHED = 1 << 9, 'the last move ended at a soft limit'
    FOLLOWING_LIMIT_REACHED = 1 << 10, 'the last move ended too far from its set point'
    MOVEMENT_FAILED = 1 << 11, 'the last move failed; the next move clears the bit'
    STREAMING = 1 << 12, 'a waveform is playing'
    AMPLIFIER_ENABLED = 1 << 18, 'the amplifier is on'
    IN_POSITION = 1 << 19, 'closed loop is within closed_loop.tolerance of its target'
    LOADED = 1 << 24, 'an external load acts on the runner'
    REFUSED = 1 << 25, 'the last command was refused'
    PRELOADING = 1 << 26, 'the preload is changing'
    FAULT = 1 << 27, 'at least one fault.* is on'
    BEAM_LOST = 1 << 28, 'the interferometer lost its beam; ~/zero_position or ~/reset restores it'
    FORCE_OVERRANGE = 1 << 29, 'the load cell is at the end of its range'


class Identity(NamedTuple):
    """Identity of a command."""

    number: int  # number since the start, from 1; 0: not a command
    name: str  # name of its topic or service after ``command/`` or ``~/``
    sent_ns: int = 0  # stamp of its sender, in the header of its message; 0: none
    tag: str = ''  # word of its sender; empty: none


@dataclass(frozen=True)
class Event:
    """The end of a command."""

    time_ns: int  # simulated time of the end
    number: int  # number of the command since the start, from 1; 0: not a command
    command: str  # name of the command
    result: Result  # result of the command
    steps: int = 0  # number of steps of a saw-tooth
    message: str = ''  # reason of a refusal or an abort
    sent_ns: int = 0  # stamp of its sender; 0: none
    tag: str = ''  # word of its sender; empty: none
    # readings at the end, m and N; None without a reading
    position_m: float | None = None
    force_n: float | None = None
    # way of the position reading per step, in the direction of the steps, m: mean of a
    # saw-tooth, or learned by a closed loop; None without steps
    step_m: float | None = None

    def to_json(self, time_origin_ns: int = 0) -> str:
        """Return the text of ``~/event``; ``stamp_ns`` is the end in the time of all stamps."""
        content: dict[str, Any] = {
            'message': self.message,  # first, as some tools cut a text
            'result': self.result.name,
            'command': self.command,
            'number': self.number,
            'steps': self.steps,
            'time_ns': self.time_ns,
            'stamp_ns': time_origin_ns + self.time_ns,
            'position_m': self.position_m,
            'force_n': self.force_n,
        }
        if self.sent_ns:
            content['sent_ns'] = self.sent_ns
        if self.tag:
            content['tag'] = self.tag
        if self.step_m is not None:
            content['step_m'] = self.step_m
        return json.dumps(content)


_KINDS: dict[str, tuple[type, ...]] = {
    **dict.fromkeys(('message', 'result', 'command', 'tag'), (str,)),
    **dict.fromkeys(('number', 'steps', 'time_ns', 'stamp_ns', 'sent_ns'), (int,)),
    **dict.fromkeys(('position_m', 'force_n'), (float, NoneType)),
    'step_m': (float,),
}
_OPTIONAL = ('stamp_ns', 'position_m', 'force_n', 'sent_ns', 'tag', 'step_m')
EVENT_MAX = 10_000
"""Most characters of an event; its message quotes only the beginning of a long value."""
INT64_END = 2**63


def read_event(text: str) -> dict[str, Any] | None:
    """Return the content of a text of ``~/event``, by names of `Event`; None if it is invalid."""
    try:
        content = json.loads(text if len(text) <= EVENT_MAX else '')
        if 'stamp_ns' in content and 'position_m' not in content:  # an event of version 1.0.0
            content['sent_ns'] = content.pop('stamp_ns')
        event = {
            name: content[name] for name in _KINDS if name not in _OPTIONAL or name in content
        }
    except (ValueError, RecursionError, TypeError, KeyError, AttributeError):
        return None
    for name, value in event.items():
        if type(value) not in _KINDS[name]:
            return None
        if isinstance(value, int | float) and not abs(value) < INT64_END:  # too large or NaN
            return None
    return event


class Readings(NamedTuple):
    """Readings of an update, and the true values at its end."""

    time_ns: int  # Simulated time of the end of the update, and of scalar readings
    voltage_v: float  # Voltage at the piezo
    trace: Array  # Oscilloscope: a row for each sample, with trace_columns
    truth: Array  # True values without sensor errors: a row of TRUTH

    @property
    def position_m(self) -> float:
        """Reading of the interferometer."""
        return float(self.trace[-1, FIRST_READING])

    @property
    def force_n(self) -> float:
        """Reading of the load cell."""
        return float(self.trace[-1, FIRST_READING + 1])

    @property
    def truth_position_m(self) -> float:
        return float(self.truth[TRUTH.index('position')])

    @property
    def truth_force_n(self) -> float:
        return float(self.truth[TRUTH.index('force')])


class Output(NamedTuple):
    """Result of an update of the bench."""

    readings: Readings  # Readings of the sensors
    events: tuple[Event, ...]  # Ends of commands, in order
    status: Status  # Status at the end of the update
    ramps: Array  # True runner positions of each finished ramp, (n, 3): start, mean, end, m
