"""The picture of a recorded run, or of a stretch of it, with events and status bits."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import EngFormatter
from numpy.typing import NDArray

from stickslip_ros.errors import OutOfRange, RecordingError
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.series import Series
from stickslip_ros.study.plotting import (
    DOTS_PER_INCH,
    check_picture,
    decimated,
    label_axes,
    new_figure,
    save_figure,
)
from stickslip_ros.study.recorded_run import (
    RUN_QUANTITIES,
    BitSpan,
    LoggedEvent,
    TimeWindow,
    bits_within,
    check_window,
    events_within,
    recorded_series,
)
from stickslip_ros.units import display_unit

COLOURS = {
    'position_m': 'tab:green',
    'force_n': 'tab:red',
    'voltage_v': 'tab:blue',
    'foot_m': 'tab:purple',
}
WIDTH_INCHES, PANEL_INCHES, BIT_INCHES = 11.0, 1.9, 0.25
LABELLED_MAX = 12
"""Events that are named in the picture; more would hide each other."""
FALL_SHARE = 0.5
"""A fall is a drop between two samples by more than this share of the voltage range."""
STEP_FALL, STEP_PERIODS = 2, 1.6
"""The enlarged step is around the fall of this index, and so many periods long."""


@dataclass(frozen=True)
class Extent:
    """A quantity in the picture: its samples, smallest and largest value, and their source."""

    name: str
    unit: str
    samples: int
    smallest: float | None
    largest: float | None
    origin: str


@dataclass(frozen=True)
class RunPlot:
    """What a picture shows."""

    start_s: float
    end_s: float
    quantities: tuple[Extent, ...]
    events: tuple[LoggedEvent, ...]
    status: tuple[BitSpan, ...]


def plot_run(
    path: Path,
    picture: Path,
    window: TimeWindow | None = None,
    *,
    title: str = '',
    with_step: bool = False,
) -> RunPlot:
    """
    Draw position, force, voltage and foot of a recording against time.

    The trace is drawn, else the topics; without a window the whole run, if wanted with one step
    enlarged beside it. The picture is PNG, SVG or PDF; without a title it has the file's name.

    Raises
    ------
    RecordingError
        If the recording cannot be read, or holds nothing to draw.
    UnknownName
        If the picture is to be of a kind that cannot be drawn.
    OutOfRange
        If the stretch is outside of the run or has no sample in it.

    """
    check_picture(picture)
    recording = Recording(path)
    series = recorded_series(recording)
    if not series:
        problem = 'has neither position, force nor voltage'
        raise RecordingError(path, problem, 'record a run that lasts a while')
    shown = _whole(series) if window is None else check_window(window, _whole(series))
    inside = {name: each.window(*shown) for name, each in series.items()}
    if not any(len(each) for each in inside.values()):
        length_s, limit = shown.end_s - shown.start_s, 'too short: no sample lies in it'
        raise OutOfRange('length of the window', length_s, 's', limit, 'raise it')
    plot = RunPlot(
        *shown,
        tuple(_extent(name, each) for name, each in inside.items()),
        tuple(events_within(recording, shown)),
        tuple(bits_within(recording, shown)),
    )
    spans = [shown]
    if with_step and 'voltage_v' in inside:
        spans.append(step_window(inside['voltage_v']))
    save_figure(_draw(plot, inside, spans, title or path.name), picture)
    return plot


def step_window(voltage: Series) -> TimeWindow:
    """
    Return a stretch around one step.

    The step is the third of the run, when the runner has begun to move; a run with fewer
    falls is shown whole.

    """
    change = np.abs(np.diff(voltage.value))
    falls = np.flatnonzero(change > FALL_SHARE * np.ptp(voltage.value))
    if len(falls) <= STEP_FALL:
        return TimeWindow(float(voltage.time_s[0]), float(voltage.time_s[-1]))
    at_s = float(voltage.time_s[falls[STEP_FALL]])
    half_s = 0.5 * STEP_PERIODS * (at_s - float(voltage.time_s[falls[STEP_FALL - 1]]))
    return TimeWindow(at_s - half_s, at_s + half_s)


def _whole(series: Mapping[str, Series]) -> TimeWindow:
    return TimeWindow(
        min(float(each.time_s[0]) for each in series.values()),
        max(float(each.time_s[-1]) for each in series.values()),
    )


def _extent(name: str, series: Series) -> Extent:
    known = series.value[np.isfinite(series.value)]
    smallest = float(known.min()) if len(known) else None
    largest = float(known.max()) if len(known) else None
    return Extent(name, series.unit, len(series), smallest, largest, series.origin)


def _draw(
    plot: RunPlot, series: Mapping[str, Series], spans: Sequence[TimeWindow], title: str
) -> Figure:
    """Draw a column of panels for what the plot is of, and one for the step, if there is one."""
    with_step = len(spans) > 1
    names = [name for name in series if name != 'foot_m' or not with_step]
    bits = list(dict.fromkeys(span.bit for span in plot.status))
    heights = [PANEL_INCHES] * len(names) + [0.45 + BIT_INCHES * max(len(bits), 1)]
    figure = new_figure(WIDTH_INCHES, 0.6 + sum(heights), title)
    grid = figure.subplots(
        len(heights),
        len(spans),
        sharex='col',
        squeeze=False,
        height_ratios=heights,
        width_ratios=(2.0, 1.0)[: len(spans)],
    )
    for panels, span in zip(grid.T, spans, strict=True):
        zero_s = _zero_s(span)
        for axes, name in zip(panels, names, strict=False):
            _draw_series(axes, name, series[name].window(*span), zero_s)
        _draw_bits(panels[-1], plot, bits, zero_s)
        panels[-1].set_xlabel('simulated time' + (f' after {zero_s:.9g} s' if zero_s else ''))
        panels[-1].set_xlim(span.start_s - zero_s, span.end_s - zero_s)
        panels[-1].xaxis.set_major_formatter(EngFormatter('s'))
    for axes, name in zip(grid[:, 0], names, strict=False):
        axes.set_ylabel(f'{RUN_QUANTITIES[name]}\n({display_unit(series[name].unit)[1]})')
    grid[-1, 0].set_ylabel('status')
    _draw_events(list(grid[:, 0]), plot, _zero_s(spans[0]))
    if with_step:
        _mark_step(grid, spans)
        if names[0] == 'position_m' and 'foot_m' in series:
            _lay_foot_beside(grid[0, 1], series['foot_m'].window(*spans[1]), _zero_s(spans[1]))
    return figure


def _zero_s(span: TimeWindow) -> float:
    """Return the zero of a time axis, s: a short stretch late in a run counts from its start."""
    return span.start_s if span.start_s > span.end_s - span.start_s else 0.0


def _draw_series(axes: Axes, name: str, series: Series, zero_s: float) -> None:
    x, y = series.time_s - zero_s, display_unit(series.unit)[0] * series.value
    if len(series):
        x, y = decimated(x, y, round(WIDTH_INCHES * DOTS_PER_INCH))
    axes.plot(x, y, color=COLOURS[name], linewidth=0.8)
    label_axes(axes, '', '')
    axes.margins(x=0.0)


def _draw_bits(axes: Axes, plot: RunPlot, bits: Sequence[str], zero_s: float) -> None:
    """Draw a bar for each stretch during which a bit was set."""
    for bit, start_s, end_s in plot.status:
        bar = (bits.index(bit), end_s - start_s, 0.6, start_s - zero_s)
        axes.barh(*bar, color='0.55')
    axes.set_yticks(range(len(bits)), [bit.lower() for bit in bits], fontsize='x-small')
    axes.set_ylim(max(len(bits), 1) - 0.5, -0.5)
    axes.grid(visible=True, axis='x', alpha=0.3)


def _draw_events(panels: Sequence[Axes], plot: RunPlot, zero_s: float) -> None:
    """Draw a line at the end of each command; of equal ones in a row the first is named."""
    ends = groupby(plot.events, lambda event: f'{event.command}: {event.result}')
    for number, (label, group) in enumerate(ends):
        times_s = [event.time_s - zero_s for event in group]
        for axes in panels:
            for time_s in times_s:
                axes.axvline(time_s, color='0.3', linewidth=0.7, linestyle=':')
        if number < LABELLED_MAX:
            late = times_s[0] > 0.5 * (plot.start_s + plot.end_s) - zero_s
            panels[0].annotate(
                label,
                (times_s[0], 0.97 - 0.14 * (number % 6)),
                xycoords=('data', 'axes fraction'),
                xytext=(-3 if late else 3, 0),
                textcoords='offset points',
                ha='right' if late else 'left',
                va='top',
                fontsize='x-small',
                bbox={'boxstyle': 'square,pad=0.1', 'color': 'white', 'alpha': 0.8},
            )


def _mark_step(grid: NDArray[Any], spans: Sequence[TimeWindow]) -> None:
    """Shade the enlarged step in the panels of the whole run, and name both columns."""
    zero_s = _zero_s(spans[0])
    for axes in grid[:, 0]:
        axes.axvspan(spans[1].start_s - zero_s, spans[1].end_s - zero_s, color='0.85', zorder=0)
    grid[0, 0].set_title('whole run; grey: enlarged', fontsize='medium')
    grid[0, 1].set_title('one step', fontsize='medium')
    grid[-1, 1].tick_params(labelleft=False)


def _lay_foot_beside(axes: Axes, foot: Series, zero_s: float) -> None:
    """Draw the foot from where the runner's panel begins, to show when the runner follows it."""
    shifted = display_unit(foot.unit)[0] * (foot.value - foot.value.min()) + axes.get_ylim()[0]
    x, label = foot.time_s - zero_s, 'foot (shifted)'
    axes.plot(x, shifted, color='0.5', linewidth=0.8, linestyle='--', label=label)
    axes.legend(loc='upper left', fontsize='small')
