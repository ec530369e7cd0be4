# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The laser interferometer, from the true position of the runner to the reading.

Its stages are loss of the beam, cyclic error, drift of the zero, white noise, low-pass, sampling,
latency, faults, zero, and quantisation. docs/explanation/sensors.md has the formulas.

"""

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.instrument.reports import Status
from stickslip_ros.instrument.sensors.reader import Noise, Reader
from stickslip_ros.instrument.sensors.signal_chain import (
    DROPPED_OUT,
    display_value,
    filter_value,
    sensor_kind,
)
from stickslip_ros.instrument.state_tree import ANY_FLOAT, refusal
from stickslip_ros.kernels.kernel import entry_point, kernel, with_types_kept
from stickslip_ros.kernels.record import FLAG, FLOAT, Record
from stickslip_ros.parameters import InterferometerParameters

SENSOR_PRESENT, IS_REFERENCED = int(Status.SENSOR_PRESENT), int(Status.IS_REFERENCED)
DRIFT_STREAM = 1
"""Number of the random walk's stream, separate from the white noise of the sensor."""
ON_TIME = 1e-9
"""Rounding of the time of a sample, relative to its period."""


class Interferometer(
    Reader, past_m=(FLOAT, (-1,)), walk=Noise, is_referenced=bool, position_m=ANY_FLOAT
):
    """Counts fringes: it knows no absolute position, and a lost beam stays lost until zeroed."""

    is_referenced: bool  # Whether the zero was set
    _last_m: Array  # Readings of the last block
    KIND = sensor_kind(
        {
            'truth_m': FLOAT,  # True position at the last sample; NaN before the first
            'lost': FLAG,  # Whether the beam is lost
            'wandered_m': FLOAT,  # Random drift of the zero so far
            'counted_m': FLOAT,  # Output of the low-pass; after a loss of the beam the last one
            'sample': FLOAT,  # Number of the held sample; sample 0 is at rest
            'held_m': FLOAT,  # Value of the held sample
        },
        step_max_m=FLOAT,  # Largest countable way in a trace sample; inf: no limit
        cyclic_error_m=FLOAT,  # Amplitude of the cyclic error
        fringe_rad_per_m=FLOAT,  # Phase of the cyclic error per distance
        drift_m=FLOAT,  # Steady drift of the zero in a trace sample
        walk_m=FLOAT,  # Random drift of the zero in a trace sample, rms
        period=FLOAT,  # Period of its samples in trace samples; 0: the trace rate
        lag=FLOAT,  # Latency in trace samples
    )
    ALARMS: ClassVar[Mapping[str, int]] = {'lost': int(Status.BEAM_LOST)}

    @staticmethod
    def constants_of(setting: InterferometerParameters, rate_hz: float) -> Mapping[str, Any]:
        """Return limit, cyclic error, drift and times."""
        return {
            'step_max_m': setting.velocity_max / rate_hz if setting.velocity_max else math.inf,
            'cyclic_error_m': setting.cyclic_error,
            'fringe_rad_per_m': 4.0 * math.pi / setting.wavelength,
            'drift_m': setting.drift / rate_hz,
            'walk_m': setting.random_walk / math.sqrt(rate_hz),
            'period': rate_hz / setting.sample_rate if setting.sample_rate else 0.0,
            'lag': setting.latency * rate_hz,
        }

    def reset(self) -> None:
        """Return to the start: rest at zero, a beam, and the same noise again."""
        super().reset()
        self.memory['truth_m'] = math.nan
        self._is_lost = self.memory['lost']
        self._condition = self.record['fault']['condition']
        self.past_m = np.zeros(math.ceil(self.record[0].lag) + 3)
        self.walk = Noise((*self.seed, DRIFT_STREAM))
        self._wanders = bool(self.record[0].walk_m > 0.0)
        self.is_referenced = False
        self._last_m = np.zeros(1)

    def recall(self, values: dict[str, Any]) -> None:
        if len(values['past_m']) != len(self.past_m):
            expected = f'{len(self.past_m)} numbers, as long as interferometer.latency'
            raise refusal(
                'checkpoint.sensing.interferometer.past_m', len(values['past_m']), expected
            )
        super().recall(values)
        self.walk.recall(values['walk'])
        self.past_m, self.is_referenced = values['past_m'], values['is_referenced']
        self._last_m = np.array([values['position_m']])

    def zero(self) -> None:
        """Make the present reading 0; after a loss of the beam, counting starts again."""
        memory = self.record[0].memory
        if memory.lost:
            self.past_m.fill(memory.level)
            memory.lost = False
            memory.counted_m = memory.held_m = memory.level
            memory.standing = memory.level + self.record[0].fault.offset
        super().zero()
        self.is_referenced = True
        self._last_m = np.zeros(1)

    def read(self, trace: Array) -> None:
        noise = self.noise.take(len(trace))
        walk = self.walk.take(len(trace)) if self._wanders else noise
        read_positions(self.record, self.past_m, trace, self.sees, self.column, noise, walk)

    def keep(self, block: Array) -> None:
        """Keep the readings of a block, the last of a trace."""
        self._last_m = block[:, self.column]

    @property
    def position_m(self) -> float:
        """Mean reading of the last block; NaN without a reading."""
        mean_m = float(np.add.reduce(self._last_m)) / len(self._last_m)
        return math.nan if self._is_lost.item() else mean_m

    @property
    def may_alarm(self) -> bool:
        """Whether its beam can be lost."""
        return bool(self.record[0].step_max_m < math.inf)

    @property
    def status_bits(self) -> int:
        is_present = not (self._is_lost.item() or self._condition.item() == DROPPED_OUT)
        bits = SENSOR_PRESENT * is_present | IS_REFERENCED * self.is_referenced
        return bits | super().status_bits


@with_types_kept
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

    ``past_m`` is a ring of the latest counts, as long as the latency. ``noise`` and ``walk``,
    shape (samples,), are unit noise of readings and random drift.

    """
    optics = sensors[0]
    beam = optics.memory
    for i in range(len(trace)):
        beam.samples += 1
        number = beam.samples
        _count(optics, trace[i, sees], noise[i], walk[i])
        past_m[number % len(past_m)] = beam.counted_m
        time = number - optics.lag
        if optics.period > 0.0:
            newest = math.floor(time / optics.period + ON_TIME)
            if newest > beam.sample:
                beam.sample = float(newest)
                beam.held_m = _count_at(past_m, min(beam.sample * optics.period, time))
        else:
            beam.held_m = _count_at(past_m, time)
        trace[i, column] = display_value(optics, beam.held_m + optics.fault.offset)


@kernel
def _count(optics: Record, truth_m: float, noise: float, walk: float) -> None:
    beam = optics.memory
    if abs(truth_m - beam.truth_m) > optics.step_max_m:
        beam.lost = True
    beam.truth_m = truth_m
    beam.wandered_m += optics.walk_m * walk
    seen_m = truth_m + (optics.drift_m * beam.samples + beam.wandered_m)
    if optics.cyclic_error_m > 0.0:
        seen_m += optics.cyclic_error_m * math.sin(optics.fringe_rad_per_m * truth_m)
    level_m = filter_value(optics, seen_m, noise)
    if not beam.lost:
        beam.counted_m = level_m


@kernel
def _count_at(past_m: Array, time: float) -> float:
    """Return the count at a time in trace samples, interpolated linearly."""
    before = math.floor(time)
    share = time - before
    count_m = past_m[int(before) % len(past_m)]
    if share > 0.0:
        count_m += share * (past_m[(int(before) + 1) % len(past_m)] - count_m)
    return float(count_m)
