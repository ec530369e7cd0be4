"""
The laser interferometer, from the true position of the runner to the reading.

In this order: loss of the beam, cyclic error, drift of the zero, white noise, low-pass, samples of
its own, latency, faults, zero, quantisation. docs/sensors.md has the formulas.

"""

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from stickslip_ros.contact.kernel import entry_point, kernel
from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.record import FLAG, FLOAT, Record, kind, record
from stickslip_ros.instrument.reports import Status
from stickslip_ros.instrument.sensors.reader import Noise, Reader
from stickslip_ros.instrument.sensors.signal_chain import displayed, low_pass_gain, sensor_kind
from stickslip_ros.instrument.state_tree import ANY_FLOAT, refusal
from stickslip_ros.parameters import InterferometerParameters

SENSOR_PRESENT, IS_REFERENCED = int(Status.SENSOR_PRESENT), int(Status.IS_REFERENCED)
DRIFT_STREAM = 1
"""Number of the random walk below the stream of the sensor: it leaves the white noise alone."""
ON_TIME = 1e-9
"""A sample of its own that is late by less than this share of its period is on time."""

OPTICS = kind(
    step_max_m=FLOAT,  # Longest way of the runner in one sample that can be counted; inf is any
    cyclic_error_m=FLOAT,  # Amplitude of the cyclic error
    fringe_rad_per_m=FLOAT,  # Its phase per distance
    drift_m=FLOAT,  # Steady drift of the zero in one sample
    walk_m=FLOAT,  # Random drift of the zero in one sample, rms
    noise_m=FLOAT,  # Standard deviation of the white noise of one sample
    gain=FLOAT,  # Share of the way that the low-pass goes to its input in one sample
    period=FLOAT,  # Samples of the trace between two of its own, 0 where it has none
    lag=FLOAT,  # Age of a reading in samples of the trace
    resolution_m=FLOAT,  # Quantisation step; 0 is none
)
BEAM = kind(
    truth_m=FLOAT,  # True position at the last sample; not a number before the first one
    lost=FLAG,  # Whether the beam was lost
    wandered_m=FLOAT,  # Random drift of the zero up to now
    level_m=FLOAT,  # Output of the low-pass
    counted_m=FLOAT,  # The same as long as the beam is there; after that the last count
    sample=FLOAT,  # Number of its own sample that is shown; from time 0, at which it saw rest
    held_m=FLOAT,  # Value of that sample
)
"""State of an interferometer between two samples of the trace."""


class Interferometer(
    Reader, past_m=(FLOAT, (-1,)), walk=Noise, is_referenced=bool, position_m=ANY_FLOAT
):
    """
    The interferometer.

    Attributes
    ----------
    is_referenced : bool
        Whether its zero was set.
    position_m : float
        Mean reading of the last block, m; not a number where there is none.

    """

    KIND = sensor_kind(OPTICS, BEAM)
    ALARMS: ClassVar[Mapping[str, int]] = {'lost': int(Status.BEAM_LOST)}

    @staticmethod
    def constants_of(setting: InterferometerParameters, rate_hz: float) -> Record:
        """Return what it is by its parameters, a record of OPTICS."""
        return record(
            OPTICS,
            step_max_m=setting.velocity_max / rate_hz if setting.velocity_max > 0.0 else math.inf,
            cyclic_error_m=setting.cyclic_error,
            fringe_rad_per_m=4.0 * math.pi / setting.wavelength,
            drift_m=setting.drift / rate_hz,
            walk_m=setting.random_walk / math.sqrt(rate_hz),
            noise_m=setting.noise_density * math.sqrt(rate_hz / 2.0),
            gain=low_pass_gain(setting.bandwidth, rate_hz),
            period=rate_hz / setting.sample_rate if setting.sample_rate > 0.0 else 0.0,
            lag=setting.latency * rate_hz,
            resolution_m=setting.resolution,
        )

    def reset(self) -> None:
        """Go back to the start: at rest at zero, the beam found, the same noise again."""
        super().reset()
        self.memory['own']['truth_m'] = math.nan
        self.past_m = np.zeros(math.ceil(self.record[0].constants.lag) + 3)
        self.walk = Noise((*self.seed, DRIFT_STREAM))
        self._wanders = bool(self.record[0].constants.walk_m > 0.0)
        self.is_referenced = False
        self.position_m = 0.0

    def recall(self, values: dict[str, Any]) -> None:
        """Remember what was read from a file."""
        if len(values['past_m']) != len(self.past_m):
            told = f'{len(self.past_m)} numbers, as long as interferometer.latency'
            raise refusal('checkpoint.sensing.interferometer.past_m', len(values['past_m']), told)
        super().recall(values)
        self.walk.recall(values['walk'])
        self.past_m, self.is_referenced = values['past_m'], values['is_referenced']
        self.position_m = values['position_m']

    def zero(self) -> None:
        """Make the present reading 0; a lost beam is found, the count starts anew."""
        sensor = self.record[0]
        memory, beam = sensor.memory, sensor.memory.own
        if beam.lost:
            self.past_m.fill(beam.level_m)
            beam.lost = False
            beam.counted_m = beam.held_m = beam.level_m
            memory.standing = beam.level_m + sensor.fault.offset
        super().zero()
        self.is_referenced = True
        self.position_m = 0.0

    def read(self, trace: Array) -> None:
        """Write its readings into its column of a trace."""
        noise = self.noise.take(len(trace))
        walk = self.walk.take(len(trace)) if self._wanders else noise
        read_positions(self.record, self.past_m, trace, self.sees, self.column, noise, walk)
        mean_m = float(np.add.reduce(trace[:, self.column])) / len(trace)
        self.position_m = math.nan if self.memory['own']['lost'].item() else mean_m

    @property
    def status_bits(self) -> int:
        """Bits of Status that it sets."""
        present = SENSOR_PRESENT * (not math.isnan(self.position_m))
        return present | IS_REFERENCED * self.is_referenced | super().status_bits


@entry_point
def read_positions(
    sensors: Record,
    past_m: Array,
    trace: Array,
    sees: int,
    column: int,
    noise: Array,
    walk: Array,
) -> None:
    """
    Write the readings of a block, m.

    Parameters
    ----------
    sensors : array of one record of an interferometer
        Its memory is changed.
    past_m : array
        Ring of the latest counts, as long as the latency; changed in place.
    trace : array, shape (samples, columns)
        One column is the true position, one receives the readings.
    sees, column : int
        Which ones.
    noise, walk : array, shape (samples,)
        Unit noise of the readings, and of the random drift.

    """
    sensor = sensors[0]
    optics, fault, memory = sensor.constants, sensor.fault, sensor.memory
    beam = memory.own
    for i in range(len(trace)):
        memory.samples += 1
        number = memory.samples
        _count(optics, beam, number, trace[i, sees], noise[i], walk[i])
        past_m[number % len(past_m)] = beam.counted_m
        time = number - optics.lag
        if optics.period > 0.0:
            newest = math.floor(time / optics.period + ON_TIME)
            if newest > beam.sample:
                beam.sample = float(newest)
                beam.held_m = _remembered(past_m, min(beam.sample * optics.period, time))
        else:
            beam.held_m = _remembered(past_m, time)
        sensed_m = beam.held_m + fault.offset
        trace[i, column] = displayed(fault, memory, sensed_m, optics.resolution_m)


@kernel
def _count(
    optics: Record, beam: Record, number: int, truth_m: float, noise: float, walk: float
) -> None:
    """Advance from the light to the count."""
    if abs(truth_m - beam.truth_m) > optics.step_max_m:
        beam.lost = True
    beam.truth_m = truth_m
    beam.wandered_m += optics.walk_m * walk
    seen_m = truth_m + (optics.drift_m * number + beam.wandered_m)
    if optics.cyclic_error_m > 0.0:
        seen_m += optics.cyclic_error_m * math.sin(optics.fringe_rad_per_m * truth_m)
    beam.level_m += optics.gain * (seen_m + optics.noise_m * noise - beam.level_m)
    if not beam.lost:
        beam.counted_m = beam.level_m


@kernel
def _remembered(past_m: Array, time: float) -> float:
    """Return the count at a time, in samples of the trace: linear between two of them."""
    before = math.floor(time)
    share = time - before
    count_m = past_m[int(before) % len(past_m)]
    if share > 0.0:
        count_m += share * (past_m[(int(before) + 1) % len(past_m)] - count_m)
    return float(count_m)
