# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Roughness that travels, spring by spring: its line wave by wave, and a drive that slips along it.

The recipe of docs/explanation/travel.md is written out anew; random numbers and the width of a
window, at whose first spring phases begin, are the package's. Springs follow the line while they
slip: the window moves with the runner in every step in which all of them do, at any fraction of a
spring, where the package moves it once, to a whole spring, when the slip is over.

"""

from functools import lru_cache
from itertools import pairwise
from typing import Any, NamedTuple

import numba
import numpy as np

from evidence.closed_forms import (
    E_STAR_PA,
    FRICTION,
    G_STAR_PA,
    HURST,
    LIMIT_PER_PRELOAD,
    LOWER_SHARE,
    RADIUS_M,
    RMS_HEIGHT_M,
    UPPER_SHARE,
    Array,
)
from evidence.group import NUMBA, Group, grid
from evidence.spring_drive import PAPER, PERIOD_S, CycleMotion, mean_foot, steps_of_a_cycle
from evidence.springs import pressed_depth
from stickslip_ros.contact.hemisphere import lines_of
from stickslip_ros.lab.validation.drive import DRIVEN_CYCLES
from stickslip_ros.parameters import Parameters

compiled: Any = numba.njit

SHARES = (*[UPPER_SHARE] * 2, *[LOWER_SHARE] * 4)
SEED, STREAM, BINS, FEET = 1, 41, 384, 6
LENGTH_M = 1e-3
DEFAULT = (1 << 17, 1e8)
"""Points of the line of the default stand, and its upper cut-off, rad/m."""
COARSE: dict[str, float | str] = {
    'contact.profile': 'rough_line', 'contact.travel': 1.0, 'contact.line_points': 1 << 14,
    'contact.cutoff_upper': 2e7, 'load_cell.contact': 'absent', 'runner.damping': 40.0,
}  # fmt: skip
"""A free runner on an eighth of the springs."""
FINER = 4
"""Heights between two springs, on which those at a fraction of a spring are interpolated."""
FARTHEST = 64
"""Springs by which a window of the drive moves at most, either way."""


class Line(NamedTuple):
    """Waves of the runner's line, each foot's phases, and what stays under each foot, m."""

    spacing_m: float
    amplitudes_m: Array
    turns: Array
    phases: Array
    fixed_m: Array

    def heights(self, foot: int, springs: Array) -> Array:
        """Return the heights of the runner's line at numbers of springs, whole or not, m."""
        heights_m = np.zeros(len(springs))
        for amplitude_m, turn, phase in zip(
            self.amplitudes_m, self.turns, self.phases[foot], strict=True
        ):
            heights_m += amplitude_m * np.cos(phase + turn * springs)
        return heights_m


@lru_cache(maxsize=4)
def line_of(travel: float, line_points: float, cutoff_upper: float) -> Line:
    """Return the line of the default seed."""
    points, spacing_m = round(line_points), LENGTH_M / line_points
    modes = np.arange(1, int(cutoff_upper * LENGTH_M / (2.0 * np.pi) * (1.0 + 1e-9)) + 1)
    power_m2 = modes ** (-2.0 * HURST - 1.0)
    power_m2 *= RMS_HEIGHT_M**2 / power_m2.sum()
    last = len(modes)
    edges = sorted({round(edge) for edge in (1.0 + last) ** (np.arange(BINS + 1) / BINS)})
    shares = np.random.default_rng((SEED, STREAM, 0)).uniform(size=len(edges) - 1)
    amplitudes_m, turns = np.zeros((2, len(shares)))
    for k, (start, end) in enumerate(pairwise(edges)):
        amplitudes_m[k] = np.sqrt(2.0 * travel * power_m2[start - 1 : end - 1].sum())
        low, high = max(start - 0.5, 1.0), min(end - 0.5, last)
        turns[k] = 2.0 * np.pi * (low + shares[k] * (high - low)) / points
    phases = np.random.default_rng((SEED, STREAM, 1)).uniform(0.0, 2.0 * np.pi, (FEET, BINS))
    case: dict[str, Any] = {'contact.travel': travel, 'contact.line_points': points}
    case |= {'contact.cutoff_upper': cutoff_upper, 'contact.profile': 'rough_line'}
    springs = int(lines_of(Parameters().updated(case).contact).springs)
    numbers = np.arange(springs) - 0.5 * (springs - 1)
    fixed_m = np.tile((spacing_m * numbers) ** 2 / RADIUS_M, (FEET, 1))
    for foot in range(FEET):
        angles = np.random.default_rng(SEED + foot).uniform(0.0, 2.0 * np.pi, points // 2 + 1)
        waves_m = np.zeros(points // 2 + 1, complex)
        waves_m[1 : last + 1] = np.sqrt(0.5 * power_m2) * np.exp(1j * angles[1 : last + 1])
        own_m = points * np.fft.irfft(waves_m, points)
        middle = (points - springs) // 2
        fixed_m[foot] += np.sqrt(1.0 - travel) * own_m[middle : middle + springs]
    return Line(spacing_m, amplitudes_m, turns, phases[:, : len(turns)], fixed_m)


@lru_cache(maxsize=8)
def limits_at(place: float, preload_n: float, travel: float) -> Array:
    """Return the forces at which the springs of all feet slip where windows are at a place, N."""
    line = line_of(travel, *DEFAULT)
    limits_n = []
    for foot, share in enumerate(SHARES):
        fixed_m = line.fixed_m[foot]
        heights_m = fixed_m + line.heights(foot, np.arange(len(fixed_m), dtype=np.float64) - place)
        heights_m -= heights_m.min()
        depth_m = pressed_depth(heights_m, line.spacing_m, share * preload_n)
        pressed_m = depth_m - heights_m[heights_m < depth_m]
        limits_n.append(FRICTION * E_STAR_PA * line.spacing_m * pressed_m)
    return np.concatenate(limits_n)


def virgin_n(place: float, preload_n: float, travel: float, displacement_m: float) -> float:
    """Return the force of all springs that are pulled from rest."""
    stretched_n = G_STAR_PA * line_of(travel, *DEFAULT).spacing_m * displacement_m
    return float(np.sum(np.minimum(limits_at(place, preload_n, travel), stretched_n)))


def motion(voltage_v: float, **changes: float | str) -> CycleMotion:
    """Run a case, whose changes are those of COARSE and some more."""
    return _motion(voltage_v, *changes.items())


@lru_cache(maxsize=8)
def _motion(voltage_v: float, *changes: tuple[str, float | str]) -> CycleMotion:
    values = dict(changes)
    points, cutoff, travel, damping = (
        float(values[name])
        for name in (
            'contact.line_points', 'contact.cutoff_upper', 'contact.travel', 'runner.damping'
        )
    )  # fmt: skip
    line = line_of(travel, points, cutoff)
    springs = line.fixed_m.shape[1]
    fine = np.arange(-FARTHEST * FINER, (springs + FARTHEST) * FINER + 1, dtype=np.float64) / FINER
    lines_m = np.array([line.heights(foot, fine) for foot in range(FEET)])
    steps_s = np.tile(steps_of_a_cycle(), DRIVEN_CYCLES)
    preload_n = float(values.get('stand.preload', PAPER['stand.preload']))
    sums = np.zeros((DRIVEN_CYCLES, 2))
    lost_j = _slide(
        lines_m, line.fixed_m, line.spacing_m, preload_n * np.array(SHARES),
        (damping, float(PAPER['runner.mass'])), mean_foot(PAPER, voltage_v, steps_s),
        steps_s, sums,
    )  # fmt: skip
    return CycleMotion(sums[:, 0] / PERIOD_S, sums[:, 1], lost_j)


@compiled
def _slide(
    lines_m: Array,
    fixed_m: Array,
    spacing_m: float,
    normal_n: Array,
    runner: tuple[float, float],
    feet_m: Array,
    steps_s: Array,
    sums: Array,
) -> float:
    """Step a runner of a damping and a mass; return the friction loss, J, and fill the sums."""
    damping, mass_kg = runner
    springs, shear = fixed_m.shape[1], G_STAR_PA * spacing_m
    forces_n, limits_n = np.zeros((2, FEET, springs))
    heights_m = np.zeros(springs)
    depths_m = np.full(FEET, spacing_m)
    x = v = u = pull_n = lost_j = time_s = 0.0
    cycle, moves = 0, True
    for i in range(len(steps_s)):
        h = steps_s[i]
        v += 0.5 * h * (-pull_n - damping * v) / mass_kg
        sums[cycle, 0] += 0.5 * h * x
        x += h * v
        sums[cycle, 0] += 0.5 * h * x
        moved_m = x - feet_m[i] - u
        u += moved_m
        if moves:  # the window goes to the place u
            start = FINER * (FARTHEST - u / spacing_m)
            whole = int(np.floor(start))
            share = start - whole
            for foot in range(FEET):
                for j in range(springs):
                    k = whole + FINER * j
                    line_m = (1.0 - share) * lines_m[foot, k] + share * lines_m[foot, k + 1]
                    heights_m[j] = fixed_m[foot, j] + line_m
                heights_m -= heights_m.min()
                total_m, count, before = normal_n[foot] / (E_STAR_PA * spacing_m), 0, -1
                while count != before:
                    before, count, sum_m = count, 0, 0.0
                    for j in range(springs):
                        if heights_m[j] < depths_m[foot]:
                            count, sum_m = count + 1, sum_m + heights_m[j]
                    depths_m[foot] = (total_m + sum_m) / count
                for j in range(springs):
                    pressed_m = max(depths_m[foot] - heights_m[j], 0.0)
                    limits_n[foot, j] = FRICTION * E_STAR_PA * spacing_m * pressed_m
        pull_n, moves = 0.0, True
        for foot in range(FEET):
            for j in range(springs):
                limit_n = limits_n[foot, j]
                if limit_n > 0.0 or forces_n[foot, j] != 0.0:
                    wanted_n = forces_n[foot, j] + shear * moved_m
                    force_n = min(max(wanted_n, -limit_n), limit_n)
                    lost_j += (wanted_n - force_n) * force_n / shear
                    moves = moves and force_n == np.copysign(limit_n, moved_m)
                    forces_n[foot, j] = force_n
                    pull_n += force_n
        v = (v - 0.5 * h * pull_n / mass_kg) / (1.0 + 0.5 * h * damping / mass_kg)
        time_s += h
        if time_s >= PERIOD_S - 0.5 * h:
            sums[cycle, 1] = x
            cycle, time_s = cycle + 1, 0.0
    return lost_j


FAMILY, BY = 'Travelling roughness', 'test/evidence/travelling.py'
PLACES = (0, 5_000, -131_072, 600_000)
"""Springs; the last is 4.6 mm away, the travel of the stand is 5."""
TABLE = 1e-5, 'of mu 2 sqrt2 F_p: springs are counted up to half a cell of the table off'
SOURCE = 'springs that follow the line while they slip, steps of 20 and 250 ns'
WAY = 1.5e-4, 'of the largest: windows at whole springs, 61 nm; its steps; seen 8e-5'
LOSS = 5e-4, 'windows that jump to where a slip ends; its steps: 4e-5 with a quarter'
VOLTAGE_V = 280.0
CASES: tuple[dict[str, float | str], ...] = (
    {'voltage_v': VOLTAGE_V, **COARSE},
    {'voltage_v': -VOLTAGE_V, **COARSE},
    {'voltage_v': VOLTAGE_V, **COARSE, 'contact.travel': 0.5},
    {'voltage_v': VOLTAGE_V, **COARSE, 'runner.damping': 150.0, 'stand.preload': 0.1},
)


def limit_n(preload_n: float, **_: object) -> float:
    """Return mu 2 sqrt2 F_p."""
    return LIMIT_PER_PRELOAD * preload_n


def end_m(cycle: float, **case: Any) -> float:
    """Return the position at the end of a cycle."""
    return float(motion(**case).ends_m[round(cycle) - 1])


def largest_m(cycle: float, **case: Any) -> float:
    """Return the largest of these."""
    return float(np.abs(motion(**case).ends_m).max())


GROUPS = [
    Group(
        FAMILY, 'travel_force_n', virgin_n, TABLE, 'all springs of six lines', BY,
        [
            *grid(place=PLACES, preload_n=[0.5], travel=[1.0], displacement_m=[2e-8]),
            *grid(place=PLACES[1:2], preload_n=[0.1, 1.0], travel=[0.5], displacement_m=[2e-8]),
        ],
        limit_n, is_slow=True,
    ),
    Group(
        FAMILY, 'drive_end_m', end_m, WAY, SOURCE, BY,
        [{**case, 'cycle': cycle} for case in CASES for cycle in (4, DRIVEN_CYCLES)],
        largest_m, NUMBA, is_slow=True,
    ),
    Group(
        FAMILY, 'drive_loss_j', lambda **case: motion(**case).lost_j, LOSS, SOURCE, BY, CASES,
        version=NUMBA, is_slow=True,
    ),
]  # fmt: skip
