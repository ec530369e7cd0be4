# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Assign table columns to quantities, by name and unit or by the user."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from stickslip_ros.errors import quoted
from stickslip_ros.lab.readers.layout import DATE, Header, TextLayout, TextTable
from stickslip_ros.lab.readers.refusal import option_for, to_fill, unclear, unit_to_fill
from stickslip_ros.lab.readers.units import factor_of, split_unit
from stickslip_ros.lab.readers.vocabulary import CLOCK_QUANTITY, Vocabulary

ROW = Header(-1, 'row number', 'row number', '')
"""A virtual column of row numbers."""
_NUMBERED = re.compile(r'#(\d+)')  # a column by its number, from 1
_WIDE = re.compile(r'[-+]?\d{16,}')  # more digits than a float holds


class Candidate(NamedTuple):
    """A column and its unit, from the file or the user."""

    header: Header
    unit: str


Found = dict[str, list[Candidate]]  # by quantity


@dataclass(frozen=True)
class Column:
    """A recognised column of a table."""

    name: str  # quantity
    header: str  # in the file
    unit: str  # in the file
    factor: float  # to SI
    index: int  # place in the table
    first: float = 0.0  # first number, SI
    begin: int = 0  # subtracted from integers with more digits than a float holds

    @property
    def begin_s(self) -> float:
        return self.factor * self.begin


def plain(name: str) -> str:
    """Return a name in lower case with single blanks between words."""
    return ' '.join(filter(None, re.split(r'[\s_-]+', name.strip().lower())))


def find_columns(
    table: TextTable, vocabulary: Vocabulary, named: Mapping[str, str]
) -> tuple[Found, list[Header]]:
    """
    Return candidate columns of each quantity, and the other columns.

    If the user names a measured quantity, only named columns are read. With several columns of
    times, each is the clock of the columns after it.

    """
    layout = table.layout
    found = {
        n: _named(table, n, named[n], vocabulary) for n in named if n in vocabulary.quantities
    }
    if CLOCK_QUANTITY in vocabulary.quantities and CLOCK_QUANTITY not in found and layout.step_s:
        found[CLOCK_QUANTITY] = [Candidate(ROW, f'{layout.step_s!r} s')]
    asked = {vocabulary.of(name) for name in found if name != CLOCK_QUANTITY}
    asked -= vocabulary.conditions
    wanted = {*vocabulary.conditions, *asked} if asked else {*vocabulary.quantities}
    taken = {place.header for places in found.values() for place in places}
    others, unread = dict[str, list[Candidate]](), list[Header]()
    for header in layout.columns:
        if header in taken or not header.text.strip():
            continue
        target = vocabulary.recognise(header.name, header.unit) or ''
        is_readable = header.kind != 'text' or target in vocabulary.words
        if target and target not in found and vocabulary.of(target) in wanted and is_readable:
            others.setdefault(target, []).append(Candidate(header, header.unit))
        else:
            unread.append(header)
    return found | others, unread


def resolve_columns(found: Found, table: TextTable, vocabulary: Vocabulary) -> list[Column]:
    """Return columns with units, one per quantity, several for time; refuse ambiguous columns."""
    first = min(place.header.at for places in found.values() for place in places)
    for name, places in found.items():
        headers = [place.header for place in places]
        are_clocks = name == CLOCK_QUANTITY and _are_clocks(headers, table.layout, first)
        if len(headers) > 1 and not are_clocks:
            problem = f'columns {" and ".join(quoted(each.text) for each in headers)}'
            options = [to_fill(name, vocabulary.quantities[name].unit)]
            raise unclear(table, f'{problem} may both be {name}', options)
    _check_units(found, table, vocabulary)
    columns = []
    for name, places in found.items():
        begin = _begin(places) if name == CLOCK_QUANTITY else 0
        for header, unit in places:
            factor = factor_of(unit, vocabulary.quantities[name].unit) or 0.0
            columns.append(Column(name, header.text, unit, factor, header.at, begin=begin))
    return columns


def _are_clocks(headers: Sequence[Header], layout: TextLayout, first: int) -> bool:
    """Return whether each column of times precedes its own columns of values."""
    return headers[0].at == first and all(
        any(each.text for each in layout.columns[one.at + 1 : two.at])
        for one, two in pairwise(headers)
    )


def _begin(clocks: Sequence[Candidate]) -> int:
    """Return an integer to subtract from times with too many digits for a float."""
    cell = clocks[0].header.cell
    if len({each.unit for each in clocks}) > 1:
        return 0
    return nanoseconds(cell) or (int(cell) if _WIDE.fullmatch(cell) else 0)


def nanoseconds(cell: str) -> int:
    """Return the time since 1970 of a date with a time of day, ns; 0 for other text."""
    found = DATE.fullmatch(cell.strip())
    if found is None:
        return 0
    zone_s = 60 * (60 * int(found[3] or 0) + int(found[4] or 0)) * (-1 if found[2] == '-' else 1)
    return int(np.datetime64(found[1], 'ns').astype(np.int64)) - zone_s * 1_000_000_000


def columns_named(layout: TextLayout, text: str) -> list[Candidate]:
    """Return columns with a name or ``#number``, and their units."""
    bare, unit = split_unit(text)
    bares = [each.name for each in layout.columns]
    texts = [each.text for each in layout.columns]
    found = list[Header]()
    for wanted, names in ((text, texts), (bare, texts), (bare, bares)):
        pairs = zip(layout.columns, names, strict=True)
        found = found or [each for each, name in pairs if name and plain(name) == plain(wanted)]
    if not found and (number := _NUMBERED.fullmatch(bare)):
        found = [each for each in layout.columns if each.at == int(number[1]) - 1]
    return [Candidate(e, e.unit if e.kind == 'date' else unit or e.unit) for e in found]


def _named(table: TextTable, name: str, text: str, vocabulary: Vocabulary) -> list[Candidate]:
    """Return column and unit named by the user; several columns if they are clocks."""
    places = columns_named(table.layout, text)
    options = [to_fill(name, vocabulary.quantities[name].unit)]
    if not places:
        raise unclear(table, f'there is no column {quoted(text)}', options)
    if len(places) > 1 and name != CLOCK_QUANTITY:
        problem = f'has {len(places)} columns {quoted(split_unit(text)[0])}'
        raise unclear(table, problem, [options[0].replace('"...', '"#...')])
    for header, _ in places:
        if header.kind == 'text' and name not in vocabulary.words:
            raise unclear(table, f'column {quoted(header.text)} is text', options)
    return places


def _check_units(found: Found, table: TextTable, vocabulary: Vocabulary) -> None:
    """Refuse missing or wrong units, all columns at once."""
    without = list[Header]()
    options = list[str]()
    for name, places in found.items():
        si = vocabulary.quantities[name].unit
        wrong = [each for each in places if not factor_of(each.unit, si)]
        for header, unit in wrong[:1]:
            if unit:
                problem = f'column {quoted(header.text)} is in {unit}, {name} in {si}'
                option = option_for(name, table.layout, header, f'... {si}')
                hint = f'fill in how many {si} are 1 {unit}, {option}'
                raise unclear(table, problem, [to_fill(name, si)], hint)
            option = option_for(name, table.layout, header, unit_to_fill(si))
            if len(wrong) > 1:  # clocks of one name
                option = f'--map {name}="{header.name} ({unit_to_fill(si)})"'
            without.append(header)
            options.append(option)
    if without:
        problem = f'has no unit for {", ".join(quoted(each.text) for each in without)}'
        raise unclear(table, problem, (), f'fill in {" ".join(options)}')
