# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Search a minimum from a place, and continue with more cycles or along a valley."""

import dataclasses
import math
from collections.abc import Sequence

import numpy as np
from scipy import optimize

from stickslip_ros.arrays import Array
from stickslip_ros.errors import StickSlipError
from stickslip_ros.lab.fitting.problem import Problem
from stickslip_ros.lab.fitting.result import Minimum, best_of

_EVALUATIONS_MAX = 60  # most steps of a search that converges
LOOSE_EVALUATIONS_MAX = 25
TOLERANCE = 1e-6
"""Relative change of sum of squares, or of coordinates, that ends a search: a thousandth of a
standard error."""
ROUNDS = 6  # most searches with more cycles, until they suffice at the minimum
FOLLOWED_MAX = 3  # most minima of the first searches that are continued
VALLEY, BLIND = 100.0, 1e4
"""Least condition number of a valley, and the largest that still shows its direction."""
_WALKS = 6  # most places in a valley, each lower than the place before
_LOWER = 0.3  # least fall of chi-square to the next place
APART = 0.05  # least distance of two minima, in coordinates


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
    """Search; return an empty minimum at an impossible stand, but refuse that of the user."""
    most = _EVALUATIONS_MAX if problem.allowance is None else LOOSE_EVALUATIONS_MAX
    try:
        return search(problem, start, most)
    except StickSlipError:
        if np.array_equal(start, problem.start):
            raise
        return Minimum((), math.inf, converged=False, evaluations=0)


def refine(problem: Problem, best: Minimum) -> tuple[Problem, list[Minimum], bool]:
    """Continue from a minimum with more cycles as long as its runs need them."""
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


def along_valley(problem: Problem, here: Minimum) -> tuple[Problem, list[Minimum]]:
    """
    Continue from a standard error to both sides of a minimum as long as chi-square falls.

    Friction, roughness, mass and damping under one preload lie in a curved valley with a rough
    floor, by some tenths of chi-square, and a search may end before its minimum. Nine parameters
    of the realistic stand stopped 10 above it, with a roughness 4 standard errors off.

    """
    found, start = list[Minimum](), here
    for _ in range(_WALKS):
        slopes = problem.slopes(here.place, central=True)
        lengths = np.maximum(np.sqrt(np.sum(slopes**2, axis=0)), np.finfo(np.float64).tiny)
        _, values, ways = np.linalg.svd(np.linalg.qr(slopes / lengths, mode='r'))
        if not VALLEY < values[0] / max(values[-1], values[0] / (2.0 * BLIND)) < BLIND:
            break
        step = ways[-1] / (values[-1] * lengths)
        step /= max(1.0, float(np.max(np.abs(step))))
        beside = dataclasses.replace(problem, metrics=())
        ends = [search_or_nothing(beside, here.place + way) for way in (step, -step)]
        lowest = best_of(ends)
        if not lowest.chi_square < here.chi_square - _LOWER:
            break
        here = lowest
        found.append(here)
        problem = problem.measured_at(problem.predicted([problem.stand(here.place)])[0])
    if here is not start:
        found.append(search(problem, here.place))
    return problem, found


def distinct(searches: Sequence[Minimum], most: int = FOLLOWED_MAX) -> list[Minimum]:
    """Return distant minima, the best first."""
    kept = list[Minimum]()
    for each in sorted(searches, key=lambda found: found.chi_square):
        is_new = all(np.max(np.abs(each.place - one.place)) > APART for one in kept)
        if each.coordinates and is_new and len(kept) < most:
            kept.append(each)
    return kept
