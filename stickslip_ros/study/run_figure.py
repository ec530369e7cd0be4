"""The picture of a run: voltage, position and force over time, with one step enlarged."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from stickslip_ros.contact.profile import Array
from stickslip_ros.errors import RecordingError, UnknownName
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.series import Series

PANELS = (
    ('voltage', 'piezo voltage (V)', 1.0, 'tab:blue'),
    ('position', 'runner position (nm)', 1e9, 'tab:green'),
    ('force', 'load-cell force (mN)', 1e3, 'tab:red'),
)
FALL_V = 0.5
"""A fall is a drop between two samples by more than this share of the voltage range."""
ZOOM_FALL = 2
ZOOM_PERIODS = 1.6
SUFFIXES = ('.png', '.svg', '.pdf')
FIGURE_INCHES = (12.0, 7.5)
DOTS_PER_INCH = 120


def draw_run(path: Path, picture: Path, title: str = '') -> None:
    """
    Draw a recorded run.

    Parameters
    ----------
    path : Path
        Recording with a trace.
    picture : Path
        PNG, SVG or PDF file to write; folders are made.
    title : str
        Heading; the file's name if empty.

    Raises
    ------
    RecordingError
        If the recording cannot be read or has no trace.
    UnknownName
        If the picture is to be of a kind that cannot be drawn.

    """
    if picture.suffix.lower() not in SUFFIXES:
        raise UnknownName('kind of picture', picture.suffix, f'use {", ".join(SUFFIXES)}')
    trace = Recording(path).trace()
    if not trace:
        raise RecordingError(path, 'has no trace to draw', 'record a run that lasts a while')
    figure = Figure(figsize=FIGURE_INCHES, layout='constrained')
    FigureCanvasAgg(figure)
    figure.suptitle(title or path.name)
    axes = figure.subplots(len(PANELS), 2, sharex='col', width_ratios=(2.0, 1.0))
    start_s, end_s = step_window(trace['voltage'])
    for row, (name, label, scale, colour) in enumerate(PANELS):
        series = trace[name]
        _plot(axes[row, 0], series.time_s, scale * series.value, colour)
        axes[row, 0].axvspan(start_s, end_s, color='0.85', zorder=0)
        axes[row, 0].set_ylabel(label)
        near = series.window(start_s, end_s)
        _plot(axes[row, 1], (near.time_s - start_s) * 1e3, scale * near.value, colour)
    _draw_foot(axes[1, 1], trace['foot'].window(start_s, end_s), start_s)
    axes[-1, 0].set_xlabel('simulated time (s)')
    axes[-1, 1].set_xlabel(f'time after {start_s:.6g} s (ms)')
    axes[0, 0].set_title('whole run; grey: enlarged')
    axes[0, 1].set_title('one step')
    picture.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(picture, dpi=DOTS_PER_INCH)


def step_window(voltage: Series) -> tuple[float, float]:
    """
    Return start and end of a stretch around one step, s.

    The step is the third of the run, when the runner has begun to move; a run with fewer
    falls is shown whole.

    """
    change = np.diff(voltage.value)
    falls = np.flatnonzero(np.abs(change) > FALL_V * np.ptp(voltage.value))
    if len(falls) <= ZOOM_FALL:
        return float(voltage.time_s[0]), float(voltage.time_s[-1])
    at_s = float(voltage.time_s[falls[ZOOM_FALL]])
    period_s = at_s - float(voltage.time_s[falls[ZOOM_FALL - 1]])
    return at_s - 0.5 * ZOOM_PERIODS * period_s, at_s + 0.5 * ZOOM_PERIODS * period_s


def _plot(axes: Axes, x: Array, y: Array, colour: str) -> None:
    axes.plot(x, y, color=colour, linewidth=0.8)
    axes.grid(visible=True, alpha=0.3)
    axes.margins(x=0.0)


def _draw_foot(axes: Axes, foot: Series, start_s: float) -> None:
    """Lay the foot beside the runner, both from the start of the step."""
    low, _ = axes.get_ylim()
    shifted_nm = 1e9 * (foot.value - foot.value.min()) + low
    axes.plot(
        (foot.time_s - start_s) * 1e3,
        shifted_nm,
        color='0.5',
        linewidth=0.8,
        linestyle='--',
        label='foot (shifted)',
    )
    axes.legend(loc='upper left', fontsize='small')
