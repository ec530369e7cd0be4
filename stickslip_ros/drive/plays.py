"""Kernel: play operators side by side, of which loops of hysteresis are made."""

from stickslip_ros.contact.kernel import kernel
from stickslip_ros.contact.profile import Array


@kernel
def drag_plays(plays: Array, count: int, first: float, spacing: float, value: float) -> float:
    """
    Let plays follow a value; return the sum of their outputs.

    Parameters
    ----------
    plays : array, at least ``count`` long
        Outputs of the plays; changed in place.
    count : int
        Number of plays.
    first, spacing : float
        Play j, from 0 on, has the half-width (j + first) spacing, in the unit of the value.
    value : float
        Input of all of them.

    """
    total = 0.0
    for j in range(count):
        half_width = (j + first) * spacing
        plays[j] = min(max(plays[j], value - half_width), value + half_width)
        total += plays[j]
    return total
