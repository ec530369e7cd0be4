# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Pack the bench's output once: the same bytes go to a topic and to a file."""

import math
from collections.abc import Callable, Container, Iterator
from typing import NamedTuple

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.instrument.reports import (
    FIRST_READING,
    Event,
    Output,
    Readings,
    Status,
    trace_columns,
)
from stickslip_ros.interface.cdr import (
    frame_field,
    pack_float64_array,
    pack_joints,
    pack_number,
    pack_stamp,
    pack_stamped,
    pack_string,
    pack_uint32,
)
from stickslip_ros.interface.messages import STAMPED_FIELDS, JointMessage
from stickslip_ros.interface.topics import READING_TYPES
from stickslip_ros.parameters import TRUTH, Parameters
from stickslip_ros.units import NANO, NS_PER_S


class Packed(NamedTuple):
    """A packed message: key of its topic, simulated time in ns, bytes."""

    key: str
    time_ns: int
    data: bytes


_PERIODIC = ('voltage', 'trace')
"""Topics with a message for each period of the trace."""
IsHeard = Callable[[str], bool]
"""Whether a topic, by its key, has a subscriber or a file."""


def pack_event(event: Event, time_origin_ns: int) -> Packed:
    """Pack the end of a command; its stamp counts from the time origin."""
    return Packed('event', event.time_ns, pack_string(event.to_json(time_origin_ns)))


class _Scalar(NamedTuple):
    """A topic with the readings of a sensor."""

    key: str
    frame: bytes
    zeros: bytes  # the numbers of the message behind the reading
    column: int  # of its readings in a trace
    sees: int  # column of its true values

    def pack(self, stamp: bytes, value: float) -> bytes:
        return stamp + self.frame + pack_number(value) + self.zeros


class Feed:
    """Packs the reports of a bench in the order of time."""

    def __init__(self, parameters: Parameters) -> None:
        self._period_ns = parameters.trace_period_ns
        self._tells_truth = parameters.sim.publish_truth
        self._stage = parameters.frame_id.stage
        self._sensors = [
            _Scalar(
                row.reading,
                frame_field(getattr(parameters.frame_id, row.frame)),
                bytes(8 * len(STAMPED_FIELDS[READING_TYPES[row.unit][0]]) - 8),  # zeros
                column,
                TRUTH.index(row.sees),
            )
            for column, row in enumerate(parameters.sensors, FIRST_READING)
        ]
        self._columns = ','.join(trace_columns(parameters))
        self._joint_name = parameters.sim.joint_name
        rate_hz = parameters.sim.joint_states_rate
        self._joint_period_ns = round(NS_PER_S / rate_hz) if rate_hz else 0
        self._keys = (*(each.key for each in self._sensors), *('joint_states',) * bool(rate_hz))
        self._block_ns = parameters.block_ns
        self._samples = parameters.block_ns // parameters.sample_ns
        self.pending: list[Array] = []  # unsent blocks of the trace
        self.status: Status | None = None  # status in the last message
        self.joint = (0, 0.0)  # ns and m of the last message of the joint, or of the start

    def resume(
        self, pending: list[Array], status: Status | None, joint: tuple[int, float]
    ) -> None:
        """Continue with unsent samples, and with status and joint of the last messages."""
        self.pending, self.status, self.joint = list(pending), status, joint

    def pack(
        self, output: Output, time_origin_ns: int = 0, is_heard: IsHeard = lambda _: True
    ) -> Iterator[Packed]:
        """
        Yield the messages of one update; stamps count from the time origin.

        Readings and events of topics that are not heard are left out.

        """
        readings, end_ns = output.readings, output.readings.time_ns
        ends_period = end_ns % self._period_ns == 0
        due = self._keys + _PERIODIC * ends_period + ('event',) * bool(output.events)
        heard = set(filter(is_heard, due))
        for event in output.events if 'event' in heard else ():
            yield pack_event(event, time_origin_ns)
        if heard or self._tells_truth or end_ns >= self._joint_due_ns:
            yield from self._pack_blocks(readings, time_origin_ns, heard)
        self.pending.append(readings.trace)
        if 'voltage' in heard:
            volts = readings.voltage_v, 0.0, 0.0
            packed = pack_stamped(time_origin_ns + end_ns, self._stage, volts)
            yield Packed('voltage', end_ns, packed)
        if 'trace' in heard:
            labels = f'sample; time_origin_ns={time_origin_ns}', self._columns
            table = pack_float64_array(np.concatenate(self.pending), labels)
            yield Packed('trace', end_ns, table)
        if ends_period:
            self.pending.clear()
        if output.status != self.status:
            self.status = output.status
            yield Packed('status', end_ns, pack_uint32(int(output.status)))

    def _pack_blocks(
        self, readings: Readings, time_origin_ns: int, heard: Container[str]
    ) -> Iterator[Packed]:
        """Yield the numbers at the end of each block: readings, true values, joint."""
        sensors = [each for each in self._sensors if each.key in heard]
        end_ns, block_ns = readings.time_ns, self._block_ns
        blocks = max(1, len(readings.trace) // self._samples)  # more may have gone together
        for time_ns in range(end_ns - (blocks - 1) * block_ns, end_ns + 1, block_ns):
            has_joint = time_ns >= self._joint_due_ns
            if not (sensors or self._tells_truth or has_joint):
                continue
            after = (end_ns - time_ns) // block_ns
            last = readings.trace[-1 - after * self._samples].tolist()
            stamp_ns = time_origin_ns + time_ns
            stamp = pack_stamp(stamp_ns)
            for each in sensors:
                yield Packed(each.key, time_ns, each.pack(stamp, last[each.column]))
            for each in self._sensors if self._tells_truth else ():
                packed = each.pack(stamp, readings.truth[each.sees])
                yield Packed(f'truth/{each.key}', time_ns, packed)
            if has_joint:
                joint = self._joint_after(time_ns, *last[FIRST_READING : FIRST_READING + 2])
                if 'joint_states' in heard:
                    message = JointMessage(stamp_ns, self._stage, (self._joint_name,), *joint)
                    yield Packed('joint_states', time_ns, pack_joints(message))

    @property
    def _joint_due_ns(self) -> float:
        """Time of the next message of the joint; inf if there is none."""
        period_ns = self._joint_period_ns
        return (self.joint[0] // period_ns + 1) * period_ns if period_ns else math.inf

    def _joint_after(
        self, time_ns: int, position_m: float, force_n: float
    ) -> tuple[tuple[float], ...]:
        """Return position, mean velocity since the last joint message, and force."""
        before_ns, before_m = self.joint
        self.joint = time_ns, position_m
        velocity_m_per_s = (position_m - before_m) / ((time_ns - before_ns) * NANO)
        return (position_m,), (velocity_m_per_s,), (force_n,)
