"""The picture of a comparison: A and B over each other, and B - A below."""

from collections.abc import Sequence
from pathlib import PurePath
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from stickslip_ros.comparison.agreement import TIME, Part
from stickslip_ros.comparison.result import Compared, ComparisonReport
from stickslip_ros.comparison.words import axis_label, place, title
from stickslip_ros.contact.profile import Array
from stickslip_ros.runs.plotting import (
    BLACK,
    GREY,
    CurveStyle,
    as_it_is,
    curve_style,
    decimated,
    label_axes,
    new_figure,
    svg_of,
)
from stickslip_ros.units import NM, display_unit

PIXELS = 800
"""Points per curve are no more than such a picture can show."""
LEGEND_MAX = 10
NAME_MAX = 40
"""Characters of a file name in a legend; of a longer one it shows the end."""
BARS_MAX = 200
"""Error bars of more points hide the points."""


def draw_quantity(comparison: ComparisonReport, quantity: Compared) -> str:
    """Return a quantity of a comparison as SVG text, the same bytes for the same numbers."""
    figure = new_figure(8.0, 6.0)
    overlay, residuals = figure.subplots(2, 1, sharex=True, height_ratios=(2.0, 1.0))
    factor, unit = display_unit(quantity.unit)
    names = [
        f'{side}: {_name(each.origin)}'
        for side, each in zip('AB', (comparison.a, comparison.b), strict=True)
    ]
    for index, part in enumerate(quantity.parts):
        if comparison.axis == TIME:
            _draw_run(overlay, residuals, part, factor, names)
        else:
            labels = [f'{name}, {place(part.at)}' for name in names]
            _draw_part(overlay, residuals, part, factor, curve_style(index), labels)
    label_axes(overlay, '', f'{title(quantity)} ({unit})')
    label_axes(residuals, axis_label(comparison), f'B − A ({unit})')
    residuals.axhline(0.0, color=GREY, linewidth=0.8)
    if len(quantity.parts) <= LEGEND_MAX:
        handles, labels = overlay.get_legend_handles_labels()
        order = sorted(range(len(labels)), key=lambda index: labels[index][0])
        figure.legend(
            [handles[index] for index in order],
            [labels[index] for index in order],
            fontsize='small',
            ncols=2,
            loc='outside upper center',
        )
    return svg_of(figure)


def _name(origin: str) -> str:
    """Return what a legend calls a file: its name without folders."""
    name = PurePath(origin).name
    return as_it_is(name if len(name) <= NAME_MAX else f'…{name[1 - NAME_MAX :]}')


def _draw_part(
    overlay: Axes,
    residuals: Axes,
    part: Part,
    factor: float,
    style: CurveStyle,
    labels: Sequence[str],
) -> None:
    """Draw one preload: A as points, with error bars where known, B as a line."""
    order = np.argsort(part.x, kind='stable')
    x, a, b = (each[order] for each in (part.x, part.a, part.b))
    x, a, b = NM * x, factor * a, factor * b
    bars = None
    if part.sigma is not None and len(x) <= BARS_MAX:
        bars = factor * part.sigma[order]
    bar: dict[str, Any] = {'yerr': bars, 'capsize': 2, 'elinewidth': 0.8}
    overlay.errorbar(x, a, label=labels[0], **style.points, **bar)
    overlay.plot(x, b, label=labels[1], linewidth=1.2, **style.line)
    residuals.errorbar(x, b - a, linewidth=0.8, **style.line_and_points, **bar)


def _draw_run(
    overlay: Axes, residuals: Axes, part: Part, factor: float, labels: Sequence[str]
) -> None:
    _thin(overlay, part.x, factor * part.a, labels[0], linewidth=1.8, **curve_style(0).line)
    _thin(overlay, part.x, factor * part.b, labels[1], linewidth=0.9, **curve_style(1).line)
    _thin(residuals, part.x, factor * part.difference, '', linewidth=0.8, color=BLACK)
    residuals.margins(x=0.0)


def _thin(axes: Axes, x: Array, y: Array, label: str, **style: Any) -> None:
    axes.plot(*decimated(x, y, PIXELS), label=label, **style)
