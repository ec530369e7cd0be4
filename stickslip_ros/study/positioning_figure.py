"""The picture of a positioning run: targets, what is left of the way, voltage."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from stickslip_ros.contact.profile import Array
from stickslip_ros.recording.reader import Recording
from stickslip_ros.units import NANO

FIGURE_INCHES = (11.0, 7.5)
DOTS_PER_INCH = 120
LEAST_M = 1e-11
"""Smaller errors are drawn as this one: the axis is logarithmic."""


def draw_positioning(
    path: Path, legs: Sequence[tuple[float, float, float]], tolerance_m: float, picture: Path
) -> None:
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
    truth = recording.series('truth/position')
    voltage = recording.trace()['voltage']
    figure = Figure(figsize=FIGURE_INCHES, layout='constrained')
    FigureCanvasAgg(figure)
    figure.suptitle('Positioning over topics, on a stand with the faults of real hardware')
    position, error, volts = figure.subplots(3, 1, sharex=True)
    _draw_position(position, truth.time_s, truth.value, legs)
    _draw_error(error, truth.time_s, truth.value, legs, tolerance_m)
    volts.plot(voltage.time_s, voltage.value, color='tab:blue', linewidth=0.7)
    volts.set_ylabel('piezo voltage (V)')
    volts.set_xlabel('simulated time (s)')
    for axes in (position, error, volts):
        axes.grid(alpha=0.3)
    picture.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(picture, dpi=DOTS_PER_INCH, metadata={})


def largest_errors_m(path: Path, spans: Sequence[tuple[float, float, float]]) -> list[float]:
    """Return the largest true distance from the target, m, in each span of start, end, target."""
    truth = Recording(path).series('truth/position')
    errors = []
    for start_s, end_s, target_m in spans:
        inside = (truth.time_s >= start_s) & (truth.time_s <= end_s)
        errors.append(float(np.abs(truth.value[inside] - target_m).max()))
    return errors


def _draw_position(
    axes: Axes, time_s: Array, position_m: Array, legs: Sequence[tuple[float, float, float]]
) -> None:
    axes.plot(time_s, position_m / 1e-6, color='tab:green', linewidth=1.0, label='true position')
    for number, (start_s, end_s, target_m) in enumerate(legs):
        label = '_' if number else 'target'
        axes.hlines(target_m / 1e-6, start_s, end_s, 'k', 'dashed', linewidth=0.8, label=label)
    axes.set_yscale('symlog', linthresh=0.1)
    axes.set_ylabel('position (um)')
    axes.legend(loc='upper left')


def _draw_error(
    axes: Axes,
    time_s: Array,
    position_m: Array,
    legs: Sequence[tuple[float, float, float]],
    tolerance_m: float,
) -> None:
    for start_s, end_s, target_m in legs:
        inside = (time_s >= start_s) & (time_s <= end_s)
        left_m = np.maximum(np.abs(position_m[inside] - target_m), LEAST_M)
        axes.plot(time_s[inside], left_m / NANO, color='tab:red', linewidth=0.7)
    axes.axhline(tolerance_m / NANO, color='k', linewidth=0.8, label=f'{tolerance_m / NANO:g} nm')
    axes.set_yscale('log')
    axes.set_ylabel('distance from target (nm)')
    axes.legend(loc='upper right')
