# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Compare runs quantity by quantity in their common time."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

import stickslip_ros
from stickslip_ros.arrays import Array
from stickslip_ros.lab.comparison.clocks import (
    OVERLAP_MIN,
    TRUSTED,
    as_good,
    clock_shift,
    coefficients,
    farthest_s,
    overlaps,
    wander_s,
)
from stickslip_ros.lab.comparison.result import (
    TIME_COLUMN,
    Alignment,
    Compared,
    Incomparable,
    Part,
    StepStatistics,
)
from stickslip_ros.lab.experiments.experiment import Experiment, Voltage
from stickslip_ros.lab.experiments.predict import predict
from stickslip_ros.lab.experiments.reading import behind_low_pass
from stickslip_ros.lab.experiments.sensor_clock import lateness_in
from stickslip_ros.lab.measurements.measurement import Side, TimeRun
from stickslip_ros.lab.readers.numbers import sigma_name
from stickslip_ros.lab.runs.sawtooth_run import scatter_of
from stickslip_ros.parameters import Parameters
from stickslip_ros.recording.series import Series

_MODEL = 'model'
STANDS_STILL = 0.05  # least range of a model, per range of the readings
_POSITION, _VOLTAGE = 'position_m', 'voltage_v'
RAMPS_MIN = 10  # ramps of a run with steps
DECIDES = 0.9  # least coefficient of a quantity that decides the shift alone
PERIOD_SLACK = 0.1  # largest deviation of the period of a ramp from the median, as a share
_SAMPLES_MAX = 1 << 20
_ON_GRID = 1e-4  # least unexplained variance of a shift between the samples
TIED = 1e-9  # largest difference of equal coefficients; the smallest of their lags counts


def predicted_run(experiment: Experiment, stand: Parameters) -> TimeRun:
    """Return the run of a model under the voltage of an experiment, in the times of its sensor."""
    stand = stand.updated(dict(experiment.settings))
    late_s = lateness_in(experiment, stand)
    [found] = predict(stand, [experiment.sensed(late_s=late_s)])
    assert isinstance(experiment.drive, Voltage)
    begins_s = experiment.drive.begins_s
    series = {}
    for each, prediction in zip(experiment.seen, found, strict=True):
        values = behind_low_pass(each, prediction.values)
        series[each.quantity] = Series(each.time_s + begins_s, values, each.unit, _MODEL)
    rows = max(len(each) for each in series.values())
    described = {'stickslip_ros': stickslip_ros.__version__, **stand.flat()}
    notes = (*experiment.drive.notes, *experiment.notes)
    for each in experiment.seen:
        moved = float(np.ptp(series[each.quantity].value))
        if moved < STANDS_STILL * float(np.ptp(each.values)):
            share = moved / float(np.ptp(each.values))
            notes += (f'the range of {each.quantity} of the model is {share:.2g} of that of A',)
    side = Side(_MODEL, _MODEL, rows, described, stand.changed(), notes)
    alignment = Alignment(late_s, 'estimated', decided_by='falls of the voltage')
    return TimeRun(side, series, alignment=alignment if late_s else None)


def align(a: TimeRun, b: TimeRun) -> Alignment:
    """Estimate the shift of B; raise Incomparable without a common quantity that changes."""
    pairs = {name: (_finite(a.series[name]), _finite(b.series[name])) for name in _shared(a, b)}
    pairs = {name: pair for name, pair in pairs.items() if min(map(len, pair)) > 1}
    if not pairs:
        hint = 'give --shift instead of --align'
        raise Incomparable('the shift', 'needs more than one sample of a quantity', hint)
    changing = {
        name: pair
        for name, pair in pairs.items()
        if all(np.ptp(each.value) > 0.0 for each in pair)
    }
    found = list[Alignment]()
    if _VOLTAGE in changing:
        one, other = changing[_VOLTAGE]
        clock = clock_shift(one.time_s, one.value, other.time_s, other.value, sampled=True)
        if clock.coefficient >= TRUSTED:
            number, error_s = clock.coefficient, clock.error_s
            told = _VOLTAGE, tuple(clock.doubts())
            found = [Alignment(clock.shift_s, 'estimated', number, None, error_s, *told)]
            del changing[_VOLTAGE]
            if not clock.doubts():
                return found[0]
    for name, pair in changing.items():
        each = estimate_alignment([pair])
        if (each.correlation or 0.0) > DECIDES:
            found.append(replace(each, decided_by=name))
    if found:
        return min(found, key=lambda each: each.error_s or 0.0)
    both = replace(estimate_alignment(list(pairs.values())), decided_by=', '.join(changing))
    if (both.correlation or 0.0) < TRUSTED:
        problem = f'has a best correlation of {both.correlation:.3f}, below {TRUSTED:g}'
        hint = 'give --shift, or two records of the same motion'
        raise Incomparable('the shift', problem, hint)
    return both


def compare_runs(a: TimeRun, b: TimeRun, *, offset: bool = False) -> tuple[Compared, ...]:
    """Compare all common quantities at A's times; ``offset`` moves B's position to A's zero."""
    found = []
    for name in _shared(a, b):
        series_a, series_b = a.series[name], b.series[name]
        spans_s = [
            (float(each.time_s[0]), float(each.time_s[-1])) for each in (series_a, series_b)
        ]
        start_s, end_s = max(span[0] for span in spans_s), min(span[1] for span in spans_s)
        if start_s > end_s:
            ranges = [f'{first_s:.6g} s to {last_s:.6g} s' for first_s, last_s in spans_s]
            raise Incomparable(
                f'{name} of {b.side.origin}',
                f'covers {ranges[1]}, that of {a.side.origin} {ranges[0]}',
                'shift B with --shift or --align',
            )
        inside = series_a.window(start_s, end_s)
        values_b = np.interp(inside.time_s, series_b.time_s, series_b.value)
        usable = np.isfinite(inside.value) & np.isfinite(values_b)
        if not usable.any():
            problem = f'has no numbers at common times in {a.side.origin} and {b.side.origin}'
            raise Incomparable(name, problem, 'compare another run')
        chosen = slice(None) if usable.all() else usable  # a copy of a long record takes room
        time_s = inside.time_s[chosen]
        known = [run.series[each] for run in (a, b) if (each := sigma_name(name)) in run.series]
        terms = [np.interp(time_s, each.time_s, each.value) for each in known]
        sigma = np.sqrt(np.sum(np.square(terms), axis=0)) if terms else None
        of_a, of_b = inside.value[chosen], values_b[chosen]
        moved = float(np.median(of_a - of_b)) if offset and name == _POSITION else 0.0
        of_b += moved  # interpolated, so that it is nobody else's
        part = Part({}, TIME_COLUMN, time_s, of_a, of_b, sigma)
        found.append(Compared(name, (part,), len(inside) - len(time_s), moved))
    return tuple(found)


def steps_of(run: TimeRun) -> StepStatistics | None:
    """
    Return the steps in the second half of a run, from ramp to ramp of its voltage.

    The ramps are the rises between 40 and 60 % of the voltage range, or the falls if these last
    longer: there the runner is slow too. None with fewer than ten ramps.

    """
    if not {_VOLTAGE, _POSITION} <= run.series.keys():
        return None
    voltage, position = (_finite(run.series[name]) for name in (_VOLTAGE, _POSITION))
    if min(len(voltage), len(position)) < 2 or not np.ptp(voltage.value) > 0.0:
        return None
    time_s, share = voltage.time_s, (voltage.value - voltage.value.min()) / np.ptp(voltage.value)
    outside = np.flatnonzero(np.abs(share - 0.5) > 0.1)
    changes = np.flatnonzero(np.diff(share[outside] > 0.5))
    if len(changes) < 2 * RAMPS_MIN:
        return None
    starts, ends = outside[changes], outside[changes + 1]
    lasts_s = time_s[ends] - time_s[starts]
    ways = slice(0, None, 2), slice(1, None, 2)  # rises and falls follow each other
    after = ends[max(ways, key=lambda way: np.median(lasts_s[way]))]
    before, level = after - 1, 0.6 if share[after[0]] > 0.5 else 0.4
    passed = (level - share[before]) / (share[after] - share[before])
    times_s = time_s[before] + passed * (time_s[after] - time_s[before])
    places_m = np.interp(times_s, position.time_s, position.value)
    periods_s = np.diff(times_s)
    is_regular = np.abs(periods_s / np.median(periods_s) - 1.0) <= PERIOD_SLACK
    steps_m = np.diff(places_m)[is_regular]
    steps_m = steps_m[len(steps_m) // 2 :]
    return StepStatistics(len(steps_m), float(np.mean(steps_m)), *scatter_of(steps_m))


def _finite(series: Series) -> Series:
    known = np.isfinite(series.value)
    if known.all():
        return series
    return replace(series, time_s=series.time_s[known], value=series.value[known])


def _shared(a: TimeRun, b: TimeRun) -> list[str]:
    names = [name for name in a.quantities if name in b.quantities]
    if not names:
        has = [', '.join(run.quantities) or 'nothing' for run in (a, b)]
        problem = f'has {has[1]}, {a.side.origin} has {has[0]}'
        raise Incomparable(b.side.origin, problem, 'compare runs that share a quantity')
    return names


def estimate_alignment(pairs: Sequence[tuple[Series, Series]]) -> Alignment:
    """
    Estimate the shift of B to A from finite quantities of both, two samples or more.

    All are interpolated to even times. The best whole number of samples has the largest mean of
    Pearson's coefficients over the quantities, each over the overlap. A parabola through it and
    its neighbours refines it. Its error is a sample, the wander of the clock, or the distance of
    the farthest peak that is as good. Raises Incomparable if no quantity changes in both.

    """
    runs = [[pair[side] for pair in pairs] for side in (0, 1)]
    series = [*runs[0], *runs[1]]
    finest_s = min(float(np.median(np.diff(np.unique(each.time_s)))) for each in series)
    longest_s = max(float(each.time_s[-1] - each.time_s[0]) for each in series)
    step_s = max(finest_s, longest_s / _SAMPLES_MAX)
    starts_s, values = list[float](), list[Array]()
    for run in runs:  # on even times, shape (quantities, n)
        start_s = max(float(each.time_s[0]) for each in run)
        end_s = min(float(each.time_s[-1]) for each in run)
        count = int(np.floor((end_s - start_s) / step_s + 0.5)) + 1 if end_s >= start_s else 1
        times_s = start_s + step_s * np.arange(count)
        starts_s.append(start_s)
        values.append(np.array([np.interp(times_s, each.time_s, each.value) for each in run]))
    a, b = values
    scores = _scores(a, b)
    lags = np.arange(1 - b.shape[1], a.shape[1])
    tied = np.flatnonzero(scores >= np.max(scores) - TIED)
    offset_s = starts_s[0] - starts_s[1]
    best = int(tied[np.argmin(np.abs(offset_s + step_s * lags[tied]))])
    vertex = 0.0
    if 0 < best < len(scores) - 1:
        before, middle, after = (float(value) for value in scores[best - 1 : best + 2])
        bend = before - 2.0 * middle + after
        vertex = 0.0 if bend >= 0.0 else float(np.clip(0.5 * (before - after) / bend, -0.5, 0.5))
    shift_s = offset_s + step_s * (float(lags[best]) + vertex)
    around = np.pad(scores, 1, constant_values=-1.0)
    tops = (scores >= around[:-2]) & (scores >= around[2:])
    alike_s = offset_s + step_s * lags[tops & as_good(scores, scores[best], _ON_GRID)]
    wanders_s = [_wander_of(*pair, shift_s, step_s) for pair in pairs]
    error_s = max(step_s, *wanders_s) + farthest_s([shift_s, *alike_s], shift_s)
    return Alignment(shift_s, 'estimated', float(scores[best]), step_s, error_s)


def _wander_of(a: Series, b: Series, shift_s: float, step_s: float) -> float:
    """Return the largest further shift of a part of B to A."""
    at_s = b.time_s + shift_s
    inside = (at_s >= a.time_s[0]) & (at_s <= a.time_s[-1])
    before, there, after = (
        np.interp(at_s[inside] + each, a.time_s, a.value) for each in (-step_s, 0.0, step_s)
    )
    columns = np.column_stack((there, np.ones(len(there))))
    gains = np.linalg.lstsq(columns, b.value[inside], rcond=None)[0]
    return wander_s(
        gains[0] * (after - before) / (2.0 * step_s), b.value[inside] - columns @ gains
    )


def _scores(a: Array, b: Array) -> Array:
    """Return the mean coefficient at each lag; -1 with too short an overlap."""
    found = [
        coefficients(one - one.mean(), other - other.mean())
        for one, other in zip(a, b, strict=True)
        if np.ptp(one) > 0.0 and np.ptp(other) > 0.0
    ]
    if not found:
        hint = 'record a motion, or give --shift'
        raise Incomparable('the shift', 'needs a quantity that changes in both', hint)
    overlap = overlaps(a.shape[1], b.shape[1])[2]
    is_enough = overlap >= OVERLAP_MIN * min(a.shape[1], b.shape[1])
    return np.where(is_enough, np.mean(found, axis=0), -1.0)
