"""What is printed: an answer as tables and lines or as JSON."""

import dataclasses
import json
import os
import sys
from collections.abc import Iterable, Sequence
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from stickslip_ros.units import FACTORS

CHECK_FAILED = 1
"""Exit status of a verb that has done its work and found something wrong."""
_WIDTH = 80
"""Columns of a table where no terminal says how many it has."""


@dataclasses.dataclass(frozen=True)
class Answer:
    """What a verb has to say."""

    content: Any  # what ``--json`` prints, SI units: a dataclass or JSON; None: nothing
    parts: Iterable[str | Table] = ()  # what people read instead, one after the other
    status: int = 0  # exit status of the process

    def show(self, *, as_json: bool) -> None:
        """Print it in one of the two ways."""
        if as_json:
            print_json(self.content)
            return
        is_known = sys.stdout.isatty() or 'COLUMNS' in os.environ
        for place, part in enumerate(self.parts):
            if isinstance(part, str):
                print(part)
            else:
                print(end='\n' * (place > 0))
                Console(width=None if is_known else _WIDTH).print(part)


def print_json(content: Any) -> None:
    """Print an object as JSON; dataclasses become objects, nothing comes of None."""
    if dataclasses.is_dataclass(content) and not isinstance(content, type):
        content = dataclasses.asdict(content)
    if content is not None:
        print(json.dumps(content, indent=2))


def table(title: str, rows: Iterable[Sequence[object]], header: Sequence[str] = ()) -> Table:
    """Return rows as a table, the first column as names and the others right-aligned."""
    cells = [[str(cell) for cell in row] for row in rows]
    shown = Table(
        title=title,
        title_justify='left',
        box=SIMPLE_HEAD,
        show_edge=False,
        pad_edge=False,
        show_header=bool(header),
    )
    for column in range(max(len(row) for row in [header, *cells])):
        name = header[column] if header else ''
        shown.add_column(name, justify='right' if column else 'left', overflow='fold')
    for row in cells:
        shown.add_row(*row)
    return shown


def number(name: str, value: float, digits: str, unit: str = '') -> tuple[str, str, str]:
    """Return the row of a number in SI, shown in one of FACTORS with digits such as ``.4f``."""
    return name, f'{value * FACTORS[unit]:{digits}}', unit
