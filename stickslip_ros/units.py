# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Powers of ten, units as typed and as displayed, and nanoseconds per second."""

import re
from collections.abc import Mapping, Sequence
from typing import Final

NANO: Final = 1e-9
MICRO: Final = 1e-6
MILLI: Final = 1e-3
KILO: Final = 1e3
GIGA: Final = 1e9
NM: Final = 1e9
"""Nanometres in a metre."""
MN: Final = 1e3
"""Millinewtons in a newton."""
NS_PER_S: Final = 1_000_000_000

_PREFIXES: Final[Mapping[str, int]] = {
    '': 0,
    'p': -12,
    'n': -9,
    **dict.fromkeys('uµμ', -6),
    'm': -3,
    'k': 3,
    'M': 6,
    'G': 9,
}
"""Powers of ten of the prefixes of units."""
TYPED: Final[Mapping[str, str]] = {
    'm': 'nm, um, mm or m',
    'N': 'uN, mN, N or kN',
    'V': 'mV, V or kV',
    's': 'us, ms or s',
    'Hz': 'Hz, kHz or MHz',
    'm/s': 'nm/s, um/s, mm/s or m/s',
    'V/s': 'V/us, V/ms or V/s',
}
"""SI units that people type most, and the alternatives that a refusal lists."""
_PARTS = re.compile(r'[^\W\d_]+|[^\s*·]')
_QUANTITY = re.compile(r'([-+]?(?:\d+\.?\d*|\.\d+))(?:e([-+]?\d{1,9}))?\s*(.*)', re.IGNORECASE)

FACTORS: Final[Mapping[str, float]] = {
    '': 1.0,
    's': 1.0,
    'nm': NM,
    'um': 1e6,
    'mN': MN,
    'nJ': 1e9,
    'GPa': 1e-9,
    'N/um': 1e-6,
    'um/s': 1e6,
    'mJ/m': 1e3,
}
"""Displayed units, and how many of each make the SI unit."""
_UNITS: Final[Mapping[str, str]] = {
    '_n_per_m': 'N/m',
    '_m_per_s': 'm/s',
    '_v_per_s': 'V/s',
    '_percent': '%',
    '_kg': 'kg',
    '_f': 'F',
    '_pa': 'Pa',
    '_m2': 'm^2',
    '_hz': 'Hz',
    '_m': 'm',
    '_n': 'N',
    '_j': 'J',
    '_s': 's',
    '_v': 'V',
}
"""SI units by the suffix of a quantity's name."""
DISPLAY: Final[Mapping[str, str]] = {
    'N': 'mN',
    'm': 'nm',
    'J': 'nJ',
    'm/s': 'um/s',
    'J/m': 'mJ/m',
}
"""Displayed unit for an SI unit; topics and files keep SI."""


def unit_of(name: str) -> str:
    """Return the SI unit of a name's suffix, ``N`` for ``force_n``; empty without a suffix."""
    return next((unit for end, unit in _UNITS.items() if name.endswith(end)), '')


def display_unit(unit: str) -> tuple[float, str]:
    """Return factor and name of the displayed unit for an SI unit."""
    name = DISPLAY.get(unit, unit)
    return FACTORS.get(name, 1.0), name


def in_digits(value: object) -> str:
    """Return a value as people read it: floats, also of a list, have five significant digits."""
    if isinstance(value, list | tuple):
        return f'[{", ".join(map(in_digits, value))}]'
    return f'{value:.5g}' if isinstance(value, float) else str(value)


def with_unit(value: float, unit: str) -> str:
    """Return an SI value as text in its displayed unit."""
    factor, name = display_unit(unit)
    return f'{in_digits(factor * value)} {name}'.rstrip()


def power_of_ten(unit: str, si_unit: str) -> int | None:
    """Return the power of ten between two units, 6 for ``V/us`` in ``V/s``; None if unrelated."""
    theirs, ours = (_PARTS.findall(each.removeprefix('1')) for each in (unit, si_unit))
    if theirs == ours:
        return 0
    if len(theirs) != len(ours) or '^' in ours:
        return None
    power, sign = 0, 1
    for part, of_ours in zip(theirs, ours, strict=True):
        base, known = ('g', 3) if of_ours == 'kg' else (of_ours, 0)
        prefix = part.removesuffix(base)
        is_known = part.endswith(base) and prefix in _PREFIXES
        if not is_known or (prefix and not (sign and base.isalpha())):
            return None
        power += sign * (_PREFIXES[prefix] - known)
        sign = {'/': -1, 'sqrt': 0}.get(of_ours, sign)
    return power


def joined(words: Sequence[str]) -> list[str]:
    """Join each typed unit to the number before it: ``60``, ``nm`` become ``60nm``."""
    found: list[str] = []
    for word in words:
        after_number = found and parse_quantity(re.split('[=:,@]', found[-1])[-1], '') is not None
        if after_number and any(power_of_ten(word, unit) is not None for unit in TYPED):
            found[-1] += word
        else:
            found.append(word)
    return found


def parse_quantity(text: str, si_unit: str) -> float | None:
    """Return the SI value of ``60nm``, ``60 nm`` or ``60e-9``; None if the text is no quantity."""
    found = _QUANTITY.fullmatch(text.strip())
    if found is None:
        return None
    mantissa, exponent, unit = found.groups()
    power = power_of_ten(unit, si_unit) if unit else 0
    return None if power is None else float(f'{mantissa}e{int(exponent or 0) + power}')
