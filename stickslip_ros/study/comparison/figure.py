"""The picture of a comparison: A and B over each other, and B - A below."""

from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes

from stickslip_ros.contact.profile import Array
from stickslip_ros.study.comparison.agreement import TIME, Part
from stickslip_ros.study.comparison.result import Compared, Comparison
from stickslip_ros.study.comparison.words import axis_label, place, title
from stickslip_ros.study.plotting import decimated, label_axes, new_figure, svg_of
from stickslip_ros.units import NM, display_unit

PIXELS = 800
"""Points per curve are no more than such a picture can show."""
COLOURS = tuple(mpl.color_sequences['tab10'])
LEGEND_MAX = 10
BARS_MAX = 200
"""Error bars of more points hide the points."""


def draw_quantity(comparison: Comparison, quantity: Compared) -> str:
    """Return a quantity of a comparison as SVG text, the same bytes for the same numbers."""
    figure = new_figure(8.0, 6.0)
    overlay, residuals = figure.subplots(2, 1, sharex=True, height_ratios=(2.0, 1.0))
    factor, unit = display_unit(quantity.unit)
    for index, part in enumerate(quantity.parts):
        if comparison.axis == TIME:
            _draw_run(overlay, residuals, part, factor)
        else:
            _draw_part(overlay, residuals, part, factor, COLOURS[index % len(COLOURS)])
    label_axes(overlay, '', f'{title(quantity)} ({unit})')
    label_axes(residuals, axis_label(comparison), f'B − A ({unit})')
    residuals.axhline(0.0, color='0.4', linewidth=0.8)
    if len(quantity.parts) <= LEGEND_MAX:
        handles, labels = overlay.get_legend_handles_labels()
        order = sorted(range(len(labels)), key=lambda index: labels[index][0])
        overlay.legend(
            [handles[index] for index in order],
            [labels[index] for index in order],
            fontsize='small',
            ncols=min(2, len(quantity.parts)),
        )
    return svg_of(figure)


def _draw_part(overlay: Axes, residuals: Axes, part: Part, factor: float, colour: object) -> None:
    """Draw one preload: A as points, with error bars where known, B as a line."""
    order = np.argsort(part.x, kind='stable')
    x, a, b = (each[order] for each in (part.x, part.a, part.b))
    x, a, b = NM * x, factor * a, factor * b
    bars = None
    if part.sigma is not None and len(x) <= BARS_MAX:
        bars = factor * part.sigma[order]
    name = place(part.at)
    points: dict[str, Any] = {
        'fmt': 'o',
        'color': colour,
        'markersize': 4,
        'capsize': 2,
        'elinewidth': 0.8,
    }
    overlay.errorbar(x, a, yerr=bars, label=f'A, {name}', **points)
    overlay.plot(x, b, color=colour, linewidth=1.2, label=f'B, {name}')
    residuals.errorbar(x, b - a, yerr=bars, linestyle='-', linewidth=0.8, **points)


def _draw_run(overlay: Axes, residuals: Axes, part: Part, factor: float) -> None:
    _thin(overlay, part.x, factor * part.a, 'A', linewidth=1.8, color=COLOURS[0])
    _thin(overlay, part.x, factor * part.b, 'B', linewidth=0.9, color=COLOURS[1], linestyle='--')
    _thin(residuals, part.x, factor * part.difference, '', linewidth=0.8, color=COLOURS[3])
    residuals.margins(x=0.0)


def _thin(axes: Axes, x: Array, y: Array, label: str, **style: Any) -> None:
    axes.plot(*decimated(x, y, PIXELS), label=label, **style)
