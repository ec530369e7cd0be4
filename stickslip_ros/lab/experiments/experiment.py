# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""An experiment: settings of a stand, its drive, the readings and their errors."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from stickslip_ros.arrays import Array
from stickslip_ros.drive.layout import STANDARD_GRAVITY_M_PER_S2
from stickslip_ros.errors import OutOfRange
from stickslip_ros.lab.experiments.friction_loop import LoopRow
from stickslip_ros.lab.experiments.sensor import KnownSensor, noise_of
from stickslip_ros.parameters import Parameters, Scalar
from stickslip_ros.units import unit_of

OF_TRACES = ('position_m', 'force_n', 'foot_position_m')
"""Quantities that may be measured over time."""
AVERAGED_S = 1e-5
"""Time over which fast readings are averaged; the mean reduces 10 kHz by 2 %."""


class SawtoothSteps(NamedTuple):
    """A saw-tooth from rest, with numbers read at its end."""

    amplitude_m: float  # stroke of the feet; 0 with a voltage
    frequency_hz: float  # steps per second, below 0 backwards
    steps: int = 0  # before the numbers are read; 0: until they are steady
    is_steady: bool = True  # whether the numbers were steady when read
    voltage_v: float = 0.0  # peak to peak, in place of the stroke


class ZeroAmplitudeRuns(NamedTuple):
    """Saw-teeth of many strokes without a load cell; their step lengths give the 0-amplitude."""

    frequency_hz: float
    steps: int = 120  # per stroke


class VoltageStep(NamedTuple):
    """A downward step of the voltage from rest; the runner rings after it."""

    amplitude_m: float  # stroke of the feet; below about 0.1 nm nothing slips
    voltage_v: float = 0.0  # in place of the stroke


class AtRest(NamedTuple):
    """No drive: numbers that are constants of the stand."""


def stroke_m(drive: SawtoothSteps | VoltageStep, stand: Parameters) -> float:
    """Return the stroke of the feet, m; refuse a voltage above the amplifier's range."""
    range_v = stand.amplifier.range_v
    if drive.voltage_v > range_v:
        limit = f'above the {range_v:g} V that the amplifier gives'
        hint = 'raise amplifier.voltage_max, or leave the row out'
        raise OutOfRange('voltage_v', drive.voltage_v, 'V', limit, hint)
    return drive.amplitude_m or drive.voltage_v * stand.actuator.gain


@dataclass(frozen=True, eq=False)
class Voltage:
    """The voltage at the amplifier's input over time, from rest."""

    rows: Array  # corners: times from 0 on, s, and voltages, V, shape (n, 2)
    notes: tuple[str, ...] = ()  # its origin, and the waves recognised in it
    begins_s: float = 0.0  # time of the first corner in the clock of the recording

    @property
    def lasts_s(self) -> float:
        """Time to the last corner."""
        return float(self.rows[-1, 0])


Excitation: TypeAlias = (
    SawtoothSteps | ZeroAmplitudeRuns | VoltageStep | AtRest | LoopRow | Voltage
)
"""``Voltage`` gives quantities over time, the others give numbers."""


@dataclass(frozen=True, eq=False)
class Readout:
    """A measured quantity: a trace over time, or one number."""

    quantity: str  # of OF_TRACES or NUMBERS
    values: Array  # SI units, shape (n,); a number has shape (1,)
    # times since the voltage began, rising, shape (n,); empty for a number
    time_s: Array = field(default_factory=lambda: np.empty(0))
    sigma: float | None = None  # standard error of a value; None: unknown
    left_out: int = 0  # outliers that were dropped
    sensor: KnownSensor = field(default_factory=KnownSensor)

    @property
    def is_trace(self) -> bool:
        """Whether it is a quantity over time."""
        return len(self.time_s) > 0

    @property
    def is_bare(self) -> bool:
        """Whether it is a number whose standard error must be estimated from residuals."""
        return self.sigma is None and not self.is_trace

    @property
    def unit(self) -> str:
        """Unit of the values."""
        return unit_of(self.quantity)

    @property
    def noise(self) -> float:
        """
        Standard error of a value: as given, else from the median of second differences.

        The median shows noise and rounding if the motion is smooth over most of the samples.

        """
        return noise_of(self.values) if self.sigma is None else self.sigma

    @property
    def apart_s(self) -> float:
        """Median time between readings."""
        return float(np.median(np.diff(self.time_s)))

    def sensed(self, **known: float) -> 'Readout':
        """Return the readings with other fields of the sensor."""
        return replace(self, sensor=replace(self.sensor, **known))

    def without(self, dropped: NDArray[np.bool_]) -> 'Readout':
        """Return the readings without those in a mask, shape (n,); count them as left out."""
        count, kept = self.left_out + int(dropped.sum()), ~dropped
        return replace(self, values=self.values[kept], time_s=self.time_s[kept], left_out=count)

    def averaged(self, most: int = 1) -> 'Readout':
        """Return means of neighbours within AVERAGED_S, but at least ``most`` of them."""
        if not self.is_trace:
            return self
        size = min(int(AVERAGED_S / self.apart_s), math.ceil(len(self.values) / most))
        if size < 2:
            return self
        whole = len(self.values) // size * size
        blocks = (each[:whole].reshape(-1, size) for each in (self.values, self.time_s))
        values, time_s = (each.mean(axis=1) for each in blocks)
        sigma = None if self.sigma is None else self.sigma / math.sqrt(size)
        return replace(self, values=values, time_s=time_s, sigma=sigma)

    def thinned(self, most: int) -> 'Readout':
        """Return at most ``most`` readings: means over AVERAGED_S, then every nth mean."""
        fewer = self.averaged(most)
        every = math.ceil(len(fewer.values) / most)
        return replace(fewer, values=fewer.values[::every], time_s=fewer.time_s[::every])

    def within(self, origin: str, start_s: float, end_s: float) -> 'Readout':
        """Return the readings in a window; raise OutOfRange if fewer than three."""
        inside = (self.time_s >= start_s) & (self.time_s <= end_s)
        if inside.sum() < 3:
            limit = f'a window with {inside.sum()} samples of the {self.quantity} of {origin}, '
            limit += f'which goes from {self.time_s[0]:.6g} to {self.time_s[-1]:.6g} s'
            asked = f'{start_s:.6g} to {end_s:.6g}'
            raise OutOfRange('window', asked, 's', limit, 'move it, or lengthen it')
        return replace(self, time_s=self.time_s[inside], values=self.values[inside])


@dataclass(frozen=True, eq=False)
class Experiment:
    """An experiment on a stand: its settings, its drive and the readings."""

    origin: str  # a file, or a row of a table
    settings: Mapping[str, Scalar]  # parameters that replace those of the stand
    drive: Excitation
    # zero, drift, delay and low-pass of the sensor of a trace are unknown
    observed: tuple[Readout, ...]
    load_n: float = 0.0  # constant external force on the runner along +x
    notes: tuple[str, ...] = ()
    slope_deg: float = 0.0  # of the rail; above 0 the runner climbs towards +x

    def load_on(self, stand: Parameters) -> float:
        """Return the external force on the runner and its weight along the rail, N."""
        weight_n = stand.runner.mass * STANDARD_GRAVITY_M_PER_S2
        return self.load_n - weight_n * math.sin(math.radians(self.slope_deg))

    @property
    def lasts_s(self) -> float:
        """Time to the last corner or the last reading; 0 for drives other than ``Voltage``."""
        if not isinstance(self.drive, Voltage):
            return 0.0
        return max([self.drive.lasts_s, *(float(each.time_s[-1]) for each in self.observed)])

    def sensed(self, **known: float) -> 'Experiment':
        """Return the experiment with other fields of all its sensors."""
        return replace(self, observed=tuple(each.sensed(**known) for each in self.observed))

    def drifting(self, most_m_per_s: float) -> 'Experiment':
        """Return the experiment with the drift of its position sensors limited."""
        observed = (
            each.sensed(drift_per_s=min(each.sensor.drift_per_s, most_m_per_s))
            if each.unit == 'm'
            else each
            for each in self.observed
        )
        return replace(self, observed=tuple(observed))

    def within(self, start_s: float, end_s: float) -> 'Experiment':
        """Keep the readings in a window; the voltage is not cut."""
        observed = (
            each.within(self.origin, start_s, end_s) for each in self.observed if each.is_trace
        )
        return replace(self, observed=tuple(observed))
