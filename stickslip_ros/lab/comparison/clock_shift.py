# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Estimate the shift between two clocks from records of the same quantity, and its error."""

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from stickslip_ros.arrays import Array
from stickslip_ros.lab.comparison.result import Alignment
from stickslip_ros.lab.experiments.sensor import OUTLIERS, lone_outliers
from stickslip_ros.lab.waveform.monitor import GAUSSIAN
from stickslip_ros.recording.series import Series

MOST_OF_B = 0.05, 0.95
"""Quantiles of B; the coarse search clips values farther outside than their distance."""
OVERLAP_MIN = 0.5
"""Least overlap as a share of the shorter record: short overlaps correlate by chance."""
NO_SPREAD = 1e-9  # largest variance of a constant, relative to the whole record
PER_SAMPLE = 4  # steps of the coarse search in a period of the slower record
GRID_MOST = 1 << 19
_PEAKS, _DIGITS = 6, 2  # peaks refined; digits of the score (the smallest shift wins a tie)
_NEWTON_STEPS, _TRIMS = 12, 3  # most Gauss-Newton steps; trimmed fits in each
CLOSE = 0.01  # the search ends at steps below this share of the standard error
FALLS, RAMPS = 8.0, 0.25
"""Slopes above FALLS medians are falls and left out. The median excludes rests: slopes below
1/FALLS of the weighted quantile RAMPS."""
_RIVAL, _EQUAL, _EXACT, _COARSE = 4.0, 1.1, 1e-6, 0.01
"""Largest unexplained variance of a rival and of an equal, relative to the best shift's; smallest
unexplained variance of the best shift, of exact records and in the coarse search."""
_TURNS, _FAST, _SPARSE = 0.3, 0.25, 0.1
"""A record has fewer than about four samples per cycle if successive changes correlate below
-_TURNS and their mean square exceeds _FAST variances; _SPARSE is then its unexplained variance."""
_PARTS, _STEADY = 10, 5.0
"""Parts of a record shifted separately; largest shift of a part by noise, in standard errors. A
larger shift means a wandering clock: more samples do not reduce the error."""
TRUSTED = 0.8
"""Least correlation of two records of the same quantity."""


def clock_shift(a: Series, b: Series, name: str) -> Alignment:
    """
    Return the time to add to the times of B to match A, a record of the same quantity.

    Times must rise. A is interpolated linearly; gain and zero of B are free. Coarse shifts are
    peaks of Pearson's coefficient over the overlap. Each is refined by least squares of
    e(t) = B - g A(t + d) - z in g, z and d: d = sum(e A')/sum(A'^2), with the slope A' orthogonal
    to A and to 1. Outliers by the median of |e| are left out. Interpolation adds error.

    """
    ta, ya, kept = a.time_s, a.value, ~lone_outliers(b.value)
    tb, yb = b.time_s[kept], b.value[kept]
    shifts_s, scores = correlation_peaks(ta, ya, tb, yb)
    found = [refined_shift(ta, ya, tb, yb, float(each)) for each in shifts_s[:_PEAKS]]
    equal = _EQUAL * max(_EXACT, 1.0 - max(each[0] for each in found) ** 2)
    found.sort(key=lambda each: (max(1.0 - each[0] ** 2, equal), abs(each[1])))
    coefficient, shift_s, error_s = found[0]
    apart_s = float(np.median(np.diff(tb)))
    others = [each for each in found[1:] if abs(each[1] - shift_s) > apart_s]
    rival, rival_s = others[0][:2] if others else (0.0, math.nan)
    sparse, between = sparseness(ya)
    if sparse or as_good(rival, coefficient):
        similar_s = [each[1] for each in found if as_good(each[0], coefficient)]
        limits = (_SPARSE, _RIVAL) if sparse else (_COARSE, _EQUAL)
        similar_s += [*shifts_s[as_good(scores, scores.max(), *limits)]]
        error_s += farthest_s(similar_s, shift_s)
    error_s += between * float(np.median(np.diff(ta)))
    doubt = (
        f'a shift of {rival_s:.6f} s is nearly as good, correlation {rival:.5f} '
        f'against {coefficient:.5f} at {shift_s:.6f} s; give the shift'
    )
    doubts = (doubt,) if as_good(rival, coefficient) else ()
    return Alignment(shift_s, 'estimated', coefficient, error_s, name, doubts)


def sparseness(values: Array) -> tuple[bool, float]:
    """Return whether samples are sparse, and the typical error of interpolation, in samples."""
    ways = np.diff(values)
    steep, square = np.abs(ways), float(np.mean(ways**2))
    turns = float(np.mean(ways[1:] * ways[:-1])) < -_TURNS * square
    moves = steep[1:] > weighted_quantile(steep, steep, RAMPS) / FALLS
    bend = float(np.median(np.abs(np.diff(ways))[moves])) / 8.0 if moves.any() else 0.0
    between = bend / float(np.median(steep[1:][moves])) if bend else 0.0
    return turns and square > _FAST * float(np.var(values)), between


def as_good(scores: Any, best: float, least: float = _EXACT, most: float = _RIVAL) -> Any:
    """Return whether the unexplained variance is at most `most` times the best's, or `least`'s."""
    return 1.0 - np.maximum(scores, 0.0) ** 2 <= most * max(1.0 - best**2, least)


def farthest_s(shifts_s: ArrayLike, shift_s: float) -> float:
    """Return the distance of the farthest shift."""
    return float(np.max(np.abs(np.asarray(shifts_s) - shift_s), initial=0.0))


def weighted_quantile(values: Array, weights: Array, share: float) -> float:
    """Return the quantile of values for a share of the weights."""
    order = np.argsort(values)
    sums = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(sums, share * sums[-1])]) if len(values) else 0.0


def wander_s(slope: Array, rest: Array) -> float:
    """Return the largest shift of a part, a median over its moving samples."""
    steep = np.abs(slope)
    moves = steep > weighted_quantile(steep, steep, RAMPS) / FALLS
    slope, rest = slope[moves], rest[moves]
    ways = np.cumsum(np.abs(slope))
    ends = np.searchsorted(ways, np.arange(1, _PARTS) / _PARTS * np.sum(np.abs(slope)))
    parts_s = np.split(rest / slope, ends)
    return farthest_s([np.median(each) for each in parts_s if len(each)], 0.0)


def correlation_peaks(ta: Array, ya: Array, tb: Array, yb: Array) -> tuple[Array, Array]:
    """Return shifts and heights of the peaks of the correlation of two records."""
    step_s = max(np.median(np.diff(tb)) / PER_SAMPLE, max(np.ptp(ta), np.ptp(tb)) / GRID_MOST)
    grids = [np.arange(times[0], times[-1], step_s) for times in (ta, tb)]
    low, high = np.quantile(yb, MOST_OF_B)
    yb = np.clip(yb, 2.0 * low - high, 2.0 * high - low)  # large values would dominate
    on_a, on_b = np.interp(grids[0], ta, ya), np.interp(grids[1], tb, yb)
    scores = coefficients(on_a - on_a.mean(), on_b - on_b.mean())
    lasts = overlaps(len(on_a), len(on_b))[2]
    scores = np.where(lasts >= OVERLAP_MIN * min(len(on_a), len(on_b)), scores, -1.0)
    around = np.pad(scores, 1, constant_values=-2.0)
    tops = np.flatnonzero((scores >= around[:-2]) & (scores > around[2:]) & (scores > 0.0))
    shifts_s = ta[0] - tb[0] + step_s * (tops + 1 - len(on_b))
    best = np.lexsort((np.abs(shifts_s), -np.round(scores[tops], _DIGITS)))
    return shifts_s[best], scores[tops][best]


def refined_shift(
    ta: Array, ya: Array, tb: Array, yb: Array, shift_s: float
) -> tuple[float, float, float]:
    """Refine a shift; return coefficient, shift and its standard error."""
    slopes = np.diff(ya) / np.maximum(np.diff(ta), np.finfo(np.float64).tiny)
    apart_s, moved_s = float(np.median(np.diff(tb))), 0.0
    for _ in range(_NEWTON_STEPS):
        at_s = tb + shift_s + moved_s
        inside = (at_s >= ta[0]) & (at_s <= ta[-1])
        target, at_s = yb[inside], at_s[inside]
        slope = slopes[np.clip(np.searchsorted(ta, at_s) - 1, 0, len(slopes) - 1)]
        columns = np.column_stack((np.interp(at_s, ta, ya), np.ones(len(target)), slope))
        steep = np.abs(slope)
        ways = np.abs(np.interp(at_s + apart_s, ta, ya) - columns[:, 0])
        ramp = weighted_quantile(steep, ways, RAMPS)
        usable = steep <= FALLS * np.median(steep[steep > ramp / FALLS]) if ramp else steep > 0.0
        if usable.sum() <= columns.shape[1]:
            return 0.0, shift_s, math.inf
        kept = usable
        for _ in range(_TRIMS):
            gains = np.linalg.lstsq(columns[kept], target[kept], rcond=None)[0]
            rest = target - columns @ gains
            limit = OUTLIERS * GAUSSIAN * float(np.median(np.abs(rest[usable])))
            kept = usable & (np.abs(rest) <= limit)
        spread = float(np.var(gains[0] * columns[usable, 0]))  # without outliers
        if not (gains[0] > 0.0 and spread > 0.0):
            return 0.0, shift_s, math.inf
        variance = float(np.mean(rest[kept] ** 2))
        inverse = np.linalg.pinv(columns[kept].T @ columns[kept])
        error_s = math.sqrt(variance * float(inverse[2, 2])) / float(gains[0])
        step_s = float(np.clip(gains[2] / gains[0], -0.5 * apart_s, 0.5 * apart_s))
        if abs(moved_s + step_s) > apart_s:  # another peak
            break
        moved_s += step_s
        if abs(step_s) < CLOSE * error_s:
            break
    wander = wander_s(slope[usable], rest[usable] / gains[0])
    error_s = wander if wander > _STEADY * math.sqrt(_PARTS) * error_s else error_s
    missed = np.minimum(rest[usable] ** 2, spread).mean() / spread
    return math.sqrt(max(1.0 - missed, 0.0)), shift_s + moved_s, error_s


def coefficients(a: Array, b: Array) -> Array:
    """Return Pearson's coefficient over the overlap for each lag of B, from 1 - len(b) on."""
    from scipy import signal  # noqa: PLC0415 - a slow import

    a, b = a / np.std(a), b / np.std(b)
    first, last, count = overlaps(len(a), len(b))
    lags = np.arange(1 - len(b), len(a))
    safe = np.maximum(count, 1)
    sum_a, square_a = _window_sums(a, first, last)
    sum_b, square_b = _window_sums(b, first - lags, last - lags)
    covariance = signal.correlate(a, b, method='fft') / safe - sum_a * sum_b / safe**2
    variance_a = square_a / safe - (sum_a / safe) ** 2
    variance_b = square_b / safe - (sum_b / safe) ** 2
    spread = (variance_a > NO_SPREAD) & (variance_b > NO_SPREAD)
    norm = np.sqrt(np.where(spread, variance_a * variance_b, 1.0))
    return np.where(spread, covariance / norm, 0.0)


def overlaps(count_a: int, count_b: int) -> tuple[Array, Array, Array]:
    """Return first sample of A, last (excluded) and length of the overlap at each lag."""
    lags = np.arange(1 - count_b, count_a)
    first, last = np.maximum(lags, 0), np.minimum(count_a, lags + count_b)
    return first, last, last - first


def _window_sums(values: Array, first: Array, last: Array) -> tuple[Array, Array]:
    sums = np.concatenate(([0.0], np.cumsum(values)))
    squares = np.concatenate(([0.0], np.cumsum(values**2)))
    return sums[last] - sums[first], squares[last] - squares[first]
