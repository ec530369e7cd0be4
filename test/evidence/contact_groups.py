# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""References of one contact by closed forms: pressed, pulled, back and forth, run down."""

import math
from functools import lru_cache
from typing import Any

import numpy as np

from evidence.closed_forms import (
    E_STAR_PA,
    FRICTION,
    G_STAR_PA,
    RADIUS_M,
    TERMS,
    Array,
    contact_of,
    height,
    hertz_depth,
    hertz_force,
    hertz_radius,
    unit_quadrature,
)
from evidence.group import ROUNDING, Group, grid
from stickslip_ros.contact.virgin import CELLS

BY = 'test/evidence/closed_forms.py'
SPHERE_TABLE = 1.5 * 0.2079 * CELLS**-1.5
"""Error of the table for a sphere, of the maximal force: 1.2e-6. The stiffness 1.5 sqrt(1 - s)
ends in a root, and there the trapezoidal rule misses -zeta(-1/2) h^(3/2)."""
TABLES = {
    'smooth': (2.0 * SPHERE_TABLE, f'of mu F_n: {CELLS} cells under the root of the stiffness'),
    'rough': (1e-7, f'of mu F_n: {CELLS} cells under a smooth stiffness'),
}
LOSSES = {
    'smooth': (8.0 * SPHERE_TABLE, f'of mu F_n u_max: {CELLS} cells under a root, eight areas'),
    'rough': (1e-6, 'table under a smooth stiffness, over a loop of a lesser area'),
}
FORCES_N = (0.001, 0.1, 10.0)
FORCE_N = 0.18
PULLS_M = {
    'smooth': (4e-9, 10e-9, 20e-9, 30e-9, 40e-9, 43e-9),
    'rough': (5e-9, 10e-9, 20e-9, 40e-9, 60e-9, 66e-9),
}
TURNS_M = {
    'smooth': (35e-9, -10e-9, -30e-9, -35e-9, 0.0, 25e-9),
    'rough': (50e-9, -20e-9, -40e-9, -50e-9, 10e-9, 40e-9),
}
"""The first turn; places on the way back; the second turn; places on the way forth."""
AMPLITUDES_M = {'smooth': (5e-9, 20e-9, 40e-9, 60e-9), 'rough': (5e-9, 20e-9, 50e-9, 80e-9)}
MODELS = {
    'smooth': 'Cattaneo, Mindlin: mu F_n (1 - (1 - u/u_max)^(3/2))',
    'rough': 'Jaeger, Ciavarella: mu (F_n - F_n(c))',
}
BRANCHES = {'smooth': 'Mindlin, Deresiewicz', 'rough': "Masing's rule on the closed form"}
BODIES = ('smooth', 'rough')


def limit_n(force_n: float, **_: object) -> float:
    """Return mu F_n."""
    return FRICTION * force_n


def limit_j(profile: str, force_n: float, **_: object) -> float:
    """Return mu F_n u_max."""
    return FRICTION * force_n * float(contact_of(profile, force_n).displacement(0.0))


def turns(turns_m: float | str) -> tuple[float, ...]:
    """Return the turning points of a case."""
    return tuple(float(turn) for turn in str(turns_m).split('/'))


def pressed_area(profile: str, depth_m: float) -> float:
    """Return F_n of a rough body: 2 E* int (d - g) dx by quadrature."""
    terms = TERMS[profile]
    low_m, high_m = 0.0, RADIUS_M
    while high_m - low_m > 1e-16 * RADIUS_M:
        middle_m = 0.5 * (low_m + high_m)
        if middle_m in {low_m, high_m}:
            break
        low_m, high_m = (
            (middle_m, high_m) if height(terms, middle_m) < depth_m else (low_m, middle_m)
        )
    points, weights = unit_quadrature()
    pressed_m = depth_m - height(terms, low_m * points**2)
    return 2.0 * E_STAR_PA * float(np.sum(weights * 2.0 * low_m * points * pressed_m))


def branch_cases(profile: str) -> list[dict[str, object]]:
    """Return histories with one and with two turns, and a closed loop."""
    first, *back, second, third, fourth = TURNS_M[profile]
    ways: list[tuple[float, ...]] = [(first, place) for place in back]
    ways += [(first, second), (first, second, third), (first, second, fourth)]
    ways.append((first, second, first))
    return grid(
        profile=[profile],
        force_n=[FORCE_N],
        turns_m=['/'.join(f'{turn:g}' for turn in way) for way in ways],
    )


REVERSALS = 1_000_000
RING_DOWN_ERRORS = {
    'smooth': (2e-5, 'of mu F_n: decision 1, a stack of 1024 turning points'),
    'rough': (2e-5, 'of mu F_n: decision 1, a stack of 1024 turning points'),
}
OUT_ERRORS = {
    'smooth': (8e-6, 'of mu F_n: error_n, turning points that were forgotten are passed again'),
    'rough': (1.4e-4, 'of mu F_n: error_n, turning points that were forgotten are passed again'),
}
REACHES_M = {'smooth': 43e-9, 'rough': 66e-9}


@lru_cache(maxsize=2)
def _ring_down(profile: str, force_n: float, reach_m: float, reversals: float) -> Array:
    """Return the forces after each reversal: nothing closes, so they are a plain sum."""
    contact, number = contact_of(profile, force_n), np.arange(round(reversals))
    turns_m = reach_m * (1.0 - number / round(reversals))
    halves_m = 0.5 * (turns_m[1:] + turns_m[:-1])
    # The virgin curve at a million places: a table of cores, refined by Newton's steps.
    cores_m = contact.radius_m * np.linspace(0.0, 1.0, 200_001, dtype=np.float64) ** 1.5
    guess_m: Any = np.interp(-halves_m, -contact.displacement(cores_m), cores_m)
    per_m = FRICTION * E_STAR_PA / G_STAR_PA
    for _ in range(8):
        slope = per_m * sum(q * n * guess_m ** (n - 1.0) for q, n in contact.terms)
        guess_m = guess_m + (contact.displacement(guess_m) - halves_m) / slope
        guess_m = np.clip(guess_m, 1e-15, contact.radius_m)
    swings_n = 2.0 * contact.force(guess_m)
    swings_n[::2] *= -1.0
    return np.cumsum(np.concatenate(([contact.pull(reach_m)], swings_n)))


def ring_down(
    profile: str, force_n: float, reach_m: float, reversals: float, after: float
) -> float:
    """Return the force after some reversals."""
    return float(_ring_down(profile, force_n, reach_m, reversals)[round(after) - 1])


def after_ring_down(
    profile: str, force_n: float, reach_m: float, reversals: float, displacement_m: float
) -> float:
    """Return the force on the way out: from the smallest loop that is not closed yet."""
    count = round(reversals)
    last = math.floor((1.0 - displacement_m / reach_m) * count)
    last -= 1 - last % 2  # an odd number: a turn below 0
    if last < 0:
        return contact_of(profile, force_n).pull(displacement_m)
    turn_m = -reach_m * (1.0 - last / count)
    swing_n = 2.0 * contact_of(profile, force_n).pull(0.5 * (displacement_m - turn_m))
    return float(_ring_down(profile, force_n, reach_m, reversals)[last]) + swing_n


GROUPS = [
    Group('Normal load', 'normal_modulus_pa', E_STAR_PA, ROUNDING, 'Eq. 5', BY),
    Group('Normal load', 'shear_modulus_pa', G_STAR_PA, ROUNDING, 'Eq. 6', BY),
    Group(
        'Normal load', 'cattaneo_mindlin', 17.0 / 14.0, ROUNDING,
        '(1 - nu/2)/(1 - nu), both nu 0.3', BY,
    ),
    *(
        Group('Normal load', quantity, formula, ROUNDING, 'Hertz', BY, cases)
        for quantity, formula, cases in (
            (
                'depth_m',
                lambda profile, force_n: hertz_depth(force_n),
                grid(profile=['smooth'], force_n=FORCES_N),
            ),
            (
                'radius_m',
                lambda profile, force_n: hertz_radius(force_n),
                grid(profile=['smooth'], force_n=FORCES_N),
            ),
            (
                'normal_force_n',
                lambda profile, depth_m: hertz_force(depth_m),
                grid(profile=['smooth'], depth_m=[1e-9, 1e-7, 1e-6]),
            ),
        )
    ),
    Group(
        'Normal load', 'depth_m',
        lambda profile, force_n: height(TERMS[profile], contact_of(profile, force_n).radius_m),
        (1e-11, 'the root that gives the radius'), 'Eqs 24 and 25, solved by bisection', BY,
        grid(profile=['rough'], force_n=FORCES_N),
    ),
    Group(
        'Normal load', 'radius_m',
        lambda profile, force_n: contact_of(profile, force_n).radius_m,
        (1e-11, 'the root that gives the radius'), 'Eqs 24 and 25, solved by bisection', BY,
        grid(profile=['rough'], force_n=FORCES_N),
    ),
    Group(
        'Normal load', 'normal_force_n', pressed_area,
        (1e-11, 'rounding, and 200 points of Gauss on a root of x'),
        '2 E* int (d - g) dx by quadrature (Eq. 24)', 'test/evidence/contact_groups.py',
        grid(profile=['rough'], depth_m=[1e-8, 8e-8, 2.63e-7]),
    ),
    Group(
        'Normal load', 'normal_stiffness_n_per_m',
        lambda profile, force_n: 2.0 * E_STAR_PA * contact_of(profile, force_n).radius_m,
        (1e-7, 'central difference over 2e-4 of the depth'), '2 E* a', BY,
        grid(profile=BODIES, force_n=[0.35]),
    ),
    *(
        group
        for profile in BODIES
        for group in (
            Group(
                'Tangential load', 'max_displacement_m',
                lambda profile, force_n: contact_of(profile, force_n).displacement(0.0),
                (1e-11, 'the root that gives the radius'), 'mu C_M d', BY,
                grid(profile=[profile], force_n=[FORCE_N]),
            ),
            Group(
                'Tangential load', 'stick_stiffness_n_per_m',
                lambda profile, force_n: 2.0 * G_STAR_PA * contact_of(profile, force_n).radius_m,
                (1e-11, 'the root that gives the radius'), '2 G* a', BY,
                grid(profile=[profile], force_n=[FORCE_N]),
            ),
            Group(
                'Tangential load', 'stick_radius_m',
                lambda profile, force_n, displacement_m: contact_of(profile, force_n).core(
                    displacement_m
                ),
                (1e-7, 'rounding, magnified where little of the core is left'),
                'd - u/(mu C_M) = g(c)', BY,
                grid(profile=[profile], force_n=[FORCE_N], displacement_m=PULLS_M[profile]),
            ),
            Group(
                'Tangential load', 'pull_n',
                lambda profile, force_n, displacement_m: contact_of(profile, force_n).pull(
                    displacement_m
                ),
                (1e-11, 'of mu F_n: the root that gives the radius'), MODELS[profile], BY,
                grid(profile=[profile], force_n=[FORCE_N], displacement_m=PULLS_M[profile]),
                limit_n,
            ),
            Group(
                'Tangential load', 'kernel_force_n',
                lambda profile, force_n, turns_m: contact_of(profile, force_n).pull(turns_m),
                TABLES[profile], MODELS[profile], BY,
                grid(profile=[profile], force_n=[FORCE_N], turns_m=PULLS_M[profile]),
                limit_n,
            ),
            Group(
                'Tangential load', 'kernel_force_n',
                lambda profile, force_n, turns_m: contact_of(profile, force_n).pull(turns_m),
                (1.0 / CELLS, f'the first of {CELLS} cells of the table is linear'),
                '2 G* a u', BY,
                grid(profile=[profile], force_n=[FORCE_N], turns_m=[5e-12]),
            ),
            Group(
                'Hysteresis', 'kernel_force_n',
                lambda profile, force_n, turns_m: contact_of(profile, force_n).along(
                    turns(turns_m)
                ),
                TABLES[profile], BRANCHES[profile], BY, branch_cases(profile), limit_n,
            ),
            Group(
                'Energy', 'cycle_loss_j',
                lambda profile, force_n, amplitude_m: contact_of(profile, force_n).cycle_loss(
                    amplitude_m
                ),
                LOSSES[profile], 'closed form, sums of powers', BY,
                grid(profile=[profile], force_n=[FORCE_N], amplitude_m=AMPLITUDES_M[profile]),
                limit_j if profile == 'smooth' else None,
            ),
            Group(
                'Energy', 'kernel_loss_j',
                lambda profile, force_n, turns_m: contact_of(profile, force_n).cycle_loss(turns_m)
                / 4.0,
                LOSSES[profile], 'a quarter of the cycle', BY,
                grid(profile=[profile], force_n=[FORCE_N], turns_m=AMPLITUDES_M[profile][1:3]),
                limit_j if profile == 'smooth' else None,
            ),
            Group(
                'Energy', 'wandering_missing', 0.0,
                (1e-6, 'of the work: trapezoidal rule, 2000 steps per leg'),
                'work is stored or lost', 'conservation of energy',
                grid(profile=[profile], force_n=[FORCE_N], reach_m=[REACHES_M[profile]]), 1.0,
                version='',
            ),
            Group(
                'Ring-down', 'ring_down_n', ring_down, RING_DOWN_ERRORS[profile],
                'alternating sum of the closed form', 'test/evidence/contact_groups.py',
                grid(
                    profile=[profile], force_n=[FORCE_N], reach_m=[REACHES_M[profile]],
                    reversals=[REVERSALS], after=[1000, 10_000, 100_000, 1_000_000],
                ),
                limit_n, is_slow=True,
            ),
            Group(
                'Ring-down', 'after_ring_down_n', after_ring_down, OUT_ERRORS[profile],
                'alternating sum of the closed form', 'test/evidence/contact_groups.py',
                grid(
                    profile=[profile], force_n=[FORCE_N], reach_m=[REACHES_M[profile]],
                    reversals=[REVERSALS],
                    displacement_m=[0.25 * REACHES_M[profile], 0.75 * REACHES_M[profile]],
                ),
                limit_n, is_slow=True,
            ),
            Group(
                'Ring-down', 'after_ring_down_n', after_ring_down, TABLES[profile],
                'back at the first turn', 'test/evidence/contact_groups.py',
                grid(
                    profile=[profile], force_n=[FORCE_N], reach_m=[REACHES_M[profile]],
                    reversals=[REVERSALS], displacement_m=[REACHES_M[profile]],
                ),
                limit_n,
            ),
        )
    ),
]  # fmt: skip
