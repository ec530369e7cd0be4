# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Print an answer as tables and lines or as JSON."""

import dataclasses
import json
import os
import sys
from collections.abc import Iterable
from itertools import zip_longest
from typing import Any

from stickslip_ros.errors import printable, shortened
from stickslip_ros.sections import Section, as_json
from stickslip_ros.units import in_digits

CHECK_FAILED = 1
"""Exit status of a verb whose check failed."""
_WIDTH = 80
"""Columns of a table without a terminal."""
_NUMBER_MAX = 30
"""Characters of the longest number with its unit; longer cells are sentences."""


@dataclasses.dataclass(frozen=True)
class Answer:
    """The answer of a verb."""

    content: Any  # for ``--json``, in SI units, any argument of ``plain``; None: nothing
    parts: Iterable[Section | str] = ()  # for people, in this order
    status: int = 0  # exit status of the process

    def show(self, *, as_json: bool) -> None:
        if as_json:
            print_json(self.content)
            return
        for place, part in enumerate(self.parts):
            section = Section(notes=(part,)) if isinstance(part, str) else part
            if section.title and section.has_words:
                print('\n' * (place > 0) + printable(section.title))
            if section.rows:
                _print_table(section)
            for note in section.notes:
                print(printable(note))


def print_json(content: Any) -> None:
    """Print an object as JSON; None prints nothing."""
    if content is not None:
        print(json.dumps(as_json(content), indent=2))


def _print_table(section: Section) -> None:
    """Print rows as a table: names and sentences to the left, numbers to the right."""
    header = [str(each) for each in section.header]
    rows = [[shortened('-' if e is None else in_digits(e)) for e in row] for row in section.rows]
    try:
        from rich import box, console, table, text  # noqa: PLC0415 - a robot has none
    except ImportError:
        print(*('  '.join(row) for row in [header, *rows]), sep='\n')
        return
    shown = table.Table(
        box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False, show_header=bool(header)
    )
    for column, cells in enumerate(zip_longest(*rows, fillvalue='')):
        is_short = max(map(len, cells)) <= _NUMBER_MAX
        shown.add_column(
            text.Text(header[column] if header else ''),
            justify='right' if column and is_short else 'left',
            overflow='fold',
            no_wrap=is_short and not column,  # others wrap before a name
        )
    for row in rows:
        shown.add_row(*map(text.Text, row))
    is_known = sys.stdout.isatty() or 'COLUMNS' in os.environ
    console.Console(width=None if is_known else _WIDTH).print(shown)
