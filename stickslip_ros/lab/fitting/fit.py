# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Fit the drive to experiments: the best of many searches, with its errors."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import count
from typing import TYPE_CHECKING

import numpy as np

from stickslip_ros.errors import OutOfRange
from stickslip_ros.lab.experiments.experiment import Experiment
from stickslip_ros.lab.experiments.options import ReadingOptions
from stickslip_ros.lab.experiments.reading import read_experiments
from stickslip_ros.lab.fitting.assumed import assumed_of, doubt_untold
from stickslip_ros.lab.fitting.free import (
    Coordinate,
    FreeParameters,
    Known,
    choose_free,
    known_of,
    listed_free,
)
from stickslip_ros.lab.fitting.metric import Allowance
from stickslip_ros.lab.fitting.missing import CYCLIC, ODDS_SURE, Missing, missing_from
from stickslip_ros.lab.fitting.problem import Problem, pose, silent
from stickslip_ros.lab.fitting.report import Fit
from stickslip_ros.lab.fitting.search import (
    CERTAIN_FACTOR,
    Minimum,
    distinct,
    notes_of,
    refine,
    search,
    search_all,
    settle,
)
from stickslip_ros.lab.fitting.statistics import QUANTILE_95, Uncertainty, uncertainty
from stickslip_ros.lab.readers.measured import MeasuredTable
from stickslip_ros.lab.runs.batch import Progress, pool_of
from stickslip_ros.parameters import Parameters, checked_arguments
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

    shape_m: float = 5e-10
    """Least error of the model's motion in each moment of a cycle, m."""
    step_share: float = 3e-3
    """Least error of the model's step length, as a share of it."""
    starts: int = 5
    """Searches from the present values and from the best of a Latin hypercube."""
    seed: int = 1
    """Seed of the hypercube."""
    assume: Mapping[str, Known | str] = field(default_factory=dict)
    """
    Error of a constant, or of scale, feet or load, which are 1; +-0%: none.

    Typed, ``{'contact.radius': '0.5mm+-2%', 'scale': '+-0%'}``, or value and relative error.

    """

    @property
    def allowance(self) -> Allowance:
        """Allowed errors of the model."""
        return Allowance(self.shape_m, self.step_share)


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
    Fit parameters of the drive to recordings of its motion and to measured numbers, all at once.

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
        Whether to show the progress; or a function, called with the runs made so far, and 0, as
        the total is not known in advance.

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
    read = read_experiments(experiments, given, options, report)
    notes += doubt_untold(shares, given, {*names, *options.assume}, read)
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
    known: Mapping[str, Known] | None = None,
    assumed: Mapping[str, float] | None = None,
    options: FitOptions = FitOptions(),
    progress: Show | None = None,
) -> Fit:
    """Fit coordinates of ``choose_free`` to experiments."""
    started_s = time.perf_counter()
    if not 1 <= options.starts <= STARTS_MAX:
        limit = f'not from 1 to {STARTS_MAX}'
        raise OutOfRange('number of starts', options.starts, '', limit, 'change --starts')
    runs, ended = count(1), 0

    def count_run() -> None:
        if progress is not None:
            progress(next(runs), 0, f'{ended} of {options.starts} searches ended')

    def count_search(done: int, _: int) -> None:
        nonlocal ended
        ended = done

    problem = pose(parameters, free, experiments, known, count_run)
    if problem.has_traces:
        problem = replace(problem, allowance=options.allowance)
    with pool_of(options.workers) as pool:
        problem = replace(problem, pool=pool)
        ends = search_all(problem, options.starts, options.seed, options.workers, count_search)
        problem, here = min(ends, key=lambda end: end[1].chi_square)
        refined, others, missing = list[Minimum](), list[Minimum](), tuple[Missing, ...]()
        near = [each for _, each in ends if each.chi_square < CERTAIN_FACTOR * here.chi_square]
        if problem.has_traces:
            problem, refined, missing = _settled(problem, here, options)
            here = refined[-1]
        else:
            others = distinct([each for _, each in ends])[1:]
        settled = problem, here
        problem, more, steady = refine(*settled)
        refined += more
        if problem.has_traces:
            again = [search(problem, each.place) for each in distinct(near)[1:]]
            best, *others = distinct([refined[-1], *again])
            refined.append(best)
        here = refined[-1] if refined else here
        is_settled = (problem, here) == settled
        problem = replace(problem, tick=silent)
        predicted = problem.predicted_at(here.place)
        doubt = uncertainty(problem, here.place, assumed or {})
        reached, rivals = _reaching(doubt, problem, here, others)
        if not is_settled:
            missing = missing_from(problem, here.place)
    return Fit(
        problem=replace(problem, pool=None),
        searches=tuple(each for _, each in ends),
        refined=tuple(refined),
        others=rivals,
        steady=steady,
        uncertainty=reached if problem.has_traces else doubt,
        predicted=predicted,
        missing=missing,
        wall_s=time.perf_counter() - started_s,
        notes=tuple(notes_of(problem, options.allowance)),
    )


def _settled(
    problem: Problem, here: Minimum, options: FitOptions
) -> tuple[Problem, list[Minimum], tuple[Missing, ...]]:
    """Settle noise and sensors, with a cyclic error that the readings surely show."""
    problem, found = settle(problem, here.place, options.allowance, options.outliers)
    missing = missing_from(problem, found[-1].place)
    sure = [one.name for one in missing[:1] if one.odds > ODDS_SURE]
    fringes_m = [CYCLIC[name] for name in sure if name in CYCLIC]
    if not fringes_m:
        return problem, found, missing
    sensed = (each.sensed(cyclic_m=CYCLIC_M, fringe_m=fringes_m[0]) for _, each, _ in problem.seen)
    problem, more = settle(
        problem.with_seen(sensed), found[-1].place, options.allowance, options.outliers
    )
    return problem, [*found, *more], missing_from(problem, more[-1].place)


def _reaching(
    doubt: Uncertainty, problem: Problem, here: Minimum, others: Sequence[Minimum]
) -> tuple[Uncertainty, tuple[Minimum, ...]]:
    """Return errors that reach to the other minima that are not ruled out, and these."""
    most = here.chi_square + QUANTILE_95**2 * doubt.variance_scale
    found = [(each, problem.natural.back(each.place)) for each in others if each.chi_square < most]
    rivals = [(each, z) for each, z in found if doubt.is_beyond_errors(z)]
    rises = np.array([each.chi_square - here.chi_square for each, _ in rivals])
    reached = doubt.reaching(np.array([z for _, z in rivals]), rises)
    return reached, tuple(each for each, _ in rivals)
