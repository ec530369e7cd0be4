# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Assignment of table columns to quantities, by name and unit or by the user."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from stickslip_ros.errors import quoted
from stickslip_ros.lab.readers.layout import DATE, Header, TextLayout, TextTable
from stickslip_ros.lab.readers.refusal import option_for, to_fill, unclear, unit_to_fill
from stickslip_ros.lab.readers.units import factor_of, split_unit
from stickslip_ros.lab.readers.vocabulary import CLOCK_QUANTITY, Vocabulary

ROW = Header(-1, 'row number', 'row number', '')
"""The column of row numbers, which no file has."""
SUM = ' + '
"""Between columns that are added."""
_NUMBERED = re.compile(r'#(\d+)')  # a column by its number, from 1
_SECONDS = re.compile(r'(.*?)_?secs?\n\1_?(nano|n)secs?')
"""Names of two columns that make a time: its seconds and nanoseconds."""
_WITH_UNIT = re.compile(r'[-+]?\d[\d.,]*\s*[^\W\d]+')  # a wrong cell of a column of numbers
_WIDE = re.compile(r'[-+]?\d{16,}')  # has more digits than a float
_EPOCH = re.compile(r'1\d{9}')  # seconds of 2001 to 2033

Addends = tuple[tuple[Header, str], ...]  # a column and its unit, or several that are added
Found = dict[str, list[Addends]]  # candidates


@dataclass(frozen=True)
class Column:
    """A recognised column of a table."""

    name: str  # quantity; then header and unit in the file, and factor to SI
    header: str
    unit: str
    factor: float
    index: int  # its place in the table
    first: float = 0.0  # its first number, in SI
    parts: tuple[tuple[int, float, int], ...] = ()  # place, factor, subtracted number of addends

    @property
    def begin_s(self) -> float:
        """Time subtracted before whole numbers become floats, which have fewer digits, s."""
        return float(sum(factor * begin for _, factor, begin in self.parts))


def plain(name: str) -> str:
    """Return a name in lower case with one blank between words."""
    return ' '.join(filter(None, re.split(r'[\s_-]+', name.strip().lower())))


def find_columns(
    table: TextTable, vocabulary: Vocabulary, named: Mapping[str, str]
) -> tuple[Found, list[Header]]:
    """
    Return candidate columns of each quantity, and the other columns.

    If the user names a measured quantity, only named ones are read. Several columns of times are
    clocks, each of the columns behind it.

    """
    layout = table.layout
    found = {
        n: _named(table, n, named[n], vocabulary) for n in named if n in vocabulary.quantities
    }
    if CLOCK_QUANTITY in vocabulary.quantities and CLOCK_QUANTITY not in found and layout.step_s:
        found[CLOCK_QUANTITY] = [((ROW, f'{layout.step_s!r} s'),)]
    others, unread = _recognised(layout, vocabulary, found)
    if CLOCK_QUANTITY in vocabulary.quantities and CLOCK_QUANTITY not in {*found, *others}:
        names = ((each, '\n'.join(e.text for e in each).lower()) for each in pairwise(unread))
        for one, two in [each for each, both in names if _SECONDS.fullmatch(both)][:1]:
            others[CLOCK_QUANTITY] = [((one, 's'), (two, 'ns'))]
            unread = [each for each in unread if each not in {one, two}]
    return found | others, unread


def _recognised(
    layout: TextLayout, vocabulary: Vocabulary, found: Found
) -> tuple[Found, list[Header]]:
    """Return the columns of wanted quantities that are not found yet, and the others."""
    asked = {
        vocabulary.of(name) for name in found if name != CLOCK_QUANTITY
    } - vocabulary.conditions
    wanted = {*vocabulary.conditions, *asked} if asked else {*vocabulary.quantities}
    taken = {header for several in found.values() for places in several for header, _ in places}
    others, unread = dict[str, list[Addends]](), list[Header]()
    for header in layout.columns:
        if header in taken or not header.text.strip():
            continue
        target = vocabulary.recognise(header.name, header.unit) or ''
        is_number = header.kind != 'text' or _WITH_UNIT.fullmatch(header.cell)
        is_readable = is_number or target in vocabulary.words
        if target and target not in found and vocabulary.of(target) in wanted and is_readable:
            others.setdefault(target, []).append(((header, header.unit),))
        else:
            unread.append(header)
    return others, unread


def resolve_columns(found: Found, table: TextTable, vocabulary: Vocabulary) -> list[Column]:
    """Return columns with units, one for each quantity but the time; refuse ambiguous ones."""
    first = min(places[0][0].at for several in found.values() for places in several)
    for name, several in found.items():
        headers = [places[0][0] for places in several]
        are_clocks = name == CLOCK_QUANTITY and _are_clocks(headers, table.layout, first)
        if len(headers) > 1 and not are_clocks:
            problem = f'columns {" and ".join(quoted(each.text) for each in headers)}'
            options = [to_fill(name, vocabulary.quantities[name].unit)]
            raise unclear(table, f'{problem} may both be {name}', options)
    _check_units(found, table, vocabulary)
    return [
        _column(name, places, vocabulary.quantities[name].unit, _begins(name, several))
        for name, several in found.items()
        for places in several
    ]


def _are_clocks(headers: Sequence[Header], layout: TextLayout, first: int) -> bool:
    """Return whether each column of times stands before values of its own."""
    return headers[0].at == first and all(
        any(each.text for each in layout.columns[one.at + 1 : two.at])
        for one, two in pairwise(headers)
    )


def _begins(name: str, several: Sequence[Addends]) -> list[int]:
    """Return the whole numbers to subtract from times, which have too many digits for a float."""
    cells = [header.cell for header, _ in several[0]]
    if name != CLOCK_QUANTITY or len({unit for (_, unit), *_ in several}) != 1:
        return [0] * len(cells)
    is_epoch = [_WIDE.fullmatch(e) or (cells[1:] and _EPOCH.fullmatch(e)) for e in cells]
    return [
        nanoseconds(cell) or (int(cell) if wide else 0)
        for cell, wide in zip(cells, is_epoch, strict=True)
    ]


def nanoseconds(cell: str) -> int:
    """Return the time since 1970 of a date with a time of day, ns; 0 for other text."""
    found = DATE.fullmatch(cell.strip())
    if found is None:
        return 0
    zone_s = 60 * (60 * int(found[3] or 0) + int(found[4] or 0)) * (-1 if found[2] == '-' else 1)
    return int(np.datetime64(found[1], 'ns').astype(np.int64)) - zone_s * 1_000_000_000


def _column(name: str, places: Addends, si_unit: str, begins: Sequence[int]) -> Column:
    parts = tuple(
        (header.at, factor_of(unit, si_unit) or 0.0, begin)
        for (header, unit), begin in zip(places, begins, strict=True)
    )
    text = SUM.join(header.text for header, _ in places)
    unit = SUM.join(unit for _, unit in places)
    return Column(name, text, unit, parts[0][1], parts[0][0], parts=parts)


def columns_named(layout: TextLayout, text: str) -> Addends:
    """Return columns with a name, or that with this ``#number``, and their units."""
    bare, unit = split_unit(text)
    bares = [each.name for each in layout.columns]
    texts = [each.text for each in layout.columns]
    found = list[Header]()
    for wanted, names in ((text, texts), (bare, texts), (bare, bares)):
        pairs = zip(layout.columns, names, strict=True)
        found = found or [each for each, name in pairs if name and plain(name) == plain(wanted)]
    if not found and (number := _NUMBERED.fullmatch(bare)):
        found = [each for each in layout.columns if each.at == int(number[1]) - 1]
    return tuple((e, e.unit if e.kind == 'date' else unit or e.unit) for e in found)


def _named(table: TextTable, name: str, text: str, vocabulary: Vocabulary) -> list[Addends]:
    """Return the column and unit, or sum of columns, named by the user."""
    layout = table.layout
    parts = [text] if columns_named(layout, text) else text.split(SUM)
    found = [columns_named(layout, part) for part in parts]
    options = [to_fill(name, vocabulary.quantities[name].unit)]
    for part, places in zip(parts, found, strict=True):
        if not places:
            raise unclear(table, f'there is no column {quoted(part)}', options)
        if len(places) > 1 and (name != CLOCK_QUANTITY or len(parts) > 1):
            problem = f'has {len(places)} columns {quoted(split_unit(part)[0])}'
            raise unclear(table, problem, [options[0].replace('"...', '"#...')])
        for header, _ in places:
            if header.kind == 'text' and name not in vocabulary.words:
                raise unclear(table, f'column {quoted(header.text)} is text', options)
    return list(zip(*found, strict=True))


def _check_units(found: Found, table: TextTable, vocabulary: Vocabulary) -> None:
    """Refuse missing or wrong units, all columns at once."""
    without = list[Header]()
    options = list[str]()
    for name, several in found.items():
        si = vocabulary.quantities[name].unit
        wrong = [each for each in several if not all(factor_of(unit, si) for _, unit in each)]
        for [(header, unit), *others] in wrong[:1]:
            if unit and not others:
                problem = f'column {quoted(header.text)} is in {unit}, {name} in {si}'
                option = option_for(name, table.layout, header, f'... {si}')
                hint = f'fill in how many {si} are 1 {unit}, {option}'
                raise unclear(table, problem, [to_fill(name, si)], hint)
            option = option_for(name, table.layout, header, unit_to_fill(si))
            if len(wrong) > 1:  # clocks of one name
                option = f'--map {name}="{header.name} ({unit_to_fill(si)})"'
            if others:
                places = [(header, unit_to_fill(si)), *((each, 'ns') for each, _ in others)]
                added = SUM.join(f'#{each.at + 1} ({unit})' for each, unit in places)
                option = f'--map {name}="{added}"'
            without.append(header)
            options.append(option)
    if without:
        problem = f'has no unit for {", ".join(quoted(each.text) for each in without)}'
        raise unclear(table, problem, (), f'fill in {" ".join(options)}')
