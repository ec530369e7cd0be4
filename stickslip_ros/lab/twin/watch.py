# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A test of changed parameters of a rig, with a stated rate of false alarms.

Each look gives estimates z with covariance C. Successive looks share errors to an unknown degree,
so a sum of looks, as in CUSUM, is not used. Each look is tested against the first ones, at its
share of the allowed rate, which then holds for any correlation. With z0 the median of the first
looks, d = z - z0, and W the inverse of the sum of the covariances of two looks,

    T_j = (W d)_j^2 / W_jj

is the fall of chi-square if parameter j alone has changed (Rao's score): without a change,
chi-square with one degree of freedom. A change is reported if the same T is the largest and above
the limit in two successive looks, as a single look may contain a knock. If the rest of chi-square
is above chance, no parameter alone has changed. Errors are enlarged, never reduced, to the scatter
of the looks.

"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.special import chdtri, fdtri

from stickslip_ros.arrays import Array

_FIRST_LOOKS = 3  # looks of the baseline
_TRUST = 4.0  # weight of the stated errors, in looks, against their scatter
_DAY_S = 86400.0
_LEFT_CHANCE = 1e-4  # least chance of the rest of chi-square after a change of one parameter
_LEFT_SHARE = 0.05  # largest rest after a large change of one parameter, per T
ELSE = -1
"""Result for a change that no single parameter explains."""


class LookEstimate(NamedTuple):
    """Estimate of a look: coordinates, shape (n,), and covariance, shape (n, n)."""

    place: Array
    covariance: Array


@dataclass
class Watch:
    """A test of looks ``period_s`` apart, with at most ``alarms_per_day`` false alarms."""

    period_s: float
    alarms_per_day: float

    def __post_init__(self) -> None:
        self._first: list[LookEstimate] = []
        # sum of squares and count of looks without a change, per coordinate
        self._squares, self._counted = 0.0, 0
        self._suspect: int | None = None

    @property
    def start(self) -> LookEstimate:
        """The baseline: medians of the first looks, with the error of one look."""
        places, covariances = zip(*self._first, strict=True)
        return LookEstimate(np.median(places, axis=0), np.mean(covariances, axis=0))

    @property
    def has_begun(self) -> bool:
        return len(self._first) >= _FIRST_LOOKS

    def limit(self, count: int) -> float:
        """Return the limit of T for a number of coordinates."""
        chance = min(self.alarms_per_day * self.period_s / _DAY_S, 0.5) / count
        freedom = count * (_TRUST + self._counted)
        return float(fdtri(1, freedom, 1.0 - chance))  # quantile of F

    def scores(self, look: LookEstimate) -> tuple[Array, float, float]:
        """Return T of each coordinate, T of all together, and the factor applied to both."""
        start = self.start
        weight = np.linalg.inv(look.covariance + start.covariance)
        along = weight @ (look.place - start.place)
        count = len(look.place)
        shown = (count * _TRUST + self._squares) / (count * (_TRUST + self._counted))
        factor = 1.0 / max(1.0, shown)
        whole = float((look.place - start.place) @ along)
        return factor * along**2 / np.diag(weight), factor * whole, factor

    def is_suspect(self, look: LookEstimate) -> bool:
        """Return whether this look alone exceeds the limit."""
        if not self.has_begun:
            return False
        scores, _, _ = self.scores(look)
        return bool(scores.max() > self.limit(len(scores)))

    def changed(self, look: LookEstimate) -> int | None:
        """Return the changed coordinate, or ELSE; None without a change."""
        if not self.has_begun:
            self._first.append(look)
            if self.has_begun:  # the scatter of three looks counts as two looks
                ways = [each.place for each in self._first]
                ways -= np.mean(ways, axis=0)
                weight = np.linalg.inv(self.start.covariance)
                self._squares = float(np.einsum('ki,ij,kj', ways, weight, ways))
                self._counted = _FIRST_LOOKS - 1
            return None
        scores, whole, factor = self.scores(look)
        worst, before, others = int(np.argmax(scores)), self._suspect, len(scores) - 1
        most = max(chdtri(max(others, 1), _LEFT_CHANCE), _LEFT_SHARE * scores[worst])
        if others and whole - scores[worst] > most:
            worst = ELSE
        self._suspect = worst if scores.max() > self.limit(len(scores)) else None
        if self._suspect is None:
            self._squares, self._counted = self._squares + whole / factor, self._counted + 1
            return None
        return worst if before == worst else None
