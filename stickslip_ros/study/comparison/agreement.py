"""The numbers of a comparison, each by its definition in docs/compare.md."""

from collections.abc import Callable

import numpy as np

from stickslip_ros.contact.profile import Array
from stickslip_ros.parameters import Scalar
from stickslip_ros.study.comparison.result import Agreement, ChiSquare, Curve, Threshold

FLANK = (0.1, 0.5)
"""Shares of the largest force between which a force curve rises almost straight."""
FLANK_POINTS_MIN = 2
ROUNDING = 1e-12
"""Relative spread up to which values are one constant with rounding."""

Where = Callable[[int], dict[str, Scalar]]


def agreement_of(curve: Curve, where: Where) -> Agreement:
    """
    Return how far B is from A.

    Parameters
    ----------
    curve : Curve
        At least one point, all finite.
    where : callable
        Gives the place of a point by its number.

    """
    difference = curve.difference
    worst = int(np.argmax(np.abs(difference)))
    rms = float(np.sqrt(np.mean(difference**2)))
    range_a = float(np.ptp(curve.a))
    return Agreement(
        points=len(difference),
        bias=float(np.mean(difference)),
        rms=rms,
        largest=float(difference[worst]),
        largest_at=where(worst),
        correlation=correlation_of(curve.a, curve.b),
        relative_rms=rms / range_a if range_a > 0.0 else None,
        chi_square=_chi_square(difference, curve.sigma),
    )


def correlation_of(a: Array, b: Array) -> float | None:
    """Return Pearson's coefficient; None if one of the two is constant."""
    if _is_constant(a) or _is_constant(b):
        return None
    # Scaled first: squares of nanometres of nanometres would lose digits.
    from_mean = [(each - each.mean()) / np.ptp(each) for each in (a, b)]
    norms = [float(np.sqrt(np.sum(each**2))) for each in from_mean]
    return float(np.sum(from_mean[0] * from_mean[1]) / (norms[0] * norms[1]))


def threshold_of(amplitude_m: Array, force_n: Array) -> Threshold:
    """
    Read 0-amplitude and saturation off a force curve.

    Parameters
    ----------
    amplitude_m, force_n : array, shape (n,)
        Points of one preload.

    """
    top = int(np.argmax(force_n))
    largest_n = float(force_n[top])
    on_flank = (force_n >= FLANK[0] * largest_n) & (force_n <= FLANK[1] * largest_n)
    on_flank &= amplitude_m <= amplitude_m[top]
    zero_m = _zero_of_line(amplitude_m[on_flank], force_n[on_flank]) if largest_n > 0.0 else None
    return Threshold(zero_m, largest_n, float(amplitude_m[top]))


def _zero_of_line(x: Array, y: Array) -> float | None:
    """Return where a straight line by least squares is zero; None if it does not rise."""
    if len(np.unique(x)) < FLANK_POINTS_MIN:
        return None
    offsets = x - x.mean()
    slope = float(np.sum(offsets * y) / np.sum(offsets**2))
    return float(x.mean() - y.mean() / slope) if slope > 0.0 else None


def _is_constant(values: Array) -> bool:
    return bool(np.ptp(values) <= ROUNDING * np.max(np.abs(values)))


def _chi_square(difference: Array, sigma: Array | None) -> ChiSquare | None:
    if sigma is None or not np.all(np.isfinite(sigma) & (sigma > 0.0)):
        return None
    from scipy.special import chdtrc  # noqa: PLC0415 - most comparisons have no uncertainties

    residuals = difference / sigma
    total = float(np.sum(residuals**2))
    return ChiSquare(
        chi_square=total,
        degrees_of_freedom=len(residuals),
        p_value=float(chdtrc(len(residuals), total)),
        largest_residual=float(residuals[np.argmax(np.abs(residuals))]),
        within_one_sigma=float(np.mean(np.abs(residuals) <= 1.0)),
        within_two_sigma=float(np.mean(np.abs(residuals) <= 2.0)),
    )
