"""A running drive: its own thread steps the bench, publishes and records; others only ask."""

import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field

from stickslip_ros.errors import StickSlipError
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request
from stickslip_ros.instrument.reports import Status
from stickslip_ros.parameters import Parameters
from stickslip_ros.recording.feed import Feed, Packed
from stickslip_ros.recording.run_writer import RunWriter
from stickslip_ros.ros.pacing import Pacer

AT_ONCE = -1
"""Due time of what shall happen at the next tick."""

Publish = Callable[[Packed], None]


@dataclass
class Order:
    """
    Something to do at a tick.

    Attributes
    ----------
    due_ns : int
        Simulated time from which on it is carried out.
    request : Request or None
        For the bench; None exchanges the recording.
    writer : RunWriter or None
        The new recording; None ends the present one.
    reply : Future
        Receives the previous recording, or None, once the tick is over.

    """

    due_ns: int
    request: Request | None = None
    writer: RunWriter | None = None
    reply: 'Future[RunWriter | None]' = field(default_factory=Future)


class Session:
    """
    The drive as a thread that ticks once per block.

    Parameters
    ----------
    parameters : Parameters
        The stand.
    publish : callable
        Receives every packed message, on the session's thread.

    """

    def __init__(self, parameters: Parameters, publish: Publish) -> None:
        self.parameters = parameters
        Bench(parameters).update(parameters.block_ns)  # compiles the kernels now
        self.bench = Bench(parameters)
        self.pacer = Pacer(parameters.sim.block, parameters.sim.real_time_factor)
        self.status = Status(0)
        self.failure: BaseException | None = None
        self._publish = publish
        self._feed = Feed(parameters)
        self._writer: RunWriter | None = None
        self._orders: deque[Order] = deque()
        self._due: list[Order] = []
        self._stopping = threading.Event()
        self._thread: threading.Thread | None = None

    @property
    def writer(self) -> RunWriter | None:
        """The recording in progress."""
        return self._writer

    def start(self) -> None:
        """Begin to tick."""
        self._stopping.clear()
        self.pacer.start()
        self._thread = threading.Thread(target=self._run, name='stickslip drive', daemon=True)
        self._thread.start()

    def stop(self) -> RunWriter | None:
        """End the thread after its present tick; return the recording, still to be closed."""
        self._stopping.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None
        while self._orders:
            order = self._orders.popleft()
            order.reply.cancel()
            if order.writer is not None:
                order.writer.close()
        writer, self._writer = self._writer, None
        return writer

    def submit(self, request: Request, due_ns: int = AT_ONCE) -> 'Future[RunWriter | None]':
        """Ask the bench for something, at the first tick from ``due_ns`` on."""
        return self._put(Order(due_ns, request=request))

    def exchange_recording(
        self, writer: RunWriter | None, due_ns: int = AT_ONCE
    ) -> 'Future[RunWriter | None]':
        """Record into ``writer`` from a tick on; the reply is the recording so far."""
        return self._put(Order(due_ns, writer=writer))

    def _put(self, order: Order) -> 'Future[RunWriter | None]':
        self._orders.append(order)
        return order.reply

    def _run(self) -> None:
        try:
            while not self._stopping.is_set():
                self._tick()
                self.pacer.wait(self._stopping)
        except BaseException as error:
            self.failure = error
            self._refuse_all(error)
            raise

    def _refuse_all(self, error: BaseException) -> None:
        """Answer every order that will never be carried out."""
        for order in (*self._due, *self._orders):
            if not order.reply.done():
                order.reply.set_exception(StickSlipError(f'the drive has stopped: {error}'))

    def _tick(self) -> None:
        now_ns = self.bench.time_ns
        due = self._due = self._take_due(now_ns)
        requests = [order.request for order in due if order.request is not None]
        replies = [self._exchange(order) if order.request is None else None for order in due]
        if self._writer is not None:
            self._writer.write_requests(requests, now_ns)
        output = self.bench.update(now_ns + self.parameters.block_ns, requests)
        self.status = output.status
        for packed in self._feed.pack(output):
            self._publish(packed)
            if self._writer is not None:
                self._writer.write(packed)
        for order, reply in zip(due, replies, strict=True):
            order.reply.set_result(reply)

    def _exchange(self, order: Order) -> RunWriter | None:
        previous, self._writer = self._writer, order.writer
        if self._writer is not None:
            self._writer.begin(self.bench.time_ns, self.status)
        return previous

    def _take_due(self, now_ns: int) -> list[Order]:
        """Take the orders that are due, in the order in which they came."""
        waiting = [self._orders.popleft() for _ in range(len(self._orders))]
        later = [order for order in waiting if order.due_ns > now_ns]
        self._orders.extendleft(reversed(later))
        due = [order for order in waiting if order.due_ns <= now_ns]
        return [order for order in due if order.reply.set_running_or_notify_cancel()]


def require(session: Session | None) -> Session:
    """
    Return a session that runs.

    Raises
    ------
    StickSlipError
        If there is none, or its thread has failed.

    """
    if session is None:
        raise StickSlipError('the drive is not active; activate the node first')
    if session.failure is not None:
        raise StickSlipError(f'the drive has stopped: {session.failure}; restart the node')
    return session
