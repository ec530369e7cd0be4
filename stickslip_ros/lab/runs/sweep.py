# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Sweeps: the drive at every combination of values."""

import dataclasses
import hashlib
import itertools
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

import stickslip_ros
from stickslip_ros.errors import OutOfRange, WrongKind
from stickslip_ros.instrument.commands import Request, check_request
from stickslip_ros.lab.measurements.sweep_table import STEP_BACK, STOP_RULE, SWEEP_COLUMNS, Row
from stickslip_ros.lab.runs.batch import Progress, run_courses
from stickslip_ros.lab.runs.courses import Course, bundle_for
from stickslip_ros.lab.runs.journal import Journal
from stickslip_ros.lab.runs.sawtooth_run import (
    STEADY_ERROR,
    STEADY_STEPS_MAX,
    STEADY_STEPS_MIN,
    STEADY_WINDOW,
    drive_course,
    voltage_for,
)
from stickslip_ros.parameters import (
    AMPLITUDE_SPEC,
    FREQUENCY_SPEC,
    Parameters,
    Scalar,
    Spec,
    checked_arguments,
    column_name,
    parse_assignments,
    spec_of,
)
from stickslip_ros.parameters.typed import to_si_list
from stickslip_ros.progress import progress_of

if TYPE_CHECKING:
    from pandas import DataFrame

CASES_MAX = 100_000  # of one table
PARTS_MAX = 10_000  # tables of a folder
SPECS = {'amplitude_m': AMPLITUDE_SPEC, 'frequency_hz': FREQUENCY_SPEC}
"""Swept quantities that are not parameters."""
_COUNT = Spec(int, 2, '', '', 'values of a range', 2, CASES_MAX)
_EXAMPLE = 'write values with commas, as 0.1,0.5, or start:stop:count, as 0:160nm:33'
STEADY_RULE = (
    f'mean force of a cycle (free runner: step length) within {STEADY_ERROR:.2%} of its limit, by '
    f'the last {2 * STEADY_WINDOW} steps; {STEADY_STEPS_MIN} to {STEADY_STEPS_MAX} steps'
)
"""Condition of a steady run."""


@dataclass(frozen=True)
class Axis:
    """A name and its values."""

    name: str
    values: tuple[Scalar, ...]


@dataclass(frozen=True)
class SweepCase:
    """One run: values of varied parameters, amplitude, frequency."""

    values: tuple[tuple[str, Scalar], ...]
    amplitude_m: float
    frequency_hz: float


@dataclass(frozen=True)
class Sweep:
    """A sweep; every combination is checked at creation."""

    parameters: Parameters  # base of all runs
    varied: tuple[Axis, ...]  # varied parameters; the last varies fastest
    frequencies_hz: tuple[float, ...]
    amplitudes_m: tuple[float, ...]  # vary fastest
    steps: int = 0  # per run; 0 until steady
    both_ways: bool = False  # whether each case runs backwards too

    def __post_init__(self) -> None:
        """Refuse invalid combinations before the runs."""
        if self.steps < 0:
            hint = 'give a number, or 0 for the steady state'
            raise OutOfRange('steps', self.steps, '', 'below 0', hint)
        names = [axis.name for axis in self.varied]
        for name in names:
            if names.count(name) > 1:
                hint = 'put all its values into one list'
                raise OutOfRange('parameter', name, '', 'varied twice', hint)
        if self.total > (most := PARTS_MAX * CASES_MAX):
            limit = f'above the maximum {most}'
            raise OutOfRange('number of runs', self.total, '', limit, 'take fewer values')
        # What is refused of an amplitude is refused of the smallest or of the largest.
        ends_m = sorted({min(self.amplitudes_m), max(self.amplitudes_m)})
        for values in itertools.product(*self._named()):
            there = self.parameters.updated(dict(values))
            for hertz, amplitude_m in itertools.product(self.frequencies_hz, ends_m):
                FREQUENCY_SPEC.check('frequency', hertz)
                if self.both_ways and hertz < 0.0:
                    limit = 'below 0 with --both-ways'
                    raise OutOfRange('frequency', hertz, 'Hz', limit, 'give it above 0')
                # An amplitude of 0 makes no steps; the next one checks the frequency.
                if (voltage_v := voltage_for(there, amplitude_m)) > 0.0:
                    check_request(Request('sawtooth', (voltage_v, hertz, 0.0)), there)

    @property
    def total(self) -> int:
        """Return the number of cases."""
        counts = (len(axis.values) for axis in self.varied)
        return math.prod(counts) * len(self.frequencies_hz) * len(self.amplitudes_m)

    def _named(self) -> list[list[tuple[str, Scalar]]]:
        return [[(axis.name, value) for value in axis.values] for axis in self.varied]

    def cases(self, first: int = 0, end: int | None = None) -> list[SweepCase]:
        """Return these cases of the full Cartesian product, in the order of the table."""
        axes: list[Sequence[Any]] = [*self._named(), self.frequencies_hz, self.amplitudes_m]
        shape = [len(each) for each in axes]
        numbers = np.unravel_index(np.arange(first, self.total if end is None else end), shape)
        columns = [[axis[i] for i in at] for axis, at in zip(axes, numbers, strict=True)]
        return [
            SweepCase(tuple(values), metres, hertz)
            for *values, hertz, metres in zip(*columns, strict=True)
        ]

    def digest(self) -> str:
        """Return what tells this sweep, by this version, from every other one."""
        _, *axes = dataclasses.astuple(self)
        content = [stickslip_ros.__version__, self.parameters.flat(), *axes]
        return hashlib.sha256(json.dumps(content).encode()).hexdigest()

    def columns(self) -> tuple[str, ...]:
        """Return the varied parameters that need their own column."""
        names = [axis.name for axis in self.varied]
        ramped = self.parameters.stand.preload_end or 'stand.preload_end' in names
        return tuple(name for name in names if ramped or name != 'stand.preload')


@checked_arguments
def sweep(
    parameters: Parameters,
    values: Mapping[str, Iterable[Scalar] | Scalar],
    *,
    steps: int = 0,
    workers: int = 0,
    progress: bool | Progress = False,
) -> 'DataFrame':
    """
    Run the drive alone, without sensors, at every combination of values.

    Parameters
    ----------
    parameters : Parameters
        The base stand of all runs.
    values : mapping of str to values
        Values of ``amplitude_m`` (stroke of the feet, m), of ``frequency_hz`` (by default 1000)
        and of any parameter, ``{'stand.preload': [0.1, 0.5]}``; the first parameter varies
        slowest, the amplitude fastest.
    steps : int
        Steps of each run; 0 runs until steady.
    workers : int
        Runs at once; 0 is one per core.
    progress : bool or callable
        Show the progress, or call this with runs done and in total.

    Returns
    -------
    DataFrame
        One row per run: the table of ``stickslip sweep``. Its ``attrs`` hold the parameters.

    Raises
    ------
    StickSlipError
        If a name, a value or a combination is refused.

    Examples
    --------
    >>> table = sweep(Parameters(), {'stand.preload': [0.25, 0.5], 'amplitude_m': [60e-9, 120e-9]})
    >>> [f'{1e3 * force_n:.1f} mN' for force_n in table['force_mean_n']]
    ['20.7 mN', '92.5 mN', '4.1 mN', '119.3 mN']

    """
    if 'amplitude_m' not in values:
        raise WrongKind('values', sorted(values), 'a sweep', 'give amplitude_m, the stroke in m')
    given = {'frequency_hz': FREQUENCY_SPEC.default, **values}
    axes = {}
    for name, each in given.items():
        spec = SPECS.get(name) or spec_of(name)
        plain: Any = each.tolist() if isinstance(each, np.ndarray | np.generic) else each
        is_one = isinstance(plain, str) or not isinstance(plain, Iterable)
        checked = (spec.check(name, value) for value in ([plain] if is_one else plain))
        axes[name] = Axis(name, tuple(checked))
    chosen = Sweep(
        parameters=parameters,
        varied=tuple(axis for name, axis in axes.items() if name not in SPECS),
        frequencies_hz=tuple(map(float, axes['frequency_hz'].values)),
        amplitudes_m=tuple(map(float, axes['amplitude_m'].values)),
        steps=steps,
    )
    import pandas as pd  # noqa: PLC0415 - slow import

    with progress_of(progress, 'runs') as show:
        frame: DataFrame = pd.DataFrame(run_sweep(chosen, workers=workers, progress=show))
    frame.attrs['parameters'] = parameters.flat()
    return frame


def parse_axis(name: str, text: str, spec: Spec) -> Axis:
    """Parse an axis: values with commas, or ``start:stop:count`` with both ends."""
    if spec.is_array:
        raise WrongKind(name, text, 'one number', 'set arrays with --set, and sweep other values')
    if ':' in text and spec.kind in {float, int}:
        values: list[object] = list(_range(name, text, spec))
    else:
        parts = [part.strip() for part in text.split(',')]
        values = list(to_si_list(name, parts, spec.unit) if spec.kind is float else parts)
    return Axis(name, tuple(spec.check(name, value) for value in values))


def parse_floats(name: str, text: str, spec: Spec) -> tuple[float, ...]:
    """Parse the numbers of an axis."""
    return tuple(map(float, parse_axis(name, text, spec).values))


def parse_varied(assignments: list[str]) -> list[Axis]:
    """Parse axes such as ``contact.friction=0.2,0.3``, each parameter once."""
    axes: list[Axis] = []
    for assignment in assignments:
        if '=' not in assignment:
            hint = 'write --vary group.name=VALUES'
            raise WrongKind('--vary', assignment, 'a parameter with values', hint)
        ((name, text),) = parse_assignments([assignment]).items()
        axes.append(parse_axis(name, text, spec_of(name)))
    return axes


def _range(name: str, text: str, spec: Spec) -> list[Scalar]:
    parts = text.split(':')
    if len(parts) != 3:
        raise WrongKind(name, text, 'start:stop:count', _EXAMPLE)
    start, stop = to_si_list(name, parts[:2], spec.unit, ':')
    count = int(_COUNT.check(f'{name} count', parts[2]))
    if start == stop:
        limit = f'both start and stop of a range of {count}'
        hint = 'move one of them, or give the value alone'
        raise OutOfRange(name, start, spec.unit, limit, hint)
    values = [float(value) for value in np.linspace(start, stop, count)]
    if spec.kind is float:
        return list(values)
    for value in values:
        if not value.is_integer():
            limit = 'not a whole number'
            raise OutOfRange(f'{name} in {text}', value, spec.unit, limit, 'change the count')
    return [int(value) for value in values]


def run_sweep(
    sweep: Sweep,
    *,
    cases: Sequence[SweepCase] = (),
    journal: Journal | None = None,
    workers: int = 0,
    scheduler: str = '',
    progress: Progress | None = None,
) -> list[Row]:
    """
    Run a sweep, or some of its cases, with ``run_batch``.

    A row per case has varied values and results. Raises OutOfRange if they are too many for one
    table.

    """
    if (count := len(cases) or sweep.total) > CASES_MAX:
        limit = f'above the maximum {CASES_MAX} of one table'
        hint = 'stickslip sweep -o NAME, without an ending, writes a folder of tables'
        raise OutOfRange('number of runs', count, '', limit, hint)
    cases = cases or sweep.cases()
    return run_courses(
        partial(case_course, sweep),
        cases,
        bundle=bundle_for(sweep.parameters.updated(dict(cases[0].values))),
        journal=journal,
        workers=workers,
        scheduler=scheduler,
        progress=progress,
    )


def case_course(sweep: Sweep, case: SweepCase) -> Course[Row]:
    """Return the row of a case."""
    values, steps = dict(case.values), sweep.steps
    stand, hertz = sweep.parameters.updated(values), case.frequency_hz
    run = yield from drive_course(stand, case.amplitude_m, hertz, steps)
    row: Row = {column_name(name): values[name] for name in sweep.columns()}
    row |= {name: getattr(run, name) for name in SWEEP_COLUMNS}
    if sweep.both_ways:
        run = yield from drive_course(stand, case.amplitude_m, -hertz, steps)
        row[STEP_BACK] = -run.step_length_m
    return row | {STOP_RULE: stop_rule(steps)}


def stop_rule(steps: int) -> str:
    """Return the end condition of a run in words."""
    return f'{steps} steps' if steps else STEADY_RULE
