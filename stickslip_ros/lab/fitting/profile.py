# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Chi-square over a grid of strongly curved parameters; the others follow.

After a fall a piezo rings and an amplifier settles within microseconds, which sensors of tens of
kilohertz see as one number: resonance and bandwidth lie in a narrow, curved valley. At each place
of the grid the others follow by their slopes at the minimum.

"""

import itertools
from dataclasses import dataclass

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.drive.long_step import LANES
from stickslip_ros.lab.fitting.problem import Problem

GRID = {'actuator.resonance': (5e4, 6e5, 26), 'amplifier.bandwidth': (6e4, 1.2e6, 7)}
"""Lowest and highest value of the grid, and its number of values."""
_APART = 0.3  # least distance of starts of further searches, in coordinates
_RANK = 1e-8  # least singular value, per largest, of the other parameters


@dataclass(frozen=True, eq=False)
class ChiSquareGrid:
    """Chi-square on a grid of some free parameters."""

    places: Array  # coordinates, with the others as they follow, shape (m, free)
    chi_square: Array  # to first order in the others, shape (m,)
    errors: Array  # standard errors of the others at a place, 0 for the grid, shape (free,)

    def best(self, count: int) -> list[Array]:
        """Return distant places, the best first."""
        kept = list[Array]()
        for place in self.places[np.argsort(self.chi_square)]:
            if all(np.max(np.abs(place - each)) > _APART for each in kept):
                kept.append(place)
        return kept[:count]

    def range_of(self, number: int, rise: float) -> tuple[float, float]:
        """Return the range of a coordinate with chi-square within a rise of its least value."""
        left = rise - (self.chi_square - self.chi_square.min())
        inside = self.places[left >= 0.0, number]
        around = self.errors[number] * np.sqrt(left[left >= 0.0])
        return float(np.min(inside - around)), float(np.max(inside + around))


def profile(problem: Problem, place: Array) -> ChiSquareGrid | None:
    """Return the grid around a place with the metrics of the problem; None without a grid."""
    axes = {
        number: np.log(np.geomspace(*GRID[one.name]))
        for number, one in enumerate(problem.free)
        if one.name in GRID and one.is_log and problem.has_traces
    }
    if not axes:
        return None
    others = [k for k in range(len(place)) if k not in axes]
    slopes = problem.slopes(place)[:, others]
    basis, triangle = np.linalg.qr(slopes)
    inverse = np.linalg.pinv(triangle, rcond=_RANK)
    errors = np.zeros(len(place))
    errors[others] = np.sqrt(np.sum(inverse**2, axis=1))
    lower, upper = problem.bounds
    grid = list[Array]()
    for chosen in itertools.product(*axes.values()):
        there = place.copy()
        there[list(axes)] = chosen
        grid.append(np.clip(there, lower, upper))
    places, missed = list[Array](), list[float]()
    for first in range(0, len(grid), LANES):
        some = grid[first : first + LANES]
        found = problem.predicted([problem.stand(each) for each in some])
        for there, each in zip(some, found, strict=True):
            residual = problem.whitened(each, None, there)
            along = basis.T @ residual
            follows = there.copy()
            follows[others] -= inverse @ along
            places.append(np.clip(follows, lower, upper))
            missed.append(float(residual @ residual - along @ along))
    return ChiSquareGrid(np.array(places), np.array(missed), errors)
