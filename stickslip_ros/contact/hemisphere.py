"""From parameters to the contact of one hemisphere."""

from stickslip_ros.contact.elasticity import Elasticity, effective_elasticity
from stickslip_ros.contact.profile import Profile, rough_profile, smooth_profile
from stickslip_ros.contact.roughness import rough_prefactor_1d
from stickslip_ros.parameters import ContactParameters


def elasticity_of(contact: ContactParameters) -> Elasticity:
    """Return the effective moduli of runner and hemisphere."""
    return effective_elasticity(
        contact.young_runner, contact.poisson_runner, contact.young_sphere, contact.poisson_sphere
    )


def profile_of(contact: ContactParameters) -> Profile:
    """Return the profile that ``contact.profile`` names."""
    if contact.profile == 'smooth':
        return smooth_profile(contact.radius)
    return rough_profile(contact.radius, prefactor_of(contact), contact.hurst)


def prefactor_of(contact: ContactParameters) -> float:
    """Return Q_1D, m^(1-H): the given one, or that of the rms height (Eqs 16 and 17)."""
    if contact.prefactor:
        return contact.prefactor
    return rough_prefactor_1d(contact.rms_height, contact.hurst, contact.radius)
