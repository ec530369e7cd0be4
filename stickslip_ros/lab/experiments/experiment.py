# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""An experiment: how a stand was set, what drove it, what was seen there, and how surely."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple, TypeAlias

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.errors import OutOfRange, WrongKind
from stickslip_ros.parameters import Scalar
from stickslip_ros.units import unit_of

OF_TRACES = ('position_m', 'force_n', 'foot_position_m')
"""Quantities that may be seen over time."""
NOISE_FACTOR = 1.4826 / math.sqrt(6.0)
"""Standard deviation of noise per median of its absolute second differences."""
_WHITE_ALIKE = -2.0 / 3.0  # correlation of neighbouring second differences of white noise
_SAME = 1e-12  # share of the largest reading by which two that are the same may differ
_FINEST = 1e-6  # share of the range of readings that no sensor tells, and no model computes
_WITHIN_MIN = 2  # readings of a window that are too few
_ROUNDING = 1.0 / math.sqrt(12.0)
"""Standard deviation of rounding, as a share of the smallest step of the readings."""


class SawtoothSteps(NamedTuple):
    """A saw-tooth from rest, after which numbers were read."""

    amplitude_m: float  # stroke of the feet
    frequency_hz: float  # steps per second, below 0 backwards
    steps: int = 0  # that were made when they were read; 0: until they were steady
    is_steady: bool = True  # whether they were read when they did not change any more


class ZeroAmplitudeRuns(NamedTuple):
    """Saw-teeth of many strokes, without a load cell, whose step lengths tell the 0-amplitude."""

    frequency_hz: float
    steps: int = 120  # of each


class VoltageStep(NamedTuple):
    """A step of the voltage, down, from rest, after which the runner rings."""

    amplitude_m: float  # stroke of the feet; within some 0.1 nm nothing slips


@dataclass(frozen=True, eq=False)
class Voltage:
    """
    The voltage at the amplifier's input over time.

    Attributes
    ----------
    rows : array, shape (n, 2)
        Times from 0 on, s, and voltages, V; straight lines join them. The stand rests at the first
        voltage before.
    said : tuple of str
        Where it comes from, and what was recognised in it.
    begins_s : float
        Time of the first corner in the clock of the recording, s.

    """

    rows: Array
    said: tuple[str, ...] = ()
    begins_s: float = 0.0

    @property
    def lasts_s(self) -> float:
        """Time to the last corner."""
        return float(self.rows[-1, 0])


Drive: TypeAlias = SawtoothSteps | ZeroAmplitudeRuns | VoltageStep | Voltage
QUANTITIES: Mapping[type[Drive], tuple[str, ...]] = {
    SawtoothSteps: ('force_n', 'step_length_m', 'energy_loss_per_step_j'),
    ZeroAmplitudeRuns: ('zero_amplitude_m',),
    VoltageStep: ('ringing_hz', 'decay_s'),
    Voltage: OF_TRACES,
}
"""What may be seen, by what drove: quantities over time of a voltage, numbers of all others."""
NUMBERS = {
    quantity: drive
    for drive, quantities in QUANTITIES.items()
    for quantity in quantities
    if drive is not Voltage
}
"""What may be read as one number, and what drives it."""


@dataclass(frozen=True, eq=False)
class Seen:
    """
    A quantity that was seen: over time, or one number.

    Attributes
    ----------
    quantity : str
        One of QUANTITIES.
    values : array, shape (n,)
        In SI units; a number is an array of one.
    time_s : array, shape (n,) or (0,)
        Times since the voltage began, s, rising; none of a number.
    sigma : float or None
        Standard error of a value; None where nobody knows it.
    left_out : int
        Readings that were left out as outliers.
    slow_s : float
        Time constant of the sensor's low-pass, first order; 0 is none.
    drift_per_s : float
        What its zero may drift by, units of the values per second; by default nothing is too much,
        and a motion that is even over time tells nothing.
    noise_lasts_s : float
        Time over which noise is alike, as that of white noise before a low-pass; 0 is white.
    low_pass_hz : float
        Low-pass of the sensor that was undone: the values are those before it; 0 is none.
    cyclic_m, fringe_m : float
        What an interferometer may be wrong by, over and over in each fringe, and the motion from
        one fringe to the next, m; 0 is none.

    """

    quantity: str
    values: Array
    time_s: Array = field(default_factory=lambda: np.empty(0))
    sigma: float | None = None
    left_out: int = 0
    slow_s: float = 0.0
    drift_per_s: float = math.inf
    noise_lasts_s: float = 0.0
    low_pass_hz: float = 0.0
    cyclic_m: float = 0.0
    fringe_m: float = 0.0

    @property
    def is_trace(self) -> bool:
        """Whether it was seen over time."""
        return len(self.time_s) > 0

    @property
    def unit(self) -> str:
        """Unit of the values."""
        return unit_of(self.quantity)

    @property
    def noise(self) -> float:
        """
        Standard error of a value: as given, else read off the second differences.

        Their median sees noise and rounding, not the motion, as long as a runner is smooth on most
        of the samples.

        """
        if self.sigma is not None:
            return self.sigma
        return noise_of(self.values)

    def within(self, origin: str, start_s: float, end_s: float) -> 'Seen':
        """Return what was seen over time in a stretch, s; refuse one that holds too little."""
        inside = (self.time_s >= start_s) & (self.time_s <= end_s)
        if inside.sum() <= _WITHIN_MIN:
            limit = f'a stretch with {inside.sum()} samples of the {self.quantity} of {origin}, '
            limit += f'which goes from {self.time_s[0]:.6g} to {self.time_s[-1]:.6g} s'
            asked = f'{start_s:.6g} to {end_s:.6g}'
            raise OutOfRange('window', asked, 's', limit, 'move it, or lengthen it')
        return replace(self, time_s=self.time_s[inside], values=self.values[inside])


@dataclass(frozen=True, eq=False)
class Experiment:
    """
    What was done to a stand, and what was seen.

    Attributes
    ----------
    origin : str
        Where it was recorded: a file, a row of a table.
    settings : mapping of str to Scalar
        Parameters that were set for it, as ``{'stand.preload': 0.35}``: they are the same whatever
        the stand is.
    drive : SawtoothSteps, ZeroAmplitudeRuns, VoltageStep or Voltage
        What drove it.
    seen : tuple of Seen
        What was seen. Zero, drift, delay and low-pass of a sensor that sees over time are unknown.
    load_n : float
        Constant external force on the runner along +x, N.

    """

    origin: str
    settings: Mapping[str, Scalar]
    drive: Drive
    seen: tuple[Seen, ...]
    load_n: float = 0.0
    notes: tuple[str, ...] = field(default=())

    def __post_init__(self) -> None:
        """Refuse what cannot have been seen."""
        known = QUANTITIES[type(self.drive)]
        for each in self.seen:
            if each.quantity not in known:
                hint = 'leave it away'
                raise WrongKind(
                    f'quantity of {self.origin}', each.quantity, f'one of {", ".join(known)}', hint
                )
            if each.is_trace != isinstance(self.drive, Voltage):
                hint = 'give values over time where a voltage drove, else one number'
                what = f'{each.quantity} of {self.origin}'
                raise WrongKind(what, len(each.time_s), 'as many times as fit its drive', hint)

    @property
    def end_s(self) -> float:
        """Time of the last sample."""
        return max((float(each.time_s[-1]) for each in self.seen if each.is_trace), default=0.0)

    @property
    def lasts_s(self) -> float:
        """Length of a run, s: to the last corner and the last reading; 0 of steps."""
        return max(self.drive.lasts_s, self.end_s) if isinstance(self.drive, Voltage) else 0.0

    def within(self, start_s: float, end_s: float) -> 'Experiment':
        """Return what was seen in a stretch; the drive begins where it began."""
        seen = (each.within(self.origin, start_s, end_s) for each in self.seen if each.is_trace)
        return replace(self, seen=tuple(seen))


def keeps_noise(values: Array, share: float) -> bool:
    """
    Return whether each value keeps a share of its noise from the one before, or none.

    Second differences of noise that is white are alike by -2/3, of what a low-pass with the share
    a makes of it by (a^2 - 3a + 4)/(2a - 6), which goes to -1/2. Theirs are read off medians, for
    the motion is not smooth everywhere.

    """
    second = np.diff(values, 2)
    together, against = (
        np.median(np.abs(each - np.median(each))) ** 2
        for each in (second[1:] + second[:-1], second[1:] - second[:-1])
    )
    if not together + against > 0.0:
        return False
    alike = float((together - against) / (together + against))
    behind = (share**2 - 3.0 * share + 4.0) / (2.0 * share - 6.0)
    return alike > 0.5 * (_WHITE_ALIKE + behind)


def noise_of(values: Array, keeps: float = 0.0) -> float:
    """
    Return the standard deviation of noise in values, at least of their rounding.

    ``keeps`` is the share of its noise that each has from the one before; 0 is white.

    """
    if len(values) < 5:
        return 0.0
    second = np.diff(values, 2)
    white = NOISE_FACTOR * float(np.median(np.abs(second - np.median(second))))
    of_white = math.sqrt(6.0 / (6.0 - 8.0 * keeps + 2.0 * keeps**2))
    return max(of_white * white, rounding_of(values))


def rounding_of(values: Array) -> float:
    """Return the standard deviation of rounding in values, at least _FINEST of their range."""
    steps = np.abs(np.diff(values))
    least = _SAME * float(np.max(np.abs(values)))
    is_rounded = np.mean(steps <= least) > 0.01  # noise that is finer than the steps
    smallest = float(np.min(steps, where=steps > least, initial=math.inf))
    rounding = _ROUNDING * smallest if is_rounded and math.isfinite(smallest) else 0.0
    return max(rounding, least, _FINEST * float(np.ptp(values)))
