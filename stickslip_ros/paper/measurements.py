"""
What others measured and published, predicted: a sphere that rebounds, and forces of two drives.

A sphere that strikes a plate obliquely presses and slides at once: its contact sticks, slips
partly and slips back while the normal force rises and falls. The tangential force is that of the
springs with which the drive goes while its preload changes.

"""

import math
from functools import lru_cache, partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

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
from stickslip_ros.paper.figure import Case, PaperFigure, Table, assumed, surface
from stickslip_ros.paper.readings import (
    AMPLITUDE_MAX_M,
    FORCE_FREQUENCY_HZ,
    friction_limit_n,
    stand_at,
    zero_of_force_m,
)
from stickslip_ros.parameters import ContactParameters, Parameters
from stickslip_ros.parameters.yaml_form import load_yaml
from stickslip_ros.study.journal import Row
from stickslip_ros.study.plotting import draw_legend, label_axes
from stickslip_ros.study.sawtooth_run import run_drive
from stickslip_ros.units import MN, NM

move_springs = entry_point(move_springs)

MEASURED = Path(__file__).parent / 'measured'
SPHERE = MEASURED / 'alumina_on_glass.yaml'
DENSITY_KG_PER_M3 = 4000.0
SPEED_M_PER_S = 3.9
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
    patch_m_per_s = along_m_per_s - (1.0 + ROLL) * lost_m_per_s
    return Rebound(
        1.0 - lost_m_per_s / along_m_per_s,
        -ROLL * lost_m_per_s / contact.radius,
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


def _sphere(parameters: Parameters) -> ContactParameters:
    """Return the sphere of the experiment, with what was changed."""
    return load_yaml(SPHERE).updated(parameters.changed()).contact


def _impact_row(contact: ContactParameters, angle_deg: float) -> Row:
    found = rebound(contact, SPEED_M_PER_S, angle_deg)
    return {'angle_deg': angle_deg, **found._asdict()}


def _impact_cases(parameters: Parameters, points: int) -> list[Case]:
    contact = _sphere(parameters)
    angles_deg = np.linspace(ANGLE_MIN_DEG, ANGLE_MAX_DEG, points)
    return [partial(_impact_row, contact, float(angle_deg)) for angle_deg in angles_deg]


PANELS = {
    'tangential_ratio': 'tangential velocity after/before',
    'spin_rad_per_s': 'spin after the impact (rad/s)',
    'patch_angle_deg': 'rebound angle of the contact point (deg)',
}


def _draw_impact(table: Table, figure: Figure) -> None:
    for axes, (name, label) in zip(figure.subplots(1, len(PANELS)), PANELS.items(), strict=True):
        axes.plot(table.column('angle_deg'), table.column(name), label='predicted')
        label_axes(axes, 'impact angle to the normal (deg)', label)
        draw_legend(axes)


def _impact_caption(parameters: Parameters) -> str:
    contact = _sphere(parameters)
    return (
        f'A solid sphere, R = {contact.radius * 1e3:g} mm, strikes a plate at '
        f'{SPEED_M_PER_S:g} m/s; mu = {contact.friction:g}, Poisson ratios '
        f'{contact.poisson_sphere:g} and {contact.poisson_runner:g}; purely elastic.'
    )


MEASURED_IMPACT = PaperFigure(
    'measured_impact',
    'Oblique impact of an alumina sphere on glass',
    35,
    _impact_cases,
    _draw_impact,
    _impact_caption,
    (13.0, 4.2),
)

HOLDING_AMPLITUDES = 2.0
"""Full amplitude of the SL-2040 in units of the one at which its force begins."""
HELD_PRELOADS_N = (0.1, 0.25, 0.5, 1.0)
VOLTAGE_MAX_V = 600.0
"""Twice that of the stand: room for twice the onset at 1 N."""
DAMPING_MAX_N_S_PER_M = 300.0


def _force_row(parameters: Parameters) -> Row:
    onset_m = zero_of_force_m(parameters, FORCE_FREQUENCY_HZ)
    full = run_drive(parameters, AMPLITUDE_MAX_M, FORCE_FREQUENCY_HZ)
    double = run_drive(parameters, HOLDING_AMPLITUDES * onset_m, FORCE_FREQUENCY_HZ)
    return {
        'preload_n': parameters.stand.preload,
        'damping_n_s_per_m': parameters.runner.damping,
        'onset_m': onset_m,
        'force_at_full_n': full.force_mean_n,
        'double_onset_share': double.force_mean_n / friction_limit_n(parameters),
    }


def _force_cases(parameters: Parameters, points: int) -> list[Case]:
    roomy = parameters.updated({'amplifier.voltage_max': VOLTAGE_MAX_V})
    return [
        partial(_force_row, stand_at(roomy, preload_n, {'runner.damping': float(damping)}))
        for preload_n in HELD_PRELOADS_N
        for damping in np.linspace(0.0, DAMPING_MAX_N_S_PER_M, points)
    ]


def _draw_force(table: Table, figure: Figure) -> None:
    force, share = figure.subplots(1, 2)
    for preload_n, rows, style in table.by_preload():
        damping = rows.column('damping_n_s_per_m')
        label = f'predicted, preload {preload_n:g} N'
        force.plot(damping, rows.column('force_at_full_n') * MN, **style.line, label=label)
        share.plot(damping, rows.column('double_onset_share'), **style.line, label=label)
    full_nm = AMPLITUDE_MAX_M * NM
    label_axes(force, 'damping c (N s/m)', f'generated force at {full_nm:g} nm (mN)')
    label_axes(share, 'damping c (N s/m)', 'force at twice the onset/holding force')
    for axes in (force, share):
        draw_legend(axes)


def _force_caption(parameters: Parameters) -> str:
    return f'{surface(parameters, "rough")}. {assumed(parameters)} The damping is varied.'


MEASURED_FORCE = PaperFigure(
    'measured_force',
    "Forces in Edeler's thesis",
    16,
    _force_cases,
    _draw_force,
    _force_caption,
    (11.0, 4.6),
)
