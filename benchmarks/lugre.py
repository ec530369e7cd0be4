# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The drive with LuGre's law: ours against scipy's stiff solver, at the same accuracy."""

import math
from collections.abc import Callable
from functools import partial

import numba
import numpy as np
from scipy.integrate import solve_ivp

from benchmarks.case import (
    ACCURACY,
    PERIOD_S,
    Ours,
    cheapest,
    ours_at,
    standard_case,
    worst_error,
)
from benchmarks.clock import Program, in_turn
from benchmarks.outcome import Outcome, Row
from benchmarks.rival import Grid, path_of
from benchmarks.sizes import Sizes
from stickslip_ros.arrays import Array
from stickslip_ros.contact.springs import friction_limit
from stickslip_ros.drive.build import plant_of
from stickslip_ros.drive.records import ALL
from stickslip_ros.kernels.kernel import entry_point
from stickslip_ros.parameters import Parameters

friction_limit = entry_point(friction_limit)

LUGRE = {
    'contact.law': 'lugre',
    'friction_law.static_ratio': 1.2,
    'friction_law.bristle_damping': 10.0,
    'friction_law.stribeck_velocity': 1e-3,
}
METHOD = 'LSODA'
REFERENCE, REFERENCE_TINY = ('Radau', 1e-8), (METHOD, 1e-6)
SCALES = np.array([1e-7, 1e-3, 1e-7, 1e-9])
"""Sizes of position (m), velocity (m/s), bristle deflection (m) and integral of position (m s):
the absolute tolerance of each is the relative one times its size."""


@numba.njit
def rates(_t: float, y: Array, foot_m_per_s: float, mass: float, cell: float, law: Array) -> Array:
    """Return the rates of position, velocity, bristle deflection and integral of position."""
    sigma0, sigma1, sigma2, coulomb_n, static_n, stribeck = law
    x, v, z, _ = y
    slide = v - foot_m_per_s
    steady = (coulomb_n + (static_n - coulomb_n) * math.exp(-((slide / stribeck) ** 2))) / sigma0
    z_rate = slide - abs(slide) * z / steady
    friction_n = sigma0 * z + sigma1 * z_rate + sigma2 * slide
    return np.array([v, (-cell * x - friction_n) / mass, z_rate, x])


def scipy_runner(parameters: Parameters, cycles: int) -> Callable[[str, float], Array]:
    """Return a function of method and tolerance that gives the mean force of every cycle, N."""
    plant = plant_of(parameters)[0]
    law = plant.contacts[ALL].law
    coulomb_n = friction_limit(plant.contacts[ALL].bank, parameters.stand.preload)
    constants = np.array(
        [
            law.bristle_n_per_m, law.bristle_n_s_per_m, law.viscous_n_s_per_m,
            coulomb_n, law.static_ratio * coulomb_n, law.stribeck_m_per_s,
        ]
    )  # fmt: skip
    stretches = path_of(parameters, Grid(0, PERIOD_S, 1), cycles)

    def run(method: str, tolerance: float) -> Array:
        y = np.zeros(4)
        integrals = []
        for start_m, end_m, steps, step_s in stretches:
            time_s = steps * step_s
            arguments = ((end_m - start_m) / time_s, plant.mass_kg, plant.cell_n_per_m, constants)
            y = solve_ivp(
                rates, (0.0, time_s), y, method, t_eval=[time_s], args=arguments,
                rtol=tolerance, atol=tolerance * SCALES,
            ).y[:, -1]  # fmt: skip
            integrals.append(y[3])
        ends = np.concatenate(([0.0], integrals[::2]))
        return np.asarray(plant.cell_n_per_m * np.diff(ends) / PERIOD_S)

    return run


def run(sizes: Sizes) -> Outcome:
    """Compare."""
    cycles = sizes.scipy_cycles
    solve = scipy_runner(standard_case(LUGRE), cycles)
    reference = REFERENCE if sizes.cold else REFERENCE_TINY
    reference_n = solve(*reference)
    ours, step_s = ours_at(LUGRE, sizes.steps_s, cycles, reference_n)
    loosest_first = sorted(sizes.tolerances, reverse=True)
    tolerance = cheapest(loosest_first, partial(solve, METHOD), reference_n)
    labels = [('ours', f'{step_s * 1e6:g} us'), (f'scipy {METHOD}', f'rtol {tolerance:g}')]
    scipy_s = Program(partial(solve, METHOD, tolerance), ours.work_s)
    times = in_turn([Program(ours, ours.work_s), scipy_s], sizes)
    forces_n = [ours(), solve(METHOD, tolerance)]
    rows: list[Row] = [
        {
            'program': label,
            'setting': setting,
            'times_real_time': 1.0 / times.median(i),
            **times.ratio(i),
            'worst_error': worst_error(forces_n[i], reference_n),
        }
        for i, (label, setting) in enumerate(labels)
    ]
    finest_n = Ours(standard_case({**LUGRE, 'sim.dt': sizes.converged_s}), cycles)()
    apart = worst_error(finest_n, reference_n)
    return Outcome(
        "LuGre's law in the same drive: scipy.integrate.solve_ivp",
        rows,
        [],
        [
            f'{cycles} cycles; Fs/Fc 1.2, sigma1 10 N s/m, vs 1 mm/s, sigma0 as in full stick',
            (
                f'reference: scipy {reference[0]}, rtol {reference[1]:g}; ours at '
                f'{sizes.converged_s * 1e6:g} us is {apart:.1e} from it'
            ),
            f'each at the loosest setting whose worst error is at most {ACCURACY:g}',
            'scipy starts anew at every corner of the saw-tooth; its right-hand side is compiled',
        ],
    )
