# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Options that settle what a table leaves open."""

import re
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise

from stickslip_ros.errors import QUOTED, quoted
from stickslip_ros.lab.readers.layout import Header, TextForm, to_number
from stickslip_ros.lab.readers.measured import USUAL, plain, recognised
from stickslip_ros.lab.readers.units import factor_of
from stickslip_ros.parameters import Spec

RATE = 'if the rows are evenly spaced in time, give their rate, as --rate 10kHz'
SUM = ' + '
"""Between columns that are added."""
EPOCH = re.compile(r'1\d{9}')  # seconds of 2001 to 2033
_NANOSECONDS = re.compile(r'\d{1,9}')
_LIKELY = {'m': 'nm', 'N': 'mN', 'kg': 'g', 'F': 'nF', 'm/s': 'mm/s', 'V/s': 'V/us'}
"""Units suggested for a column without a unit, where it is not that of SI."""
_EPOCHS = ((1e17, 'ns'), (1e14, 'us'), (1e11, 'ms'))
"""Units suggested for times from such a number on: it counts from 1970."""
_UNCLEAR = re.compile(r'["`$\\]')  # what a shell reads


def suggestion(
    names: Sequence[str], layout: TextForm, unread: Sequence[Header], specs: Mapping[str, Spec]
) -> tuple[str, str]:
    """Return a quantity and the option for its likely column, by name, else by unit; or none."""
    ranked = [(2, 0, 0, 0, 0, '')]
    for order, name in enumerate(names):
        si = specs[name].unit
        for each in unread:
            fits, words = factor_of(each.unit, si), [word for word in USUAL[name] if word[1:]]
            is_usual = recognised(each.name, '', {name: specs[name]})
            if is_usual or fits or not (each.unit or recognised(each.name, '', specs)):
                is_like = any(word in each.name.lower() for word in words)
                unit = (each.unit or likely_unit(each, si)) if each.name == each.text else ''
                unit = unit if fits or not each.unit else f'0.05 {si}'
                option = map_hint(name, layout, each, unit)
                ranked.append((not is_usual, not is_like, not fits, order, each.at, option))
    *_, order, _, option = min(ranked)
    return names[order], option


def map_hint(name: str, layout: TextForm, header: Header, unit: str = '') -> str:
    """Return the option that assigns a column and unit to a quantity; a number if unclear."""
    shown = header.name if unit else header.text
    alike = [plain(each.name if unit else each.text) for each in layout.columns]
    is_unclear = len(shown) > QUOTED or not shown.strip() or _UNCLEAR.search(shown)
    if is_unclear or alike.count(plain(shown)) > 1:
        shown = f'#{header.at + 1}'
    return f'--map {name}="{shown} ({unit})"' if unit else f'--map {name}="{shown}"'


def by_number(places: Iterable[tuple[Header, str]]) -> str:
    """Return a sum of columns as a user writes it."""
    return SUM.join(f'#{header.at + 1} ({unit})' for header, unit in places)


def epoch_of(layout: TextForm) -> str:
    """Return the option for two columns of seconds since 1970 and nanoseconds; or nothing."""
    for one, two in pairwise(layout.columns):
        if EPOCH.fullmatch(one.cell) and _NANOSECONDS.fullmatch(two.cell):
            return f'--map time_s="{by_number([(one, "s"), (two, "ns")])}"'
    return ''


def likely_unit(header: Header, si: str) -> str:
    """Return the unit that a column without one may have."""
    number = to_number(header.cell.replace(',', '.'), '.')
    epoch = (unit for least, unit in _EPOCHS if si == 's' and number >= least)
    return next(epoch, _LIKELY.get(si, si))


def listed(headers: Iterable[Header]) -> str:
    """Return quoted headers, with commas."""
    return ', '.join(quoted(header.text) for header in headers)
