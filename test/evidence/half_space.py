# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A rigid body of revolution on an elastic half-space in 3-D, and what it says of both bodies.

The contact circle is cut into rings of constant pressure (boundary elements). The displacement by
a ring is the difference of two uniformly loaded discs (Johnson, Contact Mechanics, Section 3.4),
which takes complete elliptic integrals. Nothing of the method of dimensionality reduction enters.

The contact radius is not known: it is that of the largest circle on which no pressure is
negative. The rings are finer at the centre, where a rough body has a singular pressure, and at
the edge, where every pressure has a vertical tangent; they scale with the circle, so that the
influence matrix is inverted once per mesh.

"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.optimize import bisect
from scipy.special import ellipe, ellipkm1

from evidence.closed_forms import (
    CONE_SLOPE,
    E_STAR_PA,
    HURST,
    PREFACTOR,
    RADIUS_M,
    Array,
    hess_integral,
)
from evidence.group import Group, grid

CENTRE_GRADE = 2.0
EDGE_GRADE = 3.0
"""Widths of the rings fall like s^(grade - 1); these grades give third order in practice."""


@dataclass(frozen=True)
class RingMesh:
    """Rings of the unit circle; the inverse, rings by rings, gives pressures at E* = 1."""

    middles: Array
    areas: Array
    inverse: Array


@dataclass(frozen=True)
class HalfSpaceContact:
    """Solution of the normal problem, with the pressure at the middles of the rings."""

    radius_m: float
    force_n: float
    radii_m: Array
    pressures_pa: Array


@lru_cache(maxsize=16)
def ring_mesh(rings: int) -> RingMesh:
    """Return the mesh with a number of rings."""
    s = np.linspace(0.0, 1.0, rings + 1, dtype=np.float64)
    edges = s**CENTRE_GRADE / (s**CENTRE_GRADE + (1.0 - s) ** EDGE_GRADE)
    middles = 0.5 * (edges[1:] + edges[:-1])
    discs = disc_displacement(edges[None, 1:], middles[:, None])
    discs[:, 1:] -= discs[:, :-1].copy()
    inverse = np.asarray(np.linalg.inv(discs), dtype=np.float64)
    return RingMesh(middles, np.pi * np.diff(edges**2), inverse)


def press(gap: Callable[[Array], Array], depth_m: float, rings: int) -> HalfSpaceContact:
    """Press a body of revolution, of a shape f(r) that rises from f(0) = 0, in."""
    mesh = ring_mesh(rings)

    def edge_pressure(radius_m: float) -> float:
        return float(mesh.inverse[-1] @ (depth_m - gap(radius_m * mesh.middles)))

    low_m = high_m = depth_m
    while edge_pressure(low_m) <= 0.0:
        low_m *= 0.5
    while edge_pressure(high_m) > 0.0:
        high_m *= 2.0
    radius_m = float(bisect(edge_pressure, low_m, high_m, xtol=1e-30))
    return _solution(mesh, radius_m, depth_m - gap(radius_m * mesh.middles))


def press_punch(radius_m: float, depth_m: float, rings: int) -> HalfSpaceContact:
    """Press a flat circular punch in: its contact radius is given, its edge pressure infinite."""
    mesh = ring_mesh(rings)
    return _solution(mesh, radius_m, np.full_like(mesh.middles, depth_m))


def _solution(mesh: RingMesh, radius_m: float, sinks_m: Array) -> HalfSpaceContact:
    pressures_pa = E_STAR_PA / radius_m * (mesh.inverse @ sinks_m)
    force_n = float(radius_m**2 * (mesh.areas @ pressures_pa))
    return HalfSpaceContact(radius_m, force_n, radius_m * mesh.middles, pressures_pa)


def disc_displacement(radius: Array, place: Array) -> Array:
    """
    Return E* times the displacement by a unit pressure on a disc, at places r of its plane.

    Notes
    -----
    Inside (4/pi) a E(r/a); outside (4/pi) r [E(a/r) - (1 - a^2/r^2) K(a/r)].

    """
    large, small = np.maximum(radius, place), np.minimum(radius, place)
    complement = (large - small) * (large + small) / large**2
    second = ellipe((small / large) ** 2)
    outside = second - complement * ellipkm1(complement)
    return np.asarray(4.0 / np.pi * large * np.where(place <= radius, second, outside))


RINGS = 256
FORCE_ERROR = 1e-7, f'mesh of {RINGS} rings: 3e-8 on Hertz, 4e-8 on the cone'
RADIUS_ERROR = 5e-7, f'mesh of {RINGS} rings: 2e-7 on Hertz and on the cone'
EXTRAPOLATED = 1e-9, 'extrapolation of two meshes: the error of next order'
ORDER = 3.0
DEPTHS_M = (20e-9, 80e-9, 263e-9)
DEPTH_M = DEPTHS_M[1]
BY = 'test/evidence/half_space.py'


def smooth_gap(r_m: Array) -> Array:
    """Return the shape r^2/(2 R) of the sphere, m."""
    return r_m**2 / (2.0 * RADIUS_M)


def rough_gap(r_m: Array) -> Array:
    """Return the shape r^2/(2 R) + Q_3D r^H of the equivalent rough body, m."""
    return smooth_gap(r_m) + PREFACTOR / hess_integral(HURST) * r_m**HURST


def cone_gap(r_m: Array) -> Array:
    """Return the shape of a cone, m."""
    return CONE_SLOPE * r_m


GAPS: dict[str, Callable[[Array], Array]] = {
    'smooth': smooth_gap,
    'rough': rough_gap,
    'cone': cone_gap,
}


@lru_cache(maxsize=32)
def solved(profile: str, depth_m: float, rings: int = RINGS) -> HalfSpaceContact:
    """Press a body of GAPS."""
    return press(GAPS[profile], depth_m, rings)


def extrapolated_n(profile: str, depth_m: float) -> float:
    """Return the force for rings without end, from 128 and 256 of them, N."""
    middle_n, fine_n = (solved(profile, depth_m, rings).force_n for rings in (128, 256))
    return fine_n + (fine_n - middle_n) / (2.0**ORDER - 1.0)


GROUPS = [
    Group(
        '3-D half-space', 'normal_force_n',
        lambda profile, depth_m: solved(profile, depth_m).force_n,
        FORCE_ERROR, f'3-D, {RINGS} rings', BY,
        grid(profile=['smooth', 'rough'], depth_m=DEPTHS_M),
    ),
    Group(
        '3-D half-space', 'radius_at_depth_m',
        lambda profile, depth_m: solved(profile, depth_m).radius_m,
        RADIUS_ERROR, f'3-D, {RINGS} rings', BY,
        grid(profile=['smooth', 'rough'], depth_m=DEPTHS_M),
    ),
    Group(
        '3-D half-space', 'normal_force_n', extrapolated_n, EXTRAPOLATED,
        '3-D, extrapolated from 128 and 256 rings', BY,
        grid(profile=['rough'], depth_m=[DEPTH_M]),
    ),
]  # fmt: skip
