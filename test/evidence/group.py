# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Rows of the table of references as their makers state them: one function, many cases."""

import csv
import io
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from decimal import Decimal
from typing import Any

import numba
import numpy as np
import scipy

from stickslip_ros.lab.validation.references import Reference, arguments_of, case_of

NUMPY = f'numpy {np.__version__}, scipy {scipy.__version__}'
NUMBA = f'numba {numba.__version__}, {NUMPY}'
ROUNDING = 1e-12, 'rounding of a few thousand operations'
SLACK = 1.0 + 1e-6
"""A half digit may be reached exactly; binary fractions then fall on either side of it."""
Scale = float | Callable[..., float] | None


@dataclass(frozen=True)
class Group:
    """Rows that one code makes; ``reference`` and ``relative_to`` are numbers or functions."""

    family: str
    quantity: str
    reference: float | Callable[..., Any]
    tolerance: tuple[float, str]
    source: str
    made_by: str
    cases: Sequence[dict[str, Any]] = ({},)
    relative_to: Scale = None
    """The reference if None."""
    version: str = NUMPY
    is_slow: bool = False
    """More than a second or so: only ``make evidence`` makes all rows."""

    def rows(self, cases: int | None = None) -> Iterator[Reference]:
        """Make the rows of the first cases, all of them if None."""
        for each in self.cases[:cases]:
            case = case_of(each)
            arguments = arguments_of(case)
            value = _value(self.reference, arguments)
            scale = value if self.relative_to is None else _value(self.relative_to, arguments)
            yield Reference(
                self.family, self.quantity, case, value, self.tolerance[0], abs(scale),
                self.tolerance[1], self.source, self.made_by, self.version,
            )  # fmt: skip

    def __str__(self) -> str:
        """Return the name of a test of this group."""
        return f'{self.family}: {self.quantity} ({self.source})'


def _value(given: Any, arguments: dict[str, Any]) -> float:
    return float(given(**arguments) if callable(given) else given)


def printed(
    family: str,
    quantity: str,
    figure: str,
    source: str,
    case: dict[str, Any],
    per_unit: float = 1.0,
) -> Group:
    """Return the row of a figure that is printed in a unit of so much SI."""
    half = 0.5 * 10.0 ** int(Decimal(figure).as_tuple().exponent) * SLACK
    allowed = half / abs(float(figure)), 'half a unit of the last printed digit'
    value = float(figure) * per_unit
    return Group(family, quantity, value, allowed, source, 'print', [case], version='')


def grid(**axes: Sequence[Any]) -> list[dict[str, Any]]:
    """Return a case for every combination of values."""
    cases: list[dict[str, Any]] = [{}]
    for name, values in axes.items():
        cases = [{**case, name: value} for case in cases for value in values]
    return cases


def csv_text(rows: Iterable[Reference]) -> str:
    """Return a table as it is stored."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator='\n')
    writer.writerow(Reference._fields)
    writer.writerows(_cells(row) for row in rows)
    return text.getvalue()


def _cells(row: Reference) -> Iterator[object]:
    numbers: Sequence[str] = ('reference', 'tolerance', 'relative_to')
    for name, value in row._asdict().items():
        if name not in numbers:
            yield value
        else:
            yield '' if math.isnan(value) else repr(value)
