# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Answers for the whole drive: eight cycles of a 1 kHz saw-tooth from rest."""

from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.contact.memory import fresh_memory
from stickslip_ros.drive.advance import RAMP_END, RAMP_MEAN
from stickslip_ros.drive.build import change_preload, plant_of, start_clock, state_at_rest
from stickslip_ros.drive.ledger import take_ledger
from stickslip_ros.drive.records import ALL
from stickslip_ros.drive.waveform import sawtooth
from stickslip_ros.lab.runs.courses import cycles_of, run_course
from stickslip_ros.lab.validation.contacts import follow_curve
from stickslip_ros.parameters import Parameters

DRIVEN_CYCLES = 8
FREQUENCY_HZ = 1e3


class CycleMotion(NamedTuple):
    """Runner position, mean and end of each cycle, m; total friction loss, J."""

    means_m: Array
    ends_m: Array
    lost_j: float


@lru_cache(maxsize=32)
def _motion(voltage_v: float, load_n: float, *changes: tuple[str, float | str]) -> CycleMotion:
    rest_v = max(-voltage_v, 0.0)
    parameters = Parameters().updated({**dict(changes), 'amplifier.voltage_initial': rest_v})
    plants = plant_of(parameters)
    states = state_at_rest(plants, parameters.stand.preload)
    if parameters.stand.preload_end:
        change_preload(plants, states, parameters, parameters.stand.preload_end)
    start_clock(states)
    frequency_hz = float(np.copysign(FREQUENCY_HZ, voltage_v))
    wave = sawtooth(0.0, abs(voltage_v), frequency_hz, DRIVEN_CYCLES + 1)
    ramps = run_course(cycles_of(plants, states, wave, DRIVEN_CYCLES, load_n))
    lost_j = take_ledger(plants, states).contact_lost_j
    return CycleMotion(ramps[:, RAMP_MEAN], ramps[:, RAMP_END], lost_j)


def motion(voltage_v: float, load_n: float = 0.0, **changes: Any) -> CycleMotion:
    """Run the drive with changed parameters; a voltage below 0 drives it backwards."""
    kinds = {name: type(value) for name, value in Parameters().flat().items()}
    return _motion(voltage_v, load_n, *((name, kinds[name](changes[name])) for name in changes))


def travel_force_n(place: float, preload_n: float, travel: float, displacement_m: float) -> float:
    """Return the force of contacts pulled from rest, at a place of travelling roughness."""
    changes = {'contact.profile': 'rough_line', 'contact.travel': travel}
    plants = plant_of(Parameters().updated({**changes, 'stand.preload': preload_n}))
    states, log = state_at_rest(plants, preload_n), np.zeros((1, 3))
    states['contacts']['window_m'] = place * plants[0].track.spacing_m
    take_ledger(plants, states)  # tabulates the windows
    follow_curve(plants[0].contacts[ALL].curve, fresh_memory(), np.array([displacement_m]), log)
    return float(log[0, 0])


ANSWERS: Mapping[str, Callable[..., Any]] = {
    'drive_mean_m': lambda cycle, **case: motion(**case).means_m[round(cycle) - 1],  # force / k
    'drive_end_m': lambda cycle, **case: motion(**case).ends_m[round(cycle) - 1],
    'drive_loss_j': lambda **case: motion(**case).lost_j,
    'travel_force_n': travel_force_n,
}
"""Functions by quantity; the name ends with the unit."""
