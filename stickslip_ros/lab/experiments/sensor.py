# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Properties of a sensor: delay, low-pass, noise, rounding and outliers."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stickslip_ros.arrays import Array
from stickslip_ros.lab.waveform.monitor import GAUSSIAN

OUTLIERS = 6.0
"""Least distance of an outlier in robust standard deviations; 2 of 1e9 normal values exceed it."""
_NEIGHBOURS = 3  # neighbours on either side with which a sample is compared
_SAME = 1e-12  # largest difference of equal readings, per largest reading
_FINEST = 1e-6  # least rounding, as a share of the range of the readings
_ROUNDING = 1.0 / math.sqrt(12.0)
"""Standard deviation of rounding, as a share of the smallest step of the readings."""


@dataclass(frozen=True)
class KnownSensor:
    """
    Known properties of the sensor of a trace.

    Zero, drift, and small changes of delay and low-pass are solved for with each prediction. The
    low-pass is of first order, as most are.

    """

    late_s: float = 0.0  # delay of its clock
    slow_s: float = 0.0  # time constant of its low-pass; 0: none
    noise_lasts_s: float = 0.0  # correlation time of the noise; 0: white
    # largest drift of the zero, units of the values per second; inf: uniform motion is lost
    drift_per_s: float = math.inf
    undone_hz: float = 0.0  # low-pass that was undone; 0: none
    cyclic_m: float = 0.0  # largest cyclic error of an interferometer; 0: none
    fringe_m: float = 0.0  # motion from one fringe to the next


def keeps_noise(values: Array, share: float, rounding: float = 0.0) -> bool:
    """
    Return whether the noise of each value contains a share of the noise of the value before.

    Neighbouring second differences of white noise have the correlation -2/3. A low-pass that keeps
    the share a changes it to (a^2 - 3a + 4)/(2a - 6), which goes to -1/2. It is estimated by
    medians, as the motion is not smooth everywhere. ``rounding`` is that of ``noise_of``.

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
    return correlation > 0.5 * (-2.0 / 3.0 + behind)


def noise_of(values: Array, keeps: float = 0.0, rounding: float = 0.0) -> float:
    """
    Return the standard deviation of noise in values, at least that of their rounding.

    ``keeps`` is the share of the noise of a value that the next value contains; 0: white.
    ``rounding`` is that of the readings if the values are residuals; 0: that of the values.

    """
    if len(values) < 3:
        return 0.0
    rounding = rounding or rounding_of(values)
    variance = 6.0 - 8.0 * keeps + 2.0 * keeps**2  # of second differences, per that of the noise
    size = GAUSSIAN * _middle_size(np.diff(values, 2), rounding)
    return max(size / math.sqrt(variance), rounding)


def _middle_size(changes: Array, rounding: float) -> float:
    """
    Return the median absolute deviation of changes, interpolated within groups of a digit.

    Changes of rounded readings are whole digits, so that a plain median was up to 40 % off.

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
    is_rounded = np.mean(steps <= least) > 0.01  # equal neighbours are rare without rounding
    smallest = float(np.min(steps, where=steps > least, initial=math.inf))
    rounding = _ROUNDING * smallest if is_rounded and math.isfinite(smallest) else 0.0
    return max(rounding, least, _FINEST * float(np.ptp(values)))


def lone_outliers(values: ArrayLike) -> NDArray[np.bool_]:
    """
    Return a mask of isolated samples far beyond their neighbours, shape (n,).

    The limit is OUTLIERS times the noise or the range of the neighbours, whichever is more. The
    samples of a step are not isolated: they have neighbours on their level. One neighbour may be
    an outlier too.

    """
    y = np.asarray(values, np.float64)
    padded = np.pad(y, _NEIGHBOURS, mode='reflect')
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * _NEIGHBOURS + 1)
    low, *_, high = np.sort(np.delete(windows, _NEIGHBOURS, axis=1), axis=1)[:, 1:-1].T
    noise = GAUSSIAN * float(np.median(np.abs(y - np.median(windows, axis=1))))
    beyond = np.maximum(y - high, low - y)
    return np.asarray(beyond > OUTLIERS * np.maximum(noise, high - low))
