# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Fit the drive to experiments: the best of many searches, with its errors."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from stickslip_ros.errors import OutOfRange
from stickslip_ros.kernels.kernel import compilation_reported
from stickslip_ros.lab.experiments.experiment import Experiment
from stickslip_ros.lab.experiments.options import ReadingOptions
from stickslip_ros.lab.experiments.reading import read_experiments
from stickslip_ros.lab.fitting.assumed import add_default_errors, assumed_of
from stickslip_ros.lab.fitting.free import (
    Coordinate,
    FreeParameters,
    KnownValue,
    choose_free,
    known_of,
    listed_free,
)
from stickslip_ros.lab.fitting.missing import CYCLIC, ODDS_SURE, Missing, missing_from
from stickslip_ros.lab.fitting.problem import Problem, pose, silent
from stickslip_ros.lab.fitting.report import Fit
from stickslip_ros.lab.fitting.search import Minimum, notes_of, refine, search_all, settle
from stickslip_ros.lab.fitting.statistics import uncertainty
from stickslip_ros.lab.measurements.vocabulary import MeasuredTable
from stickslip_ros.lab.runs.batch import Interrupted, Progress, pool_of
from stickslip_ros.parameters import Parameters, checked_arguments
from stickslip_ros.process.stopping import Stopped
from stickslip_ros.progress import Show, progress_of

if TYPE_CHECKING:
    from stickslip_ros.lab.measurements.recorded_run import Run
    from stickslip_ros.lab.readers.formats import Table

STARTS_MAX = 1000
CYCLIC_M = 3e-9  # usual size of a cyclic error


@checked_arguments
@dataclass(frozen=True, kw_only=True)
class FitOptions(ReadingOptions):
    """Options of reading experiments, weighing them and searching."""

    drift_m_per_s: float = 1e-6
    """Usual drift of a position sensor, m/s; a larger one could hide wrong step lengths."""
    starts: int = 5
    """Number of searches: from the present values and from the best of a Latin hypercube."""
    assume: Mapping[str, KnownValue | str] = field(default_factory=dict)
    """
    Errors of constants, by name, and of the factors scale, feet, load, voltage and position.

    Texts, ``{'contact.radius': '0.5mm+-2%', 'scale': '+-0%'}``, or pairs of value (1 for a factor)
    and relative error.

    """


@checked_arguments
def fit(
    experiments: 'Table | Run | Experiment | Sequence[Table | Run | Experiment]',
    free: FreeParameters,
    *,
    parameters: Parameters | None = None,
    options: FitOptions = FitOptions(),
    report: Callable[[MeasuredTable], None] | None = None,
    progress: bool | Progress = False,
) -> Fit:
    """
    Fit parameters of the drive jointly to recordings of its motion and to measured numbers.

    Parameters
    ----------
    experiments : path-like, Run, DataFrame, Experiment or sequence of them
        Recordings and tables over time, with a voltage and readings; and tables of forces or step
        lengths by amplitude, see docs/howto/fit.md.
    free : str, Free, or sequence of them
        Parameters to fit: ``'contact.friction'``, or ``Free('contact.friction', start=0.3)``.
    parameters : Parameters, optional
        The stand; by default that of the paper.
    options : FitOptions, optional
        Options of reading, weighing and searching.
    report : callable, optional
        Called with each ``MeasuredTable`` after reading, before anything is computed.
    progress : bool or callable
        Whether to show the progress; or a function, called with the runs made so far and their
        expected number, which is 0 until the first search has ended.

    Raises
    ------
    StickSlipError
        If an experiment cannot be read, or a parameter cannot be fitted.

    """
    free = listed_free(free)
    names = [one.name for one in free]
    given, shares = assumed_of(parameters or Parameters(), names, options.assume)
    stand, chosen, notes = choose_free(given, free)
    known = known_of(free)
    read = [
        one.drifting(options.drift_m_per_s)
        for one in read_experiments(experiments, given, options, report)
    ]
    notes += add_default_errors(shares, given, {*names, *options.assume}, read)
    with progress_of(progress, 'runs') as show:
        fitted = fit_experiments(
            stand, chosen, read, known=known, assumed=shares, options=options, progress=show
        )
    return replace(fitted, notes=(*notes, *fitted.notes))


def fit_experiments(
    parameters: Parameters,
    free: tuple[Coordinate, ...],
    experiments: Sequence[Experiment],
    *,
    known: Mapping[str, KnownValue] | None = None,
    assumed: Mapping[str, float] | None = None,
    options: FitOptions = FitOptions(),
    progress: Show | None = None,
) -> Fit:
    """Fit coordinates of ``choose_free`` to experiments."""
    started_s = time.perf_counter()
    if not 1 <= options.starts <= STARTS_MAX:
        limit = f'not from 1 to {STARTS_MAX}'
        raise OutOfRange('number of starts', options.starts, '', limit, 'change --starts')
    counts = _Counts(options.starts, progress or (lambda *_: None))
    with (
        counts.reported_when_stopped(),
        compilation_reported(counts.add_kernel),
        pool_of(options.workers) as pool,
    ):
        problem = pose(parameters, free, experiments, known, counts.add_run)
        problem = replace(problem, pool=pool)
        ends = search_all(problem, options.starts, options.workers, counts.set_searches)
        problem, here = min(ends, key=lambda end: end[1].chi_square)
        problem, refined, steady = refine(problem, here)
        missing: tuple[Missing, ...] = ()
        if problem.is_estimated:
            problem, settled, missing = _settled(problem, [here, *refined][-1])
            refined += settled
        here = [here, *refined][-1]
        problem = replace(problem, tick=silent)
        doubt = uncertainty(problem, here.place, assumed or {}, missing)
        if doubt.inert.any():  # parameters without effect keep their starts
            starts = [one.to_coordinate(one.start) for one in free]
            place = problem.natural.to(np.where(doubt.inert, starts, doubt.z))
            here = replace(here, coordinates=tuple(place.tolist()))
            refined.append(here)
            doubt = uncertainty(problem, here.place, assumed or {}, missing)
        predicted = problem.predicted_at(here.place)
    return Fit(
        problem=replace(problem, pool=None),
        searches=tuple(each for _, each in ends),
        refined=tuple(refined),
        steady=steady,
        uncertainty=doubt,
        predicted=predicted,
        missing=missing,
        wall_s=time.perf_counter() - started_s,
        notes=tuple(notes_of(problem)),
    )


@dataclass
class _Counts:
    """Runs and searches of a fit so far."""

    starts: int
    show: Show
    runs: int = 0
    ended: int = 0
    expected: int = 0  # runs of all searches, extrapolated from those that have ended

    def add_run(self) -> None:
        self.runs += 1
        self.report(f'{self.ended} of {self.starts} searches ended')

    def add_kernel(self, compiled: int) -> None:
        """Report another compiled kernel: a stand may need a hundred for its first run."""
        self.report(f'compiling kernels, once: {compiled}')

    def report(self, note: str) -> None:
        total = self.expected if self.runs <= self.expected else 0
        self.show(self.runs, total, note)

    def set_searches(self, done: int, total: int) -> None:
        self.ended, self.starts = done, total
        self.expected = self.runs * total // done if done else 0

    @contextmanager
    def reported_when_stopped(self) -> Iterator[None]:
        """Add the progress to the message of a stopped fit."""
        try:
            yield
        except (Interrupted, KeyboardInterrupt):
            counts = f'{self.ended} of {self.starts} searches, {self.runs} runs'
            raise Stopped(f'stopped after {counts}; nothing is written') from None


def _settled(
    problem: Problem, here: Minimum
) -> tuple[Problem, list[Minimum], tuple[Missing, ...]]:
    """Settle noise and sensors; solve for a cyclic error if it is almost certain."""
    problem, found = settle(problem, here.place)
    missing = missing_from(problem, found[-1].place)
    sure = [one.name for one in missing[:1] if one.odds > ODDS_SURE]
    fringes_m = [CYCLIC[name] for name in sure if name in CYCLIC]
    if not fringes_m:
        return problem, found, missing
    sensed = (
        each.sensed(cyclic_m=CYCLIC_M, fringe_m=fringes_m[0]) for _, each, _ in problem.observed
    )
    problem, more = settle(problem.with_observed(sensed), found[-1].place)
    return problem, [*found, *more], missing_from(problem, more[-1].place)
