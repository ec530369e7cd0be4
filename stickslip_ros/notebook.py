"""Results as tables of HTML, which a notebook shows instead of their text."""

import dataclasses
from collections.abc import Iterable, Sequence
from html import escape
from typing import Any


class Shown:
    """A dataclass that a notebook shows as a table of its fields."""

    def _repr_html_(self) -> str:
        fields: Any = self
        return html_table(type(self).__name__, dataclasses.asdict(fields).items())


def html_table(title: str, rows: Iterable[Sequence[object]], header: Sequence[object] = ()) -> str:
    """Return a table; whatever its cells hold is shown as text."""
    lines = [f'<table><caption>{escape(title)}</caption>']
    if header:
        lines.append(_row(header, 'th'))
    lines += [_row(row, 'td') for row in rows]
    return '\n'.join([*lines, '</table>'])


def _row(cells: Sequence[object], kind: str) -> str:
    texts = (f'{cell:.6g}' if isinstance(cell, float) else str(cell) for cell in cells)
    return '<tr>' + ''.join(f'<{kind}>{escape(text)}</{kind}>' for text in texts) + '</tr>'
