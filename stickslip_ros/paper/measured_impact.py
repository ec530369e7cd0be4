"""
A sphere that rebounds from a plate, predicted and beside what others measured.

A sphere that strikes a plate obliquely presses and slides at once: its contact sticks, slips
partly and slips back while the normal force rises and falls. The tangential force is that of the
springs with which the drive goes while its preload changes.

"""

import csv
import math
from dataclasses import replace
from functools import lru_cache, partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure
from scipy.optimize import least_squares

from stickslip_ros.contact.hemisphere import elasticity_of, profile_of
from stickslip_ros.contact.kernel import entry_point
from stickslip_ros.contact.mdr import normal_force
from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.record import Record, record
from stickslip_ros.contact.springs import (
    SPRINGS_IN_ALL,
    Group,
    move_springs,
    spring_bank,
    springs_kind,
)
from stickslip_ros.paper.figure import Case, PaperFigure, Table
from stickslip_ros.parameters import ContactParameters, Parameters
from stickslip_ros.parameters.yaml_form import load_yaml
from stickslip_ros.study.comparison.agreement import Agreement, Part, agreement_of
from stickslip_ros.study.journal import Row
from stickslip_ros.study.plotting import curve_style, draw_legend, label_axes

move_springs = entry_point(move_springs)

MEASURED = Path(__file__).parent / 'measured'
SPHERE = MEASURED / 'alumina_on_glass.yaml'
REBOUNDS = MEASURED / 'alumina_on_glass.csv'
QUANTITIES = {
    'spin_rad_per_s': ('spin after the impact (rad/s)', 3.2),
    'patch_angle_deg': ('rebound angle of the contact point (deg)', 0.6),
}
"""Measured quantities: label, and the largest error of digitising that the control points show."""
DENSITY_KG_PER_M3 = 4000.0
SPEED_M_PER_S = 3.9
"""Of the sphere; only the spin depends on the speed, nothing on the density."""
ROLL = 2.5
"""m R^2/I of a solid sphere."""
ANGLE_MIN_DEG, ANGLE_MAX_DEG = 2.5, 87.5
IMPACT_STEPS = 1000
"""Time steps of an impact; twice as many change no result by 2e-4 of its largest."""
HERTZ_TIME = 2.9432
"""Duration of an elastic impact, in units of largest depth over speed."""
DEPTHS = 4001
"""Depths at which the normal law is tabulated."""


class Rebound(NamedTuple):
    """
    What an oblique impact leaves.

    Attributes
    ----------
    tangential_ratio : float
        Tangential velocity of the centre after the impact over that before it.
    spin_rad_per_s : float
        Angular velocity; negative as friction at the front of the sphere makes it.
    patch_angle_deg : float
        Angle of the velocity of the contact point to the normal; negative backwards.

    """

    tangential_ratio: float
    spin_rad_per_s: float
    patch_angle_deg: float


class _Press(NamedTuple):
    """Normal force and work by depth, and the springs of the contact."""

    depths_m: Array
    forces_n: Array
    works_j: Array
    bank: Record


def rebound(contact: ContactParameters, speed_m_per_s: float, angle_deg: float) -> Rebound:
    """
    Return how a solid elastic sphere rebounds that strikes a plate without spin.

    Parameters
    ----------
    contact : ContactParameters
        Sphere and plate.
    speed_m_per_s : float
        Speed before the impact, m/s.
    angle_deg : float
        Angle of its direction to the normal of the plate, above 0 and below 90 degrees.

    Notes
    -----
    Quasi-static: no waves in the bodies. The normal force F of the depth d drives m d'' = -F, the
    tangential one T of the contact point u'' = -(1 + m R^2/I) T/m.

    """
    mass_kg = 4.0 / 3.0 * math.pi * contact.radius**3 * DENSITY_KG_PER_M3
    angle = math.radians(angle_deg)
    down_m_per_s, along_m_per_s = speed_m_per_s * math.cos(angle), speed_m_per_s * math.sin(angle)
    press = _press(contact, 0.5 * mass_kg * speed_m_per_s**2)
    lost_m_per_s, up_m_per_s = _bounce(press, mass_kg, down_m_per_s, along_m_per_s)
    return _leaving(contact.radius, along_m_per_s, lost_m_per_s, up_m_per_s)


def rigid_rebound(contact: ContactParameters, speed_m_per_s: float, angle_deg: float) -> Rebound:
    """Return the same for a contact without tangential springs: what sticks, stays so."""
    angle = math.radians(angle_deg)
    down_m_per_s, along_m_per_s = speed_m_per_s * math.cos(angle), speed_m_per_s * math.sin(angle)
    lost_m_per_s = min(2.0 * contact.friction * down_m_per_s, along_m_per_s / (1.0 + ROLL))
    return _leaving(contact.radius, along_m_per_s, lost_m_per_s, down_m_per_s)


def _leaving(
    radius_m: float, along_m_per_s: float, lost_m_per_s: float, up_m_per_s: float
) -> Rebound:
    patch_m_per_s = along_m_per_s - (1.0 + ROLL) * lost_m_per_s
    return Rebound(
        1.0 - lost_m_per_s / along_m_per_s,
        -ROLL * lost_m_per_s / radius_m,
        math.degrees(math.atan2(patch_m_per_s, up_m_per_s)),
    )


@lru_cache(maxsize=4)
def _press(contact: ContactParameters, energy_j: float) -> _Press:
    """Return what a contact does down to a depth that takes more than this energy."""
    profile, elasticity = profile_of(contact), elasticity_of(contact)
    deepest_m, works_j = contact.radius, np.array([math.inf])
    while works_j[-1] > 4.0 * energy_j:
        deepest_m *= 0.5
        depths_m = np.linspace(0.0, deepest_m, DEPTHS, dtype=np.float64)
        forces_n = normal_force(profile, elasticity, depths_m)
        works_j = np.cumsum(forces_n) * depths_m[1]
    group, largest_n = Group(profile, 1, 1.0), float(forces_n[-1])
    bank = spring_bank([group], elasticity, contact.friction, largest_n, SPRINGS_IN_ALL)
    return _Press(depths_m, forces_n, works_j, bank)


def _bounce(
    press: _Press, mass_kg: float, down_m_per_s: float, along_m_per_s: float
) -> tuple[float, float]:
    """Return the tangential velocity that the centre loses, and the normal one it leaves with."""
    springs = record(springs_kind(SPRINGS_IN_ALL))
    energy_j = 0.5 * mass_kg * down_m_per_s**2
    deepest_m = float(np.interp(energy_j, press.works_j, press.depths_m))
    half_s = 0.5 * HERTZ_TIME * deepest_m / down_m_per_s / IMPACT_STEPS
    depth_m = force_n = tangential_n = lost_m_per_s = 0.0
    while depth_m >= 0.0:
        down_m_per_s -= half_s * force_n / mass_kg
        lost_m_per_s += half_s * tangential_n / mass_kg
        moved_m = 2.0 * half_s * (along_m_per_s - (1.0 + ROLL) * lost_m_per_s)
        depth_m += 2.0 * half_s * down_m_per_s
        before_n, force_n = force_n, float(np.interp(depth_m, press.depths_m, press.forces_n))
        tangential_n, _ = move_springs(press.bank, springs, moved_m, before_n, force_n)
        down_m_per_s -= half_s * force_n / mass_kg
        lost_m_per_s += half_s * tangential_n / mass_kg
    return lost_m_per_s, -down_m_per_s


def sphere_struck(parameters: Parameters) -> ContactParameters:
    """Return sphere and plate of the experiment, with what was changed."""
    return load_yaml(SPHERE).updated(parameters.changed()).contact


@lru_cache
def digitised(quantity: str, kind: str = 'measured') -> tuple[Array, Array]:
    """Return impact angles, degrees, and digitised values of one of QUANTITIES."""
    with REBOUNDS.open(encoding='utf-8') as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith('#')))
    wanted = [row for row in rows if (row['quantity'], row['kind']) == (quantity, kind)]
    angles_deg, values = ([float(row[name]) for row in wanted] for name in ('angle_deg', 'value'))
    return np.array(angles_deg), np.array(values)


def predicted(contact: ContactParameters, quantity: str) -> Array:
    """Return the prediction of one of QUANTITIES at the measured angles."""
    angles_deg, _ = digitised(quantity)
    found = [rebound(contact, SPEED_M_PER_S, float(angle_deg)) for angle_deg in angles_deg]
    return np.array([getattr(one, quantity) for one in found])


def agreement(contact: ContactParameters, quantity: str) -> Agreement:
    """Return how far the prediction (B) is from what was measured (A), as in docs/compare.md."""
    angles_deg, values = digitised(quantity)
    part = Part({}, 'angle_deg', angles_deg, values, predicted(contact, quantity))
    return agreement_of([part])


@lru_cache(maxsize=4)
def fitted_friction(contact: ContactParameters) -> tuple[float, float]:
    """
    Return the friction coefficient that fits best, and its standard error.

    Both quantities count by the error of digitising; the scatter of the residuals sets the scale.

    """

    def residuals(friction: Array) -> Array:
        trial = replace(contact, friction=float(friction[0]))
        parts = [
            (predicted(trial, name) - digitised(name)[1]) / sigma
            for name, (_, sigma) in QUANTITIES.items()
        ]
        return np.concatenate(parts)

    found = least_squares(residuals, [contact.friction], diff_step=0.01)
    variance = 2.0 * found.cost / (found.fun.size - 1)
    return float(found.x[0]), math.sqrt(variance / float(found.jac[:, 0] @ found.jac[:, 0]))


def _impact_row(contact: ContactParameters, angle_deg: float, quantity: str, value: float) -> Row:
    found = rebound(contact, SPEED_M_PER_S, angle_deg)
    rigid = rigid_rebound(contact, SPEED_M_PER_S, angle_deg)
    row: Row = {'angle_deg': angle_deg, **found._asdict()}
    for name in QUANTITIES:
        row[f'rigid_{name}'] = getattr(rigid, name)
        row[f'measured_{name}'] = value if name == quantity else math.nan
    return row


def _impact_cases(parameters: Parameters, points: int) -> list[Case]:
    contact = sphere_struck(parameters)
    wanted = [
        (float(angle_deg), '', math.nan)
        for angle_deg in np.linspace(ANGLE_MIN_DEG, ANGLE_MAX_DEG, points)
    ]
    for name in QUANTITIES:
        wanted += [(float(x), name, float(y)) for x, y in zip(*digitised(name), strict=True)]
    return [partial(_impact_row, contact, *one) for one in sorted(wanted, key=lambda one: one[0])]


def _draw_impact(table: Table, figure: Figure) -> None:
    angles_deg, style = table.column('angle_deg'), curve_style(1)
    for axes, name in zip(figure.subplots(1, len(QUANTITIES)), QUANTITIES, strict=True):
        axes.plot(angles_deg, table.column(name), label='predicted')
        rigid = table.column(f'rigid_{name}')
        axes.plot(angles_deg, rigid, color='0.5', linestyle='--', label='rigid contact, Coulomb')
        measured = table.column(f'measured_{name}')
        axes.plot(
            angles_deg, measured, **style.points, label='measured (Kharaz et al.), digitised'
        )
        label_axes(axes, 'impact angle to the normal (deg)', QUANTITIES[name][0])
        draw_legend(axes)


def _impact_caption(parameters: Parameters) -> str:
    contact = sphere_struck(parameters)
    friction, error = fitted_friction(contact)
    told = [
        f'{label}: {found.points} points, RMS {found.rms:.3g}, bias {found.bias:.2g}'
        for label, found in (
            (label, agreement(contact, name)) for name, (label, _) in QUANTITIES.items()
        )
    ]
    return (
        f'A solid sphere, R = {contact.radius * 1e3:g} mm, strikes a plate at '
        f'{SPEED_M_PER_S:g} m/s; mu = {contact.friction:g}, Poisson ratios '
        f'{contact.poisson_sphere:g} and {contact.poisson_runner:g}; purely elastic. Prediction '
        f'less measurement: {"; ".join(told)}. The mu that fits best is {friction:.4f} ± '
        f'{error:.4f}.'
    )


MEASURED_IMPACT = PaperFigure(
    'measured_impact',
    'Oblique impact of an alumina sphere on glass',
    35,
    _impact_cases,
    _draw_impact,
    _impact_caption,
    (11.0, 4.6),
)
