# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""What is not known of a stand, carried on: bands of numbers over stands that are as likely."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri

from stickslip_ros.arrays import Array
from stickslip_ros.lab.runs.batch import Progress, run_courses
from stickslip_ros.lab.runs.courses import Course, bundle_for
from stickslip_ros.parameters import Parameters

BAND_DRAWS = 100  # stands of a band
LEVELS: Mapping[str, float] = {
    'low_95': 0.025,
    'low_68': 0.16,
    'middle': 0.5,
    'high_68': 0.84,
    'high_95': 0.975,
}
"""Ends of the bands that hold 95 and 68 % of the draws, and their median."""


def band_of(values: ArrayLike) -> dict[str, float]:
    """Return the ends of the bands of a number over draws, shape (draws,)."""
    found = np.quantile(np.asarray(values, dtype=np.float64), list(LEVELS.values()))
    return dict(zip(LEVELS, found.tolist(), strict=True))


def bands_with_noise(values: ArrayLike, middle: Array, noise: ArrayLike) -> dict[str, Array]:
    """
    Return the ends of the bands within which readings are expected, shapes (n,).

    Parameters
    ----------
    values : array_like, shape (draws, n)
        What the draws say.
    middle : array, shape (n,)
        What the stand says that they are drawn about.
    noise : array_like, shape (n,) or ()
        Standard deviation of the readings, normal.

    """
    ends = {}
    for (name, share), end in zip(
        LEVELS.items(), np.quantile(np.asarray(values), list(LEVELS.values()), axis=0), strict=True
    ):
        beyond = np.hypot(end - middle, ndtri(share) * np.asarray(noise))
        ends[name] = middle + np.sign(share - 0.5) * beyond
    return ends


def bands_over(
    draws: Sequence[Parameters],
    course_of: Callable[[Parameters], Course[dict[str, float]]],
    workers: int = 0,
    progress: Progress | None = None,
) -> dict[str, dict[str, float]]:
    """
    Return the bands of numbers over draws, by their names.

    Parameters
    ----------
    draws : sequence of Parameters
        Stands that are as likely as what is known.
    course_of : callable
        Returns the course of a stand, which ends with its numbers by name.
    workers : int
        Runs at once; 0 is one per core.
    progress : callable, optional
        Called with draws done and in all.

    """
    rows = run_courses(course_of, draws, bundle_for(draws[0]), workers=workers, progress=progress)
    return {name: band_of([row[name] for row in rows]) for name in rows[0]}
