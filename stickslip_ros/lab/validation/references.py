# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
References of the self-test: tables of data in the package.

A row holds a quantity (a function of the self-test), a case (its arguments), the answer of another
code, and the tolerance. ``make evidence`` writes references.csv and layouts.csv from test/evidence
and from printed figures, ``make foreign`` writes foreign.csv from other programs.

"""

import csv
import math
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

from stickslip_ros.units import unit_of

TABLES = tuple(
    Path(__file__).parent / name for name in ('references.csv', 'layouts.csv', 'foreign.csv')
)


class Reference(NamedTuple):
    """A row of a table; numbers are SI."""

    family: str
    quantity: str  # a function of the self-test; its name ends with the unit
    case: str  # its arguments: profile=rough, force_n=0.1; turning points with slashes
    reference: float
    tolerance: float  # of the error; NaN: shown, not compared
    relative_to: float  # divisor of the error
    why: str  # reason for the tolerance
    source: str
    made_by: str  # code or print
    version: str  # of that code or its libraries

    @property
    def unit(self) -> str:
        """The SI unit; empty for a pure number."""
        return unit_of(self.quantity)

    @property
    def is_compared(self) -> bool:
        """Whether there is a tolerance."""
        return not math.isnan(self.tolerance)


def read_references(paths: Iterable[Path] = TABLES) -> tuple[Reference, ...]:
    """Return the rows of all tables."""
    rows = []
    for path in paths:
        for cells in csv.DictReader(path.read_text(encoding='utf-8').splitlines()):
            numbers = ('reference', 'tolerance', 'relative_to')
            known: dict[str, Any] = {name: float(cells[name] or 'nan') for name in numbers}
            rows.append(Reference(**{**cells, **known}))
    return tuple(rows)


def arguments_of(case: str) -> dict[str, float | str]:
    """Return the arguments of a case: numbers where possible, else words."""
    arguments: dict[str, float | str] = {}
    for name, value in (part.split('=') for part in case.split(', ') if part):
        arguments[name] = value
        with suppress(ValueError):
            arguments[name] = float(value)
    return arguments


def case_of(arguments: Mapping[str, Any]) -> str:
    """Return the text of a case with these arguments."""
    return ', '.join(
        f'{name}={value if isinstance(value, str) else format(value, ".10g")}'
        for name, value in arguments.items()
    )
