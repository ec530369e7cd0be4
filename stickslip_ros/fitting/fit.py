"""A fit of the drive to measured forces: the best of many searches, and how good it is."""

import itertools
import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np

from stickslip_ros.contact.profile import Array
from stickslip_ros.errors import OutOfRange, StickSlipError
from stickslip_ros.extras import load_extra
from stickslip_ros.fitting.free import Free, choose_free
from stickslip_ros.fitting.problem import Points, Problem, pose, read_points, silent
from stickslip_ros.fitting.statistics import (
    PURPOSE,
    Estimate,
    Uncertainty,
    estimates_of,
    uncertainty,
)
from stickslip_ros.notebook import html_table
from stickslip_ros.parameters import Parameters
from stickslip_ros.progress import Show, progress_of
from stickslip_ros.runs.batch import Progress, run_batch
from stickslip_ros.runs.drawn import Drawn
from stickslip_ros.tables.experiment import Experiment, Reading

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from stickslip_ros.tables.formats import Table

# ruff: noqa: PLC0415 - its figure and report import this

STARTS_MAX = 1000
ROUNDS = 6  # searches with ever more cycles, until they suffice at the minimum
WIDENED_MAX = 4  # times that a search goes on beyond bounds that nobody has given
TOLERANCE = 1e-6
"""Relative change of sum of squares, or of coordinates, at which a search ends: a thousandth of
a standard error."""
EVALUATIONS_MAX = 60  # steps of a search, from which it is said not to have converged
SAME_CHANGE = 0.01
"""Change of chi-square, per its scale, within which two searches found the same minimum."""
SAME_SHARE = 1e-10  # the same as a share of the sum of squares of the data, for data without noise
RIVAL = 3.84  # chi-square, per its scale, by which a minimum must be worse to be ruled out at 95 %


@dataclass(frozen=True)
class Minimum:
    """
    Where a search ended, whether it converged, and how many stands it tried.

    There are no coordinates if the search came to a stand that cannot be.

    """

    coordinates: tuple[float, ...]
    chi_square: float
    converged: bool
    evaluations: int

    @property
    def place(self) -> Array:
        """Coordinates of the minimum, shape (free,)."""
        return np.array(self.coordinates)


@dataclass(frozen=True, eq=False, repr=False)
class Fit(Drawn):
    """
    What a fit comes to.

    Attributes
    ----------
    problem : Problem
        What was fitted, with the cycles of each run.
    searches, refined : tuple of Minimum
        Where each search ended, and those that went on from the best with more cycles.
    steady : bool
        Whether all runs had cycles enough.
    uncertainty : Uncertainty
        Slopes at the minimum and what follows from them.
    model_n : array, shape (points,)
        Forces of the fitted stand.
    wall_s : float
        Time it took.
    notes : tuple of str
        What was changed in the stand for it.

    """

    problem: Problem
    searches: tuple[Minimum, ...]
    refined: tuple[Minimum, ...]
    steady: bool
    uncertainty: Uncertainty
    model_n: Array
    wall_s: float
    notes: tuple[str, ...] = ()

    @property
    def found(self) -> Minimum:
        """The minimum."""
        return self.refined[-1] if self.refined else _best(self.searches)

    @property
    def parameters(self) -> Parameters:
        """The fitted stand."""
        return self.problem.stand(self.found.place)

    @cached_property
    def estimates(self) -> tuple[Estimate, ...]:
        """The free parameters."""
        return estimates_of(self.problem, self.found.place, self.uncertainty)

    def _draw(self) -> 'Figure':
        from stickslip_ros.fitting.figure import draw_fit

        return draw_fit(self)

    def __repr__(self) -> str:
        from stickslip_ros.fitting.report import warnings_of

        found = (
            f'{each.name} {each.value:.6g} ± {each.standard_error:.2g} {each.unit}'.rstrip()
            for each in self.estimates
        )
        return '\n'.join([*found, *(f'warning: {text}' for text in warnings_of(self))])

    def _repr_html_(self) -> str:
        from stickslip_ros.fitting.report import warnings_of

        header = ('parameter', 'estimate', 'standard error', '95 % low', '95 % high', 'unit')
        rows = [
            (each.name, each.value, each.standard_error, each.low, each.high, each.unit)
            for each in self.estimates
        ]
        warnings = [(text,) for text in warnings_of(self)]
        return html_table('Fit', rows, header) + html_table('Warnings', warnings) * bool(warnings)

    @property
    def covariance(self) -> Array:
        """In the units of the parameters, shape (free, free); not a number where there is none."""
        slopes = np.array([one.slope(one.value) for one in self.estimates])
        return np.asarray(self.uncertainty.covariance_z * np.outer(slopes, slopes))

    @property
    def chi_square(self) -> float:
        """Sum of squared residuals; if no errors are known, per square of the largest force."""
        return self.found.chi_square

    @property
    def reduced_chi_square(self) -> float | None:
        """Chi-square per degree of freedom; None without one."""
        dof = self.uncertainty.dof
        return self.chi_square / dof if dof else None

    @property
    def p_value(self) -> float | None:
        """Chance of a larger chi-square if model and known errors are right; else None."""
        dof = self.uncertainty.dof
        if self.noise_n is not None or not dof:
            return None
        return float(load_extra(PURPOSE, 'scipy.stats').chi2.sf(self.chi_square, dof))

    @property
    def noise_n(self) -> float | None:
        """Standard error of the points from the residuals; None where it is known."""
        points = self.problem.points
        if points.sigma_n is not None:
            return None
        return float(np.sqrt(self.uncertainty.variance_scale)) * points.largest_n

    @property
    def same(self) -> int:
        """Searches that ended in this minimum."""
        points = self.problem.points
        rounding = SAME_SHARE * float(np.sum((points.force_n / points.scale_n) ** 2))
        return self._searches_within(SAME_CHANGE * self.uncertainty.variance_scale + rounding)

    @property
    def rivals(self) -> int:
        """Searches that ended in another minimum that is not ruled out."""
        not_out = self._searches_within(RIVAL * self.uncertainty.variance_scale)
        return max(not_out - self.same, 0)

    @property
    def evaluations(self) -> int:
        """Stands tried in all searches."""
        return sum(one.evaluations for one in (*self.searches, *self.refined))

    def _searches_within(self, most: float) -> int:
        least = _best(self.searches).chi_square
        return sum(one.chi_square - least <= most for one in self.searches)


def fit(
    experiment: 'Table | Sequence[Table]',
    free: Sequence[str],
    *,
    headers: Mapping[str, str] | None = None,
    preloads_n: Sequence[float] = (),
    parameters: Parameters | None = None,
    start: Mapping[str, float | str] | None = None,
    bounds: Mapping[str, tuple[float, float] | str] | None = None,
    frequency_hz: float = 1000.0,
    steps: int = 0,
    starts: int = 8,
    seed: int = 1,
    workers: int = 0,
    report: Callable[[Experiment], None] | None = None,
    progress: bool | Progress = False,
) -> Fit:
    """
    Fit parameters of the drive to measured mean forces by weighted least squares.

    Parameters
    ----------
    experiment : path-like, DataFrame or sequence of them
        Tables of measured forces, as docs/howto/fit.md says.
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
        Steps per second of points that have none.
    steps : int
        Cycles that the drive had made from rest when a force was read; 0: until it was steady.
    starts : int
        Searches: from the present values, and from a Latin hypercube in the bounds.
    seed : int
        Seed of the hypercube.
    workers : int
        Searches at once; 0 is one per core.
    report : callable, optional
        Called with each ``Experiment`` when it has been read, before anything is computed.
    progress : bool or callable
        Whether to show how far it has come; or what is called with the points computed so far,
        and 0: nobody knows how many the searches will need.

    Raises
    ------
    StickSlipError
        If the table cannot be read, or a parameter cannot be fitted.

    """
    reading = Reading(headers or {}, preloads_n, report)
    points = read_points(experiment, frequency_hz, reading, steps)
    stand, chosen, notes = choose_free(parameters or Parameters(), free, start, bounds)
    with progress_of(progress, 'points') as show:
        fitted = fit_drive(
            stand, chosen, points, starts=starts, seed=seed, workers=workers, progress=show
        )
    return replace(fitted, notes=notes)


def fit_drive(
    parameters: Parameters,
    free: tuple[Free, ...],
    points: Points,
    *,
    starts: int = 8,
    seed: int = 1,
    workers: int = 0,
    progress: Show | None = None,
) -> Fit:
    """Do what ``fit`` does to points that were read, and to what ``choose_free`` returns."""
    started_s = time.perf_counter()
    computed, searched = itertools.count(1), 0

    def tick() -> None:
        if progress is not None:
            progress(next(computed), 0, f'{searched} of {starts} searches ended')

    def count(done: int, _: int) -> None:
        nonlocal searched
        searched = done

    problem = pose(parameters, free, points, tick)
    if not 1 <= starts <= STARTS_MAX:
        limit = f'not from 1 to {STARTS_MAX}'
        raise OutOfRange('number of starts', starts, '', limit, 'change --starts')
    places = [problem.start]  # the present values, then a Latin hypercube in the bounds
    if starts > 1:
        qmc = load_extra(PURPOSE, 'scipy.stats').qmc
        shares = qmc.LatinHypercube(d=len(free), seed=seed).random(starts - 1)
        places += list(qmc.scale(shares, *problem.bounds))
    searches = run_batch(
        partial(_search_or_nothing, problem), places, workers=workers, progress=count
    )
    problem, refined, steady = _refine(problem, _best(searches))
    found = refined[-1] if refined else _best(searches)
    for _ in range(WIDENED_MAX):
        values = problem.values(found.place)
        wider = problem.widened(values)
        if wider.free == problem.free:
            break
        beyond = _search_or_nothing(wider, wider.coordinates(values))
        if not beyond.coordinates:
            break
        problem, more, steady = _refine(wider, beyond)
        refined += [beyond, *more]
        found = refined[-1]
    problem = replace(problem, tick=silent)
    return Fit(
        problem=problem,
        searches=tuple(searches),
        refined=tuple(refined),
        steady=steady,
        uncertainty=uncertainty(problem, found.place, found.chi_square),
        model_n=problem.forces_n(found.place),
        wall_s=time.perf_counter() - started_s,
    )


def search(problem: Problem, start: Array) -> Minimum:
    """Search from coordinates: a bounded trust region, with one-sided differences."""
    optimize = load_extra(PURPOSE, 'scipy.optimize')
    ended = optimize.least_squares(
        problem.residuals,
        np.clip(start, *problem.bounds),
        jac=problem.slopes,
        bounds=problem.bounds,
        method='trf',
        x_scale='jac',
        ftol=TOLERANCE,
        xtol=TOLERANCE,
        gtol=TOLERANCE**2,
        max_nfev=EVALUATIONS_MAX,
    )
    return Minimum(
        tuple(ended.x.tolist()),
        2.0 * float(ended.cost),
        bool(ended.success),
        int(ended.nfev + len(start) * ended.njev),
    )


def _search_or_nothing(problem: Problem, start: Array) -> Minimum:
    """Search, and find nothing at a stand that cannot be, unless it is the user's own."""
    try:
        return search(problem, start)
    except StickSlipError:
        if np.array_equal(start, problem.start):
            raise
        return Minimum((), math.inf, converged=False, evaluations=0)


def _best(searches: Sequence[Minimum]) -> Minimum:
    return min(searches, key=lambda found: found.chi_square)


def _refine(problem: Problem, best: Minimum) -> tuple[Problem, list[Minimum], bool]:
    """Search on from a minimum with more cycles, as long as its runs need them."""
    refined: list[Minimum] = []
    here = best.place
    for _ in range(ROUNDS):
        longer, steady = problem.steady_at(here)
        if longer.cycles == problem.cycles:
            break
        problem = longer
        refined.append(search(problem, here))
        here = refined[-1].place
    return problem, refined, steady
