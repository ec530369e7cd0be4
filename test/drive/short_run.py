# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A short run of everything in the drive, bit by bit: as a module, or as a program that prints."""

import json
import sys
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from stickslip_ros.drive.advance import advance
from stickslip_ros.drive.build import plant_of, state_at_rest
from stickslip_ros.drive.waveform import sawtooth, with_missed_steps
from stickslip_ros.kernels.cache import CONFIG
from stickslip_ros.parameters import Parameters

PLAIN = {'runner.damping': 80.0, 'sim.dt': 1e-6, 'stand.preload': 0.1}
EVERYTHING = {
    'amplifier.resolution': 0.5,
    'amplifier.bandwidth': 1e5,
    'actuator.hysteresis': 0.15,
    'actuator.creep': 0.02,
    'actuator.resonance': 1e5,
    'actuator.gain_tolerance': 0.1,
    'load_cell.contact': 'one_sided',
    'load_cell.resonance': 1500.0,
    'load_cell.restitution': 0.5,
    'frame.mass': 0.02,
    'frame.resonance': 1e4,
    'actuator.stiffness': 4e7,
    'stand.stop_stiffness': 1e6,
}


def short_run(
    values: Mapping[str, object] = PLAIN, loads_n: Sequence[float] = (0.0,) * 5 + (-0.05,) * 10
) -> list[list[str]]:
    """Return every number of the state after each fifth of a millisecond, exactly."""
    parameters = Parameters().updated(values)
    plants, ramps = plant_of(parameters), np.zeros((8, 3))
    states = state_at_rest(plants, parameters.stand.preload)
    wave = with_missed_steps(sawtooth(0.0, 300.0, -1700.0, 4), 0.3, 1)
    lines = []
    for load_n in loads_n:
        advance(plants, states, wave, load_n, 2e-4, ramps)
        lines.append(list(_numbers(states.item())))
    return [[float(number).hex() for number in line] for line in [*lines, *ramps]]


def _numbers(value: Any) -> Iterator[float]:
    """Walk through all numbers of a record; zeros at the end of an array are left out."""
    if isinstance(value, np.ndarray):
        value = value if value.dtype.names else np.trim_zeros(value.ravel(), 'b')
        value = value.tolist()
    if isinstance(value, tuple | list):
        for element in value:
            yield from _numbers(element)
    else:
        yield value


def all_runs() -> list[list[str]]:
    """Return a run of the ideal drive, and a shorter one of everything that can be on."""
    return short_run() + short_run(EVERYTHING, (0.0, 0.1))


if __name__ == '__main__':
    json.dump({'interpreted': bool(CONFIG.DISABLE_JIT), 'run': all_runs()}, sys.stdout)
