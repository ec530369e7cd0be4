"""
A rigid body of revolution on an elastic half-space: boundary elements in three dimensions.

The contact circle is cut into rings of constant pressure. The displacement by a ring is the
difference of two uniformly loaded discs (Johnson, Contact Mechanics, Section 3.4), which takes
complete elliptic integrals. Nothing of the method of dimensionality reduction enters.

The contact radius is not known: it is that of the largest circle on which no pressure is
negative. The rings are finer at the centre, where a rough body has a singular pressure, and at
the edge, where every pressure has a vertical tangent; they scale with the circle, so that the
influence matrix is inverted once per mesh.

"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from stickslip_ros.contact.profile import Array
from stickslip_ros.errors import OutOfRange

CENTRE_GRADE = 2.0
EDGE_GRADE = 3.0
"""Widths of the rings fall like s^(grade - 1); these grades give third order in practice."""
BISECTIONS = 200
MEAN_STEPS = 40
"""Arithmetic-geometric means converge quadratically; from 1e-150 in a dozen steps."""
RINGS_MIN = 4


@dataclass(frozen=True)
class RingMesh:
    """
    Rings of the unit circle.

    Attributes
    ----------
    middles : array, shape (rings,)
        Radii at which displacements are prescribed.
    areas : array, shape (rings,)
        Areas of the rings.
    inverse : array, shape (rings, rings)
        Pressures by displacements at E* = 1.

    """

    middles: Array
    areas: Array
    inverse: Array


@dataclass(frozen=True)
class HalfSpaceContact:
    """
    Solution of the normal problem.

    Attributes
    ----------
    depth_m, radius_m, force_n : float
        Indentation d, contact radius a, normal force F_n.
    radii_m, pressures_pa : array, shape (rings,)
        Pressure at the middles of the rings.

    """

    depth_m: float
    radius_m: float
    force_n: float
    radii_m: Array
    pressures_pa: Array


@lru_cache(maxsize=16)
def ring_mesh(rings: int) -> RingMesh:
    """
    Return the mesh with a number of rings.

    Raises
    ------
    OutOfRange
        If there are fewer than 4.

    """
    if rings < RINGS_MIN:
        mend = 'take 64 or more'
        raise OutOfRange('number of rings', rings, '', f'below {RINGS_MIN}', mend)
    s = np.linspace(0.0, 1.0, rings + 1, dtype=np.float64)
    edges = s**CENTRE_GRADE / (s**CENTRE_GRADE + (1.0 - s) ** EDGE_GRADE)
    middles = 0.5 * (edges[1:] + edges[:-1])
    discs = disc_displacement(edges[None, 1:], middles[:, None])
    discs[:, 1:] -= discs[:, :-1].copy()
    inverse = np.asarray(np.linalg.inv(discs), dtype=np.float64)
    return RingMesh(middles, np.pi * np.diff(edges**2), inverse)


def press(
    gap: Callable[[Array], Array], modulus_pa: float, depth_m: float, rings: int
) -> HalfSpaceContact:
    """
    Press a body of revolution into the half-space.

    Parameters
    ----------
    gap : callable
        Shape f(r) of the body, m, with f(0) = 0 and rising.
    modulus_pa : float
        E*, Pa.
    depth_m : float
        Indentation d > 0, m.
    rings : int
        Number of rings.

    Raises
    ------
    OutOfRange
        If the depth is not above 0.

    """
    if not depth_m > 0.0:
        raise OutOfRange('depth', depth_m, 'm', 'not above 0 m', 'press the body in')
    mesh = ring_mesh(rings)

    def edge_pressure(radius_m: float) -> float:
        return float(mesh.inverse[-1] @ (depth_m - gap(radius_m * mesh.middles)))

    radius_m = _where_it_vanishes(edge_pressure, depth_m)
    return _solution(mesh, modulus_pa, depth_m, radius_m, gap(radius_m * mesh.middles))


def press_punch(
    radius_m: float, modulus_pa: float, depth_m: float, rings: int
) -> HalfSpaceContact:
    """Press a flat circular punch in: its contact radius is given, its edge pressure infinite."""
    mesh = ring_mesh(rings)
    return _solution(mesh, modulus_pa, depth_m, radius_m, np.zeros_like(mesh.middles))


def _solution(
    mesh: RingMesh, modulus_pa: float, depth_m: float, radius_m: float, gaps_m: Array
) -> HalfSpaceContact:
    pressures_pa = modulus_pa / radius_m * (mesh.inverse @ (depth_m - gaps_m))
    force_n = float(radius_m**2 * (mesh.areas @ pressures_pa))
    return HalfSpaceContact(depth_m, radius_m, force_n, radius_m * mesh.middles, pressures_pa)


def _where_it_vanishes(falling: Callable[[float], float], start: float) -> float:
    """Return the zero of a function that is positive at 0 and falls, by bisection."""
    low = high = start
    while falling(low) <= 0.0:
        low *= 0.5
    while falling(high) > 0.0:
        high *= 2.0
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        if not low < middle < high:
            break
        low, high = (middle, high) if falling(middle) > 0.0 else (low, middle)
    return low


def disc_displacement(radius: Array, place: Array) -> Array:
    """
    Return E* times the displacement at a radial place by a unit pressure on a disc.

    Parameters
    ----------
    radius, place : array
        Radius of the disc and distance from its centre; they broadcast.

    Notes
    -----
    Inside (4/pi) a E(r/a); outside (4/pi) r [E(a/r) - (1 - a^2/r^2) K(a/r)].

    """
    large, small = np.maximum(radius, place), np.minimum(radius, place)
    complement = (large - small) * (large + small) / large**2
    first, second = elliptic_integrals(complement)
    outside = second - complement * first
    return np.asarray(4.0 / np.pi * large * np.where(place <= radius, second, outside))


def elliptic_integrals(complement: Array) -> tuple[Array, Array]:
    """
    Return the complete elliptic integrals K and E by the arithmetic-geometric mean.

    Parameters
    ----------
    complement : array
        1 - k^2 in (0, 1], of the modulus k.

    """
    mean, other = np.ones_like(complement), np.sqrt(complement)
    power, total = 0.5, 0.5 * (1.0 - complement)
    for _ in range(MEAN_STEPS):
        half = 0.5 * (mean - other)
        mean, other = 0.5 * (mean + other), np.sqrt(mean * other)
        power *= 2.0
        total = total + power * half**2
        if np.all(half <= np.finfo(float).eps * mean):
            break
    first = 0.5 * np.pi / mean
    return first, first * (1.0 - total)
