"""A fit of the drive to measured forces: the best of many searches, and how good it is."""

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stickslip_ros.contact.profile import Array
from stickslip_ros.parameters import Parameters
from stickslip_ros.study.batch import Progress
from stickslip_ros.study.extras import load_extra
from stickslip_ros.study.fitting.free import Free
from stickslip_ros.study.fitting.points import Points
from stickslip_ros.study.fitting.problem import Problem, pose
from stickslip_ros.study.fitting.search import (
    PURPOSE,
    Found,
    same_minimum,
    search,
    search_all,
    starting_points,
)
from stickslip_ros.study.fitting.statistics import (
    Uncertainty,
    correlation_of,
    covariance_of,
    interval,
    uncertainty,
)

STARTS = 8
ROUNDS = 6
"""Searches with ever more cycles, until they suffice at the minimum."""
RIVAL = 3.84
"""Chi-square, per its scale, by which a minimum must be worse to be ruled out at 95 %."""


@dataclass(frozen=True)
class Estimate:
    """
    A fitted parameter.

    Attributes
    ----------
    name, unit : str
        The parameter.
    start, lower, upper : float
        Where the search started, and its bounds.
    value, standard_error : float
        The estimate; an infinite error where the forces do not determine it.
    low, high : float
        95 % confidence interval.
    is_log : bool
        Whether the interval is even about the logarithm of the value.
    at_bound, inert, undetermined : bool
        Whether the value sits on a bound, changes no force, or can be traded for others.

    """

    name: str
    unit: str
    start: float
    lower: float
    upper: float
    value: float
    standard_error: float
    low: float
    high: float
    is_log: bool
    at_bound: bool
    inert: bool
    undetermined: bool


@dataclass(frozen=True, eq=False)
class Fit:
    """
    What a fit comes to.

    Attributes
    ----------
    problem : Problem
        What was fitted, with the cycles of each run.
    parameters : Parameters
        The fitted stand.
    estimates : tuple of Estimate
        The free parameters.
    covariance, correlation : array, shape (free, free)
        In the units of the parameters; not a number where there is none.
    chi_square : float
        Sum of squared residuals; in the square of the largest force where standard errors of
        the points are not known.
    p_value : float or None
        Chance of a larger chi-square if model and standard errors are right; None if unknown.
    noise_n : float or None
        Standard error of the points as estimated from the residuals; None where it is known.
    uncertainty : Uncertainty
        Slopes at the minimum and what follows from them.
    model_n : array, shape (points,)
        Forces of the fitted stand.
    converged, steady : bool
        Whether the search ended by itself; whether all runs had cycles enough.
    searches : tuple of Found
        Where each search ended.
    same, rivals : int
        Searches that ended in this minimum, and in another that is not ruled out.
    evaluations : int
        Stands tried in all searches.
    wall_s : float
        Time it took.

    """

    problem: Problem
    parameters: Parameters
    estimates: tuple[Estimate, ...]
    covariance: Array
    correlation: Array
    chi_square: float
    p_value: float | None
    noise_n: float | None
    uncertainty: Uncertainty
    model_n: Array
    converged: bool
    steady: bool
    searches: tuple[Found, ...]
    same: int
    rivals: int
    evaluations: int
    wall_s: float

    @property
    def reduced_chi_square(self) -> float | None:
        """Chi-square per degree of freedom; None without one."""
        dof = self.uncertainty.dof
        return self.chi_square / dof if dof else None

    @property
    def coordinates(self) -> Array:
        """Coordinates of the minimum."""
        return np.array([z.to_coordinate(e.value) for z, e in self.pairs])

    @property
    def pairs(self) -> list[tuple[Free, Estimate]]:
        """Each free parameter with its estimate."""
        return list(zip(self.problem.free, self.estimates, strict=True))


def fit_drive(
    parameters: Parameters,
    free: tuple[Free, ...],
    points: Points,
    *,
    starts: int = STARTS,
    seed: int = 1,
    workers: int = 0,
    progress: Progress | None = None,
) -> Fit:
    """
    Fit parameters of the drive to measured forces by weighted least squares.

    Parameters
    ----------
    parameters : Parameters
        The stand, as ``choose_free`` returns it.
    free : tuple of Free
        What may change, as ``choose_free`` returns it.
    points : Points
        What was measured.
    starts : int
        Searches: from the present values, and from a Latin hypercube in the bounds.
    seed : int
        Seed of the hypercube.
    workers : int
        Searches at once; 0 is one per core.
    progress : callable, optional
        Called with searches done and searches in all.

    Raises
    ------
    StickSlipError
        If there are too few points, the stand cannot make one of them, or SciPy is missing.

    """
    started_s = time.perf_counter()
    problem = pose(parameters, free, points)
    places = starting_points(problem, starts, seed)
    searches = search_all(problem, places, workers, progress)
    best = min(searches, key=lambda found: found.chi_square)
    problem, refined, steady = _refine(problem, best)
    found = refined[-1] if refined else best
    return _summarise(problem, found, (best, searches, refined), steady, started_s)


def _refine(problem: Problem, best: Found) -> tuple[Problem, list[Found], bool]:
    """Search on from a minimum with more cycles, as long as its runs need them."""
    refined: list[Found] = []
    here = np.array(best.coordinates)
    for _ in range(ROUNDS):
        longer, steady = problem.steady_at(here)
        if longer.cycles == problem.cycles:
            break
        problem = longer
        refined.append(search(problem, here))
        here = np.array(refined[-1].coordinates)
    return problem, refined, steady


def _summarise(
    problem: Problem,
    found: Found,
    history: tuple[Found, Sequence[Found], Sequence[Found]],
    steady: bool,
    started_s: float,
) -> Fit:
    best, searches, refined = history
    place = np.array(found.coordinates)
    doubt = uncertainty(problem, place, found.chi_square)
    values = np.array([one.to_value(float(z)) for one, z in zip(problem.free, place, strict=True)])
    covariance = covariance_of(problem.free, values, doubt.covariance_z)
    scale = doubt.variance_scale
    same = [one for one in searches if same_minimum(problem, one, best, scale)]
    close = [one for one in searches if one.chi_square - best.chi_square <= RIVAL * scale]
    known = problem.points.sigma_n is not None
    return Fit(
        problem=problem,
        parameters=problem.stand(place),
        estimates=_estimates(problem, place, doubt),
        covariance=covariance,
        correlation=correlation_of(doubt.covariance_z),
        chi_square=found.chi_square,
        p_value=_p_value(found.chi_square, doubt.dof) if known and doubt.dof else None,
        noise_n=None if known else float(np.sqrt(scale)) * problem.points.largest_n,
        uncertainty=doubt,
        model_n=problem.forces_n(place),
        converged=found.converged,
        steady=steady,
        searches=tuple(searches),
        same=len(same),
        rivals=len([one for one in close if one not in same]),
        evaluations=sum(one.evaluations for one in (*searches, *refined)),
        wall_s=time.perf_counter() - started_s,
    )


def _estimates(problem: Problem, place: Array, doubt: Uncertainty) -> tuple[Estimate, ...]:
    estimates = []
    for index, free in enumerate(problem.free):
        value = free.to_value(float(place[index]))
        error_z = float(np.sqrt(doubt.covariance_z[index, index]))
        low, high = interval(free, float(place[index]), error_z, doubt.quantile)
        estimates.append(
            Estimate(
                name=free.name,
                unit=free.unit,
                start=free.start,
                lower=free.lower,
                upper=free.upper,
                value=value,
                standard_error=error_z * free.slope(value),
                low=low,
                high=high,
                is_log=free.is_log,
                at_bound=doubt.at_bound[index],
                inert=doubt.inert[index],
                undetermined=doubt.undetermined[index],
            )
        )
    return tuple(estimates)


def _p_value(chi_square: float, dof: int) -> float:
    return float(load_extra(PURPOSE, 'scipy.stats').chi2.sf(chi_square, dof))
