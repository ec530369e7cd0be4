"""
A rigid body of revolution on an elastic half-space in 3-D, and the checks against it.

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

from stickslip_ros.contact.mdr import normal_force
from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.roughness import hess_factor
from stickslip_ros.errors import OutOfRange
from stickslip_ros.units import GIGA, MICRO, MN, NM
from stickslip_ros.validation.checks import (
    Curve,
    Family,
    Measured,
    Panel,
    Tolerance,
    measures,
    shared,
)
from stickslip_ros.validation.histories import lower_contact
from stickslip_ros.validation.references import (
    CONE_SLOPE,
    E_STAR_PA,
    HURST,
    PREFACTOR,
    RADIUS_M,
    TERMS,
    PowerContact,
    hertz_force,
    pressure,
)

CENTRE_GRADE = 2.0
EDGE_GRADE = 3.0
"""Widths of the rings fall like s^(grade - 1); these grades give third order in practice."""
RINGS_MIN = 4


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
    """
    Return the mesh with a number of rings.

    Raises
    ------
    OutOfRange
        If there are fewer than 4.

    """
    if rings < RINGS_MIN:
        hint = 'take 64 or more'
        raise OutOfRange('number of rings', rings, '', f'below {RINGS_MIN}', hint)
    s = np.linspace(0.0, 1.0, rings + 1, dtype=np.float64)
    edges = s**CENTRE_GRADE / (s**CENTRE_GRADE + (1.0 - s) ** EDGE_GRADE)
    middles = 0.5 * (edges[1:] + edges[:-1])
    discs = disc_displacement(edges[None, 1:], middles[:, None])
    discs[:, 1:] -= discs[:, :-1].copy()
    inverse = np.asarray(np.linalg.inv(discs), dtype=np.float64)
    return RingMesh(middles, np.pi * np.diff(edges**2), inverse)


def press(gap: Callable[[Array], Array], depth_m: float, rings: int) -> HalfSpaceContact:
    """
    Press a body of revolution, of a shape f(r) that rises from f(0) = 0, into the half-space.

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
MESHES = (32, 64, 128, 256)
FORCE_ERROR = Tolerance(1e-7, f'mesh of {RINGS} rings: 3e-8 on Hertz, 4e-8 on the cone')
RADIUS_ERROR = Tolerance(5e-7, f'mesh of {RINGS} rings: 2e-7 on Hertz and on the cone')
PUNCH_ERROR = Tolerance(
    3e-7, f'mesh of {RINGS} rings under a pressure that is infinite at the edge'
)
ORDER_ERROR = Tolerance(0.05, 'order of three meshes that are not yet infinitely fine')
ORDER = 3.0
EXTRAPOLATED = Tolerance(1e-9, 'extrapolation of two meshes: the error of next order')
DEPTHS_M = (20e-9, 80e-9, 263e-9)
DEPTH_M = DEPTHS_M[1]
PUNCH_M = 1e-6
SOLVED = f'3-D, {RINGS} rings'


def smooth_gap(r_m: Array) -> Array:
    """Return the shape r^2/(2 R) of the sphere, m."""
    return r_m**2 / (2.0 * RADIUS_M)


def rough_gap(r_m: Array) -> Array:
    """Return the shape r^2/(2 R) + Q_3D r^H of the equivalent rough body, m."""
    return smooth_gap(r_m) + PREFACTOR / hess_factor(HURST) * r_m**HURST


def cone_gap(r_m: Array) -> Array:
    """Return the shape of a cone, m."""
    return CONE_SLOPE * r_m


GAPS: dict[str, Callable[[Array], Array]] = {
    'smooth': smooth_gap,
    'rough': rough_gap,
    'cone': cone_gap,
}
PROFILES = ('smooth', 'rough')


@shared
def _solved(name: str, depth_m: float, rings: int = RINGS) -> HalfSpaceContact:
    return press(GAPS[name], depth_m, rings)


def _forces(name: str, depths_m: Array | float) -> Array:
    """Return the package's normal forces on a body, N."""
    contact = lower_contact(name, 0.1)
    return normal_force(contact.profile, contact.elasticity, depths_m)


def _radius(name: str, depth_m: float) -> float:
    """Return the package's contact radius of a body, m."""
    return float(lower_contact(name, 0.1).profile.half_width(depth_m))


@measures(
    ('solver, sphere: force', 'Hertz', 'N', FORCE_ERROR),
    ('solver, flat punch: force', '2 E* a d', 'N', PUNCH_ERROR),
    ('solver, cone: force', '(pi/2) E* a^2 tan', 'N', FORCE_ERROR),
    ('solver, sphere: radius', 'Hertz', 'm', RADIUS_ERROR),
    ('solver, cone: radius', '2 d/(pi tan)', 'm', RADIUS_ERROR),
)
def _solver() -> Measured:
    """Check the solver where the answer is known; here the solver's value is ours."""
    sphere, cone = _solved('smooth', DEPTH_M), _solved('cone', DEPTH_M)
    punch = press_punch(PUNCH_M, DEPTH_M, RINGS)
    cone_m = 2.0 * DEPTH_M / (np.pi * CONE_SLOPE)
    return (
        (hertz_force(DEPTH_M), sphere.force_n),
        (2.0 * E_STAR_PA * PUNCH_M * DEPTH_M, punch.force_n),
        (0.5 * np.pi * E_STAR_PA * CONE_SLOPE * cone_m**2, cone.force_n),
        (np.sqrt(RADIUS_M * DEPTH_M), sphere.radius_m),
        (cone_m, cone.radius_m),
    )


@measures(
    (
        'solver, rough: order of convergence',
        'third order on graded rings; 64, 128, 256 of them',
        '',
        ORDER_ERROR,
    ),
    ('rough, d = 80 nm: force, extrapolated', '3-D, from 128 and 256 rings', 'N', EXTRAPOLATED),
)
def _order() -> Measured:
    """Check how the rough force converges, and where to."""
    coarse_n, middle_n, fine_n = (_solved('rough', DEPTH_M, rings).force_n for rings in MESHES[1:])
    limit_n = fine_n + (fine_n - middle_n) / (2.0**ORDER - 1.0)
    order = np.log2((middle_n - coarse_n) / (fine_n - middle_n))
    return (ORDER, order), (limit_n, _forces('rough', DEPTH_M))


@measures(
    ('smooth: force, worst of 3 depths', SOLVED, 'N', FORCE_ERROR),
    ('smooth: radius, worst of 3 depths', SOLVED, 'm', RADIUS_ERROR),
)
def _smooth() -> Measured:
    solved = [_solved('smooth', depth_m) for depth_m in DEPTHS_M]
    radii_m = [_radius('smooth', depth_m) for depth_m in DEPTHS_M]
    return (
        ([each.force_n for each in solved], _forces('smooth', np.array(DEPTHS_M))),
        ([each.radius_m for each in solved], radii_m),
    )


@measures(
    ('rough, d = {1} nm: force (Eq. 24)', SOLVED, 'N', FORCE_ERROR),
    ('rough, d = {1} nm: radius (Eq. 25)', SOLVED, 'm', RADIUS_ERROR),
    each=tuple((depth_m, f'{depth_m * NM:g}') for depth_m in DEPTHS_M),
)
def _rough(depth_m: float, _depth_nm: str) -> Measured:
    solved = _solved('rough', depth_m)
    force_n, radius_m = _forces('rough', depth_m), _radius('rough', depth_m)
    return (solved.force_n, force_n), (solved.radius_m, radius_m)


def _pressure_panel() -> Panel:
    curves = []
    for colour, name in enumerate(PROFILES):
        solved = _solved(name, DEPTH_M, 64)
        radii_m = solved.radius_m * np.linspace(0.004, 0.999, 300, dtype=np.float64)
        exact_pa = pressure(PowerContact(TERMS[name], solved.radius_m), radii_m)
        x, y = solved.radii_m[4::3] / MICRO, solved.pressures_pa[4::3] / GIGA
        curves += [
            Curve(f'{name}, integral of g', radii_m / MICRO, exact_pa / GIGA, 'line', colour),
            Curve(f'{name}, 3-D, 64 rings', x, y, 'points', colour),
        ]
    title = 'Pressure on the half-space, d = 80 nm'
    return Panel(title, 'distance from the axis r (um)', 'pressure p (GPa)', curves)


def _force_panel() -> Panel:
    depths_m = np.logspace(-8.5, -6.0, 60, dtype=np.float64)
    x, some_m = depths_m * NM, depths_m[::6]
    curves = []
    for colour, name in enumerate(PROFILES):
        solved_n = np.array([_solved(name, float(d), 64).force_n for d in some_m])
        curves += [
            Curve(f'{name}, Eqs 24, 25', x, _forces(name, depths_m) * MN, 'line', colour),
            Curve(f'{name}, 3-D', some_m * NM, solved_n * MN, 'points', colour),
        ]
    labels = ('Normal force', 'depth d (nm)', 'force F_n (mN)')
    return Panel(*labels, curves, log_x=True, log_y=True)


def _mesh_panel() -> Panel:
    rings, curves = np.array(MESHES, dtype=float), []
    for colour, name in enumerate(PROFILES):
        exact_n, exact_m = float(_forces(name, DEPTH_M)), _radius(name, DEPTH_M)
        solved = [_solved(name, DEPTH_M, count) for count in MESHES]
        forces = np.array([abs(each.force_n / exact_n - 1.0) for each in solved])
        radii = np.array([abs(each.radius_m / exact_m - 1.0) for each in solved])
        curves += [
            Curve(f'{name}, force', rings, forces, 'line', colour),
            Curve(f'{name}, radius', rings, radii, 'dashed', colour),
        ]
    curves.append(Curve('third order', rings, 1.2 * rings**-3.0, 'line', 2))
    return Panel(
        '3-D solution: mesh against Eqs 24, 25',
        'number of rings',
        'relative difference',
        curves,
        log_x=True,
        log_y=True,
        x_ticks=MESHES,
    )


HALF_SPACE = Family(
    '3-D half-space',
    (_solver, _order, _smooth, _rough),
    (_pressure_panel, _force_panel, _mesh_panel),
)
