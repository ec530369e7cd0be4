# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Results of a comparison: numbers of B minus A in SI units, see docs/howto/compare.md."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.special import chdtrc

from stickslip_ros.arrays import Array
from stickslip_ros.errors import StickSlipError
from stickslip_ros.lab.measurements.measurement import Side
from stickslip_ros.parameters import Scalar
from stickslip_ros.sections import as_json
from stickslip_ros.units import unit_of

FLANK = (0.1, 0.5)  # range of a force curve's straight part, as shares of the largest force
FLANK_POINTS_MIN = 2
ROUNDING = 1e-12  # largest relative spread of a constant


@dataclass(frozen=True)
class ChiSquare:
    """The difference in units of its uncertainty."""

    chi_square: float
    degrees_of_freedom: int
    p_value: float
    largest_residual: float
    within_one_sigma: float
    within_two_sigma: float


@dataclass(frozen=True)
class Agreement:
    """Statistics of the difference B - A."""

    points: int
    bias: float
    rms: float
    largest: float
    largest_at: dict[str, Scalar]
    correlation: float | None  # None if A or B is constant
    relative_rms: float | None  # None if A is constant
    chi_square: ChiSquare | None  # None without uncertainties
    within_68: float | None = None  # share of A within the bands of B, if any
    within_95: float | None = None
    width_95: float | None = None  # mean width of the 95 % band


@dataclass(frozen=True)
class Threshold:
    """0-amplitude (None without a flank) and largest force of a force curve."""

    zero_amplitude_m: float | None
    saturation: float
    saturation_at_m: float
    why: str = ''  # reason of a missing 0-amplitude


@dataclass(frozen=True, eq=False)
class Part:
    """One or more finite points of a quantity, of one preload or of a whole run."""

    at: dict[str, Scalar]  # preload and other settings that vary; empty for a run
    axis: str  # 'amplitude_m', 'time_s', or the column of preloads
    # amplitudes, times or preloads of A; values of A; values of B interpolated to x; shape (n,)
    x: Array
    a: Array
    b: Array
    sigma: Array | None = None  # uncertainty of B - A, shape (n,)
    threshold_a: Threshold | None = None  # only of forces by amplitude
    threshold_b: Threshold | None = None
    # ends of the bands of B by name, shapes (n,), see ``lab.runs.bands``
    band: dict[str, Array] | None = None
    way_m: Array | None = None  # displacement of the rows of a friction loop, shape (n,)

    def within(self, limits: tuple[float, float] | None) -> 'Part':
        """Return the points with x within limits; all points if limits is None."""
        if limits is None:
            return self
        here = (self.x >= limits[0]) & (self.x <= limits[1])
        band = self.band and {name: each[here] for name, each in self.band.items()}
        sigma = None if self.sigma is None else self.sigma[here]
        x, a, b = (each[here] for each in (self.x, self.a, self.b))
        return replace(self, x=x, a=a, b=b, sigma=sigma, band=band)

    @property
    def difference(self) -> Array:
        return self.b - self.a

    @cached_property
    def agreement(self) -> Agreement:
        return agreement_of([self])

    def to_json(self) -> dict[str, Any]:
        """Return an object for JSON, without the points of a run."""
        points = {self.axis: self.x, 'a': self.a, 'b': self.b, 'sigma': self.sigma}
        points |= self.band or {}
        return {
            'at': self.at,
            'agreement': self.agreement,
            'threshold_a': self.threshold_a,
            'threshold_b': self.threshold_b,
            'curve': None if self.axis == 'time_s' else points,
        }


def agreement_of(parts: Sequence[Part]) -> Agreement:
    """Return the statistics of B - A over all points of one or more parts."""
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
        **_within_bands(a, [part.band for part in parts if part.band]),
    )


def _within_bands(a: Array, found: Sequence[dict[str, Array]]) -> dict[str, float]:
    """Return the shares of A within bands, and the mean width; {} without bands."""
    if not found:
        return {}
    ends = {name: np.concatenate([each[name] for each in found]) for name in found[0]}
    return {
        'within_68': float(np.mean((a >= ends['low_68']) & (a <= ends['high_68']))),
        'within_95': float(np.mean((a >= ends['low_95']) & (a <= ends['high_95']))),
        'width_95': float(np.mean(ends['high_95'] - ends['low_95'])),
    }


def correlation_of(a: Array, b: Array) -> float | None:
    """Return Pearson's coefficient; None if A or B is constant."""
    if _is_constant(a) or _is_constant(b):
        return None
    # Scale first: squares of differences in nanometres would lose digits.
    from_mean = [(each - each.mean()) / np.ptp(each) for each in (a, b)]
    norms = [float(np.sqrt(np.sum(each**2))) for each in from_mean]
    return float(np.sum(from_mean[0] * from_mean[1]) / (norms[0] * norms[1]))


def threshold_of(amplitude_m: Array, force_n: Array) -> Threshold:
    """Return 0-amplitude and saturation of a force curve at one preload; shapes (n,)."""
    top = int(np.argmax(force_n))
    largest_n = float(force_n[top])
    on_flank = (force_n >= FLANK[0] * largest_n) & (force_n <= FLANK[1] * largest_n)
    on_flank &= amplitude_m <= amplitude_m[top]
    x_m, y_n, zero_m, why = amplitude_m[on_flank], force_n[on_flank], None, ''
    if largest_n <= 0.0:
        why = 'no force above 0'
    elif (count := len(np.unique(x_m))) < FLANK_POINTS_MIN:
        share = ' to '.join(f'{100 * each:g}' for each in FLANK)
        why = f'strokes with {share} % of the largest force: {count}; give {FLANK_POINTS_MIN}'
    else:
        offsets_m = x_m - x_m.mean()
        slope = float(np.sum(offsets_m * y_n) / np.sum(offsets_m**2))
        zero_m = float(x_m.mean() - y_n.mean() / slope) if slope > 0.0 else None
        why = '' if slope > 0.0 else 'the force does not rise with the stroke'
    return Threshold(zero_m, largest_n, float(amplitude_m[top]), why)


def _is_constant(values: Array) -> bool:
    return bool(np.ptp(values) <= ROUNDING * np.max(np.abs(values)))


def _chi_square(difference: Array, sigmas: Sequence[Array | None]) -> ChiSquare | None:
    known = [each for each in sigmas if each is not None]
    sigma = np.concatenate(known) if len(known) == len(sigmas) else np.zeros(1)
    if not np.all(np.isfinite(sigma) & (sigma > 0.0)):
        return None
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


@dataclass(frozen=True)
class StepStatistics:
    """Net motion of a runner from one period of the voltage to the next."""

    count: int
    mean_m: float
    scatter_m: float  # standard deviation, with the noise of the position
    correlation_m: float  # distance at which the correlation of steps is 1/e; 0: equal steps


class Incomparable(StickSlipError):
    """Valid inputs that cannot be compared."""

    def __init__(self, what: object, problem: str, hint: str) -> None:
        super().__init__(f'{what} {problem}; {hint}')


@dataclass(frozen=True)
class NamedDifference:
    """A parameter, seed or version with different values in A and B."""

    name: str
    a: Scalar
    b: Scalar


@dataclass(frozen=True)
class Alignment:
    """The shift added to the times of B."""

    shift_s: float
    method: str  # ``given`` or ``estimated``
    correlation: float | None = None  # of the quantity used
    error_s: float | None = None  # standard error, wander, or distance of the farthest rival
    decided_by: str = ''
    doubts: tuple[str, ...] = ()  # reasons for another shift


@dataclass(frozen=True, eq=False)
class Compared:
    """A quantity of A and B, point by point."""

    name: str  # with its unit
    parts: tuple[Part, ...]
    left_out: int  # points of A in no part
    offset: float = 0.0  # added to all values of B

    @cached_property
    def agreement(self) -> Agreement:
        return agreement_of(self.parts)

    @property
    def unit(self) -> str:
        return unit_of(self.name)

    def to_json(self) -> dict[str, Any]:
        parts = [part.to_json() for part in self.parts]
        return {**vars(self), 'parts': parts, 'agreement': self.agreement, 'unit': self.unit}


@dataclass(frozen=True, eq=False, repr=False)
class Comparison:
    """All quantities of a comparison along one axis."""

    a: Side
    b: Side
    axis: str
    quantities: tuple[Compared, ...]
    alignment: Alignment | None = None  # None: times unchanged
    window_s: tuple[float, float] | None = None  # part of A used
    # steps of A and B, if both have a periodic voltage
    steps: tuple[StepStatistics, StepStatistics] | None = None

    @property
    def differences(self) -> tuple[NamedDifference, ...]:
        """Common settings with different values, in the order of A."""
        return tuple(
            NamedDifference(name, value, self.b.described[name])
            for name, value in self.a.described.items()
            if name in self.b.described and self.b.described[name] != value
        )

    def to_json(self) -> Any:
        sides = {'a': self.a.to_json(), 'b': self.b.to_json(), 'differences': self.differences}
        quantities = [each.to_json() for each in self.quantities]
        return as_json({**vars(self), **sides, 'quantities': quantities})
