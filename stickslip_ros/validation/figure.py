"""The page of plots: one panel per item of the families, and the margin of every check."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from stickslip_ros.study.plotting import (
    BLUE,
    VERMILION,
    curve_style,
    draw_legend,
    label_axes,
    new_figure,
    save_figure,
)
from stickslip_ros.validation.checks import Curve, Findings, Panel

COLUMNS = 3
PANEL_INCHES = (5.2, 4.0)
COLOURS = 3
"""Colours in a panel: so many dashes on there are others, for curves of the same colour."""
LEAST_SHARE = 1e-6
"""Errors below that share of their tolerance are drawn there."""


def draw_page(findings: Sequence[Findings], picture: Path, heading: str) -> None:
    """Draw all panels on one page, a PNG file, under a heading."""
    panels = [panel for found in findings for panel in found.panels]
    rows = -(-(len(panels) + 1) // COLUMNS)
    size = (COLUMNS * PANEL_INCHES[0], rows * PANEL_INCHES[1])
    figure = new_figure(*size, f'stickslip validate: {heading}')
    places = figure.subplots(rows, COLUMNS, squeeze=False).ravel()
    for axes, panel in zip(places, panels, strict=False):
        _draw_panel(axes, panel)
    _draw_margins(places[len(panels)], findings)
    for axes in places[len(panels) + 1 :]:
        axes.set_visible(False)
    save_figure(figure, picture)


def _draw_panel(axes: Axes, panel: Panel) -> None:
    for curve in panel.curves:
        _draw_curve(axes, curve)
    label_axes(axes, panel.x_label, panel.y_label, panel.title)
    if panel.log_x:
        axes.set_xscale('log')
    if panel.log_y:
        axes.set_yscale('log')
    if panel.x_ticks:
        axes.set_xticks(panel.x_ticks, [f'{tick:g}' for tick in panel.x_ticks])
        axes.minorticks_off()
    draw_legend(axes)


def _draw_curve(axes: Axes, curve: Curve) -> None:
    style = curve_style(curve.colour)
    drawn = {
        'line': style.line,
        'dashed': style.line | {'linestyle': curve_style(curve.colour + COLOURS).linestyle},
        'points': style.points | {'fillstyle': 'none'},
    }[curve.style]
    axes.plot(curve.x, curve.y, label=curve.label, linewidth=1.3, **drawn)


def _draw_margins(axes: Axes, findings: Sequence[Findings]) -> None:
    """Show of every check which share of its tolerance the error uses."""
    for row, found in enumerate(findings):
        shares = np.array([each.error / each.check.tolerance.value for each in found.outcomes])
        passed = np.array([each.passed for each in found.outcomes], dtype=bool)
        drawn = np.clip(np.nan_to_num(shares, nan=np.inf), LEAST_SHARE, 1.0 / LEAST_SHARE)
        spread = row + np.linspace(-0.3, 0.3, len(drawn))
        axes.plot(drawn[passed], spread[passed], 'o', color=BLUE, markersize=4.0)
        axes.plot(drawn[~passed], spread[~passed], 'X', color=VERMILION, markersize=8.0)
    axes.axvline(1.0, color=VERMILION, linewidth=1.2)
    axes.set_xscale('log')
    axes.set_xlim(left=0.5 * LEAST_SHARE)
    axes.set_xlim(right=max(axes.get_xlim()[1], 4.0))
    axes.set_yticks(range(len(findings)), [found.family for found in findings])
    axes.invert_yaxis()
    drawn_at_left = f'error/tolerance (at most {LEAST_SHARE:g} drawn at the left)'
    label_axes(axes, drawn_at_left, '', 'Every check: right of the line it fails')
