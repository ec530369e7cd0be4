# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A measurement from any source: quantities over time, or points by amplitude."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.errors import RecordingError
from stickslip_ros.lab.measurements.mapped import mapped_series, parse_map, topic_of
from stickslip_ros.lab.measurements.numbers import NUMBERS, sigma_name
from stickslip_ros.lab.measurements.recorded import recorded_series, recorded_stand
from stickslip_ros.lab.measurements.sweep_table import RUN_COLUMNS, STEP_BACK, is_sweep, read_table
from stickslip_ros.lab.measurements.table_options import TABLE_DEFAULTS, TableOptions
from stickslip_ros.lab.measurements.tables import (
    listed_sources,
    parse_experiment,
    read_experiment,
    read_joined,
)
from stickslip_ros.lab.measurements.vocabulary import (
    BY_AMPLITUDE,
    MEASURED,
    OVER_TIME,
    TIME_COLUMNS,
    MeasuredTable,
)
from stickslip_ros.lab.readers.columns import Column
from stickslip_ros.lab.readers.formats import DATA_FRAME
from stickslip_ros.parameters import Parameters, Scalar, bare_name
from stickslip_ros.recording.integrity import is_recording
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.run_file import (
    EXPERIMENT_FILE,
    PARAMETERS_FILE,
    RUN_RECORD,
    TIME_ORIGIN,
)
from stickslip_ros.recording.series import Series

if TYPE_CHECKING:
    from pandas import DataFrame

NOT_COMPARED = {'wall_start', TIME_ORIGIN, 'seed', 'dt_s'}
"""Metadata that differ between equal runs, or repeat the parameters."""
_STROKES = 'amplitude_m', 'voltage_v'
NO_SETTINGS = {each for name in (*_STROKES, *NUMBERS) for each in (name, sigma_name(name))}
NO_SETTINGS |= {'row', 'displacement_m', 'normal_n', 'rig_n_per_m'}
RENAMED = {'force_mean_n': 'force_n'}
"""Columns of a sweep and their names in an experiment."""
SAME = 1e-9  # largest relative difference of equal numbers


@dataclass(frozen=True)
class Side:
    """A side of a comparison: a file or the model, with its known settings."""

    origin: str  # file, or ``model``
    kind: str
    rows: int  # rows of a table, or samples of a run's finest quantity
    described: dict[str, Scalar]  # parameters, seed, versions, columns with one value
    changed: dict[str, Scalar] | None  # parameters that differ from the default; None: unknown
    notes: tuple[str, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Return an object for JSON, without the description."""
        return {name: value for name, value in vars(self).items() if name != 'described'}


@dataclass(frozen=True, eq=False)
class TimeRun:
    """Quantities over time, and known uncertainties, by column names of experiment files."""

    side: Side
    series: dict[str, Series]
    recording: Recording | None = None  # source of commands too
    alignment: Any = None  # to the times of another run
    topics: Mapping[str, str] = field(default_factory=dict)  # mapped, of another program

    def sigma(self, name: str) -> float | None:
        """Return the typical uncertainty of a quantity; None if unknown."""
        each = self.series.get(sigma_name(name))
        return None if each is None else float(np.median(each.value))

    @property
    def quantities(self) -> list[str]:
        return [name for name in MEASURED[OVER_TIME] if name in self.series]

    @property
    def frame(self) -> 'DataFrame':
        """All quantities over ``time_s``; NaN for missing samples."""
        return table_of_series(self.series, self.side.origin)

    def within(self, start_s: float, end_s: float) -> 'TimeRun':
        series = {name: each.window(start_s, end_s) for name, each in self.series.items()}
        series = {name: each for name, each in series.items() if len(each)}
        rows = max(map(len, series.values()), default=0)
        return replace(self, series=series, side=replace(self.side, rows=rows))

    def moved(self, alignment: Any) -> 'TimeRun':
        """Return the run on the clock of another run."""
        series = {
            name: replace(each, time_s=each.time_s + alignment.shift_s)
            for name, each in self.series.items()
        }
        return replace(self, series=series, alignment=alignment)


@dataclass(frozen=True, eq=False)
class PointTable:
    """Points of force curves, by column names of an experiment file."""

    side: Side
    columns: dict[str, list[Scalar]]

    @property
    def axis(self) -> str:
        """Column of the axis: rows of a loop, strokes, voltages, or else preloads."""
        return next(each for each in ('row', *_STROKES, 'preload_n') if each in self.columns)

    @property
    def quantities(self) -> list[str]:
        return [name for name in NUMBERS if name in self.columns]

    @property
    def frame(self) -> 'DataFrame':
        """All columns, the first as index."""
        import pandas as pd  # noqa: PLC0415 - takes long

        return pd.DataFrame(self.columns).set_index(next(iter(self.columns)))

    @property
    def settings(self) -> dict[str, list[Scalar]]:
        """Preload, frequency if known, and other varied parameters, by column."""
        return {name: each for name, each in self.columns.items() if name not in NO_SETTINGS}

    def values(self, name: str, rows: Iterable[int]) -> Array:
        column = self.columns[name]
        return np.array([column[row] for row in rows], dtype=np.float64)

    def rows_of(self, name: str, rows: Iterable[int]) -> list[int]:
        """Return the rows with a number."""
        return [row for row in rows if not math.isnan(float(self.columns[name][row]))]

    def rows_at(self, at: Mapping[str, Scalar]) -> list[int]:
        """Return the rows with these settings, in order along the axis."""
        rows = [
            row
            for row in range(self.side.rows)
            if all(is_same(self.columns[name][row], value) for name, value in at.items())
        ]
        return sorted(rows, key=self.columns[self.axis].__getitem__)

    def groups(self, names: Sequence[str]) -> list[dict[str, Scalar]]:
        """Return the distinct values of some settings, in order of appearance."""
        found: list[dict[str, Scalar]] = []
        for row in range(self.side.rows):
            at = {name: self.columns[name][row] for name in names}
            if not any(all(is_same(at[name], old[name]) for name in names) for old in found):
                found.append(at)
        return found


Measurement = TimeRun | PointTable


class OpenedSource:
    """An opened recording or tables, with the topics or columns to read."""

    source: Any
    topics: Mapping[str, str]


def measured(
    source: Any,  # a path, a table, a Run, a Recording, or a sequence of tables
    reading: TableOptions = TABLE_DEFAULTS,
    *,
    number: int = 0,
    window_s: tuple[float, float] | None = None,
    kind: str | None = None,
    wanted: Sequence[str] = (),
) -> Measurement:
    """Read a source by its content, not its name; of a recording only the window."""
    sources = listed_sources(source)
    if len(sources) > 1:
        for each in sources:
            if recorded := recording_of(each, reading):
                problem = 'is a recording next to other sources'
                raise RecordingError(recorded[0].path, problem, 'give it alone')
        return of_table(read_joined(sources, reading, wanted))
    [one] = sources
    if recorded := recording_of(one, reading):
        recording, topics = recorded
        return of_recording(recording.within(*window_s) if window_s else recording, topics)
    if isinstance(one, OpenedSource):
        reading = replace(reading, headers={**reading.headers, **one.topics})
        return measured(one.source, reading, number=number, kind=kind, wanted=wanted)
    if kind is None and is_sweep(one):
        return of_sweep(one)
    return of_table(read_experiment(one, reading, number=number, kind=kind, measured=wanted))


def measured_alone(
    sources: Sequence[Any], reading: TableOptions = TABLE_DEFAULTS
) -> Recording | Measurement:
    """Return a recording unread, since it may exceed memory; else read all sources."""
    recorded = recording_of(sources[0], reading) if len(sources) == 1 else None
    if recorded is None:
        return measured(sources, reading)
    return of_recording(*recorded) if recorded[1] else recorded[0]


def recording_of(
    source: object, reading: TableOptions
) -> tuple[Recording, Mapping[str, str]] | None:
    """
    Return a recording and the topics to map in it; None for a table.

    A Run keeps its own topics. With several recordings, a recording of this package is read by
    its own names unless it has a mapped topic.

    """
    found, topics = source, dict[str, str]()
    if isinstance(source, OpenedSource):
        found, topics = source.source, {**source.topics}
    if isinstance(found, Path) and is_recording(found):
        found = Recording(found)
    if not isinstance(found, Recording):
        return None
    fields = [each.field for each in parse_map(reading.topics).values()]
    is_meant = any(topic_of(each, found.types) for each in fields)
    if not topics and (is_meant or not (found.is_ours and reading.is_shared)):
        topics = reading.topics
    return found, topics


def attached(run: Measurement, reading: TableOptions = TABLE_DEFAULTS) -> Measurement:
    """Return the experiment attached to a recording."""
    recording = run.recording if isinstance(run, TimeRun) else None
    if recording is None:
        problem = 'has no B and is no recording'
        raise RecordingError(run.side.origin, problem, 'name B, or the word model')
    if EXPERIMENT_FILE not in recording.attachments:
        hint = 'give a file or the word model as B'
        raise RecordingError(recording.path, f'has no attached {EXPERIMENT_FILE}', hint)
    content = recording.attachments[EXPERIMENT_FILE][1]
    return of_table(parse_experiment(content, f'{recording.path} {EXPERIMENT_FILE}', reading))


def of_recording(recording: Recording, topics: Mapping[str, str]) -> TimeRun:
    """Return series and settings of a recording, by mapped ``topics`` if any; refuse none."""
    series, notes = (
        mapped_series(recording, topics) if topics else (recorded_series(recording), [])
    )
    run = recording.metadata.get(RUN_RECORD, {})
    described: dict[str, Scalar] = {key: run[key] for key in run if key not in NOT_COMPARED}
    stand = recorded_stand(recording) if PARAMETERS_FILE in recording.attachments else None
    changed = None if stand is None else stand.changed()
    described |= {} if stand is None else stand.flat()
    if not series:
        problem = f'has neither position, force nor voltage; it holds {", ".join(recording.types)}'
        hint = 'map its topics: --map voltage_v=TOPIC.FIELD --map position_m=TOPIC.FIELD'
        raise RecordingError(recording.path, problem, hint)
    rows = max(len(each) for each in series.values())
    notes = [*recording.notes, *notes]
    side = Side(recording.origin, 'recording', rows, described, changed, tuple(notes))
    return TimeRun(side, series, recording, topics=topics)


def of_table(table: MeasuredTable) -> Measurement:
    """Return the measurement of a table."""
    if table.kind == BY_AMPLITUDE:
        columns = {name: each.tolist() for name, each in table.columns.items()}
        if np.count_nonzero(starts := table.columns.get('row', np.zeros(1)) == 1.0) > 1:
            columns['loop'] = np.cumsum(starts).tolist()  # the number of each friction loop
        rows, described = len(columns['preload_n']), constants(columns)
        return PointTable(
            Side(table.origin, BY_AMPLITUDE, rows, described, None, table.notes), columns
        )
    time_s, series = table.columns['time_s'], {}
    for name, values in table.columns.items():
        known = ~np.isnan(values)
        if name != 'time_s' and known.any():
            origin, unit = f'{table.origin} {name}', TIME_COLUMNS[name].unit
            series[name] = Series(time_s[known], values[known], unit, origin)
    return TimeRun(Side(table.origin, OVER_TIME, len(time_s), {}, None, table.notes), series)


def as_table(run: Measurement) -> MeasuredTable:
    """Return a measurement as columns; over time NaN for missing samples."""
    frame, notes = run.frame.reset_index(), run.side.notes
    columns: dict[str, Array] = {str(name): frame[name].to_numpy() for name in frame}
    if isinstance(run, PointTable):
        return MeasuredTable(run.side.origin, BY_AMPLITUDE, columns, notes)
    read = tuple(
        Column(name, each.origin, each.unit, 1.0, 0, float(each.value[0]))
        for name, each in run.series.items()
    )
    return MeasuredTable(run.side.origin, OVER_TIME, columns, notes, read, gaps=notes)


def of_sweep(table: Any) -> PointTable:
    """Return the points of a sweep's table."""
    rows, described = read_table(table)
    origin = str(table) if isinstance(table, Path) else DATA_FRAME
    columns = {
        RENAMED.get(name, name): [row[name] for row in rows]
        for name in rows[0]
        if name not in RUN_COLUMNS
    }
    # A free runner has steps but no force; a steady held runner has a force but no steps.
    for name in ('step_length_m', STEP_BACK) if any(columns['force_n']) else ('force_n',):
        columns.pop(name, None)
    unsteady = sum(not row['steady'] for row in rows)
    return point_table(columns, origin, 'sweep', described, unsteady)


def point_table(
    columns: dict[str, list[Scalar]],
    origin: str,
    kind: str,
    described: dict[str, Scalar] | None,
    unsteady: int,
    notes: tuple[str, ...] = (),
) -> PointTable:
    """Return columns as points with known settings; a column overrides a described value."""
    rows = len(columns['preload_n'])
    in_columns = {'stand.preload', *map(bare_name, columns)}
    known = {name: each for name, each in (described or {}).items() if name not in in_columns}
    default = Parameters().flat()
    changed = {name: each for name, each in known.items() if default.get(name, each) != each}
    side = Side(
        origin=origin,
        kind=kind,
        rows=rows,
        described={**known, **constants(columns)},
        changed=None if described is None else changed,
        notes=((f'{unsteady} of {rows} runs were not steady',) if unsteady else ()) + notes,
    )
    return PointTable(side, columns)


def is_same(one: Scalar, other: Scalar) -> bool:
    """Return whether two values are equal except for rounding."""
    if isinstance(one, (bool, str)) or isinstance(other, (bool, str)):
        return one == other
    return abs(one - other) <= SAME * max(abs(one), abs(other))


def is_constant(column: Sequence[Scalar]) -> bool:
    """Return whether all values are the same."""
    return all(is_same(value, column[0]) for value in column)


def constants(columns: Mapping[str, Sequence[Scalar]]) -> dict[str, Scalar]:
    """Return the settings with a single value."""
    return {
        bare_name(name): each[0]
        for name, each in columns.items()
        if name not in NO_SETTINGS and is_constant(each)
    }


def table_of_series(found: Mapping[str, Series], source: str) -> 'DataFrame':
    """Return quantities as one table over their times; NaN where unknown."""
    import pandas as pd  # noqa: PLC0415 - takes long

    columns = {
        name: pd.Series(each.value, pd.Index(each.time_s, name='time_s'))
        for name, each in found.items()
    }
    first = next(iter(columns.values()), pd.Series()).index
    is_one = all(each.index.equals(first) for each in columns.values())
    if not is_one:  # a second sample at one time gets its own row
        for name, each in columns.items():
            columns[name] = each.set_axis([each.index, each.groupby(level=0).cumcount()])
    frame = pd.DataFrame(columns) if is_one else pd.DataFrame(columns).droplevel(1)
    frame.attrs['units'] = {'time_s': 's', **{name: each.unit for name, each in found.items()}}
    frame.attrs['source'] = source
    return frame
