# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The work of a drive, block by block: orders, bench, topics and recording; no threads."""

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from stickslip_ros.errors import StickSlipError
from stickslip_ros.instrument.bench import start_bench
from stickslip_ros.instrument.commands import Request
from stickslip_ros.instrument.fault_schedule import FaultSchedule, read_schedule
from stickslip_ros.instrument.reports import Event, Identity, Output, Result
from stickslip_ros.interface.cdr import pack_stamp
from stickslip_ros.interface.feed import IsHeard, Packed, pack_event
from stickslip_ros.parameters import FaultParameters, Parameters, Scalar
from stickslip_ros.recording.run import Publish, ReportingBench, RunWriter
from stickslip_ros.runtime.orders import Order

UNTROUBLED = (Result.DONE, Result.ABORTED)
"""Results of commands that were neither refused nor failed."""
Faults = dict[str, Scalar]
"""Values of the present faults, by name."""


@dataclass(frozen=True)
class Callbacks:
    """Listeners to events of a drive, called on its thread unless told; by default none."""

    on_faults: Callable[[Faults], None] = lambda _: None  # the faults whenever they change
    on_lost_recording: Callable[[RunWriter], None] = lambda _: None  # one that has just failed
    on_end: Callable[[Event], None] = lambda _: None  # how a command has ended
    on_failure: Callable[[], None] = lambda: None  # the drive itself has failed
    say: Callable[[str], None] = lambda _: None  # a line for the log, on any thread
    is_heard: IsHeard = lambda _: True  # asked for each topic, by its key


NO_CALLBACKS = Callbacks()
HEARD_S = 0.01
"""Time after which the topics are asked anew whether they are heard."""


class Heard(dict[str, bool]):
    """Whether topics are heard, by key; each is asked once until this is cleared."""

    def __init__(self, is_heard: IsHeard) -> None:
        super().__init__()
        self._is_heard = is_heard

    def __missing__(self, key: str) -> bool:
        """Ask."""
        heard = self[key] = self._is_heard(key)
        return heard


class Worker(ReportingBench):
    """A run under orders and a schedule of faults, which reports failures."""

    def __init__(self, parameters: Parameters, publish: Publish, callbacks: Callbacks) -> None:
        path = parameters.fault.schedule
        self._schedule = read_schedule(Path(path), parameters.feet) if path else FaultSchedule()
        bench = start_bench(parameters)
        self._schedule.due(bench.time_ns - 1)  # skips faults of the time before a checkpoint
        self.heard, self._asked_s = Heard(callbacks.is_heard), 0.0
        self._is_held = parameters.sim.lockstep  # a client may subscribe between two blocks
        super().__init__(parameters, publish, bench=bench, is_heard=self.heard.__getitem__)
        self._block_ns = parameters.block_ns
        self._keeps_clock = parameters.sim.publish_clock
        self.failed_writer: RunWriter | None = None  # ended by the disk, until another begins
        self._callbacks = callbacks
        self._seen_faults: FaultParameters | None = None
        self._reported_faults: Faults = {}

    @property
    def faults(self) -> Faults:
        faults = self.bench.faults
        return {name: getattr(faults, name) for name in faults.names}

    def serve(self, orders: list[Order]) -> None:
        """Carry out orders while simulated time stands still."""
        self._carry_out(orders)
        for order in orders:
            order.answer()

    def advance(self, orders: list[Order], blocks: int = 1) -> None:
        """
        Carry out orders and scheduled faults, advance, publish the readings.

        It goes by at most so many blocks, by one if something may happen between them.

        """
        now_ns, now_s = self.bench.time_ns, time.monotonic()
        if orders or self._is_held or now_s - self._asked_s > HEARD_S:
            self.heard.clear()
            self._asked_s = now_s
        if orders or self._seen_faults is None or not self._schedule.is_over:
            self._carry_out(orders, self._schedule.due(now_ns))
        may_split = self.writer is not None and self.writer.splits
        if self._schedule.is_over and not may_split:
            outputs = self.bench.update_blocks(blocks)
        else:
            outputs = [self.advance_bench(now_ns + self._block_ns)]
        for output in outputs:
            self._publish_output(output)
        if self.writer is not None and self.writer.recorder.error is not None:
            failed, self.writer = self.writer, None
            self.lose_recording(failed)
        for order in orders:
            order.answer()

    def _publish_output(self, output: Output) -> None:
        """Publish time, ends of commands and readings."""
        # Before the readings: who gets one then has its time.
        if self._keeps_clock and self.heard['clock']:
            time_ns = output.readings.time_ns
            self._publish(Packed('clock', time_ns, pack_stamp(self.time_origin_ns + time_ns)))
        for event in output.events:
            self.heard.pop('event', None)
            self._callbacks.on_end(event)
        self.report(output)

    def report_failure(self, error: BaseException) -> None:
        """Report that the drive has stopped, as an event and in the recording."""
        packed = self._pack_event('drive', Result.DRIVE_FAILED, str(error))
        if self.writer is not None:
            self.writer.write(packed)
        self._publish(packed)

    def report_recorded(self, writer: RunWriter) -> None:
        """Report that a recording is complete; the message is its place."""
        self._publish(self._pack_event('recording', Result.DONE, writer.recorder.place))

    def lose_recording(self, writer: RunWriter) -> None:
        """Report that the disk has ended a recording; the drive goes on."""
        self.failed_writer = writer
        why = str(writer.recorder.error)
        self._publish(self._pack_event('recording', Result.RECORDING_FAILED, why))
        self._callbacks.on_lost_recording(writer)

    def _pack_event(self, name: str, result: Result, message: str) -> Packed:
        """Pack an event that ends no command."""
        event = self.bench.event(Identity(0, name), result, message)
        return pack_event(event, self.time_origin_ns)

    def _carry_out(self, orders: list[Order], scheduled: Iterable[Request] = ()) -> None:
        """Carry out recordings first, then scheduled faults, then the other orders."""
        for order in orders:
            if order.saves:
                order.outcome = self.save()
            elif order.request is None:
                if order.writer is not None:
                    self.failed_writer = None
                order.outcome = self.record(order.writer)
        for request in scheduled:
            self.accept(request)
        for order in orders:
            if order.request is not None:
                refused = self.bench.refused
                self.accept(order.request)
                if self.bench.refused > refused:
                    why = 'the drive does not take it; ~/event says why'
                    order.outcome = StickSlipError(why)
        if self.bench.faults is not self._seen_faults:
            self._seen_faults = self.bench.faults
            if self.faults != self._reported_faults:
                self._reported_faults = self.faults
                self._callbacks.on_faults(self._reported_faults)
