# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The algorithm of the paper (Section 3.4), written plainly.

Every spring of every contact is checked in every time step: it sticks, or slips at mu f_z. The
runner (Eq. 20) is stepped by velocity Verlet with a fixed small step; the ramps and falls of the
saw-tooth begin and end with a step.

"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numba
import numpy as np

from benchmarks.case import AMPLITUDE_M, PERIOD_S
from stickslip_ros.arrays import Array
from stickslip_ros.contact.hemisphere import elasticity_of
from stickslip_ros.contact.mdr import Elasticity, Presliding
from stickslip_ros.contact.profile import LineProfile, PowerProfile
from stickslip_ros.drive.layout import contacts_of
from stickslip_ros.parameters import Parameters

SIX, HALVES = 'six contacts', 'two groups, half of each'
"""Which springs are stepped: all; or those of one upper and one lower contact, on one side of the
middle, as the others are equal to them."""
UPPER, LOWER = 0, 2
BISECTIONS = 100

Loop = Callable[[Array, Array, Array, float, float, Array, Array], None]


class Springs(NamedTuple):
    """The springs in contact: stiffness G* dx, and the force mu f_z at which they slip."""

    shear_n_per_m: Array
    limit_n: Array


class Grid(NamedTuple):
    """How finely the paper's algorithm computes."""

    springs: int  # per contact; 0 for a rough line, which has its own
    step_s: float  # on the ramp
    fall_steps: int  # in one fall

    def cost(self) -> float:
        """Return springs times steps of a cycle, up to a factor."""
        return max(self.springs, 1) * (PERIOD_S / self.step_s + self.fall_steps)


def equal_springs(parameters: Parameters, springs: int, which: str) -> Springs:
    """Return the springs of six equal contacts of the equivalent or the smooth profile."""
    contacts = contacts_of(parameters)
    elasticity = elasticity_of(parameters.contact)
    chosen = [(contact, 1) for contact in contacts]
    if which != SIX:
        chosen = [(contacts[UPPER], LOWER), (contacts[LOWER], len(contacts) - LOWER)]
    banks = [
        _evenly_spaced(contact, elasticity, springs, which == HALVES, count)
        for contact, count in chosen
    ]
    return Springs(*(np.concatenate(column) for column in zip(*banks, strict=True)))


def line_springs(parameters: Parameters) -> Springs:
    """Return the springs of six different rough lines that are in contact, one per point."""
    elasticity = elasticity_of(parameters.contact)
    banks: list[Springs] = []
    for contact in contacts_of(parameters):
        line = contact.profile
        assert isinstance(line, LineProfile)
        pressed_m = contact.indentation.depth_m - line.heights_m
        pressed_m = pressed_m[pressed_m > 0.0]
        banks.append(_loaded(pressed_m, line.spacing_m, elasticity, contact.friction))
    return Springs(*(np.concatenate(column) for column in zip(*banks, strict=True)))


def _evenly_spaced(
    contact: Presliding, elasticity: Elasticity, springs: int, half: bool, count: int
) -> Springs:
    """Return the springs of ``count`` equal contacts; their depth carries exactly F_n."""
    profile = contact.profile
    assert isinstance(profile, PowerProfile)
    radius_m = contact.indentation.radius_m
    dx_m = 2.0 * radius_m / springs
    x_m = (np.arange(springs, dtype=float) + 0.5) * dx_m - radius_m
    if half:
        x_m, dx_m = x_m[springs // 2 :], 2.0 * dx_m
    heights_m = profile.height(x_m)
    low_m, high_m = 0.0, 2.0 * contact.indentation.depth_m
    for _ in range(BISECTIONS):
        depth_m = 0.5 * (low_m + high_m)
        force_n = elasticity.normal_pa * dx_m * np.sum(np.maximum(depth_m - heights_m, 0.0))
        if force_n < contact.indentation.normal_force_n:
            low_m = depth_m
        else:
            high_m = depth_m
    pressed_m = np.maximum(depth_m - heights_m, 0.0)
    return _loaded(pressed_m, count * dx_m, elasticity, contact.friction)


def _loaded(pressed_m: Array, dx_m: float, elasticity: Elasticity, friction: float) -> Springs:
    shear = np.full(len(pressed_m), elasticity.shear_pa * dx_m)
    return Springs(shear, friction * elasticity.normal_pa * dx_m * pressed_m)


def path_of(parameters: Parameters, grid: Grid, cycles: int) -> Array:
    """
    Return the motion of the feet, stretch by stretch, shape (2 cycles - 1, 4).

    Foot displacement at the start and at the end, m; number of steps; their length, s. The first
    cycle has no fall, then fall and ramp alternate.

    """
    rise_v = AMPLITUDE_M / parameters.actuator.gain
    fall_s = rise_v / (parameters.amplifier.slew_rate + rise_v / PERIOD_S)
    low_m = AMPLITUDE_M * fall_s / PERIOD_S
    fall = (AMPLITUDE_M, low_m, grid.fall_steps, fall_s / grid.fall_steps)
    ramps = []
    for start_m, time_s in ((0.0, PERIOD_S), (low_m, PERIOD_S - fall_s)):
        steps = math.ceil(time_s / grid.step_s)
        ramps.append((start_m, AMPLITUDE_M, steps, time_s / steps))
    return np.array([ramps[0]] + [fall, ramps[1]] * (cycles - 1))


def spring_by_spring(
    shear: Array, limit: Array, q: Array, mass: float, cell: float, path: Array, integrals: Array
) -> None:
    """Step the drive; numba compiles it. Integrals receives int x dt after every stretch, m s."""
    q[:] = 0.0
    x = v = force = u = integral = 0.0
    for s in range(len(path)):
        start, end, steps, dt = path[s]
        for i in range(1, int(steps) + 1):
            v += 0.5 * dt * (-cell * x - force) / mass
            integral += 0.5 * dt * x
            x += dt * v
            integral += 0.5 * dt * x
            du = x - (start + (end - start) * (i / steps)) - u
            u += du
            force = 0.0
            for j in range(len(q)):
                trial = q[j] + shear[j] * du
                if trial > limit[j]:
                    trial = limit[j]
                elif trial < -limit[j]:
                    trial = -limit[j]
                q[j] = trial
                force += trial
            v += 0.5 * dt * (-cell * x - force) / mass
        integrals[s] = integral


# No cache: numba's does not tell the two apart.
compiled: Loop = numba.njit()(spring_by_spring)
"""One spring after the other, in the order written."""
vectorised: Loop = numba.njit(fastmath=True)(spring_by_spring)
"""The compiler may reorder sums, so that it does many springs with one instruction."""


class Rival:
    """The paper's algorithm over some cycles of the saw-tooth: ``compiled`` or ``vectorised``."""

    def __init__(
        self, loop: Loop, parameters: Parameters, springs: Springs, grid: Grid, cycles: int
    ) -> None:
        self.work_s = cycles * PERIOD_S
        self._loop = loop
        self._parameters = parameters
        self._springs = springs
        self._forces_n = np.zeros_like(springs.limit_n)
        self._path = path_of(parameters, grid, cycles)
        self._integrals = np.zeros(len(self._path))

    def __call__(self) -> Array:
        """Run, and return the mean force of every cycle, N."""
        mass_kg, cell = self._parameters.runner.mass, self._parameters.load_cell.stiffness
        self._loop(*self._springs, self._forces_n, mass_kg, cell, self._path, self._integrals)
        ends = np.concatenate(([0.0], self._integrals[::2]))
        return np.asarray(cell * np.diff(ends) / PERIOD_S)
