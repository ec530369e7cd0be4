# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Contact of one hemisphere, from parameters."""

from functools import lru_cache

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.contact import mdr
from stickslip_ros.contact.mdr import Elasticity, Presliding, effective_elasticity
from stickslip_ros.contact.profile import (
    LineProfile,
    Profile,
    line_profile,
    rough_profile,
    smooth_profile,
)
from stickslip_ros.contact.roughness import Spectrum, rough_line, rough_prefactor_1d
from stickslip_ros.kernels.record import Record
from stickslip_ros.parameters import FEET_MAX, ContactParameters, Parameters, checked_arguments

PROFILES_KEPT = 64
"""Profiles kept for the next call: a rough line takes milliseconds to build."""


@checked_arguments
def presliding(parameters: Parameters, *, normal_force_n: float) -> Presliding:
    """
    Solve one hemisphere under a constant normal force, in closed form.

    Parameters
    ----------
    parameters : Parameters
        The stand; only ``contact`` is used.
    normal_force_n : float
        Normal force F_n > 0, N.

    Returns
    -------
    Presliding
        Indentation, stick radius, and tangential force over displacement.

    Raises
    ------
    OutOfRange
        If the force is not positive and finite.

    Examples
    --------
    >>> presliding(Parameters(), normal_force_n=0.1)
    Presliding: 0.1 N, slips at 4.9368e-08 m and 0.03 N

    """
    contact = parameters.contact
    elasticity = elasticity_of(contact)
    return mdr.solve_presliding(profile_of(contact), elasticity, contact.friction, normal_force_n)


def elasticity_of(contact: ContactParameters) -> Elasticity:
    """Return the effective moduli of runner and hemisphere."""
    return effective_elasticity(
        contact.young_runner, contact.poisson_runner, contact.young_sphere, contact.poisson_sphere
    )


@lru_cache(maxsize=PROFILES_KEPT)
def profile_of(
    contact: ContactParameters, index: int = 0, feet: tuple[ContactParameters, ...] = ()
) -> Profile:
    """
    Return the profile that ``contact.profile`` names; the seed of a rough line adds ``index``.

    ``feet`` are those of `lines_of`, for travelling roughness.

    Raises OutOfRange if the grid of a rough line does not resolve its cut-offs.

    """
    if contact.profile == 'smooth':
        return smooth_profile(contact.radius)
    if contact.profile == 'rough_line':
        if contact.travel:
            from stickslip_ros.contact.travel import window_profile  # noqa: PLC0415 - numba

            return window_profile(lines_of(contact, feet), index)
        seed = contact.line_seed + index
        return rough_line_profile(
            spectrum_of(contact), contact.radius, contact.line_length, contact.line_points, seed
        )
    return rough_profile(contact.radius, prefactor_of(contact), contact.hurst)


def spectrum_of(contact: ContactParameters) -> Spectrum:
    """Return the power spectrum of the roughness; raises OutOfRange if it is impossible."""
    return Spectrum(contact.hurst, contact.rms_height, contact.cutoff_lower, contact.cutoff_upper)


def lines_of(contact: ContactParameters, feet: tuple[ContactParameters, ...] = ()) -> Record:
    """
    Return the lines under the feet for travelling roughness, read-only.

    ``feet`` are the contacts of the first feet; all others have ``contact``.

    """
    from stickslip_ros.contact.travel import track_of  # noqa: PLC0415 - numba is imported by it

    each = (*feet, *[contact] * (FEET_MAX - len(feet)))
    normal_pa = tuple(elasticity_of(one).normal_pa for one in each)
    return track_of(contact, spectrum_of(contact), tuple(one.radius for one in each), normal_pa)


def prefactor_of(contact: ContactParameters) -> float:
    """Return Q_1D, m^(1-H): as given, or from the rms height (Eqs 16 and 17)."""
    if contact.prefactor:
        return contact.prefactor
    return rough_prefactor_1d(contact.rms_height, contact.hurst, contact.radius)


def rough_line_profile(
    spectrum: Spectrum, radius_m: float, length_m: float, points: int, seed: int
) -> LineProfile:
    """
    Return a rough parabola g(x) = x^2/R + h(x) (Eq. 14), centred below the sphere.

    Raises OutOfRange if the grid does not resolve the spectrum.

    """
    spacing_m = length_m / points
    x_m = line_places(length_m, points)
    return line_profile(
        x_m**2 / radius_m + rough_line(spectrum, length_m, points, seed), spacing_m
    )


def line_places(length_m: float, points: int) -> Array:
    """Return the positions of the springs, m: the centres of equal cells from -L/2 to L/2."""
    return (np.arange(points, dtype=np.float64) + 0.5) * (length_m / points) - 0.5 * length_m
