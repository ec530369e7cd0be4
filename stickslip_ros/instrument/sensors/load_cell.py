"""
The load cell, from the true force in its spring to the reading.

In this order: hysteresis and own resonance of the mechanics, white noise of bridge and amplifier,
low-pass of the electronics, drift of the zero, faults, saturation, tare, quantisation.
docs/sensors.md has the formulas.

"""

import math
from collections.abc import Mapping
from typing import ClassVar

from stickslip_ros.contact.kernel import entry_point
from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.record import FLAG, FLOAT, Record, kind, record
from stickslip_ros.instrument.reports import Status
from stickslip_ros.instrument.sensors.reader import Reader
from stickslip_ros.instrument.sensors.signal_chain import (
    LOOP,
    PLAYS,
    SWING,
    displayed,
    follow,
    loop_of,
    low_pass_gain,
    sensor_kind,
    swing,
    swing_of,
)
from stickslip_ros.parameters import LoadCellParameters

CELL = kind(
    loop=LOOP,  # Its hysteresis
    noise_n=FLOAT,  # Standard deviation of the white noise of one sample
    gain=FLOAT,  # Share of the way that the low-pass goes to its input in one sample
    swing=SWING,  # Its own resonance
    swings=FLAG,  # Whether it has one
    drift_n=FLOAT,  # Drift of the zero in one sample
    limit_n=FLOAT,  # Force at which it saturates; inf is none
    resolution_n=FLOAT,  # Quantisation step; 0 is none
)
STRAIN = kind(
    strain_n=FLOAT,  # Output of the resonance
    speed_n=FLOAT,  # How fast it changes, in the unit of SWING
    level_n=FLOAT,  # Output of the low-pass
    overrange=FLAG,  # Whether a sample of the last block reached the limit
    plays_n=(FLOAT, (PLAYS,)),  # Plays of the hysteresis
)
"""State of a load cell between two samples of the trace."""


class LoadCell(Reader):
    """The load cell."""

    KIND = sensor_kind(CELL, STRAIN)
    ALARMS: ClassVar[Mapping[str, int]] = {'overrange': int(Status.FORCE_OVERRANGE)}

    @staticmethod
    def constants_of(setting: LoadCellParameters, rate_hz: float) -> Record:
        """Return what it is by its parameters, a record of CELL."""
        return record(
            CELL,
            loop=loop_of(setting.hysteresis, setting.range),
            noise_n=setting.noise_density * math.sqrt(rate_hz / 2.0),
            gain=low_pass_gain(setting.bandwidth, rate_hz),
            swing=swing_of(setting.resonance, setting.damping_ratio, rate_hz),
            swings=setting.resonance > 0.0,
            drift_n=setting.drift / rate_hz,
            limit_n=setting.range if setting.range > 0.0 else math.inf,
            resolution_n=setting.resolution,
        )

    def read(self, trace: Array) -> None:
        """Write its readings into its column of a trace."""
        noise = self.noise.take(len(trace))
        read_forces(self.record, trace, self.sees, self.column, noise)


@entry_point
def read_forces(sensors: Record, trace: Array, sees: int, column: int, noise: Array) -> None:
    """Write the readings of a block, N, with unit noise, shape (samples,)."""
    sensor = sensors[0]
    cell, fault, memory = sensor.constants, sensor.fault, sensor.memory
    strain = memory.own
    strain.overrange = False
    for i in range(len(trace)):
        memory.samples += 1
        force_n = trace[i, sees]
        if cell.loop.weight > 0.0:
            force_n = follow(cell.loop, strain.plays_n, force_n)
        if cell.swings:
            force_n, strain.speed_n = swing(cell.swing, strain.strain_n, strain.speed_n, force_n)
            strain.strain_n = force_n
        strain.level_n += cell.gain * (force_n + cell.noise_n * noise[i] - strain.level_n)
        sensed_n = strain.level_n + cell.drift_n * memory.samples + fault.offset
        if abs(sensed_n) >= cell.limit_n:
            sensed_n = math.copysign(cell.limit_n, sensed_n)
            strain.overrange = True
        trace[i, column] = displayed(fault, memory, sensed_n, cell.resolution_n)
