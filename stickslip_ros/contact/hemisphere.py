"""From parameters to the contact of one hemisphere."""

from functools import lru_cache

from stickslip_ros.contact.elasticity import Elasticity, effective_elasticity
from stickslip_ros.contact.line_profile import rough_line_profile
from stickslip_ros.contact.profile import Profile, rough_profile, smooth_profile
from stickslip_ros.contact.roughness import rough_prefactor_1d
from stickslip_ros.contact.self_affine import Spectrum
from stickslip_ros.parameters import ContactParameters

PROFILES_KEPT = 64
"""Profiles kept for the next call: a rough line takes milliseconds to build."""


def elasticity_of(contact: ContactParameters) -> Elasticity:
    """Return the effective moduli of runner and hemisphere."""
    return effective_elasticity(
        contact.young_runner, contact.poisson_runner, contact.young_sphere, contact.poisson_sphere
    )


@lru_cache(maxsize=PROFILES_KEPT)
def profile_of(contact: ContactParameters, index: int = 0) -> Profile:
    """
    Return the profile that ``contact.profile`` names.

    Parameters
    ----------
    contact : ContactParameters
        The hemisphere.
    index : int
        Which hemisphere it is: each has a rough line of its own, of the seed line_seed + index.

    Raises
    ------
    OutOfRange
        If a rough line is asked for whose grid does not resolve its cut-offs.

    """
    if contact.profile == 'smooth':
        return smooth_profile(contact.radius)
    if contact.profile == 'rough_line':
        seed = contact.line_seed + index
        return rough_line_profile(
            spectrum_of(contact), contact.radius, contact.line_length, contact.line_points, seed
        )
    return rough_profile(contact.radius, prefactor_of(contact), contact.hurst)


def spectrum_of(contact: ContactParameters) -> Spectrum:
    """Return the power spectrum of the roughness; OutOfRange if its numbers do not fit."""
    return Spectrum(contact.hurst, contact.rms_height, contact.cutoff_lower, contact.cutoff_upper)


def prefactor_of(contact: ContactParameters) -> float:
    """Return Q_1D, m^(1-H): the given one, or that of the rms height (Eqs 16 and 17)."""
    if contact.prefactor:
        return contact.prefactor
    return rough_prefactor_1d(contact.rms_height, contact.hurst, contact.radius)
