# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""What one periodic wave does to a stand, without sensors, once the drive is steady."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.drive.advance import RAMP_END, RAMP_MEAN, observe_samples
from stickslip_ros.drive.build import plant_of, start_clock, state_at_rest
from stickslip_ros.drive.long_step import LANES
from stickslip_ros.drive.records import ALL, FOOT, FORCE, POSITION, TIME, Wave
from stickslip_ros.drive.waveform import table
from stickslip_ros.kernels.record import Record
from stickslip_ros.lab.runs.courses import Course, cycles_of
from stickslip_ros.lab.runs.sawtooth_run import force_at_n
from stickslip_ros.parameters import Parameters
from stickslip_ros.process.stopping import stop_if_asked

_WINDOW = 20  # cycles of a mean; two means one after the other tell whether a drive is steady
_CYCLES_MAX = 400  # cycles after which a drive that is not steady is measured as it is
CHANGE = 1e-3  # share by which the mean of a window may change in a steady drive
RESOLUTION_M = 1e-11  # change of a mean position, m, or of a step that is none
_kept_plant = lru_cache(maxsize=LANES)(plant_of)  # for many waves and loads; not to be written
SAMPLES = 256  # samples of the cycle that is looked at
CONTACT_SHARE = FORCE + 1
"""Column of a trace: force of all contacts as a share of their friction limit."""


@dataclass(frozen=True)
class SteadyCycle:
    """What a periodic wave does to a drive: means over the last window, and how it goes on."""

    speed_m_per_s: float  # in the wanted direction
    position_m: float  # of the runner
    work_j: float  # of the feet in a cycle
    sense: float  # the wanted direction: +1 or -1
    drive: tuple[Record, Record, Wave, float]  # plants and states, wave, load along +x (N)

    @property
    def step_m(self) -> float:
        """Net motion per cycle, m."""
        return self.speed_m_per_s * self.drive[2].period_s

    @property
    def force_n(self) -> float:
        """Force in the load cell at the mean position, less that of the feet's mean way."""
        foot_m, plant = self.trace()[:, FOOT], self.drive[0][0]
        feet_m = float((foot_m[1:] + foot_m[:-1]).mean()) / 2.0
        return self.sense * (force_at_n(plant, self.position_m) - force_at_n(plant, feet_m))

    @property
    def vibration_m_per_s(self) -> float:
        """Root mean square of the runner's velocity about its mean, over a cycle."""
        steps = np.diff(self.trace(), axis=0)
        return float((steps[:, POSITION] / steps[:, TIME]).std())

    def trace(self, *, contacts: bool = False) -> Array:
        """
        Play another cycle: time (s), voltage (V), mean foot, runner (m), cell (N), CONTACT_SHARE.

        CONTACT_SHARE is there in every row if it is asked for, which takes longer.

        """
        trace, log = np.full((SAMPLES + 1, CONTACT_SHARE + 1), np.nan), np.empty((1, 3))
        plants, states, wave, load_n = self.drive
        states, limit_n = states.copy(), plants['contacts']['curve']['force_max_n'][0, ALL]
        for number, part in enumerate(np.split(trace, range(1, SAMPLES + 1) if contacts else [1])):
            truth = np.empty((len(part), CONTACT_SHARE))
            sample_s = min(number, 1) * wave.period_s / SAMPLES
            observe_samples(plants, states, wave, load_n, sample_s, truth, log)
            part[:, :CONTACT_SHARE] = truth
            part[-1, CONTACT_SHARE] = states['contact_n'].item() / limit_n
        trace[:, TIME] = np.linspace(0.0, wave.period_s, SAMPLES + 1)
        return trace


def measure(
    parameters: Parameters,
    rows: Array,
    load_n: float = 0.0,
    sense: float = 1.0,
    change: float = CHANGE,
) -> Course[SteadyCycle]:
    """
    Play a wave from rest until the drive is steady, 400 cycles at most.

    The rows are those of ``playable``; the load is against the wanted direction, the ``sense``.
    ``change`` is the share by which the mean of a window may change in a steady drive.

    """
    parameters = parameters.updated({'amplifier.voltage_initial': float(rows[0, 1])})
    # Roughness that travels is written into its plant.
    plants = (plant_of if parameters.contact.travel else _kept_plant)(parameters)
    states = state_at_rest(plants, parameters.stand.preload)
    wave, load_n = table(rows, 0), -sense * load_n
    start_clock(states)
    is_free = parameters.load_cell.contact == 'absent'
    mean_m, cycles, steady = 0.0, 0, False
    while not steady and cycles < _CYCLES_MAX:
        stop_if_asked()
        before_m, before_j = mean_m, float(states['sums']['feet_work_j'].item())
        ramps = yield from cycles_of(plants, states, wave, _WINDOW, load_n)
        step_m = float(ramps[-1, RAMP_END] - ramps[0, RAMP_END]) / (_WINDOW - 1)
        position_m = float(ramps[:, RAMP_MEAN].mean())
        mean_m = step_m if is_free else position_m
        steady = abs(mean_m - before_m) <= max(change * abs(mean_m), RESOLUTION_M)
        cycles += _WINDOW
    work_j, speed_m_per_s = states['sums']['feet_work_j'].item(), sense * step_m / wave.period_s
    drive, work_j = (plants, states, wave, load_n), (float(work_j) - before_j) / _WINDOW
    return SteadyCycle(speed_m_per_s, position_m, work_j, sense, drive)
