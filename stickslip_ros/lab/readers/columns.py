# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Assignment of table columns to quantities, by name and unit or by the user."""

import re
from collections.abc import Mapping
from itertools import pairwise

from stickslip_ros.errors import RecordingError, quoted
from stickslip_ros.lab.readers.layout import Header, TextForm
from stickslip_ros.lab.readers.measured import Column, plain, recognised
from stickslip_ros.lab.readers.numbers import BACK, NUMBERS, SIGMA
from stickslip_ros.lab.readers.remedies import (
    EPOCH,
    SUM,
    by_number,
    likely_unit,
    listed,
    map_hint,
    suggestion,
)
from stickslip_ros.lab.readers.units import factor_of, split_unit
from stickslip_ros.parameters import Spec

ROW = Header(-1, 'row number', 'row number', '')
"""The column of row numbers, which no file has."""
_NUMBERED = re.compile(r'#(\d+)')  # a column by its number, from 1
_SECONDS = re.compile(r'(.*?)_?secs?\n\1_?(nano|n)secs?')
"""Names of two columns that make a time."""
_WIDE = re.compile(r'[-+]?\d{16,}')  # has more digits than a float
_PAIR = ('voltage_v', 'position_m')  # told by their units if no name tells anything

Addends = tuple[tuple[Header, str], ...]  # a column and its unit, or several that are added
Found = dict[str, list[Addends]]  # candidates


def find_columns(
    layout: TextForm, specs: Mapping[str, Spec], named: Mapping[str, str], where: str
) -> tuple[Found, list[Header]]:
    """
    Return candidate columns of each quantity, and the other columns.

    If the user names a measured quantity, only named ones are read. Several columns of times are
    clocks, each of the columns behind it.

    """
    found: Found = {
        name: _named(layout, name, named[name], specs, where) for name in named if name in specs
    }
    conditions = {'time_s'} if 'time_s' in specs else specs.keys() - NUMBERS.keys()
    asked = {name.replace(SIGMA, '_') for name in found} - conditions
    taken = {header for several in found.values() for places in several for header, _ in places}
    unread, others = list[Header](), dict[str, list[Addends]]()
    if 'time_s' in specs and 'time_s' not in named and layout.step_s:
        found['time_s'] = [((ROW, f'{layout.step_s!r} s'),)]
    for header in layout.columns:
        if header in taken or not header.text.strip():
            continue
        target = recognised(header.name, header.unit, specs) or ''
        is_aside = asked and target.replace(SIGMA, '_') not in {*conditions, *asked}
        # A second clock of a header with a start, Graphtec, has parts of a second.
        is_part = target == 'time_s' and layout.start_s is not None and target in others
        if not target or target in found or is_aside or is_part:
            unread.append(header)
        else:
            others.setdefault(target, []).append(((header, header.unit),))
    if 'time_s' in specs and 'time_s' not in {**found, **others}:
        for one, two in pairwise(unread):
            if _SECONDS.fullmatch(f'{one.text}\n{two.text}'.lower()):
                others['time_s'] = [((one, 's'), (two, 'ns'))]
                unread = [each for each in unread if each not in {one, two}]
                break
    if {*found, *others} == {'time_s'}:
        known = [each for each in unread if each.unit]
        fits = [[e for e in known if factor_of(e.unit, specs[name].unit)] for name in _PAIR]
        if [len(each) for each in (known, *fits)] == [2, 1, 1]:
            others |= {name: [((e, e.unit),)] for name, [e] in zip(_PAIR, fits, strict=True)}
            unread = [each for each in unread if [each] not in fits]
    found |= others
    if {*BACK, *BACK.values()} & found.keys() and [
        header.name.lower() for [(header, _), *_] in found.get('force_n', [])
    ] == ['load']:
        found['load_n'] = found.pop('force_n')
    return found, unread


def resolve_columns(
    found: Found, layout: TextForm, specs: Mapping[str, Spec], where: str
) -> list[Column]:
    """Return columns with units, one for each quantity but the time; refuse ambiguous ones."""
    first = min(places[0][0].at for several in found.values() for places in several)
    for name, several in found.items():
        headers = [each[0][0] for each in several]
        between = (
            any(each.text for each in layout.columns[one.at + 1 : two.at])
            for one, two in pairwise(headers)
        )
        is_clock = name == 'time_s' and all(between) and headers[0].at == first
        if len(headers) > 1 and not is_clock:
            problem = f'columns {" and ".join(quoted(each.text) for each in headers)}'
            hint = f'choose one: {map_hint(name, layout, headers[0])}'
            raise RecordingError(where, f'{problem} may both be {name}', hint)
    _check_units(found, layout, specs, where)
    columns = list[Column]()
    for name, several in found.items():
        is_time = name == 'time_s' and len({unit for (_, unit), *_ in several}) == 1
        cells = [header.cell if is_time else '' for header, _ in several[0]]
        is_wide = [_WIDE.fullmatch(e) or (cells[1:] and EPOCH.fullmatch(e)) for e in cells]
        begins = [int(e) if wide else 0 for e, wide in zip(cells, is_wide, strict=True)]
        for each in several:
            parts = tuple(
                (header.at, factor_of(unit, specs[name].unit) or 0.0, begin)
                for (header, unit), begin in zip(each, begins, strict=True)
            )
            text, unit = (SUM.join(e) for e in zip(*((h.text, u) for h, u in each), strict=True))
            columns.append(Column(name, text, unit, parts[0][1], parts[0][0], parts=parts))
    return columns


def columns_named(layout: TextForm, text: str) -> Addends:
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
    return tuple((each, unit or each.unit) for each in found)


def _named(
    layout: TextForm, name: str, text: str, specs: Mapping[str, Spec], where: str
) -> list[Addends]:
    """Return the column and unit, or sum of columns, named by the user."""
    parts = [text] if columns_named(layout, text) else text.split(SUM)
    found = [columns_named(layout, part) for part in parts]
    for part, places in zip(parts, found, strict=True):
        if not places:
            there = [each for each in layout.columns if each.text]
            hint = f'name one of {listed(there)}'
            if option := suggestion([name], layout, there, specs)[1]:
                hint += f', as {option}'
            raise RecordingError(where, f'there is no column {quoted(part)}', hint)
        if len(places) > 1 and (name != 'time_s' or len(parts) > 1):
            header, unit = places[0]
            shown = by_number([(header, unit or likely_unit(header, specs[name].unit))])
            problem = f'has {len(places)} columns {quoted(split_unit(part)[0])}'
            raise RecordingError(where, problem, f'name one by number: --map {name}="{shown}"')
    return list(zip(*found, strict=True))


def _check_units(found: Found, layout: TextForm, specs: Mapping[str, Spec], where: str) -> None:
    """Refuse missing or wrong units, all columns at once."""
    unsaid = []
    for name, several in found.items():
        si = specs[name].unit
        wrong = [each for each in several if not all(factor_of(unit, si) for _, unit in each)]
        for [(header, unit), *others] in wrong[:1]:
            shown = likely_unit(header, si)
            if unit and not others:
                problem = f'column {quoted(header.text)} is in {unit}, {name} in {si}'
                option = map_hint(name, layout, header, f'0.05 {si}')
                raise RecordingError(where, problem, f'say how many {si} are 1 {unit}: {option}')
            option = map_hint(name, layout, header, shown)
            if len(wrong) > 1:  # clocks of one name
                option = f'--map {name}="{header.name} ({shown})"'
            if others:
                added = by_number([(header, shown), *((each, 'ns') for each, _ in others)])
                option = f'--map {name}="{added}"'
            unsaid.append((header, shown, option))
    if unsaid:
        headers, units, options = zip(*unsaid, strict=True)
        hint = f'is it {", ".join(units)}? give it by {" ".join(options)}'
        raise RecordingError(where, f'has no unit for {listed(headers)}', hint)
