"""
What evidence is made of: checks in families, their outcomes, and panels of curves.

A check is a row of data: quantity, source of the reference, unit, tolerance. One function measures
the rows that share their work; it runs only when the first of them is run.

"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from decimal import Decimal
from functools import lru_cache
from typing import Any, TypeAlias, TypeVar, cast

import numpy as np

from stickslip_ros.contact.profile import Array
from stickslip_ros.stopping import heed_stop

Values: TypeAlias = float | Sequence[float] | Array
Compared: TypeAlias = float | tuple[Values, Values] | tuple[Values, Values, float]
"""Reference and our value, SI, or many of both; and what differences are divided by instead of
each reference. Ours alone if the reference is a printed figure."""
Measured: TypeAlias = Sequence[Compared]
"""What a function measured, a value for each of its rows."""
Row: TypeAlias = 'tuple[str, str, str, Tolerance] | tuple[str, str, str, Tolerance, str]'
"""The first fields of a Check."""
Function = TypeVar('Function', bound=Callable[..., Any])


@dataclass(frozen=True)
class Tolerance:
    """The largest error that passes, and where an error of that size comes from."""

    value: float
    reason: str
    printed: float | None = None
    """The figure, SI, of whose last digit it is a half."""


ROUNDING = Tolerance(1e-12, 'rounding of a few thousand operations in double precision')
BOUND = Tolerance(1e-9, 'a bound: nothing may exceed it')
EXCESS = 'excess over the bound'
HALF_A_DIGIT = 'half a unit of the last printed digit'
SLACK = 1.0 + 1e-6
"""A half digit may be reached exactly; binary fractions then fall on either side of it."""


def printed(figure: str, per_unit: float = 1.0) -> Tolerance:
    """Return half a unit of the last digit of ``81.5873``, printed in a unit of so much SI."""
    half = 0.5 * 10.0 ** int(Decimal(figure).as_tuple().exponent) * SLACK
    return Tolerance(half / abs(float(figure)), HALF_A_DIGIT, float(figure) * per_unit)


@dataclass(frozen=True)
class Check:
    """
    One comparison.

    Attributes
    ----------
    name : str
        The quantity.
    source : str
        Where the reference comes from.
    unit : str
        SI unit of both values; empty for a pure number.
    tolerance : Tolerance
        For the error, of many values for the largest.
    error_of : str
        What differences are divided by, if not by the reference. EXCESS: the reference is a bound,
        and the error is the share by which it is exceeded.
    measure : callable
        Computes what is compared.

    """

    name: str
    source: str
    unit: str
    tolerance: Tolerance
    error_of: str
    measure: Callable[[], Compared]

    def run(self) -> 'Outcome':
        """Compute both values and compare them."""
        compared = self.measure()
        pair = compared if isinstance(compared, tuple) else (self.tolerance.printed, compared)
        expected, found = (np.atleast_1d(np.asarray(each, dtype=float)) for each in pair[:2])
        differences = found - expected
        if self.error_of == EXCESS:
            differences = np.maximum(differences, 0.0)
        errors = np.abs(differences / (pair[2] if len(pair) > 2 else expected))
        worst = int(np.argmax(errors))  # a NaN, which fails, counts as the largest
        return Outcome(self, float(expected[worst]), float(found[worst]), float(errors[worst]))


@dataclass(frozen=True)
class Outcome:
    """What a check found: both values, SI, of many the pair with the largest error."""

    check: Check
    reference: float
    ours: float
    error: float

    @property
    def passed(self) -> bool:
        """Whether the error is a number and within the tolerance."""
        return self.error <= self.check.tolerance.value


_SHARED: list[Any] = []


def shared(function: Function) -> Function:
    """Compute once what several checks and panels of a family need."""
    cached = lru_cache(maxsize=None)(function)
    _SHARED.append(cached)
    return cast('Function', cached)


def forget() -> None:
    """Drop all that is shared."""
    for cached in _SHARED:
        cached.cache_clear()


def measures(
    *rows: Row, each: Sequence[Any] = ((),)
) -> Callable[[Callable[..., Measured]], tuple[Check, ...]]:
    """
    Make checks of rows and of the function that measures them, in this order.

    With ``each`` there are such rows for each of its cases, which the function receives and which
    stands in the names for ``{}``.

    """

    def decorate(function: Callable[..., Measured]) -> tuple[Check, ...]:
        cases = (case if isinstance(case, tuple) else (case,) for case in each)
        return tuple(check for case in cases for check in _checks(rows, function, case))

    return decorate


def _checks(
    rows: Sequence[Row], function: Callable[..., Measured], case: tuple[Any, ...]
) -> list[Check]:
    names = [row[0].format(*case) for row in rows]

    @shared
    def measured() -> dict[str, Compared]:
        return dict(zip(names, function(*case), strict=True))

    def check(name: str, row: Row) -> Check:
        _, source, unit, tolerance, *error_of = row
        return Check(name, source, unit, tolerance, ''.join(error_of), lambda: measured()[name])

    return [check(name, row) for name, row in zip(names, rows, strict=True)]


def bounded(name: str, source: str) -> Row:
    """Return the row of a pure number that does not exceed a bound, its reference."""
    return name, source, '', BOUND, EXCESS


@dataclass(frozen=True)
class Curve:
    """One curve of a panel: ``line``, ``dashed`` or ``points``; one number, one colour."""

    label: str
    x: Array
    y: Array
    style: str = 'line'
    colour: int = 0


@dataclass(frozen=True)
class Panel:
    """One panel of the page of plots; curves are in the units of its labels."""

    title: str
    x_label: str
    y_label: str
    curves: Sequence[Curve]
    log_x: bool = False
    log_y: bool = False
    x_ticks: tuple[float, ...] = ()


@dataclass(frozen=True)
class Findings:
    """What a family found: an outcome of each check, and its part of the page of plots."""

    family: str
    outcomes: tuple[Outcome, ...]
    panels: tuple[Panel, ...] = ()


@dataclass(frozen=True)
class Family:
    """Checks that belong together, group by group as ``measures`` made them, and panels."""

    name: str
    groups: Sequence[tuple[Check, ...]]
    panels: Sequence[Callable[[], Panel]] = ()

    @property
    def checks(self) -> tuple[Check, ...]:
        """The checks of all groups."""
        return tuple(check for group in self.groups for check in group)

    def run(self) -> Findings:
        """Run all checks, and then draw."""
        forget()
        outcomes = []
        for check in self.checks:
            heed_stop()
            outcomes.append(check.run())
        panels = tuple(panel() for panel in self.panels)
        forget()
        return Findings(self.name, tuple(outcomes), panels)


def failed_checks(findings: Iterable[Findings]) -> list[Outcome]:
    """Return the outcomes that fail, of all families."""
    return [each for found in findings for each in found.outcomes if not each.passed]
