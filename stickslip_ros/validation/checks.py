"""One check: a reference, our value, the error between them and the error that is allowed."""

from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal

import numpy as np

from stickslip_ros.contact.profile import Array

HALF_A_DIGIT = 'half a unit of the last printed digit'
SLACK = 1.0 + 1e-6
"""A half digit may be reached exactly; binary fractions then fall on either side of it."""


@dataclass(frozen=True)
class Tolerance:
    """
    An allowed error and why it is that large.

    Attributes
    ----------
    value : float
        Largest error that passes.
    reason : str
        Where an error of that size comes from.

    """

    value: float
    reason: str


@dataclass(frozen=True)
class Scale:
    """
    What differences are divided by instead of the reference.

    Attributes
    ----------
    value : float
        In the unit of the difference.
    name : str
        For the tables.

    """

    value: float
    name: str


ROUNDING = Tolerance(1e-12, 'rounding of a few thousand operations in double precision')


BOUND = Tolerance(1e-9, 'a bound: nothing may exceed it')


@dataclass(frozen=True)
class Check:
    """
    One comparison.

    Attributes
    ----------
    name : str
        What is compared.
    reference_text : str
        Where the reference comes from.
    reference, ours : float
        The two values, SI.
    unit : str
        Their unit; empty for a pure number.
    error : float
        Difference relative to the reference, or to what ``error_of`` names.
    tolerance : float
        Largest error that passes.
    reason : str
        Where an error of that size comes from.
    error_of : str
        What the difference is divided by, if not by the reference.

    """

    name: str
    reference_text: str
    reference: float
    ours: float
    unit: str
    error: float
    tolerance: float
    reason: str
    error_of: str = ''

    @property
    def passed(self) -> bool:
        """Whether the error is a number and within the tolerance."""
        return bool(self.error <= self.tolerance)


def compare(
    name: str, reference_text: str, reference: float, ours: float, unit: str, tolerance: Tolerance
) -> Check:
    """Return the check of one value, its error relative to the reference."""
    error = abs(ours - reference) / abs(reference)
    return Check(
        name,
        reference_text,
        float(reference),
        float(ours),
        unit,
        float(error),
        tolerance.value,
        tolerance.reason,
    )


def compare_printed(
    name: str, reference_text: str, figure: str, ours: float, unit: str, *, per_unit: float = 1.0
) -> Check:
    """
    Return the check of a value against a printed figure.

    Parameters
    ----------
    name, reference_text : str
        As in Check.
    figure : str
        The figure with all its digits, as ``81.5873``; half of the last one is the tolerance.
    ours : float
        Our value, SI.
    unit : str
        SI unit.
    per_unit : float
        SI value of the unit in which the figure is printed: 1e-9 for nm.

    """
    exponent = Decimal(figure).as_tuple().exponent
    half = 0.5 * 10.0 ** int(exponent) * SLACK
    tolerance = Tolerance(half / abs(float(figure)), HALF_A_DIGIT)
    return compare(name, reference_text, float(figure) * per_unit, ours, unit, tolerance)


def compare_worst(
    name: str,
    reference_text: str,
    references: Sequence[float] | Array,
    ours: Sequence[float] | Array,
    unit: str,
    tolerance: Tolerance,
    scale: Scale | None = None,
) -> Check:
    """
    Return the check of many values; it shows the pair with the largest error.

    Parameters
    ----------
    name, reference_text, unit : str
        As in Check.
    references, ours : array
        The values, one shape.
    tolerance : Tolerance
        For the largest error.
    scale : Scale, optional
        What differences are divided by; each its reference if None.

    """
    expected, found = np.asarray(references, dtype=float), np.asarray(ours, dtype=float)
    errors = np.abs(found - expected) / (scale.value if scale else np.abs(expected))
    worst = int(np.argmax(errors))  # a NaN, which fails, counts as the largest
    return Check(
        name,
        reference_text,
        float(expected[worst]),
        float(found[worst]),
        unit,
        float(errors[worst]),
        tolerance.value,
        tolerance.reason,
        scale.name if scale else '',
    )


def compare_bound(name: str, reference_text: str, bound: float, ours: float, unit: str) -> Check:
    """
    Return the check that a size does not exceed a bound; its error is the share of excess.

    Parameters
    ----------
    name, reference_text, unit : str
        As in Check.
    bound, ours : float
        Bound, which is shown as the reference, and size, SI.

    """
    excess = (ours - bound) / bound if ours > bound else 0.0 * ours  # NaN stays NaN, and fails
    return Check(
        name,
        reference_text,
        float(bound),
        float(ours),
        unit,
        float(excess),
        BOUND.value,
        BOUND.reason,
        'excess over the bound',
    )
