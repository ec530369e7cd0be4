"""What the instrument says: readings, events, status."""

import json
from dataclasses import dataclass
from enum import Enum, IntFlag
from typing import NamedTuple

from stickslip_ros.contact.profile import Array

TRACE_COLUMNS = ('t[s]', 'voltage[V]', 'foot[m]', 'position[m]', 'force[N]')
"""Columns of a trace, as ``drive.advance`` numbers them; the last two are sensor readings."""


class Result(Enum):
    """How a command ended."""

    DONE = 'DONE'
    ABORTED = 'ABORTED'
    INVALID_PARAMETER = 'INVALID_PARAMETER'
    RANGE_LIMIT_REACHED = 'RANGE_LIMIT_REACHED'
    END_STOP_REACHED = 'END_STOP_REACHED'
    FOLLOWING_LIMIT_REACHED = 'FOLLOWING_LIMIT_REACHED'
    TIMEOUT = 'TIMEOUT'
    NO_SENSOR = 'NO_SENSOR'
    AMPLIFIER_DISABLED = 'AMPLIFIER_DISABLED'
    RECORDING_FAILED = 'RECORDING_FAILED'
    DRIVE_FAILED = 'DRIVE_FAILED'


RESULT_TEXTS = {
    Result.DONE: 'carried out to its end',
    Result.ABORTED: 'ended before its end: replaced by another move, stopped or reset',
    Result.INVALID_PARAMETER: 'refused; the message gives value, limit, unit and mend',
    Result.RANGE_LIMIT_REACHED: 'stopped or refused at a soft limit',
    Result.END_STOP_REACHED: 'closed loop gave up: the runner no longer comes nearer',
    Result.FOLLOWING_LIMIT_REACHED: 'closed loop gave up: too far from its set point',
    Result.TIMEOUT: 'closed loop gave up: closed_loop.timeout passed before it was in position',
    Result.NO_SENSOR: 'closed loop gave up: the position reading is no number',
    Result.AMPLIFIER_DISABLED: 'refused or stopped: the amplifier is off',
    Result.RECORDING_FAILED: 'full disk or lost file: recording has stopped, the drive goes on',
    Result.DRIVE_FAILED: 'the drive has stopped; the node leaves its active state: unconfigured',
}


class Status(IntFlag):
    """State of the drive, bit by bit; bits from 24 on are not those of usual controllers."""

    MOVING = 1 << 0
    CLOSED_LOOP = 1 << 1
    MOVE_DELAYED = 1 << 4
    SENSOR_PRESENT = 1 << 5
    IS_REFERENCED = 1 << 7
    END_STOP_REACHED = 1 << 8
    RANGE_LIMIT_REACHED = 1 << 9
    FOLLOWING_LIMIT_REACHED = 1 << 10
    MOVEMENT_FAILED = 1 << 11
    STREAMING = 1 << 12
    AMPLIFIER_ENABLED = 1 << 18
    IN_POSITION = 1 << 19
    LOADED = 1 << 24
    REFUSED = 1 << 25
    PRELOADING = 1 << 26
    FAULT = 1 << 27
    BEAM_LOST = 1 << 28
    FORCE_OVERRANGE = 1 << 29


STATUS_TEXTS = {
    Status.MOVING: 'a move is being carried out; not while closed loop holds its target',
    Status.CLOSED_LOOP: 'closed loop moves to its target or holds it',
    Status.MOVE_DELAYED: 'a command has come but has not yet taken effect',
    Status.SENSOR_PRESENT: 'the position reading is a number',
    Status.IS_REFERENCED: 'the zero of position was set by ~/zero_position',
    Status.END_STOP_REACHED: 'the last move ended because the runner came no nearer',
    Status.RANGE_LIMIT_REACHED: 'the last move ended at a soft limit',
    Status.FOLLOWING_LIMIT_REACHED: 'the last move ended too far from its set point',
    Status.MOVEMENT_FAILED: 'the last move failed, for whatever reason; the next one clears it',
    Status.STREAMING: 'a waveform is being played',
    Status.AMPLIFIER_ENABLED: 'the amplifier is on',
    Status.IN_POSITION: 'closed loop is within closed_loop.tolerance of its target',
    Status.LOADED: 'an external load acts on the runner',
    Status.REFUSED: 'the last command was refused',
    Status.PRELOADING: 'the preload is on its way to another value',
    Status.FAULT: 'at least one fault.* is on',
    Status.BEAM_LOST: 'the interferometer lost its beam; ~/zero_position or ~/reset finds it',
    Status.FORCE_OVERRANGE: 'the load cell is at the end of its range',
}


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

    """

    time_ns: int
    number: int
    command: str
    result: Result
    steps: int = 0
    message: str = ''

    def to_json(self) -> str:
        """Return the event as the text of ``~/event``: the reason first, some tools cut a text."""
        return json.dumps(
            {
                'message': self.message,
                'result': self.result.value,
                'command': self.command,
                'number': self.number,
                'steps': self.steps,
                'time_ns': self.time_ns,
            }
        )


class Readings(NamedTuple):
    """
    What the sensors saw in one update.

    Attributes
    ----------
    time_ns : int
        Simulated time of the end of the update, at which the scalar readings were taken.
    position_m : float
        Interferometer.
    force_n : float
        Load cell.
    voltage_v : float
        Voltage at the piezo.
    trace : array of float, shape (samples, 5)
        The oscilloscope: rows of TRACE_COLUMNS.
    truth_position_m, truth_force_n : float
        What the sensors looked at, without their errors.

    """

    time_ns: int
    position_m: float
    force_n: float
    voltage_v: float
    trace: Array
    truth_position_m: float
    truth_force_n: float


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
