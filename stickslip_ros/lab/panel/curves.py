# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Sample buffers of the panel, thinned curves, and the trigger of the scope."""

import io
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stickslip_ros.arrays import Array
from stickslip_ros.drive.records import FOOT, TIME, VOLTAGE
from stickslip_ros.instrument.reports import FIRST_READING
from stickslip_ros.lab.drawing.film import steep_edges
from stickslip_ros.parameters import SENSORS

BINS = 600  # of a picture, of each of which the lowest and highest samples are drawn
RECENT = (1 << 13, 1 << 15, 1 << 18)  # samples searched for falls, more if these hold too few
KEPT = RECENT[-1]
_JITTER_V, _JITTER = 1.0, 0.03
"""A voltage rests if it changes by less than 1 V and its noise, and 3 % of the last saw-tooth."""
_NOISE = 12 / 1.65
"""Widest range of noise, 12 standard deviations, per median of its second differences."""
_MARGIN = 0.15  # share of a period shown before the first and after the last fall
FREE_S, FREE_SAMPLES = 0.02, 50  # time, s, and samples that the scope shows without a period
_SLACK_S = 1e-9  # rounding of times
DRAWN_MAX = 1e38  # below the largest number of the curves
HISTORY_BIN_S = 0.01
HISTORY_KEPT = 1 << 16  # samples: a minute of all sensors

SAMPLE_COLUMNS = ('t', 'voltage', 'foot', *(each.reading for each in SENSORS))
"""Columns of samples; NaN for an absent sensor."""
POSITION_READING = SAMPLE_COLUMNS.index('position')


_TABLES = {
    'oscilloscope': {'position_m': POSITION_READING, 'foot_m': FOOT, 'voltage_v': VOLTAGE},
    'history': {each.quantity: SAMPLE_COLUMNS.index(each.reading) for each in SENSORS},
}
"""Columns of the saved tables of the plots."""


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

    def take_back(self, count: int) -> Array:
        """Remove the last rows and return them."""
        rows = self.rows[len(self.rows) - count :].copy()
        self._end -= len(rows)
        return rows

    def clear(self) -> None:
        self._end = 0


class BinHistory:
    """The newest sample, and of each 10 ms those with the extreme readings of the sensors."""

    def __init__(self, kept: int = HISTORY_KEPT) -> None:
        self.samples = SampleRing(len(SAMPLE_COLUMNS), kept)
        self._open = 0  # samples of the newest bin

    def add_all(self, samples: Array) -> None:
        rows = np.concatenate((self.samples.take_back(self._open), samples))
        if len(rows):
            number = np.floor(rows[:, TIME] / HISTORY_BIN_S)
            kept = np.unique([*extremes(number, rows[:, FIRST_READING:].T), len(rows) - 1])
            self.samples.append(rows[kept])
            self._open = int(np.sum(number[kept] == number[-1]))

    def curves(self, end_s: float, span_s: float) -> dict[str, 'PanelCurve']:
        """Return the readings of ``span_s`` before ``end_s``."""
        rows = self.samples.rows
        first, last = np.searchsorted(rows[:, TIME], (end_s - span_s, end_s), 'right')
        rows = rows[max(0, first - 1) : last]
        if not len(rows):
            return {}
        shown = {
            row.reading: (values, None)
            for row, values in zip(SENSORS, rows[:, FIRST_READING:].T, strict=True)
            if not row.switch or not np.isnan(values).all()
        }
        return thinned_curves(rows[:, TIME] - end_s, shown)


class PanelCurve(NamedTuple):
    """Points of a curve."""

    x: NDArray[np.float32]  # shape (n,), relative to the time of the picture
    y: NDArray[np.float32]  # shape (n,), relative to the base
    base: float  # added to y in double precision


def table_of(columns: Mapping[str, Array]) -> str:
    """Return samples as CSV, without columns that have no number."""
    known = {k: each for k, each in columns.items() if not len(each) or np.isfinite(each).any()}
    rows, text = np.column_stack([*known.values()]), io.StringIO()
    np.savetxt(text, rows, '%.12g', ',', header=','.join(known), comments='')
    return text.getvalue()


def table_within(plot: str, rows: Array, origin_s: float, start_s: float, end_s: float) -> str:
    """Return the table of the samples of a plot between two times after its origin."""
    times_s = rows[:, TIME] - origin_s
    rows = rows[slice(*np.searchsorted(times_s, (start_s - _SLACK_S, end_s + _SLACK_S)))]
    shown = {'time_s': rows[:, TIME] - origin_s}
    return table_of(shown | {name: rows[:, at] for name, at in _TABLES[plot].items()})


def curve_of(x: Array, y: Array, base: float | None = None) -> PanelCurve:
    """Return one curve."""
    return thinned_curves(x, {'': (y, base)})['']


def thinned_curves(
    x: Array, shown: Mapping[str, tuple[Array, float | None]]
) -> dict[str, PanelCurve]:
    """Thin curves of common samples, in rising time, to the ends and extremes of BINS."""
    bases = {
        name: next(iter(y[np.isfinite(y)][:1].tolist()), 0.0) if base is None else base
        for name, (y, base) in shown.items()
    }
    drawn = np.array([y - bases[name] for name, (y, _) in shown.items()])
    drawn = np.where(np.abs(drawn) < DRAWN_MAX, drawn, np.nan)
    if len(x) > 2 * BINS:
        number = np.floor((x - x[0]) * ((BINS - 1) / (x[-1] - x[0])))
        kept = np.unique([0, *extremes(number, drawn), len(x) - 1])
        x, drawn = x[kept], drawn[:, kept]
    at, rows = x.astype(np.float32), drawn.astype(np.float32)
    return {name: PanelCurve(at, y, bases[name]) for name, y in zip(shown, rows, strict=True)}


def extremes(number: Array, curves: Array) -> NDArray[np.intp]:
    """Return the places of the lowest and highest sample of each curve in each bin, in order."""
    starts = np.append(0, np.flatnonzero(np.diff(number)) + 1)
    counts = np.diff(np.append(starts, len(number)))
    kept = [starts[:0]]
    for y in curves:
        for extreme in np.fmin.reduceat(y, starts), np.fmax.reduceat(y, starts):
            kept.append(starts[np.isnan(extreme)])  # a gap
            found = np.flatnonzero(y == np.repeat(extreme, counts))
            bins = np.searchsorted(starts, found, 'right')
            kept.append(found[np.append(True, np.diff(bins) > 0)[: len(found)]])
    places: NDArray[np.intp] = np.unique(np.concatenate(kept))
    return places


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
        self.samples: Array | None = None  # of the held picture
        self._swing_v = 0.0  # of the held picture

    def clear(self) -> None:
        """Drop the held picture."""
        self._held = None

    def picture(self, samples: Array, cycles: int) -> Picture | None:
        """Return the last cycles of samples; hold the picture while the voltage rests."""
        if not len(samples):
            return None
        recent = samples[-RECENT[0] :, VOLTAGE]
        noise_v = _noise_v(recent)
        rests_v = min(_JITTER_V + noise_v, _JITTER * self._swing_v)
        if self._held is not None and _range_v(recent) <= rests_v:
            return self._held
        for count in RECENT:
            part = samples[-count:]
            falls = steep_edges(part[:, VOLTAGE])
            if len(falls) > cycles + 1 or count >= len(samples):
                break
        if len(falls) and _range_v(part[:, VOLTAGE]) <= noise_v:
            return _free(samples)
        return self._triggered(part, falls, cycles) or _free(samples)

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
        self.samples = samples[begin:end].copy()
        self._swing_v = _range_v(samples[begin:end, VOLTAGE])
        sample_s = (samples[last, TIME] - samples[first, TIME]) / max(1, last - first)
        self._held = self._held._replace(period_s=period * sample_s)
        return self._held


def _range_v(voltage: Array) -> float:
    """Return highest less lowest voltage, V, past gaps; NaN without a voltage."""
    return float(np.fmax.reduce(voltage) - np.fmin.reduce(voltage))


def _noise_v(voltage: Array) -> float:
    """Return the widest range of the noise, V; straight ramps have none."""
    steps = np.abs(np.diff(voltage, 2))
    steps = steps[np.isfinite(steps)]
    return _NOISE * float(np.median(steps)) if len(steps) else 0.0


def _free(samples: Array) -> Picture:
    begin = int(np.searchsorted(samples[:, TIME], samples[-1, TIME] - FREE_S))
    begin = max(0, min(begin, len(samples) - FREE_SAMPLES))
    picture = _shown(samples, slice(begin, len(samples)), len(samples) - 1)
    return picture._replace(start_s=min(picture.start_s, -FREE_S), end_s=0.0)


def _shown(samples: Array, shown: slice, trigger: int) -> Picture:
    part, at_s = samples[shown], float(samples[trigger, TIME])
    x = part[:, TIME] - at_s
    places = samples[trigger, [FOOT, POSITION_READING]]
    foot_m, runner_m = np.where(np.isfinite(places), places, 0.0).tolist()
    drawn = {
        'voltage': (part[:, VOLTAGE], 0.0),
        'foot': (part[:, FOOT], foot_m),
        'runner': (part[:, POSITION_READING], runner_m),
    }
    return Picture(float(x[0]), float(x[-1]), at_s, 0.0, thinned_curves(x, drawn))
