# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Sort the samples of a voltage monitor, and estimate their rate and noise."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from stickslip_ros.arrays import Array
from stickslip_ros.errors import OutOfRange, WrongKind

RATE_MOST_HZ = 4e5
"""Faster samples are thinned to this rate: more of them add nothing to straight lines."""
SEEN_FALL_SHARE = 1.0 / 3.0
"""Largest share of a fall between two samples of a monitor that shows the fall itself."""
_SAMPLES_MIN = 12
"""Fewest samples of a wave: a saw-tooth has four unknowns, and as many again test it."""
RAIL_SHARE = 0.01
"""Reach of noise beyond a rail, as a share of the range; share of samples that may lie further."""
GAUSSIAN = 1.4826
"""Standard deviation of normal noise per median absolute deviation."""
NOISE_MOST, NOISE_LEAST = 0.015, 2e-4
"""Most and least noise, as shares of the range of the samples. More hides a wave; the least is
that of an 11-bit converter and of an amplifier's overshoot."""
QUIET_SHARE = 0.05
"""Share of short windows without corner or fall in a well-sampled wave."""
QUIET_WINDOWS = ((6, 0.42), (4, 0.226))
"""Samples of a window, and the QUIET_SHARE quantile of sqrt(chi2/dof) about a straight line."""
WINDOWS_MOST = 100_000


@dataclass(frozen=True, eq=False)
class Monitor:
    """Samples of a voltage in the order of time."""

    times_s: Array  # rising, shape (n,)
    volts_v: Array  # shape (n,)
    period_s: float  # of the clock
    jitter_s: float  # standard deviation of the time stamps
    noise_v: float  # standard deviation of the volts about the wave
    shows_falls: bool  # whether the samples are fast enough
    left_out: int  # samples not finite, repeated, or beyond the rails
    rails_v: tuple[float, float]  # of the amplifier


def monitor_of(
    times_s: ArrayLike, voltage_v: ArrayLike, low_v: float, high_v: float, slew_v_per_s: float
) -> Monitor:
    """
    Return samples, shapes (n,), sorted and cleaned.

    Samples are dropped if they are not finite, repeat a time, or lie beyond the rails ``low_v``
    and ``high_v`` by more than noise. Raises WrongKind for arrays of different lengths, OutOfRange
    for too few samples or too many beyond the rails.

    """
    times, volts = np.asarray(times_s, np.float64), np.asarray(voltage_v, np.float64)
    if times.ndim != 1 or times.shape != volts.shape:
        shapes = times.shape, volts.shape
        raise WrongKind('shapes of times and volts', shapes, 'a pair (n,), (n,)', 'give pairs')
    given, margin_v = len(times), RAIL_SHARE * (high_v - low_v)
    known = np.isfinite(times) & np.isfinite(volts)
    times, volts = times[known], volts[known]
    inside = (volts >= low_v - margin_v) & (volts <= high_v + margin_v)
    if np.sum(~inside) > RAIL_SHARE * given:
        worst_v = float(volts[~inside][np.argmax(np.abs(volts[~inside] - low_v))])
        limit = f'beyond the rails {low_v:g} and {high_v:g} V, with {np.sum(~inside)} samples'
        hint = 'give the unit of the monitor, or set amplifier.voltage_min and voltage_max'
        raise OutOfRange('voltage', worst_v, 'V', limit, hint)
    times, first = np.unique(times[inside], return_index=True)
    volts, left_out = volts[inside][first], given - len(first)
    shows_falls = False
    if len(times) > 1:
        apart_s = float(np.median(np.diff(times)))
        shows_falls = bool(slew_v_per_s * apart_s <= SEEN_FALL_SHARE * np.ptp(volts))
        every = 1 if shows_falls else max(1, math.floor(1.0 / (RATE_MOST_HZ * apart_s) + 0.5))
        times, volts = times[::every], volts[::every]
    if len(times) < _SAMPLES_MIN:
        limit = f'below {_SAMPLES_MIN}, the fewest that show a wave'
        raise OutOfRange('number of samples', len(times), '', limit, 'record longer')
    if not np.ptp(volts) > 0.0:
        hint = 'record the drive while it runs'
        raise OutOfRange('voltage', float(volts[0]), 'V', 'at all times', hint)
    spacing_s = np.diff(times)
    period_s = float(np.median(spacing_s))
    jitter_s = GAUSSIAN * float(np.median(np.abs(spacing_s - period_s))) / math.sqrt(2.0)
    # drops and gaps last whole periods
    period_s = float(np.sum(spacing_s) / np.maximum(np.rint(spacing_s / period_s), 1.0).sum())
    noise_v, rails_v = _noise(times, volts), (low_v, high_v)
    return Monitor(times, volts, period_s, jitter_s, noise_v, shows_falls, left_out, rails_v)


def _noise(times_s: Array, volts_v: Array) -> float:
    """Return the scatter about straight lines in the quietest windows, V."""
    range_v = float(np.ptp(volts_v))
    found = [NOISE_MOST * range_v]
    for width, share in QUIET_WINDOWS:
        starts = np.arange(0, len(volts_v) - width, 1 + len(volts_v) // WINDOWS_MOST)
        rows = starts[:, None] + np.arange(width)
        x, y = times_s[rows], volts_v[rows]
        x, y = x - x.mean(1, keepdims=True), y - y.mean(1, keepdims=True)
        rest = y - x * ((x * y).sum(1) / (x * x).sum(1))[:, None]
        scatter = np.sqrt((rest**2).sum(1) / (width - 2))
        found.append(float(np.quantile(scatter, QUIET_SHARE)) / share)
    return max(min(found), NOISE_LEAST * range_v)
