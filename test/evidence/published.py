# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Printed figures: our own specification of the paper's contact, the paper, and CONTACT.

The figures of the specification were computed by its authors, not by others: they show that the
package does what was asked for.

CONTACT (Vollebregt, Kalker) is a program for contact in 3-D. Its example ``cattaneo``: a sphere
on a plane, pressed by F_n and pulled by 7/8 of mu F_n. The figures are those of its printed
output, github.com/eve70a/CONTACT, Apache-2.0, examples/cattaneo.ref_out; elastic energy of the
pull is 8.525e-5 - 7.350e-5 J.

"""

from itertools import starmap

import numpy as np

from evidence.closed_forms import HURST, RADIUS_M, RMS_HEIGHT_M, hertz_depth, sphere_loss_ratio
from evidence.group import ROUNDING, SLACK, Group, printed
from evidence.springs import SPRING_ERROR, SPRINGS, Springs, pull
from stickslip_ros.contact.virgin import CELLS
from stickslip_ros.units import MICRO, NANO

OWN = 'our own specification'
SHARES = (0.1, 0.25, 0.5, 0.75, 0.9)
"""u/u_max of the tabulated forces."""
SMOOTH_RATIOS = ('0.14619', '0.35048', '0.64645', '0.87500', '0.96838')
CONTACTS = (
    (
        {'profile': 'rough', 'force_n': 0.035355339}, '81.5873', '3.11549', '29.7211', '0.7554',
        ('0.20108', '0.46195', '0.78288', '0.95697', '0.99524'),
    ),
    (
        {'profile': 'rough', 'force_n': 0.35355339}, '263.2160', '8.34539', '95.8858', '2.0235',
        ('0.17623', '0.41426', '0.73314', '0.93695', '0.99214'),
    ),
    ({'profile': 'smooth', 'force_n': 0.035355339}, '40.1840', '4.48241', '14.6385', '',
     SMOOTH_RATIOS),
    ({'profile': 'smooth', 'force_n': 0.35355339}, '186.5176', '9.65706', '67.9457', '',
     SMOOTH_RATIOS),
)  # fmt: skip
"""Profile and force; depth in nm, radius in um, u_max in nm, 2 G* a in N/um, T/(mu F_n)."""
OF_DRIVE = (
    ('rough', 0.1, '29.72'),
    ('rough', 0.5, '66.17'),
    ('rough', 1.0, '95.89'),
    ('smooth', 0.1, '14.64'),
    ('smooth', 0.5, '42.80'),
    ('smooth', 1.0, '67.95'),
)
"""u_max of the lower contacts in nm, at preloads of Figs 2 and 7."""
RATIO_DIGIT = 0.5e-5 * SLACK, 'half a unit of the last printed digit, of mu F_n'


def of_contact(
    case: dict[str, object],
    depth: str,
    radius: str,
    presliding: str,
    stiffness: str,
    ratios: tuple[str, ...],
) -> list[Group]:
    """Return what the specification says of a contact."""
    family = 'Own specification'
    groups = [
        printed(family, 'depth_m', depth, OWN, case, NANO),
        printed(family, 'radius_m', radius, OWN, case, MICRO),
        printed(family, 'max_displacement_m', presliding, OWN, case, NANO),
    ]
    if stiffness:
        groups.append(
            printed(family, 'stick_stiffness_n_per_m', stiffness, OWN, case, 1.0 / MICRO)
        )
    return groups + [
        Group(
            family, 'pull_ratio', float(ratio), RATIO_DIGIT, OWN, 'print',
            [{**case, 'share': share}], 1.0, '',
        )
        for share, ratio in zip(SHARES, ratios, strict=True)
    ]  # fmt: skip


SHEAR_PA, POISSON, FRICTION = 200e6, 0.42, 0.4
BALL = {
    'ball_m': 0.05,
    'shear_pa': SHEAR_PA,
    'poisson': POISSON,
    'friction': FRICTION,
    'force_n': 9.1954,
}
PULLED = {**BALL, 'pull': 0.875}
PULLED_SHARE = 0.75
"""u/u_max of that force: 1 - (1/8)^(2/3)."""
E_STAR_PA = SHEAR_PA / (1.0 - POISSON)
G_STAR_PA = 2.0 * SHEAR_PA / (2.0 - POISSON)
DEPTH_M = float(hertz_depth(BALL['force_n'], E_STAR_PA, BALL['ball_m']))
LIMIT_N = FRICTION * BALL['force_n']
LIMIT_M = FRICTION * E_STAR_PA / G_STAR_PA * DEPTH_M
LOSS_J = 0.25 * float(sphere_loss_ratio(PULLED_SHARE)) * LIMIT_N * LIMIT_M
WORK_J = (PULLED_SHARE - 0.4 * (1.0 - (1.0 - PULLED_SHARE) ** 2.5)) * LIMIT_N * LIMIT_M
MESH = 3e-3, 'its mesh, 15 elements across the contact: 0.1 % on Hertz, more on shear'
COUNTING = 0.04, '45 of 177 elements stick; one or two on the edge may fall either way'
KERNEL = 4.0 * 2.4e-6, f'table of the kernel, {CELLS} cells, on a part of the work'
ROOT = 1e-10, 'bisection of the force'
GAUSS = 1e-10, '200 points of Gauss'
FAMILY = 'CONTACT, 3-D'
CLOSED = 'closed form of the sphere'


def by_springs(quantity: str) -> float:
    """Return elastic energy or friction loss of the pull by springs one by one, J."""
    radius_m = np.sqrt(BALL['ball_m'] * DEPTH_M)
    width_m = 2.0 * radius_m / SPRINGS
    places_m = -radius_m + width_m * (np.arange(SPRINGS) + 0.5)
    depths_m = DEPTH_M - places_m**2 / BALL['ball_m']
    springs = Springs(G_STAR_PA * width_m, FRICTION * E_STAR_PA * width_m * depths_m)
    found = pull(springs, np.array([PULLED_SHARE * LIMIT_M]))
    return float((found.stored_j if quantity == 'ball_stored_j' else found.lost_j)[0])


def of_ball(quantity: str, figure: float, exact: float, tolerances: tuple, case: dict) -> list:
    """Return what CONTACT prints and what is exact."""
    theirs, ours = tolerances
    made_by = 'CONTACT, examples/cattaneo.ref_out'
    return [
        Group(FAMILY, quantity, figure, theirs, 'CONTACT, 19 x 19', made_by, [case], version=''),
        Group(FAMILY, quantity, exact, ours, CLOSED, 'test/evidence/published.py', [case]),
    ]


GROUPS = [
    *(group for contact in CONTACTS for group in of_contact(*contact)),
    *(
        printed(
            'Own specification', 'drive_max_displacement_m', figure, OWN,
            {'profile': profile, 'preload_n': preload_n}, NANO,
        )
        for profile, preload_n, figure in OF_DRIVE
    ),
    printed('Roughness', 'hess_factor', '1.419818', OWN, {'exponent': HURST}),
    *starmap(
        printed,
        (
            (
                'Roughness', 'rough_prefactor_1d', figure, source,
                {'rms_height_m': RMS_HEIGHT_M, 'hurst': HURST, 'radius_m': RADIUS_M},
            )
            for figure, source in (('4.44782e-4', OWN), ('4.4478e-4', 'paper, Section 4'))
        ),
    ),
    *of_ball('ball_depth_m', 1.998e-5, DEPTH_M, (MESH, ROUNDING), BALL),
    *of_ball('ball_shift_m', 8.155e-6, PULLED_SHARE * LIMIT_M, (MESH, ROOT), PULLED),
    *of_ball('ball_stick_share', 45.0 / 177.0, 0.25, (COUNTING, ROOT), PULLED),
    *of_ball('ball_normal_j', 7.350e-5, 0.4 * BALL['force_n'] * DEPTH_M, (MESH, GAUSS), BALL),
    *of_ball('ball_stored_j', 1.175e-5, WORK_J - LOSS_J, (MESH, KERNEL), PULLED),
    *of_ball('ball_loss_j', 2.750e-6, LOSS_J, (MESH, KERNEL), PULLED),
    *(
        Group(
            FAMILY, quantity, by_springs(quantity), SPRING_ERROR, f'{SPRINGS} springs',
            'test/evidence/springs.py', [PULLED],
        )
        for quantity in ('ball_stored_j', 'ball_loss_j')
    ),
]  # fmt: skip
