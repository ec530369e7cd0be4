# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""What the instrument says: readings, events, status."""

import json
from dataclasses import dataclass
from enum import Enum, IntFlag
from typing import Any, NamedTuple

from stickslip_ros.arrays import Array
from stickslip_ros.parameters import TRUTH, Parameters

FIRST_READING = TRUTH.index('foot') + 1
"""Column of a trace from which on sensor readings stand; before it stands the truth."""


def trace_columns(parameters: Parameters) -> tuple[str, ...]:
    """Return the columns of a trace of a stand, with units: truth, then a reading per sensor."""
    readings = (f'{each.reading}[{each.unit}]' for each in parameters.sensors)
    return 't[s]', 'voltage[V]', 'foot[m]', *readings


class Result(Enum):
    """How a command ended: the word of ``~/event`` is its name, the value says what it means."""

    DONE = 'carried out to its end'
    ABORTED = 'ended before its end: replaced by another move, stopped or reset'
    INVALID_PARAMETER = 'refused; the message gives value, limit, unit and remedy'
    RANGE_LIMIT_REACHED = 'stopped or refused at a soft limit'
    END_STOP_REACHED = 'closed loop gave up: the runner no longer comes nearer'
    FOLLOWING_LIMIT_REACHED = 'closed loop gave up: too far from its set point'
    TIMEOUT = 'closed loop gave up: closed_loop.timeout passed before it was in position'
    NO_SENSOR = 'closed loop gave up: the position reading is not a number'
    AMPLIFIER_DISABLED = 'refused or stopped: the amplifier is off'
    RECORDING_FAILED = 'full disk or lost file: recording has stopped, the drive goes on'
    DRIVE_FAILED = 'the drive has stopped; the node leaves its active state: unconfigured'


class Status(IntFlag):
    """State of the drive, bit by bit; bits from 24 on are not those of usual controllers."""

    text: str

    def __new__(cls, bits: int, text: str = '') -> 'Status':
        """Make a bit and its meaning; of several bits together there is none."""
        status = int.__new__(cls, bits)
        status._value_ = bits
        status.text = text
        return status

    MOVING = 1 << 0, 'a move is being carried out; not while closed loop holds its target'
    CLOSED_LOOP = 1 << 1, 'closed loop moves to its target or holds it'
    MOVE_DELAYED = 1 << 4, 'a command has come but has not yet taken effect'
    SENSOR_PRESENT = 1 << 5, 'the position reading is a number'
    IS_REFERENCED = 1 << 7, 'the zero of position was set by ~/zero_position'
    END_STOP_REACHED = 1 << 8, 'the last move ended because the runner came no nearer'
    RANGE_LIMIT_REACHED = 1 << 9, 'the last move ended at a soft limit'
    FOLLOWING_LIMIT_REACHED = 1 << 10, 'the last move ended too far from its set point'
    MOVEMENT_FAILED = 1 << 11, 'the last move failed, for whatever reason; the next one clears it'
    STREAMING = 1 << 12, 'a waveform is being played'
    AMPLIFIER_ENABLED = 1 << 18, 'the amplifier is on'
    IN_POSITION = 1 << 19, 'closed loop is within closed_loop.tolerance of its target'
    LOADED = 1 << 24, 'an external load acts on the runner'
    REFUSED = 1 << 25, 'the last command was refused'
    PRELOADING = 1 << 26, 'the preload is on its way to another value'
    FAULT = 1 << 27, 'at least one fault.* is on'
    BEAM_LOST = 1 << 28, 'the interferometer lost its beam; ~/zero_position or ~/reset finds it'
    FORCE_OVERRANGE = 1 << 29, 'the load cell is at the end of its range'


class Identity(NamedTuple):
    """
    Which command it is.

    Attributes
    ----------
    number : int
        Its number since the start, from 1; 0 for what nobody commanded.
    name : str
        What follows ``command/`` or ``~/`` in the name of its topic or service.
    stamp_ns : int
        Stamp in the header of its message; 0 where its sender gave none.
    tag : str
        Word that its sender gave it; empty for none.

    """

    number: int
    name: str
    stamp_ns: int = 0
    tag: str = ''


@dataclass(frozen=True)
class Event:
    """
    The end of a command.

    Attributes
    ----------
    time_ns : int
        Simulated time.
    number : int
        Number of the command since the start, from 1; 0 for what nobody commanded.
    command : str
        Its name.
    result : Result
        How it ended.
    steps : int
        Steps that a saw-tooth made.
    message : str
        Why it was refused or aborted.
    stamp_ns : int
        Stamp that its sender gave; 0 for none.
    tag : str
        Word that its sender gave; empty for none.
    step_m : float or None
        Way of the position reading per step, in the direction of the steps, m: of saw-teeth the
        mean, of a closed loop what it has learned; None where there is none.

    """

    time_ns: int
    number: int
    command: str
    result: Result
    steps: int = 0
    message: str = ''
    stamp_ns: int = 0
    tag: str = ''
    step_m: float | None = None

    def to_json(self) -> str:
        """Return the event as the text of ``~/event``: the reason first, some tools cut a text."""
        content: dict[str, Any] = {
            'message': self.message,
            'result': self.result.name,
            'command': self.command,
            'number': self.number,
            'steps': self.steps,
            'time_ns': self.time_ns,
        }
        if self.stamp_ns:
            content['stamp_ns'] = self.stamp_ns
        if self.tag:
            content['tag'] = self.tag
        if self.step_m is not None:
            content['step_m'] = self.step_m
        return json.dumps(content)


_KINDS: dict[str, type] = {
    **dict.fromkeys(('message', 'result', 'command', 'tag'), str),
    **dict.fromkeys(('number', 'steps', 'time_ns', 'stamp_ns'), int),
    'step_m': float,
}
_OPTIONAL = ('stamp_ns', 'tag', 'step_m')
EVENT_MAX = 10_000
"""Characters of an event: its message quotes of a long value the beginning."""
INT64_END = 2**63


def read_event(text: str) -> dict[str, Any] | None:
    """Return what a text of ``~/event`` says, by names of `Event`; None if it is none of ours."""
    try:
        content = json.loads(text if len(text) <= EVENT_MAX else '')
        event = {
            name: content[name] for name in _KINDS if name not in _OPTIONAL or name in content
        }
    except (ValueError, RecursionError, TypeError, KeyError):
        return None
    for name, value in event.items():
        if type(value) is not _KINDS[name]:
            return None
        if isinstance(value, int | float) and not abs(value) < INT64_END:  # or not a number
            return None
    return event


class Readings(NamedTuple):
    """What the sensors saw in one update, and what there was to see at its end."""

    time_ns: int  # Simulated time of the end of the update, at which scalar readings were taken
    voltage_v: float  # Voltage at the piezo
    trace: Array  # The oscilloscope, a row per sample, of trace_columns
    truth: Array  # What the sensors looked at, without their errors: a row of TRUTH

    @property
    def position_m(self) -> float:
        """Interferometer."""
        return float(self.trace[-1, FIRST_READING])

    @property
    def force_n(self) -> float:
        """Load cell."""
        return float(self.trace[-1, FIRST_READING + 1])

    @property
    def truth_position_m(self) -> float:
        """True position of the runner."""
        return float(self.truth[TRUTH.index('position')])

    @property
    def truth_force_n(self) -> float:
        """True force on the load cell."""
        return float(self.truth[TRUTH.index('force')])


class Output(NamedTuple):
    """
    Result of one update of the bench.

    Attributes
    ----------
    readings : Readings
        Of the sensors.
    events : tuple of Event
        Commands that ended, in order.
    status : Status
        At the end of the update.
    ramps : array of float, shape (n, 3)
        True runner positions of each ramp that ended: start, mean, end, m.

    """

    readings: Readings
    events: tuple[Event, ...]
    status: Status
    ramps: Array
