# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Pack the bench's output once: the same bytes go to a topic and to a file."""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.instrument.reports import FIRST_READING, Event, Output, Status, trace_columns
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


IsHeard = Callable[[str], bool]
"""Whether a topic, by its key, has a subscriber or a file."""


def pack_event(event: Event, time_origin_ns: int) -> Packed:
    """Pack the end of a command; its stamp counts from the time origin."""
    return Packed('event', event.time_ns, pack_string(event.to_json(time_origin_ns)))


class Feed:
    """Packs the reports of a bench in the order of time."""

    def __init__(self, parameters: Parameters) -> None:
        self._period_ns = parameters.trace_period_ns
        self._tells_truth = parameters.sim.publish_truth
        self._stage = parameters.frame_id.stage
        self._sensors = [
            (
                row.reading,
                frame_field(getattr(parameters.frame_id, row.frame)),
                bytes(8 * len(STAMPED_FIELDS[READING_TYPES[row.unit][0]]) - 8),  # zeros
                TRUTH.index(row.sees),
            )
            for row in parameters.sensors
        ]
        self._columns = ','.join(trace_columns(parameters))
        self._joint_name = parameters.sim.joint_name
        rate_hz = parameters.sim.joint_states_rate
        self._joint_period_ns = round(NS_PER_S / rate_hz) if rate_hz else 0
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
        readings = output.readings
        for event in output.events if is_heard('event') else ():
            yield pack_event(event, time_origin_ns)
        blocks = max(1, len(readings.trace) // self._samples)  # an update may hold several blocks
        first = len(readings.trace) - 1 - (blocks - 1) * self._samples
        period_ns, time_ns = self._joint_period_ns, readings.time_ns - blocks * self._block_ns
        for last in readings.trace[first :: self._samples].tolist():
            before_ns, time_ns = time_ns, time_ns + self._block_ns
            stamp_ns = time_origin_ns + time_ns
            stamp = pack_stamp(stamp_ns)
            for at, (key, frame, zeros, _) in enumerate(self._sensors, FIRST_READING):
                if is_heard(key):
                    yield Packed(key, time_ns, stamp + frame + pack_number(last[at]) + zeros)
            for key, frame, zeros, sees in self._sensors if self._tells_truth else ():
                packed = stamp + frame + pack_number(readings.truth[sees]) + zeros
                yield Packed(f'truth/{key}', time_ns, packed)
            if period_ns and time_ns // period_ns > before_ns // period_ns:
                joint = self._joint_after(time_ns, *last[FIRST_READING : FIRST_READING + 2])
                if is_heard('joint_states'):
                    message = JointMessage(stamp_ns, self._stage, (self._joint_name,), *joint)
                    yield Packed('joint_states', time_ns, pack_joints(message))
        self.pending.append(readings.trace)
        if readings.time_ns % self._period_ns == 0:
            stamp_ns, volts = time_origin_ns + readings.time_ns, (readings.voltage_v, 0.0, 0.0)
            if is_heard('voltage'):
                packed = pack_stamped(stamp_ns, self._stage, volts)
                yield Packed('voltage', readings.time_ns, packed)
            if is_heard('trace'):
                labels = f'sample; time_origin_ns={time_origin_ns}', self._columns
                table = pack_float64_array(np.concatenate(self.pending), labels)
                yield Packed('trace', readings.time_ns, table)
            self.pending.clear()
        if output.status != self.status:
            self.status = output.status
            yield Packed('status', readings.time_ns, pack_uint32(int(output.status)))

    def _joint_after(
        self, time_ns: int, position_m: float, force_n: float
    ) -> tuple[tuple[float], ...]:
        """Return position, mean velocity since the last joint message, and force."""
        before_ns, before_m = self.joint
        self.joint = time_ns, position_m
        velocity_m_per_s = (position_m - before_m) / ((time_ns - before_ns) * NANO)
        return (position_m,), (velocity_m_per_s,), (force_n,)
