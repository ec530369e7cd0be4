"""A quick picture of a recorded run, or of a stretch of it, with events and status bits."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from stickslip_ros.errors import OutOfRange, RecordingError, UnknownName
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.series import Series
from stickslip_ros.study.decimation import decimated
from stickslip_ros.study.plotting import dress
from stickslip_ros.study.run_figure import DOTS_PER_INCH, SUFFIXES
from stickslip_ros.study.run_log import BitSpan, LoggedEvent, bits_within, events_within
from stickslip_ros.study.run_quantities import RUN_QUANTITIES, recorded_series
from stickslip_ros.study.time_window import TimeWindow, check_window

SCALES = {'m': (1e9, 'nm'), 'N': (1e3, 'mN'), 'V': (1.0, 'V')}
COLOURS = ('tab:green', 'tab:red', 'tab:blue', 'tab:purple')
WIDTH_INCHES, PANEL_INCHES, BIT_INCHES = 11.0, 1.9, 0.25
LABELLED_MAX = 12
"""Events that are named in the picture; more would hide each other."""
TIMES = ((1e-3, 1e6, 'us'), (1.0, 1e3, 'ms'))
"""Stretches shorter than the first number, s, are drawn in the unit behind it."""


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


def plot_run(path: Path, picture: Path, window: TimeWindow | None = None) -> RunPlot:
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

    Raises
    ------
    RecordingError
        If the recording cannot be read, or holds nothing to draw.
    UnknownName
        If the picture is to be of a kind that cannot be drawn.
    OutOfRange
        If the stretch is outside of the run or has no sample in it.

    """
    if picture.suffix.lower() not in SUFFIXES:
        raise UnknownName('kind of picture', picture.suffix, f'use {", ".join(SUFFIXES)}')
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
    figure = _draw(plot, inside, path.name)
    try:
        picture.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(picture, dpi=DOTS_PER_INCH)
    except OSError as error:
        problem = f'cannot be written ({error.strerror})'
        raise RecordingError(picture, problem, 'choose another place') from None
    return plot


def _whole(series: dict[str, Series]) -> TimeWindow:
    return TimeWindow(
        min(float(each.time_s[0]) for each in series.values()),
        max(float(each.time_s[-1]) for each in series.values()),
    )


def _extent(name: str, series: Series) -> Extent:
    known = series.value[np.isfinite(series.value)]
    smallest = float(known.min()) if len(known) else None
    largest = float(known.max()) if len(known) else None
    return Extent(name, series.unit, len(series), smallest, largest, series.origin)


def _draw(plot: RunPlot, series: dict[str, Series], title: str) -> Figure:
    bits = list(dict.fromkeys(span.bit for span in plot.status))
    heights = [PANEL_INCHES] * len(series) + [0.45 + BIT_INCHES * max(len(bits), 1)]
    figure = Figure(figsize=(WIDTH_INCHES, 0.6 + sum(heights)), layout='constrained')
    FigureCanvasAgg(figure)
    figure.suptitle(title)
    panels = list(figure.subplots(len(heights), 1, sharex=True, height_ratios=heights))
    start_s, factor, unit = _time_axis(plot)
    labels = {each.name: each.label for each in RUN_QUANTITIES}
    for axes, (name, each), colour in zip(panels, series.items(), COLOURS, strict=False):
        scale, shown = SCALES[each.unit]
        pixels = round(WIDTH_INCHES * DOTS_PER_INCH)
        x, y = decimated(each.time_s, each.value, pixels) if len(each) else (each.time_s,) * 2
        axes.plot(factor * (x - start_s), scale * y, color=colour, linewidth=0.8)
        dress(axes, '', f'{labels[name]}\n({shown})')
        axes.margins(x=0.0)
    _draw_bits(panels[-1], plot, bits, (start_s, factor))
    _draw_events(panels, plot, (start_s, factor))
    since = f' after {start_s:.9g} s' if start_s else ''
    panels[-1].set_xlabel(f'simulated time{since} ({unit})')
    panels[-1].set_xlim(*(factor * (each - start_s) for each in (plot.start_s, plot.end_s)))
    return figure


def _time_axis(plot: RunPlot) -> tuple[float, float, str]:
    """Return the zero of the time axis, s, the factor and the unit."""
    length_s = plot.end_s - plot.start_s
    zero_s = plot.start_s if plot.start_s > length_s else 0.0
    for below_s, factor, unit in TIMES:
        if length_s < below_s:
            return zero_s, factor, unit
    return 0.0, 1.0, 's'


def _draw_bits(axes: Axes, plot: RunPlot, bits: list[str], time: tuple[float, float]) -> None:
    """Draw a bar for each stretch during which a bit was set."""
    start_s, factor = time
    for span in plot.status:
        left, width = factor * (span.start_s - start_s), factor * (span.end_s - span.start_s)
        axes.barh(bits.index(span.bit), width, left=left, height=0.6, color='0.55')
    axes.set_yticks(range(len(bits)), [bit.lower() for bit in bits], fontsize='x-small')
    axes.set_ylim(max(len(bits), 1) - 0.5, -0.5)
    axes.set_ylabel('status')
    axes.grid(visible=True, axis='x', alpha=0.3)


def _draw_events(panels: list[Axes], plot: RunPlot, time: tuple[float, float]) -> None:
    start_s, factor = time
    for number, event in enumerate(plot.events):
        at = factor * (event.time_s - start_s)
        for axes in panels:
            axes.axvline(at, color='0.3', linewidth=0.7, linestyle=':')
        if number < LABELLED_MAX:
            late = event.time_s > 0.5 * (plot.start_s + plot.end_s)
            panels[0].annotate(
                f'{event.command}: {event.result}',
                (at, 0.97 - 0.14 * (number % 6)),
                xycoords=('data', 'axes fraction'),
                xytext=(-3 if late else 3, 0),
                textcoords='offset points',
                ha='right' if late else 'left',
                va='top',
                fontsize='x-small',
                bbox={'boxstyle': 'square,pad=0.1', 'color': 'white', 'alpha': 0.8},
            )
