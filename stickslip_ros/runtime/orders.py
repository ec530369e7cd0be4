# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Pending orders of a drive, grants of simulated time, and its pause."""

import math
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from stickslip_ros.errors import OutOfRange, StickSlipError, WrongKind
from stickslip_ros.instrument.commands import Request
from stickslip_ros.instrument.compilation import needs_all_kernels
from stickslip_ros.interface.requests import read_request
from stickslip_ros.interface.topics import COMMAND_TOPICS, Topic
from stickslip_ros.parameters import to_nanoseconds
from stickslip_ros.recording.run import RunWriter
from stickslip_ros.units import NANO

AT_ONCE = -2
"""Due time of an order that waits for no block: it runs even while simulated time is held."""
NEXT_BLOCK = -1
"""Due time of an order for the next block."""
LEAST_NUMBERS = 100
"""Memory of an order without its numbers, counted in numbers."""

_RANKS = {topic.request: rank for rank, topic in enumerate(COMMAND_TOPICS)}


class Nobody(Future[Any]):
    """Who sent an order and awaits no reply; it costs nothing to make and to answer."""

    def __init__(self) -> None: ...

    def set_running_or_notify_cancel(self) -> bool:
        """Let the order be carried out."""
        return True

    def set_result(self, _: Any) -> None: ...

    def set_exception(self, _: BaseException | None) -> None: ...

    def done(self) -> bool:
        """Return that no reply is due."""
        return True

    def cancel(self) -> bool:
        """Return that the order cannot be withdrawn."""
        return False


NOBODY = Nobody()


@dataclass
class Order:
    """Something to do at a block."""

    due_ns: int  # earliest simulated time to carry it out, or AT_ONCE, or NEXT_BLOCK
    request: Request | None = None  # for the bench; None exchanges the recording, or saves
    writer: RunWriter | None = None  # the new recording; None ends the present one
    saves: bool = False  # whether a checkpoint is asked for
    # The reply is set to the outcome once the block is over: the previous recording, the
    # checkpoint, a refusal, or None.
    reply: 'Future[Any]' = field(default_factory=Future)
    outcome: RunWriter | bytes | StickSlipError | None = None

    def answer(self) -> None:
        if isinstance(self.outcome, StickSlipError):
            self.reply.set_exception(self.outcome)
        else:
            self.reply.set_result(self.outcome)

    @property
    def numbers(self) -> int:
        """Size of the order in the queue, in numbers."""
        return LEAST_NUMBERS + (0 if self.request is None else self.request.size)

    @property
    def name(self) -> str:
        """Name of the request; empty without one."""
        return '' if self.request is None else self.request.name

    @property
    def rank(self) -> int:
        """Place of its topic among the command topics; an order without topic comes first."""
        return _RANKS.get(self.name, -1)


class Orders:
    """
    Pending orders in the sequence of their arrival.

    With ``by_topic`` the orders of one block are sorted by topic, so that the sequence of their
    delivery by the network does not matter. Without ``has_kernels``, requests that need them wait.

    """

    def __init__(self, *, by_topic: bool, has_kernels: Callable[[], bool] = lambda: True) -> None:
        self._waiting: deque[Order] = deque()
        self.numbers = 0  # how many the waiting orders hold, each order at least LEAST_NUMBERS
        self._by_topic = by_topic
        self._has_kernels = has_kernels

    def __iter__(self) -> Iterator[Order]:
        return iter(tuple(self._waiting))

    @property
    def wait_for_kernels(self) -> bool:
        """Whether an order waits until all kernels are loaded."""
        return not self._has_kernels() and any(needs_all_kernels(each.request) for each in self)

    def put(self, order: Order) -> Order:
        self._waiting.append(order)
        self.numbers += order.numbers
        return order

    def take(self, now_ns: int) -> list[Order]:
        """Take the orders that are due at a simulated time and were not withdrawn."""
        if not self._waiting:
            return []
        due: list[Order] = []
        later: list[Order] = []
        lacks_kernels = not self._has_kernels()
        for order in self._waiting:
            waits = order.due_ns > now_ns or (lacks_kernels and needs_all_kernels(order.request))
            (later if waits else due).append(order)
        self._waiting = deque(later)
        self.numbers -= sum(order.numbers for order in due)
        if self._by_topic:
            due.sort(key=lambda order: order.rank)
        return [order for order in due if order.reply.set_running_or_notify_cancel()]

    def withdraw_all(self) -> None:
        """Cancel all orders, and close the recordings that were to begin."""
        while self._waiting:
            order = self._waiting.popleft()
            self.numbers -= order.numbers
            order.reply.cancel()
            if order.writer is not None:
                order.writer.close()


class Grant(NamedTuple):
    """A limit of simulated time in lockstep."""

    until_ns: int  # simulated time that it may reach
    commands: int  # messages on command topics that must have come before


def read_grant(topic: Topic, data: bytes) -> Grant:
    """Read a grant from ``command/grant``; refuse anything but a time and a count."""
    values = list(read_request(topic, data).values[:3])
    if len(values) != 2 or not all(map(math.isfinite, values)):
        raise WrongKind('grant', values, 'a list of 2 finite numbers', 'send [until s, commands]')
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
        """Reset to the state after an activation: not paused, no grant, no command."""
        self.is_paused = False
        self.received = 0  # messages on command topics
        self._grant = Grant(0, 0)

    def extend(self, grant: Grant) -> None:
        """Take a grant; ignore it if an earlier grant goes further."""
        if grant.until_ns >= self._grant.until_ns:
            self._grant = grant

    def is_granted(self, now_ns: int) -> bool:
        """Return whether the next block was granted and its commands have come."""
        if not self._lockstep:
            return True
        reached = now_ns + self._block_ns <= self._grant.until_ns
        return reached and self.received >= self._grant.commands

    def state(self, now_ns: int) -> str:
        """Return 'running', or the cause that holds simulated time."""
        until_ns, commands = self._grant
        if self.is_paused or self.is_granted(now_ns):
            return 'paused' if self.is_paused else 'running'
        if now_ns + self._block_ns <= until_ns:
            return f'lockstep, {self.received} of {commands} commands came'
        far = f'granted to {until_ns * NANO:.9g} s' if until_ns else 'no grant came'
        return f'lockstep, {far}'

    def allows(self, now_ns: int) -> bool:
        """Return whether the next block may be simulated."""
        return not self.is_paused and self.is_granted(now_ns)
