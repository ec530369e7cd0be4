"""Checks of the rival friction laws: benchmark, closed forms, Coulomb in the drive."""

from math import tanh

import numpy as np

from stickslip_ros.contact.laws import DAHL, EPM, LUGRE
from stickslip_ros.contact.profile import Array
from stickslip_ros.validation.checks import (
    ROUNDING,
    Check,
    Scale,
    Tolerance,
    compare,
    compare_printed,
    compare_worst,
)
from stickslip_ros.validation.coulomb import coulomb
from stickslip_ros.validation.findings import Curve, Findings, Panel
from stickslip_ros.validation.histories import zigzag
from stickslip_ros.validation.law_drivers import (
    COULOMB_N,
    CYCLES,
    DT_S,
    FRICTION,
    POSITION,
    SIGMA_0,
    SIGMA_2,
    STATIC_RATIO,
    STRIBECK_M_PER_S,
    benchmark_law,
    drift_per_cycle,
    lugre_drift_m,
    oscillation,
    plain_law,
    slip_starts,
    stick_slip,
    trace,
)

SLIP_STARTS_S = ('7.438', '13.800', '20.163')
PLATEAUS_M = ('0.6363', '1.2726')
LARGEST_FORCE_N = '1.477'
BEFORE_SLIP_S = 0.05
"""How long before the next slip a plateau is read."""
SLOW_HZ = 0.25
QUASI_STATIC = Tolerance(1e-4, 'inertia and bristle damping at 0.25 Hz; falls as the square of it')
NO_DRIFT = Tolerance(1e-12, 'rounding of the position')
AMPLITUDE_M = 1.3e-5
DAHL_CYCLES = 30
LOOP = Tolerance(1e-9, f'{DAHL_CYCLES} cycles of settling')
STEPS = 400
LOSS = Tolerance(1e-5, f'trapezoidal rule of the loss, {STEPS} steps per leg')
DEFLECTION = Scale(STATIC_RATIO / SIGMA_0, 'the deflection Fs/sigma0')
LONG_S, SLIDES = 1.0, 200
TEXT = 'reference figures, benchmark of Canudas de Wit et al. 1995'


def friction_laws() -> Findings:
    """Check LuGre, EPM, Dahl and Coulomb."""
    record = stick_slip()
    checks = (*_benchmark(record), *_drift(), *_steady_sliding(), *_dahl(), *coulomb())
    return Findings('Friction laws', checks, (_stick_slip_panel(record), _drift_panel()))


def _benchmark(record: Array) -> list[Check]:
    starts_s = slip_starts(record)
    checks = [
        compare_printed(f'LuGre: start of slip {number}', f'{TEXT}; v > vs', figure, ours_s, 's')
        for number, (figure, ours_s) in enumerate(
            zip(SLIP_STARTS_S, starts_s.tolist(), strict=True), start=1
        )
    ]
    for number, figure in enumerate(PLATEAUS_M, start=1):
        row = round((float(starts_s[number]) - BEFORE_SLIP_S) / DT_S)
        place_m = float(record[row, POSITION])
        checks.append(compare_printed(f'LuGre: plateau {number}', TEXT, figure, place_m, 'm'))
    largest_n = float(np.max(record[:, FRICTION]))
    checks.append(compare_printed('LuGre: largest force', TEXT, LARGEST_FORCE_N, largest_n, 'N'))
    return checks


def _drift() -> list[Check]:
    """Check the creep under an oscillating force below the static friction."""
    lugre_m = drift_per_cycle(oscillation(LUGRE, SLOW_HZ))
    epm_m = drift_per_cycle(oscillation(EPM, SLOW_HZ))
    formula = '(Fs/sigma0) ln[(Fs^2 - F1^2)/(Fs^2 - F2^2)]'
    name, nothing = 'EPM: drift per cycle below z_ba', 'none: elastic (Dupont et al. 2002)'
    return [
        compare('LuGre: drift per cycle', formula, lugre_drift_m(), lugre_m, 'm', QUASI_STATIC),
        compare_worst(name, nothing, [0.0], [epm_m], 'm', NO_DRIFT, DEFLECTION),
    ]


def _steady_sliding() -> list[Check]:
    """Check the force of steady sliding on both sides of the Stribeck velocity."""
    speeds = STRIBECK_M_PER_S * np.logspace(-1.0, 1.0, 21, dtype=np.float64)
    decay = np.exp(-((speeds / STRIBECK_M_PER_S) ** 2))
    expected_n = COULOMB_N * (1.0 + (STATIC_RATIO - 1.0) * decay) + SIGMA_2 * speeds
    text = 'Fc + (Fs - Fc) exp(-(v/vs)^2) + sigma2 v'
    checks = []
    for name, number in (('LuGre', LUGRE), ('EPM', EPM)):
        ours_n = [
            trace(benchmark_law(number), speed * LONG_S * np.arange(SLIDES + 1), LONG_S)[0][-1]
            for speed in speeds
        ]
        sliding = f'{name}: steady sliding, vs/10 to 10 vs'
        checks.append(compare_worst(sliding, text, expected_n, ours_n, 'N', ROUNDING))
    return checks


def _dahl() -> list[Check]:
    law, scale = plain_law(DAHL), Scale(COULOMB_N, 'Fc')
    places_m = np.linspace(0.0, 6e-5, 50, dtype=np.float64)
    virgin_n = COULOMB_N * (1.0 - np.exp(-SIGMA_0 * places_m / COULOMB_N))
    turns = (AMPLITUDE_M, -AMPLITUDE_M) * DAHL_CYCLES
    forces_n, lost_j = trace(law, zigzag(turns, STEPS))
    steady_n = COULOMB_N * tanh(SIGMA_0 * AMPLITUDE_M / COULOMB_N)
    loss_j = 4.0 * COULOMB_N * (AMPLITUDE_M - steady_n / SIGMA_0)
    ends_n = forces_n[[-1 - STEPS, -1]]
    virgin = 'Fc (1 - exp(-sigma0 x/Fc))'
    loop, area = 'Fc tanh(sigma0 X/Fc)', '4 Fc [X - (Fc/sigma0) tanh(sigma0 X/Fc)]'
    cycle_j = float(lost_j[-1] - lost_j[-1 - 2 * STEPS])
    return [
        compare_worst(
            'Dahl: virgin curve', virgin, virgin_n, trace(law, places_m)[0], 'N', ROUNDING, scale
        ),
        compare_worst('Dahl: ends of the loop', loop, [steady_n, -steady_n], ends_n, 'N', LOOP),
        compare('Dahl: loss per cycle', area, loss_j, cycle_j, 'J', LOSS),
    ]


def _stick_slip_panel(record: Array) -> Panel:
    some = slice(None, None, 200)
    times_s = np.arange(1, len(record) + 1, dtype=np.float64) * DT_S
    starts_s = np.array(SLIP_STARTS_S, dtype=float)
    plateaus_m = np.array(('0', *PLATEAUS_M), dtype=float)
    return Panel(
        'LuGre: unit mass on a spring of 2 N/m, 0.1 m/s',
        'time (s)',
        'friction (N), position (m)',
        (
            Curve('friction', times_s[some], record[some, FRICTION], 'line', 0),
            Curve('position', times_s[some], record[some, POSITION], 'line', 1),
            Curve('reference', starts_s, plateaus_m, 'points', 2),
            Curve('', times_s[[0, -1]], np.full(2, float(LARGEST_FORCE_N)), 'dashed', 2),
        ),
    )


def _drift_panel() -> Panel:
    curves = []
    for colour, (name, number) in enumerate((('LuGre', LUGRE), ('EPM', EPM))):
        positions_m = oscillation(number)[::200, POSITION]
        cycles = np.arange(len(positions_m), dtype=np.float64) * (200.0 * DT_S)
        curves.append(Curve(f'{name}, 1 Hz', cycles, positions_m * 1e6, 'line', colour))
    numbers = np.arange(2, CYCLES + 2, dtype=np.float64)
    # The formula says how far each cycle creeps; its line is laid through the last cycle.
    rest_m = oscillation(LUGRE)[-1, POSITION] - numbers[-1] * lugre_drift_m()
    line_um = (rest_m + numbers * lugre_drift_m()) * 1e6
    curves.append(Curve('slope of the formula of LuGre', numbers, line_um, 'points', 2))
    return Panel(
        'Creep under a force from 0.2 to 0.8 N, Fs = 1.5 N',
        'cycles',
        'position (um)',
        tuple(curves),
    )
