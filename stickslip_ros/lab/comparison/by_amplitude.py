# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Compare force curves of sweeps, experiments and the model by preload and stroke."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import stickslip_ros
from stickslip_ros.arrays import Array
from stickslip_ros.lab.comparison.result import (
    AMPLITUDE_COLUMN,
    VOLTAGE_COLUMN,
    Compared,
    Incomparable,
    Part,
    Side,
    threshold_of,
)
from stickslip_ros.lab.experiments.options import ReadingOptions
from stickslip_ros.lab.experiments.predict import predict
from stickslip_ros.lab.experiments.reading import of_points
from stickslip_ros.lab.runs.batch import Progress, pool_of
from stickslip_ros.lab.runs.sweep import STEP_BACK, bare_name
from stickslip_ros.lab.runs.sweep_table import RUN_COLUMNS, read_table
from stickslip_ros.lab.runs.zero_amplitude import WITHOUT_CELL
from stickslip_ros.lab.tables.formats import DATA_FRAME
from stickslip_ros.lab.tables.measured import BY_AMPLITUDE, POINT_COLUMNS, MeasuredTable
from stickslip_ros.lab.tables.numbers import NUMBERS, sigma_name
from stickslip_ros.parameters import Parameters, Scalar
from stickslip_ros.progress import progress_of
from stickslip_ros.units import NM

if TYPE_CHECKING:
    from pandas import DataFrame

MODEL, SWEEP = 'model', 'sweep'
"""Kinds of a side; MODEL also stands for the drive in place of a file."""
PRELOAD_COLUMN, FREQUENCY_COLUMN, FORCE_COLUMN = 'preload_n', 'frequency_hz', 'force_n'
_STROKES = AMPLITUDE_COLUMN, VOLTAGE_COLUMN
NO_SETTINGS = {each for name in (*_STROKES, *NUMBERS) for each in (name, sigma_name(name))}
RENAMED = {'force_mean_n': FORCE_COLUMN}
"""Columns of a sweep with another name in an experiment."""
_SAME = 1e-9  # largest relative difference of equal typed numbers


@dataclass(frozen=True, eq=False)
class PointTable:
    """Points of force curves: columns under the names of an experiment file."""

    side: Side
    columns: dict[str, list[Scalar]]

    @property
    def axis(self) -> str:
        """Column of the axis: strokes, voltages, or preloads of numbers without these."""
        return next(each for each in (*_STROKES, PRELOAD_COLUMN) if each in self.columns)

    @property
    def quantities(self) -> list[str]:
        """Measured quantities."""
        return [name for name in NUMBERS if name in self.columns]

    @property
    def settings(self) -> dict[str, list[Scalar]]:
        """Preload, frequency if known, and other varied parameters, by column."""
        return {name: each for name, each in self.columns.items() if name not in NO_SETTINGS}

    def values(self, name: str, rows: Iterable[int]) -> Array:
        """Return the numbers of a column in some rows."""
        column = self.columns[name]
        return np.array([column[row] for row in rows], dtype=np.float64)

    def rows_of(self, name: str, rows: Iterable[int]) -> list[int]:
        """Return the rows with a number."""
        return [row for row in rows if not math.isnan(float(self.columns[name][row]))]

    def rows_at(self, at: Mapping[str, Scalar]) -> list[int]:
        """Return the rows that have these settings, in their order along the axis."""
        rows = [
            row
            for row in range(self.side.rows)
            if all(_is_same(self.columns[name][row], value) for name, value in at.items())
        ]
        return sorted(rows, key=self.columns[self.axis].__getitem__)

    def groups(self, names: Sequence[str]) -> list[dict[str, Scalar]]:
        """Return the different values of some settings, in the order of their appearance."""
        found: list[dict[str, Scalar]] = []
        for row in range(self.side.rows):
            at = {name: self.columns[name][row] for name in names}
            if not any(all(_is_same(at[name], old[name]) for name in names) for old in found):
                found.append(at)
        return found


def of_experiment(experiment: MeasuredTable) -> PointTable:
    """Return the points of an experiment by amplitude."""
    measured = experiment.columns
    columns = {name: each.tolist() for name, each in measured.items()}
    rows, described = len(columns[PRELOAD_COLUMN]), _constants(columns)
    side = Side(experiment.origin, BY_AMPLITUDE, rows, described, None, experiment.notes)
    return PointTable(side, columns)


def of_sweep(table: 'Path | DataFrame') -> PointTable:
    """Return the points of the table of a sweep."""
    rows, described = read_table(table)
    origin = str(table) if isinstance(table, Path) else DATA_FRAME
    columns = {
        RENAMED.get(name, name): [row[name] for row in rows]
        for name in rows[0]
        if name not in RUN_COLUMNS
    }
    # A free runner makes steps and no force; a held runner that is steady the other way round.
    for name in ('step_length_m', STEP_BACK) if any(columns[FORCE_COLUMN]) else (FORCE_COLUMN,):
        columns.pop(name, None)
    return _point_table(columns, origin, SWEEP, described, sum(not row['steady'] for row in rows))


def of_model(
    table: PointTable,
    parameters: Parameters,
    options: ReadingOptions,
    progress: bool | Progress,
) -> PointTable:
    """
    Return the points of the drive at the settings of a table; equal runs are made once.

    The columns of the table set preload and parameters, the options a frequency without a column.
    Raises StickSlipError if the stand cannot make a point, or a parameter is set and a column.

    """
    names = [name for name in table.settings if name not in POINT_COLUMNS]
    changed = parameters.changed()
    for name in map(bare_name, names):
        if name in changed:
            problem = f'is set, and a column of {table.side.origin} too'
            raise Incomparable(name, problem, 'leave out --set or the column')
    if FORCE_COLUMN not in table.columns and 'step_length_m' in table.columns:
        parameters = parameters.updated(WITHOUT_CELL)
    asked = of_points(table.side.origin, table.columns, parameters, options, names)
    with progress_of(progress, 'runs') as show, pool_of(options.workers) as pool:
        found = predict(parameters, asked, pool=pool, progress=show)
    columns = {table.axis: table.columns[table.axis], **table.settings}
    columns.setdefault(FREQUENCY_COLUMN, [options.frequency_hz] * table.side.rows)
    numbers = (number for [number] in found)
    unsteady = set[int]()
    for name in table.quantities:
        columns[name] = [math.nan] * table.side.rows
        for row in table.rows_of(name, range(table.side.rows)):
            number = next(numbers)
            columns[name][row] = float(number.values[0])
            unsteady |= set() if number.is_steady else {row}
    described = {'stickslip_ros': stickslip_ros.__version__, **parameters.flat()}
    return _point_table(columns, MODEL, MODEL, described, len(unsteady))


def compare(a: PointTable, b: PointTable) -> tuple[Compared, ...]:
    """Compare the quantities of both tables at equal settings, B interpolated to A's strokes."""
    names = [name for name in a.quantities if name in b.quantities]
    if not names:
        problem = f'has {", ".join(b.quantities)}, {a.side.origin} has {", ".join(a.quantities)}'
        hint = 'compare two with a force (held runner), or two with steps (free runner)'
        raise Incomparable(b.side.origin, problem, hint)
    if a.axis != b.axis:
        hint = 'give both with strokes, amplitude_m, or both without'
        raise Incomparable(b.side.origin, f'has no {a.axis} that varies alone', hint)
    settings = [name for name in (PRELOAD_COLUMN, *_varied(a, b)) if name != a.axis]
    shared = [at for at in a.groups(settings) if b.rows_at(at)]
    quantities = []
    for name in names:
        parts = tuple(part for at in shared if (part := _part(a, b, at, name)) is not None)
        if not parts:
            ranges = []
            for table in (a, b):
                preloads_n = dict.fromkeys(table.columns[PRELOAD_COLUMN])
                ranges.append(f'{", ".join(f"{n:g}" for n in preloads_n)} N')
                if table.axis == AMPLITUDE_COLUMN:
                    nm = NM * table.values(AMPLITUDE_COLUMN, range(table.side.rows))
                    ranges[-1] += f', {min(nm):.5g} to {max(nm):.5g} nm'
            problem = f'({ranges[0]}) has no point within {b.side.origin} ({ranges[1]})'
            hint = f'compute its points with: stickslip compare {a.side.origin} model'
            raise Incomparable(a.side.origin, problem, hint)
        left_out = len(a.rows_of(name, range(a.side.rows))) - sum(len(part.x) for part in parts)
        quantities.append(Compared(name, parts, left_out))
    return tuple(quantities)


def _point_table(
    columns: dict[str, list[Scalar]],
    origin: str,
    kind: str,
    described: dict[str, Scalar] | None,
    unsteady: int,
) -> PointTable:
    """Return columns as points, with their known settings; a column replaces a description."""
    rows = len(columns[PRELOAD_COLUMN])
    in_columns = {'stand.preload', *map(bare_name, columns)}
    known = {name: each for name, each in (described or {}).items() if name not in in_columns}
    default = Parameters().flat()
    changed = {name: each for name, each in known.items() if default.get(name, each) != each}
    side = Side(
        origin=origin,
        kind=kind,
        rows=rows,
        described={**known, **_constants(columns)},
        changed=None if described is None else changed,
        notes=(f'{unsteady} of {rows} runs were not steady',) if unsteady else (),
    )
    return PointTable(side, columns)


def _is_same(one: Scalar, other: Scalar) -> bool:
    """Return whether two values are equal apart from the rounding of typed numbers."""
    if isinstance(one, (bool, str)) or isinstance(other, (bool, str)):
        return one == other
    return abs(one - other) <= _SAME * max(abs(one), abs(other))


def _is_constant(column: Sequence[Scalar]) -> bool:
    return all(_is_same(value, column[0]) for value in column)


def _constants(columns: Mapping[str, Sequence[Scalar]]) -> dict[str, Scalar]:
    """Return the settings with one value only."""
    return {
        bare_name(name): each[0]
        for name, each in columns.items()
        if name not in NO_SETTINGS and _is_constant(each)
    }


def _varied(a: PointTable, b: PointTable) -> list[str]:
    """Return the settings besides the preload by which rows are matched."""
    varied = [
        name
        for table in (a, b)
        for name, each in table.settings.items()
        if name != PRELOAD_COLUMN and not _is_constant(each)
    ]
    for name in varied:
        for table, other in ((a, b), (b, a)):
            if name not in table.columns:
                problem = f'varies {name}, which {table.side.origin} does not have'
                raise Incomparable(other.side.origin, problem, 'keep one value of it')
    return list(dict.fromkeys(varied))


def _part(a: PointTable, b: PointTable, at: dict[str, Scalar], name: str) -> Part | None:
    rows_a, rows_b = a.rows_of(name, a.rows_at(at)), b.rows_of(name, b.rows_at(at))
    if not rows_a or not rows_b:
        return None
    nodes_m, nodes = _averaged(b, name, rows_b)
    edge_m = _SAME * nodes_m[-1]
    strokes_m = a.values(a.axis, rows_a)
    is_inside = (nodes_m[0] - edge_m <= strokes_m) & (strokes_m <= nodes_m[-1] + edge_m)
    inside = [row for row, each in zip(rows_a, is_inside, strict=True) if each]
    if not inside:
        return None
    x_m, values_a = a.values(a.axis, inside), a.values(name, inside)
    sigma = _sigma(a, b, name, inside, rows_b)
    part = Part(at, a.axis, x_m, values_a, np.interp(x_m, nodes_m, nodes), sigma)
    if name != FORCE_COLUMN:
        return part
    threshold_a = threshold_of(strokes_m, a.values(name, rows_a))
    return replace(part, threshold_a=threshold_a, threshold_b=threshold_of(nodes_m, nodes))


def _averaged(table: PointTable, name: str, rows: Sequence[int]) -> tuple[Array, Array]:
    """Return rising strokes and the means of a column there."""
    nodes_m, index = np.unique(table.values(table.axis, rows), return_inverse=True)
    return nodes_m, np.bincount(index, table.values(name, rows)) / np.bincount(index)


def _sigma(
    a: PointTable, b: PointTable, name: str, rows_a: Sequence[int], rows_b: Sequence[int]
) -> Array | None:
    """Return the uncertainty of B - A; that of an amplitude counts by the slope of B."""
    x_m = a.values(a.axis, rows_a)
    terms, (nodes_m, nodes) = [], _averaged(b, name, rows_b)
    slope = np.full(len(x_m), np.nan)  # of B, unless it has one amplitude only
    if len(nodes_m) > 1:
        slope = np.interp(x_m, nodes_m, np.gradient(nodes, nodes_m))
    for what, factor in ((name, 1.0), (AMPLITUDE_COLUMN, slope)):
        sigma = sigma_name(what)
        if sigma in a.columns:
            terms.append(factor * a.values(sigma, rows_a))
        if sigma in b.columns:
            terms.append(factor * np.interp(x_m, *_averaged(b, sigma, rows_b)))
    return np.sqrt(np.sum(np.square(terms), axis=0)) if terms else None
