# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Answers for other layouts of feet: steps, forces and energies of saw-tooth cycles from rest."""

from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from stickslip_ros.drive.advance import RAMP_END, RAMP_MEAN
from stickslip_ros.drive.build import plant_of, start_clock, state_at_rest
from stickslip_ros.drive.ledger import take_ledger
from stickslip_ros.drive.waveform import sawtooth
from stickslip_ros.lab.runs.courses import cycles_of, run_course
from stickslip_ros.parameters import Parameters

LOWER = float(np.sqrt(2.0) / 4.0)
WALKING_FEET = 6
LAYOUTS: Mapping[str, Mapping[str, Any]] = {
    'stand': {},
    'three_feet': {'feet.count': 3, 'feet.share': 8.0 * LOWER / 3.0},
    'clamp': {'feet.count': (1, 1), 'feet.share': 1.0, 'feet.gain': (1.0, 0.0)},
    'light_clamp': {'feet.count': (1, 1), 'feet.share': (1.0, 0.3), 'feet.gain': (1.0, 0.0)},
    'walker': {'feet.count': (1,) * WALKING_FEET, 'feet.share': LOWER},
}


@lru_cache(maxsize=32)
def cycles(
    layout: str,
    voltage_v: float,
    frequency_hz: float,
    damping: float,
    cell_n_per_m: float,
    cycles: float,
    last: float,
    **rest: float,
) -> Mapping[str, float]:
    """Return mean and step, m, and loss and work of the feet, J, over the last cycles."""
    values = {
        **LAYOUTS[layout],
        'runner.damping': damping,
        'load_cell.contact': 'attached' if cell_n_per_m else 'absent',
    }
    if cell_n_per_m:
        values['load_cell.stiffness'] = cell_n_per_m
    if 'slew_v_per_s' in rest:
        values['amplifier.slew_rate'] = rest['slew_v_per_s']
    if layout == 'walker':
        delays = [k / (WALKING_FEET * frequency_hz) for k in range(WALKING_FEET)]
        values['feet.delay'] = delays
    parameters = Parameters().updated(values)
    plants, load_n = plant_of(parameters), rest.get('load_n', 0.0)
    states = state_at_rest(plants, parameters.stand.preload)
    start_clock(states)
    wave = sawtooth(0.0, voltage_v, frequency_hz, round(cycles) + 1)
    begun = run_course(cycles_of(plants, states, wave, round(cycles - last), load_n))
    before = take_ledger(plants, states)
    ramps = run_course(cycles_of(plants, states, wave, round(last), load_n))
    after, mean_m = take_ledger(plants, states), float(ramps[:, RAMP_MEAN].mean())
    return {
        'layout_mean_m': mean_m,
        'layout_force_n': cell_n_per_m * mean_m,
        'layout_step_m': float(ramps[-1, RAMP_END] - begun[-1, RAMP_END]) / last,
        'layout_loss_j': (after.contact_lost_j - before.contact_lost_j) / last,
        'layout_work_j': (after.feet_work_j - before.feet_work_j) / last,
    }


def _answer(quantity: str) -> Callable[..., float]:
    return lambda **case: cycles(**case)[quantity]


ANSWERS: Mapping[str, Callable[..., Any]] = {
    f'layout_{name}': _answer(f'layout_{name}')
    for name in ('mean_m', 'force_n', 'step_m', 'loss_j', 'work_j')
}
"""Functions by quantity; the name ends with the unit."""
