# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Figure of a comparison: A and B above, their difference below."""

from collections.abc import Sequence
from pathlib import PurePath
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stickslip_ros.arrays import Array
from stickslip_ros.lab.comparison.result import Compared, Comparison, Part
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
from stickslip_ros.lab.measurements.words import (
    CURVE_AXES,
    LEGEND_MAX,
    quantity_words,
    setting_words,
)
from stickslip_ros.units import display_unit

_PIXELS = 800  # most points per curve
_NAME_MAX = 40  # most characters of a file name in a legend; longer names are cut at the start
_CYCLE_SAMPLES = 1 << 16  # samples of a run to search for a cycle
_CYCLES_MIN, _CYCLE_SHOWN = 4, 1.2  # least cycles of a run to enlarge a cycle; cycles shown
_TICKS_MAX = 6, 3  # most tick intervals under a run and under a cycle
_READINGS_MIN = 10  # least readings of an enlarged cycle
_CORRELATION_MIN = 0.2  # least autocorrelation of the changes at the lag of a cycle
BARS_MAX = 200  # most points with error bars: more would hide the points


@styled()
def draw_comparison(comparison: Comparison, quantities: Sequence[Compared]) -> Figure:
    """Draw quantities in rows, each with its difference below."""
    figure = new_figure(8.0, 3.5 + 2.5 * len(quantities))
    ratios, axes = (2.0, 1.0) * len(quantities), {each.parts[0].axis for each in quantities}
    is_wide = axes == {'time_s'} and not is_narrow(figure)
    named = {each.name: each for each in comparison.quantities}
    clearest = named.get('voltage_v', quantities[0])
    cycle_s = cycle_of(clearest.parts[0]) if is_wide else None
    panels, *enlarged = figure.subplots(
        len(ratios),
        1 if cycle_s is None else 2,
        sharex='col' if len(axes) == 1 else 'none',
        height_ratios=ratios,
        width_ratios=(2.0, 1.0)[: 1 if cycle_s is None else 2],
        squeeze=False,
    ).T
    for columns, only_s in ((panels, None), *((each, cycle_s) for each in enlarged)):
        for quantity, overlay, residuals in zip(
            quantities, columns[::2], columns[1::2], strict=True
        ):
            _draw_quantity(comparison, quantity, overlay, residuals, only_s)
            if len(axes) > 1 or residuals is columns[-1]:
                place = 'center' if only_s is None else 'left'  # right: offset of the time axis
                residuals.set_xlabel(CURVE_AXES[quantity.parts[0].axis][1], loc=place)
    if enlarged:
        for each, ticks in zip((panels, *enlarged), _TICKS_MAX, strict=True):
            each[-1].locator_params(axis='x', nbins=ticks)
    figure.align_ylabels(panels)
    if max(len(quantity.parts) for quantity in quantities) <= LEGEND_MAX:
        shown: dict[str, Any] = {}
        for each in panels:
            for handle, label in zip(*each.get_legend_handles_labels(), strict=True):
                shown.setdefault(label, handle)
        order = sorted(shown, key=lambda label: label[0])
        columns = 1 if is_narrow(figure) else 2
        handles = [shown[label] for label in order]
        figure.legend(handles, order, ncols=columns, loc='outside upper center')
    return figure


def cycle_of(part: Part) -> tuple[float, float] | None:
    """Return start and end, s, of a little more than a cycle in mid-run; None without cycles."""
    time_s = np.linspace(part.x[0], part.x[-1], _CYCLE_SAMPLES)
    changes = np.diff(np.interp(time_s, part.x, part.a))
    power = np.abs(np.fft.rfft(changes - changes.mean(), 2 * _CYCLE_SAMPLES)) ** 2
    products = np.fft.irfft(power)[: _CYCLE_SAMPLES // _CYCLES_MIN]
    first = int(np.argmax(products <= 0.0))  # after the peak at lag 0
    lag = first + int(np.argmax(products[first:]))
    readings = lag * len(part.x) / _CYCLE_SAMPLES
    if not first or readings < _READINGS_MIN or products[lag] < _CORRELATION_MIN * products[0]:
        return None
    middle_s = float(time_s[_CYCLE_SAMPLES // 2])
    return middle_s, middle_s + _CYCLE_SHOWN * float(time_s[lag] - time_s[0])


def _draw_quantity(
    comparison: Comparison,
    quantity: Compared,
    overlay: Axes,
    residuals: Axes,
    only_s: tuple[float, float] | None,
) -> None:
    factor, unit = display_unit(quantity.unit)
    names = []
    for side, each in zip('AB', (comparison.a, comparison.b), strict=True):
        name = PurePath(each.origin).name
        short = name if len(name) <= _NAME_MAX else f'…{name[1 - _NAME_MAX :]}'
        names.append(f'{side}: {escaped(short)}')
    for index, part in enumerate(each.within(only_s) for each in quantity.parts):
        at = escaped(setting_words(part.at))
        labels = [f'{name}, {at}' if at else name for name in names]
        if part.axis == 'time_s':
            for axes, values, name, style in (
                (overlay, part.a, labels[0], {'linewidth': 1.8, **curve_style(0)}),
                (overlay, part.b, labels[1], {'linewidth': 0.9, **curve_style(1)}),
                (residuals, part.difference, '', {'linewidth': 0.8, 'color': BLACK}),
            ):
                axes.plot(*decimated(part.x, factor * values, _PIXELS), label=name, **style)
            overlay.margins(x=0.0)
            residuals.margins(x=0.0)
            if part.sigma is not None:
                for sign in (-1.0, 1.0):
                    noise = decimated(part.x, sign * factor * part.sigma, _PIXELS)
                    dashes: dict[str, Any] = {'color': GREY, 'linewidth': 0.8, 'linestyle': '--'}
                    residuals.plot(*noise, label='± 1 sigma', **dashes)
            if part.band is not None:
                _fill_bands(residuals, part.x, part, factor)
        else:
            _draw_part(overlay, residuals, part, factor, curve_style(index), labels)
    if only_s is None:
        overlay.set_ylabel(f'{quantity_words(quantity.name)} ({unit})')
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
    """Draw a curve: A as points with known error bars, B as a line."""
    order, scale = np.argsort(part.x, kind='stable'), CURVE_AXES[part.axis][0]
    over = scale * (part.x if part.way_m is None else part.way_m)
    x, a, b = over[order], factor * part.a[order], factor * part.b[order]
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
        _fill_bands(residuals, over, part, factor)


def _fill_bands(axes: Axes, x: Array, part: Part, factor: float) -> None:
    """Shade the differences expected from the uncertainty of B and noise."""
    order = np.argsort(part.x, kind='stable')
    order = order[:: 1 + len(order) // _PIXELS]
    band = part.band or {}
    for share in ('95', '68'):
        ends = (part.b - band[f'{side}_{share}'] for side in ('high', 'low'))
        low, high = (factor * each[order] for each in ends)
        label = f'B, {share} % band'
        alpha = {'95': 0.25, '68': 0.5}[share]
        axes.fill_between(x[order], low, high, color=GREY, alpha=alpha, linewidth=0.0, label=label)
