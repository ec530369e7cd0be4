"""
The coverage of the intervals of a fit, measured by fitting synthetic data.

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
from stickslip_ros.extras import load_extra
from stickslip_ros.fitting.fit import Fit, search
from stickslip_ros.fitting.statistics import LEVEL, PURPOSE, estimates_of, uncertainty
from stickslip_ros.runs.batch import Progress, run_batch

SETS_MIN, SETS_MAX = 2, 100_000


@dataclass(frozen=True)
class Coverage:
    """How often the interval of a parameter contained the truth."""

    name: str  # the parameter
    truth: float  # its value in the synthetic data
    inside: int  # intervals that held it, and synthetic data sets
    sets: int
    share_low: float  # 95 % interval of the coverage itself (Clopper and Pearson)
    share_high: float
    # mean of the estimates less the truth, in coordinates, per their standard deviation
    bias: float
    # standard deviation of the estimates per root mean square standard error, in coordinates
    spread_ratio: float


def coverage_of(
    fit: Fit, sets: int, *, seed: int = 1, workers: int = 0, progress: Progress | None = None
) -> tuple[Coverage, ...]:
    """Fit synthetic data sets, each with its noise; count the intervals that contain the truth."""
    if not SETS_MIN <= sets <= SETS_MAX:
        limit = f'not from {SETS_MIN} to {SETS_MAX}'
        raise OutOfRange('number of synthetic data sets', sets, '', limit, 'change it')
    truth = np.array([one.to_coordinate(one.value) for one in fit.estimates])
    task = partial(_refit, fit, truth, seed)
    rows = np.array(run_batch(task, range(sets), workers=workers, progress=progress))
    coverages = []
    for index, one in enumerate(fit.estimates):
        inside, missed, errors = rows[:, :, index].T
        errors = errors[np.isfinite(errors)]
        rms_error = float(np.sqrt(np.mean(errors**2))) if len(errors) else 0.0
        deviation = float(np.std(missed, ddof=1))
        hits = int(np.sum(inside))
        low, high = binomial_interval(hits, sets)
        coverages.append(
            Coverage(
                name=one.name,
                truth=one.value,
                inside=hits,
                sets=sets,
                share_low=low,
                share_high=high,
                bias=float(np.mean(missed)) / deviation if deviation else 0.0,
                spread_ratio=deviation / rms_error if rms_error else float('nan'),
            )
        )
    return tuple(coverages)


def binomial_interval(hits: int, trials: int) -> tuple[float, float]:
    """Return the 95 % interval of a share of which some trials are hits (Clopper and Pearson)."""
    beta = load_extra(PURPOSE, 'scipy.stats').beta
    tail = 0.5 * (1.0 - LEVEL)
    low = float(beta.ppf(tail, hits, trials - hits + 1)) if hits else 0.0
    high = float(beta.ppf(1.0 - tail, hits + 1, trials - hits)) if hits < trials else 1.0
    return low, high


def _refit(fit: Fit, truth: Array, seed: int, number: int) -> Array:
    """
    Fit the forces of the model with noise in place of the measured ones.

    Return whether the truth is inside, by how much it is missed, and the error of that.

    """
    points = fit.problem.points
    noise_n = np.sqrt(fit.uncertainty.variance_scale) * points.scale_n
    noise = np.random.default_rng([seed, number]).standard_normal(len(points))
    noisy = dataclasses.replace(points, force_n=fit.model_n + noise_n * noise)
    again = dataclasses.replace(fit.problem, points=noisy)
    found = search(again, again.start)
    doubt = uncertainty(again, found.place, found.chi_square)
    estimates = estimates_of(again, found.place, doubt)
    inside = [
        np.isfinite(one.standard_error) and one.low <= one.to_value(z) <= one.high
        for one, z in zip(estimates, truth.tolist(), strict=True)
    ]
    return np.array([inside, found.place - truth, doubt.errors_z])
