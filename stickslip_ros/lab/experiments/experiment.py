# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""An experiment: settings of a stand, its drive, the readings and their errors."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple, TypeAlias

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.errors import OutOfRange, WrongKind
from stickslip_ros.lab.tables.numbers import NUMBERS
from stickslip_ros.parameters import Parameters, Scalar
from stickslip_ros.units import unit_of

OF_TRACES = ('position_m', 'force_n', 'foot_position_m')
"""Quantities that may be measured over time."""
NOISE_FACTOR = 1.4826 / math.sqrt(6.0)
"""Standard deviation of noise per median of its absolute second differences."""
_WHITE_CORRELATION = -2.0 / 3.0  # of neighbouring second differences of white noise
_SAME = 1e-12  # share of the largest reading by which equal readings may differ
_FINEST = 1e-6  # least rounding, as a share of the range of the readings
_WITHIN_MIN = 2  # a window needs more readings
_ROUNDING = 1.0 / math.sqrt(12.0)
"""Standard deviation of rounding, as a share of the smallest step of the readings."""


class SawtoothSteps(NamedTuple):
    """A saw-tooth from rest, with numbers read at its end."""

    amplitude_m: float  # stroke of the feet; 0 with a voltage
    frequency_hz: float  # steps per second, below 0 backwards
    steps: int = 0  # before the reading; 0: until the numbers are steady
    is_steady: bool = True  # whether the numbers were steady when read
    voltage_v: float = 0.0  # peak to peak, in place of the stroke


class ZeroAmplitudeRuns(NamedTuple):
    """Saw-teeth of many strokes without a load cell; their step lengths give the 0-amplitude."""

    frequency_hz: float
    steps: int = 120  # of each


class VoltageStep(NamedTuple):
    """A downward step of the voltage from rest; the runner rings after it."""

    amplitude_m: float  # stroke of the feet; below about 0.1 nm nothing slips
    voltage_v: float = 0.0  # in place of the stroke


class AtRest(NamedTuple):
    """No drive: constants of the stand."""


def stroke_m(drive: SawtoothSteps | VoltageStep, stand: Parameters) -> float:
    """Return the stroke of the feet of a stand, m; refuse a voltage that it cannot give."""
    amplifier = stand.amplifier
    range_v = amplifier.voltage_max - amplifier.voltage_min
    if drive.voltage_v > range_v:
        limit = f'above the {range_v:g} V that the amplifier gives'
        hint = 'raise amplifier.voltage_max, or leave the row out'
        raise OutOfRange('voltage_v', drive.voltage_v, 'V', limit, hint)
    return drive.amplitude_m or drive.voltage_v * stand.actuator.gain


@dataclass(frozen=True, eq=False)
class Voltage:
    """The voltage at the amplifier's input over time; before it the stand rests."""

    rows: Array  # corners: times from 0 on, s, and voltages, V, shape (n, 2)
    notes: tuple[str, ...] = ()  # its origin, and the waves recognised in it
    begins_s: float = 0.0  # first corner in the clock of the recording

    @property
    def lasts_s(self) -> float:
        """Time to the last corner."""
        return float(self.rows[-1, 0])


Drive: TypeAlias = SawtoothSteps | ZeroAmplitudeRuns | VoltageStep | AtRest | Voltage
_DRIVES = {'steps': SawtoothSteps, 'zero': ZeroAmplitudeRuns, 'ring': VoltageStep, 'rest': AtRest}
QUANTITIES: Mapping[type[Drive], tuple[str, ...]] = {
    **{
        kind: tuple(name for name, each in NUMBERS.items() if each.drive == drive)
        for drive, kind in _DRIVES.items()
    },
    Voltage: OF_TRACES,
}
"""Quantities by drive: a voltage gives quantities over time, all others give numbers."""


@dataclass(frozen=True, eq=False)
class Seen:
    """A measured quantity: a trace over time, or one number."""

    quantity: str  # of QUANTITIES
    values: Array  # SI units, shape (n,); a number has shape (1,)
    # times since the voltage began, rising, shape (n,); a number has none
    time_s: Array = field(default_factory=lambda: np.empty(0))
    sigma: float | None = None  # standard error of a value; None: unknown
    left_out: int = 0  # outliers that were dropped
    slow_s: float = 0.0  # time constant of the sensor's first-order low-pass; 0: none
    # largest drift of the zero, units of the values per second; with inf a uniform motion is lost
    drift_per_s: float = math.inf
    noise_lasts_s: float = 0.0  # correlation time of the noise; 0: white
    low_pass_hz: float = 0.0  # sensor low-pass that was undone; 0: none
    cyclic_m: float = 0.0  # largest cyclic error of an interferometer; 0: none
    fringe_m: float = 0.0  # motion from one fringe to the next

    @property
    def is_trace(self) -> bool:
        """Whether it is a quantity over time."""
        return len(self.time_s) > 0

    @property
    def unit(self) -> str:
        """Unit of the values."""
        return unit_of(self.quantity)

    @property
    def noise(self) -> float:
        """
        Standard error of a value: as given, else from the second differences.

        Their median shows noise and rounding if the motion is smooth over most of the samples.

        """
        return noise_of(self.values) if self.sigma is None else self.sigma

    def within(self, origin: str, start_s: float, end_s: float) -> 'Seen':
        """Return the readings of a window; refuse a window with too few."""
        inside = (self.time_s >= start_s) & (self.time_s <= end_s)
        if inside.sum() <= _WITHIN_MIN:
            limit = f'a window with {inside.sum()} samples of the {self.quantity} of {origin}, '
            limit += f'which goes from {self.time_s[0]:.6g} to {self.time_s[-1]:.6g} s'
            asked = f'{start_s:.6g} to {end_s:.6g}'
            raise OutOfRange('window', asked, 's', limit, 'move it, or lengthen it')
        return replace(self, time_s=self.time_s[inside], values=self.values[inside])


@dataclass(frozen=True, eq=False)
class Experiment:
    """An experiment on a stand: its settings, its drive and the readings."""

    origin: str  # a file, or a row of a table
    settings: Mapping[str, Scalar]  # parameters set for it, whatever the stand is
    drive: Drive
    seen: tuple[Seen, ...]  # zero, drift, delay and low-pass of the sensor of a trace are unknown
    load_n: float = 0.0  # constant external force on the runner along +x
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Refuse quantities that do not belong to the drive."""
        known = QUANTITIES[type(self.drive)]
        for each in self.seen:
            if each.quantity not in known:
                what, wanted = f'quantity of {self.origin}', f'one of {", ".join(known)}'
                raise WrongKind(what, each.quantity, wanted, 'leave it out')
            if each.is_trace != isinstance(self.drive, Voltage):
                hint = 'give values over time for a voltage, else one number'
                what = f'{each.quantity} of {self.origin}'
                raise WrongKind(what, len(each.time_s), 'the number of times of its drive', hint)

    @property
    def end_s(self) -> float:
        """Time of the last sample."""
        return max((float(each.time_s[-1]) for each in self.seen if each.is_trace), default=0.0)

    @property
    def lasts_s(self) -> float:
        """Length of a run, to the last corner and the last reading; 0 for steps."""
        return max(self.drive.lasts_s, self.end_s) if isinstance(self.drive, Voltage) else 0.0

    def within(self, start_s: float, end_s: float) -> 'Experiment':
        """Return the readings of a window; the drive still begins where it began."""
        seen = (each.within(self.origin, start_s, end_s) for each in self.seen if each.is_trace)
        return replace(self, seen=tuple(seen))


def keeps_noise(values: Array, share: float, rounding: float = 0.0) -> bool:
    """
    Return whether the noise of each value has a share of the noise of the value before.

    Neighbouring second differences of white noise have the correlation -2/3; behind a low-pass
    that keeps the share a, (a^2 - 3a + 4)/(2a - 6), which goes to -1/2. Medians estimate it, as
    the motion is not smooth everywhere. ``rounding`` is that of ``noise_of``.

    """
    second = np.diff(values, 2)
    rounding = rounding or rounding_of(values)
    sums, differences = (
        _middle_size(each, rounding) ** 2
        for each in (second[1:] + second[:-1], second[1:] - second[:-1])
    )
    if not sums + differences > 0.0:
        return False
    correlation = float((sums - differences) / (sums + differences))
    behind = (share**2 - 3.0 * share + 4.0) / (2.0 * share - 6.0)
    return correlation > 0.5 * (_WHITE_CORRELATION + behind)


def noise_of(values: Array, keeps: float = 0.0, rounding: float = 0.0) -> float:
    """
    Return the standard deviation of noise in values, at least that of their rounding.

    ``keeps`` is the share of its noise that each value has from the value before; 0: white.
    ``rounding`` is that of the readings of which the values are residuals; 0: of the values.

    """
    if len(values) < 5:
        return 0.0
    rounding = rounding or rounding_of(values)
    white = NOISE_FACTOR * _middle_size(np.diff(values, 2), rounding)
    of_white = math.sqrt(6.0 / (6.0 - 8.0 * keeps + 2.0 * keeps**2))
    return max(of_white * white, rounding)


def _middle_size(changes: Array, rounding: float) -> float:
    """
    Return the median distance of changes from their median, interpolated in groups of a digit.

    Changes of rounded readings are whole digits: a plain median of them was up to 40 % off.

    """
    sizes = np.abs(changes - np.median(changes))
    groups = np.rint(sizes * (_ROUNDING / rounding)) if rounding else sizes
    middle = math.floor(float(np.median(groups)))
    below, equal = np.count_nonzero(groups < middle), np.count_nonzero(groups == middle)
    low = max(middle - 0.5, 0.0)
    within = (0.5 * len(groups) - below) / max(equal, 1) * (middle + 0.5 - low)
    return float(low + within) * rounding / _ROUNDING


def rounding_of(values: Array) -> float:
    """Return the standard deviation of rounding in values, at least _FINEST of their range."""
    steps = np.abs(np.diff(values))
    least = _SAME * float(np.max(np.abs(values)))
    is_rounded = np.mean(steps <= least) > 0.01  # noise that is finer than the steps
    smallest = float(np.min(steps, where=steps > least, initial=math.inf))
    rounding = _ROUNDING * smallest if is_rounded and math.isfinite(smallest) else 0.0
    return max(rounding, least, _FINEST * float(np.ptp(values)))
