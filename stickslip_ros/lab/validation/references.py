# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The references of the self-test: two tables of data that ship with the package.

A row is one number: what the code of this package is asked (a quantity, which names a function of
the self-test, and a case, which gives its arguments), what another code answers, and how far both
may be apart. ``make evidence`` writes references.csv, from the codes in test/evidence and from
printed figures; ``make foreign`` writes foreign.csv, from programs that others wrote.

"""

import csv
import math
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

from stickslip_ros.units import unit_of

TABLES = tuple(Path(__file__).parent / name for name in ('references.csv', 'foreign.csv'))


class Reference(NamedTuple):
    """A row of a table, its columns in their order; numbers are SI."""

    family: str
    quantity: str  # a function of the self-test; its name ends with the unit, as everywhere
    case: str  # arguments of that function: profile=rough, force_n=0.1; turning points by slashes
    reference: float
    tolerance: float  # of the error; not a number: for the page only, not compared
    relative_to: float  # what the error is divided by
    why: str  # where an error as large as the tolerance comes from
    source: str
    made_by: str  # the code, or the print, that the reference is from
    version: str  # of that code, or of what it computes with

    @property
    def unit(self) -> str:
        """The SI unit; empty for a pure number."""
        return unit_of(self.quantity)

    @property
    def is_compared(self) -> bool:
        """Whether there is a tolerance."""
        return not math.isnan(self.tolerance)


def read_references(paths: Iterable[Path] = TABLES) -> tuple[Reference, ...]:
    """Return the rows of tables, in their order."""
    rows = []
    for path in paths:
        for cells in csv.DictReader(path.read_text(encoding='utf-8').splitlines()):
            numbers = ('reference', 'tolerance', 'relative_to')
            known: dict[str, Any] = {name: float(cells[name] or 'nan') for name in numbers}
            rows.append(Reference(**{**cells, **known}))
    return tuple(rows)


def arguments_of(case: str) -> dict[str, float | str]:
    """Return the arguments that a case names: numbers where they are some, else words."""
    arguments: dict[str, float | str] = {}
    for name, value in (part.split('=') for part in case.split(', ') if part):
        arguments[name] = value
        with suppress(ValueError):
            arguments[name] = float(value)
    return arguments


def case_of(arguments: Mapping[str, Any]) -> str:
    """Return the words of a case."""
    return ', '.join(
        f'{name}={value if isinstance(value, str) else format(value, ".10g")}'
        for name, value in arguments.items()
    )
