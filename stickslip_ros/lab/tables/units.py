# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Units as people write them beside the name of a column, and their factors to SI."""

import math
import re
from contextlib import suppress
from functools import cache

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.extras import load_extra
from stickslip_ros.units import power_of_ten

SI_UNITS = ('s', 'm', 'N', 'V', 'Hz')
_SUFFIX = re.compile(r'(.*[^_\s])[_\s]([kmuµμnp]?)(s|m|n|v|hz)', re.IGNORECASE)
# A header may have 60,000 blanks, slashes or digits: no two parts that follow take the same ones.
BRACKETED = re.compile(r'(.*\S|)\s*[\[(]([^\[\]()]*)[\])]\s*')
SLASHED = re.compile(r'(.*\S)\s*/\s*([^\s/]+)\s*')
SCALED = re.compile(r'([-+]?\d+(?:\.\d*)?(?:e[-+]?\d+)?)?\s*([^\W\d]+)', re.IGNORECASE)
_WORDS = {
    'second': 's',
    'sec': 's',
    'meter': 'm',
    'metre': 'm',
    'newton': 'N',
    'volt': 'V',
    'hertz': 'Hz',
}
_DIGITS, _WHOLE_END = 23, 2.0**53
"""Digits of the powers of ten, and end of the whole numbers, that a float holds exactly."""
BASES = {unit.lower(): unit for unit in SI_UNITS}


@cache
def factor_of(text: str, si_unit: str) -> float | None:
    """Return how many of an SI unit one is, or ``50 mN`` are; None of another kind of unit."""
    scaled = SCALED.fullmatch(text.strip())
    if scaled is None or not math.isfinite(float(scaled[1] or 1.0)):
        return None
    number, unit = float(scaled[1] or 1.0), scaled[2]
    unit = _WORDS.get(unit.lower().removesuffix('s'), unit)
    powers = {each: power_of_ten(unit, each) for each in SI_UNITS}
    if (power := powers[si_unit]) is not None:
        return number * float(f'1e{power}')
    if any(each is not None for each in powers.values()):
        return None
    pint = load_extra(f'the unit {unit}', 'pint')
    for name in (unit, unit.lower()):
        with suppress(pint.PintError, ValueError, AssertionError):  # the latter: nan, a half
            quantity = pint.get_application_registry().Quantity(1.0, name)
            if factor := float(quantity.to(si_unit).magnitude):
                return number * factor
    return None


def in_si(values: Array, factor: float) -> Array:
    """
    Return numbers times the factor of their unit, shape (n,): 0.817 mN become what 0.000817 is.

    The product of two rounded numbers, 0.817 and 0.001, is another one. Where a number is a
    fraction of a power of ten, and the unit too, one division rounds once.

    """
    divisor = float(round(1.0 / factor))
    if factor == 1.0 or divisor * factor != 1.0:
        return values * factor
    found = values / divisor
    for digits in reversed(range(_DIGITS - len(f'{abs(divisor):.0f}'))):  # the fewest count
        whole = np.rint(10.0**digits * values)
        is_exact = (whole / 10.0**digits == values) & (np.abs(whole) < _WHOLE_END)
        found = np.where(is_exact, whole / (10.0**digits * divisor), found)
    return found


def unit_of_any(text: str) -> bool:
    """Return whether a text is the unit of something that a stand measures."""
    return any(factor_of(text, unit) for unit in SI_UNITS)


def split_unit(header: str) -> tuple[str, str]:
    """Split ``Force (mN)``, ``Force [mN]``, ``Force / mN`` or ``force_mn`` into name and unit."""
    if (found := BRACKETED.fullmatch(header)) is not None:
        return found[1], found[2].strip()
    if (found := SLASHED.fullmatch(header)) is not None and unit_of_any(found[2]):
        return found[1], found[2]
    if (found := _SUFFIX.fullmatch(header)) is not None:
        return found[1], found[2].lower() + BASES[found[3].lower()]
    return header, ''
