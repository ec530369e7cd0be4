"""One periodic wave on a stand, without sensors: its rows, and its steady cycle."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.record import Record
from stickslip_ros.drive.advance import (
    FOOT,
    FORCE,
    POSITION,
    RAMP_END,
    RAMP_MEAN,
    observe_samples,
)
from stickslip_ros.drive.build import (
    change_preload,
    plant_of,
    slew_of,
    start_clock,
    state_at_rest,
)
from stickslip_ros.drive.records import ALL, Wave
from stickslip_ros.drive.waveform import table
from stickslip_ros.errors import OutOfRange
from stickslip_ros.files import replacing
from stickslip_ros.parameters import Parameters
from stickslip_ros.stopping import heed_stop
from stickslip_ros.study.design.shapes import HEIGHT, TIME
from stickslip_ros.study.sawtooth_run import advance_cycles, force_at_n

WINDOW = 20
"""Cycles of a mean; two means one after the other tell whether a drive is steady."""
CYCLES_MAX = 400
"""Cycles after which a drive that is not steady is measured as it is."""
CHANGE = 1e-3
"""Share by which the mean of a window may change in a steady drive."""
RESOLUTION_M = 1e-11
"""Change of a mean position, m, or of a step that is none."""
SAMPLES = 256
"""Samples of the cycle that is looked at."""
SLEW_SLACK = 1e-9
"""Share by which a wave stays below the slew rate, so that the amplifier never limits it."""
SPRINGS_RATE, SPRINGS_WAY = 1e-6, 1e-5
"""Preload's rate, N/s, and share by which it changes while springs hold the history."""


@dataclass(frozen=True)
class SteadyCycle:
    """
    What a periodic wave does to a drive.

    Attributes
    ----------
    speed_m_per_s : float
        Mean over the last window; positive along +x.
    force_n : float
        Net force: in the load cell at the mean position, less that of the feet's mean way.
    work_j : float
        Work of the feet in a cycle, mean of the last window.
    vibration_m_per_s : float
        Root mean square of the runner's velocity about its mean, over the last cycle.
    cycles : int
        Cycles made.
    steady : bool
        Whether the mean changed by less than 0.1 % (or 10 pm) in 20 of them.
    trace : array, shape (n, 5) or (n, 6)
        Time of the last cycle (s), voltage (V), mean foot (m), runner (m), load cell (N); force
        of all contacts as a share of their friction limit, 1 or -1 in full slip.

    """

    speed_m_per_s: float
    force_n: float
    work_j: float
    vibration_m_per_s: float
    cycles: int
    steady: bool
    trace: Array

    @property
    def step_m(self) -> float:
        """Net motion per cycle, m."""
        return self.speed_m_per_s * float(self.trace[-1, 0])


def playable(rows: Array, parameters: Parameters, voltage_v: float, frequency_hz: float) -> Array:
    """
    Return a shape as rows of time (s) and voltage (V), within range and slew rate.

    What is steeper than the slew rate, a jump above all, takes the time that it needs; the rest of
    the cycle is played as much faster.

    Raises
    ------
    OutOfRange
        If the voltage is outside the range, or rise and fall need more than the cycle.

    """
    amplifier, period_s = parameters.amplifier, 1.0 / frequency_hz
    range_v = amplifier.voltage_max - amplifier.voltage_min
    if not 0.0 < voltage_v <= range_v * (1.0 + SLEW_SLACK):
        limit = f'not above 0 V and up to {range_v:g} V'
        raise OutOfRange('voltage of a wave', voltage_v, 'V', limit, 'see amplifier.voltage_max')
    steps = np.diff(rows, axis=0)
    wanted_s = steps[:, TIME] * period_s
    slew_v_per_s = slew_of(parameters)
    needed_s = np.abs(steps[:, HEIGHT]) * voltage_v * (1.0 + SLEW_SLACK) / slew_v_per_s
    if needed_s.sum() >= period_s:
        limit = f'more than the slew rate of {slew_v_per_s:g} V/s allows at {voltage_v:g} V'
        raise OutOfRange('frequency', frequency_hz, 'Hz', limit, 'lower it or the voltage')
    steep = np.zeros(len(steps), dtype=np.bool_)
    while True:
        pace = (period_s - needed_s[steep].sum()) / wanted_s[~steep].sum()
        more = needed_s > pace * wanted_s
        if (more == steep).all():
            break
        steep = more
    lasts_s = np.where(steep, needed_s, pace * wanted_s)
    kept = np.concatenate(([True], lasts_s > 0.0))
    time_s = np.concatenate(([0.0], np.cumsum(lasts_s)))[kept]
    volts = amplifier.voltage_min + voltage_v * rows[kept, HEIGHT]
    return np.column_stack((time_s * (period_s / time_s[-1]), volts))


def measure(
    parameters: Parameters,
    rows: Array,
    load_n: float = 0.0,
    *,
    change: float = CHANGE,
    on_springs: bool = False,
    looks: bool = False,
) -> SteadyCycle:
    """
    Play a wave from rest until the drive is steady, 400 cycles at most, and look at a cycle.

    Parameters
    ----------
    parameters : Parameters
        The stand; ``load_cell.contact`` says whether the runner is free.
    rows : array, shape (n, 2)
        One cycle: time (s) and voltage (V), as ``playable`` makes it.
    load_n : float
        External force along +x, N.
    change : float
        Share by which the mean of a window may change in a steady drive.
    on_springs : bool
        Whether springs, not turning points, hold the history of the contacts.
    looks : bool
        Whether the trace tells the state of the contacts, which takes longer.

    """
    parameters = parameters.updated({'amplifier.voltage_initial': float(rows[0, 1])})
    plants = plant_of(parameters)
    states = state_at_rest(plants, parameters.stand.preload)
    if on_springs:
        _keep_on_springs(plants, states, parameters)
    wave = table(rows, 0)
    start_clock(states)
    means = [0.0]
    while True:
        heed_stop()
        before_j = float(states['sums']['feet_work_j'].item())
        ramps = advance_cycles(plants, states, wave, WINDOW, load_n)
        work_j = (float(states['sums']['feet_work_j'].item()) - before_j) / WINDOW
        step_m = float(ramps[-1, RAMP_END] - ramps[0, RAMP_END]) / (WINDOW - 1)
        is_free = parameters.load_cell.contact == 'absent'
        means.append(step_m if is_free else float(ramps[:, RAMP_MEAN].mean()))
        change_m = abs(means[-1] - means[-2])
        steady = change_m <= max(change * abs(means[-1]), RESOLUTION_M)
        cycles = WINDOW * (len(means) - 1)
        if steady or cycles >= CYCLES_MAX:
            break
    trace = (_trace_with_contacts if looks else _trace)(plants, states, wave, load_n)
    velocity_m_per_s = np.diff(trace[:, POSITION]) / np.diff(trace[:, 0])
    runner_m = ramps[:, RAMP_MEAN].mean()
    feet_m = float((trace[1:, FOOT] + trace[:-1, FOOT]).mean()) / 2.0
    return SteadyCycle(
        speed_m_per_s=step_m / wave.period_s,
        force_n=force_at_n(plants[0], runner_m) - force_at_n(plants[0], feet_m),
        work_j=work_j,
        vibration_m_per_s=float(velocity_m_per_s.std()),
        cycles=cycles,
        steady=steady,
        trace=trace,
    )


def _keep_on_springs(plants: Record, states: Record, parameters: Parameters) -> None:
    """Let springs hold the history, which turning points would take back at a full slip."""
    plants['contacts']['preload_n_per_s'] = SPRINGS_RATE
    preload_n = parameters.stand.preload * (1.0 + SPRINGS_WAY)
    change_preload(plants, states, parameters, preload_n)


def _trace(plants: Record, states: Record, wave: Wave, load_n: float) -> Array:
    """Follow a cycle in samples; the first row is its start."""
    trace = np.empty((SAMPLES + 1, FORCE + 1))
    trace[:, 0] = np.linspace(0.0, wave.period_s, SAMPLES + 1)
    log = np.empty((1, 3))
    observe_samples(plants, states, wave, load_n, 0.0, trace[:1], log)
    observe_samples(plants, states, wave, load_n, wave.period_s / SAMPLES, trace[1:], log)
    return trace


def _trace_with_contacts(plants: Record, states: Record, wave: Wave, load_n: float) -> Array:
    """Follow a cycle sample by sample, with the force of the contacts."""
    times_s = np.linspace(0.0, wave.period_s, SAMPLES + 1)
    truth, log = np.empty((1, FORCE + 1)), np.empty((1, 3))
    limit_n = float(plants['contacts']['curve']['force_max_n'][0, ALL])
    trace = np.empty((SAMPLES + 1, FORCE + 2))
    for row, lasts_s in zip(trace, np.diff(times_s, prepend=0.0), strict=True):
        observe_samples(plants, states, wave, load_n, float(lasts_s), truth, log)
        row[:-1], row[-1] = truth[0], states['contact_n'].item() / limit_n
    trace[:, 0] = times_s
    return trace


def write_wave(rows: Array, path: Path) -> None:
    """
    Write a wave as a table that the commands read: time, s, and voltage, V.

    Raises
    ------
    RecordingError
        If it cannot be written.

    """
    lines = ['time_s,voltage_v', *(f'{time_s!r},{volts!r}' for time_s, volts in rows.tolist())]
    with replacing(path) as part:
        part.write_text('\n'.join(lines) + '\n', encoding='utf-8')
