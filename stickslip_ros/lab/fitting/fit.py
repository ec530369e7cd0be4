# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Fit the drive to experiments: the best of many searches, with its errors."""

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from scipy.stats import qmc

from stickslip_ros.errors import OutOfRange
from stickslip_ros.lab.experiments.experiment import Experiment
from stickslip_ros.lab.experiments.options import ReadingOptions
from stickslip_ros.lab.experiments.reading import read_experiments
from stickslip_ros.lab.fitting.assumed import assume, assumed_of, doubt_feet
from stickslip_ros.lab.fitting.free import (
    Coordinate,
    FreeParameters,
    Known,
    choose_free,
    known_of,
    listed_free,
)
from stickslip_ros.lab.fitting.metric import Allowance
from stickslip_ros.lab.fitting.missing import missing_from
from stickslip_ros.lab.fitting.problem import Problem, pose, silent
from stickslip_ros.lab.fitting.report import Fit
from stickslip_ros.lab.fitting.result import RULED_OUT_BY, Minimum, best_of
from stickslip_ros.lab.fitting.search import along_valley, refine, search_or_nothing
from stickslip_ros.lab.fitting.statistics import uncertainty
from stickslip_ros.lab.fitting.traces import LOOSE, refine_noise, tightened, with_clocks
from stickslip_ros.lab.fitting.trial import fit_trial
from stickslip_ros.lab.runs.batch import Progress, pool_of, run_batch
from stickslip_ros.lab.tables.measured import MeasuredTable
from stickslip_ros.parameters import Parameters, reading
from stickslip_ros.progress import Show, progress_of

if TYPE_CHECKING:
    from stickslip_ros.lab.runs.recorded_run import Run
    from stickslip_ros.lab.tables.formats import Table

STARTS_MAX = 1000
WIDENED_MAX = 4  # most continuations of a search beyond default bounds
AROUND = 1.0
"""Distance from the start of other searches of traces, in coordinates: a factor of e, mostly."""


@reading
@dataclass(frozen=True, kw_only=True)
class FitOptions(ReadingOptions):
    """Options of reading experiments, weighing them and searching."""

    shape_m: float = 5e-10
    """Error of the model's motion in each moment of a cycle, m."""
    step_share: float = 3e-3
    """Error of the model's step length, as a share of it."""
    starts: int = 8
    """Searches from the present values and a Latin hypercube in the bounds (recordings: near
    the values)."""
    seed: int = 1
    """Seed of the hypercube."""
    assume: Mapping[str, Known | str] = field(default_factory=dict)
    """
    Error of a constant, of the scale of contact stiffness, or of the number of feet; +-0%: none.

    Typed, ``{'contact.radius': '0.5mm+-2%', 'scale': '+-0%'}``, or value and relative error.

    """

    @property
    def allowance(self) -> Allowance:
        """Allowed errors of the model."""
        return Allowance(self.shape_m, self.step_share)


@reading
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
    notes += doubt_feet(shares, given, names, read)
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
    is_warm: bool = False,
    progress: Show | None = None,
) -> Fit:
    """Fit coordinates of ``choose_free`` to experiments; ``is_warm``: the start is near."""
    started_s = time.perf_counter()
    if not 1 <= options.starts <= STARTS_MAX:
        limit = f'not from 1 to {STARTS_MAX}'
        raise OutOfRange('number of starts', options.starts, '', limit, 'change --starts')
    allowance, outliers = options.allowance, options.outliers
    count = _Count(options.starts, progress)
    problem = pose(parameters, free, experiments, known, count.run)
    problem = with_clocks(problem)
    searches = _searches(problem, options, count)
    if is_warm:
        searches.append(Minimum(tuple(problem.start.tolist()), math.inf, False, 0))
    with pool_of(options.workers) as pool:
        problem = replace(problem, pool=pool)
        here, refined, notes = best_of(searches), list[Minimum](), tuple[str, ...]()
        rivals = tuple[Minimum, ...]()
        if problem.has_traces:
            is_known = is_warm and experiments[0].seen[0].sigma is not None
            problem, refined, rivals, notes = tightened(
                problem, searches, allowance, outliers, options.workers, tries_sensors=not is_known
            )
            here = refined[-1]
        problem, more, steady = _refined(problem, here, allowance, outliers)
        refined += more
        here = refined[-1] if refined else here
        if problem.has_traces and not is_warm:
            problem, more = along_valley(problem, here)
            refined += more
            here = refined[-1] if refined else here
        problem = replace(problem, tick=silent)
        [predicted] = problem.predicted([problem.stand(here.place)])
        doubt = uncertainty(problem, here.place, here.chi_square)
        rivals = tuple(
            each
            for each in rivals
            if each.chi_square - here.chi_square < RULED_OUT_BY
            and doubt.is_beyond_errors(here.place, each.place)
        )
        doubt = doubt.reaching(
            here.place,
            np.array([each.place for each in rivals]),
            np.array([each.chi_square - here.chi_square for each in rivals]),
        )
        taken = assume(problem, here.place, doubt, assumed or {})
        missing = missing_from(problem, here.place)
        trial = None if is_warm else fit_trial(problem, missing)
    return Fit(
        problem=replace(problem, pool=None),
        searches=tuple(searches),
        refined=tuple(refined),
        others=rivals,
        steady=steady,
        uncertainty=taken.widened(),
        assumed=taken,
        predicted=predicted,
        missing=missing,
        trial=trial,
        wall_s=time.perf_counter() - started_s,
        notes=notes,
    )


class _Count:
    """Reports the progress of the searches."""

    def __init__(self, starts: int, progress: Show | None) -> None:
        self._starts, self._show = starts, progress
        self._runs, self._searches = 0, 0

    def run(self) -> None:
        """Count a run."""
        self._runs += 1
        if self._show is not None:
            self._show(self._runs, 0, f'{self._searches} of {self._starts} searches ended')

    def search(self, done: int, _: int) -> None:
        """Set the number of searches that have ended."""
        self._searches = done


def _searches(problem: Problem, options: FitOptions, count: _Count) -> list[Minimum]:
    """Search from the start and from a Latin hypercube in the bounds, of traces near the start."""
    places = [problem.start]
    if options.starts > 1:
        shares = qmc.LatinHypercube(d=len(problem.free), seed=options.seed).random(
            options.starts - 1
        )
        lower, upper = problem.bounds
        if problem.has_traces:
            lower, upper = (
                np.clip(problem.start + way, lower, upper) for way in (-AROUND, AROUND)
            )
        places += list(qmc.scale(shares, lower, np.maximum(upper, lower + 1e-9)))
    first = replace(problem, allowance=LOOSE[0]) if problem.has_traces else problem
    return run_batch(
        partial(search_or_nothing, first), places, workers=options.workers, progress=count.search
    )


def _refined(
    problem: Problem, here: Minimum, allowance: Allowance, outliers: float
) -> tuple[Problem, list[Minimum], bool]:
    """Continue a search with enough cycles, and beyond default bounds."""
    problem, refined, steady = refine(problem, here)
    for _ in range(WIDENED_MAX):
        here = refined[-1] if refined else here
        values = problem.values(here.place)
        wider = problem.widened(values)
        if wider.free == problem.free:
            break
        beyond = search_or_nothing(wider, wider.coordinates(values))
        if not beyond.coordinates:
            break
        problem, more, steady = refine(wider, beyond)
        refined += [beyond, *more]
        if problem.has_traces:  # the residual at the bound was taken for noise, or for the sensor
            there = refined[-1].place
            problem, more = refine_noise(problem, there, allowance, outliers)
            refined += more
    return problem, refined, steady
