"""Units as people write them beside the name of a column, and their factors to SI."""

import math
import re
from contextlib import suppress
from functools import cache

from stickslip_ros.extras import load_extra
from stickslip_ros.units import power_of_ten

SI_UNITS = ('s', 'm', 'N', 'V', 'Hz')
SUFFIX = re.compile(r'(.*[^_\s])[_\s]([kmuµμnp]?)(s|m|n|v|hz)', re.IGNORECASE)
BRACKETED = re.compile(r'(.*?)\s*[\[(]([^\[\]()]*)[\])]\s*')
SLASHED = re.compile(r'(.*\S)\s*/\s*(\S+)\s*')
SCALED = re.compile(r'([-+]?\d+\.?\d*(?:e[-+]?\d+)?)?\s*([^\W\d]+)', re.IGNORECASE)
WORDS = {
    'second': 's',
    'sec': 's',
    'meter': 'm',
    'metre': 'm',
    'newton': 'N',
    'volt': 'V',
    'hertz': 'Hz',
}
BASES = {unit.lower(): unit for unit in SI_UNITS}


@cache
def factor_of(text: str, si_unit: str) -> float | None:
    """Return how many of an SI unit one is, or ``50 mN`` are; None of another kind of unit."""
    scaled = SCALED.fullmatch(text.strip())
    if scaled is None or not math.isfinite(float(scaled[1] or 1.0)):
        return None
    number, unit = float(scaled[1] or 1.0), scaled[2]
    unit = WORDS.get(unit.lower().removesuffix('s'), unit)
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


def unit_of_any(text: str) -> bool:
    """Return whether a text is the unit of something that a stand measures."""
    return any(factor_of(text, unit) for unit in SI_UNITS)


def split_unit(header: str) -> tuple[str, str]:
    """Split ``Force (mN)``, ``Force [mN]``, ``Force / mN`` or ``force_mn`` into name and unit."""
    if (found := BRACKETED.fullmatch(header)) is not None:
        return found[1], found[2].strip()
    if (found := SLASHED.fullmatch(header)) is not None and unit_of_any(found[2]):
        return found[1], found[2]
    if (found := SUFFIX.fullmatch(header)) is not None:
        return found[1], found[2].lower() + BASES[found[3].lower()]
    return header, ''
