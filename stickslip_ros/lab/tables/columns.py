# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Which column of a table is which quantity: by its name and unit, or as the user says."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from stickslip_ros.errors import QUOTED, RecordingError, quoted
from stickslip_ros.lab.tables.layout import TextForm
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
    'force_n': ('force', 'f', 'load', 'load cell', 'generated force', 'kraft'),
    'step_length_m': ('step length', 'step size', 'step', 'schrittlänge', 'schrittweite'),
    'zero_amplitude_m': ('zero amplitude', '0 amplitude', 'nullamplitude'),
    'ringing_hz': ('ringing', 'ringing frequency', 'ring down frequency', 'ausschwingfrequenz'),
    'decay_s': ('decay', 'decay time', 'ring down time', 'abklingzeit'),
    **{each.quantity: (each.words,) for each in SENSORS if each.switch},
}
"""Names of quantities in lower case, words separated by one blank."""
SIGMA = '_sigma_'
SIGMAS = re.compile(
    r'(\b(sigma|σ|std|sd|stdev|std dev|standard (deviation|error)|uncertainty|err|error|'
    r'unsicherheit|standardabweichung|fehler)\b|±)( (of|der|des)\b)?'
)
MEAN = re.compile(r'\b(mean|average|avg|mittelwert|mittlere)\b( (of|der|des)\b)?')
LIKELY = {'m': 'nm', 'N': 'mN', 's': 's', 'V': 'V', 'Hz': 'Hz'}
"""Units of which one asks whether they were meant."""


Found = Mapping[str, Sequence[tuple[int, str]]]
"""Places and units of the columns that may be a quantity."""


@dataclass(frozen=True)
class Column:
    """A column of a table that was understood."""

    name: str  # quantity, header in the file, and unit there, which is this factor in SI
    header: str
    unit: str
    factor: float
    index: int  # its place in the table
    first: float  # its first number, in SI


def sigma_name(name: str) -> str:
    """Return the column with the uncertainty of another one, ``force_sigma_n`` of ``force_n``."""
    stem, _, unit = name.rpartition('_')
    return f'{stem}{SIGMA}{unit}'


def find_columns(
    layout: TextForm, specs: Mapping[str, Spec], named: Mapping[str, str], where: str
) -> tuple[Found, list[str]]:
    """Return where the quantities of a table may be, and the headers of columns that are none."""
    found = {name: [_named(layout, name, named[name], where)] for name in named if name in specs}
    taken = {at for [(at, _)] in found.values()}
    aside = []
    for at, header in enumerate(layout.names):
        if at in taken or not header.strip():
            continue
        bare, unit = split_unit(header)
        unit = unit or layout.units[at]
        target = recognised(bare, unit, specs)
        if target is None or target in named:
            aside.append(f'{header} ({unit})' if unit and unit not in header else header)
        else:
            found.setdefault(target, []).append((at, unit))
    return found, aside


def understood(
    found: Found, layout: TextForm, specs: Mapping[str, Spec], where: str
) -> list[Column]:
    """Return each quantity with its one column and unit; refuse what leaves something to guess."""
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
    """Return which of some quantities which header may be: by its name, else by its unit."""
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
    """Return the option that says which column, in which unit, a quantity is."""
    shown = f'{split_unit(header)[0]} ({unit})' if unit else header
    shown = shown[:QUOTED]
    return f'--map {name}="{shown}"'


def recognised(bare: str, unit: str, specs: Mapping[str, Spec]) -> str | None:
    """Return the quantity that a name means, of two meanings that of its unit."""
    name = _plain(MEAN.sub('', _plain(bare)))
    quantity = _plain(SIGMAS.sub('', name))
    for target, usual in USUAL.items():
        column = target if quantity == name else sigma_name(target)
        if quantity not in usual or column not in specs:
            continue
        if not unit or factor_of(unit, specs[column].unit):
            return column
    return None


def listed(names: Iterable[str]) -> str:
    """Return headers as a sentence quotes them."""
    return ', '.join(quoted(name) for name in names)


def _named(layout: TextForm, name: str, header: str, where: str) -> tuple[int, str]:
    """Return place and unit of the column that the user means."""
    bare, unit = split_unit(header)
    bares, units = zip(*map(split_unit, layout.names), strict=True)
    for said, names in ((header, layout.names), (bare, layout.names), (bare, bares)):
        plain = [_plain(each) for each in names]
        if _plain(said) in plain:
            at = plain.index(_plain(said))
            return at, unit or units[at] or layout.units[at]
    problem = f'there is no column {quoted(header)}'
    raise RecordingError(
        where, problem, f'name one of {listed(filter(None, layout.names))} in --map {name}='
    )


def _plain(name: str) -> str:
    return ' '.join(re.split(r'[\s_-]+', name.strip().lower()))


def _check_units(found: Found, layout: TextForm, specs: Mapping[str, Spec], where: str) -> None:
    """Refuse columns whose unit is not said or measures another thing; all of them at once."""
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
        problem = f'no unit is said of {listed(unsaid)}'
        hint = f'is it {", ".join(units)}? give it by {" ".join(options)}'
        raise RecordingError(where, problem, hint)
