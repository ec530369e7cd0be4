"""Points of A and B, and how far they agree; docs/howto/compare.md defines each number."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

import numpy as np

from stickslip_ros.contact.profile import Array
from stickslip_ros.parameters import Scalar

AMPLITUDE, TIME = 'amplitude_m', 'time_s'
"""The two axes along which things are compared."""
FLANK = (0.1, 0.5)
"""Shares of the largest force between which a force curve rises almost straight."""
FLANK_POINTS_MIN = 2
ROUNDING = 1e-12
"""Relative spread up to which values are one constant with rounding."""


@dataclass(frozen=True)
class ChiSquare:
    """The difference measured by its uncertainty."""

    chi_square: float
    degrees_of_freedom: int
    p_value: float
    largest_residual: float
    within_one_sigma: float
    within_two_sigma: float


@dataclass(frozen=True)
class Agreement:
    """
    How far B is from A.

    There is no correlation if A or B is constant, no relative RMS if A is, and no chi-square
    unless uncertainties are known.

    """

    points: int
    bias: float
    rms: float
    largest: float
    largest_at: dict[str, Scalar]
    correlation: float | None
    relative_rms: float | None
    chi_square: ChiSquare | None


@dataclass(frozen=True)
class Threshold:
    """0-amplitude, if there is a flank, and largest force of a force curve, off its own points."""

    zero_amplitude_m: float | None
    saturation: float
    saturation_at_m: float


@dataclass(frozen=True, eq=False)
class Part:
    """
    Points of a quantity, at least one, all finite: of one preload, or of a whole run.

    Attributes
    ----------
    at : dict of str to scalar
        Preload, and what else varies; empty for a run.
    axis : str
        AMPLITUDE or TIME.
    x, a, b : array, shape (n,)
        Amplitudes or times of A's points, A, and B interpolated onto A's points.
    sigma : array, shape (n,), or None
        Uncertainty of B - A.
    threshold_a, threshold_b : Threshold or None
        Of forces by amplitude.

    """

    at: dict[str, Scalar]
    axis: str
    x: Array
    a: Array
    b: Array
    sigma: Array | None = None
    threshold_a: Threshold | None = None
    threshold_b: Threshold | None = None

    @property
    def difference(self) -> Array:
        """B - A."""
        return self.b - self.a

    @cached_property
    def agreement(self) -> Agreement:
        """How far B is from A here."""
        return agreement_of([self])

    def to_json(self) -> dict[str, Any]:
        """Return what JSON can say; of runs, which have many, not the points themselves."""
        points = {self.axis: self.x, 'a': self.a, 'b': self.b, 'sigma': self.sigma}
        curve = {name: None if each is None else each.tolist() for name, each in points.items()}
        return {
            'at': self.at,
            'agreement': asdict(self.agreement),
            'threshold_a': self.threshold_a and asdict(self.threshold_a),
            'threshold_b': self.threshold_b and asdict(self.threshold_b),
            'curve': None if self.axis == TIME else curve,
        }


def agreement_of(parts: Sequence[Part]) -> Agreement:
    """Return how far B is from A in all points of at least one part."""
    a = np.concatenate([part.a for part in parts])
    b = np.concatenate([part.b for part in parts])
    difference = b - a
    worst = max(parts, key=lambda part: np.max(np.abs(part.difference)))
    index = int(np.argmax(np.abs(worst.difference)))
    rms = float(np.sqrt(np.mean(difference**2)))
    range_a = float(np.ptp(a))
    return Agreement(
        points=len(difference),
        bias=float(np.mean(difference)),
        rms=rms,
        largest=float(worst.difference[index]),
        largest_at={**worst.at, worst.axis: float(worst.x[index])},
        correlation=correlation_of(a, b),
        relative_rms=rms / range_a if range_a > 0.0 else None,
        chi_square=_chi_square(difference, [part.sigma for part in parts]),
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
    """Read 0-amplitude and saturation off a force curve: points of one preload, shape (n,)."""
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


def _chi_square(difference: Array, sigmas: Sequence[Array | None]) -> ChiSquare | None:
    known = [each for each in sigmas if each is not None]
    sigma = np.concatenate(known) if len(known) == len(sigmas) else np.zeros(1)
    if not np.all(np.isfinite(sigma) & (sigma > 0.0)):
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
