"""
The capacitive probe, from the mean displacement of the feet to the reading.

In this order: white noise, low-pass of the electronics, faults, quantisation.

"""

import math

from stickslip_ros.contact.kernel import entry_point
from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.record import FLOAT, Record, kind, record
from stickslip_ros.instrument.sensors.reader import Reader
from stickslip_ros.instrument.sensors.signal_chain import displayed, low_pass_gain, sensor_kind
from stickslip_ros.parameters.sensors import CapacitiveProbeParameters

GAUGE = kind(
    noise_m=FLOAT,  # Standard deviation of the white noise of one sample
    gain=FLOAT,  # Share of the way that the low-pass goes to its input in one sample
    resolution_m=FLOAT,  # Quantisation step; 0 is none
)
GAP = kind(level_m=FLOAT)  # Output of the low-pass


class CapacitiveProbe(Reader):
    """The capacitive probe."""

    KIND = sensor_kind(GAUGE, GAP)

    @staticmethod
    def constants_of(setting: CapacitiveProbeParameters, rate_hz: float) -> Record:
        """Return what it is by its parameters, a record of GAUGE."""
        return record(
            GAUGE,
            noise_m=setting.noise_density * math.sqrt(rate_hz / 2.0),
            gain=low_pass_gain(setting.bandwidth, rate_hz),
            resolution_m=setting.resolution,
        )

    def read(self, trace: Array) -> None:
        """Write its readings into its column of a trace."""
        noise = self.noise.take(len(trace))
        read_foot_positions(self.record, trace, self.sees, self.column, noise)


@entry_point
def read_foot_positions(
    sensors: Record, trace: Array, sees: int, column: int, noise: Array
) -> None:
    """Write the readings of a block, m, with unit noise, shape (samples,)."""
    sensor = sensors[0]
    gauge, memory = sensor.constants, sensor.memory
    gap = memory.own
    for i in range(len(trace)):
        memory.samples += 1
        seen_m = trace[i, sees] + gauge.noise_m * noise[i]
        gap.level_m += gauge.gain * (seen_m - gap.level_m)
        sensed_m = gap.level_m + sensor.fault.offset
        trace[i, column] = displayed(sensor.fault, memory, sensed_m, gauge.resolution_m)
