# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The contact spring by spring, as the paper steps it: slow, plain, and an independent reference.

Springs stand at the places x_i of the one-dimensional foundation. Each has the tangential
stiffness G* dx and slips at mu times its normal force E* dx (d - g(x_i)).

"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import lru_cache
from itertools import repeat
from typing import Any

import numpy as np

from evidence.closed_forms import E_STAR_PA, FRICTION, G_STAR_PA, TERMS, Array, contact_of, height
from evidence.group import Group, grid
from stickslip_ros.contact.hemisphere import profile_of
from stickslip_ros.contact.mdr import Presliding
from stickslip_ros.contact.profile import LineProfile
from stickslip_ros.contact.virgin import CELLS
from stickslip_ros.lab.validation.contacts import WANDERING_STEPS, wandering
from stickslip_ros.parameters import Parameters


@dataclass(frozen=True)
class History:
    """Answer of springs to a history of displacements, one value per displacement."""

    displacement_m: Array
    force_n: Array  # sum of the spring forces
    stored_j: Array  # elastic energy
    lost_j: Array  # friction loss so far


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
SPRING_ERROR = 5e-6, f'width of one of {SPRINGS} springs, and table of the kernel'
FORCE_N, LINE_FORCE_N = 0.1, 0.18
REACHES_M = {'smooth': 29e-9, 'rough': 51e-9, 'cone': 38e-9, 'rough_line': 66e-9}
LEGS = (2.5, 5.5, 8.0, 10.5, 12.0)
LINE_SUMS = 1e-11, 'of mu F_n: rounding of differences of sums over all springs of the line'
LINE_TABLE = (
    2e-5,
    f'{CELLS} cells; a spring begins to slip up to half a cell off, with random sign',
)
BY = 'test/evidence/springs.py'


def pressed_depth(heights_m: Array, spacing_m: float, force_n: Array | float) -> Array:
    """Return the depths in which springs carry forces, m: the heights that are below count."""
    rising_m = np.sort(heights_m)
    sums_m, numbers = np.cumsum(rising_m), np.arange(1, len(rising_m) + 1)
    wanted_m = force_n / (E_STAR_PA * spacing_m)
    count = np.searchsorted(numbers * rising_m - sums_m, wanted_m) - 1
    return np.asarray((wanted_m + sums_m[count]) / numbers[count])


@lru_cache(maxsize=8)
def row_of(profile: str, force_n: float) -> Springs:
    """Return the springs under a body or under the default rough line."""
    if profile == 'rough_line':
        line = profile_of(Parameters().updated({'contact.profile': profile}).contact)
        assert isinstance(line, LineProfile)
        heights_m, width_m = line.heights_m, line.spacing_m
        depth_m = float(pressed_depth(heights_m, width_m, force_n))
    else:
        radius_m = contact_of(profile, force_n).radius_m
        width_m = 2.0 * radius_m / SPRINGS
        places_m = -radius_m + width_m * (np.arange(SPRINGS) + 0.5)
        heights_m = height(TERMS[profile], np.abs(places_m))
        depth_m = float(height(TERMS[profile], radius_m))
    depths_m = depth_m - heights_m[heights_m < depth_m]
    return Springs(G_STAR_PA * width_m, FRICTION * E_STAR_PA * width_m * depths_m)


def virgin_pull(profile: str, force_n: float, displacement_m: float) -> float:
    """Return the force at a displacement."""
    return float(pull(row_of(profile, force_n), np.array([displacement_m])).force_n[0])


@lru_cache(maxsize=8)
def _wandering(profile: str, force_n: float, reach_m: float) -> History:
    return pull(row_of(profile, force_n), wandering(reach_m, WANDERING_STEPS))


def _after(column: str) -> Callable[..., float]:
    def value(profile: str, force_n: float, reach_m: float, legs: float) -> float:
        history = vars(_wandering(profile, force_n, reach_m))[column]
        return float(history[round(legs * WANDERING_STEPS)])

    return value


def limit_n(force_n: float, **_: object) -> float:
    """Return mu F_n."""
    return FRICTION * force_n


def limit_j(force_n: float, reach_m: float, **_: object) -> float:
    """Return mu F_n times the reach, about u_max."""
    return FRICTION * force_n * reach_m


def _wanderings(
    family: str, profile: str, force_n: float, tolerance: tuple[float, str], source: str
) -> list[Group]:
    case: dict[str, Any] = {
        'profile': [profile],
        'force_n': [force_n],
        'reach_m': [REACHES_M[profile]],
    }
    return [
        Group(
            family, quantity, _after(column), (tolerance[0], f'of {words}: {tolerance[1]}'),
            source, BY, grid(**case, legs=legs), scale,
        )
        for quantity, column, words, legs, scale in (
            ('wandering_force_n', 'force_n', 'mu F_n', LEGS, limit_n),
            ('wandering_stored_j', 'stored_j', 'mu F_n u_max', (5.5, 10.5), limit_j),
            ('wandering_loss_j', 'lost_j', 'the loss', (12.0,), None),
        )
    ]  # fmt: skip


GROUPS = [
    *(
        group
        for profile in ('smooth', 'rough', 'cone')
        for group in (
            Group(
                'Springs one by one', 'pull_n', virgin_pull,
                (SPRING_ERROR[0], f'of mu F_n: {SPRING_ERROR[1]}'), f'{SPRINGS} springs', BY,
                grid(
                    profile=[profile], force_n=[FORCE_N],
                    displacement_m=[0.3 * REACHES_M[profile], 0.9 * REACHES_M[profile]],
                ),
                limit_n,
            ),
            *_wanderings(
                'Springs one by one', profile, FORCE_N, SPRING_ERROR, f'{SPRINGS} springs'
            ),
        )
    ),
    Group(
        'Spectra', 'max_force_n', limit_n, LINE_SUMS, 'mu F_n', BY,
        grid(profile=['rough_line'], force_n=[LINE_FORCE_N]),
    ),
    Group(
        'Spectra', 'pull_n', virgin_pull, LINE_SUMS, 'the springs of the line', BY,
        grid(
            profile=['rough_line'], force_n=[LINE_FORCE_N],
            displacement_m=[5e-9, 20e-9, 40e-9, 60e-9],
        ),
        limit_n,
    ),
    *_wanderings('Spectra', 'rough_line', LINE_FORCE_N, LINE_TABLE, 'the springs of the line'),
]  # fmt: skip
