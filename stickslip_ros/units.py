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

FACTORS: Final[Mapping[str, float]] = {
    '': 1.0,
    's': 1.0,
    'nm': NM,
    'um': 1e6,
    'mN': MN,
    'nJ': 1e9,
    'GPa': 1e-9,
    'N/um': 1e-6,
}
"""Units in which people read, and how many of each make the SI unit of the quantity."""
DISPLAY: Final[Mapping[str, str]] = {'N': 'mN', 'm': 'nm', 'J': 'nJ'}
"""The one of them that stands for an SI unit; topics and files are in SI."""


def display_unit(unit: str) -> tuple[float, str]:
    """Return factor and name of the unit in which pictures and tables show an SI unit."""
    name = DISPLAY.get(unit, unit)
    return FACTORS.get(name, 1.0), name


def with_unit(value: float, unit: str) -> str:
    """Return a number in SI as people read it, with its unit."""
    factor, name = display_unit(unit)
    return f'{factor * value:.5g} {name}'.rstrip()
