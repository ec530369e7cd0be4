# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Errors at a minimum: of the free parameters, together with the constants that a fit assumes.

The prior of a free parameter is a factor of ten about its start, that of a constant its stated
error; the slopes of the residuals give the errors.

"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import compress
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import optimize
from scipy.special import ndtr, ndtri, stdtrit

from stickslip_ros.arrays import Array
from stickslip_ros.lab.fitting.assumed import (
    LOAD_FACTOR,
    SHOWN,
    TENSION_MAX,
    slopes_of_constants,
    value_of,
)
from stickslip_ros.lab.fitting.free import LOAD, TINY, Coordinate
from stickslip_ros.lab.fitting.missing import Missing
from stickslip_ros.lab.fitting.problem import BOUND, EFFECT, PRIOR, Problem

Flags = NDArray[np.bool_]

LEVEL = 0.95  # confidence of the intervals
QUANTILE_95 = 1.96  # half width of a 95 % interval in standard deviations
_VAGUE = 10.0
"""Wide prior error: it shows whether the readings alone determine a parameter."""
UNDETERMINED = 1.0
"""Largest standard error of a determined parameter, in e-folds: beyond, slopes do not hold."""
_FAR = 0.1  # least information share from which a preferred value is extrapolated


class Tension(NamedTuple):
    """A known or assumed value, and the value that the readings alone prefer."""

    name: str
    value: float
    share: float  # relative standard error
    preferred: float
    apart: float  # distance in standard errors


@dataclass(frozen=True)
class Estimate(Coordinate):
    """A free parameter with its value and 95 % interval, symmetric about its coordinate."""

    value: float
    # infinite, without an interval, if any flag below is set
    standard_error: float
    low: float
    high: float
    at_bound: bool
    inert: bool  # without effect on the readings
    undetermined: bool  # compensated by others, or with an error above a factor of e


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Errors at a minimum: of the coordinates z of the free parameters, and of the constants."""

    z: Array  # shape (free,)
    sizes: Array  # 1 for a logarithm, else the coordinate or 1, whichever is larger
    per_natural: Array  # slopes of z by natural coordinates, shape (free, free)
    chi_square: float  # sum of squared residuals, of known parameters too
    dof: int  # degrees of freedom: points less free parameters
    variance_scale: float  # factor of the covariance, 1 or more
    # half width of the intervals in standard errors: by the normal distribution if the points have
    # known errors, else by the t distribution
    quantile: float
    # covariance by the recording alone, with all constants but SHOWN exact, shape (free, free)
    shown_z: Array
    recorded_z: Array  # with exact constants and with known parameters, shape (free, free)
    alone_z: Array  # standard errors by the readings alone, with a wide prior, shape (free,)
    at_bound: Flags  # parameters on a bound, shape (free,)
    # pull of the readings on a parameter beyond its bound, in standard errors, shape (free,)
    excess: Array
    inert: Flags  # parameters without effect
    shares: Mapping[str, float]  # relative errors of the constants, by name
    whole_z: Array  # covariance of z and constants, shape (free + constants, same)
    pulled: Array  # moves of z and the constants by the readings, shape (free + constants,)
    # explanations of a misfit other than assumed constants: their chances, and their moves of z
    chances: Array  # shape (explanations,)
    moves_z: Array  # shape (explanations, free)

    @cached_property
    def covariance_z(self) -> Array:
        """Covariance with 95 % intervals that include the constants and the explanations."""
        errors = np.sqrt(np.diag(self.assumed_z))
        factors = self.widening(errors, self.moves_z)
        return np.asarray(self.assumed_z * np.outer(factors, factors))

    def widening(self, errors: Array, moves: Array) -> Array:
        """
        Return factors that widen errors until the 95 % intervals include the explanations.

        Each explanation moves the centre of a normal distribution, with its probability.

        """
        known = np.isfinite(errors) & (errors > 0.0)
        apart = np.divide(moves, errors, out=np.zeros_like(moves), where=known)

        def excess(half_width: float, each: Array) -> float:
            ends = ndtr(each - half_width) + ndtr(-half_width - each)
            none = (1.0 - self.chances.sum()) * 2.0 * ndtr(-half_width)
            return float(none + self.chances @ ends) - (1.0 - LEVEL)

        farthest = QUANTILE_95 + np.max(np.abs(apart), axis=0, initial=0.0)
        return np.array(
            [
                optimize.brentq(excess, 1.9, 1.1 * far, args=(each,)) / QUANTILE_95
                for far, each in zip(farthest, apart.T, strict=True)
            ]
        )

    @cached_property
    def assumed_z(self) -> Array:
        """Covariance with the errors of the constants; its 95 % intervals include their pull."""
        free = len(self.z)
        covariance_z = self.whole_z[:free, :free]
        errors = QUANTILE_95 * np.sqrt(np.diag(covariance_z))
        known = np.isfinite(errors)
        factors = np.ones(free)
        factors[known] += np.abs(self.pulled[:free])[known] / errors[known]
        return np.asarray(covariance_z * np.outer(factors, factors))

    @property
    def errors_z(self) -> Array:
        """Standard errors of the coordinates; infinite if unknown."""
        return np.sqrt(np.diag(self.covariance_z))

    @property
    def undetermined(self) -> Flags:
        """Parameters with an error above a factor of e, or above their value."""
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

    def tensions(self, problem: Problem) -> tuple[Tension, ...]:
        """Return the known and the assumed values that the readings also determine."""
        rows, variances = list[tuple[str, float, float, float, float]](), np.diag(self.recorded_z)
        for k, one in enumerate(problem.free):
            if one.name in problem.known:  # constants are exact in a search
                value, share = problem.known[one.name]
                per = one.slope(value) / value
                offset = (self.z[k] - one.to_coordinate(value)) * per
                rows.append((one.name, value, share, variances[k] * per**2, offset))
        values = [one.to_value(z) for one, z in zip(problem.free, self.z.tolist(), strict=True)]
        stand = problem.parameters.updated(dict(problem.experiments[0].settings))
        left, pulls = np.diag(self.whole_z)[len(values) :], self.pulled[len(values) :]
        for (name, share), variance, pull in zip(self.shares.items(), left, pulls, strict=True):
            rows.append((name, value_of(stand, name), share, variance, pull))
        found = []
        for name, value, share, variance, offset in rows:
            gained = 1.0 - variance / share**2
            if gained < _FAR and abs(offset) > TENSION_MAX * share:
                gained = 1.0  # too far for a linear extrapolation: report the fitted value
            if gained > variance / UNDETERMINED**2:
                with np.errstate(over='ignore'):
                    preferred = value * float(np.exp(offset / gained))
                apart = abs(float(offset)) / (share * math.sqrt(gained))
                found.append(Tension(name, value, share, preferred, apart))
        return tuple(found)


class _Slopes(NamedTuple):
    """Whitened residuals at a minimum, without those of bounds, and their slopes."""

    missed: Array  # shape (n,)
    of_z: Array  # shape (n, free)
    inert: Flags  # coordinates without effect, shape (free,)
    active: list[int]  # numbers of the coordinates that the residuals determine
    shares: Mapping[str, float]  # relative errors of the constants with an effect
    joint: Array  # by active coordinates, then by constants, shape (n, active + constants)


def _slopes(
    problem: Problem,
    place: Array,
    per_natural: Array,
    at_bound: Flags,
    shares: Mapping[str, float],
) -> _Slopes:
    free = len(place)
    of_z = problem.slopes(place, central=True)[:-free] @ np.linalg.inv(per_natural)
    inert = np.asarray(np.sqrt(np.sum(of_z**2, axis=0)) <= EFFECT * problem.signal)
    # a parameter on a bound is not determined, unless the bound is a limit of the model
    pairs = zip(problem.free, problem.values(place), strict=True)
    held = at_bound & np.array([not one.is_limit(value) for one, value in pairs])
    active = np.flatnonzero(~held & ~inert).tolist()
    joint = of_z[:, active]
    if shares:
        constants = slopes_of_constants(problem, place, list(shares))[:-free]
        moves = np.linalg.norm(constants, axis=0) * [*shares.values()] > EFFECT * problem.signal
        shares = dict(compress(shares.items(), moves))
        joint = np.hstack((joint, constants[:, moves]))
    return _Slopes(problem.residuals(place)[:-free], of_z, inert, active, shares, joint)


def uncertainty(
    problem: Problem, place: Array, shares: Mapping[str, float], missing: Sequence[Missing]
) -> Uncertainty:
    """
    Return the errors at a minimum.

    ``shares`` are relative errors of assumed constants, ``missing`` explanations of the misfit.

    """
    shares = {name: share for name, share in shares.items() if share}
    z, at_bound = problem.natural.back(place), problem.at_bound(place)
    per_natural = problem.natural.slopes(place)
    slopes = _slopes(problem, place, per_natural, at_bound, shares)
    missed, shares, free, known = slopes.missed, slopes.shares, len(place), len(slopes.active)
    # zero and drift of each trace are fitted too
    chi_square, dof = float(missed @ missed), problem.count - 2 * len(problem.metrics) - free
    scale = max(chi_square / dof, 1.0) if problem.has_traces else 1.0
    readings = slopes.joint.T @ slopes.joint / scale
    information = readings + np.diag(np.array([*[PRIOR] * known, *shares.values()]) ** -2.0)
    starts = np.array([one.to_coordinate(one.start) for one in problem.free])
    gradient = slopes.joint.T @ missed / scale
    gradient[:known] += PRIOR**-2.0 * (z - starts)[slopes.active]
    rows = [*slopes.active, *range(free, free + len(shares))]
    pulled = np.zeros(free + len(shares))
    pulled[rows] = -_inverse(information) @ gradient
    vague = readings[:known, :known] + _VAGUE**-2.0 * np.eye(known)
    others = [each for each in missing if not is_assumed(each.name, shares)]
    moves_z = [problem.natural.back(place + each.moves) - z for each in others]
    upper, is_log = 0.5 * (1.0 + LEVEL), [one.is_log for one in problem.free]
    return Uncertainty(
        z=z,
        sizes=np.where(is_log, 1.0, np.maximum(np.abs(z), 1.0)),
        per_natural=per_natural,
        chi_square=chi_square,
        dof=dof,
        variance_scale=scale,
        quantile=float(stdtrit(dof, upper) if problem.is_bare else ndtri(upper)),
        shown_z=_shown(problem, slopes, information, scale),
        recorded_z=_spread(information[:known, :known], slopes.active, free),
        alone_z=np.sqrt(np.diag(_spread(vague, slopes.active, free))),
        at_bound=at_bound,
        excess=_excess(problem, place, slopes.of_z, missed, at_bound) / math.sqrt(scale),
        inert=slopes.inert & ~at_bound,
        shares=shares,
        whole_z=_spread(information, rows, free + len(shares)),
        pulled=pulled,
        chances=np.array([each.chance for each in others]),
        moves_z=np.reshape(moves_z, (-1, free)),
    )


def is_assumed(name: str, shares: Mapping[str, float]) -> bool:
    """Return whether the covariance already contains the error of a constant."""
    return name in shares or (name == LOAD and LOAD_FACTOR in shares)


def _shown(problem: Problem, slopes: _Slopes, information: Array, scale: float) -> Array:
    """Return the covariance of z by the recording alone, with the constants of SHOWN unknown."""
    known = len(slopes.active)
    rows = [*range(known), *(known + k for k, name in enumerate(slopes.shares) if name in SHOWN)]
    of_known = slopes.joint[len(slopes.joint) - len(problem.known) :, rows]
    alone = information[np.ix_(rows, rows)] - of_known.T @ of_known / scale
    left = _inverse(alone)[:known, :known]
    return _spread(_inverse(left), slopes.active, len(problem.free))


def _excess(
    problem: Problem, place: Array, slopes: Array, missed: Array, at_bound: Flags
) -> Array:
    """Return the pull of the residuals on parameters beyond their bounds, in standard errors."""
    is_lower = problem.excess(place, -BOUND) < 0.0
    basis, found = np.linalg.qr(slopes[:, ~at_bound])[0], np.zeros(len(place))
    for number in np.flatnonzero(at_bound):
        alone = slopes[:, number] - basis @ (basis.T @ slopes[:, number])
        pull = float(alone @ missed) / max(float(np.linalg.norm(alone)), TINY)
        found[number] = pull if is_lower[number] else -pull
    return found


def _inverse(information: Array) -> Array:
    """Return the inverse of an information matrix, scaled against different units."""
    sizes = np.sqrt(np.diag(information))
    return np.asarray(np.linalg.inv(information / np.outer(sizes, sizes)) / np.outer(sizes, sizes))


def _spread(information: Array, rows: list[int], size: int) -> Array:
    """Return the covariance; held coordinates get rows with infinite variances."""
    whole = np.full((size, size), np.nan)
    np.fill_diagonal(whole, np.inf)
    whole[np.ix_(rows, rows)] = _inverse(information)
    return whole


def estimates_of(problem: Problem, doubt: Uncertainty) -> tuple[Estimate, ...]:
    """Return the free parameters at a minimum with their errors and intervals."""
    estimates = list[Estimate]()
    for number, one in enumerate(problem.free):
        z, error_z = float(doubt.z[number]), float(doubt.errors_z[number])
        value, is_vague = one.to_value(z), bool(doubt.undetermined[number])
        low = high = math.nan
        if math.isfinite(error_z) and not is_vague:
            low, high = (one.to_value(z + way * doubt.quantile * error_z) for way in (-1.0, 1.0))
            # The error of a roughness is a factor, so the interval reaches further upwards.
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
