"""The picture of a recorded run, or of a stretch of it, with events and status bits."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
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
TIMES = ((1e-3, 1e6, 'us'), (1.0, 1e3, 'ms'))
"""Stretches shorter than the first number, s, are drawn in the unit behind it."""
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


class _TimeAxis(NamedTuple):
    """Zero of a time axis, s, factor to its unit, and the unit."""

    zero_s: float
    factor: float
    unit: str

    def at(self, time_s: Any) -> Any:
        """Return a time, or an array of them, as it is drawn."""
        return self.factor * (time_s - self.zero_s)


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

    Parameters
    ----------
    path : Path
        The recording; its trace is drawn, else its topics.
    picture : Path
        PNG, SVG or PDF file to write; folders are made.
    window : TimeWindow, optional
        Stretch to draw; the whole run without.
    title : str
        Heading; the file's name if empty.
    with_step : bool
        Whether one step is enlarged beside it.

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
        time = _time_axis(span)
        for axes, name in zip(panels, names, strict=False):
            _draw_series(axes, name, series[name].window(*span), time)
        _draw_bits(panels[-1], plot, bits, time)
        since = f' after {time.zero_s:.9g} s' if time.zero_s else ''
        panels[-1].set_xlabel(f'simulated time{since} ({time.unit})')
        panels[-1].set_xlim(*map(time.at, span))
    for axes, name in zip(grid[:, 0], names, strict=False):
        axes.set_ylabel(f'{RUN_QUANTITIES[name]}\n({display_unit(series[name].unit)[1]})')
    grid[-1, 0].set_ylabel('status')
    _draw_events(list(grid[:, 0]), plot, _time_axis(spans[0]))
    if with_step:
        _mark_step(grid, spans)
        if names[0] == 'position_m' and 'foot_m' in series:
            _lay_foot_beside(grid[0, 1], series['foot_m'].window(*spans[1]), spans[1])
    return figure


def _time_axis(span: TimeWindow) -> _TimeAxis:
    length_s = span.end_s - span.start_s
    zero_s = span.start_s if span.start_s > length_s else 0.0
    for below_s, factor, unit in TIMES:
        if length_s < below_s:
            return _TimeAxis(zero_s, factor, unit)
    return _TimeAxis(0.0, 1.0, 's')


def _draw_series(axes: Axes, name: str, series: Series, time: _TimeAxis) -> None:
    x, y = series.time_s, display_unit(series.unit)[0] * series.value
    if len(series):
        x, y = decimated(x, y, round(WIDTH_INCHES * DOTS_PER_INCH))
    axes.plot(time.at(x), y, color=COLOURS[name], linewidth=0.8)
    label_axes(axes, '', '')
    axes.margins(x=0.0)


def _draw_bits(axes: Axes, plot: RunPlot, bits: Sequence[str], time: _TimeAxis) -> None:
    """Draw a bar for each stretch during which a bit was set."""
    for span in plot.status:
        width = time.factor * (span.end_s - span.start_s)
        axes.barh(
            bits.index(span.bit), width, left=time.at(span.start_s), height=0.6, color='0.55'
        )
    axes.set_yticks(range(len(bits)), [bit.lower() for bit in bits], fontsize='x-small')
    axes.set_ylim(max(len(bits), 1) - 0.5, -0.5)
    axes.grid(visible=True, axis='x', alpha=0.3)


def _draw_events(panels: Sequence[Axes], plot: RunPlot, time: _TimeAxis) -> None:
    """Draw a line at the end of each command; of equal ones in a row the first is named."""
    labels = [f'{event.command}: {event.result}' for event in plot.events]
    named = 0
    for index, event in enumerate(plot.events):
        for axes in panels:
            axes.axvline(time.at(event.time_s), color='0.3', linewidth=0.7, linestyle=':')
        if named < LABELLED_MAX and labels[index] not in labels[max(index - 1, 0) : index]:
            late = event.time_s > 0.5 * (plot.start_s + plot.end_s)
            panels[0].annotate(
                labels[index],
                (time.at(event.time_s), 0.97 - 0.14 * (named % 6)),
                xycoords=('data', 'axes fraction'),
                xytext=(-3 if late else 3, 0),
                textcoords='offset points',
                ha='right' if late else 'left',
                va='top',
                fontsize='x-small',
                bbox={'boxstyle': 'square,pad=0.1', 'color': 'white', 'alpha': 0.8},
            )
            named += 1


def _mark_step(grid: NDArray[Any], spans: Sequence[TimeWindow]) -> None:
    """Shade the enlarged step in the panels of the whole run, and name both columns."""
    time = _time_axis(spans[0])
    for axes in grid[:, 0]:
        axes.axvspan(*map(time.at, spans[1]), color='0.85', zorder=0)
    grid[0, 0].set_title('whole run; grey: enlarged', fontsize='medium')
    grid[0, 1].set_title('one step', fontsize='medium')
    grid[-1, 1].tick_params(labelleft=False)


def _lay_foot_beside(axes: Axes, foot: Series, span: TimeWindow) -> None:
    """Draw the foot from where the runner's panel begins, to show when the runner follows it."""
    low, _ = axes.get_ylim()
    shifted = display_unit(foot.unit)[0] * (foot.value - foot.value.min()) + low
    axes.plot(
        _time_axis(span).at(foot.time_s),
        shifted,
        color='0.5',
        linewidth=0.8,
        linestyle='--',
        label='foot (shifted)',
    )
    axes.legend(loc='upper left', fontsize='small')
