# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Units in column headers, and their factors to SI."""

import math
import re
from contextlib import suppress
from functools import cache

from stickslip_ros.arrays import Array
from stickslip_ros.extras import MissingExtra, load_extra
from stickslip_ros.units import power_of_ten

SI_UNITS = ('s', 'm', 'N', 'V', 'Hz')
_SUFFIX = re.compile(
    r'(.*[^_\s])(?<!_per)[_\s]([kmuµμnp]?)(s|m|n|v|hz|g|f|m_per_s|v_per_s|n_per_m)', re.IGNORECASE
)
# Headers may have 60,000 equal characters: adjacent groups must not match equal characters.
BRACKETED = re.compile(r'(.*\S|)\s*[\[(]([^\[\]()]*)[\])]\s*')
WITHIN = re.compile(r'(.*\S|)\s*\bin\s+(\S+)\s*')
SLASHED = re.compile(r'(.*\S)\s*/\s*([^\s/]+)\s*')
SCALED = re.compile(
    r'([-+]?\d+(?:\.\d*)?(?:e[-+]?\d+)?)?\s*([^\W\d]+(?:/[^\W\d]+)?)', re.IGNORECASE
)
_WORDS = {'second': 's', 'sec': 's', 'meter': 'm', 'metre': 'm'}
_WORDS |= {'newton': 'N', 'volt': 'V', 'hertz': 'Hz'}
TIMES = ('ms', 'us', 'µs', 'μs', 'ns')
"""Headers that are only a unit, besides the words; a column s may be a distance."""
BASES = {unit.lower(): unit for unit in SI_UNITS}
BASES |= {'kg': 'kg', 'g': 'g', 'f': 'F', 'm_per_s': 'm/s', 'v_per_s': 'V/s', 'n_per_m': 'N/m'}


@cache
def factor_of(text: str, si_unit: str) -> float | None:
    """Return the factor of a unit or amount (``50 mN``) to an SI unit; None if not convertible."""
    if text.strip() == si_unit:
        return 1.0
    scaled = SCALED.fullmatch(text.strip())
    if scaled is None or not math.isfinite(float(scaled[1] or 1.0)):
        return None
    number, unit = float(scaled[1] or 1.0), scaled[2]
    unit = _WORDS.get(unit.lower().removesuffix('s'), unit)
    if (power := power_of_ten(unit, si_unit)) is not None:
        return number * float(f'1e{power}')
    if any(power_of_ten(unit, each) is not None for each in (*SI_UNITS, *BASES.values())):
        return None
    pint = load_extra(f'the unit {unit}', 'pint')
    for name in (unit, unit.lower()):
        with suppress(pint.PintError, ValueError, AssertionError):  # AssertionError: nan, a half
            quantity = pint.get_application_registry().Quantity(1.0, name)
            if factor := float(quantity.to(si_unit).magnitude):
                return number * factor
    return None


def in_si(values: Array, factor: float) -> Array:
    """Return numbers times a factor, shape (n,); dividing by 1000 is exacter than times 1e-3."""
    divisor = float(round(1.0 / factor))
    return values / divisor if divisor * factor == 1.0 else values * factor


def is_unit_of(text: str, si_unit: str) -> bool:
    """Return whether a text is a unit of a quantity; without pint, one known here."""
    with suppress(MissingExtra):
        return bool(factor_of(text, si_unit))
    return False


def unit_of_any(text: str) -> bool:
    """Return whether a text is a unit of a measured quantity; without pint, one known here."""
    return any(is_unit_of(text, unit) for unit in (*SI_UNITS, 'm/s'))


def split_unit(header: str) -> tuple[str, str]:
    """
    Split a header into name and unit.

    Forms are ``Force (mN)``, ``Force [mN]``, ``Force / mN``, ``Force in mN`` and ``force_mN``. The
    name is empty if the header is only a unit, such as ``in s`` or ``second``.

    """
    if (found := BRACKETED.fullmatch(header)) is not None:
        return found[1], found[2].strip()
    for form in (SLASHED, WITHIN):
        if (found := form.fullmatch(header)) is not None and unit_of_any(found[2]):
            return found[1], found[2]
    if (found := _SUFFIX.fullmatch(header)) is not None:
        return found[1], found[2].lower() + BASES[found[3].lower()]
    word = header.strip().lower()
    return ('', header) if word in TIMES or word.removesuffix('s') in _WORDS else (header, '')
