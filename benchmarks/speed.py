# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""How fast the drive is, and how exact, at several time steps; and with set-up, sensors, file."""

from collections.abc import Callable
from functools import partial

from benchmarks.case import (
    AMPLITUDE_M,
    FREQUENCY_HZ,
    PERIOD_S,
    Ours,
    standard_case,
    worst_error,
)
from benchmarks.clock import Program, in_turn
from benchmarks.outcome import Outcome, Row
from benchmarks.sizes import Sizes
from stickslip_ros.lab.runs.sawtooth_run import run_drive, simulate

NAN = float('nan')
LAYOUTS: dict[str, dict[str, object]] = {
    'run_drive, guide': {'feet.count': [6, 1], 'feet.share': [0.4, 0.2], 'feet.gain': [1, 0]},
    'run_drive, three delays': {
        'feet.count': [1] * 4,
        'feet.share': 0.5,
        'feet.delay': [k / (4.0 * FREQUENCY_HZ) for k in range(4)],
    },
}
"""Runs of other feet."""


def run(sizes: Sizes) -> Outcome:
    """Measure the drive alone, with its set-up, and with its sensors."""
    reference_n = Ours(standard_case({'sim.dt': sizes.converged_s}), sizes.cycles)()
    parameters, cycles, standard = standard_case(), sizes.cycles, (AMPLITUDE_M, FREQUENCY_HZ)
    simulated = partial(
        simulate, parameters, amplitude_m=AMPLITUDE_M, frequency_hz=FREQUENCY_HZ, steps=cycles
    )
    default_s, run_one = parameters.sim.dt, partial(run_drive, parameters, *standard, cycles)
    calls: list[tuple[str, float, Callable[[], object]]] = [
        *(
            ('drive.advance', step_s, Ours(standard_case({'sim.dt': step_s}), cycles))
            for step_s in sizes.steps_s
        ),
        ('run_drive', default_s, run_one),
        *(
            (name, default_s, partial(run_drive, standard_case(values), *standard, cycles))
            for name, values in LAYOUTS.items()
        ),
        ('simulate, no file', default_s, partial(simulated, record=False)),
        ('simulate', default_s, simulated),
    ]
    times = in_turn([Program(call, cycles * PERIOD_S) for _, _, call in calls], sizes)
    rows: list[Row] = []
    for i, (name, step_s, call) in enumerate(calls):
        speeds = 1.0 / times.seconds[i]
        rows.append(
            {
                'program': name,
                'longest_step': f'{step_s * 1e6:g} us',
                'times_real_time': 1.0 / times.median(i),
                'lowest': float(speeds.min()),
                'highest': float(speeds.max()),
                'worst_error': worst_error(call(), reference_n) if isinstance(call, Ours) else NAN,
                'energy_residual': call.energy_residual() if isinstance(call, Ours) else NAN,
            }
        )
    return Outcome(
        'Speed and accuracy of the standard case (equivalent rough profile)',
        rows,
        [
            f'worst error of all cycles, against longest_step = {sizes.converged_s * 1e6:g} us',
            (
                'run_drive and simulate are timed as whole calls, with set-up; simulate runs the '
                'sensors and records to a temporary file, unless it says no file'
            ),
        ],
    )
