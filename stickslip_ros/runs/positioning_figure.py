"""The picture of a positioning run: targets, what is left of the way, voltage."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.series import Series
from stickslip_ros.runs.plotting import (
    BLACK,
    BLUE,
    GREEN,
    VERMILION,
    draw_legend,
    label_axes,
    new_figure,
    save_figure,
)
from stickslip_ros.units import MICRO, NM

LEAST_M = 1e-11
"""Smaller errors are drawn as this one: the axis is logarithmic."""

Leg = tuple[float, float, float]
"""Start (s), end (s) and target (m) of a part of the run."""


def draw_positioning(path: Path, legs: Sequence[Leg], tolerance_m: float, picture: Path) -> None:
    """
    Draw a recorded positioning run.

    Parameters
    ----------
    path : Path
        Recording with truth topics.
    legs : sequence of (float, float, float)
        Start (s), end (s) and target (m) of each leg.
    tolerance_m : float
        Distance from the target that is drawn as a line, m.
    picture : Path
        PNG, SVG or PDF file to write; folders are made.

    """
    recording = Recording(path)
    truth, voltage = recording.series('truth/position'), recording.trace()['voltage']
    title = 'Positioning over topics, on a stand with the faults of real hardware'
    figure = new_figure(11.0, 7.5, title)
    position, error, volts = figure.subplots(3, 1, sharex=True)
    _draw_position(position, truth, legs)
    _draw_error(error, truth, legs, tolerance_m)
    volts.plot(voltage.time_s, voltage.value, color=BLUE, linewidth=0.7)
    label_axes(volts, 'simulated time (s)', 'piezo voltage (V)')
    save_figure(figure, picture)


def largest_errors_m(path: Path, spans: Sequence[Leg]) -> list[float]:
    """Return the largest true distance from the target, m, in each span of start, end, target."""
    truth = Recording(path).series('truth/position')
    return [
        float(np.abs(truth.window(start_s, end_s).value - target_m).max())
        for start_s, end_s, target_m in spans
    ]


def _draw_position(axes: Axes, truth: Series, legs: Sequence[Leg]) -> None:
    label_axes(axes, '', 'position (um)')
    axes.plot(truth.time_s, truth.value / MICRO, color=GREEN, linewidth=1.0, label='true position')
    for number, (start_s, end_s, target_m) in enumerate(legs):
        label = '_' if number else 'target'
        axes.hlines(target_m / MICRO, start_s, end_s, BLACK, 'dashed', linewidth=0.8, label=label)
    axes.set_yscale('symlog', linthresh=0.1)
    draw_legend(axes, 'upper left')


def _draw_error(axes: Axes, truth: Series, legs: Sequence[Leg], tolerance_m: float) -> None:
    label_axes(axes, '', 'distance from target (nm)')
    for start_s, end_s, target_m in legs:
        leg = truth.window(start_s, end_s)
        left_m = np.maximum(np.abs(leg.value - target_m), LEAST_M)
        axes.plot(leg.time_s, NM * left_m, color=VERMILION, linewidth=0.7)
    label = f'{NM * tolerance_m:g} nm'
    axes.axhline(NM * tolerance_m, color=BLACK, linestyle='--', linewidth=0.8, label=label)
    axes.set_yscale('log')
    draw_legend(axes, 'upper right')
