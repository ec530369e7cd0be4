"""Kernel: a loop of hysteresis made of play operators (Prandtl-Ishlinskii)."""

from stickslip_ros.contact.kernel import kernel
from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.record import FLOAT, Record, kind, record
from stickslip_ros.drive.piezo import move_plays

PLAYS = 16
"""Play operators of a loop; an even number, for which the weights below are exact."""


LOOP = kind(direct=FLOAT, weight=FLOAT, spacing=FLOAT)
"""
Constants of a loop.

Fields
------
direct : float
    Share of the input that passes without a loop.
weight : float
    Share of the input that passes each play; 0 is no loop.
spacing : float
    Distance between the half-widths of neighbouring plays, in the unit of the input.

"""


def loop_of(opening: float, full_scale: float) -> Record:
    """
    Return the loop that goes from -full_scale to full_scale with a gain of 1.

    Parameters
    ----------
    opening : float
        Distance of its branches in the middle, as a share of ``full_scale``; 0 is no loop.
    full_scale : float
        Largest input, in its unit.

    Notes
    -----
    Play j of N has the half-width r_j = (j - 1/2) full_scale/N. All weights are w. At the ends
    of the loop the plays give sum (full_scale - r_j) w = N w full_scale/2, in the middle its
    branches are 2 w sum min(r_j, full_scale - r_j) = N w full_scale/2 apart. So w is
    2 opening/N, and 1 - opening passes directly: this is the gain right after a reversal.

    """
    return record(
        LOOP, direct=1.0 - opening, weight=2.0 * opening / PLAYS, spacing=full_scale / PLAYS
    )


@kernel
def follow(loop: Record, plays: Array, value: float) -> float:
    """Return what the loop makes of its next input; ``plays`` is changed in place."""
    total = move_plays(plays, len(plays), 0.5, loop.spacing, value)
    return float(loop.direct * value + loop.weight * total)
