# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Compare runs quantity by quantity over their common time."""

from dataclasses import replace

import numpy as np

import stickslip_ros
from stickslip_ros.lab.comparison.by_amplitude import MODEL
from stickslip_ros.lab.comparison.clock_shift import TRUSTED, clock_shift
from stickslip_ros.lab.comparison.result import (
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
from stickslip_ros.lab.measurements.numbers import sigma_name
from stickslip_ros.lab.runs.sawtooth_run import scatter_of
from stickslip_ros.parameters import Parameters
from stickslip_ros.recording.series import Series

STANDS_STILL = 0.05  # least range of the model relative to the readings'
_POSITION, _VOLTAGE = 'position_m', 'voltage_v'
_SAMPLES_MIN = 4  # least samples to estimate a shift
RAMPS_MIN = 10  # least ramps of a run with steps
PERIOD_SLACK = 0.1  # largest relative deviation of a ramp's period from the median


def predicted_run(experiment: Experiment, stand: Parameters) -> TimeRun:
    """Simulate a stand under the voltage of an experiment; return it at the sensor's times."""
    stand = stand.updated(dict(experiment.settings))
    late_s = lateness_in(experiment, stand)
    [found] = predict(stand, [experiment.sensed(late_s=late_s)])
    assert isinstance(experiment.drive, Voltage)
    begins_s = experiment.drive.begins_s
    series = {}
    for each, prediction in zip(experiment.observed, found, strict=True):
        values = behind_low_pass(each, prediction.values)
        series[each.quantity] = Series(each.time_s + begins_s, values, each.unit, MODEL)
    rows = max(len(each) for each in series.values())
    described = {'stickslip_ros': stickslip_ros.__version__, **stand.flat()}
    notes = (*experiment.drive.notes, *experiment.notes)
    for each in experiment.observed:
        moved = float(np.ptp(series[each.quantity].value))
        if moved < STANDS_STILL * float(np.ptp(each.values)):
            share = moved / float(np.ptp(each.values))
            notes += (f'the model covers only {share:.2g} of the range of {each.quantity} of A',)
    side = Side(MODEL, MODEL, rows, described, stand.changed(), notes)
    alignment = Alignment(late_s, 'estimated', decided_by='falls of the voltage')
    return TimeRun(side, series, alignment=alignment if late_s else None)


def align(a: TimeRun, b: TimeRun) -> Alignment:
    """
    Estimate the shift of B from the voltage, else from the quantity with the smallest error.

    Raises Incomparable without a common quantity with correlated changes.

    """
    found, coefficients = list[Alignment](), list[float]()
    for name in sorted(_shared(a, b), key=_VOLTAGE.__ne__):
        one, other = _finite(a.series[name]), _finite(b.series[name])
        if min(len(one), len(other)) < _SAMPLES_MIN or not np.ptp(one.value) * np.ptp(other.value):
            continue
        shift = clock_shift(one, other, name)
        coefficients.append(shift.correlation or 0.0)
        if coefficients[-1] >= TRUSTED:
            found.append(shift)
        if found and name == _VOLTAGE and not shift.doubts:
            return shift
    if found:
        return min(found, key=lambda each: each.error_s or 0.0)
    if coefficients:
        problem = f'has a best correlation of {max(coefficients):.3f}, below {TRUSTED:g}'
        hint = 'give --shift, or two records of the same motion'
        raise Incomparable('the shift', problem, hint)
    problem = f'needs {_SAMPLES_MIN} samples of a quantity that changes in both'
    raise Incomparable('the shift', problem, 'give --shift instead of --align')


def compare_runs(a: TimeRun, b: TimeRun, *, offset: bool = False) -> tuple[Compared, ...]:
    """Compare all common quantities at A's times; ``offset`` shifts B's position to A's zero."""
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
                f'covers {ranges[1]}, but {a.side.origin} covers {ranges[0]}',
                'shift B with --shift or --align',
            )
        inside = series_a.window(start_s, end_s)
        values_b = np.interp(inside.time_s, series_b.time_s, series_b.value)
        usable = np.isfinite(inside.value) & np.isfinite(values_b)
        if not usable.any():
            problem = f'has no numbers at common times in {a.side.origin} and {b.side.origin}'
            raise Incomparable(name, problem, 'compare another run')
        chosen = slice(None) if usable.all() else usable  # a slice avoids a copy of a long record
        time_s = inside.time_s[chosen]
        known = [run.series[each] for run in (a, b) if (each := sigma_name(name)) in run.series]
        terms = [np.interp(time_s, each.time_s, each.value) for each in known]
        sigma = np.sqrt(np.sum(np.square(terms), axis=0)) if terms else None
        of_a, of_b = inside.value[chosen], values_b[chosen]
        moved = float(np.median(of_a - of_b)) if offset and name == _POSITION else 0.0
        of_b += moved  # in place: `values_b` is not shared
        part = Part({}, 'time_s', time_s, of_a, of_b, sigma)
        found.append(Compared(name, (part,), len(inside) - len(time_s), moved))
    return tuple(found)


def steps_of(run: TimeRun) -> StepStatistics | None:
    """
    Return the steps in the second half of a run, from ramp to ramp of its voltage.

    Ramps are the rises from 40 to 60 % of the voltage range, or the falls if they are slower: the
    runner is slow there too. None with fewer than ten ramps.

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
    ways = slice(0, None, 2), slice(1, None, 2)  # rises and falls alternate
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
