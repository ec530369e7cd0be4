"""Checks of the method itself: the rough body of revolution on a half-space in 3-D."""

from collections.abc import Callable

import numpy as np

from stickslip_ros.contact.indentation import normal_force
from stickslip_ros.contact.profile import Array, Profile
from stickslip_ros.contact.roughness import hess_factor
from stickslip_ros.units import GIGA
from stickslip_ros.validation.checks import Check, Tolerance, compare, compare_worst
from stickslip_ros.validation.closed_forms import (
    PowerContact,
    hertz_force,
    pressure,
)
from stickslip_ros.validation.findings import Curve, Findings, Panel
from stickslip_ros.validation.half_space import HalfSpaceContact, press, press_punch
from stickslip_ros.validation.stand import (
    E_STAR_PA,
    FRICTION,
    G_STAR_PA,
    HURST,
    PREFACTOR,
    RADIUS_M,
    TERMS,
    lower_contact,
)

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
CONE_SLOPE = 0.01
PUNCH_M = 1e-6


def smooth_gap(r_m: Array) -> Array:
    """Return the shape r^2/(2 R) of the sphere, m."""
    return r_m**2 / (2.0 * RADIUS_M)


def rough_gap(r_m: Array) -> Array:
    """Return the shape r^2/(2 R) + Q_3D r^H of the equivalent rough body, m."""
    return smooth_gap(r_m) + PREFACTOR / hess_factor(HURST) * r_m**HURST


def cone_gap(r_m: Array) -> Array:
    """Return the shape of a cone, m."""
    return CONE_SLOPE * r_m


GAPS: dict[str, Callable[[Array], Array]] = {'smooth': smooth_gap, 'rough': rough_gap}


def three_dimensions() -> Findings:
    """Check Eqs 24 and 25 against the 3-D solution, and the solver before that."""
    checks = (*_solver(), *_order(), *_smooth(), *_rough())
    return Findings('3-D half-space', checks, (_pressures(), _forces(), _convergence()))


def _solver() -> list[Check]:
    """Check the solver where the answer is known; here the solver's value is ours."""
    depth_m = DEPTHS_M[1]
    sphere = press(smooth_gap, E_STAR_PA, depth_m, RINGS)
    punch = press_punch(PUNCH_M, E_STAR_PA, depth_m, RINGS)
    cone = press(cone_gap, E_STAR_PA, depth_m, RINGS)
    cone_radius_m = 2.0 * depth_m / (np.pi * CONE_SLOPE)
    cone_force_n = 0.5 * np.pi * E_STAR_PA * CONE_SLOPE * cone_radius_m**2
    sphere_force_n = float(hertz_force(np.array(depth_m), E_STAR_PA, RADIUS_M))
    sphere_radius_m = float(np.sqrt(RADIUS_M * depth_m))
    punch_force_n = 2.0 * E_STAR_PA * PUNCH_M * depth_m
    forces = (
        ('sphere', 'Hertz', sphere_force_n, sphere.force_n, FORCE_ERROR),
        ('flat punch', '2 E* a d', punch_force_n, punch.force_n, PUNCH_ERROR),
        ('cone', '(pi/2) E* a^2 tan', cone_force_n, cone.force_n, FORCE_ERROR),
    )
    radii = (
        ('sphere', 'Hertz', sphere_radius_m, sphere.radius_m),
        ('cone', '2 d/(pi tan)', cone_radius_m, cone.radius_m),
    )
    return [
        *(
            compare(f'solver, {name}: force', text, known, ours, 'N', tolerance)
            for name, text, known, ours, tolerance in forces
        ),
        *(
            compare(f'solver, {name}: radius', text, known, ours, 'm', RADIUS_ERROR)
            for name, text, known, ours in radii
        ),
    ]


def _order() -> list[Check]:
    """Check how the rough force converges, and where to."""
    forces_n = [press(rough_gap, E_STAR_PA, DEPTHS_M[1], rings).force_n for rings in MESHES[1:]]
    ratio = (forces_n[1] - forces_n[0]) / (forces_n[2] - forces_n[1])
    extrapolated_n = forces_n[2] + (forces_n[2] - forces_n[1]) / (2.0**ORDER - 1.0)
    contact = lower_contact('rough', 0.1)
    ours_n = float(normal_force(contact.profile, contact.elasticity, DEPTHS_M[1]))
    return [
        compare(
            'solver, rough: order of convergence',
            'third order on graded rings; 64, 128, 256 of them',
            ORDER,
            float(np.log2(ratio)),
            '',
            ORDER_ERROR,
        ),
        compare(
            'rough, d = 80 nm: force, extrapolated',
            '3-D, from 128 and 256 rings',
            extrapolated_n,
            ours_n,
            'N',
            EXTRAPOLATED,
        ),
    ]


def _pair(profile: Profile, solved: HalfSpaceContact) -> tuple[float, float]:
    """Return force and contact radius of the package at the depth of a 3-D solution."""
    elasticity = lower_contact('smooth', 0.1).elasticity
    force_n = float(normal_force(profile, elasticity, solved.depth_m))
    return force_n, float(profile.half_width(solved.depth_m))


def _smooth() -> list[Check]:
    solved = [press(smooth_gap, E_STAR_PA, depth_m, RINGS) for depth_m in DEPTHS_M]
    profile = lower_contact('smooth', 0.1).profile
    ours = [_pair(profile, each) for each in solved]
    text = f'3-D, {RINGS} rings'
    return [
        compare_worst(
            'smooth: force, worst of 3 depths',
            text,
            [s.force_n for s in solved],
            [force_n for force_n, _ in ours],
            'N',
            FORCE_ERROR,
        ),
        compare_worst(
            'smooth: radius, worst of 3 depths',
            text,
            [s.radius_m for s in solved],
            [radius_m for _, radius_m in ours],
            'm',
            RADIUS_ERROR,
        ),
    ]


def _rough() -> list[Check]:
    profile = lower_contact('rough', 0.1).profile
    checks = []
    for depth_m in DEPTHS_M:
        solved = press(rough_gap, E_STAR_PA, depth_m, RINGS)
        force_n, radius_m = _pair(profile, solved)
        name, text = f'rough, d = {depth_m * 1e9:g} nm', f'3-D, {RINGS} rings'
        checks += [
            compare(f'{name}: force (Eq. 24)', text, solved.force_n, force_n, 'N', FORCE_ERROR),
            compare(
                f'{name}: radius (Eq. 25)', text, solved.radius_m, radius_m, 'm', RADIUS_ERROR
            ),
        ]
    return checks


def _pressures() -> Panel:
    curves = []
    for colour, (name, gap) in enumerate(GAPS.items()):
        solved = press(gap, E_STAR_PA, DEPTHS_M[1], 64)
        form = PowerContact(TERMS[name], E_STAR_PA, G_STAR_PA, FRICTION, solved.radius_m)
        radii_m = solved.radius_m * np.linspace(0.004, 0.999, 300, dtype=np.float64)
        curves += [
            Curve(
                f'{name}, integral of g',
                radii_m * 1e6,
                pressure(form, radii_m) / GIGA,
                'line',
                colour,
            ),
            Curve(
                f'{name}, 3-D, 64 rings',
                solved.radii_m[4::3] * 1e6,
                solved.pressures_pa[4::3] / GIGA,
                'points',
                colour,
            ),
        ]
    return Panel(
        'Pressure on the half-space, d = 80 nm',
        'distance from the axis r (um)',
        'pressure p (GPa)',
        tuple(curves),
    )


def _forces() -> Panel:
    depths_m = np.logspace(-8.5, -6.0, 60, dtype=np.float64)
    some_m = depths_m[::6]
    curves = []
    for colour, (name, gap) in enumerate(GAPS.items()):
        contact = lower_contact(name, 0.1)
        ours_n = normal_force(contact.profile, contact.elasticity, depths_m)
        solved = np.array([press(gap, E_STAR_PA, float(d), 64).force_n for d in some_m])
        curves += [
            Curve(f'{name}, Eqs 24, 25', depths_m * 1e9, ours_n * 1e3, 'line', colour),
            Curve(f'{name}, 3-D', some_m * 1e9, solved * 1e3, 'points', colour),
        ]
    return Panel(
        'Normal force', 'depth d (nm)', 'force F_n (mN)', tuple(curves), log_x=True, log_y=True
    )


def mesh_errors(name: str) -> tuple[Array, Array]:
    """
    Return the errors of force and radius against Eqs 24 and 25, one per mesh of MESHES.

    Parameters
    ----------
    name : str
        ``smooth`` or ``rough``.

    """
    profile = lower_contact(name, 0.1).profile
    solved = [press(GAPS[name], E_STAR_PA, DEPTHS_M[1], rings) for rings in MESHES]
    exact_n, exact_m = _pair(profile, solved[0])
    forces = np.array([abs(each.force_n / exact_n - 1.0) for each in solved])
    return forces, np.array([abs(each.radius_m / exact_m - 1.0) for each in solved])


def _convergence() -> Panel:
    rings = np.array(MESHES, dtype=float)
    curves = []
    for colour, name in enumerate(GAPS):
        forces, radii = mesh_errors(name)
        curves += [
            Curve(f'{name}, force', rings, forces, 'line', colour),
            Curve(f'{name}, radius', rings, radii, 'dashed', colour),
        ]
    curves.append(Curve('third order', rings, 1.2 * rings**-3.0, 'line', 2))
    return Panel(
        '3-D solution: mesh against Eqs 24, 25',
        'number of rings',
        'relative difference',
        tuple(curves),
        log_x=True,
        log_y=True,
        x_ticks=MESHES,
    )
