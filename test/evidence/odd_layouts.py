# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Odd layouts, spring by spring: radii, weight, gains of both signs, frame, stacks and a load button.

Each foot has springs as in layouts.py. Kick, drift and kick step the runner, the feet on stacks
and the centre of mass of frame and feet; the velocities of the second kick are solved for by
repetition. Steps of FINE_S after each corner of a group, else of COARSE_S.

"""

import itertools
import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.optimize import bisect

from evidence.closed_forms import FRICTION, G_STAR_PA, HURST, PREFACTOR, Array, PowerContact
from evidence.group import NUMBA
from evidence.layouts import M_PER_V, TOLERANCE, compiled
from stickslip_ros.drive.layout import gain_ratios
from stickslip_ros.lab.validation.references import Reference, case_of
from stickslip_ros.parameters import Parameters

BY = 'test/evidence/odd_layouts.py'
SLEW_V_PER_S, GRAVITY_M_PER_S2, ROUNDS = 150e6, 9.80665, 3
FINE_PART_S, BUTTON_N_PER_M = 60e-6, 1e5
STICKS_M_PER_S = 1e-7
"""Slower rebounds from the button are none."""


class Mesh(NamedTuple):
    """Springs of a foot, and the longest steps after a corner and elsewhere, s."""

    springs: int
    fine_s: float
    coarse_s: float


MESHES = Mesh(200, 20e-9, 100e-9), Mesh(400, 10e-9, 50e-9)


class Odd(NamedTuple):
    """A layout and its run; SI units. 0: without."""

    counts: tuple[int, ...]
    shares: tuple[float, ...]
    gains: tuple[float, ...]
    delays_s: tuple[float, ...]
    voltage_v: float
    frequency_hz: float
    preload_n: float
    damping: float
    cycles: int = 12
    weights: tuple[float, ...] = (0.0, 0.0, 0.0)
    radii_m: tuple[float, ...] = (0.5e-3,) * 3
    mass_kg: float = 3e-3
    cell_n_per_m: float = 0.0  # attached
    gap_m: float = -1.0  # of a one-sided cell of 1e5 N/m
    button: tuple[float, float, float] = (0.0, 0.0, 0.0)  # Hz, damping ratio, restitution
    stack: tuple[float, float, float] = (0.0, 0.0, 0.0)  # N/m, Hz, damping ratio
    foot_kg: float = 0.0
    frame: tuple[float, float, float] = (0.0, 0.0, 0.0)  # kg, Hz, damping ratio
    tolerance: float = 0.0  # of the gains


ODD = {
    'radii': Odd(
        (3, 2), (0.71, 0.083), (1.0, 0.0), (0.0, 0.0), 289.0, 457.0, 0.43, 13.0,
        weights=(0.0, 0.5), radii_m=(0.41e-3, 1.7e-3), mass_kg=5.7e-3,
    ),
    'gains': Odd(
        (3, 1, 2), (0.47, 0.13, 0.31), (1.0, -0.31, 0.63), (0.0,) * 3, 279.0, 619.0, 0.49, 9.7
    ),
    'stacks': Odd(
        (2, 2, 3), (0.57, 0.49, 0.17), (1.0, 0.93, 0.0), (0.0, 0.417e-3, 0.0), 281.0, 691.0, 0.59,
        8.9, stack=(2.3e7, 67e3, 0.063), frame=(0.0041, 2700.0, 0.043),
    ),
    'frame': Odd(
        (3, 2, 2), (0.31, 0.42, 0.27), (1.0, -0.41, 0.77), (0.0, 0.133e-3, 0.611e-3), 287.0, 811.0,
        0.61, 12.1, 25, cell_n_per_m=1e5, foot_kg=1.1e-4, frame=(0.0131, 6100.0, 0.031),
    ),
    'sled': Odd(
        (2, 2), (0.51, 0.29), (1.0, 0.0), (0.0, 0.0), 277.0, 733.0, 0.53, 10.3,
        foot_kg=3.1e-4, frame=(0.0117, 5200.0, 0.037),
    ),
    'tolerance': Odd(
        (2, 2, 2), (0.4, 0.5, 0.3), (1.0,) * 3, (0.0, 0.2e-3, 0.471e-3), 291.0, 613.0, 0.46, 6.7,
        11, tolerance=0.07,
    ),
    'scatter': Odd(
        (2, 1), (0.45, 0.6), (1.0, 0.58), (0.0, 0.0), 287.0, 557.0, 0.52, 9.9, tolerance=0.05
    ),
    'button': Odd(
        (2, 3), (0.6, 0.33), (1.0, 1.0), (0.0, 0.2713e-3), 283.0, 877.0, 0.51, 9.1, 20,
        gap_m=2.1e-7, button=(1900.0, 0.12, 0.45),
    ),
}  # fmt: skip


def springs_of(radius_m: float, normal_n: float, count: int) -> tuple[Array, Array]:
    """Return stiffnesses, N/m, and limits, N, of springs between heights of equal distance."""
    terms = ((1.0 / radius_m, 2.0), (PREFACTOR, HURST))
    anyhow = PowerContact(terms, 1e-3)
    edge_m = float(bisect(lambda a: float(anyhow.normal_force(a)) - normal_n, 0.0, 1e-3))
    contact = PowerContact(terms, edge_m)
    reaches_m = float(contact.displacement(0.0)) * np.arange(count, -1, -1) / count
    edges_m = np.array([0.0, *map(contact.core, reaches_m[1:-1]), edge_m])
    stiffnesses = 2.0 * G_STAR_PA * edges_m
    limits_n = FRICTION * contact.normal_force(edges_m) + stiffnesses * reaches_m
    return np.diff(stiffnesses), np.diff(limits_n)


class Feet(NamedTuple):
    """Kinds of equal feet: number, m/V, delay, and their springs."""

    counts: Array
    gains: Array
    delays_s: Array
    stiffnesses: Array
    limits_n: Array


def feet_of(odd: Odd, springs: int) -> Feet:
    """Return the feet; with a tolerance each is a kind of its own."""
    own = [i for i, count in enumerate(odd.counts) for _ in range(count if odd.tolerance else 1)]
    counts = np.array([1.0 if odd.tolerance else odd.counts[i] for i in own])
    gains = M_PER_V * np.array([odd.gains[i] for i in own])
    if odd.tolerance:
        gains *= gain_ratios(odd.tolerance, Parameters().sim.seed, len(own))
    weight_n = odd.mass_kg * GRAVITY_M_PER_S2
    pairs = [
        springs_of(
            odd.radii_m[i], odd.shares[i] * odd.preload_n + odd.weights[i] * weight_n, springs
        )
        for i in own
    ]
    delays_s = np.array([odd.delays_s[i] for i in own])
    return Feet(counts, gains, delays_s, *map(np.array, zip(*pairs, strict=True)))


def steps_of(odd: Odd, mesh: Mesh) -> Array:
    """Return the steps of a cycle, s: corners of all groups lie between two of them."""
    period_s = 1.0 / odd.frequency_hz
    fall_s = odd.voltage_v / (SLEW_V_PER_S + odd.voltage_v * odd.frequency_hz)
    corners_s = {0.0, period_s}
    fine = []
    for delay_s in {*odd.delays_s}:
        fine.append((delay_s, delay_s + FINE_PART_S))
        corners_s |= {delay_s, delay_s + fall_s, delay_s + FINE_PART_S}
    at_s, steps_s = sorted(corners_s), []
    for begin_s, end_s in itertools.pairwise(at_s):
        is_fine = any(low <= begin_s < high for low, high in fine)
        count = math.ceil((end_s - begin_s) / (mesh.fine_s if is_fine else mesh.coarse_s))
        steps_s.append(np.full(count, (end_s - begin_s) / count))
    return np.concatenate(steps_s)


class Bodies(NamedTuple):
    """Masses and what holds them; SI units. Inverse masses are 0 for what is not there."""

    runner_kg: float
    damping: float
    cell_n_per_m: float
    bends: bool
    stack_n_per_m: float
    foot_kg: float
    stack_n_s_per_m: float
    frame_per_kg: float
    frame_n_per_m: float
    frame_n_s_per_m: float
    feet_share: float  # of the feet in the mass of the frame with them
    button_kg: float
    button_per_kg: float
    button_n_s_per_m: float
    gap_m: float
    restitution: float


def bodies_of(odd: Odd, driven: float) -> Bodies:
    """Return the bodies of a layout."""
    stack_n_per_m, stack_hz, stack_damping = odd.stack
    foot_kg = stack_n_per_m / (2.0 * math.pi * stack_hz) ** 2 if stack_n_per_m else odd.foot_kg
    frame_kg, frame_hz, frame_damping = odd.frame
    frame_per_s, frame_per_kg = 2.0 * math.pi * frame_hz, 1.0 / frame_kg if frame_kg else 0.0
    button_hz, button_damping, restitution = odd.button
    button_kg = BUTTON_N_PER_M / (2.0 * math.pi * button_hz) ** 2 if button_hz else 0.0
    return Bodies(
        odd.mass_kg, odd.damping, odd.cell_n_per_m,
        stack_n_per_m > 0.0, stack_n_per_m, foot_kg,
        2.0 * stack_damping * math.sqrt(stack_n_per_m * foot_kg),
        frame_per_kg, frame_kg * frame_per_s**2, 2.0 * frame_damping * frame_per_s * frame_kg,
        driven * foot_kg * frame_per_kg,
        button_kg, 1.0 / button_kg if button_kg else 0.0,
        2.0 * button_damping * math.sqrt(BUTTON_N_PER_M * button_kg),
        odd.gap_m if button_kg else math.inf, restitution,
    )  # fmt: skip


def run(odd: Odd, mesh: Mesh) -> Array:
    """Return mean position m, end m, friction loss J of each cycle."""
    rows, feet = np.zeros((odd.cycles, 3)), feet_of(odd, mesh.springs)
    driven = float(feet.counts[feet.gains != 0.0].sum())
    steps_s = steps_of(odd, mesh)
    _step(feet, bodies_of(odd, driven), steps_s, odd.voltage_v, odd.frequency_hz, rows)
    return rows


@compiled
def _output_v(t: float, cycle: int, volts: float, hertz: float) -> float:
    """Return the saw-tooth a time after the start of a cycle; a delay makes the time negative."""
    if t < 0.0:
        t, cycle = t + 1.0 / hertz, cycle - 1
    ramp_v = volts * hertz * t if cycle >= 0 else 0.0
    return max(ramp_v, volts - SLEW_V_PER_S * t) if cycle > 0 else ramp_v


@compiled
def _drag(feet: Feet, moved_m: Array, forces_n: Array, pulls_n: Array) -> float:
    """Move the springs; fill the pull of a foot of each kind, N, and return the loss, J."""
    lost_j = 0.0
    for g in range(len(moved_m)):
        sum_n = sum_j = 0.0
        for j in range(forces_n.shape[1]):
            wanted_n = forces_n[g, j] + feet.stiffnesses[g, j] * moved_m[g]
            force_n = min(max(wanted_n, -feet.limits_n[g, j]), feet.limits_n[g, j])
            sum_j += (wanted_n - force_n) * force_n / feet.stiffnesses[g, j]
            forces_n[g, j] = force_n
            sum_n += force_n
        pulls_n[g] = sum_n
        lost_j += feet.counts[g] * sum_j
    return lost_j


@compiled
def _meet(of: Bodies, v: float, b_v: float) -> tuple[float, float, bool]:
    """Return the velocities after an impact on the button, and whether both stay together."""
    total_kg = of.runner_kg + of.button_kg
    both = (of.runner_kg * v + of.button_kg * b_v) / total_kg
    apart = of.restitution * (v - b_v)
    if apart < STICKS_M_PER_S:
        return both, both, True
    return both - apart * of.button_kg / total_kg, both + apart * of.runner_kg / total_kg, False


@compiled
def _step(feet: Feet, of: Bodies, steps_s: Array, volts: float, hertz: float, rows: Array) -> None:
    """Step everything, and fill the rows."""
    kinds, forces_n = len(feet.counts), np.zeros(feet.limits_n.shape)
    runs = (feet.gains != 0.0).astype(np.float64)
    in_mean = runs * feet.counts / np.sum(runs * feet.counts)
    drives, drive_w, z, w, z_a, pulls_n, places = np.zeros((7, kinds))
    x = v = a = centre = centre_v = centre_a = b = b_v = b_a = 0.0
    pressed = False
    for cycle in range(len(rows)):
        t = mean_m = lost_j = 0.0
        for h in steps_s:
            # Kick and drift.
            t += h
            v_half, centre_half, b_half = (
                v + 0.5 * h * a,
                centre_v + 0.5 * h * centre_a,
                b_v + 0.5 * h * b_a,
            )
            mean_m += h * hertz * (x + 0.5 * h * v_half)
            x, centre = x + h * v_half, centre + h * centre_half
            b = x - of.gap_m if pressed else b + h * b_half
            for g in range(kinds):
                output_v = _output_v(t - feet.delays_s[g], cycle, volts, hertz)
                drive_w[g] = (feet.gains[g] * output_v - drives[g]) / h
                drives[g] = feet.gains[g] * output_v
            w_half = w + 0.5 * h * z_a if of.bends else drive_w
            z = z + h * w_half if of.bends else drives.copy()
            frame_m = centre - of.feet_share * np.sum(in_mean * z)
            lost_j += _drag(feet, x - frame_m - z - places, forces_n, pulls_n)
            places = x - frame_m - z
            contact_n = np.sum(feet.counts * pulls_n)
            # Kick: the velocities by repetition.
            v, centre_v, b_v, w = v_half, centre_half, b_half, w_half
            for _ in range(ROUNDS):
                frame_v = centre_v - of.feet_share * np.sum(in_mean * w)
                held_n = of.frame_n_per_m * frame_m + of.frame_n_s_per_m * frame_v
                centre_a = of.frame_per_kg * (contact_n - held_n)
                if of.bends:
                    bent_n = of.stack_n_per_m * (drives - z) - of.stack_n_s_per_m * w
                    own_a = (bent_n + pulls_n) / of.foot_kg
                    recoil = centre_a - of.feet_share * np.sum(in_mean * own_a)
                    z_a = runs * (own_a - recoil / (1.0 - of.feet_share))
                    w = w_half + 0.5 * h * z_a
                runner_n = -of.cell_n_per_m * x - of.damping * v - contact_n
                button_n = -BUTTON_N_PER_M * b - of.button_n_s_per_m * b_v
                a, b_a = runner_n / of.runner_kg, button_n * of.button_per_kg
                if pressed:
                    a = b_a = (runner_n + button_n) / (of.runner_kg + of.button_kg)
                v, centre_v, b_v = (
                    v_half + 0.5 * h * a,
                    centre_half + 0.5 * h * centre_a,
                    b_half + 0.5 * h * b_a,
                )
            if pressed:
                b_v, pressed = v, of.button_kg * a - button_n > 0.0
            elif x > of.gap_m + b and v > b_v:
                v, b_v, pressed = _meet(of, v, b_v)
        rows[cycle] = (mean_m, x, lost_j)


def references(name: str) -> Iterator[Reference]:
    """Make the references of an odd layout: mean of its last cycle, and friction loss."""
    odd = ODD[name]
    coarse, fine = (run(odd, mesh)[-1] for mesh in MESHES)
    case = case_of({
        'layout': name, 'voltage_v': odd.voltage_v, 'frequency_hz': odd.frequency_hz,
        'damping': odd.damping, 'cell_n_per_m': odd.cell_n_per_m, 'cycles': odd.cycles, 'last': 1,
    })  # fmt: skip
    for quantity, column in {'layout_mean_m': 0, 'layout_loss_j': 2}.items():
        value = float(fine[column])
        error = abs(value / float(coarse[column]) - 1.0)
        yield Reference(
            'Layouts', quantity, case, value, TOLERANCE, abs(value),
            f'steps of both; half its steps, twice its springs moved ours by {error:.0e}',
            f'springs, {MESHES[1].springs} a foot, steps of 10 and 50 ns', BY, NUMBA,
        )  # fmt: skip
