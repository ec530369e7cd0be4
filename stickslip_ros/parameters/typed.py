# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Parse typed quantities: numbers in SI, or numbers with a unit."""

import math
from collections.abc import Sequence

from stickslip_ros.errors import OutOfRange, WrongKind
from stickslip_ros.units import TYPED, parse_quantity

EXAMPLES = {
    '': '0.5 or 60e-9',
    'm': '60nm or 60e-9',
    'N': '250mN or 0.25',
    'V': '300V or 300',
    'V/s': '150V/us or 150e6',
    's': '2ms or 2e-3',
    'Hz': '1kHz or 1e3',
}


def to_si(name: str, text: str, unit: str) -> float:
    """
    Return the SI value of a text such as ``60nm``.

    Raises WrongKind if it is not a finite number, or its unit is of another kind.

    """
    number = parse_quantity(text, unit)
    if number is None or not math.isfinite(number):
        has_kind = unit and number is None
        expected = f'a number in {TYPED.get(unit, unit)}' if has_kind else 'a finite number'
        raise WrongKind(name, text, expected, f'give a quantity such as {_example(unit)}')
    return number


def to_si_list(name: str, texts: Sequence[str], unit: str) -> list[float]:
    """
    Parse quantities; either all have units or none (0 needs no unit).

    Raises WrongKind or OutOfRange if a text is not a quantity in the unit, or lacks a unit that
    other texts have.

    """
    numbers = [to_si(name, text, unit) for text in texts]
    bare = [text for text in texts if parse_quantity(text, '')]
    if bare and any(parse_quantity(text, '') is None for text in texts):
        limit = 'without a unit, but others have units'
        raise OutOfRange(name, bare[0], '', limit, f'write all as {_example(unit)}')
    return numbers


def _example(unit: str) -> str:
    return EXAMPLES.get(unit, f'1{unit} or 1')
