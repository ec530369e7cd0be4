"""Compares two files, or a file and the model: recognises them and chooses the way."""

from collections.abc import Sequence
from pathlib import Path

from stickslip_ros.errors import RecordingError, StickSlipError
from stickslip_ros.files import read_bytes
from stickslip_ros.recording.integrity import MAGIC
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.run_file import EXPERIMENT_FILE
from stickslip_ros.study.batch import Progress
from stickslip_ros.study.comparison import by_amplitude, in_time
from stickslip_ros.study.comparison.agreement import AMPLITUDE, TIME
from stickslip_ros.study.comparison.by_amplitude import MODEL, ModelSettings, PointTable
from stickslip_ros.study.comparison.in_time import TimeRun
from stickslip_ros.study.comparison.result import Alignment, Comparison, Incomparable
from stickslip_ros.study.experiment import (
    AS_IT_IS,
    OVER_TIME,
    Experiment,
    Reading,
    parse_experiment,
    read_experiment,
    read_joined,
)
from stickslip_ros.study.sweep_table import PARQUET, is_sweep


def compare(
    a_name: str | Sequence[str],
    b_name: str | None,
    *,
    model: ModelSettings,
    reading: Reading = AS_IT_IS,
    shift_s: float | None = None,
    estimate_shift: bool = False,
    progress: Progress | None = None,
) -> Comparison:
    """
    Compare two things.

    Parameters
    ----------
    a_name : str or sequence of str
        A recording, a table of a sweep, or an experiment file, or several of these by amplitude.
    b_name : str, optional
        Another one, or the word ``model``; without it the experiment that a recording carries.
    model : ModelSettings
        How the model is run, if it is.
    reading : Reading
        What experiment files do not say themselves.
    shift_s, estimate_shift : float, bool
        What is added to the times of B, or whether that is to be estimated.
    progress : callable, optional
        Called with runs of the model done and in all.

    Raises
    ------
    StickSlipError
        If one cannot be read, or the two cannot be compared.

    """
    paths = [Path(name) for name in ([a_name] if isinstance(a_name, str) else a_name)]
    a = _load(paths[0], reading) if len(paths) == 1 else _joined(paths, reading)
    is_moved = estimate_shift or shift_s is not None
    if b_name == MODEL:
        table = _points(a, is_moved)
        return _by_amplitude(table, by_amplitude.of_model(table, model, progress))
    if b_name is None:
        b = _attached(paths[0], reading)
    else:
        b = _load(Path(b_name), reading, len(paths))
    if isinstance(a, TimeRun) and isinstance(b, TimeRun):
        given = None if shift_s is None else Alignment(shift_s, 'given')
        return _in_time(a, b, in_time.align(a, b) if estimate_shift else given)
    if isinstance(a, PointTable) and isinstance(b, PointTable):
        return _by_amplitude(_points(a, is_moved), b)
    raise Incomparable(
        b.side.origin,
        f'is a {b.side.kind}, {a.side.origin} a {a.side.kind}',
        'compare two over time, or two by amplitude and preload',
    )


def _by_amplitude(a: PointTable, b: PointTable) -> Comparison:
    return Comparison(a.side, b.side, AMPLITUDE, by_amplitude.compare(a, b))


def _in_time(a: TimeRun, b: TimeRun, alignment: Alignment | None) -> Comparison:
    moved = b if alignment is None else b.moved(alignment.shift_s)
    return Comparison(a.side, b.side, TIME, in_time.compare(a, moved), alignment)


def _points(a: PointTable | TimeRun, is_moved: bool) -> PointTable:
    """Return A if it is a table that is not to be moved in time, before any work is done."""
    if isinstance(a, TimeRun):
        raise Incomparable(
            a.side.origin,
            f'is a {a.side.kind}, and the model is run at amplitudes and preloads',
            'record the model with stickslip simulate -o FILE and compare with that',
        )
    if is_moved:
        hint = 'leave --shift and --align away'
        raise Incomparable(a.side.origin, 'is by amplitude and knows no time', hint)
    return a


def _load(path: Path, reading: Reading, number: int = 0) -> PointTable | TimeRun:
    """Read a file by what is in it, not by its name."""
    if path.suffix == PARQUET and path.is_file():
        return by_amplitude.of_sweep(path)
    start = read_bytes(path, 'check the path', len(MAGIC))
    if start == MAGIC or path.suffix == '.mcap':
        return in_time.of_recording(Recording(path))
    if is_sweep(path):
        return by_amplitude.of_sweep(path)
    return _of_experiment(read_experiment(path, reading, number=number))


def _joined(paths: Sequence[Path], reading: Reading) -> PointTable:
    return by_amplitude.of_experiment(read_joined(paths, reading))


def _attached(path: Path, reading: Reading) -> PointTable | TimeRun:
    """Return the experiment that a recording carries."""
    try:
        recording = Recording(path)
    except StickSlipError as error:
        hint = 'name B, or the word model'
        raise RecordingError(path, f'stands alone and is no recording ({error})', hint) from None
    if EXPERIMENT_FILE not in recording.attachments:
        hint = 'name what to compare it with as B'
        raise RecordingError(path, f'carries no {EXPERIMENT_FILE}', hint)
    content = recording.attachments[EXPERIMENT_FILE][1]
    return _of_experiment(parse_experiment(content, f'{path} {EXPERIMENT_FILE}', reading))


def _of_experiment(experiment: Experiment) -> PointTable | TimeRun:
    is_run = experiment.kind == OVER_TIME
    return in_time.of_experiment(experiment) if is_run else by_amplitude.of_experiment(experiment)
