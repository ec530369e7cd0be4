"""A short run of everything in the drive, bit by bit: as a module, or as a program that prints."""

import json
import sys

import numba
import numpy as np

from stickslip_ros.drive.build import history_of, plant_of, state_at_rest
from stickslip_ros.drive.plant import advance
from stickslip_ros.drive.waveform import sawtooth
from stickslip_ros.parameters import Parameters


def short_run() -> list[list[str]]:
    """Return every number of the state after each fifth of a millisecond, exactly."""
    parameters = Parameters().updated(
        {'runner.damping': 80.0, 'sim.dt': 1e-6, 'stand.preload': 0.1}
    )
    plant, ramps = plant_of(parameters), np.zeros((8, 3))
    history = history_of(plant)
    state = state_at_rest(plant, history, parameters.stand.preload)
    wave = sawtooth(0.0, 300.0, -1700.0, 4)
    lines = []
    for load_n in [0.0] * 5 + [-0.05] * 10:
        state = advance(plant, history, state, wave, load_n, 2e-4, ramps)
        lines.append([*state.clock, *state[1:5], *state.contact.memory, *state.sums])
    return [[float(number).hex() for number in line] for line in [*lines, *ramps]]


if __name__ == '__main__':
    json.dump({'interpreted': bool(numba.config.DISABLE_JIT), 'run': short_run()}, sys.stdout)
