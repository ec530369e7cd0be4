"""Checks of the normal problem: effective moduli, Hertz, and the springs under the rough body."""

import numpy as np

from stickslip_ros.contact.indentation import indent, normal_force
from stickslip_ros.units import GIGA
from stickslip_ros.validation.checks import (
    ROUNDING,
    Check,
    Tolerance,
    compare,
    compare_printed,
    compare_worst,
)
from stickslip_ros.validation.closed_forms import (
    hertz_depth,
    hertz_force,
    hertz_radius,
    unit_quadrature,
)
from stickslip_ros.validation.findings import Findings
from stickslip_ros.validation.stand import (
    E_STAR_PA,
    RADIUS_M,
    ROUGH_TERMS,
    lower_contact,
)

FORCES_N = np.logspace(-3.0, 1.0, 41, dtype=np.float64)
QUADRATURE = Tolerance(1e-11, 'rounding, and 200 points of Gauss on a root of x')
SLOPE = Tolerance(1e-7, 'central difference over 2e-4 of the depth')
SLOPE_STEP = 1e-4


def normal_load() -> Findings:
    """Check force, depth and radius under a normal load."""
    return Findings('Normal load', (*_moduli(), *_hertz(), *_rough()))


def _moduli() -> list[Check]:
    elasticity = lower_contact('rough', 0.1).elasticity
    return [
        compare_printed(
            'effective modulus E*', 'Eq. 5', '147.2149', elasticity.normal_pa, 'Pa', per_unit=GIGA
        ),
        compare_printed(
            'effective shear modulus G*',
            'Eq. 6',
            '121.2358',
            elasticity.shear_pa,
            'Pa',
            per_unit=GIGA,
        ),
        compare(
            'C_M = E*/G*, equal Poisson ratios 0.3',
            '(1 - nu/2)/(1 - nu) = 17/14',
            17.0 / 14.0,
            elasticity.cattaneo_mindlin,
            '',
            ROUNDING,
        ),
    ]


def _hertz() -> list[Check]:
    """Check the smooth sphere from 1 mN to 10 N."""
    contact = lower_contact('smooth', 0.1)
    solved = [indent(contact.profile, contact.elasticity, force) for force in FORCES_N]
    depths_m = hertz_depth(FORCES_N, E_STAR_PA, RADIUS_M)
    radii_m = hertz_radius(FORCES_N, E_STAR_PA, RADIUS_M)
    given_m = np.logspace(-9.0, -6.0, 41, dtype=np.float64)
    forces_n = normal_force(contact.profile, contact.elasticity, given_m)
    text = 'Hertz, 1 mN to 10 N'
    return [
        compare_worst(
            'sphere: depth d', text, depths_m, [s.depth_m for s in solved], 'm', ROUNDING
        ),
        compare_worst(
            'sphere: contact radius a', text, radii_m, [s.radius_m for s in solved], 'm', ROUNDING
        ),
        compare_worst(
            'sphere: normal force F_n',
            'Hertz, 1 nm to 1 um',
            hertz_force(given_m, E_STAR_PA, RADIUS_M),
            forces_n,
            'N',
            ROUNDING,
        ),
    ]


def _rough() -> list[Check]:
    """Check Eqs 24 and 25 against the definition of the foundation."""
    contact = lower_contact('rough', 1.0)
    depth_m, radius_m = contact.indentation.depth_m, contact.indentation.radius_m
    reached_m = sum(q * radius_m**n for q, n in zip(*ROUGH_TERMS, strict=True))
    points, weights = unit_quadrature()
    places_m = radius_m * points**2
    height_m = sum(q * places_m**n for q, n in zip(*ROUGH_TERMS, strict=True))
    summed_n = 2.0 * E_STAR_PA * np.sum(weights * 2.0 * radius_m * points * (depth_m - height_m))
    step_m = SLOPE_STEP * depth_m
    near_m = np.array([depth_m - step_m, depth_m + step_m])
    low_n, high_n = normal_force(contact.profile, contact.elasticity, near_m)
    return [
        compare('rough: depth d = g(a)', 'Eq. 25 with our a', reached_m, depth_m, 'm', ROUNDING),
        compare(
            'rough: normal force F_n(d)',
            '2 E* int (d - g) dx by quadrature (Eq. 24)',
            float(summed_n),
            contact.indentation.normal_force_n,
            'N',
            QUADRATURE,
        ),
        compare(
            'rough: normal stiffness dF_n/dd',
            '2 E* a',
            2.0 * E_STAR_PA * radius_m,
            float(high_n - low_n) / (2.0 * step_m),
            'N/m',
            SLOPE,
        ),
    ]
