"""The search for the least squares, from one starting point or from many."""

from dataclasses import dataclass
from functools import partial

import numpy as np

from stickslip_ros.contact.profile import Array
from stickslip_ros.errors import OutOfRange, StickSlipError
from stickslip_ros.study.batch import Progress, run_batch
from stickslip_ros.study.extras import load_extra
from stickslip_ros.study.fitting.problem import Problem
from stickslip_ros.study.journal import Row

PURPOSE = 'a fit'
TOLERANCE = 1e-6
"""Relative change of sum of squares, or of coordinates, at which a search ends: a thousandth of
a standard error."""
EVALUATIONS_MAX = 60
"""Steps of a search, from which it is said not to have converged."""
STARTS_MAX = 1000
SAME_CHANGE = 0.01
"""Change of chi-square, per its scale, within which two searches found the same minimum."""
SAME_SHARE = 1e-10
"""The same as a share of the sum of squares of the data, for data without noise."""


@dataclass(frozen=True)
class Found:
    """
    Where a search ended.

    Attributes
    ----------
    coordinates : tuple of float
        The minimum; empty if the search came to a stand that cannot be.
    chi_square : float
        Sum of squared residuals there.
    converged : bool
        Whether the search ended by itself.
    evaluations : int
        Stands tried.

    """

    coordinates: tuple[float, ...]
    chi_square: float
    converged: bool
    evaluations: int


def search(problem: Problem, start: Array) -> Found:
    """
    Go downhill from a starting point: a bounded trust region, with differences to one side.

    Parameters
    ----------
    problem : Problem
        What to fit.
    start : array, shape (free,)
        Coordinates of the start.

    """
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
    return Found(
        tuple(ended.x.tolist()),
        2.0 * float(ended.cost),
        bool(ended.success),
        int(ended.nfev + len(start) * ended.njev),
    )


def starting_points(problem: Problem, starts: int, seed: int) -> list[Array]:
    """
    Return the present values, and a Latin hypercube in the bounds.

    Raises
    ------
    OutOfRange
        If there is no start, or are too many.

    """
    if not 1 <= starts <= STARTS_MAX:
        limit = f'not from 1 to {STARTS_MAX}'
        raise OutOfRange('number of starts', starts, '', limit, 'change --starts')
    first = problem.start
    if starts == 1:
        return [first]
    qmc = load_extra(PURPOSE, 'scipy.stats').qmc
    shares = qmc.LatinHypercube(d=len(first), seed=seed).random(starts - 1)
    return [first, *qmc.scale(shares, *problem.bounds)]


def search_all(
    problem: Problem, starts: list[Array], workers: int = 0, progress: Progress | None = None
) -> list[Found]:
    """
    Search from many starting points at once.

    Returns
    -------
    list of Found
        In the order of the starts. One that came to a stand that cannot be has no place.

    Raises
    ------
    StickSlipError
        If not even the first start led anywhere.

    """
    task = partial(_search_row, problem)
    rows = run_batch(task, starts, workers=workers, progress=progress)
    return [_found(row, len(problem.free)) for row in rows]


def same_minimum(problem: Problem, one: Found, other: Found, scale: float) -> bool:
    """Tell whether two searches ended in the same minimum; ``scale`` is that of chi-square."""
    points = problem.points
    least = SAME_SHARE * float(np.sum((points.force_n / points.scale_n) ** 2))
    return abs(one.chi_square - other.chi_square) <= SAME_CHANGE * scale + least


def _search_row(problem: Problem, start: Array) -> Row:
    try:
        found = search(problem, start)
    except StickSlipError:
        if np.array_equal(start, problem.start):
            raise
        return {'chi_square': float('inf'), 'converged': False, 'evaluations': 0}
    places = {f'coordinate_{index}': z for index, z in enumerate(found.coordinates)}
    return {
        'chi_square': found.chi_square,
        'converged': found.converged,
        'evaluations': found.evaluations,
        **places,
    }


def _found(row: Row, free: int) -> Found:
    names = [f'coordinate_{index}' for index in range(free)]
    return Found(
        tuple(float(row[name]) for name in names if name in row),
        float(row['chi_square']),
        bool(row['converged']),
        int(row['evaluations']),
    )
