"""Checks of the virgin tangential curve: Cattaneo, Mindlin, and initial stiffness."""

import numpy as np

from stickslip_ros.contact.presliding import Presliding
from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.virgin import CELLS
from stickslip_ros.validation.checks import (
    ROUNDING,
    Check,
    Scale,
    Tolerance,
    compare,
    compare_worst,
)
from stickslip_ros.validation.closed_forms import PowerContact, cattaneo_ratio
from stickslip_ros.validation.findings import Curve, Findings, Panel
from stickslip_ros.validation.histories import ROUGH_TABLE, TABLE, remember
from stickslip_ros.validation.stand import (
    E_STAR_PA,
    FRICTION,
    G_STAR_PA,
    TERMS,
    fractions,
    lower_contact,
)

POINTS = 1000
EDGE = Tolerance(1e-7, 'rounding, magnified by the square root of the core that is left')
FIRST_CELL = Tolerance(1.0 / CELLS, f'the first of {CELLS} cells of the table is linear')
CELL_SHARE = 0.5
"""The kernel's first slope is taken inside the first cell of its table."""
SLOPE = Tolerance(1e-6, 'one-sided difference of second order over 1e-4 of u_max')
SLOPE_STEP = 1e-4
MU_FN = 'mu F_n'


def tangential() -> Findings:
    """Check load curve, stick radius and initial stiffness."""
    checks = [*_sphere(), *_rough()]
    for profile in ('smooth', 'rough'):
        checks += _initial_stiffness(profile)
    return Findings('Tangential load', tuple(checks), (_panel(),))


def closed_form_of(contact: Presliding, profile: str) -> PowerContact:
    """Return the independent closed form of a contact, of the same radius."""
    radius_m = contact.indentation.radius_m
    return PowerContact(TERMS[profile], E_STAR_PA, G_STAR_PA, FRICTION, radius_m)


def _sphere() -> list[Check]:
    contact = lower_contact('smooth', 0.5)
    places = fractions(POINTS)
    displacements_m = places * contact.max_displacement_m
    ratios = cattaneo_ratio(places)
    closed = contact.tangential_force(displacements_m) / contact.max_force_n
    kernel = remember(contact, displacements_m).force_n / contact.max_force_n
    radius_m = contact.indentation.radius_m
    cores, roots = contact.stick_radius(displacements_m) / radius_m, np.sqrt(1.0 - places)
    limit_m = 3.0 * contact.max_force_n / (4.0 * G_STAR_PA * radius_m)
    text, scale = 'Cattaneo, Mindlin: 1 - (1 - u/u_max)^(3/2)', Scale(1.0, MU_FN)
    found_m = contact.max_displacement_m
    name = 'sphere: load curve'
    return [
        compare('sphere: u_max', 'Mindlin: 3 mu F_n/(4 G* a)', limit_m, found_m, 'm', ROUNDING),
        compare_worst(f'{name}, closed form', text, ratios, closed, '', ROUNDING, scale),
        compare_worst(f'{name}, kernel', text, ratios, kernel, '', TABLE, scale),
        compare_worst(
            'sphere: stick radius c/a',
            '(1 - u/u_max)^(1/2)',
            roots,
            cores,
            '',
            EDGE,
            Scale(1.0, 'the contact radius'),
        ),
    ]


def _rough() -> list[Check]:
    """Check the rough contact along its stick radius, so that nothing has to be solved."""
    contact = lower_contact('rough', 0.5)
    form = closed_form_of(contact, 'rough')
    cores_m = form.radius_m * (1.0 - fractions(POINTS)[:-1])
    displacements_m = form.displacement(cores_m)
    scale = Scale(contact.max_force_n, MU_FN)
    text = 'Jaeger, Ciavarella, along c'
    return [
        compare_worst(
            'rough: load curve, closed form',
            text,
            form.force(cores_m),
            contact.tangential_force(displacements_m),
            'N',
            ROUNDING,
            scale,
        ),
        compare_worst(
            'rough: load curve, kernel',
            text,
            form.force(cores_m),
            remember(contact, displacements_m).force_n,
            'N',
            ROUGH_TABLE,
            scale,
        ),
        compare_worst(
            'rough: stick radius c',
            'd - u/(mu C_M) = g(c)',
            cores_m,
            contact.stick_radius(displacements_m),
            'm',
            EDGE,
        ),
    ]


def _initial_stiffness(profile: str) -> list[Check]:
    contact = lower_contact(profile, 0.5)
    stiffness = 2.0 * G_STAR_PA * contact.indentation.radius_m
    step_m = SLOPE_STEP * contact.max_displacement_m
    one_n, two_n = contact.tangential_force(np.array([step_m, 2.0 * step_m]))
    first_m = np.array([CELL_SHARE * contact.max_displacement_m / CELLS])
    kernel = remember(contact, first_m).force_n[0] / first_m[0]
    name = f'{profile}: initial stiffness'
    return [
        compare(
            f'{name}, closed form',
            '2 G* a',
            stiffness,
            float(4.0 * one_n - two_n) / (2.0 * step_m),
            'N/m',
            SLOPE,
        ),
        compare(f'{name}, kernel', '2 G* a', stiffness, float(kernel), 'N/m', FIRST_CELL),
    ]


def _panel() -> Panel:
    places = fractions(200)
    curves = [Curve('(1 - u/u_max)^(1/2)', places, np.sqrt(1.0 - places), 'dashed', 2)]
    some = np.concatenate((np.zeros(1), fractions(20)))
    for colour, profile in enumerate(('smooth', 'rough')):
        label = f'{profile}, F_p = 0.5 N, package'
        curves.append(Curve(label, some, _core_ratio(profile, some), 'points', colour))
    form = closed_form_of(lower_contact('rough', 0.5), 'rough')
    cores_m = form.radius_m * np.linspace(0.0, 1.0, 200, dtype=np.float64)
    whole_m = form.displacement(0.0)
    along = form.displacement(cores_m) / whole_m
    curves.append(Curve('rough, g(c) = d - u/(mu C_M)', along, cores_m / form.radius_m, 'line', 1))
    return Panel(
        'Stick radius on the virgin curve',
        'displacement u/u_max',
        'stick radius c/a',
        tuple(curves),
    )


def _core_ratio(profile: str, places: Array) -> Array:
    contact = lower_contact(profile, 0.5)
    cores_m = contact.stick_radius(places * contact.max_displacement_m)
    return np.asarray(cores_m / contact.indentation.radius_m)
