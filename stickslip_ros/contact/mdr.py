# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Contact of two elastic bodies at constant load, by the method of dimensionality reduction.

Effective moduli (Eqs 5 and 6), the normal problem (Eqs 24 and 25), and the tangential problem in
closed form (Jaeger, Ciavarella; Eq. 22).

"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.contact.profile import Profile
from stickslip_ros.errors import OutOfRange

INDENTATIONS_KEPT = 64
"""Solutions kept for the next drive; a sweep over friction needs two for each preload."""


@dataclass(frozen=True)
class Elasticity:
    """Effective moduli of a pair of bodies."""

    normal_pa: float  # E*, Pa (Eq. 5). A spring of the foundation has the normal stiffness E* dx
    # G*, Pa (Eq. 6). A spring has the tangential stiffness G* dx, so the full-stick stiffness of
    # a contact of radius a is 2 G* a. Johnson, Mindlin and most DEM codes call a quarter of this
    # value G*
    shear_pa: float

    @property
    def cattaneo_mindlin(self) -> float:
        """C_M = E*/G*, the ratio of the normal to the tangential stiffness (Eq. 23)."""
        return self.normal_pa / self.shear_pa


def shear_modulus(young_pa: float, poisson: float) -> float:
    """Return the shear modulus G = E / (2 (1 + nu)) of an isotropic body, Pa."""
    return young_pa / (2.0 * (1.0 + poisson))


def effective_elasticity(
    young_1_pa: float, poisson_1: float, young_2_pa: float, poisson_2: float
) -> Elasticity:
    """
    Return the effective moduli of two isotropic bodies.

    1/E* = sum (1 - nu_i^2)/E_i (Eq. 5) and 1/G* = sum (2 - nu_i)/(4 G_i) (Eq. 6).

    """
    normal_compliance = (1.0 - poisson_1**2) / young_1_pa + (1.0 - poisson_2**2) / young_2_pa
    shear_compliance = sum(
        (2.0 - poisson) / (4.0 * shear_modulus(young, poisson))
        for young, poisson in ((young_1_pa, poisson_1), (young_2_pa, poisson_2))
    )
    return Elasticity(1.0 / normal_compliance, 1.0 / shear_compliance)


@dataclass(frozen=True)
class Indentation:
    """A contact under a constant normal force."""

    normal_force_n: float  # F_n, N
    depth_m: float  # indentation d = g(a), m (Eq. 25)
    radius_m: float  # contact radius a, m; half the length in contact if there are many patches


def normal_force(profile: Profile, elasticity: Elasticity, depth_m: Array | float) -> Array:
    """Return the normal force at an indentation depth d >= 0, N (Eq. 24); any shape."""
    return 2.0 * elasticity.normal_pa * profile.pressed_area_at(depth_m)


@lru_cache(maxsize=INDENTATIONS_KEPT, typed=True)
def indent(profile: Profile, elasticity: Elasticity, normal_force_n: float) -> Indentation:
    """
    Solve the normal problem for a force F_n > 0.

    Raises OutOfRange if the force is not positive and finite, or the profile is too short for it.

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


@dataclass(frozen=True, repr=False)
class Presliding:
    """
    A contact under a tangential force and a constant normal force.

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

    def __repr__(self) -> str:
        return (
            f'Presliding: {self.indentation.normal_force_n:.5g} N, slips at '
            f'{self.max_displacement_m:.5g} m and {self.max_force_n:.5g} N'
        )

    @property
    def max_displacement_m(self) -> float:
        """Displacement at which the whole contact slips, u_max = mu C_M d, m (Eq. 22)."""
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
        g(c) = d - u / (mu C_M): the core is the contact area at this smaller indentation.

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


def solve_presliding(
    profile: Profile, elasticity: Elasticity, friction: float, normal_force_n: float
) -> Presliding:
    """
    Prepare the tangential problem under a constant normal force F_n > 0, with mu > 0.

    Raises OutOfRange if the force is not positive and finite.

    """
    return Presliding(profile, elasticity, friction, indent(profile, elasticity, normal_force_n))
