# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The algorithm of the paper (Section 3.4) for the whole drive: rows of springs, small time steps.

It shares no code with the drive that it checks, and is written plainly: the voltage stage by stage
on one grid of times, springs at equal distances under each contact, each of which sticks or slips
in every step, and velocity Verlet. Width of a spring and length of a step make the difference to
the equations.

"""

import math
from collections.abc import Mapping
from functools import lru_cache
from typing import Any, NamedTuple, TypeAlias

import numba
import numpy as np
from scipy.optimize import bisect

from evidence.closed_forms import (
    E_STAR_PA,
    FRICTION,
    G_STAR_PA,
    LOWER_SHARE,
    TERMS,
    UPPER_SHARE,
    Array,
    PowerContact,
    Terms,
    height,
)
from evidence.group import NUMBA, Group
from stickslip_ros.drive.layout import gain_ratios
from stickslip_ros.lab.validation.drive import DRIVEN_CYCLES
from stickslip_ros.parameters import Parameters

compiled: Any = numba.njit

PERIOD_S = 1e-3
FINE_S, COARSE_S = 20e-9, 250e-9
"""Steps in the first part of a cycle, with the fall and what rings after it, and in the rest."""
FINE_PART_S = 60e-6
SPRINGS = 400
"""From the middle of a contact to its edge under the largest preload."""
EDGE = 1.01
"""A row of springs ends a little beyond that edge."""
RADIUS_MAX_M = 1e-4
GRAVITY_M_PER_S2 = 9.80665
BELOW = (0.0, 0.0, 1.0, 1.0, 1.0, 1.0)
"""Whether a foot is one of the lower ones, which also carry the weight."""
TAUS_S = tuple(10.0**k for k in range(-2, 4))
"""Time constants of creep."""

Values: TypeAlias = Mapping[str, float | str]
"""Values of parameters by their full names, SI."""
PAPER: dict[str, float | str] = {
    'actuator.mass': 0.0,
    'actuator.creep': 0.0,
    'actuator.damping_ratio': 0.05,
    'actuator.gain': 160e-9 / 300.0,
    'actuator.hysteresis': 0.0,
    'actuator.plays': 8,
    'actuator.resonance': 0.0,
    'actuator.stiffness': 0.0,
    'amplifier.bandwidth': 0.0,
    'amplifier.resolution': 0.0,
    'amplifier.current_max': 0.75,  # 150 V/us into PIEZOS_F
    'contact.loss_factor': 0.0,
    'contact.profile': 'rough',
    'frame.damping_ratio': 0.01,
    'frame.mass': 0.0,
    'frame.resonance': 0.0,
    'load_cell.contact': 'attached',
    'load_cell.damping_ratio': 0.1,
    'load_cell.gap': 0.0,
    'load_cell.resonance': 0.0,
    'load_cell.stiffness': 1e5,
    'runner.damping': 0.0,
    'runner.mass': 3e-3,
    'stand.preload': 0.5,
    'stand.preload_end': 0.0,
    'stand.preload_rate': 1.0,
    'stand.weight': 0.0,
}
"""The drive of the paper, and what the package assumes: what a case does not change."""
RANGE_V, PIEZOS_F = 300.0, 5e-9


class CycleMotion(NamedTuple):
    """Position of the runner, mean over each cycle and at its end, and the friction loss."""

    means_m: Array
    ends_m: Array
    lost_j: float


def run_springs(
    changes: Values, voltage_v: float, cycles: int, load_n: float, ratios: Array
) -> CycleMotion:
    """
    Run a drive, changed from PAPER, from rest under a saw-tooth of 1 kHz, backwards below 0 V.

    ``ratios`` are displacements of the feet per that of the mean foot, the two upper ones first.

    """
    values = PAPER | dict(changes)
    steps_s = np.tile(steps_of_a_cycle(), cycles)
    kinds, counts = np.unique(np.column_stack((BELOW, ratios)), axis=0, return_counts=True)
    rows = [springs_under(values, np.cumsum(steps_s), bool(is_below)) for is_below, _ in kinds]
    joint = values['load_cell.contact']
    cell_kg = cell_n_s_per_m = 0.0
    if values['load_cell.resonance'] and joint == 'attached':
        cell_per_s = 2.0 * math.pi * float(values['load_cell.resonance'])
        cell_kg = float(values['load_cell.stiffness']) / cell_per_s**2
        cell_n_s_per_m = 2.0 * float(values['load_cell.damping_ratio']) * cell_per_s * cell_kg
    runner = Runner(
        float(values['runner.mass']) + cell_kg,
        float(values['runner.damping']) + cell_n_s_per_m,
        0.0 if joint == 'absent' else float(values['load_cell.stiffness']),
        joint == 'attached',
        float(values['load_cell.gap']),
        load_n,
        0.0,
    )
    stick_n_per_m = 2.0 * G_STAR_PA * sum(map(_stick_radius, [values] * 6, BELOW))
    held_n_per_m = stick_n_per_m + runner.is_fixed * runner.cell_n_per_m
    lag_s = float(values['contact.loss_factor']) * math.sqrt(held_n_per_m * runner.mass_kg)
    runner = runner._replace(lag_s=lag_s / stick_n_per_m)
    foot_per_s = 2.0 * math.pi * float(values['actuator.resonance'])
    foot_kg, stack_n_per_m = float(values['actuator.mass']), float(values['actuator.stiffness'])
    if stack_n_per_m:
        foot_kg = stack_n_per_m / foot_per_s**2
    frame_kg, frame_per_s = (
        float(values['frame.mass']),
        2.0 * math.pi * float(values['frame.resonance']),
    )
    frame = Frame(
        1.0 / frame_kg if frame_kg else 0.0,
        frame_per_s,
        2.0 * float(values['frame.damping_ratio']) * frame_per_s,
        6.0 * foot_kg / frame_kg if frame_kg else 0.0,
    )
    sums = np.zeros((cycles, 2))
    stack = Stack(
        stack_n_per_m > 0.0,
        foot_kg,
        foot_per_s,
        2.0 * float(values['actuator.damping_ratio']) * foot_per_s,
    )
    feet_m = mean_foot(values, voltage_v, steps_s)
    lost_j = _step(
        runner,
        frame,
        stack,
        FootMotion(steps_s, feet_m, np.outer(feet_m, kinds[:, 1])),
        FootSprings(
            counts.astype(np.float64),
            np.array([row.heights_m for row in rows]),
            np.array([row.width_m for row in rows]) * counts,
            np.stack([row.depths_m for row in rows], axis=1),
        ),
        sums,
    )
    return CycleMotion(sums[:, 0] / PERIOD_S, sums[:, 1], lost_j)


def steps_of_a_cycle() -> Array:
    """Return the lengths of the time steps of a cycle, s."""
    fine = round(FINE_PART_S / FINE_S)
    coarse = round((PERIOD_S - FINE_PART_S) / COARSE_S)
    return np.concatenate((np.full(fine, FINE_S), np.full(coarse, COARSE_S)))


def mean_foot(values: Values, voltage_v: float, steps_s: Array) -> Array:
    """Return the displacement of the mean foot at the end of each step, m."""
    cycle_s = steps_of_a_cycle()
    phase = np.tile(np.cumsum(cycle_s) / PERIOD_S, len(steps_s) // len(cycle_s))
    rest_v = max(-voltage_v, 0.0)
    signal = rest_v + voltage_v * phase
    level_v = float(values['amplifier.resolution'])
    if level_v:
        signal = np.round(signal / level_v) * level_v
    signal = _slew(signal, rest_v, float(values['amplifier.current_max']) / PIEZOS_F * steps_s)
    if values['amplifier.bandwidth']:
        tau_s = 1.0 / (2.0 * math.pi * float(values['amplifier.bandwidth']))
        signal = _lag(signal, rest_v, tau_s, steps_s)
    gain = float(values['actuator.gain'])
    if values['actuator.hysteresis']:
        foot_m = gain * _hysteresis(values, signal, rest_v)
    else:
        foot_m = gain * (signal - rest_v)
    if values['actuator.creep']:
        crept = sum(_lag(foot_m, 0.0, tau_s, steps_s) for tau_s in TAUS_S)
        foot_m = foot_m + float(values['actuator.creep']) * crept
    if values['actuator.resonance'] and not values['actuator.stiffness']:
        omega_per_s = 2.0 * math.pi * float(values['actuator.resonance'])
        foot_m = _ring(foot_m, omega_per_s, float(values['actuator.damping_ratio']), steps_s)
    return foot_m


def _slew(wanted: Array, start: float, most: Array) -> Array:
    """Return an output that follows a signal by so much at most in each step."""
    now, followed = start, []
    for target, change in zip(wanted.tolist(), most.tolist(), strict=True):
        now += min(max(target - now, -change), change)
        followed.append(now)
    return np.array(followed)


def _lag(signal: Array, start: float, tau_s: float, steps_s: Array) -> Array:
    """Return tau y' = signal - y by the trapezoidal rule."""
    now, before, lagging = start, start, []
    shares = (steps_s / (tau_s + 0.5 * steps_s)).tolist()
    for value, share in zip(signal.tolist(), shares, strict=True):
        now += share * (0.5 * (before + value) - now)
        before = value
        lagging.append(now)
    return np.array(lagging)


def _hysteresis(values: Values, voltages_v: Array, rest_v: float) -> Array:
    """Return plays and linear part together, V from rest, as the page physics.md has them."""
    n = int(values['actuator.plays'])
    weight = float(values['actuator.hysteresis']) * (n + 1) / ((n + 1) ** 2 // 4)
    total_v = (1.0 - 0.5 * weight * n) * (voltages_v - rest_v)
    for j in range(1, n + 1):
        half_v = 0.5 * RANGE_V * j / (n + 1)
        start_v = now_v = min(rest_v + half_v, RANGE_V - half_v)
        followed = []
        for voltage_v in voltages_v.tolist():
            now_v = min(max(now_v, voltage_v - half_v), voltage_v + half_v)
            followed.append(now_v - start_v)
        total_v = total_v + weight * np.array(followed)
    return total_v


def _ring(drive_m: Array, omega_per_s: float, damping_ratio: float, steps_s: Array) -> Array:
    """Return y'' + 2 D w y' + w^2 y = w^2 x by velocity Verlet."""
    place_m = speed_m_per_s = before_m = 0.0
    drag_per_s, stiff_per_s2, rung = 2.0 * damping_ratio * omega_per_s, omega_per_s**2, []
    for driven_m, h_s in zip(drive_m.tolist(), steps_s.tolist(), strict=True):
        pull = stiff_per_s2 * (before_m - place_m) - drag_per_s * speed_m_per_s
        speed_m_per_s += 0.5 * h_s * pull
        place_m += h_s * speed_m_per_s
        speed_m_per_s += 0.5 * h_s * stiff_per_s2 * (driven_m - place_m)
        speed_m_per_s /= 1.0 + 0.5 * h_s * drag_per_s
        before_m = driven_m
        rung.append(place_m)
    return np.array(rung)


class Row(NamedTuple):
    """The springs under a foot."""

    heights_m: Array  # heights g of the springs on both sides of the middle, (SPRINGS,)
    width_m: float  # width dx of a spring, of both sides together
    depths_m: Array  # depth after each step; it carries the normal force of Eq. 19, (steps,)


def springs_under(values: Values, ends_s: Array, is_below: bool) -> Row:
    """Return the springs under an upper or a lower foot, and their depths while time runs."""
    start_n, end_n = float(values['stand.preload']), float(values['stand.preload_end'])
    loads_n = np.full_like(ends_s, start_n)
    if end_n:
        most_n = float(values['stand.preload_rate']) * ends_s
        loads_n += np.clip(end_n - start_n, -most_n, most_n)
    if is_below and values['stand.weight']:
        loads_n += float(values['runner.mass']) * GRAVITY_M_PER_S2
    normal_n = (LOWER_SHARE if is_below else UPPER_SHARE) * loads_n
    terms = TERMS[str(values['contact.profile'])]
    width_m = EDGE * _radius(terms, float(normal_n.max())) / SPRINGS
    heights_m = height(terms, width_m * (np.arange(SPRINGS, dtype=np.float64) + 0.5))
    pressed_m = np.arange(SPRINGS) * heights_m - (np.cumsum(heights_m) - heights_m)
    corners_n = 2.0 * E_STAR_PA * width_m * pressed_m
    return Row(heights_m, 2.0 * width_m, np.interp(normal_n, corners_n, heights_m))


def _stick_radius(values: Values, is_below: float) -> float:
    """Return the radius of an upper or a lower contact under the first preload, m."""
    share = LOWER_SHARE if is_below else UPPER_SHARE
    return _radius(TERMS[str(values['contact.profile'])], share * float(values['stand.preload']))


def _radius(terms: Terms, normal_n: float) -> float:
    """Return the contact radius of a normal force, m."""
    contact = PowerContact(terms, RADIUS_MAX_M)
    return float(bisect(lambda a: float(contact.normal_force(a)) - normal_n, 0.0, RADIUS_MAX_M))


class Runner(NamedTuple):
    """
    Of Eq. 20: m, c, k, whether it is fixed to the cell or a way off, F_ext; SI units.

    A contact acts with its springs plus lag_s times the rate of their force.

    """

    mass_kg: float
    damping_n_s_per_m: float
    cell_n_per_m: float
    is_fixed: bool
    gap_m: float
    load_n: float
    lag_s: float


class Stack(NamedTuple):
    """Under each foot: its mass, angular frequency and damping; whether there is one."""

    exists: bool
    foot_kg: float
    omega_per_s: float
    damping_per_s: float


class Frame(NamedTuple):
    """Inverse of its mass with the feet, angular frequency, damping, share of the feet."""

    per_kg: float
    omega_per_s: float
    damping_per_s: float
    feet_share: float


class FootMotion(NamedTuple):
    """Steps of time, the mean of the feet at their ends, and each kind of foot, (steps, kinds)."""

    steps_s: Array
    mean_m: Array
    feet_m: Array


class FootSprings(NamedTuple):
    """Feet of each kind, heights and widths of their springs, and depths, (steps, kinds)."""

    counts: Array
    heights_m: Array
    widths_m: Array
    depths_m: Array


@compiled
def _step(  # noqa: PLR0915 - the algorithm in one piece
    runner: Runner,
    frame: Frame,
    stack: Stack,
    motion: FootMotion,
    springs: FootSprings,
    sums: Array,
) -> float:
    """
    Step the runner; return the friction loss, J.

    ``sums`` receives the integral of the position over each cycle and the position at its end.

    """
    counts, heights_m, widths_m, depths_m = springs
    places_m, forces_n = np.zeros(len(counts)), np.zeros(heights_m.shape)  # of feet and springs
    m, c, h_sum, cycle = runner.mass_kg, runner.damping_n_s_per_m, 0.0, 0
    x = v = contact_n = lost_j = centre_m = centre_w = frame_m = foot_w = 0.0
    z, z_w, loads_n, springs_n = np.zeros((4, len(places_m)))
    stiff = stack.omega_per_s**2
    others_n = runner.load_n
    for i in range(len(motion.steps_s)):
        h = motion.steps_s[i]
        v += 0.5 * h * (others_n - contact_n - c * v) / m
        sums[cycle, 0] += 0.5 * h * x
        x += h * v
        sums[cycle, 0] += 0.5 * h * x
        # Frame and feet: their centre of mass answers to the contacts and to the table.
        pull = contact_n * frame.per_kg - frame.omega_per_s**2 * frame_m
        swing = centre_w - frame.feet_share * foot_w
        centre_w += 0.5 * h * (pull - frame.damping_per_s * swing)
        centre_m += h * centre_w
        foot_w = (motion.mean_m[i] - (motion.mean_m[i - 1] if i else 0.0)) / h
        mean_z = motion.mean_m[i]
        if stack.exists:
            drive_m = motion.feet_m[i - 1] if i else np.zeros(len(z))
            pulls = stiff * (drive_m - z) - stack.damping_per_s * z_w + loads_n / stack.foot_kg
            pull -= frame.damping_per_s * swing
            recoil = pull - frame.feet_share * np.sum(counts * pulls) / 6.0
            z_w += 0.5 * h * (pulls - recoil / (1.0 - frame.feet_share))
            z += h * z_w
            mean_z, foot_w = np.sum(counts * z) / 6.0, np.sum(counts * z_w) / 6.0
        frame_m = centre_m - frame.feet_share * mean_z
        contact_n = 0.0
        for foot in range(len(places_m)):
            place_m = z[foot] if stack.exists else motion.feet_m[i, foot]
            moved_m = x - frame_m - place_m - places_m[foot]
            force_of_foot_n = 0.0
            places_m[foot] += moved_m
            shear = G_STAR_PA * widths_m[foot]
            for j in range(heights_m.shape[1]):
                pressed_m = max(depths_m[i, foot] - heights_m[foot, j], 0.0)
                limit_n = FRICTION * E_STAR_PA * widths_m[foot] * pressed_m
                wanted_n = forces_n[foot, j] + shear * moved_m
                force_n = min(max(wanted_n, -limit_n), limit_n)
                lost_j += (wanted_n - force_n) * force_n / shear
                forces_n[foot, j] = force_n
                force_of_foot_n += force_n
            lag_n = runner.lag_s * (force_of_foot_n - springs_n[foot]) / h
            springs_n[foot] = force_of_foot_n
            contact_n += force_of_foot_n + lag_n
            loads_n[foot] = (force_of_foot_n + lag_n) / counts[foot]
        cell_m = x if runner.is_fixed else max(x - runner.gap_m, 0.0)
        others_n = runner.load_n - runner.cell_n_per_m * cell_m
        pull = contact_n * frame.per_kg - frame.omega_per_s**2 * frame_m
        if stack.exists:
            pulls = (
                stiff * (motion.feet_m[i] - z)
                - stack.damping_per_s * z_w
                + loads_n / stack.foot_kg
            )
            swing = centre_w - frame.feet_share * foot_w
            recoil = pull - frame.damping_per_s * swing
            recoil -= frame.feet_share * np.sum(counts * pulls) / 6.0
            pulls += stack.damping_per_s * z_w - recoil / (1.0 - frame.feet_share)
            z_w = (z_w + 0.5 * h * pulls) / (1.0 + 0.5 * h * stack.damping_per_s)
            foot_w = np.sum(counts * z_w) / 6.0
        pull += frame.damping_per_s * frame.feet_share * foot_w
        centre_w = (centre_w + 0.5 * h * pull) / (1.0 + 0.5 * h * frame.damping_per_s)
        v = (v + 0.5 * h * (others_n - contact_n) / m) / (1.0 + 0.5 * h * c / m)
        h_sum += h
        if h_sum >= PERIOD_S - 0.5 * h:
            sums[cycle, 1] = x
            cycle, h_sum = cycle + 1, 0.0
    return lost_j


FAMILY, BY = 'Drive', 'test/evidence/spring_drive.py'
SOURCE = f'springs, 2 x {SPRINGS} a contact, steps of 20 and 250 ns'
ERROR = 5e-4, 'its steps; our springs on ramps: seen 4.7e-4 with a coarse converter, else 3.4e-4'
OF_LARGEST = ERROR[0], f'of the largest; {ERROR[1]}'
VOLTAGE_V = 243.75
"""130 nm."""
FREE: Values = {'load_cell.contact': 'absent'}
ONE_SIDED: Values = {'load_cell.contact': 'one_sided', 'load_cell.gap': 1e-7}
RISES: Values = {'stand.preload': 0.3, 'stand.preload_end': 1.0, 'stand.preload_rate': 100.0}
FALLS: Values = {'stand.preload': 1.0, 'stand.preload_end': 0.3, 'stand.preload_rate': 100.0}
STACKS: Values = {
    'actuator.stiffness': 3.5e7, 'actuator.resonance': 1.5e5, 'actuator.damping_ratio': 0.1
}  # fmt: skip
FRAME: Values = {
    'frame.mass': 0.015, 'frame.resonance': 1e4, 'frame.damping_ratio': 0.05, 'actuator.mass': 2e-4
}  # fmt: skip
LIGHT: Values = {
    'actuator.resonance': 5e4, 'frame.mass': 0.01, 'frame.resonance': 1e4, 'sim.dt': 1e-6
}  # fmt: skip
"""A frame of which the feet are a fifth; the default step of the drive errs by 1.2e-3 there."""
CASES: tuple[dict[str, float | str], ...] = (
    {'voltage_v': VOLTAGE_V},
    {'voltage_v': -VOLTAGE_V},
    {'voltage_v': VOLTAGE_V, 'contact.profile': 'smooth'},
    {'voltage_v': VOLTAGE_V, 'runner.damping': 80.0},
    {'voltage_v': VOLTAGE_V, 'load_n': -0.05},
    {'voltage_v': VOLTAGE_V, **ONE_SIDED},
    {'voltage_v': VOLTAGE_V, **FREE},
    {'voltage_v': -VOLTAGE_V, **FREE},
    {'voltage_v': VOLTAGE_V, 'load_n': -0.02, **FREE},
    {'voltage_v': VOLTAGE_V, 'stand.weight': 1.0, 'stand.preload': 0.1},
    {'voltage_v': VOLTAGE_V, **RISES},
    {'voltage_v': VOLTAGE_V, **FALLS},
    {'voltage_v': VOLTAGE_V, 'actuator.gain_tolerance': 0.2},
    {'voltage_v': VOLTAGE_V, 'amplifier.current_max': 0.125},
    {'voltage_v': VOLTAGE_V, 'amplifier.resolution': 5.0},
    {'voltage_v': VOLTAGE_V, 'amplifier.bandwidth': 5e4},
    {'voltage_v': VOLTAGE_V, 'actuator.hysteresis': 0.15},
    {'voltage_v': VOLTAGE_V, 'actuator.creep': 0.05},
    {'voltage_v': VOLTAGE_V, 'actuator.resonance': 1.5e5, 'actuator.damping_ratio': 0.1},
    {'voltage_v': VOLTAGE_V, **FRAME, 'frame.mass': 0.03, 'actuator.mass': 5e-4},
    {'voltage_v': -VOLTAGE_V, **FRAME, **FREE},
    {'voltage_v': VOLTAGE_V, **FRAME, **ONE_SIDED},
    {'voltage_v': VOLTAGE_V, 'load_cell.resonance': 1.5e3},
    {'voltage_v': VOLTAGE_V, **STACKS},
    {'voltage_v': VOLTAGE_V, **STACKS, 'actuator.stiffness': 9e6, 'actuator.damping_ratio': 0.3},
    {'voltage_v': -VOLTAGE_V, **STACKS, 'frame.mass': 0.01, 'frame.resonance': 5e3},
    {'voltage_v': VOLTAGE_V, **STACKS, **LIGHT},
    {'voltage_v': VOLTAGE_V, **STACKS, **LIGHT, **FREE},
    {'voltage_v': VOLTAGE_V, 'actuator.gain_tolerance': 0.2, 'contact.loss_factor': 0.1},
    {'voltage_v': -VOLTAGE_V, **FRAME, **FREE, 'contact.loss_factor': 0.1},
    {'voltage_v': VOLTAGE_V, **STACKS, **LIGHT, 'contact.loss_factor': 0.1},
)


def motion(voltage_v: float, load_n: float = 0.0, **changes: float | str) -> CycleMotion:
    """Run a case; the gains of unequal feet are the package's random numbers."""
    return _motion(voltage_v, load_n, *changes.items())


@lru_cache(maxsize=32)
def _motion(voltage_v: float, load_n: float, *changes: tuple[str, float | str]) -> CycleMotion:
    values = dict(changes)
    spread = float(values.pop('actuator.gain_tolerance', 0.0))
    ratios = gain_ratios(spread, Parameters().sim.seed, 6)
    return run_springs(values, voltage_v, DRIVEN_CYCLES, load_n, ratios)


def _in_cycles(quantity: str, column: str, cycles: tuple[int, ...]) -> Group:
    """Return a group of positions, with errors relative to the largest of the run."""

    def position(cycle: float, **case: Any) -> float:
        return float(getattr(motion(**case), column)[round(cycle) - 1])

    def largest(cycle: float, **case: Any) -> float:
        return float(np.abs(getattr(motion(**case), column)).max())

    cases = [{**case, 'cycle': cycle} for case in CASES for cycle in cycles]
    return Group(
        FAMILY, quantity, position, OF_LARGEST, SOURCE, BY, cases, largest, NUMBA, is_slow=True
    )


GROUPS = [
    _in_cycles('drive_mean_m', 'means_m', (1, 4, 8)),
    _in_cycles('drive_end_m', 'ends_m', (1, 8)),
    Group(
        FAMILY, 'drive_loss_j', lambda **case: motion(**case).lost_j, ERROR, SOURCE, BY, CASES,
        version=NUMBA, is_slow=True,
    ),
]  # fmt: skip
