# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""One search for a minimum, from a place; and on from there, with more cycles."""

import math
from collections.abc import Sequence

import numpy as np
from scipy import optimize

from stickslip_ros.arrays import Array
from stickslip_ros.errors import StickSlipError
from stickslip_ros.lab.fitting.problem import Problem
from stickslip_ros.lab.fitting.result import Minimum

_EVALUATIONS_MAX = 60  # steps of a search, from which it is said not to have converged
LOOSE_EVALUATIONS_MAX = 25
TOLERANCE = 1e-6
"""Relative change of sum of squares, or of coordinates, at which a search ends: a thousandth of
a standard error."""
ROUNDS = 6  # searches with ever more cycles, until they suffice at the minimum
FOLLOWED_MAX = 3  # minima of the first searches from which one goes on
APART = 0.05  # coordinates from which two minima are different ones


def search(problem: Problem, start: Array, most: int = _EVALUATIONS_MAX) -> Minimum:
    """Search from coordinates: a bounded trust region, with one-sided differences."""
    place = np.clip(start, *problem.bounds)
    if problem.has_traces and not problem.metrics:
        problem = problem.measured_at(problem.predicted([problem.stand(place)])[0])
    ended = optimize.least_squares(
        problem.residuals,
        place,
        jac=problem.slopes,
        bounds=problem.bounds,
        method='trf',
        x_scale='jac',
        ftol=TOLERANCE,
        xtol=TOLERANCE,
        gtol=TOLERANCE**2,
        max_nfev=most,
    )
    return Minimum(
        tuple(ended.x.tolist()),
        2.0 * float(ended.cost),
        bool(ended.success),
        int(ended.nfev + len(start) * ended.njev),
    )


def search_or_nothing(problem: Problem, start: Array) -> Minimum:
    """Search, and find nothing at a stand that cannot be, unless it is the user's own."""
    most = _EVALUATIONS_MAX if problem.allowance is None else LOOSE_EVALUATIONS_MAX
    try:
        return search(problem, start, most)
    except StickSlipError:
        if np.array_equal(start, problem.start):
            raise
        return Minimum((), math.inf, converged=False, evaluations=0)


def refine(problem: Problem, best: Minimum) -> tuple[Problem, list[Minimum], bool]:
    """Search on from a minimum with more cycles, as long as its runs need them."""
    refined: list[Minimum] = []
    here = best.place
    for _ in range(ROUNDS):
        longer, steady = problem.steady_at(here)
        if longer.experiments == problem.experiments:
            break
        problem = longer
        refined.append(search(problem, here))
        here = refined[-1].place
    return problem, refined, steady


def distinct(searches: Sequence[Minimum], most: int = FOLLOWED_MAX) -> list[Minimum]:
    """Return the first minima that lie apart, the best first."""
    kept = list[Minimum]()
    for each in sorted(searches, key=lambda found: found.chi_square):
        is_new = all(np.max(np.abs(each.place - one.place)) > APART for one in kept)
        if each.coordinates and is_new and len(kept) < most:
            kept.append(each)
    return kept
