# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Quantities as they are typed: numbers in SI, or numbers with a unit behind them."""

import math
from collections.abc import Sequence

from stickslip_ros.errors import OutOfRange, WrongKind
from stickslip_ros.units import TYPED, quantity

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
    Return the number of a text such as ``60nm`` in an SI unit.

    Raises
    ------
    WrongKind
        If it is no finite number, or its unit is of another kind.

    """
    number = quantity(text, unit)
    if number is None or not math.isfinite(number):
        has_kind = unit and number is None
        expected = f'a number in {TYPED.get(unit, unit)}' if has_kind else 'a finite number'
        raise WrongKind(name, text, expected, f'give one such as {_example(unit)}')
    return number


def to_si_list(name: str, texts: Sequence[str], unit: str) -> list[float]:
    """
    Return the numbers of several texts, of which all have units or none has; 0 needs none.

    Raises
    ------
    WrongKind, OutOfRange
        If one is no quantity in the unit, or has none where others have one.

    """
    numbers = [to_si(name, text, unit) for text in texts]
    bare = [text for text in texts if quantity(text, '')]
    if bare and any(quantity(text, '') is None for text in texts):
        limit = 'without a unit, which others have'
        raise OutOfRange(name, bare[0], '', limit, f'write all as {_example(unit)}')
    return numbers


def _example(unit: str) -> str:
    return EXAMPLES.get(unit, f'1{unit} or 1')
