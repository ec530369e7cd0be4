"""The tangential problem at constant load, in closed form (Jaeger, Ciavarella; Eq. 22)."""

from dataclasses import dataclass

import numpy as np

from stickslip_ros.contact.elasticity import Elasticity
from stickslip_ros.contact.indentation import Indentation, indent, normal_force
from stickslip_ros.contact.profile import Array, Profile


@dataclass(frozen=True)
class Presliding:
    """
    A contact that is pulled sideways under a constant normal force.

    Attributes
    ----------
    profile : Profile
        The indenter.
    elasticity : Elasticity
        Effective moduli.
    friction : float
        Friction coefficient mu.
    indentation : Indentation
        The solved normal problem.

    """

    profile: Profile
    elasticity: Elasticity
    friction: float
    indentation: Indentation

    @property
    def max_displacement_m(self) -> float:
        """u_max = mu C_M d: the displacement at which the whole contact slips, m (Eq. 22)."""
        return self.friction * self.elasticity.cattaneo_mindlin * self.indentation.depth_m

    @property
    def max_force_n(self) -> float:
        """Largest tangential force mu F_n, N."""
        return self.friction * self.indentation.normal_force_n

    @property
    def stick_stiffness_n_per_m(self) -> float:
        """Tangential stiffness 2 G* a of full stick, N/m."""
        return 2.0 * self.elasticity.shear_pa * self.indentation.radius_m

    def stick_radius(self, displacement_m: Array | float) -> Array:
        """
        Return the radius c of the sticking core (half its length) on the virgin curve, m.

        Parameters
        ----------
        displacement_m : array or float
            Relative displacement u >= 0 from the unloaded state, m.

        Notes
        -----
        g(c) = d - u / (mu C_M): what sticks is what a lesser indentation would touch.

        """
        return self.profile.half_width(self._depth_of_core(displacement_m))

    def tangential_stiffness(self, displacement_m: Array | float) -> Array:
        """Return dT/du = 2 G* c on the virgin curve, N/m; any shape, u >= 0."""
        return 2.0 * self.elasticity.shear_pa * self.stick_radius(displacement_m)

    def tangential_force(self, displacement_m: Array | float) -> Array:
        """
        Return the tangential force on the virgin curve, N; any shape.

        Parameters
        ----------
        displacement_m : array or float
            Relative displacement u >= 0 from the unloaded state, m.

        Notes
        -----
        T(u) = mu [F_n(d) - F_n(d - u / (mu C_M))] up to u_max, mu F_n beyond.

        """
        core = normal_force(self.profile, self.elasticity, self._depth_of_core(displacement_m))
        return self.friction * (self.indentation.normal_force_n - core)

    def _depth_of_core(self, displacement_m: Array | float) -> Array:
        per_depth = self.friction * self.elasticity.cattaneo_mindlin
        used_m = np.asarray(displacement_m, dtype=float) / per_depth
        return np.maximum(self.indentation.depth_m - used_m, 0.0)


def presliding(
    profile: Profile, elasticity: Elasticity, friction: float, normal_force_n: float
) -> Presliding:
    """
    Prepare the tangential problem under a constant normal force.

    Parameters
    ----------
    profile : Profile
        The indenter.
    elasticity : Elasticity
        Effective moduli.
    friction : float
        Friction coefficient mu > 0.
    normal_force_n : float
        F_n > 0, N.

    Raises
    ------
    OutOfRange
        If the force does not press.

    """
    return Presliding(profile, elasticity, friction, indent(profile, elasticity, normal_force_n))
