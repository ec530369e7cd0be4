"""Kernels: what both sensors do last: break down, subtract the zero, and quantise."""

import numpy as np

from stickslip_ros.contact.kernel import kernel
from stickslip_ros.contact.record import COUNT, FLOAT, Record, kind

WORKS, FROZEN, DROPPED_OUT = range(3)
CONDITIONS = {'none': WORKS, 'freeze': FROZEN, 'dropout': DROPPED_OUT}
"""Conditions of a sensor, after the words of ``fault.interferometer`` and ``fault.load_cell``."""

FINEST = 2.0**52
"""From this number of quantisation steps on, the reading itself has no finer digits."""


FAULT = kind(condition=COUNT, offset=FLOAT)
"""
What is broken about a sensor.

Fields
------
condition : int
    WORKS, FROZEN or DROPPED_OUT.
offset : float
    Jump of the reading, in its unit.

"""


@kernel
def standing(fault: Record, before: float, value: float) -> float:
    """Return the value that stands behind the display: a frozen sensor keeps the one before."""
    return before if fault.condition == FROZEN else value


@kernel
def displayed(fault: Record, value: float, zero: float, resolution: float) -> float:
    """Return the reading: ``value`` above ``zero`` in whole steps, or not a number."""
    if fault.condition == DROPPED_OUT:
        return np.nan
    above = value - zero
    if abs(above) < FINEST * resolution:
        return float(np.rint(above / resolution) * resolution)
    return above
