"""
Checks of the spring bank while the preload changes: a fine row of springs, and the energy.

The reference is Section 3.4 of the paper taken literally: thousands of springs at equal distances
under each hemisphere, short steps, one array operation per step. With a quarter of the springs,
or twice as many, it differs by at most 5e-6 of mu F_n; with a third of the step its loss by 2e-5.

"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import sqrt

import numpy as np

from stickslip_ros.contact.bank import BANK_ERROR, SPRINGS
from stickslip_ros.contact.elasticity import Elasticity
from stickslip_ros.contact.indentation import indent
from stickslip_ros.contact.profile import Array, PowerProfile
from stickslip_ros.validation.bank_history import (
    LIMIT_PER_PRELOAD,
    drag_along,
    model_at,
    random_turns,
)
from stickslip_ros.validation.checks import Check, Scale, Tolerance, compare, compare_worst
from stickslip_ros.validation.findings import Curve, Panel
from stickslip_ros.validation.histories import History, zigzag
from stickslip_ros.validation.stand import (
    E_STAR_PA,
    FRICTION,
    G_STAR_PA,
    LOWER_SHARE,
    TERMS,
)

CONTACTS = ((2, sqrt(2.0) / 2.0), (4, LOWER_SHARE))
"""How many upper and lower contacts, and the share of the preload of each (Eq. 19)."""
FINE_SPRINGS = 4000
"""From the middle to the edge under the largest preload, per contact."""
REFINEMENT = 5
"""Steps of the reference per step of the bank."""
RAMP_N = (2.0, 0.1, 1.5, 0.2, 1.0)
"""Corners of the preload, which starts at the last one."""
SEED, TURNS, STEPS = 97, 25, 40
REACH_M = 120e-9
"""Largest turn: full slip at a light preload, stick under a heavy one."""
RAMP_ERROR = Tolerance(BANK_ERROR, f'{SPRINGS} springs per group instead of {FINE_SPRINGS}')
RAMP_LOSS = Tolerance(
    3e-4, f'{SPRINGS} springs per group; errors of single steps cancel in the sum'
)
BALANCE_STEPS = 4000
BALANCE = Tolerance(1e-5, f'trapezoidal rule of the work, {BALANCE_STEPS} steps')
NOW = Scale(1.0, 'mu F_n of that instant')
EDGE = 1.01
"""The row of springs ends a little beyond the contact under the largest preload."""


@dataclass(frozen=True)
class FineRow:
    """
    Springs at equal distances under equal contacts, from the middle to the edge.

    Attributes
    ----------
    heights_m : array
        Profile at each spring, rising.
    width_m : float
        Length of the foundation that a spring stands for: both sides of all contacts.
    load_per_preload : float
        Normal force of all contacts per preload.

    """

    heights_m: Array
    width_m: float
    load_per_preload: float

    def depths(self, preloads_n: Array) -> Array:
        """Return the depths at which the springs carry preloads, m."""
        sums_m = np.cumsum(self.heights_m)
        numbers = np.arange(1, len(self.heights_m) + 1)
        before_m = numbers * self.heights_m - sums_m
        wanted_m = self.load_per_preload * preloads_n / (E_STAR_PA * self.width_m)
        pressed = np.searchsorted(before_m, wanted_m) - 1
        return np.asarray((wanted_m + sums_m[pressed]) / numbers[pressed])


def fine_rows(profile: str) -> list[FineRow]:
    """Return the springs of upper and lower contacts, to beyond the heaviest contact's edge."""
    heaviest_n = CONTACTS[0][1] * max(RAMP_N)
    elasticity = Elasticity(E_STAR_PA, G_STAR_PA)
    edge_m = indent(PowerProfile(*TERMS[profile]), elasticity, heaviest_n).radius_m
    spacing_m = EDGE * edge_m / FINE_SPRINGS
    places_m = spacing_m * (np.arange(FINE_SPRINGS) + 0.5)
    heights_m = np.asarray(sum(q * places_m**n for q, n in zip(*TERMS[profile], strict=True)))
    return [
        FineRow(heights_m, 2.0 * count * spacing_m, count * share) for count, share in CONTACTS
    ]


def press_and_pull(rows: Sequence[FineRow], displacements_m: Array, preloads_n: Array) -> History:
    """
    Return the answer of rows of springs to displacement and preload, from unloaded springs.

    Notes
    -----
    What is lost is the work (trapezoidal rule) less what is stored: no formula for slip enters.

    """
    steps_m = np.diff(displacements_m, prepend=displacements_m[0])
    total_n, stored_j = np.zeros(len(steps_m)), np.zeros(len(steps_m))
    for row in rows:
        stiffness, forces_n = G_STAR_PA * row.width_m, np.zeros(len(row.heights_m))
        for k, depth_m in enumerate(row.depths(preloads_n)):
            pressed_m = np.maximum(depth_m - row.heights_m, 0.0)
            limits_n = FRICTION * E_STAR_PA * row.width_m * pressed_m
            forces_n = np.clip(forces_n + stiffness * steps_m[k], -limits_n, limits_n)
            total_n[k] += np.sum(forces_n)
            stored_j[k] += np.sum(forces_n**2) / (2.0 * stiffness)
    middle_n = 0.5 * (total_n + np.concatenate((np.zeros(1), total_n[:-1])))
    work_j = np.cumsum(middle_n * steps_m)
    return History(displacements_m, total_n, stored_j, work_j - stored_j)


def ramp_path() -> tuple[Array, Array]:
    """Return displacements, m, of a random history and preloads, N, that ramp meanwhile."""
    turns = tuple(REACH_M * turn for turn in random_turns(SEED, TURNS))
    displacements_m = zigzag(turns, STEPS)
    corners = np.linspace(0.0, 1.0, len(RAMP_N) + 1)
    times = np.linspace(0.0, 1.0, len(displacements_m))
    return displacements_m, np.interp(times, corners, (RAMP_N[-1], *RAMP_N))


@lru_cache(maxsize=2)
def both_on_the_ramp(profile: str) -> tuple[History, History, Array]:
    """Return the histories by fine springs and by the bank, and the preloads, N."""
    displacements_m, preloads_n = ramp_path()
    coarse = np.arange(len(preloads_n), dtype=float)
    fine = np.linspace(0.0, coarse[-1], REFINEMENT * (len(coarse) - 1) + 1)
    slow = press_and_pull(
        fine_rows(profile),
        np.interp(fine, coarse, displacements_m),
        np.interp(fine, coarse, preloads_n),
    )
    some = slice(None, None, REFINEMENT)
    expected = History(displacements_m, slow.force_n[some], slow.stored_j[some], slow.lost_j[some])
    bank = model_at(max(RAMP_N), profile).bank
    return expected, drag_along(bank, displacements_m, preloads_n), preloads_n


def preload_ramp() -> list[Check]:
    """Check force, loss and energy balance while the preload changes."""
    checks = []
    for profile in ('rough', 'smooth'):
        expected, found, preloads_n = both_on_the_ramp(profile)
        limits_n = LIMIT_PER_PRELOAD * preloads_n
        text = f'{len(CONTACTS)} x {FINE_SPRINGS} springs, NumPy'
        whole_j = float(expected.lost_j[-1])
        checks += [
            compare_worst(
                f'{profile}, preload ramps: T/(mu F_n)',
                text,
                expected.force_n / limits_n,
                found.force_n / limits_n,
                '',
                RAMP_ERROR,
                NOW,
            ),
            compare(
                f'{profile}, preload ramps: friction loss',
                f'{text}: work - stored',
                whole_j,
                float(found.lost_j[-1]),
                'J',
                RAMP_LOSS,
            ),
            _balance(profile),
        ]
    return checks


def _balance(profile: str) -> Check:
    """Check work = stored + lost on a smooth path of displacement and preload."""
    angles = np.linspace(0.0, 4.0 * np.pi, BALANCE_STEPS + 1, dtype=np.float64)
    bank = model_at(max(RAMP_N), profile).bank
    preloads_n = 0.6 + 0.4 * np.cos(0.7 * angles)
    found = drag_along(bank, REACH_M * np.sin(angles), preloads_n)
    means_n = 0.5 * (found.force_n[1:] + found.force_n[:-1])
    work_j = np.cumsum(means_n * np.diff(found.displacement_m))
    return compare_worst(
        f'{profile}, preload changes: stored + lost',
        'work int T du',
        work_j,
        found.stored_j[1:] + found.lost_j[1:],
        'J',
        BALANCE,
        Scale(float(work_j[-1]), 'the whole work'),
    )


def ramp_panel() -> Panel:
    """Return force and friction limit along the ramps."""
    expected, found, preloads_n = both_on_the_ramp('rough')
    steps = np.arange(len(preloads_n), dtype=float)
    some = slice(None, None, 8)
    limits_mn = LIMIT_PER_PRELOAD * preloads_n * 1e3
    return Panel(
        'Preload ramps, 0.1 to 2 N: bank and fine springs',
        'step of the history',
        'force T (mN)',
        (
            Curve('bank', steps, found.force_n * 1e3),
            Curve(
                f'2 x {FINE_SPRINGS} springs',
                steps[some],
                expected.force_n[some] * 1e3,
                'points',
                1,
            ),
            Curve('friction limit', steps, limits_mn, 'dashed', 2),
            Curve('', steps, -limits_mn, 'dashed', 2),
        ),
    )
