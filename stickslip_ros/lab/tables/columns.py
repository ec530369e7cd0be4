# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Assignment of table columns to quantities, by name and unit or by the user."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from stickslip_ros.errors import QUOTED, RecordingError, quoted
from stickslip_ros.lab.tables.layout import TextForm, to_number
from stickslip_ros.lab.tables.numbers import BACK, DIRECTIONS, NUMBERS, SIGMA, sigma_name
from stickslip_ros.lab.tables.units import factor_of, split_unit
from stickslip_ros.parameters import SENSORS, Spec

USUAL: Mapping[str, tuple[str, ...]] = {
    'time_s': ('time', 't', 'x axis', 'x value', 'zeit'),
    'position_m': ('position', 'pos', 'x', 'displacement', 'weg', 'auslenkung'),
    'voltage_v': ('voltage', 'u', 'v', 'piezo', 'piezo voltage', 'spannung', 'piezospannung'),
    'foot_m': ('foot', 'feet', 'stroke', 'hub', 'fuß', 'fuss'),
    'preload_n': ('preload', 'fp', 'normal force', 'vorlast', 'vorspannkraft', 'normalkraft'),
    'amplitude_m': ('amplitude', 'stroke', 'hub'),
    'frequency_hz': ('frequency', 'freq', 'f', 'frequenz'),
    'load_n': ('external force', 'external load'),
    'direction': ('direction', 'richtung'),
    'tolerance': ('tolerance', 'toleranz'),
    **{name: tuple(each.words.split(', ')) for name, each in NUMBERS.items() if each.words},
    **{each.quantity: (each.words,) for each in SENSORS if each.switch},
}
"""Usual names of quantities, in lower case, words separated by one blank."""
SIGMAS = re.compile(
    r'(\b(sigma|σ|std|sd|stdev|std dev|standard (deviation|error)|uncertainty|err|error|'
    r'unsicherheit|standardabweichung|fehler)\b|±)( (of|der|des)\b)?'
)
_DIRECTED = re.compile(rf'\b({"|".join(filter(str.isalpha, DIRECTIONS))})\b')
MEAN = re.compile(r'\b(mean|average|avg|mittelwert|mittlere)\b( (of|der|des)\b)?')
LIKELY = {'m': 'nm', 'N': 'mN', 's': 's', 'V': 'V', 'Hz': 'Hz', '%': '%'}
LIKELY |= {'kg': 'g', 'F': 'nF', 'm/s': 'mm/s', 'V/s': 'V/us'}
"""Units suggested for a column without a unit."""
_EPOCHS = ((1e17, 'ns'), (1e14, 'us'), (1e11, 'ms'))
"""Units suggested for times from such a number on: it counts from 1970."""
ROW = -1
"""Place of a column of row numbers, which no file has."""
SUM, _NUMBERED = ' + ', re.compile(r'#(\d+)')
"""Between columns that are added; a column by its number, from 1."""
_SECONDS = re.compile(r'(.*?)_?secs?\n\1_?(nano|n)secs?')
"""Names of two columns that make a time."""
_WIDE = re.compile(r'[-+]?\d{16,}')  # has more digits than a float
_EPOCH = re.compile(r'1\d{9}')  # seconds of 2001 to 2033
_UNCLEAR = re.compile(r'["`$\\]')  # what a shell reads

Places = tuple[tuple[int, str], ...]  # place and unit of a column, or of several that are added
Found = dict[str, list[Places]]  # candidates


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


def find_columns(
    layout: TextForm, specs: Mapping[str, Spec], named: Mapping[str, str], where: str
) -> tuple[Found, list[int]]:
    """
    Return candidate columns of each quantity, and the places of the other columns.

    If the user names a measured quantity, only named ones are read. Several columns of times are
    clocks, each of the columns behind it.

    """
    found: Found = {
        name: _named(layout, name, named[name], specs, where) for name in named if name in specs
    }
    conditions = {'time_s'} if 'time_s' in specs else specs.keys() - NUMBERS.keys()
    asked = {name.replace(SIGMA, '_') for name in found} - conditions
    taken = {at for several in found.values() for places in several for at, _ in places}
    unread, others = list[int](), dict[str, list[Places]]()
    if 'time_s' in specs and 'time_s' not in named and layout.step_s:
        found['time_s'] = [((ROW, f'{layout.step_s!r} s'),)]
    for at, header in enumerate(layout.names):
        if at in taken or not header.strip():
            continue
        bare, unit = split_unit(header)
        unit = unit or layout.units[at]
        target = recognised(bare, unit, specs) or ''
        is_aside = asked and target.replace(SIGMA, '_') not in {*conditions, *asked}
        # A second clock of a header with a start, Graphtec, has parts of a second.
        is_part = target == 'time_s' and layout.start_s is not None and target in others
        if not target or target in found or is_aside or is_part:
            unread.append(at)
        else:
            others.setdefault(target, []).append(((at, unit),))
    if 'time_s' in specs and 'time_s' not in {**found, **others}:
        for at, after in pairwise(unread):
            names = f'{layout.names[at]}\n{layout.names[after]}'.lower()
            if after == at + 1 and _SECONDS.fullmatch(names):
                others['time_s'] = [((at, 's'), (after, 'ns'))]
                unread = [each for each in unread if each not in {at, after}]
                break
    return {**found, **others}, unread


def resolve_columns(
    found: Found, layout: TextForm, specs: Mapping[str, Spec], where: str
) -> list[Column]:
    """Return columns with units, one for each quantity but the time; refuse ambiguous ones."""
    firsts = sorted(places[0][0] for several in found.values() for places in several)
    columns = list[Column]()
    for name, several in found.items():
        places = [each[0][0] for each in several]
        between = (any(layout.names[one + 1 : two]) for one, two in pairwise(places))
        is_clock = name == 'time_s' and all(between) and places[0] == firsts[0]
        if len(places) > 1 and not is_clock:
            problem = f'columns {" and ".join(quoted(layout.names[at]) for at in places)}'
            hint = f'choose one: {map_hint(name, layout, places[0])}'
            raise RecordingError(where, f'{problem} may both be {name}', hint)
    _check_units(found, layout, specs, where)
    for name, several in found.items():
        is_time = name == 'time_s' and len({unit for (_, unit), *_ in several}) == 1
        cells = [layout.row[at].strip() if is_time and at != ROW else '' for at, _ in several[0]]
        is_wide = [_WIDE.fullmatch(e) or (cells[1:] and _EPOCH.fullmatch(e)) for e in cells]
        begins = [int(e) if wide else 0 for e, wide in zip(cells, is_wide, strict=True)]
        for each in several:
            parts = tuple(
                (at, factor_of(unit, specs[name].unit) or 0.0, begin)
                for (at, unit), begin in zip(each, begins, strict=True)
            )
            headers = ('row number' if at == ROW else layout.names[at] for at, _ in each)
            header, unit = SUM.join(headers), SUM.join(unit for _, unit in each)
            columns.append(Column(name, header, unit, parts[0][1], parts[0][0], parts=parts))
    return columns


def suggestion(
    names: Sequence[str], layout: TextForm, unread: Sequence[int], specs: Mapping[str, Spec]
) -> tuple[str, str]:
    """Return a quantity and the option for its likely column, by name, else by unit; or none."""
    ranked = [(2, 0, 0, 0, 0, '')]
    for order, name in enumerate(names):
        si = specs[name].unit
        for at in unread:
            bare, own = split_unit(layout.names[at])
            unit = own or layout.units[at]
            fits, words = factor_of(unit, si), [each for each in USUAL[name] if len(each) > 1]
            is_usual = recognised(bare, '', {name: specs[name]})
            if is_usual or fits or not (unit or recognised(bare, '', specs)):
                is_like = any(each in bare.lower() for each in words)
                shown = '' if own else unit or likely_unit(layout, si, at)
                option = map_hint(name, layout, at, shown if fits or not unit else f'0.05 {si}')
                ranked.append((not is_usual, not is_like, not fits, order, at, option))
    *_, order, _, option = min(ranked)
    return names[order], option


def map_hint(name: str, layout: TextForm, at: int, unit: str = '') -> str:
    """Return the option that assigns a column and unit to a quantity; a number if unclear."""
    names = [split_unit(each)[0] if unit else each for each in layout.names]
    shown, same = names[at], [_plain(each) for each in names].count(_plain(names[at]))
    if same > 1 or len(shown) > QUOTED or not shown.strip() or _UNCLEAR.search(shown):
        shown = f'#{at + 1}'
    return f'--map {name}="{shown} ({unit})"' if unit else f'--map {name}="{shown}"'


def by_number(places: Iterable[tuple[int, str]]) -> str:
    """Return a sum of columns as a user writes it."""
    return SUM.join(f'#{at + 1} ({unit})' for at, unit in places)


def epoch_of(layout: TextForm) -> str:
    """Return the option for two columns of seconds since 1970 and nanoseconds; or nothing."""
    cells = [each.strip() for each in layout.row]
    for at, (seconds, rest) in enumerate(pairwise(cells)):
        if _EPOCH.fullmatch(seconds) and rest.isdecimal() and len(rest) <= len('999999999'):
            return f'--map time_s="{by_number([(at, "s"), (at + 1, "ns")])}"'
    return ''


def likely_unit(layout: TextForm, si: str, at: int) -> str:
    """Return the likely unit of a column without a unit."""
    number = to_number(layout.row[at], layout.decimal)
    epoch = (unit for least, unit in _EPOCHS if si == 's' and number >= least)
    return next(epoch, LIKELY.get(si, si))


def recognised(bare: str, unit: str, specs: Mapping[str, Spec]) -> str | None:
    """Return the quantity of a name; the unit decides between two."""
    name = _plain(MEAN.sub('', _plain(bare)))
    if not name and unit and 'time_s' in specs and factor_of(unit, 's'):
        return 'time_s'
    quantity = _plain(SIGMAS.sub('', name))
    way = _DIRECTED.search(quantity)
    of_both = way and (_plain(_DIRECTED.sub('', quantity)) or 'step')
    for target, usual in USUAL.items():
        is_known = quantity in usual
        if way and target in BACK and of_both in usual:
            target, is_known = BACK[target] if DIRECTIONS[way[0]] < 0.0 else target, True  # noqa: PLW2901
        column = target if quantity == name else sigma_name(target)
        is_known = is_known and column in specs
        if is_known and (not unit or factor_of(unit, specs[column].unit)):
            return column
    return None


def shown_column(layout: TextForm, at: int) -> str:
    """Return the header of a column with its unit."""
    header, unit = layout.names[at], layout.units[at]
    return f'{header} ({unit})' if unit and unit not in header else header


def listed(names: Iterable[str]) -> str:
    """Return quoted headers, with commas."""
    return ', '.join(quoted(name) for name in names)


def _named(
    layout: TextForm, name: str, text: str, specs: Mapping[str, Spec], where: str
) -> list[Places]:
    """Return places and units of the column, or sum of columns, named by the user."""
    parts = [text] if places_of(layout, text) else text.split(SUM)
    found = [places_of(layout, part) for part in parts]
    for part, places in zip(parts, found, strict=True):
        if not places:
            there = [at for at, header in enumerate(layout.names) if header]
            hint = f'name one of {listed(layout.names[at] for at in there)}'
            if option := suggestion([name], layout, there, specs)[1]:
                hint += f', as {option}'
            raise RecordingError(where, f'there is no column {quoted(part)}', hint)
        if len(places) > 1 and (name != 'time_s' or len(parts) > 1):
            at, unit = places[0]
            shown = by_number([(at, unit or likely_unit(layout, specs[name].unit, at))])
            problem = f'has {len(places)} columns {quoted(split_unit(part)[0])}'
            raise RecordingError(where, problem, f'name one by number: --map {name}="{shown}"')
    return list(zip(*found, strict=True))


def places_of(layout: TextForm, text: str) -> Places:
    """Return places and units of the columns with a name, or of the one with this ``#number``."""
    bare, unit = split_unit(text)
    bares, units = zip(*map(split_unit, layout.names), strict=True)
    for wanted, names in ((text, layout.names), (bare, layout.names), (bare, bares)):
        same = [at for at, each in enumerate(names) if each and _plain(each) == _plain(wanted)]
        if same:
            return tuple((at, unit or units[at] or layout.units[at]) for at in same)
    number = _NUMBERED.fullmatch(bare)
    at = int(number[1]) - 1 if number else -1
    return ((at, unit or units[at] or layout.units[at]),) if 0 <= at < len(units) else ()


def _plain(name: str) -> str:
    return ' '.join(filter(None, re.split(r'[\s_-]+', name.strip().lower())))


def _check_units(found: Found, layout: TextForm, specs: Mapping[str, Spec], where: str) -> None:
    """Refuse missing or wrong units, all columns at once."""
    unsaid = []
    for name, several in found.items():
        si = specs[name].unit
        wrong = [each for each in several if not all(factor_of(unit, si) for _, unit in each)]
        for [(at, unit), *others] in wrong[:1]:
            header, shown = layout.names[at], likely_unit(layout, si, at)
            if unit and not others:
                problem = f'column {quoted(header)} is in {unit}, {name} in {si}'
                option = map_hint(name, layout, at, f'0.05 {si}')
                raise RecordingError(where, problem, f'say how many {si} are 1 {unit}: {option}')
            option = map_hint(name, layout, at, shown)
            if len(wrong) > 1:  # clocks of one name
                option = f'--map {name}="{split_unit(header)[0]} ({shown})"'
            if others:
                added = by_number([(at, shown), *((each, 'ns') for each, _ in others)])
                option = f'--map {name}="{added}"'
            unsaid.append((header, shown, option))
    if unsaid:
        headers, units, options = zip(*unsaid, strict=True)
        hint = f'is it {", ".join(units)}? give it by {" ".join(options)}'
        raise RecordingError(where, f'has no unit for {listed(headers)}', hint)
