"""
Many rough lines against the equivalent profile (Eq. 14 against Eq. 18).

The equivalent profile takes its prefactor from Eqs 16 and 17 with the rms height, the Hurst
exponent and the radius of the lines; nothing is fitted. Depths of a rough line count from its
own first touch. That sets its zero of the normal law and of u_max, which is the compression of
its lowest spring; force against stiffness is free of it.

"""

import dataclasses
from dataclasses import dataclass

import numpy as np

from stickslip_ros.contact.hemisphere import elasticity_of, profile_of
from stickslip_ros.contact.mdr import Presliding, normal_force, presliding
from stickslip_ros.contact.profile import Array, PowerProfile, Profile, rough_profile
from stickslip_ros.contact.roughness import rough_prefactor_1d
from stickslip_ros.errors import OutOfRange
from stickslip_ros.parameters import ContactParameters, Parameters
from stickslip_ros.stopping import heed_stop
from stickslip_ros.study.batch import Progress

LOADS_N = tuple(float(load_n) for load_n in np.logspace(-2.0, 0.0, 13))
"""Normal forces from 0.01 to 1 N, six per decade: the loads of the stand and a decade below."""
REALISATIONS_MIN = 2
"""Fewest lines that have a spread."""


@dataclass(frozen=True)
class Comparison:
    """
    One quantity of many lines beside that of the equivalent profile.

    ``lines`` has the shape (realisations, loads), all others have the shape (loads,).

    """

    lines: Array
    equivalent: Array

    @property
    def mean(self) -> Array:
        """Mean over the lines."""
        return np.asarray(np.mean(self.lines, axis=0))

    @property
    def spread(self) -> Array:
        """Standard deviation over the lines."""
        return np.asarray(np.std(self.lines, axis=0, ddof=1))

    @property
    def ratio(self) -> Array:
        """Mean of the lines, relative to the equivalent profile."""
        return self.mean / self.equivalent

    @property
    def ratio_spread(self) -> Array:
        """Standard deviation of the lines, relative to the equivalent profile."""
        return self.spread / self.equivalent


@dataclass(frozen=True)
class Ensemble:
    """
    Rough lines and their equivalent profile over a range of loads.

    Attributes
    ----------
    loads_n : array, shape (loads,)
        Normal forces, N.
    depths_m : array, shape (loads,)
        Indentations of the equivalent profile under these, m: where normal forces are compared.
    normal_force_n, max_displacement_m, stiffness_n_per_m : Comparison
        Normal force at these depths, N; under these loads u_max = mu C_M d, m, and the tangential
        stiffness of full stick, N/m.
    springs_in_contact : array, shape (loads,)
        Mean number of springs in contact.

    """

    loads_n: Array
    depths_m: Array
    normal_force_n: Comparison
    max_displacement_m: Comparison
    stiffness_n_per_m: Comparison
    springs_in_contact: Array

    @property
    def comparisons(self) -> dict[str, Comparison]:
        """The three comparisons by name."""
        return {
            'normal_force': self.normal_force_n,
            'max_displacement': self.max_displacement_m,
            'stiffness': self.stiffness_n_per_m,
        }


def rough_line_ensemble(
    parameters: Parameters,
    realisations: int,
    loads_n: Array | tuple[float, ...] = LOADS_N,
    progress: Progress | None = None,
) -> Ensemble:
    """
    Press realisations of a rough line and their equivalent profile.

    Parameters
    ----------
    parameters : Parameters
        Gives material, radius and roughness; the lines have the seeds contact.line_seed, and on.
    realisations : int
        Number of lines, at least 2.
    loads_n : array or tuple of float
        Normal forces, N.
    progress : callable, optional
        Called with lines done and lines wanted.

    Raises
    ------
    OutOfRange
        If there are too few lines, their grid does not resolve the roughness, or one is too
        short for a load.

    """
    if realisations < REALISATIONS_MIN:
        limit = f'below {REALISATIONS_MIN}, the fewest that have a spread'
        raise OutOfRange('number of realisations', realisations, '', limit, 'raise it')
    contact = line_contact(parameters.contact)
    elasticity = elasticity_of(contact)
    loads = np.asarray(loads_n, dtype=float)
    equivalent = _press(equivalent_profile(contact), contact, loads)
    depths_m = np.array([each.indentation.depth_m for each in equivalent])
    lines = []
    for index in range(realisations):
        heed_stop()
        line = profile_of(contact, index)
        forces_n = normal_force(line, elasticity, depths_m)
        lines.append(np.stack((forces_n, *_readings(_press(line, contact, loads)))))
        if progress is not None:
            progress(index + 1, realisations)
    forces, displacements, stiffnesses = map(
        Comparison, np.stack(lines, axis=1), (loads, *_readings(equivalent))
    )
    per_spring = elasticity.shear_pa * contact.line_length / contact.line_points
    springs = stiffnesses.mean / per_spring
    return Ensemble(loads, depths_m, forces, displacements, stiffnesses, springs)


def line_contact(contact: ContactParameters) -> ContactParameters:
    """
    Return the contact with a rough line, whatever its profile was.

    Raises
    ------
    OutOfRange
        If it has a prefactor of its own, which a line cannot have.

    """
    return dataclasses.replace(contact, profile='rough_line')


def equivalent_profile(contact: ContactParameters) -> PowerProfile:
    """Return the profile of Eq. 18 with the Q_1D of Eqs 16 and 17: the rms height decides."""
    prefactor = rough_prefactor_1d(contact.rms_height, contact.hurst, contact.radius)
    return rough_profile(contact.radius, prefactor, contact.hurst)


def _press(profile: Profile, contact: ContactParameters, loads_n: Array) -> list[Presliding]:
    elasticity = elasticity_of(contact)
    return [presliding(profile, elasticity, contact.friction, float(load)) for load in loads_n]


def _readings(pressed: list[Presliding]) -> tuple[Array, Array]:
    """Return u_max, m, and full-stick stiffness, N/m, of a contact under each load."""
    return (
        np.array([contact.max_displacement_m for contact in pressed]),
        np.array([contact.stick_stiffness_n_per_m for contact in pressed]),
    )
