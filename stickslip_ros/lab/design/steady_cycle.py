# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The steady response of a stand to a periodic wave, without sensors."""

from dataclasses import dataclass

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.drive.advance import RAMP_END, RAMP_MEAN, observe_samples
from stickslip_ros.drive.build import start_clock, state_at_rest
from stickslip_ros.drive.records import FOOT, FORCE, POSITION, TIME, Wave
from stickslip_ros.drive.waveform import table
from stickslip_ros.kernels.record import Record
from stickslip_ros.lab.runs.courses import Course, cycles_of, shared_plant
from stickslip_ros.lab.runs.sawtooth_run import force_at_n
from stickslip_ros.parameters import Parameters
from stickslip_ros.process.stopping import stop_if_asked

_WINDOW = 20  # cycles of a mean; steady if two successive means agree
_CYCLES_MAX = 400  # cycles after which an unsteady drive is measured
CHANGE = 1e-3  # largest relative change of a steady mean
RESOLUTION_M = 1e-11  # negligible change of mean position or step, m
SAMPLES = 256  # samples of a traced cycle


@dataclass(frozen=True)
class SteadyCycle:
    """Means over the last window of a steady wave, and the state to continue from."""

    speed_m_per_s: float
    position_m: float  # of the runner
    work_j: float  # of the feet in a cycle
    drive: tuple[Record, Record, Wave, float]  # plants and states, wave, load along +x (N)

    @property
    def step_m(self) -> float:
        """Net motion per cycle, m."""
        return self.speed_m_per_s * self.drive[2].period_s

    @property
    def force_n(self) -> float:
        """Force in the load cell at the mean position, less that at the mean foot position."""
        foot_m, plant = self.trace()[:, FOOT], self.drive[0][0]
        feet_m = float((foot_m[1:] + foot_m[:-1]).mean()) / 2.0
        return force_at_n(plant, self.position_m) - force_at_n(plant, feet_m)

    @property
    def vibration_m_per_s(self) -> float:
        """Rms deviation of the runner velocity from its mean, over a cycle."""
        steps = np.diff(self.trace(), axis=0)
        return float((steps[:, POSITION] / steps[:, TIME]).std())

    def trace(self) -> Array:
        """Run another cycle: t (s), V, mean foot, runner (m), cell (N)."""
        plants, states, wave, load_n = self.drive
        states, log, trace = states.copy(), np.zeros((1, 3)), np.zeros((SAMPLES + 1, FORCE + 1))
        for part, sample_s in ((trace[:1], 0.0), (trace[1:], wave.period_s / SAMPLES)):
            observe_samples(plants, states, wave, load_n, sample_s, part, log)
        trace[:, TIME] = np.linspace(0.0, wave.period_s, SAMPLES + 1)
        return trace


def measure(
    parameters: Parameters, rows: Array, load_n: float = 0.0, change: float = CHANGE
) -> Course[SteadyCycle]:
    """
    Run a wave from rest until the means change by less than ``change``, at most 400 cycles.

    The rows are those of ``playable``; the load acts along -x.

    """
    parameters = parameters.updated({'amplifier.voltage_initial': float(rows[0, 1])})
    plants = shared_plant(parameters)
    states = state_at_rest(plants, parameters.stand.preload)
    wave, load_n = table(rows, 0), -load_n
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
    work_j, speed_m_per_s = states['sums']['feet_work_j'].item(), step_m / wave.period_s
    drive, work_j = (plants, states, wave, load_n), (float(work_j) - before_j) / _WINDOW
    return SteadyCycle(speed_m_per_s, position_m, work_j, drive)
