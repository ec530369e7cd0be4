"""
Checks against published numbers: the reference table of the paper's contact, and CONTACT.

CONTACT (Vollebregt, Kalker) is a program for contact in 3-D. Its example ``cattaneo``: a sphere
on a plane, pressed by F_n and pulled by 7/8 of mu F_n. The figures are those of its printed
output, github.com/eve70a/CONTACT, Apache-2.0, examples/cattaneo.ref_out; elastic energy of the
pull is 8.525e-5 - 7.350e-5 J.

"""

from typing import NamedTuple

import numpy as np
from scipy.optimize import bisect

from stickslip_ros.contact.mdr import Presliding, effective_elasticity, normal_force, presliding
from stickslip_ros.contact.profile import smooth_profile
from stickslip_ros.contact.virgin import CELLS
from stickslip_ros.drive.build import contacts_of
from stickslip_ros.parameters import Parameters
from stickslip_ros.units import MICRO, MILLI, NANO
from stickslip_ros.validation.checks import (
    HALF_A_DIGIT,
    ROUNDING,
    SLACK,
    Check,
    Curve,
    Family,
    Measured,
    Panel,
    Tolerance,
    measures,
    printed,
)
from stickslip_ros.validation.histories import MU_FN, TABLE, fractions, lower_contact, remember
from stickslip_ros.validation.references import hertz_depth, sphere_loss_ratio, unit_quadrature
from stickslip_ros.validation.springs import BY_SPRINGS, SPRING_ERROR, SPRINGS, plant_springs, pull

REFERENCE = 'reference table'
PLACES = np.array([0.1, 0.25, 0.5, 0.75, 0.9])
"""u/u_max of the tabulated forces."""
SMOOTH_RATIOS = (0.14619, 0.35048, 0.64645, 0.87500, 0.96838)
RATIO_DIGIT = Tolerance(0.5e-5 * SLACK, HALF_A_DIGIT)


class TableRow(NamedTuple):
    """A row of the table: preload in N, figures as they are printed in nm, um, nm and N/um."""

    profile: str
    preload_n: float
    depth: str
    radius: str
    presliding: str
    stiffness: str
    ratios: tuple[float, ...]

    @property
    def name(self) -> str:
        """Profile and normal force."""
        return f'{self.profile}, F_n = {0.35355339 * self.preload_n:.3g} N'


ROUGH_RATIOS = (
    (0.20108, 0.46195, 0.78288, 0.95697, 0.99524),
    (0.17623, 0.41426, 0.73314, 0.93695, 0.99214),
)
ROWS = (
    TableRow('rough', 0.1, '81.5873', '3.11549', '29.7211', '0.7554', ROUGH_RATIOS[0]),
    TableRow('rough', 1.0, '263.2160', '8.34539', '95.8858', '2.0235', ROUGH_RATIOS[1]),
    TableRow('smooth', 0.1, '40.1840', '4.48241', '14.6385', '', SMOOTH_RATIOS),
    TableRow('smooth', 1.0, '186.5176', '9.65706', '67.9457', '', SMOOTH_RATIOS),
)
FIG_7 = (
    ('rough', 0.1, '29.72'),
    ('rough', 0.5, '66.17'),
    ('rough', 1.0, '95.89'),
    ('smooth', 0.1, '14.64'),
    ('smooth', 0.5, '42.80'),
    ('smooth', 1.0, '67.95'),
)
"""u_max of the lower contacts in nm, at preloads of Figs 2 and 7."""


def _row_checks(row: TableRow) -> tuple[Check, ...]:
    stiffness = (f'{row.name}: 2 G* a', REFERENCE, 'N/m')

    @measures(
        (f'{row.name}: d', REFERENCE, 'm', printed(row.depth, NANO)),
        (f'{row.name}: a', REFERENCE, 'm', printed(row.radius, MICRO)),
        (f'{row.name}: u_max', REFERENCE, 'm', printed(row.presliding, NANO)),
        *([(*stiffness, printed(row.stiffness, 1.0 / MICRO))] if row.stiffness else []),
        (f'{row.name}: T/(mu F_n)', f'{REFERENCE}, worst of 5', '', RATIO_DIGIT, MU_FN),
    )
    def measured() -> Measured:
        contact = lower_contact(row.profile, row.preload_n)
        forces_n = contact.tangential_force(PLACES * contact.max_displacement_m)
        return (
            contact.indentation.depth_m,
            contact.indentation.radius_m,
            contact.max_displacement_m,
            *([contact.stick_stiffness_n_per_m] if row.stiffness else []),
            (row.ratios, forces_n / contact.max_force_n, 1.0),
        )

    return measured


def _drive_checks(profile: str, preload_n: float, figure: str) -> tuple[Check, ...]:
    """Check u_max of a contact that the drive builds."""
    name = f'{profile}, F_p = {preload_n:g} N: u_max'

    @measures((name, REFERENCE, 'm', printed(figure, NANO)))
    def measured() -> Measured:
        stand = Parameters().updated({'contact.profile': profile, 'stand.preload': preload_n})
        return (contacts_of(stand)[-1].max_displacement_m,)

    return measured


def _table_panel() -> Panel:
    curves, places = [], fractions(80)
    for colour, row in enumerate(ROWS[:3]):
        contact = lower_contact(row.profile, row.preload_n)
        forces_n = remember(contact, places * contact.max_displacement_m).force_n
        label = row.name if row.profile == 'rough' else 'smooth, any F_n'
        curves += [
            Curve(label, places, forces_n / contact.max_force_n, 'line', colour),
            Curve('', PLACES, np.array(row.ratios), 'points', colour),
        ]
    title = 'Load curve: kernel (lines), reference table (points)'
    return Panel(title, 'displacement u/u_max', 'force T/(mu F_n)', curves)


REFERENCE_TABLE = Family(
    'Reference table',
    (*map(_row_checks, ROWS), *(_drive_checks(*row) for row in FIG_7)),
    (_table_panel,),
)


SPHERE_M = 50e-3
SHEAR_PA = 200e6
POISSON = 0.42
FRICTION = 0.4
NORMAL_N = 9.1954
PULL = 7.0 / 8.0
"""F_x/(mu F_n)."""
PULLED = 0.75
"""u/u_max of that force: 1 - (1/8)^(2/3)."""
SHIFTS_MM = (6.453e-3, 7.620e-3, 8.087e-3, 8.150e-3, 8.155e-3)
PULLS = (0.7410, 0.8367, 0.8704, 0.8747, 0.8750)
"""Iterates of its force control: shift and F_x/(mu F_n)."""

MESH = Tolerance(3e-3, 'its mesh, 15 elements across the contact: 0.1 % on Hertz, more on shear')
COUNTING = Tolerance(0.04, '45 of 177 elements stick; one or two on the edge may fall either way')
KERNEL = Tolerance(4.0 * TABLE.value, f'table of the kernel, {CELLS} cells, on a part of the work')
BISECTION = Tolerance(1e-10, 'bisection of the force')
QUADRATURE = Tolerance(1e-10, '200 points of Gauss')
TEXT, CLOSED = 'CONTACT, 19 x 19', 'closed form of the sphere'
WORK, LOSS = 'pull, elastic energy', 'pull, frictional work'


def sphere_on_plane() -> Presliding:
    """Return the package's contact of the case."""
    young_pa = 2.0 * SHEAR_PA * (1.0 + POISSON)
    elasticity = effective_elasticity(young_pa, POISSON, young_pa, POISSON)
    return presliding(smooth_profile(SPHERE_M), elasticity, FRICTION, NORMAL_N)


def _shift(contact: Presliding) -> float:
    """Return the displacement at which the package's force is PULL, m."""
    limit_n, limit_m = contact.max_force_n, contact.max_displacement_m

    def missing_n(shift_m: float) -> float:
        return float(contact.tangential_force(shift_m)) - PULL * limit_n

    return float(bisect(missing_n, 0.0, limit_m, xtol=1e-18))


@measures(
    ('approach: CONTACT', TEXT, 'm', MESH),
    ('approach: exact', CLOSED, 'm', ROUNDING),
    ('shift: CONTACT', TEXT, 'm', MESH),
    ('shift: exact', CLOSED, 'm', BISECTION),
    ('stick area/contact area: CONTACT', TEXT, '', COUNTING),
    ('stick area/contact area: exact', CLOSED, '', BISECTION),
    ('normal load, energy: CONTACT', TEXT, 'J', MESH),
    ('normal load, energy: exact', '(2/5) F_n d', 'J', QUADRATURE),
    (f'{WORK}: CONTACT', TEXT, 'J', MESH),
    (f'{WORK}: exact', CLOSED, 'J', KERNEL),
    (f'{WORK}: springs', BY_SPRINGS, 'J', SPRING_ERROR),
    (f'{LOSS}: CONTACT', TEXT, 'J', MESH),
    (f'{LOSS}: exact', CLOSED, 'J', KERNEL),
    (f'{LOSS}: springs', BY_SPRINGS, 'J', SPRING_ERROR),
)
def _contact_case() -> Measured:
    """Check approach, shift and stick area, and both energies of the pull."""
    contact = sphere_on_plane()
    moduli, depth_m = contact.elasticity, contact.indentation.depth_m
    shift_m = _shift(contact)
    stick = float(contact.stick_radius(shift_m) / contact.indentation.radius_m) ** 2
    exact_m = hertz_depth(NORMAL_N, moduli.normal_pa, SPHERE_M)
    points, weights = unit_quadrature()
    forces_n = normal_force(contact.profile, moduli, depth_m * points)
    normal_j = float(np.sum(weights * forces_n)) * depth_m
    springs = plant_springs(contact, lambda x_m: x_m**2 / SPHERE_M, SPRINGS)
    slow, kernel = pull(springs, np.array([shift_m])), remember(contact, np.array([shift_m]))
    unit_j = contact.max_force_n * contact.max_displacement_m
    lost_j = 0.25 * float(sphere_loss_ratio(PULLED)) * unit_j
    work_j = (PULLED - 0.4 * (1.0 - (1.0 - PULLED) ** 2.5)) * unit_j
    return (
        (1.998e-2 * MILLI, depth_m),
        (exact_m, depth_m),
        (8.155e-3 * MILLI, shift_m),
        (PULLED * FRICTION * moduli.cattaneo_mindlin * exact_m, shift_m),
        (45.0 / 177.0, stick),
        (0.25, stick),
        (7.350e-5, normal_j),
        (0.4 * NORMAL_N * depth_m, normal_j),
        (1.175e-5, kernel.stored_j),
        (work_j - lost_j, kernel.stored_j),
        (slow.stored_j, kernel.stored_j),
        (2.750e-6, kernel.lost_j),
        (lost_j, kernel.lost_j),
        (slow.lost_j, kernel.lost_j),
    )


def _contact_panel() -> Panel:
    contact = sphere_on_plane()
    shifts_m = fractions(100) * contact.max_displacement_m
    ratios = remember(contact, shifts_m).force_n / contact.max_force_n
    shifts_um, pulls = np.array(SHIFTS_MM) * 1e3, np.array(PULLS)
    curves = (
        Curve('kernel', shifts_m / MICRO, ratios),
        Curve('CONTACT, 19 x 19, iterates to 7/8', shifts_um, pulls, 'points', 1),
    )
    title = 'Sphere on a plane: kernel and CONTACT'
    return Panel(title, 'shift (um)', 'force F_x/(mu F_n)', curves)


CONTACT_CASE = Family('CONTACT, 3-D', (_contact_case,), (_contact_panel,))
