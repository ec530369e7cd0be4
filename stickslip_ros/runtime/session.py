# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A running drive: its own thread does the work, other threads queue orders."""

import threading
import time
from collections import deque
from collections.abc import Mapping
from concurrent.futures import Future
from concurrent.futures import TimeoutError as NoReply
from enum import Enum, auto
from typing import Any, TypeVar

from stickslip_ros.errors import OutOfRange, StickSlipError
from stickslip_ros.instrument.commands import FAULT, Request
from stickslip_ros.interface.channels import Channel
from stickslip_ros.parameters import Parameters, to_nanoseconds
from stickslip_ros.process.stopping import StillBusy
from stickslip_ros.recording.run import Publish, RunWriter
from stickslip_ros.recording.run_file import run_path
from stickslip_ros.runtime.orders import (
    AT_ONCE,
    NEXT_BLOCK,
    NOBODY,
    Grant,
    Order,
    Orders,
    TimeControl,
)
from stickslip_ros.runtime.pacing import Pacer
from stickslip_ros.runtime.remaining import RemainingKernels
from stickslip_ros.runtime.worker import NO_CALLBACKS, Callbacks, Worker
from stickslip_ros.units import NANO

LONG_PAUSE_S = 0.2
"""Longest pause spent asleep, which is exact; a longer pause can be ended at once."""
HOLD_TIMEOUT_S = 10.0
REPLY_TIMEOUT_S = 10.0
WAITING_MAX = 2_000_000
"""Largest sum of numbers in pending commands: ten of the longest waveforms."""
STOP_TIMEOUT_S = 5.0

T = TypeVar('T')


class Turn(Enum):
    """Next action of a session's thread."""

    ADVANCE = auto()
    STEP = auto()
    SERVE = auto()
    END = auto()


class Session:
    """The drive as a thread that ticks once per block."""

    def __init__(
        self, parameters: Parameters, publish: Publish, callbacks: Callbacks = NO_CALLBACKS
    ) -> None:
        self.parameters = parameters
        lockstep = parameters.sim.lockstep
        pace = 0.0 if lockstep else parameters.sim.real_time_factor
        self._wake_ns = max(parameters.block_ns, to_nanoseconds(parameters.sim.wake))
        self.pacer = Pacer(self._wake_ns * NANO, pace, parameters.sim.lag_max)
        self.failure: BaseException | None = None  # why there will be no further tick
        self._on_failure = callbacks.on_failure
        self._lock = threading.RLock()  # of the condition, and faster to take
        self._changed = threading.Condition(self._lock)
        self._kernels = RemainingKernels(parameters, callbacks.say, self._notify)
        # Other threads may read the state of worker and bench, but change nothing.
        self.worker = Worker(parameters, publish, callbacks)
        self.bench = self.worker.bench
        self._time_control = TimeControl(parameters.block_ns, lockstep=lockstep)
        self._orders = Orders(by_topic=lockstep, has_kernels=lambda: self._kernels.are_loaded)
        self._steps: deque[Future[None]] = deque()
        self._due: list[Order] = []
        self._is_ending = False
        self._origin_s: float | None = None  # moment of the time origin, by the monotonic clock
        self._busy_since_s: float | None = None
        self._pausing = 0  # calls that wait for the end of the present block
        self._thread: threading.Thread | None = None

    @property
    def is_paused(self) -> bool:
        """Whether simulated time is held by ``~/set_paused``."""
        return self._time_control.is_paused

    @property
    def received(self) -> int:
        """Number of messages on command topics since the activation."""
        return self._time_control.received

    @property
    def state(self) -> str:
        """Simulated time, and the cause that holds it."""
        now_ns = self.bench.time_ns
        held = 'waits for kernels, which are compiled once' * self._waits_for_kernels
        return f'simulated time {now_ns * NANO:.9g} s; {held or self._time_control.state(now_ns)}'

    @property
    def _waits_for_kernels(self) -> bool:
        """Whether simulated time is held for kernels: without a pace, orders keep their block."""
        return self.pacer.real_time_factor == 0.0 and self._orders.wait_for_kernels

    @property
    def busy_s(self) -> float:
        """Wall-clock time since the present block began, s; 0 between two blocks."""
        since_s = self._busy_since_s
        return 0.0 if since_s is None else time.monotonic() - since_s

    @property
    def stamps_behind_s(self) -> float | None:
        """Lag of the stamps behind the system's time, s; None if they do not follow it."""
        origin_ns = self.worker.time_origin_ns
        return (time.time_ns() - origin_ns - self.bench.time_ns) * NANO if origin_ns else None

    def fix_time_origin(self, *, follows_clock: bool) -> None:
        """
        Set the origin of the stamps, as `has_system_time` decides.

        A reading is published when the blocks of its wake-up begin. Its stamp is the end of its
        block, and must not lie in the future. The deadlines of `start` count from this moment.

        """
        self._kernels.load()
        self.worker.time_origin_ns, self._origin_s = 0, None
        if has_system_time(self.parameters, follows_clock=follows_clock):
            ahead_ns = self.bench.time_ns + self._wake_ns
            # The largest difference is that of two readings without a pause in between.
            lead_ns = max(time.monotonic_ns() - time.time_ns() for _ in range(5))
            now_ns = time.time_ns()
            self.worker.time_origin_ns = now_ns - ahead_ns
            self._origin_s = (now_ns + lead_ns) * NANO

    def start(self) -> None:
        """Start to tick, not paused and without a grant."""
        self._is_ending = False
        self._time_control.restart()
        self._kernels.start()
        self._kernels.hurry(is_wanted=self._orders.wait_for_kernels)
        self.pacer.start(self._origin_s)
        self._thread = threading.Thread(target=self._run, name='stickslip drive', daemon=True)
        self._thread.start()

    def stop(self) -> RunWriter | None:
        """
        End the thread after its present tick; return the recording, which is still open.

        A tick that does not end hangs in a kernel and cannot be interrupted: it is left alone, and
        `failure` says so.

        """
        self._is_ending = True
        self._kernels.stop()
        self._notify()
        if self._thread is not None:
            self._thread.join(STOP_TIMEOUT_S)
            if self._thread.is_alive():
                self.failure = StillBusy(
                    f'the present block has not ended in {STOP_TIMEOUT_S:g} s'
                )
            self._thread = None
        self._orders.withdraw_all()
        while self._steps:
            self._steps.popleft().cancel()
        writer, self.worker.writer = self.worker.writer, None
        return writer

    def submit(self, request: Request, due_ns: int = NEXT_BLOCK) -> 'Future[None]':
        """Queue a request for the bench, due at the first tick from ``due_ns`` on."""
        return self._put(Order(due_ns, request=request))

    def exchange_recording(
        self, writer: RunWriter | None, due_ns: int = AT_ONCE
    ) -> 'Future[RunWriter | None]':
        """Record into ``writer`` from the next tick on; the reply is the previous recording."""
        return self._put(Order(due_ns, writer=writer))

    def save(self) -> 'Future[bytes]':
        """Ask for a checkpoint of the drive at the next tick."""
        return self._put(Order(AT_ONCE, saves=True))

    def receive(self, request: Request | None) -> None:
        """
        Take a request from a command topic; None stands for a message without meaning.

        Refused if too many numbers are pending: time is held, or the drive cannot follow.

        """
        with self._changed:
            self._time_control.received += 1
            numbers = self._orders.numbers
            if request is not None and numbers >= WAITING_MAX:
                limit = f'at the limit of {WAITING_MAX} waiting for the next block'
                hint = 'advance simulated time first'
                raise OutOfRange('numbers of commands', numbers, '', limit, hint)
            if request is not None:
                self._queue(Order(NEXT_BLOCK, request=request, reply=NOBODY))
            self._changed.notify_all()

    def extend_grant(self, grant: Grant) -> None:
        """Allow the drive to go on in lockstep."""
        with self._changed:
            self._time_control.extend(grant)
            self._changed.notify_all()

    def await_time(self, time_ns: int, timeout_s: float) -> bool:
        """Wait for the end and publication of a block; return whether it came in time."""
        with self._changed:
            return self._changed.wait_for(
                lambda: self.bench.time_ns >= time_ns and self._busy_since_s is None, timeout_s
            )

    def set_paused(self, wanted: bool) -> None:
        """Hold simulated time from the end of the present tick on, or let it run."""
        with self._changed:
            self._time_control.is_paused = wanted
            self._changed.notify_all()
            self._pausing += wanted
            has_ended = not wanted or self._changed.wait_for(
                lambda: self._busy_since_s is None, HOLD_TIMEOUT_S
            )
            self._pausing -= wanted
            if not has_ended:
                raise StickSlipError(f'the present block has not ended in {HOLD_TIMEOUT_S:g} s')

    def step(self) -> 'Future[None]':
        """Advance by one block; refused if time is not held or the block is not granted."""
        with self._changed:
            if not self._time_control.is_paused:
                raise StickSlipError('simulated time runs; call ~/set_paused with true first')
            if not self._time_control.is_granted(self.bench.time_ns):
                raise StickSlipError('the next block is not granted; send command/grant first')
            reply: Future[None] = Future()
            self._steps.append(reply)
            self._changed.notify_all()
            return reply

    def open_recording(self, channels: Mapping[str, Channel], namespace: str = '') -> RunWriter:
        """
        Start the file of a recording; without a pace to keep, the drive waits for the disk.

        The path is absolute: the client may run in another folder.

        """
        return RunWriter(
            run_path(self.parameters, namespace).absolute(),
            self.parameters,
            wait=self.pacer.real_time_factor == 0.0,
            channels=channels,
            time_origin_ns=self.worker.time_origin_ns,
        )

    def start_recording(self, channels: Mapping[str, Channel], namespace: str = '') -> str:
        with self._changed:
            begins = any(each.writer is not None for each in self._orders)
        if begins or self.worker.writer is not None:
            raise StickSlipError('already recording')
        writer = self.open_recording(channels, namespace)
        try:
            await_reply(self.exchange_recording(writer))
        except StickSlipError:
            writer.close()
            raise
        return writer.recorder.place

    def end_recording(self, logger: Any) -> str:
        ended = await_reply(self.exchange_recording(None))  # one that is about to begin, too
        if ended is None:
            failed = self.worker.failed_writer
            raise StickSlipError('not recording' if failed is None else why_lost(failed))
        return self.close_recording(ended, logger)

    def close_recording(self, writer: RunWriter, logger: Any) -> str:
        """
        Finish a file while the drive goes on; return its path.

        Refused if the recording has failed; the drive reports that too.

        """
        writer.close()
        recorder = writer.recorder
        if recorder.error is not None:
            self.worker.lose_recording(writer)
            raise StickSlipError(why_lost(writer))
        said = f'recorded {recorder.place}: {recorder.stored} messages, {recorder.losses}'
        if recorder.dropped:
            logger.warning(said)
        else:
            logger.info(said)
        return recorder.place

    def _notify(self) -> None:
        with self._changed:
            self._changed.notify_all()

    def _put(self, order: Order) -> 'Future[Any]':
        with self._changed:
            self._queue(order)
            self._changed.notify_all()
        return order.reply

    def _queue(self, order: Order) -> None:
        """Add an order; if the drive lacks its kernels, it waits while the drive goes on."""
        if order.name == 'clear_faults' and not self._kernels.are_loaded:
            for fault in filter(lambda each: each.name == FAULT, self._orders):
                fault.reply.cancel()
        self._orders.put(order)
        self._kernels.hurry(is_wanted=self._orders.wait_for_kernels)

    def _run(self) -> None:
        try:
            self._go_on()
        except BaseException as error:
            self._fail(error)
            if not isinstance(error, StickSlipError):
                raise
        finally:
            self._busy_since_s = None
            self._notify()

    def _go_on(self) -> None:
        while True:
            with self._lock:
                while (turn := self._next_turn()) is None:
                    self.pacer.hold()
                    self._changed.wait()
                if turn is Turn.END:
                    return
                self._busy_since_s = time.monotonic()
            if turn is Turn.SERVE:
                self.worker.serve(self._due)
            elif turn is Turn.STEP:
                self.worker.heard.clear()
                self.worker.advance(self._due)
                self._steps.popleft().set_result(None)
            else:
                self.pacer.resume()
                self.worker.advance(self._due, self._blocks_ahead())
            self._due = []
            self._busy_since_s = None
            # Only for a waiter: waking others costs a switch of threads in each block.
            if self._pausing:
                self._notify()
            if turn is Turn.ADVANCE and self.bench.time_ns % self._wake_ns == 0:
                self.pacer.wait(self._sleep)

    def _fail(self, error: BaseException) -> None:
        """Refuse all pending orders, and report the failure."""
        self.failure = error
        why = StickSlipError(f'the drive has stopped: {error}')
        with self._changed:
            replies = [order.reply for order in (*self._due, *self._orders)]
            for reply in (*replies, *self._steps):
                if not reply.done():
                    reply.set_exception(why)
            self._steps.clear()
        self._on_failure()
        self.worker.report_failure(error)

    def _next_turn(self) -> Turn | None:
        """Return the next action, and take its orders."""
        now_ns = self.bench.time_ns
        if self._is_ending:
            return Turn.END
        if self._time_control.allows(now_ns) and not self._waits_for_kernels:
            self._due = self._orders.take(now_ns)
            return Turn.ADVANCE
        self._due = self._orders.take(AT_ONCE)
        if self._due:
            return Turn.SERVE
        while self._steps and not self._steps[0].set_running_or_notify_cancel():
            self._steps.popleft()
        if self._waits_for_kernels or not self._steps:
            return None
        self._due = self._orders.take(now_ns)
        return Turn.STEP

    def _blocks_ahead(self) -> int:
        """Return the number of blocks until the next order, or the end of the wake-up."""
        now_ns, block_ns = self.bench.time_ns, self.parameters.block_ns
        left_ns = self._wake_ns - now_ns % self._wake_ns
        if left_ns == block_ns or self.parameters.sim.lockstep:  # each block has a grant
            return 1
        due_ns = min((order.due_ns for order in self._orders), default=now_ns + left_ns)
        return max(1, min(left_ns, due_ns - now_ns) // block_ns)

    def _sleep(self, pause_s: float) -> None:
        if pause_s <= LONG_PAUSE_S:
            time.sleep(pause_s)
            return
        with self._changed:
            self._changed.wait_for(lambda: self._is_ending or self.is_paused, pause_s)


def has_system_time(parameters: Parameters, *, follows_clock: bool) -> bool:
    """Return whether stamps begin at the system's time, not at that of ``/clock``."""
    sim = parameters.sim
    if sim.time_origin != 'auto':
        return sim.time_origin == 'system'
    has_clock = sim.publish_clock or follows_clock
    return sim.real_time_factor == 1.0 and not (has_clock or sim.lockstep)


def await_reply(reply: 'Future[T]') -> T:
    """Wait for the reply to an order; withdraw and refuse it if no tick comes."""
    try:
        return reply.result(REPLY_TIMEOUT_S)
    except NoReply:
        reply.cancel()
        raise StickSlipError(
            f'the drive made no tick in {REPLY_TIMEOUT_S:g} s; look at /diagnostics'
        ) from None


def why_lost(writer: RunWriter) -> str:
    """Return the path of a failed recording and its error, in words."""
    return f'{writer.recorder.path} has stopped: {writer.recorder.error}'


def require(session: Session | None, state: str) -> Session:
    """Return a running session; refuse None and a failed session."""
    if session is None:
        raise StickSlipError(f'the node is {state}, not active; activate it first')
    if session.failure is not None:
        raise StickSlipError(f'the drive has stopped: {session.failure}; configure the node anew')
    return session
