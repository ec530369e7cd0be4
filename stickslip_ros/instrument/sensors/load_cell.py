# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The load cell, from the true force in its spring to the reading.

Its stages are hysteresis of the mechanics, white noise of bridge and amplifier, low-pass of the
electronics, drift of the zero, faults, saturation, tare, and quantisation.
docs/explanation/sensors.md has the formulas.

"""

import math
from collections.abc import Mapping
from typing import Any, ClassVar

from stickslip_ros.arrays import Array
from stickslip_ros.instrument.reports import Status
from stickslip_ros.instrument.sensors.reader import Reader
from stickslip_ros.instrument.sensors.signal_chain import (
    LOOP,
    PLAYS,
    display_value,
    filter_value,
    follow_loop,
    loop_of,
    sensor_kind,
)
from stickslip_ros.kernels.kernel import entry_point, with_types_kept
from stickslip_ros.kernels.record import FLAG, FLOAT, Record
from stickslip_ros.parameters import LoadCellParameters


@with_types_kept
@entry_point
def read_forces(sensors: Record, trace: Array, sees: int, column: int, noise: Array) -> None:
    """Write the readings of a block, N, with unit noise, shape (samples,)."""
    cell = sensors[0]
    memory = cell.memory
    memory.overrange = False
    for i in range(len(trace)):
        memory.samples += 1
        force_n = trace[i, sees]
        if cell.loop.weight > 0.0:
            force_n = follow_loop(cell.loop, memory.plays_n, force_n)
        level_n = filter_value(cell, force_n, noise[i])
        sensed_n = level_n + cell.drift_n * memory.samples + cell.fault.offset
        if abs(sensed_n) >= cell.limit_n:
            sensed_n = math.copysign(cell.limit_n, sensed_n)
            memory.overrange = True
        trace[i, column] = display_value(cell, sensed_n)


class LoadCell(Reader):
    """Reads the force in its spring; hysteresis and saturation come before the tare."""

    KIND = sensor_kind(
        {
            'overrange': FLAG,  # Whether a sample of the last block reached the limit
            'plays_n': (FLOAT, (PLAYS,)),  # Plays of the hysteresis
        },
        loop=LOOP,  # Hysteresis
        drift_n=FLOAT,  # Drift of the zero in a sample
        limit_n=FLOAT,  # Force at saturation; inf: none
    )
    KERNEL = staticmethod(read_forces)
    ALARMS: ClassVar[Mapping[str, int]] = {'overrange': int(Status.FORCE_OVERRANGE)}

    @property
    def may_alarm(self) -> bool:
        """Whether it has a range."""
        return bool(self.record[0].limit_n < math.inf)

    @staticmethod
    def constants_of(setting: LoadCellParameters, rate_hz: float) -> Mapping[str, Any]:
        """Return hysteresis, drift and range."""
        return {
            'loop': loop_of(setting.hysteresis, setting.range),
            'drift_n': setting.drift / rate_hz,
            'limit_n': setting.range if setting.range > 0.0 else math.inf,
        }
