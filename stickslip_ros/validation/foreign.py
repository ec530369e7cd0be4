"""
Checks against codes that others wrote, by their stored answers.

``make foreign`` asks them (scripts/foreign.py) and writes foreign.csv: what was given and what
came out, with units in the names. tamaas and ContactMechanics press bodies on a half-space, slippy
pulls at them, in 3-D; SurfaceTopography fits the exponents of random lines and surfaces.

"""

import csv
from functools import partial
from pathlib import Path

import numpy as np

from stickslip_ros.contact.mdr import indent, normal_force, presliding
from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.roughness import fit_hurst, line_spectrum, surface_spectrum
from stickslip_ros.units import MICRO, MN, NM
from stickslip_ros.validation.checks import (
    Curve,
    Family,
    Measured,
    Panel,
    Tolerance,
    measures,
    shared,
)
from stickslip_ros.validation.histories import MU_FN, lower_contact
from stickslip_ros.validation.roughness import LENGTH_M, line_and_surface

STORED = Path(__file__).parent / 'foreign.csv'
BODIES = ('smooth', 'rough')
PULLED_N = 0.3535534
"""Normal force of the contacts that slippy pulls."""
SPHERES = 48
SPHERE_LOADS_N = (0.035, 0.1, 0.354, 0.707)
ANSWERED = ('depth_m', 'stiffness_n_per_m')
"""What is known of random spheres: mean and scatter of each."""
AVERAGED = f'tamaas, mean of {SPHERES}'

DEPTH = Tolerance(2e-5, 'its mesh of 256 x 256')
RADIUS = Tolerance(3e-3, 'its elements in contact, counted: each is 1 % of the radius wide')
SLIP = Tolerance(2e-5, 'its mesh of 128 x 128')
BINS = Tolerance(3e-3, 'its means over bins, ten a decade, of a steep power law')
RINGS = Tolerance(1e-2, 'its bins, our rings: the first ones average waves that differ by 20 %')
STANDS_FOR = Tolerance(0.1, 'the body only stands for their mean, which 48 give to 3 %: 7 % seen')


@shared
def answers(body: str, quantity: str) -> tuple[Array, Array]:
    """Return what the codes were given, and what they answered, SI."""
    with STORED.open(encoding='utf-8') as file:
        rows = [r for r in csv.DictReader(file) if (r['body'], r['quantity']) == (body, quantity)]
    return np.array([float(r['at']) for r in rows]), np.array([float(r['value']) for r in rows])


@measures(
    ('{}: depth d, worst of 3 loads', 'tamaas', 'm', DEPTH),
    ('{}: radius a, worst of 3 loads', 'tamaas', 'm', RADIUS),
    ('{}: force F_n, worst of 3 depths', 'ContactMechanics', 'N', DEPTH),
    ('{}: T/(mu F_n), worst of 3 displacements', 'slippy', '', SLIP, MU_FN),
    each=BODIES,
)
def _bodies(body: str) -> Measured:
    contact = lower_contact(body, 1.0)
    profile, moduli = contact.profile, contact.elasticity
    loads_n, depths_m = answers(body, 'depth_m')
    solved = [indent(profile, moduli, float(load_n)) for load_n in loads_n]
    given_m, forces_n = answers(body, 'force_n')
    pulled = presliding(profile, moduli, contact.friction, PULLED_N)
    moved_m, pulls_n = answers(body, 'tangential_force_n')
    return (
        (depths_m, [each.depth_m for each in solved]),
        (answers(body, 'radius_m')[1], [each.radius_m for each in solved]),
        (forces_n, normal_force(profile, moduli, given_m)),
        (pulls_n / pulled.max_force_n, pulled.tangential_force(moved_m) / pulled.max_force_n, 1.0),
    )


@measures(
    ('random lines: fitted H, worst of 3', 'SurfaceTopography', '', BINS),
    ('random surfaces: fitted H, worst of 3', 'SurfaceTopography', '', RINGS),
)
def _exponents() -> Measured:
    (asked, of_lines), (_, of_surfaces) = (answers(b, 'fitted_hurst') for b in ('line', 'surface'))
    both = [line_and_surface(float(hurst)) for hurst in asked]
    return (
        (of_lines, [fit_hurst(*line_spectrum(line_m, LENGTH_M), 1) for line_m, _ in both]),
        (of_surfaces, [fit_hurst(*surface_spectrum(all_m, LENGTH_M), 2) for _, all_m in both]),
    )


def equivalent(load_n: float) -> tuple[float, float]:
    """Return depth d, m, and stiffness dF_n/dd, N/m, of the body that stands for the spheres."""
    contact = lower_contact('rough', 1.0)
    solved = indent(contact.profile, contact.elasticity, load_n)
    return solved.depth_m, 2.0 * contact.elasticity.normal_pa * solved.radius_m


@measures(
    ('random spheres, F_n = {1:g} N: depth d', AVERAGED, 'm', STANDS_FOR),
    ('random spheres, F_n = {1:g} N: stiffness dF_n/dd', AVERAGED, 'N/m', STANDS_FOR),
    each=tuple(enumerate(SPHERE_LOADS_N)),
)
def _spheres(place: int, load_n: float) -> Measured:
    means = [answers('random', f'mean_{name}')[1][place] for name in ANSWERED]
    depth_m, stiffness_n_per_m = equivalent(load_n)
    return (means[0], depth_m), (means[1], stiffness_n_per_m)


def _spheres_panel(place: int, label: str, per_si: float) -> Panel:
    loads_n, means = answers('random', f'mean_{ANSWERED[place]}')
    means, scatter = means * per_si, answers('random', f'scatter_{ANSWERED[place]}')[1] * per_si
    along_n = np.geomspace(loads_n[0], loads_n[-1], 30)
    bodies = np.array([equivalent(float(load_n))[place] for load_n in along_n]) * per_si
    curves = [
        Curve('body of Pohrt and Popov', along_n * MN, bodies),
        Curve(f'mean of {SPHERES}, tamaas', loads_n * MN, means, 'points', 1),
        Curve('± their scatter', loads_n * MN, means - scatter, 'dashed', 1),
        Curve('', loads_n * MN, means + scatter, 'dashed', 1),
    ]
    return Panel('Random rough spheres', 'force F_n (mN)', label, curves, log_x=True, log_y=True)


FOREIGN = Family(
    'Codes of others',
    (_bodies, _exponents, _spheres),
    (
        partial(_spheres_panel, 0, 'depth d (nm)', NM),
        partial(_spheres_panel, 1, 'stiffness dF_n/dd (N/um)', MICRO),
    ),
)
