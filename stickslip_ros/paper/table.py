"""The numbers behind a figure: rows of a CSV file with units in the header."""

import csv
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stickslip_ros.contact.profile import Array
from stickslip_ros.study.journal import Row


@dataclass(frozen=True)
class Table:
    """
    Rows that share their columns.

    Attributes
    ----------
    columns : tuple of str
        Names, each of a quantity ending with its unit.
    rows : sequence of dict
        A value for every column; not a number where there is none.

    """

    columns: tuple[str, ...]
    rows: Sequence[Row]

    def where(self, **values: object) -> 'Table':
        """Return the rows that have these values."""
        kept = [row for row in self.rows if all(row[name] == values[name] for name in values)]
        return Table(self.columns, kept)

    def column(self, name: str) -> Array:
        """Return a column of numbers, shape (rows,)."""
        return np.array([row[name] for row in self.rows], dtype=float)

    def different(self, name: str) -> list[object]:
        """Return the different values of a column, in the order of their appearance."""
        return list(dict.fromkeys(row[name] for row in self.rows))

    def groups(self, name: str) -> Iterator[tuple[object, 'Table']]:
        """Return each different value of a column with its rows."""
        for value in self.different(name):
            yield value, self.where(**{name: value})

    def write(self, path: Path) -> None:
        """Write the table as CSV; what is not a number stays empty."""
        with path.open('w', newline='', encoding='utf-8') as file:
            writer = csv.writer(file, lineterminator='\n')
            writer.writerow(self.columns)
            writer.writerows(self._texts())

    def _texts(self) -> Iterable[list[object]]:
        for row in self.rows:
            values = [row[name] for name in self.columns]
            yield ['' if isinstance(v, float) and math.isnan(v) else v for v in values]
