"""Simulated time: where its stamps begin, and whether it may go on."""

import math
from typing import NamedTuple

from stickslip_ros.errors import OutOfRange, WrongKind
from stickslip_ros.interface.requests import read_request
from stickslip_ros.interface.topics import Topic
from stickslip_ros.parameters import Parameters, to_nanoseconds


def has_system_time(parameters: Parameters, *, follows_clock: bool) -> bool:
    """
    Return whether the stamps of a drive begin at the system's time.

    Parameters
    ----------
    parameters : Parameters
        Of the drive.
    follows_clock : bool
        Whether its node takes the time from ``/clock``: ``use_sim_time``.

    """
    sim = parameters.sim
    if sim.time_origin != 'auto':
        return sim.time_origin == 'system'
    has_clock = sim.publish_clock or follows_clock
    return sim.real_time_factor == 1.0 and not (has_clock or sim.lockstep)


class Grant(NamedTuple):
    """
    How far the drive may go in lockstep.

    Attributes
    ----------
    until_ns : int
        Simulated time that it may reach.
    commands : int
        Messages on command topics that must have come before.

    """

    until_ns: int
    commands: int


def read_grant(topic: Topic, data: bytes) -> Grant:
    """
    Return what a message on ``command/grant`` allows.

    Raises
    ------
    StickSlipError
        If it is not a time and a count of commands.

    """
    values = list(read_request(topic, data).values[:3])
    if len(values) != 2 or not all(map(math.isfinite, values)):
        hint = 'send [until s, commands]'
        raise WrongKind('grant', values, 'a list of 2 finite numbers', hint)
    until_s, commands = values
    if until_s < 0.0:
        raise OutOfRange('grant until', until_s, 's', 'below 0 s', 'give a simulated time')
    if commands < 0.0 or commands != math.floor(commands):
        hint = 'give the number of messages sent on command topics since the activation'
        raise OutOfRange('grant commands', commands, '', 'not a count', hint)
    return Grant(to_nanoseconds(until_s), int(commands))


class TimeControl:
    """Pause and lockstep of one drive: in lockstep every block waits for a grant."""

    def __init__(self, block_ns: int, *, lockstep: bool) -> None:
        self._block_ns = block_ns
        self._lockstep = lockstep
        self.restart()

    def restart(self) -> None:
        """Begin as after an activation: not paused, nothing granted, no command received."""
        self.is_paused = False
        self._received = 0
        self._grant = Grant(0, 0)

    def count_command(self) -> None:
        """Note that a message came on a command topic."""
        self._received += 1

    def extend(self, grant: Grant) -> None:
        """Take a grant; one that goes less far than an earlier one changes nothing."""
        if grant.until_ns >= self._grant.until_ns:
            self._grant = grant

    def is_granted(self, now_ns: int) -> bool:
        """Return whether the block that begins now was granted, and its commands have come."""
        if not self._lockstep:
            return True
        reached = now_ns + self._block_ns <= self._grant.until_ns
        return reached and self._received >= self._grant.commands

    def allows(self, now_ns: int) -> bool:
        """Return whether the block that begins now may be simulated."""
        return not self.is_paused and self.is_granted(now_ns)
