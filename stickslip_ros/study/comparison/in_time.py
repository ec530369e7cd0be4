"""Runs against each other: quantity by quantity on the time that both share."""

from dataclasses import dataclass

import numpy as np

from stickslip_ros.contact.profile import Array
from stickslip_ros.parameters import Scalar, parse_yaml
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.run_file import PARAMETERS_FILE, RUN_RECORD
from stickslip_ros.recording.series import Series
from stickslip_ros.study.comparison.agreement import agreement_of
from stickslip_ros.study.comparison.lag import estimate_alignment
from stickslip_ros.study.comparison.refusal import Incomparable
from stickslip_ros.study.comparison.result import (
    TIME,
    UNITS,
    Alignment,
    Compared,
    Curve,
    Part,
    Side,
)
from stickslip_ros.study.experiment import MEASURED, OVER_TIME, Experiment, sigma_name
from stickslip_ros.study.run_quantities import recorded_series

RECORDING = 'recording'
NOT_COMPARED = {'wall_start', 'seed', 'dt_s'}
"""Of the metadata: chance, and what stands among the parameters too."""


@dataclass(frozen=True, eq=False)
class TimeRun:
    """
    A run over time.

    Attributes
    ----------
    side : Side
        Where it comes from.
    series : dict of str to Series
        Its quantities.
    sigmas : dict of str to Series
        Their uncertainties where they are known.

    """

    side: Side
    series: dict[str, Series]
    sigmas: dict[str, Series]

    def moved(self, shift_s: float) -> 'TimeRun':
        """Return the run with other times."""
        return TimeRun(self.side, _moved(self.series, shift_s), _moved(self.sigmas, shift_s))


def run_of_recording(recording: Recording) -> TimeRun:
    """Return what a recording holds over time, and what it says of itself."""
    series = recorded_series(recording)
    run = recording.metadata.get(RUN_RECORD, {})
    described: dict[str, Scalar] = {key: run[key] for key in run if key not in NOT_COMPARED}
    changed = None
    if PARAMETERS_FILE in recording.attachments:
        text = recording.attachments[PARAMETERS_FILE][1].decode()
        parameters = parse_yaml(text, f'{recording.path} {PARAMETERS_FILE}')
        described |= parameters.flat()
        changed = parameters.changed()
    rows = max((len(each) for each in series.values()), default=0)
    side = Side(str(recording.path), RECORDING, rows, described, changed)
    return TimeRun(side, series, {})


def run_of_experiment(experiment: Experiment) -> TimeRun:
    """Return the run that an experiment over time holds."""
    columns = experiment.columns
    time_s = columns['time_s']

    def series(name: str) -> Series:
        unit = UNITS[name.rpartition('_')[2]]
        return Series(time_s, columns[name], unit, f'{experiment.origin} {name}')

    names = [name for name in MEASURED[OVER_TIME] if name in columns]
    side = Side(experiment.origin, OVER_TIME, len(time_s), {}, None, experiment.notes)
    return TimeRun(
        side,
        {name: series(name) for name in names},
        {name: series(sigma_name(name)) for name in names if sigma_name(name) in columns},
    )


def align(a: TimeRun, b: TimeRun) -> Alignment:
    """
    Estimate by how much B must be shifted.

    Raises
    ------
    Incomparable
        If they share nothing that changes.

    """
    names = [
        name for name in _shared(a, b) if min(len(_finite(run.series[name])) for run in (a, b)) > 1
    ]
    pairs = [(_finite(a.series[name]), _finite(b.series[name])) for name in names]
    if not pairs:
        mend = 'give --shift instead of --align'
        raise Incomparable('the lag', 'cannot be found in single samples', mend)
    return estimate_alignment([pair[0] for pair in pairs], [pair[1] for pair in pairs])


def compare_runs(a: TimeRun, b: TimeRun) -> tuple[Compared, ...]:
    """
    Compare every quantity that both runs have, at A's times within both.

    Raises
    ------
    Incomparable
        If they share no quantity or no time.

    """
    return tuple(_compare(a, b, name) for name in _shared(a, b))


def _shared(a: TimeRun, b: TimeRun) -> list[str]:
    names = [name for name in a.series if name in b.series]
    if not names:
        has = [', '.join(run.series) or 'nothing' for run in (a, b)]
        problem = f'has {has[1]}, {a.side.origin} has {has[0]}'
        raise Incomparable(b.side.origin, problem, 'compare runs that share a quantity')
    return names


def _compare(a: TimeRun, b: TimeRun, name: str) -> Compared:
    series_a, series_b = a.series[name], b.series[name]
    start_s = max(_start_s(series_a), _start_s(series_b))
    end_s = min(_end_s(series_a), _end_s(series_b))
    if start_s > end_s:
        spans = [
            f'{_start_s(each):.6g} s to {_end_s(each):.6g} s' for each in (series_a, series_b)
        ]
        raise Incomparable(
            f'{name} of {b.side.origin}',
            f'is there from {spans[1]}, that of {a.side.origin} from {spans[0]}',
            'move B with --shift or --align',
        )
    inside = series_a.window(start_s, end_s)
    values_b = np.interp(inside.time_s, series_b.time_s, series_b.value)
    usable = np.isfinite(inside.value) & np.isfinite(values_b)
    if not usable.any():
        problem = f'is a number at no time in both {a.side.origin} and {b.side.origin}'
        raise Incomparable(name, problem, 'compare another run')
    time_s = inside.time_s[usable]
    sigma = _sigma(a, b, name, time_s)
    curve = Curve(time_s, inside.value[usable], values_b[usable], sigma)

    def where(index: int) -> dict[str, Scalar]:
        return {TIME: float(time_s[index])}

    agreement = agreement_of(curve, where)
    part = Part({}, agreement, None, None, curve)
    return Compared(name, agreement, (part,), len(inside) - len(time_s))


def _sigma(a: TimeRun, b: TimeRun, name: str, time_s: Array) -> Array | None:
    known = [run.sigmas[name] for run in (a, b) if name in run.sigmas]
    if not known:
        return None
    parts = [np.interp(time_s, each.time_s, each.value) for each in known]
    sigma: Array = np.sqrt(np.sum(np.square(parts), axis=0))
    return sigma


def _moved(series: dict[str, Series], shift_s: float) -> dict[str, Series]:
    return {
        name: Series(each.time_s + shift_s, each.value, each.unit, each.origin)
        for name, each in series.items()
    }


def _finite(series: Series) -> Series:
    known = np.isfinite(series.value)
    return Series(series.time_s[known], series.value[known], series.unit, series.origin)


def _start_s(series: Series) -> float:
    return float(series.time_s[0])


def _end_s(series: Series) -> float:
    return float(series.time_s[-1])
