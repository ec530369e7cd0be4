# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Layouts of feet, spring by spring: three feet, a clamp with a guide, and a walker of six feet.

``make evidence`` writes layouts.csv. Heights at equal distances part the springs of a foot; each
has exactly the normal force and the stiffness of its part. Velocity Verlet steps the runner; falls
begin and end on a step. A second run with half the steps and twice the springs gives the error.

**Walker.** n equal feet (limit L = mu F_n, virgin curve T_v up to u_max) fall by A, slowly and one
after another; F pulls the runner along its way.

- Rigid contacts: n - 1 feet hold one if (n - 1) L + F >= L, so the load -F is at most (n - 2) L.
  The runner follows the ramp of the feet that hold it: a step is A.
- Presliding: each fall takes the runner back by d. The force of a foot is L after its fall, and
  L - 2 T_v(k d/2) after k falls of others (Masing). The ramp changes no force. All add up to F:
  2 (T_v(d/2) + T_v(2 d/2) + ... + T_v((n - 1) d/2)) = n L - F. A step is A - n d; if A < n d, the
  loops close, and it is 0. So the 0-amplitude is n d and the slope is 1.
- A fast fall ends before the runner moves and unloads its own foot too: the sum ends at n d/2.
- The step vanishes at d = A/n, under the load -F = 2 (T_v(A/2n) + ... + T_v((n - 1) A/2n)) - n L.
- If all springs slip at once, T_v = min(L u/u_max, L), and F = 0: d = 2 u_max/(n - 1), and a step
  is A - 2 u_max n/(n - 1). Every T_v is concave, so no profile has a smaller step.

"""

import math
from collections.abc import Iterator
from functools import lru_cache
from typing import Any, NamedTuple

import numba
import numpy as np
from scipy.optimize import bisect

from evidence.closed_forms import (
    E_STAR_PA,
    FRICTION,
    G_STAR_PA,
    POISSON,
    YOUNG_PA,
    Array,
    contact_of,
)
from evidence.group import NUMBA
from stickslip_ros.lab.validation.references import TABLES, Reference, case_of

compiled: Any = numba.njit(fastmath={'reassoc', 'contract', 'nnan', 'nsz'})

BY = 'test/evidence/layouts.py'
TABLE = TABLES[1]
PRELOAD_N, MASS_KG, M_PER_V, SLEW_V_PER_S = 0.5, 3e-3, 160e-9 / 300.0, 150e6
FINE_PART_S = 12e-6
"""From the begin of a fall; half as long again as a slow fall."""
TOLERANCE = 3e-4
NO_STEP = 1e-3
"""The error of a smaller step is relative to this share of the stroke."""


class Layout(NamedTuple):
    """Groups of equal feet: number, F_n of a foot per preload, gain, delay in periods, stuff."""

    counts: tuple[int, ...]
    shares: tuple[float, ...]
    gains: tuple[float, ...]
    delays: tuple[float, ...]
    stuffs: tuple[tuple[float, float], ...] = ((FRICTION, YOUNG_PA[1]),) * 6
    """Friction coefficient and Young's modulus, Pa, of each group."""


class Mesh(NamedTuple):
    """Springs of a foot, and the longest steps in the fine part and in the rest, s."""

    springs: int
    fine_s: float
    coarse_s: float


MESHES = Mesh(300, 20e-9, 100e-9), Mesh(600, 10e-9, 50e-9)
ROOT = math.sqrt(2.0)
LAYOUTS = {
    'stand': Layout((2, 4), (ROOT / 2.0, ROOT / 4.0), (1.0, 1.0), (0.0, 0.0)),
    'three_feet': Layout((3,), (2.0 * ROOT / 3.0,), (1.0,), (0.0,)),
    'clamp': Layout((1, 1), (1.0, 1.0), (1.0, 0.0), (0.0, 0.0)),
    'light_clamp': Layout((1, 1), (1.0, 0.3), (1.0, 0.0), (0.0, 0.0)),
    'walker': Layout((1,) * 6, (ROOT / 4.0,) * 6, (1.0,) * 6, tuple(i / 6.0 for i in range(6))),
    'ptfe_guide': Layout(
        (2, 1), (0.5, 1.0), (1.0, 0.0), (0.0, 0.0), ((FRICTION, YOUNG_PA[1]), (0.05, 0.5e9))
    ),
    'rolling_guide': Layout(
        (3, 2), (0.33, 0.5), (1.0, 0.0), (0.0, 0.0), ((0.21, 68e9), (0.004, 210e9))
    ),
    'sapphire_pads': Layout(
        (2, 4), (0.71, 0.35), (1.0, 1.0), (0.0, 0.0), ((0.17, 435e9), (0.26, YOUNG_PA[1]))
    ),
    'mixed_walker': Layout(
        (2, 2, 2),
        (0.47, 0.4, 0.33),
        (1.0, 0.9, 1.0),
        (0.0, 1.0 / 3.0, 2.0 / 3.0),
        ((0.3, 70e9), (0.19, 435e9), (0.24, 30e9)),
    ),
}


class Case(NamedTuple):
    """A run from rest; SI units. ``last`` cycles are averaged."""

    layout: str
    voltage_v: float
    frequency_hz: float
    damping: float
    cell_n_per_m: float
    cycles: int
    last: int
    load_n: float = 0.0
    slew_v_per_s: float = SLEW_V_PER_S
    loss_factor: float = 0.0


K = 1e5
CASES = (
    Case('stand', 300.0, 1e3, 20.0, K, 200, 50),
    *(Case('three_feet', 300.0, 1e3, damping, K, 200, 50) for damping in (0.0, 20.0)),
    *(
        Case('three_feet', volts, 200.0, 20.0, 0.0, 60, 20)
        for volts in (120.0, 180.0, 240.0, 300.0)
    ),
    *(
        Case(layout, 300.0, 500.0, 20.0, cell_n_per_m, 60, 20)
        for layout in ('clamp', 'light_clamp', 'walker')
        for cell_n_per_m in (0.0, K)
    ),
    Case('ptfe_guide', 287.0, 500.0, 11.0, 0.0, 60, 20),
    Case('rolling_guide', 279.0, 600.0, 9.0, 0.0, 60, 20),
    Case('sapphire_pads', 291.0, 900.0, 13.0, K, 200, 50),
    Case('mixed_walker', 283.0, 400.0, 17.0, 0.0, 60, 20),
    Case('stand', 300.0, 1e3, 0.0, K, 40, 10, loss_factor=0.1),
    Case('stand', 300.0, 1e3, 5.0, 0.0, 40, 10, loss_factor=0.3),
    Case('light_clamp', 300.0, 500.0, 0.0, K, 40, 10, loss_factor=0.1),
    Case('walker', 300.0, 500.0, 0.0, 0.0, 20, 10, loss_factor=0.1),
    Case('ptfe_guide', 287.0, 500.0, 11.0, 0.0, 40, 10, loss_factor=0.2),
    Case('rolling_guide', 279.0, 600.0, 0.0, K, 40, 10, loss_factor=0.15),
    Case('sapphire_pads', 291.0, 900.0, 3.0, 0.0, 40, 10, loss_factor=0.1),
    Case('mixed_walker', 283.0, 400.0, 7.0, K, 40, 10, loss_factor=0.25),
)


@lru_cache(maxsize=32)
def springs_of(
    normal_n: float, count: int, friction: float = FRICTION, young_pa: float = YOUNG_PA[1]
) -> tuple[Array, Array]:
    """
    Return stiffnesses, N/m, and limits, N, of springs between heights of equal distance.

    With equal Poisson's ratios both moduli of a foot of another stuff change by one factor: the
    contact is that of the paper under a force that is smaller by it.

    """
    softness = (1.0 - POISSON**2) * (1.0 / YOUNG_PA[0] + 1.0 / young_pa) * E_STAR_PA
    contact = contact_of('rough', normal_n * softness)
    reaches_m = float(contact.displacement(0.0)) * np.arange(count, -1, -1) / count
    edges_m = np.array([0.0, *map(contact.core, reaches_m[1:-1]), contact.radius_m])
    stiffnesses = 2.0 * G_STAR_PA * edges_m
    limits_n = FRICTION * contact.normal_force(edges_m) + stiffnesses * reaches_m
    return np.diff(stiffnesses) / softness, np.diff(limits_n) * friction / (FRICTION * softness)


def zero_amplitude_m(
    feet: int, normal_n: float, load_n: float = 0.0, is_fast: bool = False
) -> float:
    """Return n d of a walker with slow or fast falls; ``load_n`` is F."""
    contact = contact_of('rough', normal_n)

    def left_n(d_m: float) -> float:
        pulls_n = 2.0 * sum(contact.pull(0.5 * k * d_m) for k in range(1, feet + is_fast))
        return pulls_n - feet * FRICTION * normal_n + load_n

    return feet * bisect(left_n, 0.0, 2.0 * float(contact.displacement(0.0)), xtol=1e-18)


@lru_cache(maxsize=32)
def run(case: Case, layout: Layout, mesh: Mesh) -> Array:
    """Return mean m, end m, friction loss J and work of the feet J of each cycle."""
    pairs = [
        springs_of(PRELOAD_N * share, mesh.springs, *stuff)
        for share, stuff in zip(layout.shares, layout.stuffs, strict=False)
    ]
    counts = np.array(layout.counts, dtype=np.float64)[:, None]
    stiffnesses, limits_n = (counts * np.array(each) for each in zip(*pairs, strict=True))
    gains, delays_s = M_PER_V * np.array(layout.gains), np.array(layout.delays) / case.frequency_hz
    fall_s = case.voltage_v / (case.slew_v_per_s + case.voltage_v * case.frequency_hz)
    fine_s, falls = max(FINE_PART_S, 1.5 * fall_s), len(set(layout.delays))
    parts_s = fall_s, fine_s - fall_s, 1.0 / (falls * case.frequency_hz) - fine_s
    steps = np.ceil(np.array(parts_s) / (mesh.fine_s, mesh.fine_s, mesh.coarse_s)).astype(int)
    steps_s, rows = np.tile(np.repeat(parts_s / steps, steps), falls), np.zeros((case.cycles, 4))
    sticks_n_per_m = float(stiffnesses.sum())
    lag_s = math.sqrt(MASS_KG * (sticks_n_per_m + case.cell_n_per_m)) / sticks_n_per_m
    lag_s *= case.loss_factor
    _step(case, lag_s, steps_s, gains, delays_s, stiffnesses, limits_n, rows)
    return rows


@compiled
def _step(
    case: Case, lag_s: float, steps_s: Array, gains: Array, delays_s: Array, stiffnesses: Array,
    limits_n: Array, rows: Array,
) -> None:  # fmt: skip
    """Step the runner, and fill the rows; a foot adds lag_s times the rate of its springs."""
    compliances, forces_n = 1.0 / stiffnesses, np.zeros(limits_n.shape)
    feet_m, feet_n = np.zeros((2, len(gains)))
    x, v, c, others_n = 0.0, 0.0, case.damping, case.load_n
    for cycle in range(len(rows)):
        t = mean_m = lost_j = work_j = 0.0
        for h in steps_s:
            t += h
            v += 0.5 * h * (others_n - c * v) / MASS_KG
            mean_m += h * case.frequency_hz * (x + 0.5 * h * v)
            x += h * v
            others_n = case.load_n - case.cell_n_per_m * x
            for g in range(len(gains)):
                since_s, falls = t - delays_s[g], cycle  # falls of this group so far
                if since_s < 0.0:
                    since_s, falls = since_s + 1.0 / case.frequency_hz, cycle - 1
                output_v = case.voltage_v * case.frequency_hz * since_s if falls >= 0 else 0.0
                if falls > 0:
                    output_v = max(output_v, case.voltage_v - case.slew_v_per_s * since_s)
                foot_m = gains[g] * output_v - feet_m[g]
                feet_m[g] += foot_m
                sum_n = sum_j = 0.0
                for j in range(limits_n.shape[1]):
                    wanted_n = forces_n[g, j] + stiffnesses[g, j] * (h * v - foot_m)
                    force_n = min(max(wanted_n, -limits_n[g, j]), limits_n[g, j])
                    sum_j += (wanted_n - force_n) * force_n * compliances[g, j]
                    forces_n[g, j] = force_n
                    sum_n += force_n
                lost_j += sum_j
                lag_n = lag_s * (sum_n - feet_n[g]) / h
                work_j -= (0.5 * (feet_n[g] + sum_n) + lag_n) * foot_m
                feet_n[g] = sum_n
                others_n -= sum_n + lag_n
            v = (v + 0.5 * h * others_n / MASS_KG) / (1.0 + 0.5 * h * c / MASS_KG)
        rows[cycle] = (mean_m, x, lost_j, work_j)


def numbers(case: Case, rows: Array) -> dict[str, float]:
    """Return the numbers of a case; columns of the rows are mean, end, loss and work."""
    mean_m, _, loss_j, work_j = map(float, rows[-case.last :].mean(axis=0))
    step_m = float(rows[-1, 1] - rows[-case.last - 1, 1]) / case.last
    found = {'layout_loss_j': loss_j, 'layout_work_j': work_j}
    if case.cell_n_per_m:
        return {'layout_force_n': case.cell_n_per_m * mean_m, **found}
    return {'layout_step_m': step_m, 'layout_mean_m': mean_m, **found}


def references(case: Case) -> Iterator[Reference]:
    """Make the references of a case."""
    coarse, fine = (numbers(case, run(case, LAYOUTS[case.layout], mesh)) for mesh in MESHES)
    changed = {k: v for k, v in case._asdict().items() if v != Case._field_defaults.get(k)}
    for quantity, value in fine.items():
        least = NO_STEP * M_PER_V * case.voltage_v if quantity == 'layout_step_m' else 0.0
        scale = max(abs(value), least)
        error = abs(value - coarse[quantity]) / scale
        yield Reference(
            'Layouts', quantity, case_of(changed), value, TOLERANCE, scale,
            f'steps of both; half its steps, twice its springs moved ours by {error:.0e}',
            f'springs, {MESHES[1].springs} a foot, steps of 10 and 50 ns', BY, NUMBA,
        )  # fmt: skip
