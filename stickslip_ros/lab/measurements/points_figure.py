# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Figure of points by amplitude, voltage or preload."""

from dataclasses import dataclass
from typing import Any

from matplotlib.figure import Figure

from stickslip_ros.lab.figures.plotting import curve_style, escaped, new_figure, styled
from stickslip_ros.lab.measurements.measurement import PointTable, is_constant
from stickslip_ros.lab.measurements.numbers import sigma_name
from stickslip_ros.lab.measurements.run_figure import Extent
from stickslip_ros.lab.measurements.words import (
    CURVE_AXES,
    LEGEND_MAX,
    quantity_words,
    setting_words,
)
from stickslip_ros.units import display_unit, unit_of


@dataclass(frozen=True)
class PointsPlot:
    """Content of a figure of points."""

    axis: str
    quantities: tuple[Extent, ...]

    @property
    def title(self) -> str:
        return f'over the {CURVE_AXES[self.axis][1]}'


@styled()
def draw_points(table: PointTable) -> tuple[Figure, PointsPlot]:
    """Draw each quantity over the axis of a table, a curve for each set of varied settings."""
    names = table.quantities
    settings = [name for name, each in table.settings.items() if not is_constant(each)]
    groups = table.groups([name for name in settings if name != table.axis])
    figure = new_figure(8.0, 1.0 + 2.5 * len(names))
    panels = figure.subplots(len(names), 1, squeeze=False, sharex=True)[:, 0]
    scale, label = CURVE_AXES[table.axis]
    over = 'displacement_m' if table.axis == 'row' else table.axis
    for axes, name in zip(panels, names, strict=True):
        factor, unit = display_unit(unit_of(name))
        for number, at in enumerate(groups):
            rows = table.rows_of(name, table.rows_at(at))
            look: dict[str, Any] = {**curve_style(number), 'marker': 'o', 'capsize': 2}
            if sigma_name(name) in table.columns:
                look['yerr'] = factor * table.values(sigma_name(name), rows)
            x, y = scale * table.values(over, rows), factor * table.values(name, rows)
            axes.errorbar(x, y, label=escaped(setting_words(at)), **look)
        axes.set_ylabel(f'{quantity_words(name)} ({unit})' if unit else quantity_words(name))
    panels[-1].set_xlabel(label)
    if 1 < len(groups) <= LEGEND_MAX:
        figure.legend(*panels[0].get_legend_handles_labels(), ncols=2, loc='outside upper center')
    extents = []
    for name in names:
        values = table.values(name, table.rows_of(name, range(table.side.rows)))
        extents.append(Extent.of(name, values, unit_of(name), table.side.origin))
    return figure, PointsPlot(table.axis, tuple(extents))
