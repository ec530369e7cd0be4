# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Whether the parameters of a rig have changed: a test with a stated rate of false alarms.

Each look gives estimates z with the covariance C of their honest errors, which successive windows
share in part: how much is not known. So looks are not summed up, as CUSUM does: each one is tested
against the first looks for itself, at the chance that a look may have of a false alarm. The
expected number of these is then below that rate however errors are correlated. With z0 the
median of the first looks, d = z - z0 and W the inverse of the sum of the covariances of two looks,

    T_j = (W d)_j^2 / W_jj

is by how much chi-square falls if parameter j alone has changed (Rao's score): of chance alone,
chi-square with one degree of freedom for each j. That j has changed whose T is largest and too
large twice in succession, for one window may hold a knock. Errors that looks show to be larger
than stated, the first ones by how they scatter, count as the looks show them, never as smaller.

"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.stats import f

from stickslip_ros.arrays import Array

_FIRST_LOOKS = 3
"""Looks that make the start."""
_TRUST = 4.0
"""Looks by which the stated size of the errors is believed against what the looks show."""
_DAY_S = 86400.0


class Watched(NamedTuple):
    """What a look found: coordinates, shape (n,), and their covariance, shape (n, n)."""

    place: Array
    covariance: Array


@dataclass
class Watch:
    """
    Watches the coordinates of some parameters.

    Parameters
    ----------
    period_s : float
        Time from one look to the next.
    alarms_per_day : float
        False alarms a day that are allowed.

    """

    period_s: float
    alarms_per_day: float

    def __post_init__(self) -> None:
        self._first: list[Watched] = []
        # of the first looks about their mean, and of changes that were none, per coordinate
        self._squares, self._counted = 0.0, 0
        self._suspect: int | None = None

    @property
    def start(self) -> Watched:
        """The medians of the first looks, of which one may be off, with the error of a look."""
        places, covariances = zip(*self._first, strict=True)
        return Watched(np.median(places, axis=0), np.mean(covariances, axis=0))

    @property
    def has_begun(self) -> bool:
        """Whether the start is known, so that a change can be seen."""
        return len(self._first) >= _FIRST_LOOKS

    def limit(self, count: int) -> float:
        """Return the limit of T for so many coordinates, by the rate of false alarms."""
        chance = min(self.alarms_per_day * self.period_s / _DAY_S, 0.5) / count
        freedom = count * (_TRUST + self._counted)
        return float(f.isf(chance, 1, freedom))

    def scores(self, look: Watched) -> tuple[Array, float]:
        """Return T of each coordinate, and by how much chi-square falls if all have changed."""
        start = self.start
        weight = np.linalg.inv(look.covariance + start.covariance)
        along = weight @ (look.place - start.place)
        count = len(look.place)
        shown = (count * _TRUST + self._squares) / (count * (_TRUST + self._counted))
        scores = along**2 / np.diag(weight) / max(1.0, shown)
        return scores, float((look.place - start.place) @ along)

    def is_suspect(self, look: Watched) -> bool:
        """Return whether a look alone says that something has changed."""
        if not self.has_begun:
            return False
        scores, _ = self.scores(look)
        return bool(scores.max() > self.limit(len(scores)))

    def changed(self, look: Watched) -> int | None:
        """Return which coordinate has changed since the start; None if none has."""
        if not self.has_begun:
            self._first.append(look)
            if self.has_begun:  # they scatter about their mean as two changes that are none do
                ways = [each.place for each in self._first]
                ways -= np.mean(ways, axis=0)
                weight = np.linalg.inv(self.start.covariance)
                self._squares = float(np.einsum('ki,ij,kj', ways, weight, ways))
                self._counted = _FIRST_LOOKS - 1
            return None
        scores, square = self.scores(look)
        worst, before = int(np.argmax(scores)), self._suspect
        self._suspect = worst if scores[worst] > self.limit(len(scores)) else None
        if self._suspect is None:
            self._squares, self._counted = self._squares + square, self._counted + 1
            return None
        return worst if before == worst else None
