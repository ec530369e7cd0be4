"""Checks of the rival friction laws: benchmark, closed forms, Coulomb in the drive."""

import math

import numpy as np

from stickslip_ros.contact.kernel import entry_point
from stickslip_ros.contact.laws import DAHL, EPM, LAW, LUGRE, deflect
from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.record import Record, record
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request
from stickslip_ros.parameters import Parameters
from stickslip_ros.units import MICRO
from stickslip_ros.validation.checks import (
    ROUNDING,
    Curve,
    Family,
    Measured,
    Panel,
    Tolerance,
    measures,
    printed,
    shared,
)
from stickslip_ros.validation.histories import zigzag
from stickslip_ros.validation.references import LIMIT_PER_PRELOAD

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


def plain_law(number: int, **damping: float) -> Record:
    """Return a law without any damping and without more static than Coulomb friction."""
    constants = {
        'bristle_n_per_m': SIGMA_0,
        'static_ratio': 1.0,
        'stribeck_m_per_s': STRIBECK_M_PER_S,
        'breakaway_ratio': BREAKAWAY,
    }
    return record(LAW, number=number, **(constants | damping))


def benchmark_law(number: int) -> Record:
    """Return a law with the constants of the benchmark."""
    return plain_law(
        number, static_ratio=STATIC_RATIO, bristle_n_s_per_m=SIGMA_1, viscous_n_s_per_m=SIGMA_2
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
    Drag a unit mass by a spring whose end moves at PULL_M_PER_S, and by a force; Verlet's steps.

    The force rises to its mean in a period, then oscillates. The log, of shape (steps, 3),
    receives position (m), speed (m/s) and friction (N) after each step.

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


SLIP_STARTS_S = ('7.438', '13.800', '20.163')
PLATEAUS_M = ('0.6363', '1.2726')
LARGEST_FORCE_N = '1.477'
BEFORE_SLIP_S = 0.05
"""How long before the next slip a plateau is read."""
TEXT = 'reference figures, benchmark of Canudas de Wit et al. 1995'


@shared
def stick_slip() -> Array:
    """Return the log of the stick-slip benchmark of LuGre; its rows are DT_S apart."""
    log = np.zeros((round(STICK_SLIP_S / DT_S), 3))
    pull_mass(benchmark_law(LUGRE), SPRING_N_PER_M, 0.0, 0.0, 1.0, DT_S, log)
    return log


@measures(
    ('LuGre: start of slip 1', f'{TEXT}; v > vs', 's', printed(SLIP_STARTS_S[0])),
    ('LuGre: start of slip 2', f'{TEXT}; v > vs', 's', printed(SLIP_STARTS_S[1])),
    ('LuGre: start of slip 3', f'{TEXT}; v > vs', 's', printed(SLIP_STARTS_S[2])),
    ('LuGre: plateau 1', TEXT, 'm', printed(PLATEAUS_M[0])),
    ('LuGre: plateau 2', TEXT, 'm', printed(PLATEAUS_M[1])),
    ('LuGre: largest force', TEXT, 'N', printed(LARGEST_FORCE_N)),
)
def _benchmark() -> Measured:
    log = stick_slip()
    sliding = log[:, SPEED] > STRIBECK_M_PER_S
    starts_s = ((np.flatnonzero(sliding[1:] & ~sliding[:-1]) + 2) * DT_S).tolist()
    rows = [round((start_s - BEFORE_SLIP_S) / DT_S) for start_s in starts_s[1:]]
    return *starts_s, *log[rows, POSITION].tolist(), float(np.max(log[:, FRICTION]))


SLOW_HZ = 0.25
QUASI_STATIC = Tolerance(1e-4, 'inertia and bristle damping at 0.25 Hz; falls as the square of it')
NO_DRIFT = Tolerance(1e-12, 'rounding of the position')


@shared
def oscillation(number: int, wave_hz: float) -> Array:
    """Return the log of a mass under an oscillating force, for CYCLES after the rise."""
    log = np.zeros((round((CYCLES + 1) / wave_hz / DT_S), 3))
    pull_mass(benchmark_law(number), 0.0, MEAN_N, WAVE_N, wave_hz, DT_S, log)
    return log


def drift_per_cycle(log: Array) -> float:
    """Return the mean drift of the last cycles of an oscillation, m."""
    cycle = len(log) // (CYCLES + 1)
    return float(log[-1, POSITION] - log[-1 - SETTLING * cycle, POSITION]) / SETTLING


def lugre_drift_m() -> float:
    """Return (Fs/sigma0) ln[(Fs^2 - F1^2)/(Fs^2 - F2^2)], the quasi-static drift of LuGre, m."""
    square = STATIC_RATIO**2
    least, most = MEAN_N - WAVE_N, MEAN_N + WAVE_N
    return STATIC_RATIO / SIGMA_0 * math.log((square - least**2) / (square - most**2))


@measures(
    ('LuGre: drift per cycle', '(Fs/sigma0) ln[(Fs^2 - F1^2)/(Fs^2 - F2^2)]', 'm', QUASI_STATIC),
    (
        'EPM: drift per cycle below z_ba',
        'none: elastic (Dupont et al. 2002)',
        'm',
        NO_DRIFT,
        'the deflection Fs/sigma0',
    ),
)
def _drift() -> Measured:
    """Compare the creep under an oscillating force below the static friction."""
    lugre_m, epm_m = (drift_per_cycle(oscillation(number, SLOW_HZ)) for number in (LUGRE, EPM))
    return (lugre_drift_m(), lugre_m), (0.0, epm_m, STATIC_RATIO / SIGMA_0)


LONG_S, SLIDES = 1.0, 200
STRIBECK = 'Fc + (Fs - Fc) exp(-(v/vs)^2) + sigma2 v'


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


@measures(
    ('LuGre: steady sliding, vs/10 to 10 vs', STRIBECK, 'N', ROUNDING),
    ('EPM: steady sliding, vs/10 to 10 vs', STRIBECK, 'N', ROUNDING),
)
def _steady_sliding() -> Measured:
    """Compare the force on both sides of the Stribeck velocity."""
    speeds = STRIBECK_M_PER_S * np.logspace(-1.0, 1.0, 21, dtype=np.float64)
    decay = np.exp(-((speeds / STRIBECK_M_PER_S) ** 2))
    expected_n = COULOMB_N * (1.0 + (STATIC_RATIO - 1.0) * decay) + SIGMA_2 * speeds
    places_s = LONG_S * np.arange(SLIDES + 1)
    return [
        (expected_n, [trace(benchmark_law(law), v * places_s, LONG_S)[0][-1] for v in speeds])
        for law in (LUGRE, EPM)
    ]


AMPLITUDE_M = 1.3e-5
DAHL_CYCLES = 30
LOOP = Tolerance(1e-9, f'{DAHL_CYCLES} cycles of settling')
STEPS = 400
LOSS = Tolerance(1e-5, f'trapezoidal rule of the loss, {STEPS} steps per leg')


@measures(
    ('Dahl: virgin curve', 'Fc (1 - exp(-sigma0 x/Fc))', 'N', ROUNDING, 'Fc'),
    ('Dahl: ends of the loop', 'Fc tanh(sigma0 X/Fc)', 'N', LOOP),
    ('Dahl: loss per cycle', '4 Fc [X - (Fc/sigma0) tanh(sigma0 X/Fc)]', 'J', LOSS),
)
def _dahl() -> Measured:
    law = plain_law(DAHL)
    places_m = np.linspace(0.0, 6e-5, 50, dtype=np.float64)
    virgin_n = COULOMB_N * (1.0 - np.exp(-SIGMA_0 * places_m / COULOMB_N))
    forces_n, lost_j = trace(law, zigzag((AMPLITUDE_M, -AMPLITUDE_M) * DAHL_CYCLES, STEPS))
    steady_n = COULOMB_N * math.tanh(SIGMA_0 * AMPLITUDE_M / COULOMB_N)
    loss_j = 4.0 * COULOMB_N * (AMPLITUDE_M - steady_n / SIGMA_0)
    return (
        (virgin_n, trace(law, places_m)[0], COULOMB_N),
        ([steady_n, -steady_n], forces_n[[-1 - STEPS, -1]]),
        (loss_j, lost_j[-1] - lost_j[-1 - 2 * STEPS]),
    )


PRELOAD_N, MASS_KG = 0.5, 3e-3
LESS, MORE = 0.5, 1.2
"""Loads below and above the limit, as shares of it."""
BLOCKS, BLOCK_S = 20, 1e-3
FIRST_STEP = Tolerance(
    3e-4, 'half a step of 0.6 us without friction, times 5 for the small excess'
)
STILL = Tolerance(1e-8, 'half a step of 0.6 us without friction, out of 20 ms, squared')


@measures(
    ('Coulomb, load of half the limit: motion', 'rest', 'm', STILL, 'the way without friction'),
    ('Coulomb, load of 1.2 limits: force', 'mu 2 sqrt2 F_p', 'N', ROUNDING),
    ('Coulomb, load of 1.2 limits: motion', '(F_ext - mu 2 sqrt2 F_p) t^2/(2 m)', 'm', FIRST_STEP),
)
def _coulomb() -> Measured:
    """Compare a runner that rests under a lesser load and that a greater one moves."""
    limit_n = LIMIT_PER_PRELOAD * PRELOAD_N
    resting, sliding = (_loaded(share * limit_n).state for share in (LESS, MORE))
    way_m_per_n = 0.5 / MASS_KG * (BLOCKS * BLOCK_S) ** 2
    return (
        (0.0, resting.position_m, LESS * limit_n * way_m_per_n),
        (limit_n, sliding.contact_n),
        ((MORE - 1.0) * limit_n * way_m_per_n, sliding.position_m),
    )


def _loaded(load_n: float) -> Bench:
    """Return a bench whose free runner a constant load has pulled."""
    values = {'contact.law': 'coulomb', 'load_cell.contact': 'absent'}
    bench = Bench(Parameters().updated({**values, 'stand.preload': PRELOAD_N}))
    requests = [Request('load', (load_n, 0.0, 0.0, 0.0, 0.0, 0.0))]
    for _ in range(BLOCKS):
        bench.update(bench.time_ns + bench.parameters.block_ns, requests)
        requests = []
    return bench


def _stick_slip_panel() -> Panel:
    log = stick_slip()
    some = slice(None, None, 200)
    times_s = np.arange(1, len(log) + 1, dtype=np.float64) * DT_S
    starts_s, plateaus_m = (
        np.array(each, dtype=float) for each in (SLIP_STARTS_S, ('0', *PLATEAUS_M))
    )
    curves = (
        Curve('friction', times_s[some], log[some, FRICTION], 'line', 0),
        Curve('position', times_s[some], log[some, POSITION], 'line', 1),
        Curve('reference', starts_s, plateaus_m, 'points', 2),
        Curve('', times_s[[0, -1]], np.full(2, float(LARGEST_FORCE_N)), 'dashed', 2),
    )
    title = 'LuGre: unit mass on a spring of 2 N/m, 0.1 m/s'
    return Panel(title, 'time (s)', 'friction (N), position (m)', curves)


def _drift_panel() -> Panel:
    curves = []
    for colour, (name, number) in enumerate((('LuGre', LUGRE), ('EPM', EPM))):
        positions_m = oscillation(number, 1.0)[::200, POSITION]
        cycles = np.arange(len(positions_m), dtype=np.float64) * (200.0 * DT_S)
        curves.append(Curve(f'{name}, 1 Hz', cycles, positions_m / MICRO, 'line', colour))
    numbers = np.arange(2, CYCLES + 2, dtype=np.float64)
    # The formula says how far each cycle creeps; its line is laid through the last cycle.
    rest_m = oscillation(LUGRE, 1.0)[-1, POSITION] - numbers[-1] * lugre_drift_m()
    line_um = (rest_m + numbers * lugre_drift_m()) / MICRO
    curves.append(Curve('slope of the formula of LuGre', numbers, line_um, 'points', 2))
    title = 'Creep under a force from 0.2 to 0.8 N, Fs = 1.5 N'
    return Panel(title, 'cycles', 'position (um)', curves)


FRICTION_LAWS = Family(
    'Friction laws',
    (_benchmark, _drift, _steady_sliding, _dahl, _coulomb),
    (_stick_slip_panel, _drift_panel),
)
