"""Powers of ten, display units and the nanoseconds of ROS."""

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
