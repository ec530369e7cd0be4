"""What ``import stickslip_ros`` offers: the work of the command line for scripts, notebooks."""

import shutil
import tempfile
import weakref
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from stickslip_ros.contact import mdr
from stickslip_ros.contact.hemisphere import elasticity_of, profile_of
from stickslip_ros.contact.mdr import Presliding
from stickslip_ros.errors import OutOfRange, RecordingError, StickSlipError, WrongKind
from stickslip_ros.files import make_room
from stickslip_ros.notebook import html_table
from stickslip_ros.parameters import Parameters, Scalar, spec_of
from stickslip_ros.progress import shown_progress
from stickslip_ros.recording.reader import Recording
from stickslip_ros.study import sweep as sweeps
from stickslip_ros.study import zero_amplitude as zero_amplitudes
from stickslip_ros.study.comparison import compare as comparisons
from stickslip_ros.study.comparison.by_amplitude import MODEL, ModelSettings
from stickslip_ros.study.comparison.report import write_report
from stickslip_ros.study.comparison.result import Comparison
from stickslip_ros.study.comparison.words import sections
from stickslip_ros.study.experiment import Reading
from stickslip_ros.study.fitting.fit import STARTS, Fit, fit_drive
from stickslip_ros.study.fitting.free import choose_free
from stickslip_ros.study.fitting.problem import DEFAULT_FREQUENCY_HZ, read_points
from stickslip_ros.study.recorded_run import TimeWindow, recorded_series, recorded_stand
from stickslip_ros.study.run_figure import draw_run
from stickslip_ros.study.sawtooth_run import (
    SAWTOOTH_HZ,
    SawtoothRun,
    run_sawtooth,
    run_waveform,
    voltage_for,
)
from stickslip_ros.study.zero_amplitude import ZeroAmplitude

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

AMPLITUDE, FREQUENCY = 'amplitude_m', 'frequency_hz'
AXES = {AMPLITUDE: sweeps.AMPLITUDE, FREQUENCY: sweeps.FREQUENCY}
"""What a sweep varies beside parameters."""


class ComparisonReport(Comparison):
    """What a comparison comes to, to be saved as a page or shown in a notebook."""

    def save(self, path: str | Path) -> Path:
        """
        Write a page of HTML that needs nothing else, in place of an older one.

        Raises
        ------
        RecordingError
            If it cannot be written.

        """
        write_report(self, Path(path))
        return Path(path)

    def _repr_html_(self) -> str:
        tables = [html_table(title, rows, header) for title, header, rows in sections(self)]
        return '\n'.join(tables)


class Run:
    """
    A recorded run: a file, or one that lives as long as this object.

    Parameters
    ----------
    path : path-like
        An MCAP file, a bag directory, or the name that parts share.
    result : SawtoothRun, optional
        What the run came to, known of a run that was simulated here.
    folder : Path, optional
        A folder that is removed with this object.

    Attributes
    ----------
    recording : Recording
        Topics, messages, metadata and attachments of the file.

    Raises
    ------
    RecordingError
        If the recording cannot be read.

    """

    def __init__(
        self,
        path: str | Path,
        result: SawtoothRun | None = None,
        folder: Path | None = None,
    ) -> None:
        self.recording = Recording(path)
        self._result = result
        if folder is not None:
            weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)

    @property
    def path(self) -> Path:
        """The file."""
        return self.recording.path

    @cached_property
    def parameters(self) -> Parameters:
        """The stand; RecordingError if the file does not say."""
        return recorded_stand(self.recording)

    @property
    def result(self) -> SawtoothRun:
        """What the saw-tooth came to; StickSlipError of a run that ``simulate`` did not make."""
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
    def frame(self) -> 'DataFrame':
        """
        Table of the run: ``voltage_v``, ``foot_m``, ``position_m``, ``force_n`` over ``time_s``.

        From the trace where the run has one, else from its topics, whose times differ: what is
        not known at a time is not a number. ``attrs`` hold the units and what was recorded.

        """
        import pandas as pd  # noqa: PLC0415 - what has no table does without

        found = recorded_series(self.recording)
        columns = {
            name: pd.Series(each.value, pd.Index(each.time_s, name='time_s'))
            for name, each in found.items()
        }
        if len({len(each) for each in columns.values()}) > 1:  # topics have one sample an instant
            columns = {name: each.groupby(level=0).last() for name, each in columns.items()}
        frame: DataFrame = pd.DataFrame(columns)
        frame.attrs['units'] = {'time_s': 's', **{name: each.unit for name, each in found.items()}}
        frame.attrs['source'] = str(self.path)
        return frame

    def plot(self, start_s: float | None = None, end_s: float | None = None) -> 'Figure':
        """
        Draw the run, or a stretch of it, with its events and status bits.

        Raises
        ------
        RecordingError, OutOfRange
            If there is nothing to draw, or not in that stretch.

        """
        window = None
        if start_s is not None or end_s is not None:
            window = TimeWindow(start_s or 0.0, float('inf') if end_s is None else end_s)
        return draw_run(self.recording, window)[0]

    def save(self, path: str | Path) -> Path:
        """
        Copy the recording to a new file.

        Raises
        ------
        RecordingError
            If it exists, cannot be written, or the run is no single file.

        """
        if self.recording.files != [self.path]:
            raise RecordingError(self.path, 'is in parts', 'copy its files')
        target = Path(path)
        make_room(target, is_new=True)
        shutil.copyfile(self.path, target)
        return target

    def _repr_html_(self) -> str:
        rows = [(each.topic, each.type_name, each.messages) for each in self.recording.channels]
        table = html_table(str(self.path), rows, ('topic', 'type', 'messages'))
        if self._result is None:
            return table
        return self._result._repr_html_() + table


def simulate(
    parameters: Parameters,
    *,
    amplitude_m: float | None = None,
    waveform: ArrayLike | None = None,
    frequency_hz: float | None = None,
    steps: int = 0,
    progress: bool = False,
) -> Run:
    """
    Drive the whole stand with a saw-tooth or another wave, from rest, and record it.

    Parameters
    ----------
    parameters : Parameters
        The stand.
    amplitude_m : float, optional
        Stroke of the feet along a saw-tooth, m.
    waveform : array-like, shape (n, 2), optional
        In place of a saw-tooth: one cycle of times, s, and voltages, V, that ends as it begins.
    frequency_hz : float, optional
        Steps per second; negative ones go backwards. By default 1000, or as the waveform says.
    steps : int
        Number of steps; 0 goes on until the force is steady, at most 5000.
    progress : bool
        Whether to show how far it has come.

    Raises
    ------
    StickSlipError
        If wave, frequency or steps are refused.

    """
    if waveform is not None and amplitude_m is None:
        task = partial(run_waveform, parameters, np.asarray(waveform, float), frequency_hz)
    elif waveform is None and amplitude_m is not None:
        voltage_v = voltage_for(parameters, amplitude_m)
        frequency_hz = SAWTOOTH_HZ if frequency_hz is None else frequency_hz
        task = partial(run_sawtooth, parameters, voltage_v, frequency_hz)
    else:
        both = (amplitude_m, waveform)
        raise WrongKind('amplitude_m, waveform', both, 'one of them', 'leave out the other')
    folder = Path(tempfile.mkdtemp(prefix='stickslip-'))
    path = folder / 'run.mcap'
    try:
        with shown_progress('steps', quiet=not progress) as show:
            result = task(steps, path=path, progress=show)
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    return Run(path, result, folder)


def open_run(path: str | Path) -> Run:
    """
    Open a recording: an MCAP file, a bag directory, or the name that parts of a run share.

    Raises
    ------
    RecordingError
        If it cannot be read.

    """
    return Run(path)


def sweep(
    parameters: Parameters,
    values: Mapping[str, Iterable[Scalar] | Scalar],
    *,
    steps: int = 0,
    workers: int = 0,
    progress: bool = False,
) -> 'DataFrame':
    """
    Run the drive alone, without sensors, at every combination of values.

    Parameters
    ----------
    parameters : Parameters
        The stand that all runs start from.
    values : mapping of str to values
        Values of ``amplitude_m`` (stroke of the feet, m), of ``frequency_hz`` (by default 1000)
        and of any parameter, ``{'stand.preload': [0.1, 0.5]}``; the first parameter is the
        slowest, the amplitude the fastest.
    steps : int
        Steps of each run; 0 goes on until the steady state.
    workers : int
        Runs at once; 0 is one per core.
    progress : bool
        Whether to show how far it has come.

    Returns
    -------
    DataFrame
        One row per run: the table of ``stickslip sweep``. Its ``attrs`` hold the parameters.

    Raises
    ------
    StickSlipError
        If a name, a value or a combination is refused.

    """
    if AMPLITUDE not in values:
        raise WrongKind('values', sorted(values), 'a sweep', f'give {AMPLITUDE}, the stroke in m')
    given = {FREQUENCY: sweeps.FREQUENCY.default, **values}
    axes = {name: _axis(name, each) for name, each in given.items()}
    chosen = sweeps.Sweep(
        parameters=parameters,
        varied=tuple(axis for name, axis in axes.items() if name not in AXES),
        frequencies_hz=_floats(axes, FREQUENCY),
        amplitudes_m=_floats(axes, AMPLITUDE),
        steps=steps,
    )
    import pandas as pd  # noqa: PLC0415 - what has no table does without

    with shown_progress('runs', quiet=not progress) as show:
        frame: DataFrame = pd.DataFrame(sweeps.run_sweep(chosen, workers=workers, progress=show))
    frame.attrs['parameters'] = parameters.flat()
    return frame


def _axis(name: str, given: Iterable[Scalar] | Scalar) -> sweeps.Axis:
    spec = AXES.get(name) or spec_of(name)
    plain: Any = given.tolist() if isinstance(given, np.ndarray | np.generic) else given
    is_one = isinstance(plain, str) or not isinstance(plain, Iterable)
    values = [plain] if is_one else list(plain)
    return sweeps.Axis(name, tuple(spec.check(name, value) for value in values))


def _floats(axes: Mapping[str, sweeps.Axis], name: str) -> tuple[float, ...]:
    return tuple(float(value) for value in axes[name].values)


def zero_amplitude(
    parameters: Parameters,
    *,
    frequency_hz: float = 200.0,
    steps: int = zero_amplitudes.STEPS,
    workers: int = 0,
    progress: bool = False,
) -> ZeroAmplitude:
    """
    Find the 0-amplitude of a drive whose runner is free: the load cell is taken away.

    Parameters
    ----------
    parameters : Parameters
        The stand.
    frequency_hz : float
        Steps per second; negative ones go backwards.
    steps : int
        Steps of each run.
    workers : int
        Runs at once; 0 is one per core.
    progress : bool
        Whether to show how far it has come.

    Raises
    ------
    StickSlipError
        If the frequency is refused, or the runner steps at no amplitude.

    """
    with shown_progress('runs', quiet=not progress) as show:
        return zero_amplitudes.zero_amplitude(
            parameters, frequency_hz, steps=steps, workers=workers, progress=show
        )


def presliding(parameters: Parameters, *, normal_force_n: float) -> Presliding:
    """
    Solve one hemisphere under a constant normal force, in closed form.

    Parameters
    ----------
    parameters : Parameters
        The stand, of which ``contact`` counts.
    normal_force_n : float
        Normal force F_n > 0, N.

    Returns
    -------
    Presliding
        Indentation, stick radius, and tangential force over displacement.

    Raises
    ------
    OutOfRange
        If the force does not press.

    """
    material = parameters.contact
    return mdr.presliding(
        profile_of(material), elasticity_of(material), material.friction, normal_force_n
    )


def compare(
    a: str | Path | Run | Sequence[str | Path],
    b: str | Path | Run | Parameters | None = None,
    *,
    headers: Mapping[str, str] | None = None,
    preloads_n: Sequence[float] = (),
    frequency_hz: float = 1000.0,
    steps: int = 0,
    shift_s: float | None = None,
    align: bool = False,
    workers: int = 0,
    progress: bool = False,
) -> ComparisonReport:
    """
    Compare two runs over time, or two tables by amplitude and preload.

    Parameters
    ----------
    a : path-like, Run or sequence of path-like
        A recording, the table of a sweep, an experiment file, or several of these by amplitude.
    b : path-like, Run or Parameters, optional
        Another one; parameters run the model at the points of A; without it a recording is
        compared with the experiment that it carries.
    headers : mapping of str to str, optional
        Headers of columns in experiment files that do not tell, ``{'force_n': 'CH2 (mN)'}``.
    preloads_n : sequence of float
        Preloads of experiment files without such a column, N: one of all, or one of each.
    frequency_hz, steps : float, int
        How the model is run where A does not say: steps per second; 0 steps go on until steady.
    shift_s, align : float, bool
        What is added to the times of B, s, or whether that is to be estimated.
    workers : int
        Runs of the model at once; 0 is one per core.
    progress : bool
        Whether to show how far it has come.

    Raises
    ------
    StickSlipError
        If one cannot be read, or the two cannot be compared.

    """
    stand, b_name = Parameters(), None
    if isinstance(b, Parameters):
        stand, b_name = b, MODEL
    elif b is not None:
        b_name = _name(b)
    files = [_name(each) for each in _listed(a)]
    tables = len(files) + (b_name not in {None, MODEL})
    with shown_progress('runs', quiet=not progress) as show:
        comparison = comparisons.compare(
            files,
            b_name,
            model=ModelSettings(stand, frequency_hz, steps, workers),
            reading=_reading(headers, preloads_n, tables),
            shift_s=shift_s,
            estimate_shift=align,
            progress=show,
        )
    return ComparisonReport(**vars(comparison))


def _name(file: str | Path | Run) -> str:
    return str(file.path if isinstance(file, Run) else file)


def _listed(files: str | Path | Run | Sequence[str | Path]) -> Sequence[str | Path | Run]:
    return [files] if isinstance(files, str | Path | Run) else files


def _reading(
    headers: Mapping[str, str] | None, preloads_n: Sequence[float], tables: int
) -> Reading:
    if len(preloads_n) > tables:
        limit = f'above the number of tables, {tables}'
        hint = 'give one of all, or one of each'
        raise OutOfRange('number of preloads', len(preloads_n), '', limit, hint)
    return Reading(headers or {}, preloads_n)


def fit(
    experiment: str | Path | Sequence[str | Path],
    free: Sequence[str],
    *,
    headers: Mapping[str, str] | None = None,
    preloads_n: Sequence[float] = (),
    parameters: Parameters | None = None,
    start: Mapping[str, float] | None = None,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    frequency_hz: float = DEFAULT_FREQUENCY_HZ,
    starts: int = STARTS,
    seed: int = 1,
    workers: int = 0,
    progress: bool = False,
) -> Fit:
    """
    Fit parameters of the drive to measured mean forces by weighted least squares.

    Parameters
    ----------
    experiment : path-like or sequence of path-like
        Tables of measured forces, as docs/fit.md says.
    free : sequence of str
        Parameters to fit, ``['contact.friction']``.
    headers : mapping of str to str, optional
        Headers of columns in files that do not tell, ``{'force_n': 'CH2 (mN)'}``.
    preloads_n : sequence of float
        Preloads of files without such a column, N: one of all, or one of each.
    parameters : Parameters, optional
        The stand; by default that of the paper.
    start, bounds : mapping
        Start, and low and high, of free parameters; by default the stand's value, and a decade
        below and above it.
    frequency_hz : float
        Frequency of points that have none, Hz.
    starts, seed : int
        Searches, and the seed of where they start.
    workers : int
        Searches at once; 0 is one per core.
    progress : bool
        Whether to show how far it has come.

    Raises
    ------
    StickSlipError
        If the table cannot be read, or a parameter cannot be fitted.

    """
    paths = [Path(_name(each)) for each in _listed(experiment)]
    points = read_points(paths, frequency_hz, _reading(headers, preloads_n, len(paths)))
    stand, chosen, _ = choose_free(
        parameters or Parameters(),
        free,
        {name: repr(float(value)) for name, value in (start or {}).items()},
        {name: f'{float(low)!r}:{float(high)!r}' for name, (low, high) in (bounds or {}).items()},
    )
    with shown_progress('searches', quiet=not progress) as show:
        return fit_drive(
            stand, chosen, points, starts=starts, seed=seed, workers=workers, progress=show
        )
