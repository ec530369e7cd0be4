"""Checks of the contact under a normal load, and along the virgin tangential curve."""

import numpy as np

from stickslip_ros.contact.mdr import indent, normal_force
from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.virgin import CELLS
from stickslip_ros.units import GIGA
from stickslip_ros.validation.checks import (
    ROUNDING,
    Curve,
    Family,
    Measured,
    Panel,
    Tolerance,
    measures,
    printed,
)
from stickslip_ros.validation.histories import (
    MU_FN,
    ROUGH_TABLE,
    TABLE,
    closed_form_of,
    fractions,
    lower_contact,
    remember,
)
from stickslip_ros.validation.references import (
    E_STAR_PA,
    G_STAR_PA,
    TERMS,
    cattaneo_ratio,
    height,
    hertz_depth,
    hertz_force,
    hertz_radius,
    unit_quadrature,
)

FORCES_N = np.logspace(-3.0, 1.0, 41, dtype=np.float64)
DEPTHS_M = np.logspace(-9.0, -6.0, 41, dtype=np.float64)
QUADRATURE = Tolerance(1e-11, 'rounding, and 200 points of Gauss on a root of x')
NORMAL_SLOPE = Tolerance(1e-7, 'central difference over 2e-4 of the depth')
SLOPE = Tolerance(1e-6, 'one-sided difference of second order over 1e-4 of u_max')
SLOPE_STEP = 1e-4

POINTS = 1000
EDGE = Tolerance(1e-7, 'rounding, magnified by the square root of the core that is left')
FIRST_CELL = Tolerance(1.0 / CELLS, f'the first of {CELLS} cells of the table is linear')
CELL_SHARE = 0.5
"""The kernel's first slope is taken inside the first cell of its table."""
CATTANEO = 'Cattaneo, Mindlin: 1 - (1 - u/u_max)^(3/2)'
JAEGER = 'Jaeger, Ciavarella, along c'


@measures(
    ('effective modulus E*', 'Eq. 5', 'Pa', printed('147.2149', GIGA)),
    ('effective shear modulus G*', 'Eq. 6', 'Pa', printed('121.2358', GIGA)),
    ('C_M = E*/G*, equal Poisson ratios 0.3', '(1 - nu/2)/(1 - nu) = 17/14', '', ROUNDING),
)
def _moduli() -> Measured:
    moduli = lower_contact('rough', 0.1).elasticity
    return moduli.normal_pa, moduli.shear_pa, (17.0 / 14.0, moduli.cattaneo_mindlin)


@measures(
    ('sphere: depth d', 'Hertz, 1 mN to 10 N', 'm', ROUNDING),
    ('sphere: contact radius a', 'Hertz, 1 mN to 10 N', 'm', ROUNDING),
    ('sphere: normal force F_n', 'Hertz, 1 nm to 1 um', 'N', ROUNDING),
)
def _hertz() -> Measured:
    contact = lower_contact('smooth', 0.1)
    solved = [indent(contact.profile, contact.elasticity, force_n) for force_n in FORCES_N]
    return (
        (hertz_depth(FORCES_N), [each.depth_m for each in solved]),
        (hertz_radius(FORCES_N), [each.radius_m for each in solved]),
        (hertz_force(DEPTHS_M), normal_force(contact.profile, contact.elasticity, DEPTHS_M)),
    )


@measures(
    ('rough: depth d = g(a)', 'Eq. 25 with our a', 'm', ROUNDING),
    ('rough: normal force F_n(d)', '2 E* int (d - g) dx by quadrature (Eq. 24)', 'N', QUADRATURE),
    ('rough: normal stiffness dF_n/dd', '2 E* a', 'N/m', NORMAL_SLOPE),
)
def _rough() -> Measured:
    """Compare Eqs 24 and 25 with the definition of the foundation."""
    contact = lower_contact('rough', 1.0)
    solved, terms = contact.indentation, TERMS['rough']
    points, weights = unit_quadrature()
    pressed_m = solved.depth_m - height(terms, solved.radius_m * points**2)
    area_m2 = np.sum(weights * 2.0 * solved.radius_m * points * pressed_m)
    step_m = SLOPE_STEP * solved.depth_m
    near_m = np.array([solved.depth_m - step_m, solved.depth_m + step_m])
    low_n, high_n = normal_force(contact.profile, contact.elasticity, near_m)
    return (
        (height(terms, solved.radius_m), solved.depth_m),
        (2.0 * E_STAR_PA * area_m2, solved.normal_force_n),
        (2.0 * E_STAR_PA * solved.radius_m, (high_n - low_n) / (2.0 * step_m)),
    )


@measures(
    ('sphere: u_max', 'Mindlin: 3 mu F_n/(4 G* a)', 'm', ROUNDING),
    ('sphere: load curve, closed form', CATTANEO, '', ROUNDING, MU_FN),
    ('sphere: load curve, kernel', CATTANEO, '', TABLE, MU_FN),
    ('sphere: stick radius c/a', '(1 - u/u_max)^(1/2)', '', EDGE, 'the contact radius'),
)
def _sphere_pulled() -> Measured:
    contact, places = lower_contact('smooth', 0.5), fractions(POINTS)
    radius_m, force_n = contact.indentation.radius_m, contact.max_force_n
    displacements_m = places * contact.max_displacement_m
    ratios = cattaneo_ratio(places)
    return (
        (3.0 * force_n / (4.0 * G_STAR_PA * radius_m), contact.max_displacement_m),
        (ratios, contact.tangential_force(displacements_m) / force_n, 1.0),
        (ratios, remember(contact, displacements_m).force_n / force_n, 1.0),
        (np.sqrt(1.0 - places), contact.stick_radius(displacements_m) / radius_m, 1.0),
    )


@measures(
    ('rough: load curve, closed form', JAEGER, 'N', ROUNDING, MU_FN),
    ('rough: load curve, kernel', JAEGER, 'N', ROUGH_TABLE, MU_FN),
    ('rough: stick radius c', 'd - u/(mu C_M) = g(c)', 'm', EDGE),
)
def _rough_pulled() -> Measured:
    """Compare along the stick radius, so that nothing has to be solved."""
    contact = lower_contact('rough', 0.5)
    form, limit_n = closed_form_of(contact, 'rough'), contact.max_force_n
    cores_m = form.radius_m * (1.0 - fractions(POINTS)[:-1])
    displacements_m, forces_n = form.displacement(cores_m), form.force(cores_m)
    return (
        (forces_n, contact.tangential_force(displacements_m), limit_n),
        (forces_n, remember(contact, displacements_m).force_n, limit_n),
        (cores_m, contact.stick_radius(displacements_m)),
    )


@measures(
    ('{}: initial stiffness, closed form', '2 G* a', 'N/m', SLOPE),
    ('{}: initial stiffness, kernel', '2 G* a', 'N/m', FIRST_CELL),
    each=('smooth', 'rough'),
)
def _initial_stiffness(profile: str) -> Measured:
    contact = lower_contact(profile, 0.5)
    stiffness = 2.0 * G_STAR_PA * contact.indentation.radius_m
    step_m = SLOPE_STEP * contact.max_displacement_m
    one_n, two_n = contact.tangential_force(np.array([step_m, 2.0 * step_m]))
    first_m = np.array([CELL_SHARE * contact.max_displacement_m / CELLS])
    return (
        (stiffness, (4.0 * one_n - two_n) / (2.0 * step_m)),
        (stiffness, remember(contact, first_m).force_n / first_m),
    )


def _stick_radius_panel() -> Panel:
    places = fractions(200)
    curves = [Curve('(1 - u/u_max)^(1/2)', places, np.sqrt(1.0 - places), 'dashed', 2)]
    some = np.concatenate((np.zeros(1), fractions(20)))
    for colour, profile in enumerate(('smooth', 'rough')):
        label = f'{profile}, F_p = 0.5 N, package'
        curves.append(Curve(label, some, _core_ratio(profile, some), 'points', colour))
    form = closed_form_of(lower_contact('rough', 0.5), 'rough')
    cores = np.linspace(0.0, 1.0, 200, dtype=np.float64)
    along = form.displacement(form.radius_m * cores) / form.displacement(0.0)
    curves.append(Curve('rough, g(c) = d - u/(mu C_M)', along, cores, 'line', 1))
    return Panel(
        'Stick radius on the virgin curve', 'displacement u/u_max', 'stick radius c/a', curves
    )


def _core_ratio(profile: str, places: Array) -> Array:
    contact = lower_contact(profile, 0.5)
    cores_m = contact.stick_radius(places * contact.max_displacement_m)
    return np.asarray(cores_m / contact.indentation.radius_m)


NORMAL_LOAD = Family('Normal load', (_moduli, _hertz, _rough))
TANGENTIAL_LOAD = Family(
    'Tangential load', (_sphere_pulled, _rough_pulled, _initial_stiffness), (_stick_radius_panel,)
)
