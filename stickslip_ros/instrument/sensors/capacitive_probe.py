# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The capacitive probe, from the mean displacement of the feet to the reading.

Its stages are white noise, low-pass of the electronics, faults, and quantisation.

"""

from stickslip_ros.arrays import Array
from stickslip_ros.instrument.sensors.reader import Reader
from stickslip_ros.instrument.sensors.signal_chain import display_value, filter_value, sensor_kind
from stickslip_ros.kernels.kernel import entry_point, with_types_kept
from stickslip_ros.kernels.record import Record


@with_types_kept
@entry_point
def read_foot_positions(
    sensors: Record, trace: Array, sees: int, column: int, noise: Array
) -> None:
    """Write the readings of a block, m, with unit noise, shape (samples,)."""
    probe = sensors[0]
    for i in range(len(trace)):
        probe.memory.samples += 1
        level_m = filter_value(probe, trace[i, sees], noise[i])
        trace[i, column] = display_value(probe, level_m + probe.fault.offset)


class CapacitiveProbe(Reader):
    """Reads the feet by noise and low-pass alone: the least that a sensor is."""

    KIND = sensor_kind({})
    KERNEL = staticmethod(read_foot_positions)
