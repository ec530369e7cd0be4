"""Runs against each other: quantity by quantity in the time that both cover."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from stickslip_ros.comparison.result import (
    TIME,
    Alignment,
    Compared,
    Incomparable,
    Part,
    Side,
    StepStatistics,
)
from stickslip_ros.contact.profile import Array
from stickslip_ros.parameters import Scalar, parse_yaml
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.run_file import PARAMETERS_FILE, RUN_RECORD, TIME_ORIGIN
from stickslip_ros.recording.series import Series
from stickslip_ros.runs.mapped import mapped_series
from stickslip_ros.runs.recorded_run import recorded_series
from stickslip_ros.runs.sawtooth_run import scatter_of
from stickslip_ros.tables.columns import sigma_name
from stickslip_ros.tables.experiment import MEASURED, OVER_TIME, TIME_COLUMNS, Experiment

RECORDING = 'recording'
POSITION, VOLTAGE = 'position_m', 'voltage_v'
NOT_COMPARED = {'wall_start', TIME_ORIGIN, 'seed', 'dt_s'}
"""Metadata that differ by chance, or that the parameters repeat."""
RAMPS_MIN = 10  # fewer make no steps to speak of
PERIOD_SLACK = 0.1  # ramps follow each other in the median of their periods, within this share
SAMPLES_MAX = 1 << 20
OVERLAP_MIN = 0.5
"""Share of the shorter run that must overlap: a short overlap correlates by chance."""
TIED = 1e-9  # coefficients this near are the same; of these lags the smallest counts
NO_SPREAD = 1e-9  # variance, relative to that of the whole run, below which a stretch is constant


@dataclass(frozen=True, eq=False)
class TimeRun:
    """Quantities over time, and uncertainties where known, under the names of experiment files."""

    side: Side
    series: dict[str, Series]

    @property
    def quantities(self) -> list[str]:
        """What was measured."""
        return [name for name in MEASURED[OVER_TIME] if name in self.series]

    def within(self, start_s: float, end_s: float) -> 'TimeRun':
        """Return a stretch of the run."""
        series = {name: each.window(start_s, end_s) for name, each in self.series.items()}
        series = {name: each for name, each in series.items() if len(each)}
        rows = max(map(len, series.values()), default=0)
        return replace(self, series=series, side=replace(self.side, rows=rows))

    def moved(self, shift_s: float) -> 'TimeRun':
        """Return the run with other times."""
        series = {
            name: replace(each, time_s=each.time_s + shift_s) for name, each in self.series.items()
        }
        return replace(self, series=series)


def of_recording(recording: Recording, topics: Mapping[str, str]) -> TimeRun:
    """
    Return what a recording holds over time, and what it says of itself.

    One of another program holds what ``topics`` say, if they say anything.

    """
    is_mapped = topics and RUN_RECORD not in recording.metadata
    series = mapped_series(recording, topics) if is_mapped else recorded_series(recording)
    run = recording.metadata.get(RUN_RECORD, {})
    described: dict[str, Scalar] = {key: run[key] for key in run if key not in NOT_COMPARED}
    changed = None
    if PARAMETERS_FILE in recording.attachments:
        text = recording.attachments[PARAMETERS_FILE][1].decode()
        parameters = parse_yaml(text, f'{recording.path} {PARAMETERS_FILE}')
        described |= parameters.flat()
        changed = parameters.changed()
    rows = max((len(each) for each in series.values()), default=0)
    return TimeRun(Side(str(recording.path), RECORDING, rows, described, changed), series)


def of_experiment(experiment: Experiment) -> TimeRun:
    """Return the run that an experiment over time holds."""
    time_s, series = experiment.columns['time_s'], {}
    for name, values in experiment.columns.items():
        known, unit = ~np.isnan(values), TIME_COLUMNS[name].unit
        if name != 'time_s' and known.any():
            origin = f'{experiment.origin} {name}'
            series[name] = Series(time_s[known], values[known], unit, origin)
    side = Side(experiment.origin, OVER_TIME, len(time_s), {}, None, experiment.notes)
    return TimeRun(side, series)


def align(a: TimeRun, b: TimeRun) -> Alignment:
    """Estimate by how much B must be shifted; Incomparable if they share nothing that changes."""
    pairs = [(_finite(a.series[name]), _finite(b.series[name])) for name in _shared(a, b)]
    pairs = [pair for pair in pairs if min(map(len, pair)) > 1]
    if not pairs:
        hint = 'give --shift instead of --align'
        raise Incomparable('the lag', 'cannot be found in single samples', hint)
    return estimate_alignment(pairs)


def compare(a: TimeRun, b: TimeRun, *, offset: bool = False) -> tuple[Compared, ...]:
    """
    Compare every quantity that both runs have, at A's times within both.

    The zero of a position is arbitrary: with ``offset`` that of B is moved onto A's.

    """
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
                f'is there from {ranges[1]}, that of {a.side.origin} from {ranges[0]}',
                'move B with --shift or --align',
            )
        inside = series_a.window(start_s, end_s)
        values_b = np.interp(inside.time_s, series_b.time_s, series_b.value)
        usable = np.isfinite(inside.value) & np.isfinite(values_b)
        if not usable.any():
            problem = f'is a number at no time in both {a.side.origin} and {b.side.origin}'
            raise Incomparable(name, problem, 'compare another run')
        time_s = inside.time_s[usable]
        known = [run.series[each] for run in (a, b) if (each := sigma_name(name)) in run.series]
        terms = [np.interp(time_s, each.time_s, each.value) for each in known]
        sigma = np.sqrt(np.sum(np.square(terms), axis=0)) if terms else None
        of_a, of_b = inside.value[usable], values_b[usable]
        moved = float(np.median(of_a - of_b)) if offset and name == POSITION else 0.0
        part = Part({}, TIME, time_s, of_a, of_b + moved, sigma)
        found.append(Compared(name, (part,), len(inside) - len(time_s), moved))
    return tuple(found)


def steps_of(run: TimeRun) -> StepStatistics | None:
    """
    Return the steps of the second half of a run, from ramp to ramp of its voltage.

    Rises between 40 and 60 % of the range of the voltage are ramps if they last longer than the
    falls, else falls are: there the runner is slow too. None of fewer than ten ramps.

    """
    if not {VOLTAGE, POSITION} <= run.series.keys():
        return None
    voltage, position = (_finite(run.series[name]) for name in (VOLTAGE, POSITION))
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
    is_alike = np.abs(periods_s / np.median(periods_s) - 1.0) <= PERIOD_SLACK
    steps_m = np.diff(places_m)[is_alike]
    steps_m = steps_m[len(steps_m) // 2 :]
    return StepStatistics(len(steps_m), float(np.mean(steps_m)), *scatter_of(steps_m))


def _finite(series: Series) -> Series:
    known = np.isfinite(series.value)
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
    Estimate the shift that lays B onto A, of quantities of both: finite, two samples or more.

    All are interpolated onto even times. For each whole number of samples with enough overlap
    Pearson's coefficient of each quantity is taken over the overlap; the best shift has the
    largest mean over the quantities. A parabola through it and its neighbours refines it. Raises
    Incomparable if no quantity changes in both.

    """
    runs = [[pair[side] for pair in pairs] for side in (0, 1)]
    series = [*runs[0], *runs[1]]
    finest_s = min(float(np.median(np.diff(np.unique(each.time_s)))) for each in series)
    longest_s = max(float(each.time_s[-1] - each.time_s[0]) for each in series)
    step_s = max(finest_s, longest_s / SAMPLES_MAX)
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
    return Alignment(shift_s, 'estimated', float(scores[best]), step_s)


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
    size = 1 << (len(lags) - 1).bit_length()
    spectrum = np.fft.rfft(a, size) * np.conj(np.fft.rfft(b, size))
    wrapped = np.fft.irfft(spectrum, size)
    products = np.concatenate((wrapped[size - (len(b) - 1) :], wrapped[: len(a)]))
    covariance = products / safe - sum_a * sum_b / safe**2
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
