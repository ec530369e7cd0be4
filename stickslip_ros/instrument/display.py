"""Kernels: what both sensors do last: break down, subtract the zero, and quantise."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from stickslip_ros.contact.kernel import kernel

INTERFEROMETER_STREAM, LOAD_CELL_STREAM = 1, 2
"""Numbers of the random streams: sensors never share noise."""

WORKS, FROZEN, DROPPED_OUT = 0.0, 1.0, 2.0
CONDITIONS = {'none': WORKS, 'freeze': FROZEN, 'dropout': DROPPED_OUT}
"""Conditions of a sensor, after the words of ``fault.interferometer`` and ``fault.load_cell``."""

FINEST = 2.0**52
"""From this number of quantisation steps on, the reading itself has no finer digits."""


class Fault(NamedTuple):
    """
    What is broken during a block.

    Attributes
    ----------
    condition : float
        WORKS, FROZEN or DROPPED_OUT.
    offset : float
        Jump of the reading, in its unit.

    """

    condition: float
    offset: float


NO_FAULT = Fault(WORKS, 0.0)


@lru_cache(maxsize=64)
def fault_of(word: str, offset: float) -> Fault:
    """
    Return the fault that ``none``, ``freeze`` or ``dropout`` and an offset mean.

    The same ones give the same object, so that kernels need not look at it again.

    """
    return Fault(CONDITIONS[word], offset)


@kernel
def standing(fault: Fault, before: float, value: float) -> float:
    """Return the value that stands behind the display: a frozen sensor keeps the one before."""
    return before if fault.condition == FROZEN else value


@kernel
def displayed(fault: Fault, value: float, zero: float, resolution: float) -> float:
    """Return the reading: ``value`` above ``zero`` in whole steps, or not a number."""
    if fault.condition == DROPPED_OUT:
        return np.nan
    above = value - zero
    if abs(above) < FINEST * resolution:
        return float(np.rint(above / resolution) * resolution)
    return above
