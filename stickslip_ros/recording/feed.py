"""From the bench's output to packed messages: the same bytes go to a topic and to a file."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from stickslip_ros.contact.profile import Array
from stickslip_ros.instrument.reports import TRACE_COLUMNS, Output, Status
from stickslip_ros.parameters import Parameters
from stickslip_ros.recording.cdr import (
    pack_float64,
    pack_float64_array,
    pack_stamped,
    pack_string,
    pack_uint32,
)


class Packed(NamedTuple):
    """A packed message: key of its topic, simulated time in ns, bytes."""

    key: str
    time_ns: int
    data: bytes


class Feed:
    """
    What a bench reports, packed in the order of time.

    Attributes
    ----------
    pending : list of array
        Blocks of the trace that no message has held yet.
    status : Status or None
        The last that a message has held; None before the first.

    """

    def __init__(self, parameters: Parameters) -> None:
        self._period_ns = parameters.trace_period_ns
        self._tells_truth = parameters.sim.publish_truth
        self._frames = parameters.frame_id
        self.pending: list[Array] = []
        self.status: Status | None = None

    def resume(self, pending: list[Array], status: Status | None) -> None:
        """Go on with samples that no message has held yet, and the status of the last one."""
        self.pending, self.status = list(pending), status

    def pack(self, output: Output, time_origin_ns: int = 0) -> Iterator[Packed]:
        """Yield the messages of one update; stamps begin with the time origin."""
        readings = output.readings
        for event in output.events:
            yield Packed('event', event.time_ns, pack_string(event.to_json()))
        times_ns = readings.time_ns, time_origin_ns + readings.time_ns
        yield from self._pack_pair('', *times_ns, readings.position_m, readings.force_n)
        if self._tells_truth:
            truth = (readings.truth_position_m, readings.truth_force_n)
            yield from self._pack_pair('truth/', *times_ns, *truth)
        self.pending.append(readings.trace)
        if readings.time_ns % self._period_ns == 0:
            yield Packed('voltage', readings.time_ns, pack_float64(readings.voltage_v))
            yield Packed('trace', readings.time_ns, self._pack_trace())
        if output.status != self.status:
            self.status = output.status
            yield Packed('status', readings.time_ns, pack_uint32(int(output.status)))

    def _pack_trace(self) -> bytes:
        block = np.concatenate(self.pending)
        self.pending.clear()
        return pack_float64_array(block, ('sample', ','.join(TRACE_COLUMNS)))

    def _pack_pair(
        self, prefix: str, time_ns: int, stamp_ns: int, position_m: float, force_n: float
    ) -> Iterator[Packed]:
        """Yield position and force, as read or as they are."""
        point = pack_stamped(stamp_ns, self._frames.stage, (position_m, 0.0, 0.0))
        yield Packed(f'{prefix}position', time_ns, point)
        numbers = (force_n, 0.0, 0.0, 0.0, 0.0, 0.0)
        wrench = pack_stamped(stamp_ns, self._frames.load_cell, numbers)
        yield Packed(f'{prefix}force', time_ns, wrench)
