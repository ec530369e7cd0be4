"""What the instrument says: readings, events, status."""

import json
from dataclasses import dataclass
from enum import Enum, IntFlag

from stickslip_ros.contact.profile import Array

TRACE_COLUMNS = ('t[s]', 'voltage[V]', 'foot[m]', 'position[m]', 'force[N]')
"""Columns of a trace: time, piezo voltage, foot displacement, the two sensor readings."""
TIME, VOLTAGE, FOOT, POSITION, FORCE = range(len(TRACE_COLUMNS))


class Result(Enum):
    """How a command ended."""

    DONE = 'DONE'
    ABORTED = 'ABORTED'
    INVALID_PARAMETER = 'INVALID_PARAMETER'


RESULT_TEXTS = {
    Result.DONE: 'carried out to its end',
    Result.ABORTED: 'ended before its end: replaced by another move, stopped or reset',
    Result.INVALID_PARAMETER: 'refused; the message gives value, limit, unit and mend',
}


class Status(IntFlag):
    """State of the drive, bit by bit; bits from 24 on are not those of usual controllers."""

    MOVING = 1 << 0
    LOADED = 1 << 24
    REFUSED = 1 << 25
    PRELOADING = 1 << 26


STATUS_TEXTS = {
    Status.MOVING: 'a voltage or saw-tooth command is being carried out',
    Status.LOADED: 'an external load acts on the runner',
    Status.REFUSED: 'the last command was refused',
    Status.PRELOADING: 'the preload is on its way to another value',
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
        Number of the command since the start, from 1.
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
        """Return the event as the text of ``~/event``."""
        return json.dumps(
            {
                'time_ns': self.time_ns,
                'number': self.number,
                'command': self.command,
                'result': self.result.value,
                'steps': self.steps,
                'message': self.message,
            }
        )


@dataclass(frozen=True)
class Readings:
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

    """

    time_ns: int
    position_m: float
    force_n: float
    voltage_v: float
    trace: Array


@dataclass(frozen=True)
class Output:
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
