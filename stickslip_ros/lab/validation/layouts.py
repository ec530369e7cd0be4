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


def _feet(count: Any, share: Any, gain: Any = 1.0, friction: Any = 0.0, young: Any = 0.0) -> Any:
    named = {'count': count, 'share': share, 'gain': gain, 'friction': friction, 'young': young}
    return {f'feet.{name}': value for name, value in named.items()}


LAYOUTS: Mapping[str, Mapping[str, Any]] = {
    'stand': {},
    'three_feet': _feet(3, 8.0 * LOWER / 3.0),
    'clamp': _feet((1, 1), 1.0, (1.0, 0.0)),
    'light_clamp': _feet((1, 1), (1.0, 0.3), (1.0, 0.0)),
    'walker': _feet((1,) * WALKING_FEET, LOWER),
    'ptfe_guide': _feet((2, 1), (0.5, 1.0), (1.0, 0.0), (0.0, 0.05), (0.0, 0.5e9)),
    'rolling_guide': _feet((3, 2), (0.33, 0.5), (1.0, 0.0), (0.21, 0.004), (68e9, 210e9)),
    'sapphire_pads': _feet((2, 4), (0.71, 0.35), 1.0, (0.17, 0.26), (435e9, 0.0)),
    'mixed_walker': _feet(
        (2, 2, 2), (0.47, 0.4, 0.33), (1.0, 0.9, 1.0), (0.0, 0.19, 0.24), (70e9, 435e9, 30e9)
    ),
    'radii': {
        'feet.count': (3, 2), 'feet.share': (0.71, 0.083), 'feet.gain': (1.0, 0.0),
        'feet.weight': (0.0, 0.5), 'feet.radius': (0.41e-3, 1.7e-3),
        'stand.weight': True, 'stand.preload': 0.43, 'runner.mass': 5.7e-3,
    },
    'gains': {
        'feet.count': (3, 1, 2), 'feet.share': (0.47, 0.13, 0.31),
        'feet.gain': (1.0, -0.31, 0.63), 'stand.preload': 0.49,
    },
    'stacks': {
        'feet.count': (2, 2, 3), 'feet.share': (0.57, 0.49, 0.17), 'feet.gain': (1.0, 0.93, 0.0),
        'feet.delay': (0.0, 0.417e-3, 0.0), 'stand.preload': 0.59,
        'actuator.stiffness': 2.3e7, 'actuator.resonance': 67e3, 'actuator.damping_ratio': 0.063,
        'frame.mass': 0.0041, 'frame.resonance': 2700.0, 'frame.damping_ratio': 0.043,
    },
    'frame': {
        'feet.count': (3, 2, 2), 'feet.share': (0.31, 0.42, 0.27), 'feet.gain': (1.0, -0.41, 0.77),
        'feet.delay': (0.0, 0.133e-3, 0.611e-3), 'stand.preload': 0.61, 'actuator.mass': 1.1e-4,
        'frame.mass': 0.0131, 'frame.resonance': 6100.0, 'frame.damping_ratio': 0.031,
    },
    'sled': {
        'feet.count': (2, 2), 'feet.share': (0.51, 0.29), 'feet.gain': (1.0, 0.0),
        'stand.preload': 0.53, 'actuator.mass': 3.1e-4,
        'frame.mass': 0.0117, 'frame.resonance': 5200.0, 'frame.damping_ratio': 0.037,
    },
    'tolerance': {
        'feet.count': (2, 2, 2), 'feet.share': (0.4, 0.5, 0.3), 'stand.preload': 0.46,
        'feet.delay': (0.0, 0.2e-3, 0.471e-3), 'actuator.gain_tolerance': 0.07,
    },
    'scatter': {
        'feet.count': (2, 1), 'feet.share': (0.45, 0.6), 'feet.gain': (1.0, 0.58),
        'stand.preload': 0.52, 'actuator.gain_tolerance': 0.05,
    },
    'button': {
        'feet.count': (2, 3), 'feet.share': (0.6, 0.33), 'feet.delay': (0.0, 0.2713e-3),
        'stand.preload': 0.51, 'load_cell.contact': 'one_sided', 'load_cell.gap': 2.1e-7,
        'load_cell.resonance': 1900.0, 'load_cell.damping_ratio': 0.12,
        'load_cell.restitution': 0.45,
    },
}  # fmt: skip


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
        'runner.damping': damping,
        'contact.loss_factor': rest.get('loss_factor', 0.0),
        'load_cell.contact': 'attached' if cell_n_per_m else 'absent',
        **LAYOUTS[layout],
    }
    if cell_n_per_m:
        values['load_cell.stiffness'] = cell_n_per_m
    if 'slew_v_per_s' in rest:
        values['amplifier.slew_rate'] = rest['slew_v_per_s']
    if layout.endswith('walker'):
        groups = len(values['feet.count'])
        values['feet.delay'] = [k / (groups * frequency_hz) for k in range(groups)]
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
