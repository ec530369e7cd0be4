# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Assignment of table columns to quantities, by name and unit or by the user."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from stickslip_ros.errors import QUOTED, RecordingError, quoted
from stickslip_ros.lab.tables.layout import TextForm
from stickslip_ros.lab.tables.numbers import BACK, DIRECTIONS, NUMBERS, sigma_name
from stickslip_ros.lab.tables.units import factor_of, split_unit
from stickslip_ros.parameters import SENSORS, Spec

USUAL: Mapping[str, tuple[str, ...]] = {
    'time_s': ('time', 't', 'x axis', 'x value', 'zeit'),
    'position_m': ('position', 'pos', 'x', 'displacement', 'weg', 'auslenkung'),
    'voltage_v': ('voltage', 'u', 'v', 'piezo voltage', 'spannung', 'piezospannung'),
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


Found = dict[str, list[tuple[int, str]]]  # places and units of candidate columns


@dataclass(frozen=True)
class Column:
    """A recognised column of a table."""

    name: str  # quantity; then header and unit in the file, and factor to SI
    header: str
    unit: str
    factor: float
    index: int  # its place in the table
    first: float  # its first number, in SI


def find_columns(
    layout: TextForm, specs: Mapping[str, Spec], named: Mapping[str, str], where: str
) -> tuple[Found, list[str]]:
    """Return candidate columns of each quantity, and the headers of the other columns."""
    found: Found = {
        name: [_named(layout, name, named[name], where)] for name in named if name in specs
    }
    taken = {at for [(at, _)] in found.values()}
    unread = []
    for at, header in enumerate(layout.names):
        if at in taken or not header.strip():
            continue
        bare, unit = split_unit(header)
        unit = unit or layout.units[at]
        target = recognised(bare, unit, specs)
        if target is None or target in named:
            unread.append(f'{header} ({unit})' if unit and unit not in header else header)
        else:
            found.setdefault(target, []).append((at, unit))
    return found, unread


def resolve_columns(
    found: Found, layout: TextForm, specs: Mapping[str, Spec], where: str
) -> list[Column]:
    """Return one column with unit for each quantity; refuse ambiguous ones."""
    for name, places in found.items():
        if len(places) > 1:
            headers = [layout.names[at] for at, _ in places]
            problem = f'columns {" and ".join(map(quoted, headers))} may both be {name}'
            raise RecordingError(where, problem, f'choose one: {map_hint(name, headers[0])}')
    _check_units(found, layout, specs, where)
    return [
        Column(name, layout.names[at], unit, factor_of(unit, specs[name].unit) or 0.0, at, 0.0)
        for name, [(at, unit)] in found.items()
    ]


def suggestion(
    names: Sequence[str], headers: Iterable[str], specs: Mapping[str, Spec]
) -> tuple[str, str]:
    """Return a quantity and the option for its likely column, by name, else by unit."""
    split = [(header, *split_unit(header)) for header in headers]
    for name in names:
        for header, bare, unit in split:
            if recognised(bare, '', {name: specs[name]}):
                si = specs[name].unit
                return name, map_hint(name, header, '' if factor_of(unit, si) else f'0.05 {si}')
    fitting = [
        (name, map_hint(name, header))
        for name in names
        for header, _, unit in split
        if factor_of(unit, specs[name].unit)
    ]
    unsaid = next((header for header, _, unit in split if not unit), '...')
    name = names[0]
    return (fitting or [(name, map_hint(name, unsaid, LIKELY[specs[name].unit]))])[0]


def map_hint(name: str, header: str, unit: str = '') -> str:
    """Return the option that assigns a column and unit to a quantity."""
    shown = f'{split_unit(header)[0]} ({unit})' if unit else header
    return f'--map {name}="{shown[:QUOTED]}"'


def recognised(bare: str, unit: str, specs: Mapping[str, Spec]) -> str | None:
    """Return the quantity of a name; the unit decides between two."""
    name = _plain(MEAN.sub('', _plain(bare)))
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


def listed(names: Iterable[str]) -> str:
    """Return quoted headers, with commas."""
    return ', '.join(quoted(name) for name in names)


def _named(layout: TextForm, name: str, header: str, where: str) -> tuple[int, str]:
    """Return place and unit of the column named by the user."""
    bare, unit = split_unit(header)
    bares, units = zip(*map(split_unit, layout.names), strict=True)
    for wanted, names in ((header, layout.names), (bare, layout.names), (bare, bares)):
        plain = [_plain(each) for each in names]
        if _plain(wanted) in plain:
            at = plain.index(_plain(wanted))
            return at, unit or units[at] or layout.units[at]
    problem = f'there is no column {quoted(header)}'
    hint = f'name one of {listed(filter(None, layout.names))} in --map {name}='
    raise RecordingError(where, problem, hint)


def _plain(name: str) -> str:
    return ' '.join(re.split(r'[\s_-]+', name.strip().lower()))


def _check_units(found: Found, layout: TextForm, specs: Mapping[str, Spec], where: str) -> None:
    """Refuse missing or wrong units, all columns at once."""
    unsaid, options, units = [], [], []
    for name, [(at, unit)] in found.items():
        header, si = layout.names[at], specs[name].unit
        if factor_of(unit, si):
            continue
        if unit:
            problem = f'column {quoted(header)} is in {unit}, {name} in {si}'
            hint = f'say how many {si} are 1 {unit}: {map_hint(name, header, f"0.05 {si}")}'
            raise RecordingError(where, problem, hint)
        unsaid.append(header)
        units.append(LIKELY[si])
        options.append(map_hint(name, header, LIKELY[si]))
    if unsaid:
        problem = f'has no unit for {listed(unsaid)}'
        hint = f'is it {", ".join(units)}? give it by {" ".join(options)}'
        raise RecordingError(where, problem, hint)
