# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Statistics of a minimum: errors, intervals, correlations, parameters without influence."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm, t

from stickslip_ros.arrays import Array
from stickslip_ros.lab.fitting.free import Coordinate
from stickslip_ros.lab.fitting.problem import Problem
from stickslip_ros.lab.fitting.profile import profile
from stickslip_ros.parameters import spec_of

Flags = NDArray[np.bool_]

QUANTILE_95 = 1.96  # half width of a 95 % interval in standard deviations
_APART = 2.0  # least distance of another minimum in standard errors
LEVEL = 0.95  # confidence of the intervals
EFFECT = 1e-5
"""Least effect of an e-fold, or the whole range, per force: the noise of a slope."""
RANK = 1e-5
"""Least singular value, per largest, of independent columns of unit length: the noise."""
UNDETERMINED = 1.0
"""Largest standard error of a coordinate, an e-fold or the whole range, of a determined parameter:
slopes do not reach further."""
_SHARE = 1e-3  # least part of a parameter in an undetermined combination


@dataclass(frozen=True)
class Estimate(Coordinate):
    """A free parameter with its value and 95 % interval, symmetric about its coordinate."""

    value: float
    # infinite, without an interval, if one of the flags below is set, or if another parameter sits
    # on a bound that is no limit of the model
    standard_error: float
    low: float
    high: float
    at_bound: bool
    inert: bool  # without effect on the forces
    undetermined: bool  # exchangeable with others, or known to less than a factor of e


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Errors of the parameters at a minimum."""

    dof: int  # degrees of freedom: points less free parameters
    # factor of the covariance: 1 with known standard errors of the points, else chi-square per
    # degree of freedom
    variance_scale: float
    # half width of the intervals in standard errors: of the normal distribution with known errors
    # of the points, else of the t distribution
    quantile: float
    covariance_z: Array  # of the coordinates, with infinite variances, shape (free, free)
    at_bound: Flags  # parameters on a bound, shape (free,)
    inert: Flags  # parameters without effect
    undetermined: Flags  # parameters in a combination without effect
    # of the slopes of the residuals with columns of unit length, of all other parameters
    singular_values: tuple[float, ...]
    weakest: tuple[float, ...]  # combination of coordinates of the smallest of them

    @property
    def errors_z(self) -> Array:
        """Standard errors of the coordinates; infinite if unknown."""
        return np.sqrt(np.diag(self.covariance_z))

    @property
    def correlation(self) -> Array:
        """Correlation, shape (free, free); nan for a parameter without a standard error."""
        errors = self.errors_z
        errors = np.where(np.isfinite(errors) & (errors > 0.0), errors, np.nan)
        return np.asarray(self.covariance_z / np.outer(errors, errors))

    @property
    def condition(self) -> float:
        """Condition number: 1 if parameters act independently."""
        values = self.singular_values
        if not values:
            return 1.0
        return values[0] / values[-1] if values[-1] > 0.0 else float('inf')

    def is_beyond_errors(self, place: Array, other: Array) -> bool:
        """Return whether another place lies beyond the errors of this place."""
        return bool(np.any(np.abs(other - place) > _APART * self.errors_z))

    def reaching(self, place: Array, others: Array, rises: Array) -> 'Uncertainty':
        """Widen the intervals to other minima, shape (n, free), by their rises of chi-square."""
        if not len(others):
            return self
        left = np.sqrt(np.maximum(1.0 - rises / QUANTILE_95**2, 0.0))
        around = QUANTILE_95 * left[:, np.newaxis] * self.errors_z
        reach = np.max(np.abs(others - place) + around, axis=0)
        return replace(self, covariance_z=reaching(self.covariance_z, reach))


def uncertainty(problem: Problem, coordinates: Array, chi_square: float) -> Uncertainty:
    """Return the errors of the parameters from the slopes at a minimum."""
    jacobian = problem.slopes(coordinates, central=True)
    is_known, free = problem.noise.known, len(problem.free)
    dof = problem.count - problem.unknowns - free
    at_bound = problem.at_bound(coordinates)
    lengths = np.sqrt(np.sum(jacobian**2, axis=0))
    inert = lengths <= EFFECT * problem.signal
    active = np.flatnonzero(~at_bound & ~inert)
    values, directions = np.empty(0), np.empty((0, 0))
    weakest = np.zeros(free)
    if len(active):
        unit = jacobian[:, active] / lengths[active]
        # The triangle alone: the other matrix would have a row for each reading of a trace.
        _, values, directions = np.linalg.svd(np.linalg.qr(unit, mode='r'), full_matrices=True)
        values = np.concatenate((values, np.zeros(len(directions) - len(values))))
        row = directions[-1]
        weakest[active] = row * np.sign(row[np.argmax(np.abs(row))])
    scale = 1.0 if is_known else chi_square / dof
    covariance_z, undetermined = covariance_of(values, directions, lengths[active], scale)
    if any(
        sits and not one.is_limited(value)  # the model goes on beyond this bound
        for one, value, sits in zip(
            problem.free, problem.values(coordinates), at_bound, strict=True
        )
    ):
        covariance_z = np.full_like(covariance_z, np.nan)
        np.fill_diagonal(covariance_z, np.inf)
    whole_z = np.full((free, free), np.nan)  # what is not active has no covariance
    np.fill_diagonal(whole_z, np.inf)
    whole_z[np.ix_(active, active)] = covariance_z
    upper = 0.5 * (1.0 + LEVEL)
    return Uncertainty(
        dof=dof,
        variance_scale=scale,
        quantile=float(norm.ppf(upper) if is_known else t.ppf(upper, dof)),
        covariance_z=widen(problem, coordinates, whole_z),
        at_bound=at_bound,
        inert=inert & ~at_bound,
        undetermined=np.isin(range(free), active[undetermined]),
        singular_values=tuple(values.tolist()),
        weakest=tuple(weakest.tolist()),
    )


def widen(problem: Problem, coordinates: Array, covariance_z: Array) -> Array:
    """
    Widen a covariance to the places of a grid that are not ruled out.

    Parameters that follow the grid curve with it: a damping ratio of 0.07, freed with resonance
    and bandwidth, was 3.5 standard errors off otherwise.

    """
    grid = profile(problem, coordinates)
    if grid is None:
        return covariance_z
    ends = [grid.range_of(number, QUANTILE_95**2) for number in range(len(coordinates))]
    return reaching(covariance_z, np.max(np.abs(np.transpose(ends) - coordinates), axis=0))


def reaching(covariance_z: Array, reach: Array) -> Array:
    """Widen a covariance to 95 % intervals of at least this reach; infinite variances stay."""
    factors = np.maximum(reach / (QUANTILE_95 * np.sqrt(np.diag(covariance_z))), 1.0)
    return np.asarray(covariance_z * np.outer(factors, factors))


def vague(covariance_z: Array) -> Flags:
    """Return a mask of the coordinates with an error too large for an estimate, but finite."""
    variances = np.diag(covariance_z)
    return np.asarray(np.isfinite(variances) & (variances > UNDETERMINED**2))


def estimates_of(problem: Problem, coordinates: Array, doubt: Uncertainty) -> tuple[Estimate, ...]:
    """Return the free parameters at a minimum with their errors and intervals."""
    estimates, is_vague = [], vague(doubt.covariance_z)
    for index, free in enumerate(problem.free):
        z = float(coordinates[index])
        error_z = math.inf if is_vague[index] else float(doubt.errors_z[index])
        value, spec = free.to_value(z), spec_of(free.name)
        low = high = np.nan
        if np.isfinite(error_z):
            # The interval is symmetric about the coordinate, and cut at the limits of the model.
            ends_z = z + doubt.quantile * error_z * np.array((-1.0, 1.0))
            with np.errstate(over='ignore'):
                ends = np.exp(ends_z) if free.is_log else free.unbounded_value(1.0) * ends_z
            low = float(max(ends[0], -np.inf if spec.minimum is None else spec.minimum))
            high = float(min(ends[1], np.inf if spec.maximum is None else spec.maximum))
        estimates.append(
            Estimate(
                **vars(free),
                value=value,
                standard_error=error_z * free.slope(value),
                low=low,
                high=high,
                at_bound=bool(doubt.at_bound[index]),
                inert=bool(doubt.inert[index]),
                undetermined=bool(doubt.undetermined[index] or is_vague[index]),
            )
        )
    return tuple(estimates)


def covariance_of(
    values: Array, directions: Array, lengths: Array, scale: float
) -> tuple[Array, Flags]:
    """Return the covariance of active coordinates, and a mask of those not determined."""
    if not len(values):
        return np.empty((0, 0)), np.zeros(0, dtype=np.bool_)
    blind = values <= RANK * values[0]
    seen = directions[~blind] / values[~blind, None]
    covariance = scale * (seen.T @ seen) / np.outer(lengths, lengths)
    undetermined = np.sum(directions[blind] ** 2, axis=0) > _SHARE
    covariance[undetermined, :] = covariance[:, undetermined] = np.nan
    covariance[undetermined, undetermined] = np.inf
    return covariance, np.asarray(undetermined)
