# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Sections of a result: one description for a screen, a notebook and a page."""

import dataclasses
import math
from collections.abc import Callable, Iterable, Sequence
from html import escape
from typing import Any, NamedTuple

from stickslip_ros.units import FACTORS, display_unit, in_digits, unit_of


class Section(NamedTuple):
    """A title, a table, sentences below it, and a function that draws a figure above them."""

    title: str = ''
    rows: Sequence[Sequence[object]] = ()
    header: Sequence[object] = ()
    notes: Sequence[str] = ()
    draw: Callable[[], Any] | None = None

    @property
    def has_words(self) -> bool:
        """Whether it is more than a figure, which only a page shows."""
        return self.draw is None or bool(self.rows or self.notes)


class NotebookView:
    """Base of results: a notebook shows their sections as HTML."""

    def sections(self) -> Iterable[Section]:
        raise NotImplementedError

    def _repr_html_(self) -> str:
        return '\n'.join(html_of(each) for each in self.sections() if each.has_words)


def html_of(section: Section, heading: str = 'h4', picture: str = '') -> str:
    """Return a section as HTML with escaped cells."""
    lines = [f'<{heading}>{_text(section.title)}</{heading}>{picture}']
    if section.rows:
        head = [_row(section.header, 'th')] if section.header else []
        lines += ['<table>', *head, *(_row(row, 'td') for row in section.rows), '</table>']
    return '\n'.join([*lines, *(f'<p>{_text(note)}</p>' for note in section.notes)])


def si_row(name: str, value: float, digits: str, unit: str = '') -> tuple[str, str, str]:
    """Return the row of an SI number in a unit of FACTORS, with a format such as ``.4f``."""
    return name, f'{value * FACTORS[unit]:{digits}}', unit


def report_field(words: str, digits: str, **default: Any) -> Any:
    """Return a dataclass field that ``rows_of`` prints; its name ends with its SI unit."""
    return dataclasses.field(**default, metadata={'words': words, 'digits': digits})


def rows_of(result: Any) -> list[tuple[str, str, str]]:
    """Return the rows of the fields that ``report_field`` declares."""
    rows = []
    for each in dataclasses.fields(result):
        if each.metadata:
            factor, unit = display_unit(unit_of(each.name))
            value = format(factor * getattr(result, each.name), each.metadata['digits'])
            shown = value if float(value) else value.removeprefix('-')
            rows.append((each.metadata['words'], shown, unit))
    return rows


def as_json(value: Any) -> Any:
    """Convert a value for JSON: records to objects, numbers that are not finite to None."""
    if dataclasses.is_dataclass(value):
        value = {each.name: getattr(value, each.name) for each in dataclasses.fields(value)}
    elif isinstance(value, tuple) and hasattr(value, '_asdict'):
        value = value._asdict()
    elif hasattr(value, 'tolist'):
        value = value.tolist()
    if isinstance(value, dict):
        return {name: as_json(part) for name, part in value.items()}
    if isinstance(value, list | tuple):
        return [as_json(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _row(cells: Sequence[object], kind: str) -> str:
    return '<tr>' + ''.join(f'<{kind}>{_text(cell)}</{kind}>' for cell in cells) + '</tr>'


def _text(cell: object) -> str:
    return escape('-' if cell is None else in_digits(cell)).replace('\n', '<br>')
