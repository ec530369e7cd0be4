# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Bands of numbers over random stands that fit the data equally well."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri

from stickslip_ros.arrays import Array
from stickslip_ros.lab.runs.batch import Progress, run_courses
from stickslip_ros.lab.runs.courses import Course, bundle_for
from stickslip_ros.parameters import Parameters

BAND_DRAWS = 100  # random stands per band
LEVELS: Mapping[str, float] = {
    'low_95': 0.025,
    'low_68': 0.16,
    'middle': 0.5,
    'high_68': 0.84,
    'high_95': 0.975,
}
"""Quantiles: ends of the bands of 95 and 68 % of the draws, and the median."""


def band_of(values: ArrayLike) -> dict[str, float]:
    """Return the quantiles of a number over draws, shape (draws,)."""
    found = np.quantile(np.asarray(values, dtype=np.float64), list(LEVELS.values()))
    return dict(zip(LEVELS, found.tolist(), strict=True))


def bands_with_noise(values: ArrayLike, middle: Array, noise: ArrayLike) -> dict[str, Array]:
    """Return bands of readings, shapes (n,), from draws (draws, n) and noise, (n,) or ()."""
    ends, shares = {}, list(LEVELS.values())
    quantiles = np.quantile(np.asarray(values), shares, axis=0)
    for name, share, end in zip(LEVELS, shares, quantiles, strict=True):
        beyond = np.hypot(end - middle, ndtri(share) * np.asarray(noise))
        ends[name] = middle + np.sign(share - 0.5) * beyond
    return ends


def bands_over(
    draws: Sequence[Parameters],
    course_of: Callable[[Parameters], Course[dict[str, float]]],
    workers: int = 0,
    progress: Progress | None = None,
) -> dict[str, dict[str, float]]:
    """Run a course for each draw; return the bands of its numbers by name."""
    rows = run_courses(course_of, draws, bundle_for(draws[0]), workers=workers, progress=progress)
    return {name: band_of([row[name] for row in rows]) for name in rows[0]}
