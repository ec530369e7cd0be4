"""Effective moduli of two elastic bodies in contact."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Elasticity:
    """
    Effective moduli of a pair of bodies.

    Attributes
    ----------
    normal_pa : float
        E*, Pa (Eq. 5). A spring of the foundation has the normal stiffness E* dx.
    shear_pa : float
        G*, Pa (Eq. 6). A spring has the tangential stiffness G* dx, so the full-stick
        stiffness of a contact of radius a is 2 G* a. Johnson, Mindlin and most DEM codes
        call a quarter of this value G*.

    """

    normal_pa: float
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

    Parameters
    ----------
    young_1_pa, young_2_pa : float
        Young's moduli, Pa.
    poisson_1, poisson_2 : float
        Poisson's ratios.

    Notes
    -----
    1/E* = sum (1 - nu_i^2)/E_i (Eq. 5) and 1/G* = sum (2 - nu_i)/(4 G_i) (Eq. 6).

    """
    normal_compliance = (1.0 - poisson_1**2) / young_1_pa + (1.0 - poisson_2**2) / young_2_pa
    shear_compliance = sum(
        (2.0 - poisson) / (4.0 * shear_modulus(young, poisson))
        for young, poisson in ((young_1_pa, poisson_1), (young_2_pa, poisson_2))
    )
    return Elasticity(1.0 / normal_compliance, 1.0 / shear_compliance)
