"""
Checks against CONTACT (Vollebregt, Kalker), a published program for contact in 3-D.

Its example ``cattaneo``: a sphere on a plane, pressed by F_n and pulled by 7/8 of mu F_n.
The figures are those of its printed output, github.com/eve70a/CONTACT, Apache-2.0,
examples/cattaneo.ref_out; elastic energy of the pull is 8.525e-5 - 7.350e-5 J.

"""

from math import sqrt

import numpy as np

from stickslip_ros.contact.elasticity import effective_elasticity
from stickslip_ros.contact.indentation import normal_force
from stickslip_ros.contact.presliding import Presliding, presliding
from stickslip_ros.contact.profile import smooth_profile
from stickslip_ros.contact.virgin import CELLS
from stickslip_ros.units import MILLI
from stickslip_ros.validation.checks import ROUNDING, Check, Tolerance, compare
from stickslip_ros.validation.closed_forms import (
    hertz_depth,
    sphere_loss_ratio,
    unit_quadrature,
)
from stickslip_ros.validation.findings import Curve, Findings, Panel
from stickslip_ros.validation.histories import TABLE, History, remember
from stickslip_ros.validation.jaeger import SPRING_ERROR, SPRINGS
from stickslip_ros.validation.springs import plant_springs, pull
from stickslip_ros.validation.stand import fractions

SPHERE_M = 50e-3
SHEAR_PA = 200e6
POISSON = 0.42
FRICTION = 0.4
NORMAL_N = 9.1954
PULL = 7.0 / 8.0
"""F_x/(mu F_n)."""
PULLED = 0.75
"""u/u_max of that force: 1 - (1/8)^(2/3)."""

MESH = Tolerance(3e-3, 'its mesh, 15 elements across the contact: 0.1 % on Hertz, more on shear')
COUNTING = Tolerance(0.04, '45 of 177 elements stick; one or two on the edge may fall either way')
KERNEL = Tolerance(4.0 * TABLE.value, f'table of the kernel, {CELLS} cells, on a part of the work')
BISECTION = Tolerance(1e-10, 'bisection of the force')
QUADRATURE = Tolerance(1e-10, '200 points of Gauss')
TEXT = 'CONTACT, 19 x 19'
CLOSED = 'closed form of the sphere'
BISECTIONS = 200

SHIFTS_MM = (6.453e-3, 7.620e-3, 8.087e-3, 8.150e-3, 8.155e-3)
PULLS = (0.7410, 0.8367, 0.8704, 0.8747, 0.8750)
"""Iterates of its force control: shift and F_x/(mu F_n)."""


def contact_case() -> Findings:
    """Check approach, shift, energies and stick area."""
    contact = sphere_on_plane()
    shift_m = shift_for(contact, PULL)
    checks = (*_lengths(contact, shift_m), *_energies(contact, shift_m))
    return Findings('CONTACT, 3-D', checks, (_panel(contact),))


def sphere_on_plane() -> Presliding:
    """Return the package's contact of the case."""
    young_pa = 2.0 * SHEAR_PA * (1.0 + POISSON)
    elasticity = effective_elasticity(young_pa, POISSON, young_pa, POISSON)
    return presliding(smooth_profile(SPHERE_M), elasticity, FRICTION, NORMAL_N)


def shift_for(contact: Presliding, ratio: float) -> float:
    """Return the displacement at which the package's force is a share of mu F_n, m."""
    low_m, high_m = 0.0, contact.max_displacement_m
    for _ in range(BISECTIONS):
        middle_m = 0.5 * (low_m + high_m)
        if float(contact.tangential_force(middle_m)) < ratio * contact.max_force_n:
            low_m = middle_m
        else:
            high_m = middle_m
    return low_m


def _lengths(contact: Presliding, shift_m: float) -> list[Check]:
    depth_m, radius_m = contact.indentation.depth_m, contact.indentation.radius_m
    stick = float(contact.stick_radius(shift_m) / radius_m) ** 2
    exact_m = float(hertz_depth(np.array(NORMAL_N), contact.elasticity.normal_pa, SPHERE_M))
    exact_shift_m = PULLED * FRICTION * contact.elasticity.cattaneo_mindlin * exact_m
    rows = (
        ('approach', 1.998e-2 * MILLI, MESH, exact_m, depth_m, ROUNDING, 'm'),
        ('shift', 8.155e-3 * MILLI, MESH, exact_shift_m, shift_m, BISECTION, 'm'),
        ('stick area/contact area', 45.0 / 177.0, COUNTING, 0.25, stick, BISECTION, ''),
    )
    checks = []
    for name, published, coarse, exact, ours, fine, unit in rows:
        checks += [
            compare(f'{name}: CONTACT', TEXT, published, ours, unit, coarse),
            compare(f'{name}: exact', CLOSED, exact, ours, unit, fine),
        ]
    return checks


def _energies(contact: Presliding, shift_m: float) -> list[Check]:
    """Check both energies of the pull by the program, by closed form and by springs."""
    kernel = remember(contact, np.array([shift_m]))
    stored_j, lost_j = float(kernel.stored_j[0]), float(kernel.lost_j[0])
    unit_j = contact.max_force_n * contact.max_displacement_m
    work_j = (PULLED - 0.4 * (1.0 - (1.0 - PULLED) ** 2.5)) * unit_j
    exact_j = 0.25 * float(sphere_loss_ratio(np.array(PULLED))) * unit_j
    slow = _springs(contact, shift_m)
    springs_j, springs_lost_j = float(slow.stored_j[0]), float(slow.lost_j[0])
    by_springs = f'{SPRINGS} springs'
    pulled, lost = 'pull, elastic energy', 'pull, frictional work'
    ours_j, normal_j = _normal_energy(contact), 0.4 * NORMAL_N * contact.indentation.depth_m
    return [
        compare('normal load, energy: CONTACT', TEXT, 7.350e-5, ours_j, 'J', MESH),
        compare('normal load, energy: exact', '(2/5) F_n d', normal_j, ours_j, 'J', QUADRATURE),
        compare(f'{pulled}: CONTACT', TEXT, 1.175e-5, stored_j, 'J', MESH),
        compare(f'{pulled}: exact', CLOSED, work_j - exact_j, stored_j, 'J', KERNEL),
        compare(f'{pulled}: springs', by_springs, springs_j, stored_j, 'J', SPRING_ERROR),
        compare(f'{lost}: CONTACT', TEXT, 2.750e-6, lost_j, 'J', MESH),
        compare(f'{lost}: exact', CLOSED, exact_j, lost_j, 'J', KERNEL),
        compare(f'{lost}: springs', by_springs, springs_lost_j, lost_j, 'J', SPRING_ERROR),
    ]


def _springs(contact: Presliding, shift_m: float) -> History:
    """Return the answer of explicit springs to the shift."""
    springs = plant_springs(
        lambda x_m: x_m**2 / SPHERE_M,
        (contact.elasticity.normal_pa, contact.elasticity.shear_pa),
        FRICTION,
        sqrt(SPHERE_M * contact.indentation.depth_m),
        SPRINGS,
    )
    return pull(springs, np.array([shift_m]))


def _normal_energy(contact: Presliding) -> float:
    """Return int F_n dd, J."""
    points, weights = unit_quadrature()
    depth_m = contact.indentation.depth_m
    forces_n = normal_force(contact.profile, contact.elasticity, depth_m * points)
    return float(np.sum(weights * forces_n)) * depth_m


def _panel(contact: Presliding) -> Panel:
    shifts_m = fractions(100) * contact.max_displacement_m
    ratios = remember(contact, shifts_m).force_n / contact.max_force_n
    return Panel(
        'Sphere on a plane: kernel and CONTACT',
        'shift (um)',
        'force F_x/(mu F_n)',
        (
            Curve('kernel', shifts_m * 1e6, ratios),
            Curve(
                'CONTACT, 19 x 19, iterates to 7/8',
                np.array(SHIFTS_MM) * 1e3,
                np.array(PULLS),
                'points',
                1,
            ),
        ),
    )
