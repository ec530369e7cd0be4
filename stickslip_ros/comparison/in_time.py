"""Runs against each other: quantity by quantity in the time that both cover."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from stickslip_ros.comparison.agreement import TIME, Part
from stickslip_ros.comparison.lag import estimate_alignment
from stickslip_ros.comparison.result import Alignment, Compared, Incomparable, Side
from stickslip_ros.contact.profile import Array
from stickslip_ros.parameters import Scalar, parse_yaml
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.run_file import PARAMETERS_FILE, RUN_RECORD, TIME_ORIGIN
from stickslip_ros.recording.series import Series
from stickslip_ros.runs.mapped import mapped_series
from stickslip_ros.runs.recorded_run import recorded_series
from stickslip_ros.tables.columns import sigma_name
from stickslip_ros.tables.experiment import (
    MEASURED,
    OVER_TIME,
    TIME_COLUMNS,
    Experiment,
)

RECORDING = 'recording'
POSITION = 'position_m'
NOT_COMPARED = {'wall_start', TIME_ORIGIN, 'seed', 'dt_s'}
"""Of the metadata: chance, and what stands among the parameters too."""


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
    time_s = experiment.columns['time_s']
    series = {
        name: Series(time_s, values, TIME_COLUMNS[name].unit, f'{experiment.origin} {name}')
        for name, values in experiment.columns.items()
        if name != 'time_s'
    }
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

    Raises
    ------
    Incomparable
        If they share no quantity or no time.

    """
    return tuple(
        _compare(a, b, name, offset=offset and name == POSITION) for name in _shared(a, b)
    )


def _shared(a: TimeRun, b: TimeRun) -> list[str]:
    names = [name for name in a.quantities if name in b.quantities]
    if not names:
        has = [', '.join(run.quantities) or 'nothing' for run in (a, b)]
        problem = f'has {has[1]}, {a.side.origin} has {has[0]}'
        raise Incomparable(b.side.origin, problem, 'compare runs that share a quantity')
    return names


def _compare(a: TimeRun, b: TimeRun, name: str, *, offset: bool) -> Compared:
    series_a, series_b = a.series[name], b.series[name]
    spans_s = [(float(each.time_s[0]), float(each.time_s[-1])) for each in (series_a, series_b)]
    start_s, end_s = max(span[0] for span in spans_s), min(span[1] for span in spans_s)
    if start_s > end_s:
        told = [f'{first_s:.6g} s to {last_s:.6g} s' for first_s, last_s in spans_s]
        raise Incomparable(
            f'{name} of {b.side.origin}',
            f'is there from {told[1]}, that of {a.side.origin} from {told[0]}',
            'move B with --shift or --align',
        )
    inside = series_a.window(start_s, end_s)
    values_b = np.interp(inside.time_s, series_b.time_s, series_b.value)
    usable = np.isfinite(inside.value) & np.isfinite(values_b)
    if not usable.any():
        problem = f'is a number at no time in both {a.side.origin} and {b.side.origin}'
        raise Incomparable(name, problem, 'compare another run')
    time_s = inside.time_s[usable]
    sigma = _sigma(a, b, name, time_s)
    of_a, of_b = inside.value[usable], values_b[usable]
    moved = float(np.median(of_a - of_b)) if offset else 0.0
    part = Part({}, TIME, time_s, of_a, of_b + moved, sigma)
    return Compared(name, (part,), len(inside) - len(time_s), moved)


def _sigma(a: TimeRun, b: TimeRun, name: str, time_s: Array) -> Array | None:
    known = [run.series[sigma] for run in (a, b) if (sigma := sigma_name(name)) in run.series]
    terms = [np.interp(time_s, each.time_s, each.value) for each in known]
    return np.sqrt(np.sum(np.square(terms), axis=0)) if terms else None


def _finite(series: Series) -> Series:
    known = np.isfinite(series.value)
    return replace(series, time_s=series.time_s[known], value=series.value[known])
