# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The figure of a fit: measurement A, fitted model B, and their difference."""

from itertools import groupby
from pathlib import PurePath

import numpy as np
from matplotlib.figure import Figure

from stickslip_ros.lab.comparison.figure import draw_comparison
from stickslip_ros.lab.comparison.result import (
    TIME_COLUMN,
    Compared,
    Comparison,
    Part,
)
from stickslip_ros.lab.experiments.experiment import Voltage
from stickslip_ros.lab.fitting.result import FitResult
from stickslip_ros.lab.measurements.measurement import (
    AMPLITUDE_COLUMN,
    PRELOAD_COLUMN,
    VOLTAGE_COLUMN,
    Side,
)
from stickslip_ros.lab.readers.numbers import NUMBERS
from stickslip_ros.parameters import Scalar

_OF_AXIS = (AMPLITUDE_COLUMN, VOLTAGE_COLUMN, PRELOAD_COLUMN)  # the first that is not 0
_COUNTED = ('steps', 'is_steady')  # settings that do not distinguish curves


def draw_fit(fit: FitResult) -> Figure:
    """Draw each trace, without zero and drift of its sensor, and each kind of number of a fit."""
    quantities, sensors = list[Compared](), iter(fit.sensors)
    rows = list[tuple[str, str, list[tuple[str, Scalar]], tuple[float, ...]]]()
    for (one, each, error), shown in zip(fit.problem.seen, fit.predicted, strict=True):
        model = shown.values
        if isinstance(one.drive, Voltage):
            *_, sensor = next(sensors)
            drifting = sensor['drift_per_s'] * (each.time_s - each.time_s.mean())
            measured = each.values - sensor['zero'] - drifting
            noise = np.full(len(model), sensor['noise'])
            name = PurePath(one.origin).name
            part = Part({'recording': name}, TIME_COLUMN, each.time_s, measured, model, noise)
            quantities.append(Compared(each.quantity, (part,), 0))
            continue
        at: dict[str, Scalar] = {PRELOAD_COLUMN: one.settings['stand.preload']}
        at |= {name: x for name, x in one.drive._asdict().items() if x and name not in _COUNTED}
        axis = next(name for name in _OF_AXIS if name in at)
        row = float(at.pop(axis)), float(each.values[0]), float(model[0]), error
        rows.append((each.quantity, axis, list(at.items()), row))
    rows.sort(key=lambda row: (tuple(NUMBERS).index(row[0]), *row[1:]))
    for quantity, of_one in groupby(rows, key=lambda row: row[0]):
        parts = list[Part]()
        for (axis, settings), curve in groupby(of_one, key=lambda row: row[1:3]):
            x, a, b, errors = np.transpose([row[3] for row in curve])
            sigma = errors if fit.problem.noise.known else None
            parts.append(Part(dict(settings), axis, x, a, b, sigma))
        quantities.append(Compared(quantity, tuple(parts), 0))
    measured_by, model_of = (
        Side(name, name, fit.readings, {}, None) for name in ('measured', 'model')
    )
    comparison = Comparison(measured_by, model_of, TIME_COLUMN, tuple(quantities))
    return draw_comparison(comparison, quantities)
