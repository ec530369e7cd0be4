# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Errors of a minimum: of the free parameters, together with the constants that a fit assumes.

Each free parameter is taken to be within a factor of ten of its start, each constant within its
stated error; the slopes of the residuals do the rest.

"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm, t

from stickslip_ros.arrays import Array
from stickslip_ros.lab.fitting.assumed import LOAD_FACTOR, TENSION_MAX, slopes_of_constants
from stickslip_ros.lab.fitting.free import TINY, Coordinate
from stickslip_ros.lab.fitting.problem import BOUND, EFFECT, PRIOR, Problem

Flags = NDArray[np.bool_]

LEVEL = 0.95  # confidence of the intervals
QUANTILE_95 = 1.96  # half width of a 95 % interval in standard deviations
_VAGUE = 10.0
"""Standard error before a measurement that shows whether the readings alone determine it."""
UNDETERMINED = 1.0
"""Largest standard error of a determined parameter, in e-folds: slopes do not reach further."""
_FAR = 0.1  # least share of an offset that is extrapolated


class Tension(NamedTuple):
    """A constant from elsewhere, and the value that the readings alone prefer."""

    name: str
    value: float
    share: float  # relative standard error
    preferred: float
    apart: float  # distance in standard errors


@dataclass(frozen=True)
class Estimate(Coordinate):
    """A free parameter with its value and 95 % interval, symmetric about its coordinate."""

    value: float
    # infinite, without an interval, if one of the flags is set
    standard_error: float
    low: float
    high: float
    at_bound: bool
    inert: bool  # without effect on the readings
    undetermined: bool  # exchangeable with others, or known to less than a factor of e


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Errors at a minimum: of the coordinates z of the free parameters, and of the constants."""

    z: Array  # shape (free,)
    sizes: Array  # 1 for a logarithm, else the coordinate, at least 1
    per_natural: Array  # slopes of z by natural coordinates, shape (free, free)
    chi_square: float  # sum of squared residuals, of known parameters too
    dof: int  # degrees of freedom: points less free parameters
    # factor of the covariance: 1 or more with known standard errors of the points, else chi-square
    # per degree of freedom
    variance_scale: float
    # half width of the intervals in standard errors: of the normal distribution with known errors
    # of the points, else of the t distribution
    quantile: float
    # covariance by the recording alone, with exact constants but for the load, shape (free, free)
    shown_z: Array
    recorded_z: Array  # with exact constants and with known parameters, shape (free, free)
    covariance_z: Array  # the same with the errors of the constants
    alone_z: Array  # standard errors by the readings alone, nearly without those before
    at_bound: Flags  # parameters on a bound, shape (free,)
    # how far the readings pull a parameter beyond such a bound, in standard errors, shape (free,)
    excess: Array
    inert: Flags  # parameters without effect
    shares: Mapping[str, float]  # relative errors of the constants, by name
    whole_z: Array  # covariance of z and constants, shape (free + constants, same)
    pulled: Array  # where the readings would move z and the constants, shape (free + constants,)

    @property
    def errors_z(self) -> Array:
        """Standard errors of the coordinates; infinite if unknown."""
        return np.sqrt(np.diag(self.covariance_z))

    @property
    def undetermined(self) -> Flags:
        """Parameters known to less than a factor of e, or than themselves."""
        errors = np.maximum(self.errors_z, self.alone_z)
        return np.asarray(np.isfinite(errors) & (errors > UNDETERMINED * self.sizes))

    @property
    def correlation(self) -> Array:
        """Correlation, shape (free, free); nan for a parameter without a standard error."""
        errors = self.errors_z
        errors = np.where(np.isfinite(errors) & (errors > 0.0), errors, np.nan)
        return np.asarray(self.covariance_z / np.outer(errors, errors))

    def natural(self, covariance_z: Array) -> Array:
        """Return the covariance of natural coordinates; held parameters have no variance."""
        known = np.isfinite(np.diag(covariance_z))
        finite = np.where(np.outer(known, known), covariance_z, 0.0)
        per_z = np.linalg.inv(self.per_natural)
        return np.asarray(per_z @ finite @ per_z.T)

    def is_beyond_errors(self, z: Array) -> bool:
        """Return whether another place lies beyond the errors that the readings leave."""
        errors = np.sqrt(np.diag(self.recorded_z))
        return bool(np.any(np.abs(z - self.z) > QUANTILE_95 * errors))

    def reaching(self, others: Array, rises: Array) -> 'Uncertainty':
        """Widen the intervals to other minima, shape (n, free), by their rises of chi-square."""
        if not len(others):
            return self
        left = np.sqrt(np.maximum(1.0 - rises / QUANTILE_95**2, 0.0))
        around = QUANTILE_95 * left[:, np.newaxis] * self.errors_z
        reach = np.max(np.abs(others - self.z) + around, axis=0)
        return replace(self, covariance_z=_reaching(self.covariance_z, reach))

    def tensions(self, problem: Problem) -> tuple[Tension, ...]:
        """Return the known and the assumed values about which the readings tell."""
        rows, variances = list[tuple[str, float, float, float, float]](), np.diag(self.recorded_z)
        for k, one in enumerate(problem.free):
            if one.name in problem.known:  # with exact constants, as the minimum was sought
                value, share = problem.known[one.name]
                per = one.slope(value) / value
                offset = (self.z[k] - one.to_coordinate(value)) * per
                rows.append((one.name, value, share, variances[k] * per**2, offset))
        values = [one.to_value(z) for one, z in zip(problem.free, self.z.tolist(), strict=True)]
        stand = problem.parameters.updated(dict(problem.experiments[0].settings)).flat()
        left, pulls = np.diag(self.whole_z)[len(values) :], self.pulled[len(values) :]
        for (name, share), variance, pull in zip(self.shares.items(), left, pulls, strict=True):
            rows.append((name, float(stand.get(name, 1.0)), share, variance, pull))
        found = []
        for name, value, share, variance, offset in rows:
            told = 1.0 - variance / share**2
            if told < _FAR and abs(offset) > TENSION_MAX * share:
                told = 1.0  # no linear way leads so far: it is at least where the fit has come to
            if told > variance / UNDETERMINED**2:
                with np.errstate(over='ignore'):
                    preferred = value * float(np.exp(offset / told))
                apart = abs(float(offset)) / (share * math.sqrt(told))
                found.append(Tension(name, value, share, preferred, apart))
        return tuple(found)


def uncertainty(problem: Problem, place: Array, shares: Mapping[str, float]) -> Uncertainty:
    """Return the errors at a minimum; ``shares`` are relative errors of assumed constants."""
    free, z = len(place), problem.natural.back(place)
    per_natural = problem.natural.slopes(place)
    slopes = problem.slopes(place, central=True)[:-free] @ np.linalg.inv(per_natural)
    missed = problem.residuals(place)[:-free]  # without bounds, and what was known before
    chi_square = float(missed @ missed)
    # zero and drift of each trace are fitted too
    is_known, dof = problem.noise.known, problem.count - 2 * len(problem.metrics) - free
    scale = _scale_of(problem, chi_square, dof)
    at_bound = problem.at_bound(place)
    inert = np.sqrt(np.sum(slopes**2, axis=0)) <= EFFECT * problem.signal
    active = np.flatnonzero(~_held(problem, place, at_bound) & ~inert)
    shares = {name: share for name, share in shares.items() if share}
    seen = slopes[:, active]
    if shares:
        constants = slopes_of_constants(problem, place, list(shares))[:-free]
        seen = np.hstack((seen, constants))
    known = len(active)
    readings = seen.T @ seen / scale
    information = readings + np.diag(np.array([*[PRIOR] * known, *shares.values()]) ** -2.0)
    shown = [*range(known), *(known + k for k, name in enumerate(shares) if name == LOAD_FACTOR)]
    of_known = seen[len(seen) - len(problem.known) :, shown]
    alone = information[np.ix_(shown, shown)] - of_known.T @ of_known / scale
    gradient = seen.T @ missed / scale
    starts = np.array([one.to_coordinate(one.start) for one in problem.free])
    gradient[:known] += PRIOR**-2.0 * (z - starts)[active]

    def spread(own: Array) -> Array:
        return _spread(_inverse(own)[:known, :known], [*active], free)

    inner, size = _inverse(information), free + len(shares)
    rows = [*active, *range(free, size)]
    whole_z, pulled = _spread(inner, rows, size), np.zeros(size)
    pulled[rows] = -inner @ gradient
    covariance_z = whole_z[:free, :free]
    errors = np.sqrt(np.diag(covariance_z))
    reach = np.where(np.isfinite(errors), np.abs(pulled[:free]) + QUANTILE_95 * errors, 0.0)
    upper, is_log = 0.5 * (1.0 + LEVEL), [one.is_log for one in problem.free]
    return Uncertainty(
        z=z,
        sizes=np.where(is_log, 1.0, np.maximum(np.abs(z), 1.0)),
        per_natural=per_natural,
        chi_square=chi_square,
        dof=dof,
        variance_scale=scale,
        quantile=float(norm.ppf(upper) if is_known else t.ppf(upper, dof)),
        shown_z=spread(alone),
        recorded_z=spread(information[:known, :known]),
        covariance_z=_reaching(covariance_z, reach),
        alone_z=np.sqrt(np.diag(spread(readings[:known, :known] + _VAGUE**-2.0 * np.eye(known)))),
        at_bound=at_bound,
        excess=_excess(problem, place, slopes, missed, at_bound) / math.sqrt(scale),
        inert=inert & ~at_bound,
        shares=shares,
        whole_z=whole_z,
        pulled=pulled,
    )


def _scale_of(problem: Problem, chi_square: float, dof: int) -> float:
    """Return the factor of the covariance: errors of numbers are given, of traces estimated."""
    if not problem.noise.known:
        return max(chi_square / dof, TINY)
    return max(chi_square / dof, 1.0) if problem.has_traces else 1.0


def _held(problem: Problem, place: Array, at_bound: Flags) -> Flags:
    """Return a mask of the parameters on a bound that is no limit of the model."""
    pairs = zip(problem.free, problem.values(place), at_bound, strict=True)
    return np.array([sits and not one.is_limit(value) for one, value, sits in pairs])


def _excess(
    problem: Problem, place: Array, slopes: Array, missed: Array, at_bound: Flags
) -> Array:
    """Return how far the residuals pull parameters beyond their bounds, in standard errors."""
    is_lower = problem.excess(place, -BOUND) < 0.0
    basis, found = np.linalg.qr(slopes[:, ~at_bound])[0], np.zeros(len(place))
    for number in np.flatnonzero(at_bound):
        alone = slopes[:, number] - basis @ (basis.T @ slopes[:, number])
        pull = float(alone @ missed) / max(float(np.linalg.norm(alone)), TINY)
        found[number] = pull if is_lower[number] else -pull
    return found


def _inverse(information: Array) -> Array:
    """Return the inverse of an information of any units."""
    sizes = np.sqrt(np.diag(information))
    return np.asarray(np.linalg.inv(information / np.outer(sizes, sizes)) / np.outer(sizes, sizes))


def _spread(covariance: Array, rows: list[int], size: int) -> Array:
    """Return a covariance with rows for held coordinates, which have infinite variances."""
    whole = np.full((size, size), np.nan)
    np.fill_diagonal(whole, np.inf)
    whole[np.ix_(rows, rows)] = covariance
    return whole


def _reaching(covariance_z: Array, reach: Array) -> Array:
    """Widen a covariance to 95 % intervals of at least this reach; infinite variances stay."""
    factors = np.maximum(reach / (QUANTILE_95 * np.sqrt(np.diag(covariance_z))), 1.0)
    return np.asarray(covariance_z * np.outer(factors, factors))


def estimates_of(problem: Problem, doubt: Uncertainty) -> tuple[Estimate, ...]:
    """Return the free parameters at a minimum with their errors and intervals."""
    estimates = list[Estimate]()
    for number, one in enumerate(problem.free):
        z, error_z = float(doubt.z[number]), float(doubt.errors_z[number])
        value, is_vague = one.to_value(z), bool(doubt.undetermined[number])
        low = high = math.nan
        if math.isfinite(error_z) and not is_vague:
            low, high = (one.to_value(z + way * doubt.quantile * error_z) for way in (-1.0, 1.0))
            # Twice a roughness is as likely as half of it.
            if not one.is_log and 0.0 < error_z < z:
                high = max(high, min(value * math.exp(doubt.quantile * error_z / z), one.upper))
        estimates.append(
            Estimate(
                **vars(one),
                value=value,
                standard_error=math.inf if is_vague else error_z * one.slope(value),
                low=low,
                high=high,
                at_bound=bool(doubt.at_bound[number]),
                inert=bool(doubt.inert[number]),
                undetermined=is_vague,
            )
        )
    return tuple(estimates)
