# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Errors of the default step over random stands: bounds that the README states."""

from typing import Any

import numpy as np

from benchmarks.outcome import Outcome, Row
from benchmarks.sizes import Sizes
from stickslip_ros.arrays import Array
from stickslip_ros.drive.advance import RAMP_END, RAMP_MEAN
from stickslip_ros.drive.build import plant_of, start_clock, state_at_rest
from stickslip_ros.drive.waveform import sawtooth
from stickslip_ros.lab.runs.courses import cycles_of, run_course
from stickslip_ros.parameters import Parameters

CYCLES, FINER, SEED = 12, 16.0, 57
IDEAL: dict[str, Any] = {
    'amplifier.bandwidth': 0.0,
    'actuator.resonance': 0.0,
    'actuator.hysteresis': 0.0,
    'actuator.gain_tolerance': 0.0,
}
KINDS = {
    'ideal': IDEAL,
    'low-pass': IDEAL | {'amplifier.bandwidth': 1.0},
    'resonance': IDEAL | {'actuator.resonance': 1.0},
    'low-pass and resonance': IDEAL | {'amplifier.bandwidth': 1.0, 'actuator.resonance': 1.0},
    'all, with hysteresis and unequal feet': dict.fromkeys(IDEAL, 1.0),
}
"""Parts that are drawn (1.0) or left out (0.0)."""


def run(sizes: Sizes) -> Outcome:
    """Compare runs from rest, of each kind a fifth of the stands."""
    draws, rows = np.random.default_rng(SEED), list[Row]()
    for kind, parts in KINDS.items():
        errors = [error_of(*random_stand(draws, parts)) for _ in range(sizes.stands)]
        rows.append({
            'stands': kind,
            'median': float(np.median(errors)),
            '95 %': float(np.quantile(errors, 0.95)),
            'largest': float(np.max(errors)),
        })  # fmt: skip
    note = (
        f'{sizes.stands} random stands of each kind, {CYCLES} cycles; largest error of mean or '
        f'end of a cycle, of the largest position, against sim.dt/{FINER:g}'
    )
    return Outcome('Accuracy of the default step', rows, [note])


def random_stand(
    draws: np.random.Generator, parts: dict[str, float]
) -> tuple[dict[str, Any], float, float]:
    """Return settings, voltage and frequency of a random stand."""

    def between(low: float, high: float) -> float:
        return float(np.exp(draws.uniform(np.log(low), np.log(high))))

    drawn = {
        'amplifier.bandwidth': between(2e4, 4e5),
        'actuator.resonance': between(2e4, 4e5),
        'actuator.hysteresis': between(0.02, 0.2),
        'actuator.gain_tolerance': between(0.01, 0.1),
    }
    settings: dict[str, Any] = {name: parts[name] * value for name, value in drawn.items()}
    settings |= {
        'actuator.damping_ratio': between(0.02, 0.8),
        'stand.preload': between(0.1, 1.0),
        'runner.damping': float(draws.choice((0.0, 20.0))),
        'load_cell.contact': str(draws.choice(('absent', 'attached'))),
        'contact.profile': str(draws.choice(('rough', 'smooth'))),
    }
    return settings, float(draws.uniform(90.0, 290.0)), between(150.0, 1500.0)


def error_of(settings: dict[str, Any], voltage_v: float, frequency_hz: float) -> float:
    """Return the largest error of a position, of the largest position."""
    step_s = Parameters().sim.dt
    coarse_m, fine_m = (
        positions_m(settings | {'sim.dt': dt_s}, voltage_v, frequency_hz)
        for dt_s in (step_s, step_s / FINER)
    )
    return float(np.max(np.abs(coarse_m - fine_m)) / np.max(np.abs(fine_m)))


def positions_m(settings: dict[str, Any], voltage_v: float, frequency_hz: float) -> Array:
    """Return mean and end of each cycle from rest, m."""
    parameters = Parameters().updated(settings)
    plants = plant_of(parameters)
    states = state_at_rest(plants, parameters.stand.preload)
    start_clock(states)
    wave = sawtooth(0.0, voltage_v, frequency_hz, CYCLES + 1)
    ramps = run_course(cycles_of(plants, states, wave, CYCLES, 0.0))
    return np.asarray(ramps[:, [RAMP_MEAN, RAMP_END]])
