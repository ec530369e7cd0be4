"""
Whether the intervals of a fit hold what they promise, by fitting synthetic data again.

The fitted stand is taken for the truth; noise of the standard error of the points is added to its
forces; every data set is fitted anew, from the same start as the first. The truth must lie in
95 % of the intervals.

"""

import dataclasses
from dataclasses import dataclass
from functools import partial

import numpy as np

from stickslip_ros.contact.profile import Array
from stickslip_ros.errors import OutOfRange
from stickslip_ros.study.batch import Progress, run_batch
from stickslip_ros.study.extras import load_extra
from stickslip_ros.study.fitting.fit import Fit
from stickslip_ros.study.fitting.problem import Problem
from stickslip_ros.study.fitting.search import PURPOSE, search
from stickslip_ros.study.fitting.statistics import LEVEL, interval, uncertainty
from stickslip_ros.study.journal import Row

SETS_MIN, SETS_MAX = 2, 100_000


@dataclass(frozen=True)
class Coverage:
    """
    How often the interval of a parameter held the truth.

    Attributes
    ----------
    name : str
        The parameter.
    truth : float
        Its value in the synthetic data.
    inside, sets : int
        Intervals that held it, and synthetic data sets.
    share_low, share_high : float
        95 % interval of the coverage itself (Clopper and Pearson).
    bias : float
        Mean of the estimates less the truth, in coordinates, per their standard deviation.
    spread_ratio : float
        Standard deviation of the estimates per root mean square standard error, in coordinates.

    """

    name: str
    truth: float
    inside: int
    sets: int
    share_low: float
    share_high: float
    bias: float
    spread_ratio: float


def coverage_of(
    fit: Fit, sets: int, *, seed: int = 1, workers: int = 0, progress: Progress | None = None
) -> tuple[Coverage, ...]:
    """
    Fit synthetic data sets and count the intervals that hold the truth.

    Parameters
    ----------
    fit : Fit
        Gives the truth, the points, the noise and the start of the searches.
    sets : int
        Synthetic data sets.
    seed : int
        Seed of the noise; data set i has a stream of its own.
    workers, progress
        As of ``run_batch``.

    Raises
    ------
    OutOfRange
        If the number of data sets is none.

    """
    if not SETS_MIN <= sets <= SETS_MAX:
        limit = f'not from {SETS_MIN} to {SETS_MAX}'
        raise OutOfRange('number of synthetic data sets', sets, '', limit, 'change it')
    rows = run_batch(
        partial(_refit, fit.problem, fit.model_n, _noise_n(fit), fit.coordinates, seed),
        range(sets),
        workers=workers,
        progress=progress,
    )
    return tuple(
        _count(one.name, one.value, rows, index) for index, one in enumerate(fit.estimates)
    )


def synthetic(problem: Problem, model_n: Array, noise_n: Array, seed: int, number: int) -> Problem:
    """Return a problem whose measured forces are those of a model with noise."""
    noise = np.random.default_rng([seed, number]).standard_normal(len(model_n))
    points = dataclasses.replace(problem.points, force_n=model_n + noise_n * noise)
    return dataclasses.replace(problem, points=points)


def _noise_n(fit: Fit) -> Array:
    sigma_n = fit.problem.points.sigma_n
    return np.full(len(fit.model_n), fit.noise_n) if sigma_n is None else sigma_n


def _refit(
    problem: Problem, model_n: Array, noise_n: Array, truth: Array, seed: int, number: int
) -> Row:
    again = synthetic(problem, model_n, noise_n, seed, number)
    found = search(again, again.start)
    place = np.array(found.coordinates)
    doubt = uncertainty(again, place, found.chi_square)
    row: Row = {}
    for index, free in enumerate(again.free):
        error_z = float(np.sqrt(doubt.covariance_z[index, index]))
        low, high = interval(free, float(place[index]), error_z, doubt.quantile)
        true = free.to_value(float(truth[index]))
        row[f'inside_{index}'] = bool(np.isfinite(error_z) and low <= true <= high)
        row[f'missed_{index}'] = float(place[index] - truth[index])
        row[f'error_{index}'] = error_z
    return row


def _count(name: str, truth: float, rows: list[Row], index: int) -> Coverage:
    inside = sum(bool(row[f'inside_{index}']) for row in rows)
    missed = np.array([float(row[f'missed_{index}']) for row in rows])
    errors = np.array([float(row[f'error_{index}']) for row in rows])
    errors = errors[np.isfinite(errors)]
    rms_error = float(np.sqrt(np.mean(errors**2))) if len(errors) else 0.0
    deviation = float(np.std(missed, ddof=1))
    low, high = binomial_interval(inside, len(rows))
    return Coverage(
        name=name,
        truth=truth,
        inside=inside,
        sets=len(rows),
        share_low=low,
        share_high=high,
        bias=float(np.mean(missed)) / deviation if deviation else 0.0,
        spread_ratio=deviation / rms_error if rms_error else float('nan'),
    )


def binomial_interval(hits: int, trials: int) -> tuple[float, float]:
    """Return the 95 % interval of a share of which some trials are hits (Clopper and Pearson)."""
    beta = load_extra(PURPOSE, 'scipy.stats').beta
    tail = 0.5 * (1.0 - LEVEL)
    low = float(beta.ppf(tail, hits, trials - hits + 1)) if hits else 0.0
    high = float(beta.ppf(1.0 - tail, hits + 1, trials - hits)) if hits < trials else 1.0
    return low, high
