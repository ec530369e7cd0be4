# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Answers for the rival friction laws: a mass on a spring, drift, loops."""

import math
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.contact.laws import LAW, LUGRE, deflect, plastic_bents
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request
from stickslip_ros.kernels.kernel import entry_point
from stickslip_ros.kernels.record import Record, record
from stickslip_ros.lab.validation.contacts import zigzag
from stickslip_ros.parameters import LAWS, Parameters

_deflect = entry_point(deflect)

COULOMB_N = 1.0
SIGMA_0, SIGMA_1, SIGMA_2 = 1e5, math.sqrt(1e5), 0.4
STATIC_RATIO, STRIBECK_M_PER_S = 1.5, 1e-3
"""Benchmark of Canudas de Wit, Olsson, Astrom, Lischinsky (1995), unit mass."""
BREAKAWAY = 0.7  # z_ba/z_ss of EPM
SPRING_N_PER_M, PULL_M_PER_S = 2.0, 0.1
STICK_SLIP_S = 22.0
BEFORE_SLIP_S = 0.05  # time before the next slip at which a plateau is read
_SLOW_HZ, _CYCLES, _SETTLING = 0.25, 20, 10
DT_S = 5e-5
_POSITION, _SPEED, _FRICTION = range(3)  # columns of a log
LONG_S, SLIDES = 1.0, 200
LOOP_STEPS, LOOP_CYCLES = 400, 30
BLOCKS = 20


def plain_law(number: int, **damping: float) -> Record:
    """Return a law without damping and with static equal to Coulomb friction."""
    constants = {
        'bristle_n_per_m': SIGMA_0,
        'static_ratio': 1.0,
        'stribeck_m_per_s': STRIBECK_M_PER_S,
        'breakaway_ratio': BREAKAWAY,
        'bents': plastic_bents(BREAKAWAY),
    }
    return record(LAW, number=number, **(constants | damping))


def benchmark_law(number: int) -> Record:
    """Return a law with the benchmark constants."""
    damping = {'bristle_n_s_per_m': SIGMA_1, 'viscous_n_s_per_m': SIGMA_2}
    return plain_law(number, static_ratio=STATIC_RATIO, **damping)


@entry_point
def pull_mass(
    law: Record,
    spring_n_per_m: float,
    mean_n: float,
    wave_n: float,
    wave_hz: float,
    dt_s: float,
    log: Array,
) -> None:
    """
    Drag a unit mass by a force and by a spring whose end moves at PULL_M_PER_S (Verlet steps).

    The force reaches its mean in one period, then oscillates. Each row of the log receives
    position (m), speed (m/s) and friction (N).

    """
    x_m = speed = z_m = friction_n = 0.0
    for i in range(len(log)):
        for half in range(2):
            time_s = (i + half) * dt_s
            rise = min(time_s * wave_hz, 1.0)
            drive_n = rise * mean_n
            if rise >= 1.0:
                drive_n += wave_n * math.sin(2.0 * math.pi * wave_hz * time_s)
            drive_n += spring_n_per_m * (PULL_M_PER_S * time_s - x_m)
            speed += 0.5 * dt_s * (drive_n - friction_n)
            if half == 0:
                before_m = x_m
                x_m += dt_s * speed
                z_m, friction_n, _ = _deflect(law, COULOMB_N, z_m, x_m - before_m, dt_s)
        log[i, 0], log[i, 1], log[i, 2] = x_m, speed, friction_n


@lru_cache(maxsize=1)
def stick_slip() -> tuple[Array, list[float]]:
    """Return the log of LuGre's stick-slip benchmark, one row per DT_S, and the slip starts, s."""
    log = np.zeros((round(STICK_SLIP_S / DT_S), 3))
    pull_mass(benchmark_law(LUGRE), SPRING_N_PER_M, 0.0, 0.0, 1.0, DT_S, log)
    sliding = log[:, _SPEED] > STRIBECK_M_PER_S
    return log, ((np.flatnonzero(sliding[1:] & ~sliding[:-1]) + 2) * DT_S).tolist()


def plateau_m(plateau: float) -> float:
    """Return the stick position between two slips."""
    log, starts_s = stick_slip()
    return float(log[round((starts_s[round(plateau)] - BEFORE_SLIP_S) / DT_S), _POSITION])


def drift_per_cycle_m(law: str, mean_n: float, wave_n: float) -> float:
    """Return the mean drift per cycle under an oscillating force."""
    log = np.zeros((round((_CYCLES + 1) / _SLOW_HZ / DT_S), 3))
    pull_mass(benchmark_law(LAWS.index(law)), 0.0, mean_n, wave_n, _SLOW_HZ, DT_S, log)
    cycle = len(log) // (_CYCLES + 1)
    return float(log[-1, _POSITION] - log[-1 - _SETTLING * cycle, _POSITION]) / _SETTLING


def trace(law: Record, displacements_m: Array, dt_s: float = 1e-3) -> tuple[Array, Array]:
    """Return friction, N, and lost energy, J, along displacements from 0 with Fc = COULOMB_N."""
    z_m = lost_j = 0.0
    rows = []
    for du_m in np.diff(displacements_m, prepend=0.0):
        z_m, force_n, loss_j = _deflect(law, COULOMB_N, z_m, float(du_m), dt_s)
        lost_j += loss_j
        rows.append((force_n, lost_j))
    forces_n, lost = np.array(rows).T
    return forces_n, lost


def steady_friction_n(law: str, speed_m_per_s: float) -> float:
    """Return the friction of steady sliding."""
    places_m = speed_m_per_s * LONG_S * np.arange(SLIDES + 1, dtype=np.float64)
    return float(trace(benchmark_law(LAWS.index(law)), places_m, LONG_S)[0][-1])


def virgin_friction_n(law: str, displacement_m: float) -> float:
    """Return the friction of first loading, without damping."""
    places_m = np.linspace(0.0, displacement_m, 50, dtype=np.float64)
    return float(trace(plain_law(LAWS.index(law)), places_m)[0][-1])


@lru_cache(maxsize=1)
def steady_loop(law: str, amplitude_m: float) -> tuple[Array, Array]:
    """Return friction, N, and lost energy, J, along loops until they are steady."""
    path_m = zigzag((amplitude_m, -amplitude_m) * LOOP_CYCLES, LOOP_STEPS)
    return trace(plain_law(LAWS.index(law)), path_m)


@lru_cache(maxsize=2)
def loaded(preload_n: float, load_n: float) -> tuple[float, float]:
    """Return position, m, and friction, N, of a free runner after 20 ms of a load."""
    values = {'contact.law': 'coulomb', 'load_cell.contact': 'absent'}
    bench = Bench(Parameters().updated({**values, 'stand.preload': preload_n}))
    requests = [Request('load', (load_n, 0.0, 0.0, 0.0, 0.0, 0.0))]
    for _ in range(BLOCKS):
        bench.update(bench.time_ns + bench.parameters.block_ns, requests)
        requests = []
    return float(bench.state.position_m), float(bench.state.contact_n)


ANSWERS: Mapping[str, Callable[..., Any]] = {
    'slip_start_s': lambda slip: stick_slip()[1][round(slip) - 1],  # faster than Stribeck's speed
    'plateau_m': plateau_m,
    'largest_friction_n': lambda: np.max(stick_slip()[0][:, _FRICTION]),
    'drift_per_cycle_m': drift_per_cycle_m,
    'steady_friction_n': steady_friction_n,
    'virgin_friction_n': virgin_friction_n,
    'loop_end_n': lambda **at: steady_loop(**at)[0][-1 - LOOP_STEPS],
    'loop_loss_j': lambda **at: (
        steady_loop(**at)[1][-1] - steady_loop(**at)[1][-1 - 2 * LOOP_STEPS]
    ),
    'coulomb_way_m': lambda **at: loaded(**at)[0],
    'coulomb_friction_n': lambda **at: loaded(**at)[1],
}
"""Functions by quantity; the name ends with the unit."""
