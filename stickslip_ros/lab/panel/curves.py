# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Sample buffers of the panel, thinned curves, and the trigger of the scope."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stickslip_ros.arrays import Array
from stickslip_ros.drive.records import FOOT, TIME, VOLTAGE
from stickslip_ros.instrument.reports import FIRST_READING
from stickslip_ros.lab.drawing.film import steep_edges
from stickslip_ros.parameters import SENSORS

BINS = 600  # a curve has at most this many pairs of lowest and highest sample
RECENT = (1 << 13, 1 << 15, 1 << 18)  # samples searched for falls, more if these hold too few
KEPT = RECENT[-1]
_JITTER_V, _JITTER = 1.0, 0.03
"""A voltage rests if it changes by less than 1 V and 3 % of the last saw-tooth."""
_MARGIN = 0.15  # share of a period shown before the first and after the last fall
FREE_S = 0.02  # time that the scope shows without a period, s
DRAWN_MAX = 1e38  # below the largest number of the curves
HISTORY_BIN_S = 0.01
HISTORY_KEPT = 1 << 13

SAMPLE_COLUMNS = ('t', 'voltage', 'foot', *(each.reading for each in SENSORS))
"""Columns of samples; NaN for an absent sensor."""
POSITION_READING = SAMPLE_COLUMNS.index('position')


class SampleRing:
    """The last rows of a growing table, always contiguous."""

    def __init__(self, columns: int, capacity: int) -> None:
        self._capacity = capacity  # rows returned at most
        self._table = np.empty((2 * capacity, columns))
        self._end = 0

    @property
    def rows(self) -> Array:
        """The last rows: a view, valid until the next ``append``."""
        return self._table[max(0, self._end - self._capacity) : self._end]

    def append(self, rows: Array) -> None:
        """Append rows; keep the last rows up to the capacity."""
        rows = rows[-self._capacity :]
        if self._end + len(rows) > len(self._table):
            kept = self.rows[len(rows) - self._capacity or len(self.rows) :].copy()
            self._table[: len(kept)] = kept
            self._end = len(kept)
        self._table[self._end : self._end + len(rows)] = rows
        self._end += len(rows)

    def clear(self) -> None:
        """Remove all rows."""
        self._end = 0


class BinHistory:
    """Bins of 10 ms: start (s), then lowest and highest reading of each sensor."""

    def __init__(self, kept: int = HISTORY_KEPT) -> None:
        self.bins = SampleRing(1 + 2 * len(SENSORS), kept)

    def add(self, samples: Array) -> None:
        """Add samples of at most one bin."""
        readings = samples[:, FIRST_READING:]
        row = np.empty((1, 1 + 2 * len(SENSORS)))
        row[0, 0] = samples[0, TIME]
        row[0, 1::2], row[0, 2::2] = np.fmin.reduce(readings), np.fmax.reduce(readings)
        bins = self.bins.rows
        # Three quarters, since starts of bins are not exact multiples.
        if len(bins) and row[0, 0] - bins[-1, 0] < 0.75 * HISTORY_BIN_S:
            bins[-1, 1::2] = np.fmin(bins[-1, 1::2], row[0, 1::2])
            bins[-1, 2::2] = np.fmax(bins[-1, 2::2], row[0, 2::2])
        else:
            self.bins.append(row)

    def add_all(self, samples: Array) -> None:
        """Add any samples."""
        if len(samples):
            number = np.floor((samples[:, TIME] - samples[0, TIME]) / HISTORY_BIN_S)
            for part in np.split(samples, np.flatnonzero(np.diff(number)) + 1):
                self.add(part)

    def curves(self, end_s: float, span_s: float) -> dict[str, 'PanelCurve']:
        """Return the readings of ``span_s`` before ``end_s``."""
        bins = self.bins.rows
        first, last = np.searchsorted(bins[:, 0], (end_s - span_s, end_s), 'right')
        bins = bins[max(0, first - 1) : last]
        if not len(bins):
            return {}
        x = np.repeat(bins[:, 0] - end_s, 2)
        x[1::2] += 0.5 * HISTORY_BIN_S
        pairs = np.split(bins[:, 1:], len(SENSORS), axis=1)
        return {
            row.reading: curve_of(x, pair.ravel())
            for row, pair in zip(SENSORS, pairs, strict=True)
            if not row.switch or not np.isnan(pair).all()
        }


class PanelCurve(NamedTuple):
    """Points of a curve."""

    x: NDArray[np.float32]  # shape (n,), relative to the time of the picture
    y: NDArray[np.float32]  # shape (n,), relative to the base
    base: float  # added to y in double precision


def curve_of(x: Array, y: Array, base: float | None = None) -> PanelCurve:
    """Thin samples to the lowest and highest of BINS, in rising time; a bin of NaN is a gap."""
    if base is None:
        finite = y[np.isfinite(y)]
        base = float(finite[0]) if len(finite) else 0.0
    y = y - base
    if len(x) > 2 * BINS:
        width = (x[-1] - x[0]) / BINS
        place = np.minimum(np.floor((x - x[0]) / width), BINS - 1)
        starts = np.append(0, np.flatnonzero(np.diff(place)) + 1)
        pair = np.fmin.reduceat(y, starts), np.fmax.reduceat(y, starts)
        x, y = np.repeat(x[0] + width * place[starts], 2), np.column_stack(pair).ravel()
        x[1::2] += 0.5 * width
    y = np.where(np.abs(y) < DRAWN_MAX, y, np.nan)
    return PanelCurve(x.astype(np.float32), y.astype(np.float32), base)


class Picture(NamedTuple):
    """The curves of the scope, and their times."""

    start_s: float  # relative to the trigger: the first fall, or the newest sample
    end_s: float
    at_s: float  # time of the trigger
    period_s: float  # of the saw-tooth; 0 without trigger
    curves: dict[str, PanelCurve]  # voltage, foot, runner; the last two from the trigger on


class Scope:
    """The oscilloscope: the last cycles, triggered on the fall of the voltage."""

    def __init__(self) -> None:
        self._held: Picture | None = None
        self._jitter_v = 0.0

    def clear(self) -> None:
        """Drop the held picture."""
        self._held = None

    def picture(self, samples: Array, cycles: int, *, triggers: bool = True) -> Picture | None:
        """Return the last cycles of samples; hold the picture while the voltage rests."""
        if not len(samples):
            return None
        if not triggers:
            period_s = self._held.period_s if self._held else FREE_S / cycles
            return _free(samples, cycles * period_s)
        recent = samples[-RECENT[0] :, VOLTAGE]
        if self._held is not None and np.ptp(recent) <= self._jitter_v:
            return self._held
        for count in RECENT:
            part = samples[-count:]
            falls = steep_edges(part[:, VOLTAGE])
            if len(falls) > cycles + 1 or count >= len(samples):
                break
        return self._triggered(part, falls, cycles) or _free(samples, FREE_S)

    def _triggered(self, samples: Array, falls: NDArray[np.intp], cycles: int) -> Picture | None:
        if len(falls) < 2:
            return None
        period = float(np.median(np.diff(falls)))
        if falls[-1] + _MARGIN * period > len(samples) - 1 and len(falls) > 2:
            falls = falls[:-1]
        first, last = int(falls[max(0, len(falls) - 1 - cycles)]), int(falls[-1])
        begin = max(0, first - round(_MARGIN * period))
        end = min(len(samples), last + round(_MARGIN * period) + 1)
        self._held = _shown(samples, slice(begin, end), first)
        swing_v = float(np.ptp(samples[begin:end, VOLTAGE]))
        self._jitter_v = min(_JITTER_V, _JITTER * swing_v)
        sample_s = (samples[last, TIME] - samples[first, TIME]) / max(1, last - first)
        self._held = self._held._replace(period_s=period * sample_s)
        return self._held


def _free(samples: Array, length_s: float) -> Picture:
    begin = int(np.searchsorted(samples[:, TIME], samples[-1, TIME] - length_s))
    picture = _shown(samples, slice(begin, len(samples)), len(samples) - 1)
    return picture._replace(start_s=-length_s, end_s=0.0)


def _shown(samples: Array, shown: slice, trigger: int) -> Picture:
    part, at_s = samples[shown], float(samples[trigger, TIME])
    x = part[:, TIME] - at_s
    curves = {'voltage': curve_of(x, part[:, VOLTAGE], 0.0)}
    for name, column in (('foot', FOOT), ('runner', POSITION_READING)):
        place = float(samples[trigger, column])
        curves[name] = curve_of(x, part[:, column], place if math.isfinite(place) else 0.0)
    return Picture(float(x[0]), float(x[-1]), at_s, 0.0, curves)
