# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Refusals that show the columns of a table and an option to fill in."""

from collections.abc import Iterable

from stickslip_ros.errors import QUOTED, RecordingError, quoted
from stickslip_ros.lab.readers.layout import Header, TextLayout, TextTable

RATE = 'fill in the rate of rows that are evenly spaced in time, --rate ...kHz'
_SHOWN = 60  # most columns in a refusal
TITLES = ('#', 'name', 'unit', 'kind', 'first', 'last')
_TYPED = {'m': 'nm', 'N': 'mN', 'kg': 'g', 'F': 'nF', 'm/s': 'mm/s', 'V/s': 'V/us'}
"""Units in options to fill in, if not the SI unit."""


def unclear(
    table: TextTable, problem: str, options: Iterable[str], otherwise: str = ''
) -> RecordingError:
    """Return a refusal that shows the columns, and asks for options or another remedy."""
    columns = [each for each in table.layout.columns if each.text or each.cell]
    rows = [
        (f'#{e.at + 1}', e.name or e.text, e.unit or '-', e.kind, e.cell, e.last)
        for e in columns[:_SHOWN]
    ]
    more = [(f'{len(columns) - _SHOWN} more', *[''] * 5)] if columns[_SHOWN:] else []
    shown = [tuple(cell[:QUOTED] for cell in row) for row in (TITLES, *rows, *more)]
    there = [f'#{e.at + 1} {quoted(e.shown)}' for e in table.layout.columns if e.kind == 'number']
    problem += f'; columns of numbers: {", ".join(there)}' * bool(there)
    asked = ' '.join(options) if there else ''
    hint = ', or '.join(filter(None, (f'fill in {asked}' * bool(asked), otherwise)))
    return RecordingError(table.where, problem, hint, table=shown)


def to_fill(name: str, si_unit: str) -> str:
    """Return a ``--map`` option for a quantity, with the column to fill in."""
    return f'--map {name}="... ({_TYPED.get(si_unit, si_unit)})"'


def unit_to_fill(si_unit: str) -> str:
    """Return a unit with the prefix to fill in."""
    return f'...{si_unit.removeprefix("k")}'


def option_for(name: str, layout: TextLayout, header: Header, unit: str) -> str:
    """Return the ``--map`` option for a column and unit; unclear columns by number."""
    names = [each.name.lower() for each in layout.columns]
    is_clear = header.name.replace(' ', '').isalnum() and len(header.name) <= QUOTED
    is_one = names.count(header.name.lower()) == 1
    shown = header.name if is_clear and is_one else f'#{header.at + 1}'
    return f'--map {name}="{shown} ({unit})"'
