# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A drive whose friction ages, spring by spring: the slip speed of each is solved for in every step.

In a step h a spring that would be stretched to the force A slips at the speed s at which

    A - k h s = f_z (mu0 + a ln((s + v_c)/(v0 + v_c)) + b ln(v0 theta/D_c)),

with its age at the end, theta = (theta_before + h)/(1 + s h/D_c). Newton's method finds it. The
package has a closed form of the speed instead, fewer springs and steps 100 times as long.

"""

import math
from functools import lru_cache
from typing import Any, NamedTuple

import numba
import numpy as np

from evidence.closed_forms import E_STAR_PA, FRICTION, G_STAR_PA, Array
from evidence.group import NUMBA, Group
from evidence.spring_drive import (
    PAPER,
    PERIOD_S,
    SPRINGS,
    Values,
    mean_foot,
    springs_under,
    steps_of_a_cycle,
)
from stickslip_ros.lab.validation.drive import DRIVEN_CYCLES

compiled: Any = numba.njit

V0_M_PER_S, CUTOFF_M_PER_S = 1e-3, 1e-4
ITERATIONS = 30
EXACT = 1e-12
"""Change of ln(s + v_c) that ends Newton's method."""
UPPER, LOWER = 2, 4
"""Contacts of each kind."""
FREE: Values = {'load_cell.contact': 'absent', 'runner.damping': 20.0}
AGED: Values = {
    'contact.friction_rate': 0.01, 'contact.friction_ageing': 0.01, 'contact.rest_time': 100.0
}  # fmt: skip
CASES: tuple[dict[str, float | str], ...] = (
    {'voltage_v': 300.0, **FREE, **AGED},
    {'voltage_v': 300.0, **FREE, **AGED, 'contact.friction_rate': 0.0025},
    {'voltage_v': 300.0, **FREE, **AGED, 'contact.friction_rate': 0.0, 'stand.preload': 0.8},
    {'voltage_v': 300.0, **FREE, **AGED, 'contact.friction_distance': 1e-7},
    {'voltage_v': -300.0, **AGED, 'contact.friction_ageing': 0.0, 'stand.preload': 0.2},
)


def end_m(cycle: float, **case: Any) -> float:
    """Return the position of the runner at the end of a cycle."""
    return float(ends_m(**case)[round(cycle) - 1])


def largest_m(cycle: float, **case: Any) -> float:
    """Return the largest position of a run."""
    return float(np.abs(ends_m(**case)).max())


def ends_m(voltage_v: float, **changes: float | str) -> Array:
    """Return the position of the runner at the end of each cycle of a saw-tooth of 1 kHz."""
    return _ends_m(voltage_v, *changes.items())


@lru_cache(maxsize=8)
def _ends_m(voltage_v: float, *changes: tuple[str, float | str]) -> Array:
    values = PAPER | {'contact.friction_distance': 1e-6, 'contact.rest_time': 1.0} | dict(changes)
    steps_s = np.tile(steps_of_a_cycle(), DRIVEN_CYCLES)
    rows = [springs_under(values, PERIOD_S * np.ones(1), is_below) for is_below in (False, True)]
    counts = (UPPER, LOWER)
    widths_m = np.repeat([n * row.width_m for n, row in zip(counts, rows, strict=True)], SPRINGS)
    pressed_m = np.concatenate([row.depths_m[0] - row.heights_m for row in rows])
    widths_m, pressed_m = widths_m[pressed_m > 0.0], pressed_m[pressed_m > 0.0]
    ageing = Ageing(
        float(values['contact.friction_rate']),
        float(values['contact.friction_ageing']),
        float(values['contact.friction_distance']),
        float(values['contact.rest_time']),
    )
    runner = Runner(
        float(values['runner.mass']),
        float(values['runner.damping']),
        0.0 if values['load_cell.contact'] == 'absent' else float(values['load_cell.stiffness']),
    )
    positions_m = _slide(
        G_STAR_PA * widths_m,
        E_STAR_PA * widths_m * pressed_m,
        ageing,
        runner,
        mean_foot(values, voltage_v, steps_s),
        steps_s,
    )
    return positions_m[len(steps_s) // DRIVEN_CYCLES - 1 :: len(steps_s) // DRIVEN_CYCLES]


class Ageing(NamedTuple):
    """Rate a, ageing b, distance of renewal, and time of rest before; SI units."""

    a: float
    b: float
    distance_m: float
    rest_s: float


class Runner(NamedTuple):
    """Mass, damping, and stiffness of the cell; SI units."""

    mass_kg: float
    damping: float
    cell_n_per_m: float


@compiled
def _slide(
    n_per_m: Array, normal_n: Array, ageing: Ageing, runner: Runner, feet_m: Array, steps_s: Array
) -> Array:
    """Step the runner by velocity Verlet; return its position at the end of each step, m."""
    a, b, distance_m, rest_s = ageing
    mass_kg, damping, cell_n_per_m = runner
    forces_n, ages_s = np.zeros(len(normal_n)), np.full(len(normal_n), rest_s)
    positions_m = np.zeros(len(steps_s))
    x = v = u = pull_n = 0.0
    for i in range(len(steps_s)):
        h = steps_s[i]
        v += 0.5 * h * (-pull_n - damping * v) / mass_kg
        x += h * v
        moved_m, u = x - feet_m[i] - u, x - feet_m[i]
        pull_n = cell_n_per_m * x
        for j in range(len(forces_n)):
            wanted_n = forces_n[j] + n_per_m[j] * moved_m
            share = n_per_m[j] * h / normal_n[j]
            s = _slip_speed(abs(wanted_n) / normal_n[j], share, ages_s[j], h, a, b, distance_m)
            kept_n = abs(wanted_n) - n_per_m[j] * h * s
            forces_n[j] = kept_n if wanted_n > 0.0 else -kept_n
            ages_s[j] = (ages_s[j] + h) / (1.0 + s * h / distance_m)
            pull_n += forces_n[j]
        v = (v - 0.5 * h * pull_n / mass_kg) / (1.0 + 0.5 * h * damping / mass_kg)
        positions_m[i] = x
    return positions_m


@compiled
def _slip_speed(
    wanted: float, share: float, age_s: float, h: float, a: float, b: float, distance_m: float
) -> float:
    """Return s of wanted - share s = mu(s, theta), 0 if the spring sticks, m/s."""
    sticks = FRICTION + b * math.log(V0_M_PER_S * (age_s + h) / distance_m)
    sticks += a * math.log(CUTOFF_M_PER_S / (V0_M_PER_S + CUTOFF_M_PER_S))
    above = wanted - sticks
    if above <= 0.0:
        return 0.0
    # Unknown is y = ln((s + v_c)/v_c), from above: there the function is concave.
    y = math.log1p(above / (share * CUTOFF_M_PER_S))
    if a > 0.0:
        y = min(y, above / a)
    for _ in range(ITERATIONS):
        s = CUTOFF_M_PER_S * math.expm1(y)
        renewed = 1.0 + s * h / distance_m
        left = above - share * s - a * y + b * math.log(renewed)
        slope = (b * h / (distance_m * renewed) - share) * (s + CUTOFF_M_PER_S) - a
        change = left / slope
        y = max(y - change, 0.0)
        if abs(change) < EXACT:
            break
    return CUTOFF_M_PER_S * math.expm1(y)


SOURCE = 'a slip speed solved for in each of 2 x 400 springs, steps of 20 and 250 ns'
ERROR = 1e-3, 'of the largest; our 128 springs: seen 5.1e-4'
GROUPS = [
    Group(
        'Friction that ages', 'drive_end_m', end_m, ERROR, SOURCE, 'test/evidence/ageing.py',
        [{**case, 'cycle': cycle} for case in CASES for cycle in (1, 2, DRIVEN_CYCLES)],
        largest_m, NUMBA, is_slow=True,
    )
]  # fmt: skip
