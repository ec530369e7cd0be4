"""Checks of Jaeger's theorem, and of the kernel, against springs that are stepped one by one."""

from dataclasses import dataclass

import numpy as np

from stickslip_ros.contact.elasticity import Elasticity
from stickslip_ros.contact.presliding import Presliding, presliding
from stickslip_ros.contact.profile import Array, PowerProfile
from stickslip_ros.validation.checks import Check, Scale, Tolerance, compare_worst
from stickslip_ros.validation.findings import Curve, Findings, Panel
from stickslip_ros.validation.histories import WANDERING, History, remember, zigzag
from stickslip_ros.validation.springs import Springs, plant_springs, pull
from stickslip_ros.validation.stand import (
    E_STAR_PA,
    FRICTION,
    G_STAR_PA,
    ROUGH_TERMS,
    SMOOTH_TERMS,
    fractions,
)
from stickslip_ros.validation.tangential import MU_FN

SPRINGS = 4001
"""Not a multiple of the steps: where slip ends between springs is left to chance."""
SPRING_ERROR = Tolerance(5e-6, f'width of one of {SPRINGS} springs, and table of the kernel')
FORCE_N = 0.1
STEPS = 30
CONE_SLOPE = 0.01
COUNTS = (31, 101, 307, 1009, 3001, 10007)


@dataclass(frozen=True)
class Body:
    """A profile by name, as sums of powers."""

    name: str
    terms: tuple[tuple[float, ...], tuple[float, ...]]

    def height(self, x_m: Array) -> Array:
        """Return g, m."""
        return np.asarray(sum(q * x_m**n for q, n in zip(*self.terms, strict=True)))

    def contact(self) -> Presliding:
        """Return the package's contact."""
        elasticity = Elasticity(E_STAR_PA, G_STAR_PA)
        return presliding(PowerProfile(*self.terms), elasticity, FRICTION, FORCE_N)

    def springs(self, count: int) -> Springs:
        """Return the row of springs under the same force."""
        radius_m = self.contact().indentation.radius_m
        return plant_springs(self.height, (E_STAR_PA, G_STAR_PA), FRICTION, radius_m, count)


BODIES = (
    Body('sphere', SMOOTH_TERMS),
    Body('equivalent rough', ROUGH_TERMS),
    Body('cone', ((0.5 * np.pi * CONE_SLOPE,), (1.0,))),
)


def jaeger() -> Findings:
    """Check load curve and whole histories of three bodies."""
    checks = [check for body in BODIES for check in _body_checks(body)]
    return Findings('Springs one by one', tuple(checks), (_history_panel(), _count_panel()))


def _body_checks(body: Body) -> list[Check]:
    contact, springs = body.contact(), body.springs(SPRINGS)
    virgin_m = fractions(50) * contact.max_displacement_m
    forces_n = pull(springs, virgin_m).force_n
    closed_n = contact.tangential_force(virgin_m)
    expected, found = both(contact, springs)
    force_scale = Scale(contact.max_force_n, MU_FN)
    unit = Scale(contact.max_force_n * contact.max_displacement_m, 'mu F_n u_max')
    whole = Scale(float(expected.lost_j[-1]), 'the whole loss')
    rows = (
        ('load curve, closed form', forces_n, closed_n, 'N', force_scale),
        ('force, kernel', expected.force_n, found.force_n, 'N', force_scale),
        ('stored energy, kernel', expected.stored_j, found.stored_j, 'J', unit),
        ('friction loss, kernel', expected.lost_j, found.lost_j, 'J', whole),
    )
    text = f'{SPRINGS} springs'
    return [
        compare_worst(f'{body.name}: {name}', text, reference, ours, symbol, SPRING_ERROR, scale)
        for name, reference, ours, symbol, scale in rows
    ]


def both(contact: Presliding, springs: Springs) -> tuple[History, History]:
    """Return the wandering history by springs and by the kernel."""
    turns = tuple(turn * contact.max_displacement_m for turn in WANDERING)
    displacements_m = zigzag(turns, STEPS)
    return pull(springs, displacements_m), remember(contact, displacements_m)


def _history_panel() -> Panel:
    body = BODIES[1]
    contact = body.contact()
    expected, found = both(contact, body.springs(SPRINGS))
    places_nm = found.displacement_m * 1e9
    some = slice(None, None, 6)
    return Panel(
        'Equivalent rough contact, 12 turns, F_n = 0.1 N',
        'displacement u (nm)',
        'force T (mN)',
        (
            Curve('kernel', places_nm, found.force_n * 1e3),
            Curve(
                f'{SPRINGS} springs', places_nm[some], expected.force_n[some] * 1e3, 'points', 1
            ),
        ),
    )


def _count_panel() -> Panel:
    curves = []
    for colour, body in enumerate(BODIES):
        contact = body.contact()
        places_m = fractions(50) * contact.max_displacement_m
        closed_n = contact.tangential_force(places_m)
        errors = [
            float(np.max(np.abs(pull(body.springs(count), places_m).force_n - closed_n)))
            / contact.max_force_n
            for count in COUNTS
        ]
        counts = np.array(COUNTS, dtype=float)
        curves.append(Curve(body.name, counts, np.array(errors), 'line', colour))
    return Panel(
        'Load curve: springs tend to the closed form',
        'number of springs',
        'largest difference/(mu F_n)',
        tuple(curves),
        log_x=True,
        log_y=True,
    )
