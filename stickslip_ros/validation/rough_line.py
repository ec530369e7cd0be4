"""Checks of the contact under one random rough line against the sum over its springs."""

from functools import lru_cache

import numpy as np

from stickslip_ros.contact.elasticity import Elasticity
from stickslip_ros.contact.hemisphere import profile_of
from stickslip_ros.contact.line_profile import LineProfile
from stickslip_ros.contact.presliding import Presliding, presliding
from stickslip_ros.contact.virgin import CELLS
from stickslip_ros.parameters import Parameters
from stickslip_ros.validation.checks import Check, Scale, Tolerance, compare, compare_worst
from stickslip_ros.validation.findings import Curve, Panel
from stickslip_ros.validation.histories import WANDERING, remember, zigzag
from stickslip_ros.validation.springs import Springs, pull
from stickslip_ros.validation.stand import (
    E_STAR_PA,
    FRICTION,
    G_STAR_PA,
    LOWER_SHARE,
    fractions,
)
from stickslip_ros.validation.tangential import MU_FN

PRELOAD_N = 0.5
STEPS = 30
PREFIX_SUMS = Tolerance(1e-11, 'rounding of differences of sums over all springs of the line')
LINE_TABLE = Tolerance(
    2e-5, f'{CELLS} cells; a spring begins to slip up to half a cell off, with random sign'
)
ENERGY_TABLE = Tolerance(2e-5, f'the same {CELLS} cells')


@lru_cache(maxsize=1)
def rough_line_contact() -> tuple[Presliding, Springs]:
    """Return a lower contact under the default line, and the springs that it presses."""
    parameters = Parameters().updated({'contact.profile': 'rough_line'}).contact
    line = profile_of(parameters)
    assert isinstance(line, LineProfile)
    elasticity = Elasticity(E_STAR_PA, G_STAR_PA)
    contact = presliding(line, elasticity, FRICTION, LOWER_SHARE * PRELOAD_N)
    compressed_m = contact.indentation.depth_m - line.heights_m
    limits_n = FRICTION * E_STAR_PA * line.spacing_m * compressed_m[compressed_m > 0.0]
    return contact, Springs(G_STAR_PA * line.spacing_m, limits_n)


def rough_line_checks() -> list[Check]:
    """Check normal force, Jaeger's theorem and the kernel's table."""
    contact, springs = rough_line_contact()
    places_m = 1.1 * fractions(100) * contact.max_displacement_m
    exact_n = pull(springs, places_m).force_n
    count = len(springs.thresholds_n)
    text, scale = f'sum over its {count} springs', Scale(contact.max_force_n, MU_FN)
    turns = tuple(turn * contact.max_displacement_m for turn in WANDERING)
    path_m = zigzag(turns, STEPS)
    slow, fast = pull(springs, path_m), remember(contact, path_m)
    limit_n, turned = float(np.sum(springs.thresholds_n)), f'{text}, {len(turns)} turns'
    whole = Scale(float(slow.lost_j[-1]), 'the whole loss')
    rows = (
        ('load curve (Jaeger)', text, exact_n, contact.tangential_force(places_m), PREFIX_SUMS),
        ('load curve, kernel', text, exact_n, remember(contact, places_m).force_n, LINE_TABLE),
        ('force, kernel', turned, slow.force_n, fast.force_n, LINE_TABLE),
    )
    name = 'rough line'
    return [
        compare(f'{name}: mu F_n', text, limit_n, contact.max_force_n, 'N', PREFIX_SUMS),
        *(
            compare_worst(f'{name}: {what}', against, expected, ours, 'N', tolerance, scale)
            for what, against, expected, ours, tolerance in rows
        ),
        compare_worst(
            f'{name}: friction loss, kernel',
            turned,
            slow.lost_j,
            fast.lost_j,
            'J',
            ENERGY_TABLE,
            whole,
        ),
    ]


def rough_line_panel() -> Panel:
    """Return the virgin curve and a loop of the line, by springs and by the kernel."""
    contact, springs = rough_line_contact()
    limit_m = contact.max_displacement_m
    path_m = zigzag((0.9 * limit_m, -0.9 * limit_m, 0.9 * limit_m), 60)
    slow, fast = pull(springs, path_m), remember(contact, path_m)
    places_nm, some = path_m * 1e9, slice(None, None, 4)
    return Panel(
        f'One random rough line, F_p = {PRELOAD_N:g} N',
        'displacement u (nm)',
        'force T (mN)',
        (
            Curve('kernel', places_nm, fast.force_n * 1e3),
            Curve(
                f'{len(springs.thresholds_n)} springs of the line',
                places_nm[some],
                slow.force_n[some] * 1e3,
                'points',
                1,
            ),
        ),
    )
