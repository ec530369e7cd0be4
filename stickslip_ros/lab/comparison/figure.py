# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The picture of a comparison: A and B above, their difference below."""

from collections.abc import Sequence
from pathlib import PurePath
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stickslip_ros.arrays import Array
from stickslip_ros.lab.comparison.result import (
    TIME_COLUMN,
    Compared,
    Comparison,
    Part,
)
from stickslip_ros.lab.comparison.words import place, title
from stickslip_ros.lab.figures.plotting import (
    BLACK,
    GREY,
    curve_style,
    decimated,
    escaped,
    is_narrow,
    new_figure,
    styled,
)
from stickslip_ros.lab.measurements.measurement import (
    AMPLITUDE_COLUMN,
    PRELOAD_COLUMN,
    VOLTAGE_COLUMN,
)
from stickslip_ros.units import NM, display_unit

ALONG = {
    TIME_COLUMN: (1.0, 'time (s)'),
    AMPLITUDE_COLUMN: (NM, 'stroke of the feet (nm)'),
    VOLTAGE_COLUMN: (1.0, 'voltage (V)'),
    PRELOAD_COLUMN: (1.0, 'preload (N)'),
}
"""Axes of the points: factor of SI and label."""
_PIXELS = 800  # most points per curve
LEGEND_MAX = 10
_NAME_MAX = 40  # most characters of a file name in a legend; the end of a longer name is shown
BARS_MAX = 200  # error bars of more points hide the points


@styled()
def draw_comparison(comparison: Comparison, quantities: Sequence[Compared]) -> Figure:
    """Draw quantities below each other, each with its difference below it."""
    figure = new_figure(8.0, 3.5 + 2.5 * len(quantities))
    ratios, axes = (2.0, 1.0) * len(quantities), {each.parts[0].axis for each in quantities}
    panels = figure.subplots(len(ratios), 1, sharex=len(axes) == 1, height_ratios=ratios)
    for quantity, overlay, residuals in zip(quantities, panels[::2], panels[1::2], strict=True):
        _draw_quantity(comparison, quantity, overlay, residuals)
        if len(axes) > 1 or residuals is panels[-1]:
            residuals.set_xlabel(ALONG[quantity.parts[0].axis][1])
    if max(len(quantity.parts) for quantity in quantities) <= LEGEND_MAX:
        shown: dict[str, Any] = {}
        for overlay in panels[::2]:
            for handle, label in zip(*overlay.get_legend_handles_labels(), strict=True):
                shown.setdefault(label, handle)
        order = sorted(shown, key=lambda label: label[0])
        columns = 1 if is_narrow(figure) else 2
        handles = [shown[label] for label in order]
        figure.legend(handles, order, ncols=columns, loc='outside upper center')
    return figure


def _draw_quantity(
    comparison: Comparison, quantity: Compared, overlay: Axes, residuals: Axes
) -> None:
    factor, unit = display_unit(quantity.unit)
    names = []
    for side, each in zip('AB', (comparison.a, comparison.b), strict=True):
        name = PurePath(each.origin).name
        short = name if len(name) <= _NAME_MAX else f'…{name[1 - _NAME_MAX :]}'
        names.append(f'{side}: {escaped(short)}')
    for index, part in enumerate(quantity.parts):
        at = escaped(place(part.at))
        labels = [f'{name}, {at}' if at else name for name in names]
        if part.axis == TIME_COLUMN:
            for axes, values, name, style in (
                (overlay, part.a, labels[0], {'linewidth': 1.8, **curve_style(0)}),
                (overlay, part.b, labels[1], {'linewidth': 0.9, **curve_style(1)}),
                (residuals, part.difference, '', {'linewidth': 0.8, 'color': BLACK}),
            ):
                axes.plot(*decimated(part.x, factor * values, _PIXELS), label=name, **style)
            residuals.margins(x=0.0)
            if part.sigma is not None:
                for sign in (-1.0, 1.0):
                    noise = decimated(part.x, sign * factor * part.sigma, _PIXELS)
                    residuals.plot(*noise, color=GREY, linewidth=0.8, linestyle='--')
            if part.band is not None:
                _fill_bands(residuals, part.x, part, factor)
        else:
            _draw_part(overlay, residuals, part, factor, curve_style(index), labels)
    overlay.set_ylabel(f'{title(quantity)} ({unit})')
    residuals.set_ylabel(f'B − A ({unit})')
    residuals.axhline(0.0, color=GREY, linewidth=0.8)


def _draw_part(
    overlay: Axes,
    residuals: Axes,
    part: Part,
    factor: float,
    style: dict[str, Any],
    labels: Sequence[str],
) -> None:
    """Draw one curve: A as points, with error bars where known, B as a line."""
    order, scale = np.argsort(part.x, kind='stable'), ALONG[part.axis][0]
    x, a, b = (each[order] for each in (part.x, part.a, part.b))
    x, a, b = scale * x, factor * a, factor * b
    bars = None
    if part.sigma is not None and len(x) <= BARS_MAX:
        bars = factor * part.sigma[order]
    bar: dict[str, Any] = {'yerr': bars, 'capsize': 2, 'elinewidth': 0.8, 'marker': 'o'}
    overlay.errorbar(x, a, label=labels[0], **style | {'linestyle': ''}, **bar)
    overlay.plot(
        x, b, label=labels[1], linewidth=1.2, **style | {'marker': '' if len(x) > 1 else '_'}
    )
    residuals.errorbar(x, b - a, linewidth=0.8, **style, **bar)
    if part.band is not None:
        _fill_bands(residuals, scale * part.x, part, factor)


def _fill_bands(axes: Axes, x: Array, part: Part, factor: float) -> None:
    """Shade the differences expected from the unknowns of B and noise."""
    order = np.argsort(x, kind='stable')
    order = order[:: 1 + len(order) // _PIXELS]
    band = part.band or {}
    for share in ('95', '68'):
        ends = (part.b - band[f'{side}_{share}'] for side in ('high', 'low'))
        low, high = (factor * each[order] for each in ends)
        axes.fill_between(x[order], low, high, color=GREY, alpha=0.25, linewidth=0.0)
