"""Two files, or a file and the model, compared: what are they, and which way is it done."""

import csv
from dataclasses import dataclass
from pathlib import Path

from stickslip_ros.errors import RecordingError, StickSlipError
from stickslip_ros.files import readable
from stickslip_ros.recording.integrity import MAGIC
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.run_file import EXPERIMENT_FILE
from stickslip_ros.study.batch import Progress
from stickslip_ros.study.comparison.by_amplitude import compare_points
from stickslip_ros.study.comparison.in_time import (
    TimeRun,
    align,
    compare_runs,
    run_of_experiment,
    run_of_recording,
)
from stickslip_ros.study.comparison.model import MODEL, ModelSettings, run_model
from stickslip_ros.study.comparison.points import (
    SWEEP_MARK,
    PointTable,
    points_of_experiment,
    read_sweep,
)
from stickslip_ros.study.comparison.refusal import Incomparable
from stickslip_ros.study.comparison.result import (
    AMPLITUDE,
    TIME,
    Alignment,
    Comparison,
    differences_of,
)
from stickslip_ros.study.experiment import (
    OVER_TIME,
    Experiment,
    parse_experiment,
    read_experiment,
)
from stickslip_ros.study.sweep_table import PARQUET


@dataclass(frozen=True)
class Shift:
    """How to lay times onto each other: by a number of seconds for B, or by an estimate."""

    seconds: float | None = None
    estimate: bool = False

    @property
    def is_asked(self) -> bool:
        """Whether B is to be moved at all."""
        return self.estimate or self.seconds is not None


def compare(
    a_name: str,
    b_name: str | None,
    *,
    model: ModelSettings,
    shift: Shift,
    progress: Progress | None = None,
) -> Comparison:
    """
    Compare two things.

    Parameters
    ----------
    a_name : str
        A recording, a table of a sweep, or an experiment file.
    b_name : str, optional
        Another one, or the word ``model``; without it the experiment that a recording carries.
    model : ModelSettings
        How the model is run, if it is.
    shift : Shift
        How times are laid onto each other.
    progress : callable, optional
        Called with runs of the model done and in all.

    Raises
    ------
    StickSlipError
        If one cannot be read, or the two cannot be compared.

    """
    a = _load(Path(a_name))
    if b_name == MODEL:
        table = _points(a, shift)
        return _by_amplitude(table, run_model(table, model, progress))
    b = _attached(Path(a_name)) if b_name is None else _load(Path(b_name))
    if isinstance(a, TimeRun) and isinstance(b, TimeRun):
        return _in_time(a, b, shift)
    if isinstance(a, PointTable) and isinstance(b, PointTable):
        return _by_amplitude(_points(a, shift), b)
    raise Incomparable(
        b.side.origin,
        f'is a {b.side.kind}, {a.side.origin} a {a.side.kind}',
        'compare two over time, or two by amplitude and preload',
    )


def _by_amplitude(a: PointTable, b: PointTable) -> Comparison:
    quantities = compare_points(a, b)
    return Comparison(a.side, b.side, AMPLITUDE, differences_of(a.side, b.side), None, quantities)


def _in_time(a: TimeRun, b: TimeRun, shift: Shift) -> Comparison:
    alignment = None
    if shift.estimate:
        alignment = align(a, b)
    elif shift.seconds is not None:
        alignment = Alignment(shift.seconds, 'given')
    moved = b if alignment is None else b.moved(alignment.shift_s)
    quantities = compare_runs(a, moved)
    return Comparison(a.side, b.side, TIME, differences_of(a.side, b.side), alignment, quantities)


def _points(a: PointTable | TimeRun, shift: Shift) -> PointTable:
    """Return A if it is a table, before any work is done."""
    if isinstance(a, PointTable):
        if shift.is_asked:
            mend = 'leave --shift and --align away'
            raise Incomparable(a.side.origin, 'is by amplitude and knows no time', mend)
        return a
    raise Incomparable(
        a.side.origin,
        f'is a {a.side.kind}, and the model is run at amplitudes and preloads',
        'record the model with stickslip simulate -o FILE and compare with that',
    )


def _load(path: Path) -> PointTable | TimeRun:
    """Read a file by what is in it, not by its name."""
    if path.suffix == PARQUET and path.is_file():
        return read_sweep(path)
    try:
        with readable(path).open('rb') as file:
            start = file.read(len(MAGIC))
    except OSError as error:
        problem = f'cannot be read ({error.strerror})'
        raise RecordingError(path, problem, 'check the path') from None
    if start == MAGIC or path.suffix == '.mcap':
        return run_of_recording(Recording(path))
    if _is_sweep(path):
        return read_sweep(path)
    return _of_experiment(read_experiment(path))


def _is_sweep(path: Path) -> bool:
    try:
        with path.open(newline='', encoding='utf-8') as file:
            return SWEEP_MARK in next(csv.reader(file), [])
    except (UnicodeDecodeError, csv.Error):
        return False


def _attached(path: Path) -> PointTable | TimeRun:
    """Return the experiment that a recording carries."""
    recording = _as_recording(path)
    if EXPERIMENT_FILE not in recording.attachments:
        raise RecordingError(
            path, f'carries no {EXPERIMENT_FILE}', 'name what to compare it with as B'
        )
    content = recording.attachments[EXPERIMENT_FILE][1]
    return _of_experiment(parse_experiment(content, f'{path} {EXPERIMENT_FILE}'))


def _as_recording(path: Path) -> Recording:
    try:
        return Recording(path)
    except StickSlipError as error:
        mend = 'name B, or the word model'
        raise RecordingError(path, f'stands alone and is no recording ({error})', mend) from None


def _of_experiment(experiment: Experiment) -> PointTable | TimeRun:
    if experiment.kind == OVER_TIME:
        return run_of_experiment(experiment)
    return points_of_experiment(experiment)
