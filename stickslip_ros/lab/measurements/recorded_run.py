# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A recorded or measured run: series, table, figure."""

import shutil
import weakref
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from functools import cache, cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from stickslip_ros.errors import RecordingError, StickSlipError, WrongUse
from stickslip_ros.files import RUN_ENDINGS, prepare_output
from stickslip_ros.lab.measurements.measurement import (
    OpenedSource,
    TimeRun,
    measured,
    table_of_series,
)
from stickslip_ros.lab.measurements.recorded import (
    RUN_QUANTITIES,
    TimeWindow,
    recorded_series,
    recorded_stand,
    sections_of,
)
from stickslip_ros.lab.measurements.run_result import SawtoothRun
from stickslip_ros.lab.measurements.table_options import TableOptions
from stickslip_ros.parameters import Parameters, checked_arguments
from stickslip_ros.recording.integrity import is_recording
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.series import Series
from stickslip_ros.sections import NotebookView, Section
from stickslip_ros.units import with_unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

    from stickslip_ros.lab.readers.formats import Table

    class RunTable(DataFrame):
        """A table whose ``plot`` returns figures and whose ``to_xarray`` keeps the units."""

        plot: Any


@checked_arguments
class Run(NotebookView, OpenedSource):
    """
    A recorded or measured run; a temporary file lives as long as this object.

    Parameters
    ----------
    path : path-like, DataFrame, or sequence of them, optional
        An MCAP file, a bag directory, the common name of parts, or a table over time; several
        tables are joined. None without a recording.
    result : SawtoothRun, optional
        The result of a simulated run.
    folder : Path, optional
        A folder to remove with this object.
    topics : mapping of str to str, optional
        Topic and field of each quantity in a recording of another program; its column in a table.

    """

    def __init__(
        self,
        path: 'Table | Sequence[Table] | None',
        result: SawtoothRun | None = None,
        folder: Path | None = None,
        topics: Mapping[str, str] | None = None,
    ) -> None:
        self._path = Path(path) if isinstance(path, str) else path
        self._result = result
        self._origin = '' if folder is None else 'simulated run'
        self.topics = topics or {}
        if folder is not None:
            weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)

    @cached_property
    def recording(self) -> Recording:
        """The recording; StickSlipError if it is missing, damaged or a table."""
        if self._path is None:
            raise StickSlipError('the run was not recorded; simulate without record=False')
        if not isinstance(self._path, Path):
            raise StickSlipError('a table holds no commands and no stand; use its series')
        return Recording(self._path, self._origin)

    @property
    def path(self) -> Path:
        """Path of the recording's file."""
        return self.recording.path

    @cached_property
    def parameters(self) -> Parameters:
        """The stand; RecordingError if it was not recorded."""
        return recorded_stand(self.recording)

    @property
    def result(self) -> SawtoothRun:
        """The result of the saw-tooth; StickSlipError unless made by ``simulate``."""
        if self._result is None:
            raise StickSlipError(f'{self.path} was opened, not simulated; use its frame')
        return self._result

    @property
    def force_mean_n(self) -> float:
        """Generated force of a simulated run, mean over the last cycle, N."""
        return self.result.force_mean_n

    @property
    def step_length_m(self) -> float:
        """Net motion per cycle of a simulated run, mean over the last cycles, m."""
        return self.result.step_length_m

    @cached_property
    def source(self) -> Any:
        """The recording, or the tables as given."""
        is_table = self._path is not None and not (
            isinstance(self._path, Path) and is_recording(self._path)
        )
        return self._path if is_table else self.recording

    @property
    def is_read_whole(self) -> bool:
        """Whether all series are in memory: a table, or a recording of another program."""
        return bool(self.topics) or not isinstance(self.source, Recording)

    @cached_property
    def measurement(self) -> TimeRun:
        """Quantities over time, with source, clocks and stand; cached."""
        found = measured(self.source, TableOptions(headers=self.topics))
        if isinstance(found, TimeRun):
            return found
        hint = 'use compare or fit, or read it with pandas'
        raise RecordingError(found.side.origin, 'is by amplitude and has no times', hint)

    @property
    def series(self) -> dict[str, Series]:
        """Quantities over time by the column names of ``frame``."""
        return self.measurement.series

    @checked_arguments
    def series_within(self, start_s: float, end_s: float) -> dict[str, Series]:
        """Return ``series`` from start to end, both included."""
        if self.is_read_whole:
            return {name: each.window(start_s, end_s) for name, each in self.series.items()}
        return recorded_series(self.recording.within(start_s, end_s))

    @cached_property
    def frame(self) -> 'RunTable':
        """
        Table of the run: ``voltage_v``, ``foot_m`` and readings, ``position_m``, over ``time_s``.

        Values come from the trace, else from topics with different times (NaN where unknown).
        ``attrs`` hold units and source. For a run larger than memory use ``table``.

        """
        return self.table()

    @checked_arguments
    def table(self, window_s: tuple[float, float] | None = None) -> 'RunTable':
        """Return ``frame`` for a window (start and end, s); reads only the window."""
        found = self.series if window_s is None else self.series_within(*window_s)
        is_recorded = isinstance(self.source, Recording)
        origin = self.source.origin if is_recorded else self.measurement.side.origin
        return _equipped(table_of_series(found, origin))

    @checked_arguments
    def plot(
        self,
        start_s: float | None = None,
        end_s: float | None = None,
        *,
        style: str = '',
        width_mm: float | None = None,
    ) -> 'Figure':
        """
        Draw the run, or a part of it, with commands and failures.

        The style is ``screen``, ``paper`` (column of 85 mm, 8 pt text) or a style file of
        matplotlib; a width alone means ``paper``.

        Raises
        ------
        RecordingError, OutOfRange
            If the part has nothing to draw, or the size is out of range.

        """
        window = None
        if start_s is not None or end_s is not None:
            window = TimeWindow(start_s or 0.0, float('inf') if end_s is None else end_s)
        # ruff: noqa: PLC0415 - slow imports
        from stickslip_ros.lab.figures.plotting import looking
        from stickslip_ros.lab.measurements.run_figure import draw_run

        with looking(style, width_mm):
            return draw_run(self.measurement if self.is_read_whole else self.source, window)[0]

    @checked_arguments
    def save(self, path: str | Path) -> Path:
        """
        Copy the recording to a new file.

        Raises
        ------
        RecordingError
            If the file exists or cannot be written, or the run has several files.

        """
        if self.recording.files != [self.path]:
            raise RecordingError(self.path, 'is in parts', 'copy its files')
        target = Path(path)
        prepare_output(target, is_new=True, endings=RUN_ENDINGS)
        shutil.copyfile(self.path, target)
        return target

    if not TYPE_CHECKING:  # a type checker would then accept every name

        def __getattr__(self, name: str) -> Any:
            """Refuse an unknown name; suggest a similar attribute or column."""
            near = get_close_matches(name, [*dir(type(self)), *RUN_QUANTITIES], 1, 0.5)
            way = f'frame[{near[0]!r}]' if {*near} & RUN_QUANTITIES.keys() else ''.join(near)
            raise WrongUse(f'a Run has no {name}; did you mean run.{way or "frame"}?')

    def __repr__(self) -> str:
        text = 'keep it with save(path)' if self._origin else str(self._path or 'not recorded')
        if self._result is not None:
            force, step = with_unit(self.force_mean_n, 'N'), with_unit(self.step_length_m, 'm')
            text = f'{self._result.steps} steps of {step}, mean force {force}; {text}'
        return f'Run({text})'

    def sections(self) -> list[Section]:
        """Return the result of a simulated run, and the content of the file."""
        shown = [] if self._result is None else self._result.sections()
        if self._path is None:
            return shown
        if isinstance(self.source, Recording):
            return [*shown, *sections_of(self.source)]
        side, header = self.measurement.side, ('quantity', 'samples', 'first at', 'last at')
        rows = [
            (name, len(each), *(with_unit(float(each.time_s[at]), 's') for at in (0, -1)))
            for name, each in self.series.items()
        ]
        return [Section(side.origin, rows, header, side.notes)]


@checked_arguments
def open_run(path: 'Table | Sequence[Table]', topics: Mapping[str, str] | None = None) -> Run:
    """
    Open a recording, an MCAP file, a bag directory or the common name of parts, or a table.

    Parameters
    ----------
    path : path-like, DataFrame, or sequence of them
        The recording, or tables over time.
    topics : mapping of str to str, optional
        Topic, field and unit of each quantity in a recording of another program:
        ``{'position_m': '/rig/encoder.point.x', 'force_n': '/rig/cell.data (mN)'}``; its column
        in a table: ``{'position_m': 'Ch 2 (nm)'}``.

    Raises
    ------
    StickSlipError
        If the recording cannot be read, or lacks a topic.

    """
    run = Run(path, topics=topics)
    if run.is_read_whole:
        _ = run.series  # refuse unreadable files now
    return run


def _equipped(frame: 'DataFrame') -> 'RunTable':
    def to_xarray() -> Any:
        data = type(frame).to_xarray(frame).assign_attrs(source=frame.attrs['source'])
        for name in {*data.variables} & frame.attrs['units'].keys():
            data[name].attrs['units'] = frame.attrs['units'][name]
        return data

    for name, own in (('plot', _plots()(frame)), ('to_xarray', to_xarray)):
        object.__setattr__(frame, name, own)  # makes a reference cycle of frame and method
    return cast('RunTable', frame)


@cache
def _plots() -> Any:
    import matplotlib.pyplot as plt
    from matplotlib.figure import Figure
    from pandas.plotting import PlotAccessor

    from stickslip_ros.lab.figures.plotting import new_figure, styled

    class Plots(PlotAccessor):
        """``DataFrame.plot`` with labelled axes that returns a Figure, as ``Run.plot`` does."""

        @styled()
        def __call__(self, *given: Any, **named: Any) -> Any:
            if named.get('kind', 'line') == 'line' and not named.get('subplots'):
                y = named.get('y') or [*self._parent]  # type: ignore[attr-defined]
                named.setdefault('ylabel', ', '.join(y) if isinstance(y, list) else str(y))
            if not named.get('subplots'):
                named.setdefault('ax', new_figure(8.0, 4.5).subplots())
            if isinstance(axes := named.get('ax'), Figure):
                named['ax'] = axes.axes[0]
            drawn: Any = np.ravel(super().__call__(*given, **named))[0].figure
            if axes is None:
                plt.close(drawn)  # a notebook would show it twice
            return drawn

    return Plots
