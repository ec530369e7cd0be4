"""What drives a friction law in its checks: a mass on a spring or a force, a given path."""

import math

import numpy as np

from stickslip_ros.contact.kernel import entry_point
from stickslip_ros.contact.laws import LAW, LUGRE, deflect
from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.record import Record, record

deflect = entry_point(deflect)

COULOMB_N = 1.0
SIGMA_0, SIGMA_1, SIGMA_2 = 1e5, math.sqrt(1e5), 0.4
STATIC_RATIO, STRIBECK_M_PER_S = 1.5, 1e-3
"""The benchmark of Canudas de Wit, Olsson, Astrom, Lischinsky (1995), for a unit mass."""
BREAKAWAY = 0.7
"""z_ba/z_ss of EPM."""
SPRING_N_PER_M, PULL_M_PER_S = 2.0, 0.1
STICK_SLIP_S = 22.0
MEAN_N, WAVE_N = 0.5, 0.3
"""Oscillating force, from 0.2 to 0.8 N: below the static friction of 1.5 N."""
CYCLES, SETTLING = 20, 10
DT_S = 5e-5
POSITION, SPEED, FRICTION = range(3)
"""Columns of a log."""


def benchmark_law(number: int) -> Record:
    """Return a law with the constants of the benchmark."""
    return record(
        LAW,
        number=number,
        bristle_n_per_m=SIGMA_0,
        bristle_n_s_per_m=SIGMA_1,
        viscous_n_s_per_m=SIGMA_2,
        static_ratio=STATIC_RATIO,
        stribeck_m_per_s=STRIBECK_M_PER_S,
        breakaway_ratio=BREAKAWAY,
    )


def plain_law(number: int) -> Record:
    """Return a law without any damping and without more static than Coulomb friction."""
    return record(
        LAW,
        number=number,
        bristle_n_per_m=SIGMA_0,
        static_ratio=1.0,
        stribeck_m_per_s=STRIBECK_M_PER_S,
        breakaway_ratio=BREAKAWAY,
    )


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
    Drag a unit mass by a spring whose end moves at PULL_M_PER_S, and by a force.

    Parameters
    ----------
    law : record of LAW
        Friction on the mass, with Fc = COULOMB_N.
    spring_n_per_m, mean_n, wave_n, wave_hz, dt_s : float
        Spring, force (it rises to its mean in a period, then oscillates), step of Verlet.
    log : array, shape (steps, 3)
        Receives position (m), speed (m/s) and friction (N) after each step.

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
                z_m, friction_n, _ = deflect(law, COULOMB_N, z_m, x_m - before_m, dt_s)
        log[i, 0], log[i, 1], log[i, 2] = x_m, speed, friction_n


def stick_slip() -> Array:
    """Return the log of the stick-slip benchmark of LuGre; its rows are DT_S apart."""
    log = np.zeros((round(STICK_SLIP_S / DT_S), 3))
    pull_mass(benchmark_law(LUGRE), SPRING_N_PER_M, 0.0, 0.0, 1.0, DT_S, log)
    return log


def slip_starts(log: Array) -> Array:
    """Return the times at which the speed first exceeds the Stribeck velocity, s."""
    sliding = log[:, SPEED] > STRIBECK_M_PER_S
    return np.asarray((np.flatnonzero(sliding[1:] & ~sliding[:-1]) + 2) * DT_S)


def oscillation(number: int, wave_hz: float = 1.0) -> Array:
    """Return the log of a mass under an oscillating force, for CYCLES after the rise."""
    log = np.zeros((round((CYCLES + 1) / wave_hz / DT_S), 3))
    pull_mass(benchmark_law(number), 0.0, MEAN_N, WAVE_N, wave_hz, DT_S, log)
    return log


def drift_per_cycle(log: Array) -> float:
    """Return the mean drift of the last cycles of an oscillation, m."""
    cycle = len(log) // (CYCLES + 1)
    last = len(log) - 1
    moved_m = log[last, POSITION] - log[last - SETTLING * cycle, POSITION]
    return float(moved_m) / SETTLING


def lugre_drift_m() -> float:
    """Return (Fs/sigma0) ln[(Fs^2 - F1^2)/(Fs^2 - F2^2)], the quasi-static drift of LuGre, m."""
    square = STATIC_RATIO**2
    least, most = MEAN_N - WAVE_N, MEAN_N + WAVE_N
    return STATIC_RATIO / SIGMA_0 * math.log((square - least**2) / (square - most**2))


def trace(law: Record, displacements_m: Array, dt_s: float = 1e-3) -> tuple[Array, Array]:
    """Return friction, N, and loss so far, J, along displacements from 0 with Fc = COULOMB_N."""
    z_m = lost_j = 0.0
    rows = []
    for du_m in np.diff(displacements_m, prepend=0.0):
        z_m, force_n, loss_j = deflect(law, COULOMB_N, z_m, float(du_m), dt_s)
        lost_j += loss_j
        rows.append((force_n, lost_j))
    forces_n, lost = np.array(rows).T
    return forces_n, lost
