# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A fit of the drive to experiments: the best of many searches, and how good it is."""

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.stats import qmc

from stickslip_ros.errors import OutOfRange
from stickslip_ros.lab.experiments.experiment import Experiment
from stickslip_ros.lab.experiments.reading import DriveSource, read_experiments
from stickslip_ros.lab.fitting.free import Free, choose_free, choose_known
from stickslip_ros.lab.fitting.metric import Allowance
from stickslip_ros.lab.fitting.missing import missing_from
from stickslip_ros.lab.fitting.problem import Problem, pose, silent
from stickslip_ros.lab.fitting.report import Fit
from stickslip_ros.lab.fitting.result import RULED_OUT_BY, Minimum, best_of
from stickslip_ros.lab.fitting.search import along_valley, refine, search_or_nothing
from stickslip_ros.lab.fitting.statistics import uncertainty
from stickslip_ros.lab.fitting.traces import LOOSE, tightened, with_clocks, with_its_noise
from stickslip_ros.lab.fitting.trial import trial_of
from stickslip_ros.lab.runs.batch import Progress, pool_of, run_batch
from stickslip_ros.lab.tables.experiment import MeasuredTable, Reading
from stickslip_ros.parameters import Parameters
from stickslip_ros.progress import Show, progress_of

if TYPE_CHECKING:
    from stickslip_ros.lab.tables.formats import Table

STARTS_MAX = 1000
WIDENED_MAX = 4  # times that a search goes on beyond bounds that nobody has given
AROUND = 1.0
"""Coordinates around the start in which other searches of traces begin: 2.7 times, mostly."""


class Searching(NamedTuple):
    """How minima are looked for: from how many places, by which chance, in how many processes."""

    starts: int = 8
    seed: int = 1
    workers: int = 0  # 0 is one per core
    is_warm: bool = False  # whether the present values are near, so that little is allowed at once


def fit(
    experiment: 'Table | Experiment | Sequence[Table | Experiment]',
    free: Sequence[str],
    *,
    headers: Mapping[str, str] | None = None,
    preloads_n: Sequence[float] = (),
    parameters: Parameters | None = None,
    start: Mapping[str, float | str] | None = None,
    bounds: Mapping[str, tuple[float, float] | str] | None = None,
    known: Mapping[str, tuple[float, float] | str] | None = None,
    commands: 'Table | None' = None,
    frequency_hz: float = 1000.0,
    frequency_max_hz: float | None = None,
    steps: int = 0,
    window_s: tuple[float, float] | None = None,
    outliers: float = 6.0,
    shape_m: float = 5e-10,
    step_share: float = 3e-3,
    starts: int = 8,
    seed: int = 1,
    workers: int = 0,
    report: Callable[[MeasuredTable], None] | None = None,
    progress: bool | Progress = False,
) -> Fit:
    """
    Fit parameters of the drive to recordings of its motion and to measured numbers, all at once.

    Parameters
    ----------
    experiment : path-like, DataFrame, Experiment or sequence of them
        Recordings and tables over time, with a voltage and what was seen; and tables of forces or
        step lengths by amplitude, as docs/howto/fit.md says.
    free : sequence of str
        Parameters to fit, ``['contact.friction']``.
    headers : mapping of str to str, optional
        Headers of columns in files that do not tell, ``{'force_n': 'CH2 (mN)'}``, and topics of
        recordings of other programs, ``{'position_m': '/rig/encoder.point.x'}``.
    preloads_n : sequence of float
        Preloads of files without such a column, N: one of all, or one of each.
    parameters : Parameters, optional
        The stand; by default that of the paper.
    start, bounds : mapping
        Start, and low and high, of free parameters; by default the stand's value, and a decade
        below and above it.
    known : mapping
        Free parameters that were measured otherwise: value and its relative standard error, or
        both as typed, ``3g+-1%``.
    commands : path-like or DataFrame, optional
        What drove the recordings, where it is known: times and voltages.
    frequency_hz : float
        Steps per second of points that have none.
    frequency_max_hz : float, optional
        Largest number of steps per second, for a monitor so slow that others look alike.
    steps : int
        Cycles that the drive had made from rest when a number was read; 0: until it was steady.
    window_s : tuple of float, optional
        Start and end of the stretch of recordings that counts, s.
    outliers : float
        Robust standard deviations from which a lone reading is left out; 0 keeps all.
    shape_m : float
        What the model's motion may be wrong by in each moment of a cycle, m.
    step_share : float
        The same of the length of a step, as a share.
    starts : int
        Searches: from the present values, and from a Latin hypercube in the bounds.
    seed : int
        Seed of the hypercube.
    workers : int
        Searches at once; 0 is one per core.
    report : callable, optional
        Called with each ``MeasuredTable`` when it has been read, before anything is computed.
    progress : bool or callable
        Whether to show how far it has come; or what is called with the runs made so far, and 0:
        nobody knows how many the searches will need.

    Raises
    ------
    StickSlipError
        If an experiment cannot be read, or a parameter cannot be fitted.

    """
    reading = Reading(headers or {}, preloads_n, report, is_run=True)
    given = parameters or Parameters()
    stand, chosen, notes = choose_free(given, free, start, bounds)
    sure = choose_known(known or {}, chosen)
    source = DriveSource(commands, frequency_max_hz, window_s=window_s)
    experiments = read_experiments(
        experiment, given, reading, source, frequency_hz, steps, outliers
    )
    with progress_of(progress, 'runs') as show:
        fitted = fit_experiments(
            stand,
            chosen,
            experiments,
            known=sure,
            allowance=Allowance(shape_m, step_share),
            outliers=outliers,
            how=Searching(starts, seed, workers),
            progress=show,
        )
    return replace(fitted, notes=(*notes, *fitted.notes))


def fit_experiments(
    parameters: Parameters,
    free: tuple[Free, ...],
    experiments: Sequence[Experiment],
    *,
    known: Mapping[str, tuple[float, float]] | None = None,
    allowance: Allowance = Allowance(),  # noqa: B008 - it does not change
    outliers: float = 6.0,
    how: Searching = Searching(),  # noqa: B008 - it does not change
    progress: Show | None = None,
) -> Fit:
    """Do what ``fit`` does to experiments, and to what ``choose_free`` returns."""
    started_s = time.perf_counter()
    if not 1 <= how.starts <= STARTS_MAX:
        limit = f'not from 1 to {STARTS_MAX}'
        raise OutOfRange('number of starts', how.starts, '', limit, 'change --starts')
    count = _Count(how.starts, progress)
    problem = pose(parameters, free, experiments, known, count.run)
    problem, notes = with_clocks(problem)
    searches = _searches(problem, how, count)
    with pool_of(how.workers) as pool:
        problem = replace(problem, pool=pool)
        here, refined, rivals = best_of(searches), list[Minimum](), tuple[Minimum, ...]()
        if problem.has_traces:
            is_known = how.is_warm and experiments[0].seen[0].sigma is not None
            problem, refined, rivals, noted = tightened(
                problem, searches, allowance, outliers, how.workers, tries_sensors=not is_known
            )
            here, notes = refined[-1], notes + noted
        problem, more, steady = _refined(problem, here, allowance, outliers)
        refined += more
        here = refined[-1] if refined else here
        if problem.has_traces and not how.is_warm:
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
            and doubt.is_apart(here.place, each.place)
        )
        missing = missing_from(problem, here.place)
        trial = None if how.is_warm else trial_of(problem, missing)
    return Fit(
        problem=replace(problem, pool=None),
        searches=tuple(searches),
        refined=tuple(refined),
        others=rivals,
        steady=steady,
        uncertainty=doubt.reaching(
            here.place,
            np.array([each.place for each in rivals]),
            np.array([each.chi_square - here.chi_square for each in rivals]),
        ),
        predicted=predicted,
        missing=missing,
        trial=trial,
        wall_s=time.perf_counter() - started_s,
        notes=notes,
    )


class _Count:
    """Tells how far the searches of a fit have come."""

    def __init__(self, starts: int, progress: Show | None) -> None:
        self._starts, self._show = starts, progress
        self._runs, self._searches = 0, 0

    def run(self) -> None:
        """Count a run."""
        self._runs += 1
        if self._show is not None:
            self._show(self._runs, 0, f'{self._searches} of {self._starts} searches ended')

    def search(self, done: int, _: int) -> None:
        """Take note of the searches that have ended."""
        self._searches = done


def _searches(problem: Problem, how: Searching, count: _Count) -> list[Minimum]:
    """Search from the present values, and from a Latin hypercube: of traces, not far from them."""
    places = [problem.start]
    if how.starts > 1:
        shares = qmc.LatinHypercube(d=len(problem.free), seed=how.seed).random(how.starts - 1)
        lower, upper = problem.bounds
        if problem.has_traces:
            lower, upper = (
                np.clip(problem.start + way, lower, upper) for way in (-AROUND, AROUND)
            )
        places += list(qmc.scale(shares, lower, np.maximum(upper, lower + 1e-9)))
    first = replace(problem, allowance=LOOSE[0]) if problem.has_traces else problem
    searches = run_batch(
        partial(search_or_nothing, first), places, workers=how.workers, progress=count.search
    )
    if how.is_warm:
        searches.append(Minimum(tuple(problem.start.tolist()), math.inf, False, 0))
    return searches


def _refined(
    problem: Problem, here: Minimum, allowance: Allowance, outliers: float
) -> tuple[Problem, list[Minimum], bool]:
    """Search on with cycles enough, and beyond bounds that nobody has given."""
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
        if problem.has_traces:  # what the bound left over passed for noise, or for the sensor
            there = refined[-1].place
            problem, more = with_its_noise(problem, there, allowance, outliers)
            refined += more
    return problem, refined, steady
