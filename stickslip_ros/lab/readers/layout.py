# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Layout of text tables: encoding, delimiter, decimal sign, header, units, settings."""

import codecs
import csv
import math
import os
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from stickslip_ros.errors import RecordingError
from stickslip_ros.files import read_bytes
from stickslip_ros.lab.readers.headers import COMMENT, Cells, read_header, settings_in
from stickslip_ros.lab.readers.units import split_unit, unit_of_any

if TYPE_CHECKING:
    from pandas import DataFrame

HEAD_BYTES = 1 << 16  # bytes that determine the layout
BLANKS = r'\s+'
DIALECTS = [(delimiter, sign) for delimiter in ('\t', ';', ',', BLANKS) for sign in '.,']
DIALECTS.remove((',', ','))
NUMBER = {
    '.': re.compile(r'(?:[-+]\s*)?(\d+(\.\d*)?|\.\d+)(e[-+]?\d+)?', re.IGNORECASE),
    ',': re.compile(r'(?:[-+]\s*)?(\d+|\d*,\d+)(e[-+]?\d+)?', re.IGNORECASE),
}
_BLANK = re.compile(r'\s+')
EMPTY = ('', '-', '--', 'nan', 'na', 'n/a', '#n/a', '#nv', 'null', 'none')
"""Cells without a measured number, in lower case."""
OVER_RANGE = re.compile(
    r'[-+]*\s*(∞|infinity|(over|under)[ -]?(range|flow|load)?|ovf|ovr|o\.?l\.?|burnout)|[-+]{3,}',
    re.IGNORECASE,
)
"""Cells for a number out of an instrument's range."""
OVER_RANGE_NUMBER = 9.9e37  # same as a number (SCPI)
BOMS = {codecs.BOM_UTF8: 'utf-8-sig', codecs.BOM_UTF16_LE: 'utf-16', codecs.BOM_UTF16_BE: 'utf-16'}
MISSING = {*EMPTY, 'inf', '-inf'}  # cells for a missing number; may also be text
WINDOWS = 'cp1252'
_MARKED = re.compile(r'\[[^\[\]]*\]|\([^()]*\)')  # a unit in a row of units
_LINE_END = re.compile('\r\n|\n|\r')
TEXT_HINT = 'save it as text: CSV in UTF-8, one row for each point or sample'
DATE = re.compile(r'(\d{4}-\d\d-\d\d[ T]\d\d:\d\d:\d\d(?:\.\d{1,9})?)(?:Z|([-+])(\d\d):?(\d\d))?')
"""Date and time of day (ISO 8601), with the sign, hours and minutes of its zone."""
RECORD_LENGTH = 'record length'
"""First setting of an old Tektronix export: two columns of settings, time and signal."""
SETTINGS_WIDTH = 3  # columns left of the time in such a file
NUMBERING = ('no.', 'no', 'nr', 'number', 'sequence', '#', '1', '-')
"""Cells in a row of units for columns without a unit."""
Mask = tuple[bool | None, ...]


class Header(NamedTuple):
    """Header of a column: place, text, name, unit, first and last cell."""

    at: int  # place of the column, from 0
    text: str  # text in the file
    name: str  # without the unit
    unit: str  # in the text or in a row of units; empty if unknown
    cell: str = ''  # cell in the first row
    kind: str = 'number'  # or date, text, empty
    last: str = ''  # cell in the last row

    @property
    def shown(self) -> str:
        is_there = not self.unit or self.name != self.text or self.unit in self.text
        return self.text if is_there else f'{self.text} ({self.unit})'


@dataclass(frozen=True)
class TextLayout:
    """The layout of a table."""

    encoding: str  # pandas' name
    delimiter: str
    decimal: str
    columns: tuple[Header, ...]
    header: int  # line of the header, from 1; 0 without header
    first: int  # line of the first row
    notes: tuple[str, ...]  # comment lines above the table
    start_s: float | None = None  # first time in the header: added to the times
    step_s: float = 0.0  # time step without a column of times


class TextTable(NamedTuple):
    """A table with its layout."""

    source: 'Path | bytes | DataFrame'
    layout: TextLayout
    origin: str

    @property
    def where(self) -> str:
        """File and line of the header."""
        return f'{self.origin}: line {self.layout.header or self.layout.first}'


def layout_of(source: Path | bytes, origin: str) -> TextLayout:
    """Return the layout of a table from its first HEAD_BYTES; refuse files without numbers."""
    if isinstance(source, Path):
        head = read_bytes(source, 'check the path', HEAD_BYTES + 1)
    else:
        head = source[: HEAD_BYTES + 1]
    is_whole = len(head) <= HEAD_BYTES
    head = head[:HEAD_BYTES]
    encoding, text = _decode(head, origin)
    lines = _LINE_END.split(text)[: None if is_whole else -1]
    delimiter, decimal, rows, mask = _dialect(lines)
    if not text.strip():
        raise RecordingError(origin, 'is empty', TEXT_HINT)
    if not mask:
        problem = f'has no rows of numbers in its first {len(lines)} lines'
        raise RecordingError(f'{origin}: line 1', problem, TEXT_HINT)
    first, header, shown, settings = _parts(lines, rows, mask, delimiter, decimal)
    where = f'{origin}: line {header or first + 1}'
    names, units, start_s, step_s = read_header(
        settings, shown, rows[first : first + 2], decimal, where
    )
    if names and len(_trimmed(names)) < len(_trimmed(rows[first])):
        problem = f'has {len(rows[first])} values, the header in line {header} {len(names)} names'
        hint = 'name every column; with decimal commas separate columns by semicolons'
        raise RecordingError(f'{origin}: line {first + 1}', problem, hint)
    while len(rows) > first + 1 and not any(rows[-1]):
        rows.pop()
    last = rows[-1] if is_whole else _last_row(source, head, encoding, delimiter)
    notes = [line for at, line in enumerate(lines[:first]) if at != header - 1]
    return TextLayout(
        encoding=encoding,
        delimiter=delimiter,
        decimal=decimal,
        columns=_columns(names, units, rows[first:], last),
        header=header,
        first=first + 1,
        notes=tuple(COMMENT.sub('', note).rstrip() for note in notes if COMMENT.match(note)),
        start_s=start_s,
        step_s=step_s,
    )


def _parts(
    lines: Sequence[str], rows: Sequence[Cells], mask: Mask, delimiter: str, decimal: str
) -> tuple[int, int, tuple[Cells, Cells], dict[str, Cells]]:
    """Return first row, header line, names with units, and settings above or left of a table."""
    if rows[0][0].strip().lower() == RECORD_LENGTH and len(rows[0]) > SETTINGS_WIDTH:
        settings = settings_in(lines, rows)
        channel = settings.get('source', ['', ''])[1]
        return 0, 0, ([*[''] * SETTINGS_WIDTH, 'Time', channel], []), settings
    first, header, shown = _below(lines, rows, mask, delimiter, decimal)
    return first, header, shown, settings_in(lines[:first], rows[:first])


def _columns(names: Cells, units: Cells, rows: Sequence[Cells], last: Cells) -> tuple[Header, ...]:
    """Return the columns with the kind of their cells; numbers replace missing names."""
    width = max(len(names), len(rows[0]))
    names = names or [str(number) for number in range(1, width + 1)]
    kinds = [_kind_of([row[at].strip() for row in rows if len(row) > at]) for at in range(width)]
    filled = ((*e, *[''] * width)[:width] for e in (names, units, rows[0], kinds, last))
    return tuple(header_of(at, *e) for at, e in enumerate(zip(*filled, strict=True)))


def header_of(
    at: int, text: str, unit: str = '', cell: str = '', kind: str = 'number', last: str = ''
) -> Header:
    """Return the header of a column; its unit is in the text, else in a row of units."""
    name, own = split_unit(text.strip())
    own = 'ns' if kind == 'date' else own or unit.strip(' []()')
    return Header(at, text.strip(), name, own, cell.strip(), kind, last.strip())


def _kind_of(cells: Sequence[str]) -> str:
    """Return the kind of most cells of a column; numbers may have either decimal sign."""
    kinds = Counter[str]()
    for cell in cells:
        is_number = _is_number(cell, '.')
        if is_number is not None:
            kind = 'date' if DATE.fullmatch(cell) else 'text'
            kinds['number' if is_number or _is_number(cell, ',') else kind] += 1
    return max(kinds, key=lambda kind: (kinds[kind], kind == 'number'), default='empty')


def _last_row(source: Path | bytes, head: bytes, encoding: str, delimiter: str) -> Cells:
    """Return the cells of the last line of a long table."""
    if isinstance(source, bytes):
        end = source[-HEAD_BYTES:]
    else:
        with source.open('rb') as file:
            file.seek(-HEAD_BYTES, os.SEEK_END)
            end = file.read()
    mark = head[:2] if encoding == 'utf-16' else b''
    lines = _LINE_END.split((mark + end).decode(encoding, 'replace').rstrip())
    return _split(lines[-1], delimiter)


def _below(
    lines: Sequence[str], rows: Sequence[Cells], mask: Mask, delimiter: str, decimal: str
) -> tuple[int, int, tuple[Cells, Cells]]:
    """Return first row, header line, names and units of a table below its header."""
    first = next(at for at, row in enumerate(rows) if _is_row(_mask(row, decimal), mask))
    header, names = _header(lines, rows, first, delimiter)
    if header > 1 and _are_units(names, _mask(rows[first], decimal)):
        at, names_above = _header(lines, rows, header - 1, delimiter)
        if len(names_above) >= len(names):
            return first, at, (names_above, names)
    if header:
        above = next((row for row in reversed(rows[: header - 1]) if len(_trimmed(row)) > 1), [])
        is_row = any(_mask(rows[header - 1], decimal)) and not any(_mask(above, decimal))
        if is_row and len(above) >= len(rows[first]) <= len(rows[header - 1]):
            # The assumed header is a faulty row under the true header.
            first = header - 1
            header, names = _header(lines, rows, first, delimiter)
    return first, header, (names, [])


def _is_row(cells: Mask, usual: Mask) -> bool:
    """Return whether cells are numbers in the usual columns; some may be missing."""
    begins = cells[0] is not False or usual[0] is not None
    pairs = zip_longest(cells, usual)
    return begins and any(cells) and all(None in pair or pair[0] == pair[1] for pair in pairs)


def _are_units(names: Sequence[str], are_numbers: Mask) -> bool:
    """Return whether names above numbers are units: known, or in brackets."""
    pairs = zip(names, are_numbers, strict=False)
    units = [unit for name, is_number in pairs if is_number and (unit := name.strip(' []()'))]
    units = [unit for unit in units if unit.lower() not in NUMBERING]
    is_marked = all(_MARKED.fullmatch(name.strip()) for name in names if name.strip())
    return bool(units) and (is_marked or all(map(unit_of_any, units)))


def to_number(cell: str, decimal: str) -> float:
    """Return the number in a cell; NaN for other text."""
    text = cell.strip()
    if not NUMBER[decimal].fullmatch(text):
        return math.nan
    return float(_BLANK.sub('', text).replace(decimal, '.'))


def _decode(head: bytes, origin: str) -> tuple[str, str]:
    """Return encoding and text; text that is not Unicode counts as Windows-1252."""
    for encoding in [BOMS[bom] for bom in BOMS if head.startswith(bom)] or ['utf-8', WINDOWS]:
        try:
            text = codecs.getincrementaldecoder(encoding)().decode(head)
        except UnicodeError:
            continue
        if '\0' not in text:
            return encoding, text
    raise RecordingError(origin, 'is no text', TEXT_HINT)


def _split(line: str, delimiter: str) -> Cells:
    if delimiter == BLANKS:
        return line.split() or ['']
    return next(csv.reader([line], delimiter=delimiter, skipinitialspace=True), ['']) or ['']


def _mask(row: Sequence[str], decimal: str) -> Mask:
    """Return whether each cell is a number; None if it may be a missing number."""
    return tuple([_is_number(text.strip(), decimal) for text in row])


def _is_number(text: str, decimal: str) -> bool | None:
    if text[:1].isdigit() or not (text.lower() in MISSING or OVER_RANGE.fullmatch(text)):
        return bool(NUMBER[decimal].fullmatch(text.rstrip(' %')))
    return None


def _dialect(lines: Sequence[str]) -> tuple[str, str, list[Cells], Mask]:
    """Return delimiter, decimal sign, cells and usual mask: the dialect with most numbers."""
    best: tuple[tuple[float, int], tuple[str, str, list[Cells], Mask]]
    best = ((0.0, 0), (',', '.', [[line] for line in lines], ()))
    split, of_a_column = dict[str, list[Cells]](), set[str]()
    for delimiter, decimal in DIALECTS:
        if delimiter not in split:
            split[delimiter] = [_split(line, delimiter) for line in lines]
        rows = split[delimiter]
        if max(map(len, rows)) == 1:  # the delimiter is absent, as another one may have been
            if decimal in of_a_column:
                continue
            of_a_column.add(decimal)
        counts = Counter(_mask(row, decimal) for row in rows)
        masks = {each: count for each, count in counts.items() if any(each) and len(each) > 1}
        if counts[True,] > len(lines) // 2:  # one column
            masks[True,] = counts[True,]
        if not masks:
            continue

        def weight(mask: Mask, masks: Mapping[Mask, int] = masks) -> tuple[bool, bool, int, int]:
            numbers = mask.count(True)
            return numbers > 1, False not in mask, masks[mask], numbers

        mask = max(masks, key=weight)
        numbers = mask.count(True)
        score = (numbers / (numbers + mask.count(False)), numbers * masks[mask])
        if score > best[0]:
            best = (score, (delimiter, decimal, rows, mask))
    return best[1]


def _header(
    lines: Sequence[str], rows: Sequence[Cells], first: int, delimiter: str
) -> tuple[int, Cells]:
    """Return line and names of the header above a row; 0 and [] without header."""
    for at in reversed(range(first)):
        if not lines[at].strip(' \t,;'):
            continue
        line = COMMENT.sub('', lines[at], count=1) if COMMENT.match(lines[at]) else lines[at]
        width = len(_trimmed(rows[first]))
        names = _split(line, delimiter)
        if delimiter == BLANKS and len(names) != width:
            whole = re.sub(r'(?<!\s)\s+(?=[\[(])', '', line.strip())  # "Force (mN)" is one name
            names = min(
                (re.split(r'\s{2,}|\t', line.strip()), whole.split()),
                key=lambda each: abs(len(each) - width),
            )
        count = len(_trimmed(names))
        is_table = count >= min(width, 2) and (line is lines[at] or count == width)
        return (at + 1, names) if is_table else (0, [])
    return 0, []


def _trimmed(row: Sequence[str]) -> list[str]:
    """Return a row without trailing empty cells."""
    kept = list(row)
    while kept and not kept[-1].strip():
        kept.pop()
    return kept
