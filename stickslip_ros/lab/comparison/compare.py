# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Compares two files, or a file and the model: recognises them and chooses the way."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stickslip_ros.errors import RecordingError, StickSlipError
from stickslip_ros.lab.comparison import by_amplitude, in_time
from stickslip_ros.lab.comparison.by_amplitude import PointTable
from stickslip_ros.lab.comparison.in_time import TimeRun
from stickslip_ros.lab.comparison.report import ComparisonReport
from stickslip_ros.lab.comparison.result import (
    TIME_COLUMN,
    Alignment,
    Compared,
    Incomparable,
)
from stickslip_ros.lab.experiments.experiment import noise_of
from stickslip_ros.lab.experiments.reading import DriveSource, read_experiments
from stickslip_ros.lab.runs.bands import bands_with_noise
from stickslip_ros.lab.runs.batch import Progress
from stickslip_ros.lab.runs.recorded_run import Run
from stickslip_ros.lab.runs.sweep_table import is_sweep
from stickslip_ros.lab.tables.experiment import (
    OVER_TIME,
    MeasuredTable,
    Reading,
    listed_tables,
    parse_experiment,
    read_experiment,
    read_joined,
)
from stickslip_ros.lab.tables.formats import DATA_FRAME
from stickslip_ros.parameters import Parameters
from stickslip_ros.progress import progress_of
from stickslip_ros.recording.integrity import is_recording
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.run_file import EXPERIMENT_FILE

if TYPE_CHECKING:
    from pandas import DataFrame

    from stickslip_ros.lab.tables.formats import Table

_USUAL_HZ = 1000.0
"""Steps per second of the model, where nothing says another number."""


def compare(
    a: 'Table | Run | Sequence[Table]',
    b: 'Table | Run | Parameters | None' = None,
    *,
    headers: Mapping[str, str] | None = None,
    preloads_n: Sequence[float] = (),
    frequency_hz: float = _USUAL_HZ,
    steps: int = 0,
    commands: 'Table | None' = None,
    frequency_max_hz: float | None = None,
    shift_s: float | None = None,
    align: bool = False,
    offset: bool = False,
    window_s: tuple[float, float] | None = None,
    draws: Sequence[Parameters] = (),
    workers: int = 0,
    report: Callable[[MeasuredTable], None] | None = None,
    progress: bool | Progress = False,
) -> ComparisonReport:
    """
    Compare two runs over time, or two tables by amplitude and preload.

    Parameters
    ----------
    a : path-like, Run, DataFrame, or sequence of them
        A recording, the table of a sweep, an experiment, or several of these by amplitude.
    b : path-like, Run, DataFrame or Parameters, optional
        Another one; parameters run the model at the points of A, or under the voltage that drove
        A; without it a recording is compared with the experiment that it carries.
    headers : mapping of str to str, optional
        Headers of columns in experiment files that do not tell, ``{'force_n': 'CH2 (mN)'}``; and
        topics of recordings of other programs, ``{'force_n': '/rig/cell.wrench.force.x'}``.
    preloads_n : sequence of float
        Preloads of experiment files without such a column, N: one of all, or one of each.
    frequency_hz : float
        Steps per second of the model, where A has none.
    steps : int
        Steps of each of its runs; 0 goes on until the steady state.
    commands : path-like or DataFrame, optional
        What drove A, where it is known: times and voltages; else it is recognised in its voltage.
    frequency_max_hz : float, optional
        Largest number of steps per second, for a monitor so slow that others look alike.
    shift_s : float, optional
        What is added to the times of B, s.
    align : bool
        Estimate that shift by cross-correlation.
    offset : bool
        Lay the position of B onto that of A: find the difference of their zeros and add it.
    window_s : tuple of float, optional
        Start and end of the stretch of A that counts, s.
    draws : sequence of Parameters
        Stands as likely as B, ``Fit.draws(100)``: what they show is told as bands.
    workers : int
        Runs of the model at once; 0 is one per core.
    report : callable, optional
        Called with each ``MeasuredTable`` when it has been read, before anything is computed.
    progress : bool or callable
        Whether to show how far it has come; or what is called with runs done and in all.

    Raises
    ------
    StickSlipError
        If one cannot be read, or the two cannot be compared.

    """
    given: list[Any] = [a] if isinstance(a, Run) else listed_tables(a)
    reading = Reading(headers or {}, preloads_n, report, is_run=isinstance(b, Parameters))
    reading.check_count(len(given) + (b is not None and not isinstance(b, Parameters)))
    times = _Times(shift_s, align, offset, window_s)
    first = (
        _load(given[0], reading, times.read_s)
        if len(given) == 1
        else by_amplitude.of_experiment(read_joined(given, reading))
    )
    if isinstance(first, PointTable):
        times.check_none(first)
    if not isinstance(b, Parameters):
        if draws:
            hint = 'give parameters as B, or leave them away'
            raise Incomparable('draws', 'are of no model', hint)
        if b is None:
            return _compared(first, _attached(given[0], reading), times)
        return _compared(first, _load(b, reading, times.read_of_b_s, len(given)), times)
    shown_by: Callable[[Parameters], TimeRun | PointTable]
    if isinstance(first, TimeRun):
        times.check_unmoved(first)
        if steps or frequency_hz != _USUAL_HZ:
            problem = 'is over time, where the voltage says frequency and steps'
            raise Incomparable(first.side.origin, problem, 'leave --frequency and --steps away')
        times = times._replace(offset=True)
        source = DriveSource(commands, frequency_max_hz, window_s=window_s)
        [experiment] = read_experiments(given, b, replace(reading, report=None), source)
        shown_by = partial(in_time.of_model, experiment)
    else:
        if commands is not None or frequency_max_hz is not None:
            hint = 'leave --commands and --frequency-max away'
            raise Incomparable(first.side.origin, 'is by amplitude: no voltage drove it', hint)
        shown_by = partial(
            by_amplitude.of_model,
            first,
            frequency_hz=frequency_hz,
            steps=steps,
            workers=workers,
            progress=False if draws else progress,
        )
    return _with_bands(lambda stand: _compared(first, shown_by(stand), times), b, draws, progress)


class _Times(NamedTuple):
    """What is said of the times of A and B, and of the zeros of their positions."""

    shift_s: float | None
    align: bool
    offset: bool
    window_s: tuple[float, float] | None

    @property
    def read_s(self) -> tuple[float, float] | None:
        """The stretch of A to read: all, where the clocks are laid upon each other by all."""
        return None if self.align else self.window_s

    @property
    def read_of_b_s(self) -> tuple[float, float] | None:
        """The same of B, in its own times."""
        late_s = self.shift_s or 0.0
        return self.read_s and (self.read_s[0] - late_s, self.read_s[1] - late_s)

    def check_unmoved(self, a: TimeRun) -> None:
        """Refuse a shift of what drove A itself."""
        if self.align or self.shift_s is not None:
            hint = 'leave --shift and --align away: the clock is found by the falls'
            raise Incomparable(a.side.origin, 'is compared with what drove it', hint)

    def check_none(self, a: PointTable) -> None:
        """Refuse times of points."""
        if self != (None, False, False, None):
            hint = 'leave --shift, --align, --offset and --window away'
            raise Incomparable(a.side.origin, 'is by amplitude and knows no time', hint)


def _compared(a: PointTable | TimeRun, b: PointTable | TimeRun, times: _Times) -> ComparisonReport:
    """Compare two that are over time, or two by amplitude."""
    if isinstance(a, PointTable) and isinstance(b, PointTable):
        return ComparisonReport(a.side, b.side, a.axis, by_amplitude.compare(a, b))
    if isinstance(a, PointTable) or isinstance(b, PointTable):
        raise Incomparable(
            b.side.origin,
            f'is a {b.side.kind}, {a.side.origin} a {a.side.kind}',
            'compare two over time, or two by amplitude and preload',
        )
    if times.align:
        b = b.moved(in_time.align(a, b))
    elif times.shift_s is not None:
        b = b.moved(Alignment(times.shift_s, 'given'))
    if times.window_s is not None:
        a, b = a.within(*times.window_s), b.within(*times.window_s)
    found = in_time.compare(a, b, offset=times.offset)
    made = in_time.steps_of(a), in_time.steps_of(b)
    steps_of_both = None if made[0] is None or made[1] is None else (made[0], made[1])
    return ComparisonReport(
        a.side, b.side, TIME_COLUMN, found, b.alignment, times.window_s, steps_of_both
    )


def _with_bands(
    compared_with: Callable[[Parameters], ComparisonReport],
    stand: Parameters,
    draws: Sequence[Parameters],
    progress: bool | Progress,
) -> ComparisonReport:
    """Return the comparison with a stand, with bands of what draws and noise show."""
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
                noise = np.array(noise_of(part.a) if part.axis == TIME_COLUMN else 0.0)
            parts.append(replace(part, band=bands_with_noise(drawn, part.b, noise)))
        quantities.append(replace(quantity, parts=tuple(parts)))
    return replace(report, quantities=tuple(quantities))


def _load(
    given: 'Table | Run',
    reading: Reading,
    window_s: tuple[float, float] | None,
    number: int = 0,
) -> PointTable | TimeRun:
    """Read a file by what is in it, not by its name; of a recording a window is enough."""
    given = Path(given) if isinstance(given, str) else given
    if isinstance(given, Run) or (isinstance(given, Path) and is_recording(given)):
        recording = given.recording if isinstance(given, Run) else Recording(given)
        topics = (given.topics if isinstance(given, Run) else None) or reading.topics
        if window_s is not None:
            recording = recording.within(*window_s)
        return in_time.of_recording(recording, topics)
    if is_sweep(given):
        return by_amplitude.of_sweep(given)
    return _of_experiment(read_experiment(given, reading, number=number))


def _attached(given: 'Path | DataFrame | Run', reading: Reading) -> PointTable | TimeRun:
    """Return the experiment that a recording carries."""
    hint = 'name B, or the word model'
    if not isinstance(given, Run | Path):
        raise RecordingError(DATA_FRAME, 'stands alone and is no recording', hint)
    path = given if isinstance(given, Path) else given.path
    try:
        recording = Recording(path)
    except StickSlipError as error:
        raise RecordingError(path, f'stands alone and is no recording ({error})', hint) from None
    if EXPERIMENT_FILE not in recording.attachments:
        hint = 'name what to compare it with as B'
        raise RecordingError(path, f'carries no {EXPERIMENT_FILE}', hint)
    content = recording.attachments[EXPERIMENT_FILE][1]
    return _of_experiment(parse_experiment(content, f'{path} {EXPERIMENT_FILE}', reading))


def _of_experiment(experiment: MeasuredTable) -> PointTable | TimeRun:
    is_run = experiment.kind == OVER_TIME
    return in_time.of_experiment(experiment) if is_run else by_amplitude.of_experiment(experiment)
