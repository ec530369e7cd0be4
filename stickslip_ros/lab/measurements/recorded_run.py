# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A recorded run: file, table, picture."""

import math
import shutil
import weakref
from collections.abc import Mapping
from difflib import get_close_matches
from functools import cache, cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stickslip_ros.errors import OutOfRange, RecordingError, StickSlipError, WrongUse
from stickslip_ros.files import RUN_ENDINGS, prepare_output
from stickslip_ros.lab.measurements.recorded import (
    RUN_QUANTITIES,
    TimeWindow,
    recorded_series,
    recorded_stand,
    sections_of,
    series_by_stretch,
    stretches_of,
)
from stickslip_ros.lab.measurements.run_result import SawtoothRun
from stickslip_ros.parameters import Parameters, checked_arguments
from stickslip_ros.recording.integrity import is_recording
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.series import Series
from stickslip_ros.sections import NotebookView, Section
from stickslip_ros.units import with_unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame


@checked_arguments
class Run(NotebookView):
    """
    A recorded run in a file; a temporary file lives as long as this object.

    Parameters
    ----------
    path : path-like, optional
        An MCAP file, a bag directory, or the common name of parts; None without a recording.
    result : SawtoothRun, optional
        The result of a simulated run.
    folder : Path, optional
        A folder to remove with this object.
    topics : mapping of str to str, optional
        For a recording of another program: topic and field of its quantities.

    """

    def __init__(
        self,
        path: str | Path | None,
        result: SawtoothRun | None = None,
        folder: Path | None = None,
        topics: Mapping[str, str] | None = None,
    ) -> None:
        self._path = path
        self._result = result
        self._origin = '' if folder is None else 'simulated run'
        self.topics = topics or {}
        if folder is not None:
            weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)

    @cached_property
    def recording(self) -> Recording:
        """Topics, messages, metadata, attachments; refused if missing or damaged."""
        if self._path is None:
            raise StickSlipError('the run was not recorded; simulate without record=False')
        return Recording(self._path, self._origin)

    @property
    def path(self) -> Path:
        """The file."""
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
    def series(self) -> dict[str, Series]:
        """Quantities over time, by the names of the columns of ``frame``."""
        if self.topics:
            from stickslip_ros.lab.measurements.mapped import mapped_series  # it imports tables

            return mapped_series(self.recording, self.topics)[0]
        return recorded_series(self.recording)

    @checked_arguments
    def series_within(self, start_s: float, end_s: float) -> dict[str, Series]:
        """Return ``series`` of a stretch, both ends included."""
        if self.topics:
            return {name: each.window(start_s, end_s) for name, each in self.series.items()}
        return recorded_series(self.recording.within(start_s, end_s))

    @cached_property
    def frame(self) -> 'DataFrame':
        """
        Table of the run: ``voltage_v``, ``foot_m`` and readings, ``position_m``, over ``time_s``.

        Values come from the trace, else from topics with different times: NaN where unknown.
        ``attrs`` hold units and source. For a trace larger than memory, use ``table``.

        """
        frame = table_of_series(self.series, self.recording.origin)
        object.__setattr__(frame, 'plot', _labelled_plots()(frame))  # each then keeps the other
        return frame

    @checked_arguments
    def table(self, window_s: tuple[float, float] | None = None, every: int = 1) -> 'DataFrame':
        """
        Return every n-th row of ``frame``, or a stretch of it, for runs larger than memory.

        Parameters
        ----------
        window_s : tuple of float, optional
            Start and end of the stretch, s; by default the whole run.
        every : int
            1 keeps all rows, 1000 every thousandth.

        Raises
        ------
        OutOfRange
            If ``every`` is below 1.

        """
        import pandas as pd

        if every < 1:
            raise OutOfRange('every', every, '', 'below 1', 'give 1 for all rows')
        window = TimeWindow(*window_s or (-math.inf, math.inf))
        stretches = (
            [self.series_within(*window)]
            if self.topics
            else series_by_stretch(self.recording, stretches_of(self.recording, window))
        )
        parts, rows = list[pd.DataFrame](), 0
        for found in stretches:
            frame = table_of_series(found, self.recording.origin)
            parts.append(frame.iloc[-rows % every :: every])
            rows += len(frame)
        whole = pd.concat(parts)
        whole.attrs = parts[0].attrs
        return whole

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
        Draw the run, or a stretch of it, with its events and status bits.

        The style is ``screen``, ``paper`` or a style file of matplotlib; a width alone means
        paper, where a column is 85 mm wide, with 8 pt text.

        Raises
        ------
        RecordingError, OutOfRange
            If the stretch has nothing to draw, or the size is refused.

        """
        window = None
        if start_s is not None or end_s is not None:
            window = TimeWindow(start_s or 0.0, float('inf') if end_s is None else end_s)
        # ruff: noqa: PLC0415 - slow imports
        from stickslip_ros.lab.figures.plotting import looking
        from stickslip_ros.lab.measurements.run_figure import draw_run

        # A short run is read once for all pictures, a long one never as a whole.
        is_held = self.topics or len(stretches_of(self.recording)) == 1
        with looking(style, width_mm):
            quantities = self.series if is_held else None
            return draw_run(self.recording, window, quantities=quantities)[0]

    @checked_arguments
    def save(self, path: str | Path) -> Path:
        """
        Copy the recording to a new file.

        Raises
        ------
        RecordingError
            If it exists, cannot be written, or the run has several files.

        """
        if self.recording.files != [self.path]:
            raise RecordingError(self.path, 'is in parts', 'copy its files')
        target = Path(path)
        prepare_output(target, is_new=True, endings=RUN_ENDINGS)
        shutil.copyfile(self.path, target)
        return target

    if not TYPE_CHECKING:  # a checker would then take every name

        def __getattr__(self, name: str) -> Any:
            """Refuse a quantity, or another name, by the way to it."""
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
        """Return the result, if known, and the content of the file."""
        shown = [] if self._result is None else self._result.sections()
        return shown if self._path is None else [*shown, *sections_of(self.recording)]


@checked_arguments
def open_run(path: str | Path, topics: Mapping[str, str] | None = None) -> Run:
    """
    Open a recording: an MCAP file, a bag directory, or the common name of parts.

    Parameters
    ----------
    path : path-like
        The recording.
    topics : mapping of str to str, optional
        For a recording of another program: topic, field and unit of its quantities, as
        ``{'position_m': '/rig/encoder.point.x', 'force_n': '/rig/cell.data (mN)'}``.

    Raises
    ------
    StickSlipError
        If it cannot be read, or has no such topics.

    """
    run = Run(path, topics=topics)
    _ = run.series if topics else run.recording  # refuse an unreadable file now
    return run


def recording_of(
    source: object, topics: Mapping[str, str]
) -> tuple[Recording, Mapping[str, str]] | None:
    """Return a recording, of a Run or a path, and its topics: its own first; None of a table."""
    if isinstance(source, Run):
        return source.recording, source.topics or topics
    if isinstance(source, Path) and is_recording(source):
        return Recording(source), topics
    return None


def table_of_series(found: Mapping[str, Series], source: str) -> 'DataFrame':
    """Return quantities as one table over their times; NaN where unknown."""
    import pandas as pd

    columns = {
        name: pd.Series(each.value, pd.Index(each.time_s, name='time_s'))
        for name, each in found.items()
    }
    first = next(iter(columns.values()), pd.Series()).index
    is_one = all(each.index.equals(first) for each in columns.values())
    if not is_one:  # the second sample of a time is a row of its own
        for name, each in columns.items():
            columns[name] = each.set_axis([each.index, each.groupby(level=0).cumcount()])
    frame = pd.DataFrame(columns) if is_one else pd.DataFrame(columns).droplevel(1)
    frame.attrs['units'] = {'time_s': 's', **{name: each.unit for name, each in found.items()}}
    frame.attrs['source'] = source
    return frame


@cache
def _labelled_plots() -> Any:
    from pandas.plotting import PlotAccessor

    class Plot(PlotAccessor):
        """``DataFrame.plot`` that labels the vertical axis of lines with their columns."""

        def __call__(self, *given: Any, **named: Any) -> Any:
            if named.get('kind', 'line') == 'line' and not named.get('subplots'):
                y = named.get('y') or [*self._parent]  # type: ignore[attr-defined]
                named.setdefault('ylabel', ', '.join(y) if isinstance(y, list) else str(y))
            return super().__call__(*given, **named)

    return Plot
