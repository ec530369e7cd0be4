# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Figure of a run or a part of it, with the commands of a recording."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import cycle, groupby
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import EngFormatter

from stickslip_ros.arrays import Array
from stickslip_ros.errors import OutOfRange, RecordingError
from stickslip_ros.instrument.reports import Result
from stickslip_ros.lab.figures.plotting import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    PURPLE,
    SKY_BLUE,
    VERMILION,
    check_picture,
    decimated,
    is_narrow,
    label_end,
    new_figure,
    save_figure,
    styled,
    write_label,
)
from stickslip_ros.lab.measurements.measurement import TimeRun
from stickslip_ros.lab.measurements.recorded import (
    RUN_QUANTITIES,
    LoggedCommand,
    LoggedEvent,
    TimeWindow,
    check_window,
    events_within,
    recorded_commands,
    recorded_series,
    series_by_stretch,
    stretches_of,
)
from stickslip_ros.parameters import SENSORS
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.series import Series
from stickslip_ros.units import NM, display_unit

COLOURS = {
    **dict(zip((each.quantity for each in SENSORS), cycle((GREEN, VERMILION, SKY_BLUE)))),
    'voltage_v': BLUE,
    'foot_m': PURPLE,
}
WIDTH_INCHES, PANEL_INCHES, STEPS_INCHES, LANE_INCHES = 11.0, 1.7, 3.2, 0.28
PIXELS = 1320  # screen pixels across the figure
LABEL_CHARACTERS = 17, 13  # characters per line of an axis label, in wide and narrow figures
GAP_PX = 3.0  # between labels
LABELLED_MAX = 12  # commands with written numbers; more would overlap
_FALL_SHARE = 0.5  # least fall between two samples, as a share of the voltage range
_STEPS = 4  # falls in the enlarged part
BEFORE_PERIODS, AFTER_PERIODS = 1.2, 0.6
"""Periods shown before the first and after the last fall."""
SLIP_SHARE = 0.1  # least step with slip at the fall, as a share of the stroke
_DONE, _ABORTED = Result.DONE.name, Result.ABORTED.name


@dataclass(frozen=True)
class Extent:
    """A quantity in a figure: number of samples, range, source."""

    name: str
    unit: str
    samples: int
    smallest: float | None
    largest: float | None
    origin: str

    @classmethod
    def of(cls, name: str, values: Array, unit: str, origin: str) -> 'Extent':
        """Return the extent of values; its range is None without finite values."""
        known = values[np.isfinite(values)]
        smallest = float(known.min()) if len(known) else None
        largest = float(known.max()) if len(known) else None
        return cls(name, unit, len(values), smallest, largest, origin)


@dataclass(frozen=True)
class RunPlot:
    """Content of a figure."""

    start_s: float
    end_s: float
    quantities: tuple[Extent, ...]
    commands: tuple[LoggedCommand, ...]
    events: tuple[LoggedEvent, ...] = ()

    @property
    def title(self) -> str:
        return f'{self.start_s:.9g} s to {self.end_s:.9g} s'


def plot_run(
    run: Recording | TimeRun, picture: Path, window: TimeWindow | None = None, **how: Any
) -> RunPlot:
    """Draw a run or a part into a PNG, SVG or PDF, with the options of ``draw_run``."""
    check_picture(picture)
    figure, plot = draw_run(run, window, **how)
    save_figure(figure, picture)
    return plot


def draw_run(
    run: Recording | TimeRun,
    window: TimeWindow | None = None,
    *,
    title: str = '',
    with_steps: bool = False,
) -> tuple[Figure, RunPlot]:
    """
    Draw position, force, voltage and feet over time, in a window if given.

    A long recording is read in parts; ``with_steps`` adds the first steps, enlarged. Raises
    RecordingError and OutOfRange.

    """
    if isinstance(run, TimeRun):
        recording, origin, quantities = run.recording, run.side.origin, run.series
        extents = dict[str, Extent]()
    else:
        recording, origin = run, run.origin
        quantities, extents = _overview(run, window)
    series = {name: each for name, each in quantities.items() if name in RUN_QUANTITIES}
    if not series:
        problem = 'has neither position, force nor voltage'
        hint = 'record a longer run, or map its topics with --map'
        raise RecordingError(origin, problem, hint)
    commands = recorded_commands(recording) if recording else []
    firsts_s = [float(each.time_s[0]) for each in series.values()]
    whole = TimeWindow(
        min(*firsts_s, *(each.time_s for each in commands[:1]), math.inf),
        max(float(each.time_s[-1]) for each in series.values()),
    )
    shown = whole if window is None else check_window(window, whole)
    inside = {name: each.window(*shown) for name, each in series.items()}
    if not any(len(each) for each in inside.values()):
        length_s, limit = shown.end_s - shown.start_s, 'too short: no sample lies in it'
        raise OutOfRange('length of the window', length_s, 's', limit, 'raise it')
    quantities_shown = tuple(
        extents.get(name) or Extent.of(name, each.value, each.unit, each.origin)
        for name, each in inside.items()
    )
    commands = [each for each in commands if shown.start_s <= each.time_s <= shown.end_s]
    events = events_within(recording, shown) if recording else []
    plot = RunPlot(*shown, quantities_shown, tuple(commands), tuple(events))
    falls_s = fall_times_s(inside['voltage_v']) if with_steps and 'voltage_v' in inside else []
    with_steps = len(falls_s) >= _STEPS and {'position_m', 'foot_m'} <= inside.keys()
    enlarged_s = falls_s[:_STEPS] if with_steps else []
    return _draw(plot, inside, enlarged_s, title), plot


def _overview(
    recording: Recording, window: TimeWindow | None
) -> tuple[dict[str, Series], dict[str, Extent]]:
    """Return quantities, thinned for a long recording, and the extents of all samples."""
    stretches = stretches_of(recording)
    if len(stretches) == 1:
        return recorded_series(recording), {}
    if window is not None:
        stretches = stretches_of(recording, check_window(window, TimeWindow(*recording.span_s)))
    pixels = math.ceil(PIXELS / len(stretches))
    thin, samples = dict[str, list[Series]](), Counter[str]()
    for found in series_by_stretch(recording, stretches):
        for name, each in found.items():
            if len(each):
                time_s, value = decimated(each.time_s, each.value, pixels)  # keeps the extremes
                thin.setdefault(name, []).append(replace(each, time_s=time_s, value=value))
                samples[name] += len(each)
    joined = {
        name: replace(
            parts[0],
            time_s=np.concatenate([each.time_s for each in parts]),
            value=np.concatenate([each.value for each in parts]),
        )
        for name, parts in thin.items()
    }
    return joined, {
        name: replace(Extent.of(name, each.value, each.unit, each.origin), samples=samples[name])
        for name, each in joined.items()
    }


def fall_times_s(voltage: Series) -> list[float]:
    """Return the times, s, of the last sample before each fall of a saw-tooth."""
    change = np.abs(np.diff(voltage.value))
    falls = np.flatnonzero(change > _FALL_SHARE * np.ptp(voltage.value))
    return [float(each) for each in voltage.time_s[falls]]


@styled()
def _draw(
    plot: RunPlot, series: Mapping[str, Series], falls_s: Sequence[float], title: str
) -> Figure:
    """Draw the steps around falls, if any, above panels of all quantities."""
    shown = [name for name in series if name != 'foot_m' or not falls_s]
    failed = [event for event in plot.events if event.result != _DONE]
    names = [each.command for each in plot.commands] + [each.command for each in failed]
    lanes = list(dict.fromkeys(names))
    heights = [STEPS_INCHES] * bool(falls_s) + [PANEL_INCHES] * len(shown)
    heights += [0.45 + LANE_INCHES * len(lanes)] * bool(lanes)
    figure = new_figure(WIDTH_INCHES, 0.6 + sum(heights), title)
    panels = list(figure.subplots(len(heights), 1, squeeze=False, height_ratios=heights)[:, 0])
    enlarged = _draw_steps(panels.pop(0), series, falls_s) if falls_s else None
    span = TimeWindow(plot.start_s, plot.end_s)
    zero_s = _zero_s(span)
    for axes, name in zip(panels, shown, strict=False):
        _draw_series(axes, name, series[name], zero_s)
        label = f'{RUN_QUANTITIES[name]} ({display_unit(series[name].unit)[1]})'
        axes.set_ylabel(fill(label, LABEL_CHARACTERS[is_narrow(figure)]))
        for group in _in_a_row(plot):  # start of a command
            axes.axvline(group[0].time_s - zero_s, color=GREY, linewidth=0.8, linestyle=':')
        if enlarged is not None:
            ends_s = enlarged.start_s - zero_s, enlarged.end_s - zero_s
            axes.axvspan(*ends_s, color='0.85', zorder=0)
    labels = _draw_lanes(panels[-1], plot, failed, lanes) if lanes else []
    for axes in panels[:-1]:
        axes.sharex(panels[-1])
        axes.tick_params(labelbottom=False)
    _set_time_axis(panels[-1], span)
    if labels:
        figure.draw_without_rendering()  # needed for positions
        _write_labels(panels[-1], labels)
    return figure


def _zero_s(span: TimeWindow) -> float:
    """Return the zero of the time axis, s: the start of a short, late part, else 0."""
    return span.start_s if span.start_s > span.end_s - span.start_s else 0.0


def _set_time_axis(axes: Axes, span: TimeWindow) -> None:
    zero_s = _zero_s(span)
    axes.set_xlabel('time' + (f' after {zero_s:.9g} s' if zero_s else ''))
    axes.set_xlim(span.start_s - zero_s, span.end_s - zero_s)
    axes.xaxis.set_major_formatter(EngFormatter('s'))
    if is_narrow(axes.figure):
        axes.locator_params(axis='x', nbins=4)


def _draw_series(axes: Axes, name: str, series: Series, zero_s: float) -> Line2D:
    x, y = series.time_s - zero_s, display_unit(series.unit)[0] * series.value
    if len(series):
        x, y = decimated(x, y, PIXELS)
    [line] = axes.plot(x, y, color=COLOURS[name], linestyle='-', linewidth=0.8)
    axes.margins(x=0.0)
    return line


def _draw_steps(axes: Axes, series: Mapping[str, Series], falls_s: Sequence[float]) -> TimeWindow:
    """Draw runner and feet on one axis around falls; return the time window."""
    period_s = (falls_s[-1] - falls_s[0]) / (len(falls_s) - 1)
    start_s = falls_s[0] - BEFORE_PERIODS * period_s
    span = TimeWindow(start_s, falls_s[-1] + AFTER_PERIODS * period_s)
    runner, feet = (series[name].window(*span) for name in ('position_m', 'foot_m'))
    zero_s = _zero_s(span)
    for name, each, label in (('position_m', runner, 'runner'), ('foot_m', feet, 'feet')):
        label_end(axes, _draw_series(axes, name, each, zero_s), label)
    runner_line, feet_line = axes.lines
    runner_line.set_linewidth(1.2)
    feet_line.set(linewidth=1.4, linestyle='--')
    before_nm = NM * np.interp(falls_s, runner.time_s, runner.value)
    step_nm = float(before_nm[-1] - before_nm[0]) / (len(falls_s) - 1)
    stroke_nm = NM * float(np.ptp(feet.value))
    title = f'first steps, enlarged: {step_nm:.0f} nm each; the feet move by {stroke_nm:.0f} nm'
    axes.set(title=title, ylabel='displacement (nm)')
    if step_nm > SLIP_SHARE * stroke_nm:
        fall_s, at_nm = falls_s[1] - zero_s, float(before_nm[1])
        stick = fall_s - 0.5 * period_s, at_nm - 0.5 * stroke_nm
        style: dict[str, Any] = {'arrowprops': {'arrowstyle': '->', 'color': BLACK}}
        style |= {'xytext': (-40, 32), 'textcoords': 'offset points', 'ha': 'center'}
        for word, place in (('stick', stick), ('slip', (fall_s, at_nm))):
            axes.annotate(word, place, **style)
    _set_time_axis(axes, span)
    return span


def _in_a_row(plot: RunPlot) -> list[list[LoggedCommand]]:
    """Group equal successive commands."""
    return [list(group) for _, group in groupby(plot.commands, lambda each: each.command)]


def _draw_lanes(
    axes: Axes, plot: RunPlot, failed: Sequence[LoggedEvent], lanes: Sequence[str]
) -> list[tuple[int, float, float, str]]:
    """Mark commands and failures; return lane, ends and text of each label."""
    labels, zero_s = [], _zero_s(TimeWindow(plot.start_s, plot.end_s))
    for number, group in enumerate(_in_a_row(plot)):
        lane, times_s = lanes.index(group[0].command), [each.time_s - zero_s for each in group]
        axes.plot(times_s, [lane] * len(group), '|', color=BLACK, markersize=9.0)
        ends = dict.fromkeys((group[0].numbers, group[-1].numbers))
        words = ' to '.join(ends) if number < LABELLED_MAX else ''
        labels.append((lane, times_s[0], times_s[-1], words))
    for event in failed:
        lane, time_s = lanes.index(event.command), event.time_s - zero_s
        axes.plot(time_s, lane, 'x', color=BLACK, markersize=5.0)
        why = event.message.partition(':')[0] if event.result == _ABORTED else ''
        labels.append((lane, time_s, time_s, why or event.result))
    axes.set_yticks(range(len(lanes)), lanes, fontsize='small')
    axes.set_ylim(len(lanes) - 0.5, -0.5)
    axes.grid(visible=False, axis='y')
    return sorted(labels)


def _write_labels(axes: Axes, labels: Sequence[tuple[int, float, float, str]]) -> None:
    """Write each label to the right or left of its mark, if there is room."""
    free_px: dict[int, float] = {}
    for number, (lane, first, last, words) in enumerate(labels):
        following = [start for row, start, *_ in labels[number + 1 :] if row == lane]
        places = [(x, lane) for x in (last, *following[:1])]
        last_px, *next_px = axes.transData.transform(places)[:, 0]
        begin_px, free_px[lane] = free_px.get(lane, axes.bbox.x0), last_px
        for x, left in ((last, False), (first, True)):
            label = write_label(axes, x, lane, words, left=left, size='small')
            box = label.get_window_extent().padded(GAP_PX)
            if begin_px <= box.x0 and box.x1 <= min([*next_px, axes.bbox.x1]):
                free_px[lane] = max(last_px, box.x1)
                break
            label.remove()
