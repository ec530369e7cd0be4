"""Powers of ten, display units and the nanoseconds of ROS."""

from collections.abc import Mapping
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

DISPLAY: Final[Mapping[str, tuple[float, str]]] = {
    'N': (MN, 'mN'),
    'm': (NM, 'nm'),
    'J': (1e9, 'nJ'),
}
"""Factor and name of the unit in which people read a quantity; topics and files are in SI."""


def display_unit(unit: str) -> tuple[float, str]:
    """Return factor and name of the unit in which pictures and tables show an SI unit."""
    return DISPLAY.get(unit, (1.0, unit))


def with_unit(value: float, unit: str) -> str:
    """Return a number in SI as people read it, with its unit."""
    factor, name = display_unit(unit)
    return f'{factor * value:.5g} {name}'.rstrip()
