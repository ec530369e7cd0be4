"""
Choose few springs for a bank, and choose them well.

The order of the springs does not matter, so neighbours in height, not in place, are joined. Each
joined spring has the stiffness of its class and the mean height of it; with these the bank has
the exact normal force at every class boundary. At a given preload its depth is solved for the
bank itself, so that full slip is exactly mu F_n.

"""

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from stickslip_ros.contact.elasticity import Elasticity
from stickslip_ros.contact.profile import Array, Profile
from stickslip_ros.contact.record import Record, record
from stickslip_ros.contact.springs import GROUPS_MAX, SPRINGS_IN_ALL, bank_kind

SPRINGS = 64
"""Springs per group of equal contacts. Against the continuum the force is then exact to
BANK_ERROR of its maximum, from a twentieth of the largest preload on."""
BANK_ERROR = 2.5e-3
"""With the 21 springs that each of six different rough lines gets, it is 1.5e-2."""
GRADING = 2.0
"""Class boundaries grow like this power of their number: fine where small preloads press."""
CLASSES_KEPT = 32
"""Groups whose classes are kept for the next drive: they carry any preload up to the largest."""


class Group(NamedTuple):
    """
    Equal contacts: a profile, how many there are, and their share of the preload.

    Attributes
    ----------
    profile : Profile
        The indenter.
    contacts : int
        How many.
    share : float
        Normal force of one per preload.

    """

    profile: Profile
    contacts: int
    share: float


def spring_bank(
    groups: Sequence[Group],
    elasticity: Elasticity,
    friction: float,
    preload_max_n: float,
    springs: int = SPRINGS,
) -> Record:
    """
    Choose the springs of a drive.

    Parameters
    ----------
    groups : sequence of Group
        The contacts.
    elasticity : Elasticity
        Effective moduli.
    friction : float
        Friction coefficient mu.
    preload_max_n : float
        Largest preload that the bank can carry, N.
    springs : int
        Springs per group; a record of BANK has room for SPRINGS_IN_ALL.

    Raises
    ------
    OutOfRange
        If a profile is too short for the largest preload.

    """
    rows = [_classes(group, elasticity, preload_max_n, springs) for group in groups]
    heights_m, widths_m = (np.array(column) for column in zip(*rows, strict=True))
    normal = 2.0 * elasticity.normal_pa * widths_m
    slope = np.cumsum(normal, axis=1)
    steps_n = slope[:, :-1] * np.diff(heights_m, axis=1)
    area_n = np.concatenate((np.zeros((len(groups), 1)), np.cumsum(steps_n, axis=1)), axis=1)
    return bank_of_rows(
        heights_m,
        friction * normal,
        2.0 * elasticity.shear_pa * widths_m,
        area_n,
        slope,
        shares=[group.contacts * group.share for group in groups],
        friction=friction,
    )


def bank_of_rows(
    heights_m: Array,
    limit_n_per_m: Array,
    shear_n_per_m: Array,
    area_n: Array,
    slope_n_per_m: Array,
    *,
    shares: Sequence[float],
    friction: float,
) -> Record:
    """Return a bank whose springs lie in arrays of shape (groups, springs of each group)."""
    groups, springs = heights_m.shape
    room = max(groups * springs, SPRINGS_IN_ALL)

    def flat(rows: Array) -> Array:
        return np.pad(rows.ravel(), (0, room - rows.size))

    firsts = np.full(GROUPS_MAX + 1, groups * springs)
    firsts[:groups] = springs * np.arange(groups)
    return record(
        bank_kind(room),
        groups=groups,
        first=firsts,
        heights_m=flat(heights_m),
        limit_n_per_m=flat(limit_n_per_m),
        shear_n_per_m=flat(shear_n_per_m),
        per_shear_m_per_n=flat(
            np.divide(
                1.0, shear_n_per_m, out=np.zeros_like(shear_n_per_m), where=shear_n_per_m > 0.0
            )
        ),
        area_n=flat(area_n),
        slope_n_per_m=flat(slope_n_per_m),
        shares=np.pad(np.array(shares), (0, GROUPS_MAX - groups)),
        friction=friction,
    )


@lru_cache(maxsize=CLASSES_KEPT)
def _classes(
    group: Group, elasticity: Elasticity, preload_max_n: float, springs: int
) -> tuple[Array, Array]:
    """Return mean height and half width of each class of springs; not to be written."""
    profile = group.profile
    area_m2 = group.share * preload_max_n / (2.0 * elasticity.normal_pa)
    deepest_m = profile.depth_for(area_m2)
    bounds_m = deepest_m * (np.arange(springs + 1) / springs) ** GRADING
    half_width_m = profile.half_width(bounds_m)
    areas_m2 = profile.pressed_area_at(bounds_m)
    widths_m = np.diff(half_width_m)
    gained_m2 = np.diff(areas_m2) - half_width_m[:-1] * np.diff(bounds_m)
    heights_m = bounds_m[1:] - gained_m2 / np.where(widths_m > 0.0, widths_m, 1.0)
    return heights_m, group.contacts * widths_m
