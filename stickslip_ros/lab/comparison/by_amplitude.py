# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Compare force curves of sweeps, experiments and the model, by preload and stroke."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

import stickslip_ros
from stickslip_ros.arrays import Array
from stickslip_ros.lab.comparison.result import Compared, Incomparable, Part, threshold_of
from stickslip_ros.lab.experiments.friction_loop import without_effect
from stickslip_ros.lab.experiments.options import ReadingOptions
from stickslip_ros.lab.experiments.predict import predict
from stickslip_ros.lab.experiments.reading import of_points
from stickslip_ros.lab.measurements.measurement import SAME, PointTable, is_constant, point_table
from stickslip_ros.lab.measurements.numbers import sigma_name
from stickslip_ros.lab.measurements.vocabulary import POINT_COLUMNS
from stickslip_ros.lab.runs.batch import Progress, pool_of
from stickslip_ros.lab.runs.zero_amplitude import WITHOUT_CELL
from stickslip_ros.parameters import Parameters, Scalar, bare_name
from stickslip_ros.progress import progress_of
from stickslip_ros.units import NM

MODEL = 'model'
"""Kind of a side; also its name in place of a file."""


def predicted_points(
    table: PointTable,
    parameters: Parameters,
    options: ReadingOptions,
    progress: bool | Progress,
) -> PointTable:
    """
    Simulate the drive at the settings of a table, equal settings once; return the points.

    Columns of the table set preload and parameters; the options set a frequency without a column.
    Raises StickSlipError if a point cannot be simulated, or a parameter is set and has a column.

    """
    names = [name for name in table.settings if name not in {*POINT_COLUMNS, 'loop'}]
    changed = parameters.changed()
    for name in map(bare_name, names):
        if name in changed:
            problem = f'is set, but {table.side.origin} has a column of it'
            raise Incomparable(name, problem, 'leave out --set or the column')
    if 'force_n' not in table.columns and 'step_length_m' in table.columns:
        parameters = parameters.updated(WITHOUT_CELL)
    asked = of_points(table.side.origin, table.columns, parameters, options, names)
    with progress_of(progress, 'runs') as show, pool_of(options.workers) as pool:
        found = predict(parameters, asked, pool=pool, progress=show)
    columns = {table.axis: table.columns[table.axis], **table.settings}
    columns.setdefault('frequency_hz', [options.frequency_hz] * table.side.rows)
    numbers = (number for [number] in found)
    unsteady = set[int]()
    for name in table.quantities:
        columns[name] = [math.nan] * table.side.rows
        for row in table.rows_of(name, range(table.side.rows)):
            number = next(numbers)
            columns[name][row] = float(number.values[0])
            unsteady |= set() if number.is_steady else {row}
    described = {'stickslip_ros': stickslip_ros.__version__, **parameters.flat()}
    notes = without_effect(parameters) if table.axis == 'row' else ()
    return point_table(columns, MODEL, MODEL, described, len(unsteady), notes)


def compare_points(a: PointTable, b: PointTable) -> tuple[Compared, ...]:
    """Compare the common quantities at equal settings, B interpolated to A's strokes."""
    names = [name for name in a.quantities if name in b.quantities]
    if not names:
        problem = f'has {", ".join(b.quantities)}, {a.side.origin} has {", ".join(a.quantities)}'
        hint = 'compare two with a force (held runner), or two with steps (free runner)'
        raise Incomparable(b.side.origin, problem, hint)
    if a.axis != b.axis:
        hint = 'give both with strokes, amplitude_m, or both without'
        raise Incomparable(b.side.origin, f'has no {a.axis} that varies alone', hint)
    settings = [name for name in ('preload_n', *_varied(a, b)) if name != a.axis]
    shared = [at for at in a.groups(settings) if b.rows_at(at)]
    quantities = []
    for name in names:
        parts = tuple(part for at in shared if (part := _part(a, b, at, name)) is not None)
        if not parts:
            problem = f'({_range_of(a)}) has no point within {b.side.origin} ({_range_of(b)})'
            hint = f'compute its points with: stickslip compare {a.side.origin} model'
            raise Incomparable(a.side.origin, problem, hint)
        left_out = len(a.rows_of(name, range(a.side.rows))) - sum(len(part.x) for part in parts)
        quantities.append(Compared(name, parts, left_out))
    return tuple(quantities)


def _range_of(table: PointTable) -> str:
    """Return preloads and strokes of a table in words."""
    preloads_n = dict.fromkeys(table.columns['preload_n'])
    words = f'{", ".join(f"{n:g}" for n in preloads_n)} N'
    if table.axis != 'amplitude_m':
        return words
    nm = NM * table.values('amplitude_m', range(table.side.rows))
    return f'{words}, {min(nm):.5g} to {max(nm):.5g} nm'


def _varied(a: PointTable, b: PointTable) -> list[str]:
    """Return the settings, besides the preload, that match rows of A and B."""
    varied = [
        name
        for table in (a, b)
        for name, each in table.settings.items()
        if name != 'preload_n' and not is_constant(each)
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
    edge_m = SAME * nodes_m[-1]
    strokes_m = a.values(a.axis, rows_a)
    is_inside = (nodes_m[0] - edge_m <= strokes_m) & (strokes_m <= nodes_m[-1] + edge_m)
    inside = [row for row, each in zip(rows_a, is_inside, strict=True) if each]
    if not inside:
        return None
    x_m, values_a = a.values(a.axis, inside), a.values(name, inside)
    sigma = _sigma(a, b, name, inside, rows_b)
    part = Part(at, a.axis, x_m, values_a, np.interp(x_m, nodes_m, nodes), sigma)
    if a.axis == 'row':
        return replace(part, way_m=a.values('displacement_m', inside))
    if name != 'force_n':
        return part
    threshold_a = threshold_of(strokes_m, a.values(name, rows_a))
    return replace(part, threshold_a=threshold_a, threshold_b=threshold_of(nodes_m, nodes))


def _averaged(table: PointTable, name: str, rows: Sequence[int]) -> tuple[Array, Array]:
    """Return rising strokes and the mean of a column at each."""
    nodes_m, index = np.unique(table.values(table.axis, rows), return_inverse=True)
    return nodes_m, np.bincount(index, table.values(name, rows)) / np.bincount(index)


def _sigma(
    a: PointTable, b: PointTable, name: str, rows_a: Sequence[int], rows_b: Sequence[int]
) -> Array | None:
    """Return the uncertainty of B - A; an amplitude's uncertainty is scaled by the slope of B."""
    x_m = a.values(a.axis, rows_a)
    terms, (nodes_m, nodes) = [], _averaged(b, name, rows_b)
    slope = np.full(len(x_m), np.nan)  # of B; unknown for a single amplitude
    if len(nodes_m) > 1:
        slope = np.interp(x_m, nodes_m, np.gradient(nodes, nodes_m))
    for what, factor in ((name, 1.0), ('amplitude_m', slope)):
        sigma = sigma_name(what)
        if sigma in a.columns:
            terms.append(factor * a.values(sigma, rows_a))
        if sigma in b.columns:
            terms.append(factor * np.interp(x_m, *_averaged(b, sigma, rows_b)))
    return np.sqrt(np.sum(np.square(terms), axis=0)) if terms else None
