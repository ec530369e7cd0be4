"""
The contact spring by spring, as the paper steps it: slow, plain, and an independent reference.

Springs stand at the places x_i of the one-dimensional foundation. Each has the tangential
stiffness G* dx and slips at mu times its normal force E* dx (d - g(x_i)).

"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from itertools import repeat

import numpy as np

from stickslip_ros.contact.hemisphere import profile_of
from stickslip_ros.contact.mdr import Presliding
from stickslip_ros.contact.profile import Array, LineProfile
from stickslip_ros.contact.virgin import CELLS
from stickslip_ros.parameters import Parameters
from stickslip_ros.units import MN, NM
from stickslip_ros.validation.checks import (
    Curve,
    Family,
    Measured,
    Panel,
    Tolerance,
    measures,
    shared,
)
from stickslip_ros.validation.histories import (
    MU_FN,
    WANDERING,
    History,
    fractions,
    power_profile,
    pressed,
    remember,
    wandering,
    zigzag,
)
from stickslip_ros.validation.references import LOWER_SHARE, TERMS, height


@dataclass(frozen=True)
class Springs:
    """A row of springs: the stiffness of each, and the force at which each one slips."""

    stiffness_n_per_m: float
    limits_n: Array


def springs_under(contact: Presliding, depths_m: Array, spacing_m: float) -> Springs:
    """Return springs at equal distances that are pressed in by depths, m."""
    elasticity = contact.elasticity
    limits_n = contact.friction * elasticity.normal_pa * spacing_m * depths_m
    return Springs(elasticity.shear_pa * spacing_m, limits_n)


def springs_of_line(contact: Presliding) -> Springs:
    """Return the springs that a contact presses under a rough line."""
    line = contact.profile
    assert isinstance(line, LineProfile)
    depths_m = contact.indentation.depth_m - line.heights_m
    return springs_under(contact, depths_m[depths_m > 0.0], line.spacing_m)


def plant_springs(contact: Presliding, profile: Callable[[Array], Array], count: int) -> Springs:
    """
    Return so many springs from -a to a under a profile g(x).

    Of the contact moduli, friction and radius a are taken; the indentation is g(a).

    """
    radius_m = contact.indentation.radius_m
    spacing_m = 2.0 * radius_m / count
    places_m = -radius_m + spacing_m * (np.arange(count) + 0.5)
    depths_m = profile(np.array([radius_m])) - profile(np.abs(places_m))
    return springs_under(contact, depths_m, spacing_m)


def pull(
    springs: Springs, displacements_m: Array, limits_n: Iterable[Array] | None = None
) -> History:
    """
    Return the answer of the springs to a history of displacements, from rest at 0.

    If the forces at which they slip change, ``limits_n`` gives those at each displacement.

    Notes
    -----
    A spring is stretched by its stiffness times the step and cut back to its limit; what is
    cut off is slip, at the force of the limit.

    """
    stiffness, forces_n = springs.stiffness_n_per_m, np.zeros_like(springs.limits_n)
    limits = repeat(springs.limits_n) if limits_n is None else limits_n
    before_m = lost_j = 0.0
    rows = []
    for place_m, most_n in zip(displacements_m, limits, strict=False):
        wanted_n = forces_n + stiffness * (place_m - before_m)
        forces_n = np.clip(wanted_n, -most_n, most_n)
        lost_j += float(np.sum((wanted_n - forces_n) * forces_n)) / stiffness
        stored_j = float(np.sum(forces_n**2)) / (2.0 * stiffness)
        rows.append((float(np.sum(forces_n)), stored_j, lost_j))
        before_m = float(place_m)
    return History(displacements_m, *np.array(rows).T)


SPRINGS = 4001
"""Not a multiple of the steps: where slip ends between springs is left to chance."""
BY_SPRINGS = f'{SPRINGS} springs'
SPRING_ERROR = Tolerance(5e-6, f'width of one of {SPRINGS} springs, and table of the kernel')
FORCE_N = 0.1
STEPS = 30
COUNTS = (31, 101, 307, 1009, 3001, 10007)
BODIES = {'sphere': 'smooth', 'equivalent rough': 'rough', 'cone': 'cone'}


def _body(name: str, count: int = SPRINGS) -> tuple[Presliding, Springs]:
    """Return a body as the package presses it, and the row of springs under it."""
    contact = pressed(power_profile(BODIES[name]), FORCE_N)
    return contact, plant_springs(contact, partial(height, TERMS[BODIES[name]]), count)


def both(contact: Presliding, springs: Springs) -> tuple[History, History]:
    """Return the wandering history by springs and by the kernel."""
    displacements_m = wandering(contact, STEPS)
    return pull(springs, displacements_m), remember(contact, displacements_m)


@measures(
    ('{}: load curve, closed form', BY_SPRINGS, 'N', SPRING_ERROR, MU_FN),
    ('{}: force, kernel', BY_SPRINGS, 'N', SPRING_ERROR, MU_FN),
    ('{}: stored energy, kernel', BY_SPRINGS, 'J', SPRING_ERROR, 'mu F_n u_max'),
    ('{}: friction loss, kernel', BY_SPRINGS, 'J', SPRING_ERROR, 'the whole loss'),
    each=tuple(BODIES),
)
def _one_by_one(name: str) -> Measured:
    contact, springs = _body(name)
    limit_n, limit_m = contact.max_force_n, contact.max_displacement_m
    virgin_m = fractions(50) * limit_m
    slow, fast = both(contact, springs)
    return (
        (pull(springs, virgin_m).force_n, contact.tangential_force(virgin_m), limit_n),
        (slow.force_n, fast.force_n, limit_n),
        (slow.stored_j, fast.stored_j, limit_n * limit_m),
        (slow.lost_j, fast.lost_j, slow.lost_j[-1]),
    )


def _both_panel(title: str, histories: tuple[History, History], label: str, every: int) -> Panel:
    """Return the kernel's force as a line, and some of the springs' as points."""
    slow, fast = histories
    some = slow.part(slice(None, None, every))
    curves = (
        Curve('kernel', fast.displacement_m * NM, fast.force_n * MN),
        Curve(label, some.displacement_m * NM, some.force_n * MN, 'points', 1),
    )
    return Panel(title, 'displacement u (nm)', 'force T (mN)', curves)


def _history_panel() -> Panel:
    title = 'Equivalent rough contact, 12 turns, F_n = 0.1 N'
    return _both_panel(title, both(*_body('equivalent rough')), BY_SPRINGS, 6)


def _count_panel() -> Panel:
    counts, curves = np.array(COUNTS, dtype=float), []
    for colour, name in enumerate(BODIES):
        errors = []
        for count in COUNTS:
            contact, springs = _body(name, count)
            places_m = fractions(50) * contact.max_displacement_m
            missed_n = pull(springs, places_m).force_n - contact.tangential_force(places_m)
            errors.append(np.max(np.abs(missed_n)) / contact.max_force_n)
        curves.append(Curve(name, counts, np.array(errors), 'line', colour))
    title = 'Load curve: springs tend to the closed form'
    labels = ('number of springs', 'largest difference/(mu F_n)')
    return Panel(title, *labels, curves, log_x=True, log_y=True)


ONE_BY_ONE = Family('Springs one by one', (_one_by_one,), (_history_panel, _count_panel))


PRELOAD_N = 0.5
LINE_SPRINGS = 1647
"""Springs that this preload presses under the default line."""
LINE = f'sum over its {LINE_SPRINGS} springs'
TURNED = f'{LINE}, {len(WANDERING)} turns'
PREFIX_SUMS = Tolerance(1e-11, 'rounding of differences of sums over all springs of the line')
LINE_TABLE = Tolerance(
    2e-5, f'{CELLS} cells; a spring begins to slip up to half a cell off, with random sign'
)
ENERGY_TABLE = Tolerance(2e-5, f'the same {CELLS} cells')


@shared
def rough_line_contact() -> tuple[Presliding, Springs]:
    """Return a lower contact under the default line, and the springs that it presses."""
    line = profile_of(Parameters().updated({'contact.profile': 'rough_line'}).contact)
    contact = pressed(line, LOWER_SHARE * PRELOAD_N)
    return contact, springs_of_line(contact)


@measures(
    ('rough line: mu F_n', LINE, 'N', PREFIX_SUMS),
    ('rough line: load curve (Jaeger)', LINE, 'N', PREFIX_SUMS, MU_FN),
    ('rough line: load curve, kernel', LINE, 'N', LINE_TABLE, MU_FN),
    ('rough line: force, kernel', TURNED, 'N', LINE_TABLE, MU_FN),
    ('rough line: friction loss, kernel', TURNED, 'J', ENERGY_TABLE, 'the whole loss'),
)
def rough_line_checks() -> Measured:
    """Check normal force, Jaeger's theorem and the kernel's table under one random line."""
    contact, springs = rough_line_contact()
    limit_n = contact.max_force_n
    places_m = 1.1 * fractions(100) * contact.max_displacement_m
    exact_n = pull(springs, places_m).force_n
    slow, fast = both(contact, springs)
    return (
        (np.sum(springs.limits_n), limit_n),
        (exact_n, contact.tangential_force(places_m), limit_n),
        (exact_n, remember(contact, places_m).force_n, limit_n),
        (slow.force_n, fast.force_n, limit_n),
        (slow.lost_j, fast.lost_j, slow.lost_j[-1]),
    )


def rough_line_panel() -> Panel:
    """Return the virgin curve and a loop of the line, by springs and by the kernel."""
    contact, springs = rough_line_contact()
    turn_m = 0.9 * contact.max_displacement_m
    path_m = zigzag((turn_m, -turn_m, turn_m), 60)
    title = f'One random rough line, F_p = {PRELOAD_N:g} N'
    histories = (pull(springs, path_m), remember(contact, path_m))
    return _both_panel(title, histories, f'{LINE_SPRINGS} springs of the line', 4)
