"""Checks against the table of reference numbers of the contact of the paper."""

from dataclasses import dataclass

import numpy as np

from stickslip_ros.drive.build import contacts_of
from stickslip_ros.parameters import Parameters
from stickslip_ros.units import MICRO, NANO
from stickslip_ros.validation.checks import (
    HALF_A_DIGIT,
    SLACK,
    Check,
    Scale,
    Tolerance,
    compare_printed,
    compare_worst,
)
from stickslip_ros.validation.findings import Curve, Findings, Panel
from stickslip_ros.validation.histories import remember
from stickslip_ros.validation.stand import PRELOADS_N, fractions, lower_contact

TABLE_TEXT = 'reference table'
PLACES = (0.1, 0.25, 0.5, 0.75, 0.9)
"""u/u_max of the tabulated forces."""
SMOOTH_RATIOS = (0.14619, 0.35048, 0.64645, 0.87500, 0.96838)
RATIO_DIGIT = Tolerance(0.5e-5 * SLACK, HALF_A_DIGIT)


@dataclass(frozen=True)
class Row:
    """A row of the table: the figures as they are printed, in nm, um and N/um."""

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


ROWS = (
    Row(
        'rough',
        0.1,
        '81.5873',
        '3.11549',
        '29.7211',
        '0.7554',
        (0.20108, 0.46195, 0.78288, 0.95697, 0.99524),
    ),
    Row(
        'rough',
        1.0,
        '263.2160',
        '8.34539',
        '95.8858',
        '2.0235',
        (0.17623, 0.41426, 0.73314, 0.93695, 0.99214),
    ),
    Row('smooth', 0.1, '40.1840', '4.48241', '14.6385', '', SMOOTH_RATIOS),
    Row('smooth', 1.0, '186.5176', '9.65706', '67.9457', '', SMOOTH_RATIOS),
)

FIG_7 = {'rough': ('29.72', '66.17', '95.89'), 'smooth': ('14.64', '42.80', '67.95')}
"""u_max of the lower contacts in nm at preloads of 0.1, 0.5 and 1 N."""


def tables() -> Findings:
    """Check every number of the reference table."""
    checks = [check for row in ROWS for check in _row_checks(row)]
    return Findings('Reference table', (*checks, *_fig_7()), (_panel(),))


def _row_checks(row: Row) -> list[Check]:
    contact = lower_contact(row.profile, row.preload_n)
    lengths = (
        ('d', row.depth, contact.indentation.depth_m, NANO),
        ('a', row.radius, contact.indentation.radius_m, MICRO),
        ('u_max', row.presliding, contact.max_displacement_m, NANO),
    )
    checks = [
        compare_printed(f'{row.name}: {name}', TABLE_TEXT, figure, ours, 'm', per_unit=unit)
        for name, figure, ours, unit in lengths
    ]
    if row.stiffness:
        ours = contact.stick_stiffness_n_per_m
        name = f'{row.name}: 2 G* a'
        checks.append(
            compare_printed(name, TABLE_TEXT, row.stiffness, ours, 'N/m', per_unit=1.0 / MICRO)
        )
    forces_n = contact.tangential_force(np.array(PLACES) * contact.max_displacement_m)
    ratios = forces_n / contact.max_force_n
    name, text = f'{row.name}: T/(mu F_n)', f'{TABLE_TEXT}, worst of 5'
    checks.append(
        compare_worst(name, text, row.ratios, ratios, '', RATIO_DIGIT, scale=Scale(1.0, 'mu F_n'))
    )
    return checks


def _fig_7() -> list[Check]:
    """Check u_max at the preloads of Fig. 7, of the contacts that the drive builds."""
    checks = []
    for profile, figures in FIG_7.items():
        for preload_n, figure in zip(PRELOADS_N, figures, strict=True):
            stand = Parameters().updated({'contact.profile': profile, 'stand.preload': preload_n})
            ours = contacts_of(stand)[-1].max_displacement_m
            name = f'{profile}, F_p = {preload_n:g} N: u_max'
            checks.append(compare_printed(name, TABLE_TEXT, figure, ours, 'm', per_unit=NANO))
    return checks


def _panel() -> Panel:
    curves = []
    for colour, row in enumerate(ROWS[:3]):
        contact = lower_contact(row.profile, row.preload_n)
        places = fractions(80)
        history = remember(contact, places * contact.max_displacement_m)
        label = row.name if row.profile == 'rough' else 'smooth, any F_n'
        ratios = history.force_n / contact.max_force_n
        curves.append(Curve(label, places, ratios, colour=colour))
        printed = np.array(row.ratios)
        curves.append(Curve('', np.array(PLACES), printed, 'points', colour))
    return Panel(
        'Load curve: kernel (lines), reference table (points)',
        'displacement u/u_max',
        'force T/(mu F_n)',
        tuple(curves),
    )
