# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The springs of the drive against more of them: rows of thousands, at constant load and on ramps.

Section 3.4 of the paper taken literally: springs at equal distances under each hemisphere, in
short steps. With a quarter of the springs, or twice as many, the answer differs by at most 5e-6 of
mu F_n; with a third of the step its loss by 2e-5.

"""

from functools import lru_cache

import numpy as np

from evidence.closed_forms import (
    E_STAR_PA,
    FRICTION,
    G_STAR_PA,
    LIMIT_PER_PRELOAD,
    LOWER_SHARE,
    TERMS,
    UPPER_SHARE,
    Array,
    contact_of,
    height,
)
from evidence.group import Group, grid
from evidence.springs import History, Springs, pressed_depth, pull
from stickslip_ros.contact.profile import LineProfile
from stickslip_ros.contact.springs import BANK_ERROR, SPRINGS, SPRINGS_IN_ALL
from stickslip_ros.drive.layout import contacts_of
from stickslip_ros.lab.validation.bank import TURN_STEPS, ramp, random_path
from stickslip_ros.parameters import Parameters

CONTACTS = ((2, UPPER_SHARE), (4, LOWER_SHARE))
"""How many upper and lower contacts, and the share of the preload of each (Eq. 19)."""
SHARES = (*[UPPER_SHARE] * 2, *[LOWER_SHARE] * 4)
FINE_SPRINGS = 4000
"""From the middle to the edge under the largest preload, per contact."""
REFINEMENT = 5
"""Steps of the reference per step of the bank."""
EDGE = 1.01
"""The row of springs ends a little beyond the contact under the largest preload."""
FEW = BANK_ERROR, f'of mu 2 sqrt2 F_p: {SPRINGS} springs per group, not infinitely many'
FEWER = (
    6.0 * BANK_ERROR,
    f'of mu 2 sqrt2 F_p: {SPRINGS_IN_ALL // 6} springs per contact of six different lines',
)
LOSS = 3e-4, f'{SPRINGS} springs per group; errors of single steps cancel in the sum'
PRELOADS_N = (0.1, 0.5, 1.0, 2.0)
LEGS = (4.5, 17.0, 31.5, 46.5, 60.0)
RAMP_STEPS = (120, 333, 480, 651, 815, 1000)
BY = 'test/evidence/spring_bank.py'


def fine_springs(profile: str, displacements_m: Array, preloads_n: Array) -> History:
    """
    Return the answer of fine rows of springs to displacement and preload.

    Notes
    -----
    A spring stands for both sides of all equal contacts. What is lost is the work less what is
    stored: no formula for slip enters.

    """
    heaviest = contact_of(profile, UPPER_SHARE * float(np.max(preloads_n)))
    spacing_m = EDGE * heaviest.radius_m / FINE_SPRINGS
    numbers = np.arange(FINE_SPRINGS, dtype=np.float64)
    heights_m = height(TERMS[profile], spacing_m * (numbers + 0.5))
    force_n, stored_j = np.zeros((2, len(preloads_n)))
    for count, share in CONTACTS:
        width_m = 2.0 * count * spacing_m
        depths_m = pressed_depth(heights_m, width_m, count * share * preloads_n)
        limits_n = (
            FRICTION * E_STAR_PA * width_m * np.maximum(depth_m - heights_m, 0.0)
            for depth_m in depths_m
        )
        springs = Springs(G_STAR_PA * width_m, np.zeros(FINE_SPRINGS))
        found = pull(springs, displacements_m, limits_n)
        force_n, stored_j = force_n + found.force_n, stored_j + found.stored_j
    means_n = 0.5 * (force_n[1:] + force_n[:-1])
    work_j = np.concatenate(([0.0], np.cumsum(means_n * np.diff(displacements_m))))
    return History(displacements_m, force_n, stored_j, work_j - stored_j)


def line_springs(preload_n: float, displacements_m: Array) -> Array:
    """Return the force of all springs under the six lines of the default drive, N."""
    stand = Parameters().updated({'contact.profile': 'rough_line', 'stand.preload': preload_n})
    force_n = np.zeros_like(displacements_m)
    for contact, share in zip(contacts_of(stand), SHARES, strict=True):
        line = contact.profile
        assert isinstance(line, LineProfile)
        depth_m = float(pressed_depth(line.heights_m, line.spacing_m, share * preload_n))
        depths_m = depth_m - line.heights_m[line.heights_m < depth_m]
        limits_n = FRICTION * E_STAR_PA * line.spacing_m * depths_m
        force_n += pull(Springs(G_STAR_PA * line.spacing_m, limits_n), displacements_m).force_n
    return force_n


@lru_cache(maxsize=16)
def _at_constant_load(profile: str, preload_n: float, reach_m: float) -> Array:
    path_m = random_path(reach_m)
    if profile == 'rough_line':
        return line_springs(preload_n, path_m)
    return fine_springs(profile, path_m, np.full(len(path_m), preload_n)).force_n


def at_constant_load(profile: str, preload_n: float, reach_m: float, legs: float) -> float:
    """Return the force after some legs of the random history."""
    return float(_at_constant_load(profile, preload_n, reach_m)[round(legs * TURN_STEPS)])


@lru_cache(maxsize=2)
def on_ramps(profile: str) -> History:
    """Return the answer of fine springs on ramps of the preload."""
    return fine_springs(profile, *ramp(REFINEMENT))


def full_slip_n(preload_n: float, **_: object) -> float:
    """Return mu 2 sqrt2 F_p."""
    return LIMIT_PER_PRELOAD * preload_n


def limit_on_ramps_n(step: float, **_: object) -> float:
    """Return mu 2 sqrt2 F_p after some steps."""
    return LIMIT_PER_PRELOAD * float(ramp()[1][round(step)])


def _reach_m(profile: str, preload_n: float) -> float:
    """Return 1.2 u_max of an upper contact, about."""
    body = 'smooth' if profile == 'smooth' else 'rough'
    limit_m = float(contact_of(body, UPPER_SHARE * preload_n).displacement(0.0))
    return float(f'{1.2 * limit_m:.2g}')


GROUPS = [
    *(
        Group(
            'Spring bank', 'bank_force_n', at_constant_load,
            FEWER if profile == 'rough_line' else FEW, source, BY,
            [
                {**case, 'reach_m': _reach_m(profile, preload_n), 'legs': legs}
                for preload_n in PRELOADS_N
                for case in grid(profile=[profile], preload_n=[preload_n])
                for legs in LEGS
            ],
            full_slip_n, is_slow=True,
        )
        for profile, source in (
            ('smooth', f'{len(CONTACTS)} x {FINE_SPRINGS} springs'),
            ('rough', f'{len(CONTACTS)} x {FINE_SPRINGS} springs'),
            ('rough_line', 'all springs of six lines'),
        )
    ),
    Group(
        'Spring bank', 'bank_full_slip_n', full_slip_n,
        (1e-11, 'rounding of sums over the springs'), 'mu 2 sqrt2 F_p', BY,
        grid(profile=['smooth', 'rough'], preload_n=[0.1, 0.7, 2.0]),
    ),
    Group(
        'Spring bank', 'ramp_force_n',
        lambda profile, step: on_ramps(profile).force_n[REFINEMENT * round(step)],
        FEW, f'{len(CONTACTS)} x {FINE_SPRINGS} springs in short steps', BY,
        grid(profile=['smooth', 'rough'], step=RAMP_STEPS), limit_on_ramps_n, is_slow=True,
    ),
    Group(
        'Spring bank', 'ramp_loss_j', lambda profile: on_ramps(profile).lost_j[-1],
        LOSS, f'{len(CONTACTS)} x {FINE_SPRINGS} springs in short steps', BY,
        grid(profile=['smooth', 'rough']), is_slow=True,
    ),
    Group(
        'Spring bank', 'bank_missing', 0.0,
        (1e-5, 'of the work: trapezoidal rule, 4000 steps'), 'work is stored or lost',
        'conservation of energy', grid(profile=['smooth', 'rough']), 1.0, version='',
    ),
]  # fmt: skip
