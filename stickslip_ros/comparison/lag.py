"""The time shift between two runs, by cross-correlation, to a fraction of a sample."""

from collections.abc import Sequence

import numpy as np

from stickslip_ros.comparison.result import Alignment, Incomparable
from stickslip_ros.contact.profile import Array
from stickslip_ros.recording.series import Series

SAMPLES_MAX = 1 << 20
OVERLAP_MIN = 0.5
"""Share of the shorter run that must overlap: a short overlap correlates by chance."""
TIED = 1e-9
"""Coefficients this near are the same; of these lags the smallest counts."""
NO_SPREAD = 1e-9
"""Variance, relative to that of the whole run, below which a stretch is constant."""


def estimate_alignment(pairs: Sequence[tuple[Series, Series]]) -> Alignment:
    """
    Estimate the shift that lays B onto A, of quantities of both: finite, two samples or more.

    All are interpolated onto even times. For each whole number of samples with enough overlap
    Pearson's coefficient of each quantity is taken over the overlap; the best shift has the
    largest mean over the quantities. A parabola through it and its neighbours refines it.

    Raises
    ------
    Incomparable
        If no quantity changes in both.

    """
    runs = [[pair[side] for pair in pairs] for side in (0, 1)]
    step_s = _step_s([*runs[0], *runs[1]])
    (start_a_s, a), (start_b_s, b) = (_resampled(run, step_s) for run in runs)
    scores = _scores(a, b)
    lags = np.arange(1 - b.shape[1], a.shape[1])
    tied = np.flatnonzero(scores >= np.max(scores) - TIED)
    offset_s = start_a_s - start_b_s
    best = int(tied[np.argmin(np.abs(offset_s + step_s * lags[tied]))])
    shift_s = offset_s + step_s * (float(lags[best]) + _vertex(scores, best))
    return Alignment(shift_s, 'estimated', float(scores[best]), step_s)


def _step_s(series: list[Series]) -> float:
    """Return the spacing of the finest run, as long as it does not ask for too many samples."""
    finest_s = min(float(np.median(np.diff(np.unique(each.time_s)))) for each in series)
    longest_s = max(float(each.time_s[-1] - each.time_s[0]) for each in series)
    return max(finest_s, longest_s / SAMPLES_MAX)


def _resampled(run: list[Series], step_s: float) -> tuple[float, Array]:
    """Return a start, s, and what is there on even times from it on, shape (quantities, n)."""
    start_s = max(float(each.time_s[0]) for each in run)
    end_s = min(float(each.time_s[-1]) for each in run)
    count = int(np.floor((end_s - start_s) / step_s + 0.5)) + 1 if end_s >= start_s else 1
    times_s = start_s + step_s * np.arange(count)
    return start_s, np.array([np.interp(times_s, each.time_s, each.value) for each in run])


def _scores(a: Array, b: Array) -> Array:
    """Return the mean coefficient of each lag, -1 where the overlap is too short."""
    coefficients = [
        _coefficients(one - one.mean(), other - other.mean())
        for one, other in zip(a, b, strict=True)
        if np.ptp(one) > 0.0 and np.ptp(other) > 0.0
    ]
    if not coefficients:
        hint = 'record something that moves, or give --shift'
        raise Incomparable('the lag', 'cannot be found: nothing changes in both', hint)
    overlap = _overlaps(a.shape[1], b.shape[1])[2]
    is_enough = overlap >= OVERLAP_MIN * min(a.shape[1], b.shape[1])
    return np.where(is_enough, np.mean(coefficients, axis=0), -1.0)


def _coefficients(a: Array, b: Array) -> Array:
    """Return Pearson's coefficient over the overlap for each lag of B, from 1 - len(b) on."""
    a, b = a / np.std(a), b / np.std(b)
    first, last, count = _overlaps(len(a), len(b))
    lags = np.arange(1 - len(b), len(a))
    safe = np.maximum(count, 1)
    sum_a, square_a = _window_sums(a, first, last)
    sum_b, square_b = _window_sums(b, first - lags, last - lags)
    covariance = _products(a, b) / safe - sum_a * sum_b / safe**2
    variance_a = square_a / safe - (sum_a / safe) ** 2
    variance_b = square_b / safe - (sum_b / safe) ** 2
    spread = (variance_a > NO_SPREAD) & (variance_b > NO_SPREAD)
    norm = np.sqrt(np.where(spread, variance_a * variance_b, 1.0))
    return np.where(spread, covariance / norm, 0.0)


def _overlaps(count_a: int, count_b: int) -> tuple[Array, Array, Array]:
    """Return first and last sample of A in the overlap of each lag, and its length."""
    lags = np.arange(1 - count_b, count_a)
    first, last = np.maximum(lags, 0), np.minimum(count_a, lags + count_b)
    return first, last, last - first


def _window_sums(values: Array, first: Array, last: Array) -> tuple[Array, Array]:
    sums = np.concatenate(([0.0], np.cumsum(values)))
    squares = np.concatenate(([0.0], np.cumsum(values**2)))
    return sums[last] - sums[first], squares[last] - squares[first]


def _products(a: Array, b: Array) -> Array:
    """Return the sum of products for each lag, by Fourier transform."""
    length = len(a) + len(b) - 1
    size = 1 << (length - 1).bit_length()
    spectrum = np.fft.rfft(a, size) * np.conj(np.fft.rfft(b, size))
    wrapped = np.fft.irfft(spectrum, size)
    return np.concatenate((wrapped[size - (len(b) - 1) :], wrapped[: len(a)]))


def _vertex(scores: Array, best: int) -> float:
    """Return where a parabola through three scores has its top, in samples from the middle."""
    if not 0 < best < len(scores) - 1:
        return 0.0
    before, middle, after = (float(value) for value in scores[best - 1 : best + 2])
    bend = before - 2.0 * middle + after
    return 0.0 if bend >= 0.0 else float(np.clip(0.5 * (before - after) / bend, -0.5, 0.5))
