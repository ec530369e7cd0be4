"""What one periodic wave does to a stand, without sensors, once the drive is steady."""

from dataclasses import dataclass

import numpy as np

from stickslip_ros.contact.profile import Array
from stickslip_ros.drive.advance import (
    FOOT,
    FORCE,
    POSITION,
    RAMP_END,
    RAMP_MEAN,
    TIME,
    observe_samples,
)
from stickslip_ros.drive.build import plant_of, start_clock, state_at_rest
from stickslip_ros.drive.records import ALL
from stickslip_ros.drive.waveform import table
from stickslip_ros.parameters import Parameters
from stickslip_ros.process.stopping import stop_if_asked
from stickslip_ros.runs.courses import alone, cycles_of
from stickslip_ros.runs.sawtooth_run import force_at_n

WINDOW = 20  # cycles of a mean; two means one after the other tell whether a drive is steady
CYCLES_MAX = 400  # cycles after which a drive that is not steady is measured as it is
CHANGE = 1e-3  # share by which the mean of a window may change in a steady drive
RESOLUTION_M = 1e-11  # change of a mean position, m, or of a step that is none
SAMPLES = 256  # samples of the cycle that is looked at
CONTACT = FORCE + 1  # column of a trace: force of all contacts as a share of their friction limit


@dataclass(frozen=True)
class SteadyCycle:
    """What a periodic wave does to a drive: means over the last window, and the last cycle."""

    speed_m_per_s: float  # positive along +x
    force_n: float  # net: in the load cell at the mean position, less that of the feet's mean way
    work_j: float  # of the feet in a cycle
    vibration_m_per_s: float  # rms of the runner's velocity about its mean, over the last cycle
    trace: Array  # rows of time (s), voltage (V), mean foot (m), runner (m), cell (N), CONTACT

    @property
    def step_m(self) -> float:
        """Net motion per cycle, m."""
        return self.speed_m_per_s * float(self.trace[-1, TIME])


def measure(
    parameters: Parameters,
    rows: Array,
    load_n: float = 0.0,
    *,
    change: float = CHANGE,
    looks: bool = False,
) -> SteadyCycle:
    """
    Play a wave from rest until the drive is steady, 400 cycles at most, and look at a cycle.

    The rows are those of ``playable``; the load is along +x. ``change`` is the share by which the
    mean of a window may change in a steady drive. If it ``looks``, every row of the trace has the
    force of the contacts, which takes longer.

    """
    parameters = parameters.updated({'amplifier.voltage_initial': float(rows[0, 1])})
    plants = plant_of(parameters)
    states = state_at_rest(plants, parameters.stand.preload)
    wave = table(rows, 0)
    start_clock(states)
    is_free = parameters.load_cell.contact == 'absent'
    mean_m, cycles, steady = 0.0, 0, False
    while not steady and cycles < CYCLES_MAX:
        stop_if_asked()
        before_m, before_j = mean_m, float(states['sums']['feet_work_j'].item())
        ramps = alone(cycles_of(plants, states, wave, WINDOW, load_n))
        step_m = float(ramps[-1, RAMP_END] - ramps[0, RAMP_END]) / (WINDOW - 1)
        mean_m = step_m if is_free else float(ramps[:, RAMP_MEAN].mean())
        steady = abs(mean_m - before_m) <= max(change * abs(mean_m), RESOLUTION_M)
        cycles += WINDOW
    work_j = (float(states['sums']['feet_work_j'].item()) - before_j) / WINDOW
    trace, log = np.full((SAMPLES + 1, CONTACT + 1), np.nan), np.empty((1, 3))
    limit_n = float(plants['contacts']['curve']['force_max_n'][0, ALL])
    for number, part in enumerate(np.split(trace, range(1, SAMPLES + 1) if looks else [1])):
        truth, sample_s = np.empty((len(part), CONTACT)), min(number, 1) * wave.period_s / SAMPLES
        observe_samples(plants, states, wave, load_n, sample_s, truth, log)
        part[:, :CONTACT], part[-1, CONTACT] = truth, states['contact_n'].item() / limit_n
    trace[:, TIME] = np.linspace(0.0, wave.period_s, SAMPLES + 1)
    runner_m = ramps[:, RAMP_MEAN].mean()
    feet_m = float((trace[1:, FOOT] + trace[:-1, FOOT]).mean()) / 2.0
    return SteadyCycle(
        speed_m_per_s=step_m / wave.period_s,
        force_n=force_at_n(plants[0], runner_m) - force_at_n(plants[0], feet_m),
        work_j=work_j,
        vibration_m_per_s=float((np.diff(trace[:, POSITION]) / np.diff(trace[:, TIME])).std()),
        trace=trace,
    )
