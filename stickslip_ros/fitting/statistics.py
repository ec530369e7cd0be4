"""Statistics of a minimum: errors, intervals, correlations, parameters without influence."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stickslip_ros.contact.profile import Array
from stickslip_ros.extras import load_extra
from stickslip_ros.fitting.free import Free
from stickslip_ros.fitting.problem import Problem
from stickslip_ros.parameters import spec_of

Flags = NDArray[np.bool_]
Places = NDArray[np.intp]

PURPOSE = 'a fit'
"""What needs SciPy, for the refusal where it is missing."""
LEVEL = 0.95
"""Confidence of the intervals."""
EFFECT = 1e-5
"""Share of the forces that one e-fold, or the whole range, must change: the noise of a slope."""
RANK = 1e-5
"""Singular value, per largest, below which columns of unit length are dependent: the noise."""
SHARE = 1e-3
"""Part of an undetermined combination from which a parameter belongs to it."""


@dataclass(frozen=True)
class Estimate(Free):
    """
    A free parameter with its value and 95 % interval, which is even about its coordinate.

    The standard error is infinite, and there is no interval, where the forces do not determine it:
    the value sits on a bound, is inert, which is to change no force, or is undetermined, which is
    to be traded for others; or a bound that is no limit of the model holds another parameter.

    """

    value: float
    standard_error: float
    low: float
    high: float
    at_bound: bool
    inert: bool
    undetermined: bool


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """
    How well a minimum determines its parameters.

    Attributes
    ----------
    dof : int
        Degrees of freedom: points less free parameters.
    variance_scale : float
        What the covariance was multiplied with: 1 where the standard errors of the points are
        known, chi-square per degree of freedom where they are not.
    quantile : float
        Half width of the intervals in standard errors: of the normal distribution where the
        standard errors of the points are known, of the t distribution where they are not.
    covariance_z : array, shape (free, free)
        Covariance of the coordinates; infinite variance where nothing is known.
    at_bound, inert, undetermined : array of bool, shape (free,)
        Which parameters sit on a bound, change no force, or belong to a combination that
        changes none.
    singular_values : tuple of float
        Of the slopes of the residuals with columns of unit length, without the parameters on
        a bound and those that change nothing.
    weakest : tuple of float
        The combination of coordinates that belongs to the smallest of them.

    """

    dof: int
    variance_scale: float
    quantile: float
    covariance_z: Array
    at_bound: Flags
    inert: Flags
    undetermined: Flags
    singular_values: tuple[float, ...]
    weakest: tuple[float, ...]

    @property
    def errors_z(self) -> Array:
        """Standard errors of the coordinates; infinite where nothing is known."""
        return np.sqrt(np.diag(self.covariance_z))

    @property
    def correlation(self) -> Array:
        """Shape (free, free); not a number where a parameter has no standard error."""
        errors = self.errors_z
        errors = np.where(np.isfinite(errors) & (errors > 0.0), errors, np.nan)
        return np.asarray(self.covariance_z / np.outer(errors, errors))

    @property
    def condition(self) -> float:
        """Condition number: 1 if parameters act independently of each other."""
        values = self.singular_values
        if not values:
            return 1.0
        return values[0] / values[-1] if values[-1] > 0.0 else float('inf')


def uncertainty(problem: Problem, coordinates: Array, chi_square: float) -> Uncertainty:
    """Return what the slopes at the coordinates of a minimum say about its parameters."""
    jacobian = problem.slopes(coordinates, central=True)
    known = problem.points.sigma_n is not None
    dof = len(problem.points) - len(problem.free)
    at_bound = problem.at_bound(coordinates)
    lengths = np.sqrt(np.sum(jacobian**2, axis=0))
    forces = problem.points.force_n / problem.points.scale_n
    inert = lengths <= EFFECT * np.sqrt(np.sum(forces**2))
    active = np.flatnonzero(~at_bound & ~inert)
    values, directions = _decompose(jacobian[:, active] / lengths[active])
    scale = 1.0 if known else chi_square / dof
    covariance_z, undetermined = _covariance(values, directions, lengths[active], scale)
    if _is_held(problem, coordinates, at_bound):
        covariance_z = np.full_like(covariance_z, np.nan)
        np.fill_diagonal(covariance_z, np.inf)
    return Uncertainty(
        dof=dof,
        variance_scale=scale,
        quantile=_quantile(known, dof),
        covariance_z=_spread(covariance_z, active, len(lengths)),
        at_bound=at_bound,
        inert=inert & ~at_bound,
        undetermined=np.isin(range(len(lengths)), active[undetermined]),
        singular_values=tuple(values.tolist()),
        weakest=_weakest(directions, active, len(lengths)),
    )


def estimates_of(problem: Problem, coordinates: Array, doubt: Uncertainty) -> tuple[Estimate, ...]:
    """Return the free parameters at a minimum with their errors and intervals."""
    estimates = []
    for index, free in enumerate(problem.free):
        z, error_z = float(coordinates[index]), float(doubt.errors_z[index])
        value = free.to_value(z)
        low, high = _interval(free, z, error_z, doubt.quantile)
        estimates.append(
            Estimate(
                **vars(free),
                value=value,
                standard_error=error_z * free.slope(value),
                low=low,
                high=high,
                at_bound=bool(doubt.at_bound[index]),
                inert=bool(doubt.inert[index]),
                undetermined=bool(doubt.undetermined[index]),
            )
        )
    return tuple(estimates)


def _is_held(problem: Problem, coordinates: Array, at_bound: Flags) -> bool:
    """Return whether a parameter sits on a bound that the model does not have."""
    values = problem.values(coordinates)
    return any(
        sits and not one.is_limited(value)
        for one, value, sits in zip(problem.free, values, at_bound, strict=True)
    )


def _interval(free: Free, z: float, error_z: float, quantile: float) -> tuple[float, float]:
    """Return the interval even about a coordinate; what the parameter cannot be is cut off."""
    if not np.isfinite(error_z):
        return np.nan, np.nan
    spec = spec_of(free.name)
    low, high = (_value(free, z + sign * quantile * error_z) for sign in (-1.0, 1.0))
    least = -np.inf if spec.minimum is None else spec.minimum
    most = np.inf if spec.maximum is None else spec.maximum
    return float(max(low, least)), float(min(high, most))


def _value(free: Free, coordinate: float) -> float:
    with np.errstate(over='ignore'):
        return float(np.exp(coordinate)) if free.is_log else free.unbounded_value(coordinate)


def _decompose(unit: Array) -> tuple[Array, Array]:
    """Return singular values and, as rows, the combinations of columns that belong to them."""
    if not unit.size:
        return np.empty(0), np.empty((0, 0))
    _, values, directions = np.linalg.svd(unit, full_matrices=True)
    missing = len(directions) - len(values)
    return np.concatenate((values, np.zeros(missing))), directions


def _covariance(
    values: Array, directions: Array, lengths: Array, scale: float
) -> tuple[Array, Flags]:
    """Return the covariance of active coordinates, and which of them are not determined."""
    if not len(values):
        return np.empty((0, 0)), np.zeros(0, dtype=np.bool_)
    blind = values <= RANK * values[0]
    seen = directions[~blind] / values[~blind, None]
    covariance = scale * (seen.T @ seen) / np.outer(lengths, lengths)
    undetermined = np.sum(directions[blind] ** 2, axis=0) > SHARE
    covariance[undetermined, :] = covariance[:, undetermined] = np.nan
    covariance[undetermined, undetermined] = np.inf
    return covariance, np.asarray(undetermined)


def _spread(covariance: Array, active: Places, free: int) -> Array:
    """Return a covariance of all parameters: those that are not active have none."""
    whole = np.full((free, free), np.nan)
    np.fill_diagonal(whole, np.inf)
    whole[np.ix_(active, active)] = covariance
    return whole


def _weakest(directions: Array, active: Places, free: int) -> tuple[float, ...]:
    whole = np.zeros(free)
    if len(directions):
        row = directions[-1]
        whole[active] = row * np.sign(row[np.argmax(np.abs(row))])
    return tuple(whole.tolist())


def _quantile(known: bool, dof: int) -> float:
    stats = load_extra(PURPOSE, 'scipy.stats')
    upper = 0.5 * (1.0 + LEVEL)
    return float(stats.norm.ppf(upper) if known else stats.t.ppf(upper, dof))
