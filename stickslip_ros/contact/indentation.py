"""The normal problem: force, indentation and contact radius (Eqs 24 and 25)."""

import math
from dataclasses import dataclass
from functools import lru_cache

from stickslip_ros.contact.elasticity import Elasticity
from stickslip_ros.contact.profile import Array, Profile
from stickslip_ros.errors import OutOfRange

INDENTATIONS_KEPT = 64
"""Solutions kept for the next drive: a sweep over friction has two for each preload."""


@dataclass(frozen=True)
class Indentation:
    """
    A contact under a constant normal force.

    Attributes
    ----------
    normal_force_n : float
        F_n, N.
    depth_m : float
        Indentation d = g(a), m (Eq. 25).
    radius_m : float
        Contact radius a, m; half the length in contact where there are many patches.

    """

    normal_force_n: float
    depth_m: float
    radius_m: float


def normal_force(profile: Profile, elasticity: Elasticity, depth_m: Array | float) -> Array:
    """
    Return the normal force at an indentation depth, N (Eq. 24); any shape.

    Parameters
    ----------
    profile : Profile
        The indenter.
    elasticity : Elasticity
        Effective moduli.
    depth_m : array or float
        Indentation d >= 0, m.

    """
    return 2.0 * elasticity.normal_pa * profile.pressed_area_at(depth_m)


@lru_cache(maxsize=INDENTATIONS_KEPT, typed=True)
def indent(profile: Profile, elasticity: Elasticity, normal_force_n: float) -> Indentation:
    """
    Solve the normal problem for a given force; the last few solutions are kept.

    Parameters
    ----------
    profile : Profile
        The indenter.
    elasticity : Elasticity
        Effective moduli.
    normal_force_n : float
        F_n > 0, N.

    Raises
    ------
    OutOfRange
        If the force does not press, or the profile is too short for it.

    """
    if not normal_force_n > 0.0:
        raise OutOfRange(
            'normal force', normal_force_n, 'N', 'not above 0 N', 'press the bodies together'
        )
    if not math.isfinite(normal_force_n):
        raise OutOfRange('normal force', normal_force_n, 'N', 'not finite', 'give a number')
    area_m2 = normal_force_n / (2.0 * elasticity.normal_pa)
    depth_m = profile.depth_for(area_m2)
    return Indentation(normal_force_n, depth_m, float(profile.half_width(depth_m)))
