"""Orders to a drive that it has not carried out yet."""

from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from dataclasses import dataclass, field
from typing import Any

from stickslip_ros.errors import StickSlipError
from stickslip_ros.instrument.commands import Request
from stickslip_ros.interface.topics import COMMAND_TOPICS
from stickslip_ros.recording.run import RunWriter

AT_ONCE = -2
"""Due time of what waits for no block: it is done even while simulated time is held."""
NEXT_BLOCK = -1
"""Due time of what shall happen with the next block."""

LEAST_NUMBERS = 100
"""Numbers whose memory an order takes besides its own."""

_RANKS = {topic.request: rank for rank, topic in enumerate(COMMAND_TOPICS)}


MustWait = Callable[[Request | None, bool], bool]
"""Whether a request must wait for more than its time, given whether one before it does."""


@dataclass
class Order:
    """
    Something to do at a block.

    Attributes
    ----------
    due_ns : int
        Simulated time from which on it is carried out, or AT_ONCE, or NEXT_BLOCK.
    request : Request or None
        For the bench; None exchanges the recording, or saves.
    writer : RunWriter or None
        The new recording; None ends the present one.
    saves : bool
        Whether a checkpoint is asked for.
    reply : Future
        Receives the previous recording, the checkpoint, or None, once the block is over.
    outcome : RunWriter or bytes or StickSlipError or None
        What the reply will be.

    """

    due_ns: int
    request: Request | None = None
    writer: RunWriter | None = None
    saves: bool = False
    reply: 'Future[Any]' = field(default_factory=Future)
    outcome: RunWriter | bytes | StickSlipError | None = None

    def answer(self) -> None:
        """Reply with the outcome."""
        if isinstance(self.outcome, StickSlipError):
            self.reply.set_exception(self.outcome)
        else:
            self.reply.set_result(self.outcome)

    def refuse(self, why: StickSlipError) -> None:
        """Reply that the order will never be carried out."""
        if not self.reply.done():
            self.reply.set_exception(why)

    @property
    def numbers(self) -> int:
        """Its share of what may wait."""
        return LEAST_NUMBERS + (0 if self.request is None else self.request.size)

    @property
    def rank(self) -> int:
        """Place of its topic among the command topics; what has none comes first."""
        return -1 if self.request is None else _RANKS.get(self.request.name, -1)


class Orders:
    """
    Orders that wait, in the order in which they came.

    Parameters
    ----------
    by_topic : bool
        Whether orders of one block are sorted by their topics, so that it does not matter in
        which order the network delivered them.
    must_wait : callable
        Returns whether a request must wait for more than its time.

    Attributes
    ----------
    numbers : int
        Numbers that the waiting orders hold, each order at least LEAST_NUMBERS.

    """

    def __init__(self, *, by_topic: bool, must_wait: MustWait = lambda *_: False) -> None:
        self._waiting: deque[Order] = deque()
        self.numbers = 0
        self._by_topic = by_topic
        self._must_wait = must_wait

    def __iter__(self) -> Iterator[Order]:
        return iter(tuple(self._waiting))

    def put(self, order: Order) -> Order:
        """Add an order; return it."""
        self._waiting.append(order)
        self.numbers += order.numbers
        return order

    def take(self, now_ns: int) -> list[Order]:
        """Take what is due at a simulated time, need not wait and was not withdrawn."""
        due: list[Order] = []
        later: list[Order] = []
        for order, waits in self._with_waits():
            (due if order.due_ns <= now_ns and not waits else later).append(order)
        self._waiting = deque(later)
        self.numbers -= sum(order.numbers for order in due)
        if self._by_topic:
            due.sort(key=lambda order: order.rank)
        return [order for order in due if order.reply.set_running_or_notify_cancel()]

    def held(self, now_ns: int) -> int:
        """Return how many are due but must wait for more than their time."""
        return sum(waits and order.due_ns <= now_ns for order, waits in self._with_waits())

    def _with_waits(self) -> Iterator[tuple[Order, bool]]:
        after = False
        for order in tuple(self._waiting):
            waits = self._must_wait(order.request, after)
            after = after or waits
            yield order, waits

    def withdraw_all(self) -> None:
        """Cancel everything; recordings that were to begin are closed."""
        while self._waiting:
            order = self._waiting.popleft()
            self.numbers -= order.numbers
            order.reply.cancel()
            if order.writer is not None:
                order.writer.close()
