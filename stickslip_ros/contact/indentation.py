"""The normal problem: force, indentation and contact radius (Eqs 24 and 25)."""

from dataclasses import dataclass

from stickslip_ros.contact.elasticity import Elasticity
from stickslip_ros.contact.profile import Array, PowerProfile
from stickslip_ros.errors import OutOfRange


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
        Contact radius a, m.

    """

    normal_force_n: float
    depth_m: float
    radius_m: float


def normal_force(profile: PowerProfile, elasticity: Elasticity, depth_m: Array | float) -> Array:
    """
    Return the normal force at an indentation depth, N (Eq. 24); any shape.

    Parameters
    ----------
    profile : PowerProfile
        The indenter.
    elasticity : Elasticity
        Effective moduli.
    depth_m : array or float
        Indentation d >= 0, m.

    """
    return 2.0 * elasticity.normal_pa * profile.pressed_area(profile.radius_at_height(depth_m))


def indent(profile: PowerProfile, elasticity: Elasticity, normal_force_n: float) -> Indentation:
    """
    Solve the normal problem for a given force.

    Parameters
    ----------
    profile : PowerProfile
        The indenter.
    elasticity : Elasticity
        Effective moduli.
    normal_force_n : float
        F_n > 0, N.

    Raises
    ------
    OutOfRange
        If the force does not press.

    """
    if not normal_force_n > 0.0:
        raise OutOfRange(
            'normal force', normal_force_n, 'N', 'not above 0 N', 'press the bodies together'
        )
    area_m2 = normal_force_n / (2.0 * elasticity.normal_pa)
    radius_m = float(profile.radius_at_area(area_m2))
    return Indentation(normal_force_n, float(profile.height(radius_m)), radius_m)
