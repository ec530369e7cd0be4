# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Compare two files, or a file and the model, over time or by amplitude."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from stickslip_ros.lab.comparison import by_amplitude, in_time
from stickslip_ros.lab.comparison.result import Alignment, Compared, Comparison, Incomparable
from stickslip_ros.lab.comparison.words import sections, sentences
from stickslip_ros.lab.experiments.options import ReadingOptions
from stickslip_ros.lab.experiments.reading import experiment_of
from stickslip_ros.lab.experiments.sensor import noise_of
from stickslip_ros.lab.experiments.sensor_clock import LEAD_S
from stickslip_ros.lab.figures.plottable import Plottable
from stickslip_ros.lab.measurements.measurement import (
    Measurement,
    PointTable,
    TimeRun,
    attached,
    measured,
)
from stickslip_ros.lab.measurements.recorded_run import Run
from stickslip_ros.lab.measurements.tables import listed_sources
from stickslip_ros.lab.measurements.vocabulary import MeasuredTable
from stickslip_ros.lab.runs.bands import bands_with_noise
from stickslip_ros.lab.runs.batch import Progress
from stickslip_ros.parameters import Parameters, checked_arguments
from stickslip_ros.progress import progress_of
from stickslip_ros.sections import Section

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from stickslip_ros.lab.readers.formats import Table


@checked_arguments
@dataclass(frozen=True, kw_only=True)
class CompareOptions(ReadingOptions):
    """Options of reading two experiments, and of matching times and positions."""

    shift_s: float | None = None
    """Time to add to the times of B, s."""
    align: bool = False
    """Estimate the shift by cross-correlation."""
    offset: bool = False
    """Shift the position of B to that of A, since its zero is arbitrary."""


class ComparisonReport(Plottable, Comparison):
    """The result of ``compare``."""

    def sections(self) -> Iterator[Section]:
        """Yield the findings, the two sides, and the numbers of each quantity."""
        return sections(self, self._draw)

    def _draw(self, quantities: Sequence[Compared] = ()) -> 'Figure':
        # slow import
        from stickslip_ros.lab.comparison.figure import draw_comparison  # noqa: PLC0415

        return draw_comparison(self, quantities or self.quantities)

    def __repr__(self) -> str:
        return '\n'.join(sentences(self))


@checked_arguments
def compare(
    a: 'Table | Run | Sequence[Table]',
    b: 'Table | Run | Parameters | Mapping[str, object] | None' = None,
    *,
    options: CompareOptions = CompareOptions(),
    draws: Sequence[Parameters] = (),
    report: Callable[[MeasuredTable], None] | None = None,
    progress: bool | Progress = False,
) -> ComparisonReport:
    """
    Compare two runs over time, or two tables by amplitude and preload.

    Parameters
    ----------
    a : path-like, Run, DataFrame, or sequence of them
        A recording, the table of a sweep, an experiment, or several experiments by amplitude.
    b : path-like, Run, DataFrame or Parameters, optional
        The same. Parameters run the model at the points of A, or under the voltage of A. By
        default a recording is compared with its attached experiment.
    options : CompareOptions, optional
        Options of reading both, and of matching times and positions.
    draws : sequence of Parameters
        Stands as likely as B, such as ``Fit.draws(100)``; bands show their spread.
    report : callable, optional
        Called with each ``MeasuredTable`` after reading, before the computation.
    progress : bool or callable
        Whether to show progress; or a function, called with runs done and total runs.

    Raises
    ------
    StickSlipError
        If a side cannot be read, or the sides cannot be compared.

    """
    if isinstance(b, Mapping) and all('.' in str(each) for each in b):
        b = Parameters().updated(b)
    given = listed_sources(a)
    window_s = None if options.align else options.window_s  # alignment needs both in full
    others = [] if b is None or isinstance(b, Parameters) else listed_sources(b)
    reading = options.reading(report, b if isinstance(b, Parameters) else None)
    reading = reading.for_sources([*given, *others])
    stretch_s = None
    if window_s is not None and options.commands is None:  # a model starts before the window
        stretch_s = window_s[0] - LEAD_S * isinstance(b, Parameters), window_s[1]
    first = measured(given, reading, window_s=stretch_s)
    has_times = options.align or options.offset or options.shift_s is not None or options.window_s
    if isinstance(first, PointTable) and has_times:
        hint = 'leave out --shift, --align, --offset and --window'
        raise Incomparable(first.side.origin, 'is by amplitude and has no times', hint)
    if not isinstance(b, Parameters):
        if draws:
            hint = 'give parameters as B, or leave them out'
            raise Incomparable('draws', 'need the model as B', hint)
        if b is None:
            return _compared(first, attached(first, reading), options)
        [other], shift_s = others, options.shift_s or 0.0
        window_s = window_s and (window_s[0] - shift_s, window_s[1] - shift_s)  # in the times of B
        second = measured(other, reading, number=len(given), window_s=window_s)
        return _compared(first, second, options)
    quiet = False if draws else progress
    shown_by, options = _model_for(first, b, reading.preload_n(0), options, quiet)
    return _with_bands(
        lambda stand: _compared(first, shown_by(stand), options), b, draws, progress
    )


def _model_for(
    a: Measurement,
    stand: Parameters,
    preload_n: float | None,
    options: CompareOptions,
    progress: bool | Progress,
) -> tuple[Callable[[Parameters], Measurement], CompareOptions]:
    """Return a function that runs a stand as A was run, and the options."""
    if isinstance(a, TimeRun):
        _check_unmoved(a, options)
        options = replace(options, offset=True)
        experiment = experiment_of(a, stand, preload_n, options)
        return partial(in_time.predicted_run, experiment), options
    if options.commands is not None:
        hint = 'leave out --commands'
        raise Incomparable(a.side.origin, 'is by amplitude: no voltage drove it', hint)
    points = by_amplitude.predicted_points
    return partial(points, a, options=options, progress=progress), options


def _check_unmoved(a: TimeRun, options: CompareOptions) -> None:
    """Refuse shift, frequency and steps for the model under the voltage of A."""
    if options.align or options.shift_s is not None:
        hint = 'leave out --shift and --align: the falls of the voltage give the clock'
        raise Incomparable(a.side.origin, 'is compared with a model under its own voltage', hint)
    usual = CompareOptions()
    if (options.frequency_hz, options.steps) != (usual.frequency_hz, usual.steps):
        problem = 'is over time: its voltage gives frequency and steps'
        raise Incomparable(a.side.origin, problem, 'leave out --frequency and --steps')


def _compared(a: Measurement, b: Measurement, options: CompareOptions) -> ComparisonReport:
    """Compare two runs over time, or two tables by amplitude."""
    if isinstance(a, PointTable) and isinstance(b, PointTable):
        return ComparisonReport(a.side, b.side, a.axis, by_amplitude.compare_points(a, b))
    if isinstance(a, PointTable) or isinstance(b, PointTable):
        raise Incomparable(
            b.side.origin,
            f'is a {b.side.kind}, {a.side.origin} a {a.side.kind}',
            'compare two files over time, or two by amplitude and preload',
        )
    if options.align:
        b = b.moved(in_time.align(a, b))
    elif options.shift_s is not None:
        b = b.moved(Alignment(options.shift_s, 'given'))
    if options.window_s is not None:
        a, b = a.within(*options.window_s), b.within(*options.window_s)
    found = in_time.compare_runs(a, b, offset=options.offset)
    made = in_time.steps_of(a), in_time.steps_of(b)
    steps_of_both = None if made[0] is None or made[1] is None else (made[0], made[1])
    return ComparisonReport(
        a.side, b.side, 'time_s', found, b.alignment, options.window_s, steps_of_both
    )


def _with_bands(
    compared_with: Callable[[Parameters], ComparisonReport],
    stand: Parameters,
    draws: Sequence[Parameters],
    progress: bool | Progress,
) -> ComparisonReport:
    """Compare with a stand; add bands from draws and noise."""
    report = compared_with(stand)
    if not draws:
        return report
    found = list[tuple[Compared, ...]]()
    with progress_of(progress, 'draws') as show:
        for number, each in enumerate(draws, 1):
            found.append(compared_with(each).quantities)
            show(number, len(draws))
    quantities = []
    for k, quantity in enumerate(report.quantities):
        parts = []
        for j, part in enumerate(quantity.parts):
            drawn = [each[k].parts[j].b for each in found]
            noise = part.sigma
            if noise is None:
                noise = np.array(noise_of(part.a) if part.axis == 'time_s' else 0.0)
            parts.append(replace(part, band=bands_with_noise(drawn, part.b, noise)))
        quantities.append(replace(quantity, parts=tuple(parts)))
    return replace(report, quantities=tuple(quantities))
