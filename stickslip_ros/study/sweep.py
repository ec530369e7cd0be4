"""A sweep: the drive at every combination of preload, amplitude, frequency and parameters."""

import dataclasses
import itertools
import math
from dataclasses import dataclass
from functools import partial

from stickslip_ros.errors import OutOfRange
from stickslip_ros.instrument.commands import Request, check_request
from stickslip_ros.parameters import Parameters, Scalar, Spec
from stickslip_ros.study.axes import Axis, column_name, refuse_repeated
from stickslip_ros.study.batch import Progress, run_batch
from stickslip_ros.study.drive_run import run_drive
from stickslip_ros.study.journal import Identity, Journal, Row, identify
from stickslip_ros.study.ramps import (
    STEADY_CHANGE,
    STEADY_STEPS_MAX,
    STEADY_STEPS_MIN,
    STEADY_WINDOW,
)
from stickslip_ros.study.sawtooth_run import voltage_for

CASES_MAX = 100_000
RENAMED = {'energy_loss_j': 'energy_loss_per_step_j'}
AMPLITUDE = Spec(float, 0.0, 'm', '', 'stroke of the feet', 0.0, 1.0)
FREQUENCY = Spec(float, 1000.0, 'Hz', '', 'steps per second', -1e9, 1e9)
STEADY_RULE = (
    f'mean force of a cycle (free runner: step length) within {STEADY_CHANGE:.1%} per '
    f'{STEADY_WINDOW} steps; {STEADY_STEPS_MIN} to {STEADY_STEPS_MAX} steps'
)
"""When a run is steady, and how many steps it makes at least and at most."""


@dataclass(frozen=True)
class Case:
    """One run of a sweep: values of the varied parameters, amplitude, frequency."""

    values: tuple[tuple[str, Scalar], ...]
    amplitude_m: float
    frequency_hz: float


@dataclass(frozen=True)
class Sweep:
    """
    What a sweep consists of; every combination is checked when it is made.

    Attributes
    ----------
    parameters : Parameters
        The stand that all runs start from.
    varied : tuple of Axis
        Parameters that vary; the last one fastest.
    frequencies_hz, amplitudes_m : tuple of float
        Frequencies and strokes of the feet; amplitudes vary fastest of all.
    steps : int
        Steps of each run; 0 goes on until the steady state.

    Raises
    ------
    StickSlipError
        If there are too many combinations, or the stand cannot make one of them.

    """

    parameters: Parameters
    varied: tuple[Axis, ...]
    frequencies_hz: tuple[float, ...]
    amplitudes_m: tuple[float, ...]
    steps: int = 0

    def __post_init__(self) -> None:
        """Refuse what would be refused in the middle of a long night."""
        if self.steps < 0:
            mend = 'give a number, or 0 for the steady state'
            raise OutOfRange('steps', self.steps, '', 'below 0', mend)
        refuse_repeated(list(self.varied))
        counts = [len(axis.values) for axis in self.varied]
        total = math.prod(counts) * len(self.frequencies_hz) * len(self.amplitudes_m)
        if total > CASES_MAX:
            limit = f'above the maximum {CASES_MAX}'
            raise OutOfRange('number of runs', total, '', limit, 'take fewer values')
        for values in self._combinations():
            there = self.parameters.updated(dict(values))
            for frequency_hz in self.frequencies_hz:
                for amplitude_m in self.amplitudes_m:
                    _check_wave(there, amplitude_m, frequency_hz)

    def cases(self) -> list[Case]:
        """Return the full Cartesian product, in the order of the table."""
        return [
            Case(values, amplitude_m, frequency_hz)
            for values in self._combinations()
            for frequency_hz in self.frequencies_hz
            for amplitude_m in self.amplitudes_m
        ]

    def identity(self) -> Identity:
        """Return what tells this sweep from others."""
        settings: dict[str, object] = {
            'varied': [dataclasses.astuple(axis) for axis in self.varied],
            'frequencies_hz': self.frequencies_hz,
            'amplitudes_m': self.amplitudes_m,
            'steps': self.steps,
        }
        return identify('sweep', self.parameters, len(self.cases()), settings)

    def columns(self) -> tuple[str, ...]:
        """Return the varied parameters that need a column beside ``preload_n`` and the others."""
        names = [axis.name for axis in self.varied]
        ramped = self.parameters.stand.preload_end or 'stand.preload_end' in names
        return tuple(name for name in names if ramped or name != 'stand.preload')

    def _combinations(self) -> list[tuple[tuple[str, Scalar], ...]]:
        named = [[(axis.name, value) for value in axis.values] for axis in self.varied]
        return list(itertools.product(*named))


def run_sweep(
    sweep: Sweep,
    *,
    journal: Journal | None = None,
    workers: int = 0,
    scheduler: str = '',
    progress: Progress | None = None,
) -> list[Row]:
    """
    Run a sweep and return its table; the parameters are those of ``run_batch``.

    Returns
    -------
    list of dict
        One row per case: varied parameters with their units, what was asked for and what came
        of it, and the rule by which the run ended.

    """
    return run_batch(
        partial(run_case, sweep.parameters, sweep.steps, sweep.columns()),
        sweep.cases(),
        journal=journal,
        workers=workers,
        scheduler=scheduler,
        progress=progress,
    )


def run_case(parameters: Parameters, steps: int, columns: tuple[str, ...], case: Case) -> Row:
    """
    Return the row of one case.

    Parameters
    ----------
    parameters : Parameters
        The stand that the case starts from.
    steps : int
        Steps; 0 goes on until the steady state.
    columns : tuple of str
        Varied parameters that have a column of their own.
    case : Case
        The case.

    """
    values = dict(case.values)
    there = parameters.updated(values)
    run = vars(run_drive(there, case.amplitude_m, case.frequency_hz, steps))
    varied = {column_name(name): values[name] for name in columns}
    measured = {RENAMED.get(name, name): value for name, value in run.items()}
    return {**varied, **measured, 'stop_rule': stop_rule(steps)}


def stop_rule(steps: int) -> str:
    """Say when a run of so many steps ends."""
    return f'{steps} steps' if steps else STEADY_RULE


def _check_wave(parameters: Parameters, amplitude_m: float, frequency_hz: float) -> None:
    AMPLITUDE.check('amplitude', amplitude_m)
    FREQUENCY.check('frequency', frequency_hz)
    # An amplitude of 0 makes no steps; its frequency is checked with the next one there is.
    voltage_v = voltage_for(parameters, amplitude_m)
    if voltage_v > 0.0:
        check_request(Request('sawtooth', (voltage_v, frequency_hz, 0.0)), parameters)
