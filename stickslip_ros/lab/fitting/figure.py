# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The figures of a fit: measurement A, model B and their difference; correlations."""

from collections.abc import Sequence
from itertools import groupby
from pathlib import PurePath

import numpy as np
from matplotlib.figure import Figure

from stickslip_ros.arrays import Array
from stickslip_ros.lab.comparison.figure import draw_comparison
from stickslip_ros.lab.comparison.result import Compared, Comparison, Part
from stickslip_ros.lab.experiments.experiment import Voltage
from stickslip_ros.lab.experiments.friction_loop import LoopRow
from stickslip_ros.lab.figures.plotting import new_figure, styled
from stickslip_ros.lab.fitting.result import FitResult
from stickslip_ros.lab.measurements.measurement import Side
from stickslip_ros.lab.measurements.numbers import NUMBERS
from stickslip_ros.parameters import Scalar

_OF_AXIS = ('row', 'amplitude_m', 'voltage_v', 'preload_n')  # the first with a value is the axis
_LETTERS_MAX = 50  # most letters of names side by side
_DARK = 0.6  # least correlation of a cell in a dark colour
_COUNTED = ('steps', 'is_steady')  # fields of a drive that do not distinguish curves


def draw_fit(fit: FitResult) -> Figure:
    """Draw the traces of a fit, without zero and drift of their sensors, and its numbers."""
    quantities, sensors = list[Compared](), iter(fit.sensors)
    rows = list[tuple[str, str, list[tuple[str, Scalar]], tuple[float, ...]]]()
    for (one, each, error), shown in zip(fit.problem.observed, fit.predicted, strict=True):
        model = shown.values
        if isinstance(one.drive, Voltage):
            *_, sensor = next(sensors)
            drifting = sensor['drift_per_s'] * (each.time_s - each.time_s.mean())
            measured = each.values - sensor['zero'] - drifting
            noise = np.full(len(model), sensor['noise'])
            name = PurePath(one.origin).name
            part = Part({'recording': name}, 'time_s', each.time_s, measured, model, noise)
            quantities.append(Compared(each.quantity, (part,), 0))
            continue
        at: dict[str, Scalar] = {'preload_n': one.settings.get('stand.preload', 0.0)}
        at |= {name: x for name, x in one.drive._asdict().items() if x and name not in _COUNTED}
        axis = next(name for name in _OF_AXIS if name in at)
        way_m = one.drive.way_m if isinstance(one.drive, LoopRow) else 0.0
        row = float(at.pop(axis)), float(each.values[0]), float(model[0]), error, way_m
        rows.append((each.quantity, axis, list(at.items()), row))
    rows.sort(key=lambda row: (tuple(NUMBERS).index(row[0]), *row[1:]))
    for quantity, of_one in groupby(rows, key=lambda row: row[0]):
        parts = list[Part]()
        for (axis, settings), curve in groupby(of_one, key=lambda row: row[1:3]):
            x, a, b, errors, ways_m = np.transpose([row[3] for row in curve])
            sigma = None if fit.problem.is_bare else errors
            over = ways_m if axis == 'row' else None
            parts.append(Part(dict(settings), axis, x, a, b, sigma, way_m=over))
        quantities.append(Compared(quantity, tuple(parts), 0))
    measured_by, model_of = (
        Side(name, name, fit.readings, {}, None) for name in ('measured', 'model')
    )
    comparison = Comparison(measured_by, model_of, 'time_s', tuple(quantities))
    return draw_comparison(comparison, quantities)


@styled()
def draw_correlations(names: Sequence[str], correlation: Array) -> Figure:
    """Draw a matrix of correlations with its values; nan (unknown error) is a dash."""
    count = len(names)
    figure = new_figure(8.0, 1.2 + 0.45 * count)
    axes = figure.subplots()
    image = axes.imshow(correlation, cmap='RdBu_r', vmin=-1.0, vmax=1.0, aspect='auto')
    figure.colorbar(image, ax=axes, label='correlation')
    axes.grid(visible=False)
    broken = [name.replace('.', '.\n', 1) for name in names]
    longest = max(len(line) for name in broken for line in name.split('\n'))
    axes.set_yticks(range(count), broken)
    axes.set_xticks(range(count), broken, rotation=90 * (count * longest > _LETTERS_MAX))
    for (row, column), value in np.ndenumerate(correlation):
        colour = 'white' if abs(value) > _DARK else 'black'
        text = f'{round(value, 2) + 0.0:.2f}'.replace('-', '−') if np.isfinite(value) else '–'
        axes.text(column, row, text, color=colour, ha='center', va='center')
    return figure
