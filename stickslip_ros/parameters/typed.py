# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Parse typed quantities: numbers in SI, or numbers with a unit."""

import math
import re
from collections.abc import Sequence

from stickslip_ros.errors import OutOfRange, WrongKind
from stickslip_ros.units import TYPED, parse_quantity

MEANT = {
    'm': ('nm', 'um', 'mm'),
    'N': ('mN', 'uN'),
    's': ('ms', 'us'),
    'kg': ('g', 'mg'),
    'Hz': ('kHz', 'MHz'),
    'V': ('mV',),
    'V/s': ('V/us', 'V/ms'),
    'Pa': ('GPa', 'MPa'),
}
"""Other units that a number out of range may have, by SI unit."""

EXAMPLES = {
    '': '0.5 or 60e-9',
    'm': '60nm or 60e-9',
    'N': '250mN or 0.25',
    'V': '300V or 300',
    'V/s': '150V/us or 150e6',
    's': '2ms or 2e-3',
    'Hz': '1kHz or 1e3',
}

_COMMA = re.compile(r'([-+]?\d*),(\d+)(?![\d.,])(.*)')
"""A number with one comma and no point: before it, after it, and the unit."""


def to_si(name: str, text: str, unit: str) -> float:
    """
    Return the SI value of a text such as ``60nm``.

    Raises WrongKind if it is not a finite number, or its unit is of another kind.

    """
    number = parse_quantity(text, unit)
    if number is None or not math.isfinite(number):
        has_kind = unit and number is None
        expected = f'a number in {TYPED.get(unit, unit)}' if has_kind else 'a finite number'
        pointed = with_point(name, text)
        has_comma = pointed != text and parse_quantity(pointed, unit) is not None
        hint = f'write {pointed}' if has_comma else f'give a quantity such as {_example(unit)}'
        raise WrongKind(name, text, expected, hint)
    return number


def with_point(name: str, text: str) -> str:
    """
    Return a typed number with a point for its decimal comma: ``0,3 kV``, ``,5``.

    Raises WrongKind if the comma may separate thousands, as in ``1,000``.

    """
    found = _COMMA.fullmatch(text.strip())
    if found is None:
        return text
    whole, part, rest = found.groups()
    if len(part) == 3 and 1 <= len(whole.lstrip('+-0')) <= 3:
        hint = f'write {whole}{part}{rest} or {whole}.{part}{rest}'
        raise WrongKind(name, text, 'clear: thousands or a decimal comma', hint)
    return f'{whole}.{part}{rest}'


def to_si_list(name: str, texts: Sequence[str], unit: str, separator: str = ',') -> list[float]:
    """
    Parse quantities; either all have units or none (0 needs no unit).

    Raises WrongKind or OutOfRange if a text is not a quantity in the unit, or lacks a unit that
    other texts have.

    """
    numbers = [to_si(name, text, unit) for text in texts]
    hint = ''
    if separator == ',' and len(texts) == 2 and texts[0].isdecimal() and texts[1][:1].isdecimal():
        hint = f', or with a decimal point, {".".join(texts)}'
        if unit and numbers[0] == 0.0 and '.' not in texts[1] and 'e' not in texts[1]:
            limit = 'a list of two values, or one with a decimal comma'
            raise OutOfRange(name, ','.join(texts), '', limit, f'write 0.0,{texts[1]}{hint}')
    bare = [text for text in texts if parse_quantity(text, '')]
    if bare and any(parse_quantity(text, '') is None for text in texts):
        limit = 'without a unit, but others have units'
        raise OutOfRange(name, bare[0], '', limit, f'write all as {_example(unit)}{hint}')
    return numbers


def unit_meant(value: float, unit: str, low: float | None, high: float | None) -> str:
    """Suggest a unit that brings a value between its bounds; return '' if there is none."""
    if value <= 0.0 or (low or 0.0) / 2.0 < value < 2.0 * (high or math.inf):
        return ''  # near a bound
    for each in MEANT.get(unit, ()):
        found = parse_quantity(f'{value:g}{each}', unit)
        if found is not None and (low is None or low <= found) and (high is None or found <= high):
            return f'; did you mean {value:g} {each}?'
    return ''


def _example(unit: str) -> str:
    return EXAMPLES.get(unit, f'1{unit} or 1')
