"""From the bench's output to packed messages: the same bytes go to a topic and to a file."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from stickslip_ros.contact.profile import Array
from stickslip_ros.instrument.commands import Request
from stickslip_ros.instrument.reports import TRACE_COLUMNS, Output, Status
from stickslip_ros.parameters import Parameters
from stickslip_ros.recording.cdr import (
    pack_float64,
    pack_float64_array,
    pack_point_stamped,
    pack_string,
    pack_uint32,
    pack_wrench_stamped,
)

STAGE_FRAME, CELL_FRAME, RUNNER_FRAME = 'stage_base', 'load_cell', 'runner'
SAWTOOTH_LABEL = 'amplitude[V],frequency[Hz],steps'


class Packed(NamedTuple):
    """A packed message: key of its topic, simulated time in ns, bytes."""

    key: str
    time_ns: int
    data: bytes


class Feed:
    """
    Pack what the bench reports, in the order of time.

    Parameters
    ----------
    parameters : Parameters
        Gives the period of trace and voltage.

    """

    def __init__(self, parameters: Parameters) -> None:
        self._period_ns = parameters.trace_period_ns
        self._blocks: list[Array] = []
        self._status: Status | None = None

    @property
    def is_flushed(self) -> bool:
        """Whether every sample of the trace has been packed."""
        return not self._blocks

    def pack(self, output: Output) -> Iterator[Packed]:
        """Yield the messages of one update."""
        readings = output.readings
        for event in output.events:
            yield Packed('event', event.time_ns, pack_string(event.to_json()))
        point = pack_point_stamped(readings.time_ns, STAGE_FRAME, (readings.position_m, 0.0, 0.0))
        yield Packed('position', readings.time_ns, point)
        wrench = pack_wrench_stamped(
            readings.time_ns, CELL_FRAME, (readings.force_n, 0.0, 0.0), (0.0, 0.0, 0.0)
        )
        yield Packed('force', readings.time_ns, wrench)
        self._blocks.append(readings.trace)
        if readings.time_ns % self._period_ns == 0:
            yield Packed('piezo', readings.time_ns, pack_float64(readings.voltage_v))
            yield Packed('trace', readings.time_ns, self._pack_trace())
        if output.status != self._status:
            self._status = output.status
            yield Packed('status', readings.time_ns, pack_uint32(int(output.status)))

    def _pack_trace(self) -> bytes:
        block = np.concatenate(self._blocks)
        self._blocks.clear()
        return pack_float64_array(block, ('sample', ','.join(TRACE_COLUMNS)))


def pack_request(request: Request, time_ns: int) -> bytes:
    """
    Return a request as the message of its command topic.

    Parameters
    ----------
    request : Request
        ``voltage``, ``preload``, ``sawtooth`` or ``load``.
    time_ns : int
        Stamp, where the message has one.

    """
    if request.name in ('voltage', 'preload'):
        return pack_float64(*request.values)
    if request.name == 'sawtooth':
        return pack_float64_array(np.array(request.values), (SAWTOOTH_LABEL,))
    force, torque = request.values[:3], request.values[3:]
    return pack_wrench_stamped(time_ns, RUNNER_FRAME, force, torque)
