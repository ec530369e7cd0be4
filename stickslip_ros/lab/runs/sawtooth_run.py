# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Saw-tooth runs of the drive alone or of the whole stand, and their results."""

import math
import shutil
import tempfile
import time
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from stickslip_ros.arrays import Array
from stickslip_ros.contact.laws import COULOMB, MDR
from stickslip_ros.drive.advance import RAMP_END, RAMP_MEAN, RAMP_START
from stickslip_ros.drive.build import change_preload, start_clock
from stickslip_ros.drive.ledger import EnergyLedger, take_ledger
from stickslip_ros.drive.records import ALL, Wave
from stickslip_ros.drive.runner import cell_force
from stickslip_ros.drive.waveform import mean_rise_v
from stickslip_ros.errors import OutOfRange, WrongUse
from stickslip_ros.files import RUN_ENDINGS, prepare_output
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request, check_request
from stickslip_ros.instrument.reports import Output, Status
from stickslip_ros.kernels.kernel import in_python
from stickslip_ros.kernels.record import Record
from stickslip_ros.lab.measurements.recorded_run import Run
from stickslip_ros.lab.measurements.run_result import DriveRun, SawtoothRun
from stickslip_ros.lab.runs.batch import Progress
from stickslip_ros.lab.runs.courses import Course, cycles_of, drive_at_rest, give_back, run_course
from stickslip_ros.parameters import (
    STROKE_SPEC,
    Parameters,
    ReplaceableDefault,
    checked_arguments,
    spec_of,
)
from stickslip_ros.process.stopping import stop_if_asked
from stickslip_ros.progress import progress_of
from stickslip_ros.recording.run import ReportingBench, RunWriter
from stickslip_ros.units import NANO

SAWTOOTH_HZ = 1000.0  # default steps per second
SMALLEST_MEANT_M = 1e-12  # smallest stroke for which a missing unit nm is suspected
STEADY_STEPS_MIN = 200  # fewest steps of a steady run
STEADY_WINDOW = 20
"""Steps of a window; the changes over the last two windows, continued as a geometric series, give
the distance to the limit."""
AT_ONCE_S = 0.5
"""Simulated time between two checks for Ctrl-C in a run of a given number of steps, s."""
STEADY_ERROR = 2e-4
"""Largest distance to the limit, as a share of a steady value. Against 4000 cycles (240 runs:
cells of 30 to 300 kN/m, 0.1 to 1 N, 61 to 160 nm, 0.2 to 1 kHz, 0 to 80 N s/m) none was larger."""
STEADY_ROUNDING = 1e-6  # relative change per window that counts as rounding
STEADY_STEPS_MAX = 5000  # largest number of steps without a given number
STEP_LENGTH_CYCLES = 10  # last cycles averaged for the step length


@checked_arguments
def run_drive(
    parameters: Parameters,
    amplitude_m: float,
    frequency_hz: float,
    steps: int = 0,
    *,
    load_n: float = 0.0,
) -> DriveRun:
    """
    Drive the runner with a saw-tooth, from rest, without sensors, at full speed.

    Parameters
    ----------
    parameters : Parameters
        The stand.
    amplitude_m : float
        Stroke of the feet, m; 0 is a drive at rest.
    frequency_hz : float
        Steps per second, negative backwards.
    steps : int
        Number of steps; 0 runs to the steady state, at most 5000 steps.
    load_n : float
        Constant external force on the runner along +x, N.

    Raises
    ------
    StickSlipError
        If amplitude, frequency or steps are refused, or the integration has failed.

    Examples
    --------
    >>> free = Parameters().updated({'load_cell.contact': 'absent'})
    >>> run = run_drive(free, amplitude_m=160e-9, frequency_hz=500.0)
    >>> f'{1e9 * run.step_length_m:.1f} nm'
    '98.1 nm'

    """
    return run_course(drive_course(parameters, amplitude_m, frequency_hz, steps, load_n=load_n))


def drive_course(
    parameters: Parameters,
    amplitude_m: float,
    frequency_hz: float,
    steps: int = 0,
    *,
    load_n: float = 0.0,
) -> Course[DriveRun]:
    """Return the course of ``run_drive``."""
    if amplitude_m == 0.0:
        preload_n = parameters.stand.preload
        return DriveRun(preload_n=preload_n, amplitude_m=0.0, frequency_hz=frequency_hz)
    request = Request('sawtooth', (voltage_for(parameters, amplitude_m), frequency_hz, 0.0))
    wave = check_request(request, parameters)
    parameters = start_on_wave(parameters, wave)
    if steps < 0:
        raise OutOfRange('steps', steps, '', 'below 0', 'give a number, or 0 for the steady state')
    plants, states = drive_at_rest(parameters)
    if parameters.stand.preload_end:
        change_preload(plants, states, parameters, parameters.stand.preload_end)
    start_clock(states)
    most, loss_j, ledger = steps or STEADY_STEPS_MAX, 0.0, take_ledger(plants, states)
    logs, done = list[Array]([np.empty((0, 3))]), 0
    while done < most and (steps or not is_steady(plants[0], np.concatenate(logs))):
        stop_if_asked()
        cycles = min(STEADY_WINDOW, most - done)
        if steps:  # the state is looked at in the last window alone
            at_once = min(steps - STEADY_WINDOW - done, int(AT_ONCE_S * abs(frequency_hz)))
            cycles = max(cycles, at_once)
        logs.append((yield from cycles_of(plants, states, wave, cycles, load_n)))
        done += cycles
        before_j, ledger = ledger.contact_lost_j, take_ledger(plants, states)
        loss_j = (ledger.contact_lost_j - before_j) / cycles
    run = DriveRun(
        preload_n=float(states['preload_n'].item()),
        amplitude_m=amplitude_m,
        frequency_hz=frequency_hz,
        energy_loss_per_step_j=loss_j,
        **_read_off(plants[0], np.concatenate(logs), ledger, wave),
    )
    give_back(plants, states, parameters)
    return run


@checked_arguments
def simulate(
    parameters: Parameters | None = None,
    *,
    amplitude_m: float | None = None,
    voltage_v: float | None = None,
    waveform: ArrayLike | None = None,
    frequency_hz: float | None = None,
    steps: int = 0,
    record: str | Path | bool = True,
    progress: bool | Progress = False,
) -> Run:
    """
    Drive the whole stand with a saw-tooth or another wave, from rest, and record it.

    Parameters
    ----------
    parameters : Parameters, optional
        The stand; by default that of the paper.
    amplitude_m : float, optional
        Stroke of the feet along a saw-tooth, peak to peak, m.
    voltage_v : float, optional
        In place of the stroke: the voltage, peak to peak, V.
    waveform : array-like, shape (n, 2), optional
        In place of a saw-tooth: one cycle of times, s, and voltages, V, that ends as it begins.
    frequency_hz : float, optional
        Steps per second, negative backwards; by default 1000, or that of the waveform.
    steps : int
        Number of steps; 0 runs until the force is steady, at most 5000 steps.
    record : path-like or bool
        The file to record; by default one that lives as long as what is returned. ``False``
        records nothing, which takes less time.
    progress : bool or callable
        Whether to show how far it has come; or what is called with steps done and wanted, 0 if
        that is not known.

    Raises
    ------
    StickSlipError
        If wave, frequency or steps are refused, or the recording cannot be written.

    Examples
    --------
    >>> stand = Parameters().updated({'stand.preload': 0.25})
    >>> run = simulate(stand, amplitude_m=60e-9, frequency_hz=500.0, steps=40)
    >>> f'{1e3 * run.force_mean_n:.1f} mN'
    '22.7 mN'
    >>> list(run.frame)
    ['position_m', 'force_n', 'voltage_v', 'foot_m']

    """
    parameters = parameters or Parameters()
    given = sum(each is not None for each in (amplitude_m, voltage_v, waveform))
    if given != 1:
        names = 'amplitude_m, voltage_v and waveform'
        raise WrongUse(f'{given} of {names} are given; give one, such as amplitude_m=100e-9')
    if amplitude_m is not None:
        voltage_v = voltage_for(parameters, amplitude_m)
    if voltage_v is not None:
        frequency_hz = SAWTOOTH_HZ if frequency_hz is None else frequency_hz
        request = Request('sawtooth', (voltage_v, frequency_hz, float(steps)))
    else:
        rows, frequency_hz = _stretched(parameters, waveform, frequency_hz)
        request = Request('waveform', tuple(rows.ravel().tolist()), cycles=steps)
        voltage_v = float(np.ptp(rows[:, 1]))
    wave = check_request(request, parameters)
    stand = start_on_wave(parameters, wave)
    file, folder = _file_of(record)
    grid_ns = stand.trace_period_ns if file else stand.block_ns
    joins = is_steered_by_requests(stand, is_recorded=file is not None)
    bench = Bench(stand.updated({'sim.block': stand.trace.period}) if joins else stand)
    try:
        with (
            progress_of(progress, 'steps') as show,
            RunWriter(file, stand, wait=True, synced=not folder)
            if file
            else nullcontext() as writer,
        ):
            run = ReportingBench(stand, writer=writer, bench=bench) if writer else bench
            ramps, start_s = _drive(
                bench, run.update, request, steps, frequency_hz, stand.block_ns, grid_ns, show
            )
    except BaseException:
        if folder:
            shutil.rmtree(folder, ignore_errors=True)
        raise
    wall_s, simulated_s = time.perf_counter() - start_s, bench.time_ns * NANO
    result = SawtoothRun(
        preload_n=stand.stand.preload,
        voltage_v=voltage_v,
        amplitude_m=voltage_v * stand.actuator.gain,
        frequency_hz=frequency_hz,
        simulated_s=simulated_s,
        wall_s=wall_s,
        real_time_factor=simulated_s / wall_s,
        recording='' if folder else str(file or ''),
        **_read_off(bench.plant, ramps, bench.ledger, wave),
    )
    return Run(file, result, folder)


def _file_of(record: str | Path | bool) -> tuple[Path | None, Path | None]:
    """Return the file to record; of one that lives as long as the run, its folder too."""
    if record is True:
        folder = Path(tempfile.mkdtemp(prefix='stickslip-'))
        return folder / 'run.mcap', folder
    if record is False:
        return None, None
    prepare_output(Path(record), is_new=True, endings=RUN_ENDINGS)
    return Path(record), None


def _stretched(
    parameters: Parameters, waveform: Any, frequency_hz: float | None
) -> tuple[Array, float]:
    """Return the rows of a cycle at a frequency, by default its own, and that frequency, Hz."""
    cycle = tuple(np.ravel(np.asarray(waveform, dtype=np.float64)))
    wave = check_request(Request('waveform', cycle), parameters)
    if frequency_hz is None:
        frequency_hz = 1.0 / wave.period_s
    elif not 0.0 < frequency_hz < np.inf:
        raise OutOfRange('frequency', frequency_hz, 'Hz', 'not above 0', 'turn the wave round')
    return wave.rows * np.array((1.0 / (frequency_hz * wave.period_s), 1.0)), frequency_hz


def is_steered_by_requests(stand: Parameters, *, is_recorded: bool) -> bool:
    """
    Return whether only requests change the stand, so that blocks can be merged.

    The blocks of a trace period then give the same bits; a recording must not change within them.

    """
    changes = [stand.limits.has_soft_limits, stand.fault.names]
    if is_recorded:
        changes += [stand.stand.preload_end, stand.sim.publish_truth, stand.load_cell.range]
        changes += [stand.interferometer.velocity_max]
        changes += [stand.record.split_size, stand.record.split_duration]
    return stand.trace.period <= (spec_of('sim.block').maximum or 0.0) and not any(changes)


def start_on_wave(parameters: Parameters, wave: Wave) -> Parameters:
    """
    Return a stand at rest at the first voltage of a wave, unless ``voltage_initial`` is given.

    Then a run backwards, which starts at the upper end, is the mirror image of a run forwards.

    """
    initial_v = parameters.amplifier.voltage_initial
    if initial_v == wave.start_v or not isinstance(initial_v, ReplaceableDefault):
        return parameters
    return parameters.updated({'amplifier.voltage_initial': wave.start_v})


def _drive(
    bench: Bench,
    update: Callable[[int, list[Request]], Output],
    request: Request,
    wanted: int,
    frequency_hz: float,
    block_ns: int,
    grid_ns: int,
    progress: Progress,
) -> tuple[Array, float]:
    """
    Update until the wave has ended, at a multiple of ``grid_ns``; return ramps and start, s.

    Far from the end, and behind it, the longer blocks of the bench are used. The start is the
    clock after the first block, which compiles.

    """
    long_ns, start_s = bench.parameters.block_ns, 0.0
    requests, logs, done, is_moving = [request], list[Array](), 0, True
    while True:
        stop_if_asked()
        sure_s = ((wanted or STEADY_STEPS_MIN) - done) / abs(frequency_hz) - bench.stand.ramp_s
        is_long = not requests and not (is_moving and sure_s <= bench.parameters.sim.block)
        step_ns = long_ns - bench.time_ns % long_ns if is_long else block_ns
        output = update(bench.time_ns + step_ns, requests)
        start_s = start_s or time.perf_counter()
        requests = []
        if len(output.ramps):
            logs.append(output.ramps)
            done += len(output.ramps)
            progress(done, wanted)
        is_moving = bool(output.status & (Status.MOVING | Status.MOVE_DELAYED))
        if not is_moving and bench.time_ns % grid_ns == 0:
            return np.concatenate(logs), start_s
        may_end = not wanted and done >= STEADY_STEPS_MIN and len(output.ramps)
        if may_end:
            logs = [np.concatenate(logs)]
            if (steady := is_steady(bench.plant, logs[0])) or done >= STEADY_STEPS_MAX:
                why = f'{"steady" if steady else "NOT steady"} after {done} steps'
                requests = [Request('stop', tag=f'the run ended before the {request.name}: {why}')]


def _read_off(plant: Record, ramps: Array, ledger: EnergyLedger, wave: Wave) -> dict[str, Any]:
    """Return the fields of a result that come from ramps and energy balance."""
    scatter_m, correlation_m = scatter_of(np.diff(ramps[len(ramps) // 2 :, RAMP_END]))
    mean_n = net_n = force_at_n(plant, ramps[-1, RAMP_MEAN])
    if mean_n:
        contact, cell_n_per_m = plant.contacts[ALL], plant.cell_n_per_m + plant.walls.cell_n_per_m
        cell_n_per_m += plant.button.n_per_m * plant.button.exists
        stick_n_per_m = {MDR: contact.curve.cells[0, 1], COULOMB: np.inf}.get(
            int(contact.law.number), contact.law.bristle_n_per_m
        )
        # Load cell and sticking contacts in series follow the mean foot position.
        following_n_per_m = float(1.0 / (1.0 / cell_n_per_m + 1.0 / stick_n_per_m))
        net_n -= following_n_per_m * (float(plant.gain_m_per_v) * mean_rise_v(wave))
    return {
        'force_mean_n': mean_n,
        'force_net_n': net_n,
        'force_ramp_start_n': force_at_n(plant, ramps[-1, RAMP_START]),
        'step_length_m': step_length_m(ramps),
        'step_scatter_m': scatter_m,
        'step_correlation_m': correlation_m,
        'steady': is_steady(plant, ramps),
        'steps': len(ramps),
        'energy_residual': relative_residual(ledger),
    }


def is_steady(plant: Record, ramps: Array) -> bool:
    """Return whether a run is steady."""
    if len(ramps) < STEADY_STEPS_MIN:
        return False
    pressed_n_per_m = plant.walls.cell_n_per_m + plant.button.n_per_m * plant.button.exists
    is_free = not (plant.cell_n_per_m > 0.0 or pressed_n_per_m > 0.0)
    earlier, before, now = (
        step_length_m(part) if is_free else force_at_n(plant, part[-1, RAMP_MEAN])
        for part in (ramps[: -2 * STEADY_WINDOW], ramps[:-STEADY_WINDOW], ramps)
    )
    if pressed_n_per_m > 0.0 and now <= 0.0:
        return False
    change, change_before = abs(now - before), abs(before - earlier)
    is_near = change**2 <= STEADY_ERROR * abs(now) * (change_before - change)
    return bool(is_near or change <= STEADY_ROUNDING * abs(now))


def force_at_n(plant: Record, position_m: float) -> float:
    """Return the force in the load cell at a position of the runner, N."""
    return float(in_python(cell_force)(plant, float(position_m)))


def step_length_m(ramps: Array) -> float:
    """Return the mean motion per cycle over the last cycles, m; a first cycle starts at 0."""
    cycles = min(STEP_LENGTH_CYCLES, len(ramps))
    start_m = float(ramps[-1 - cycles, RAMP_END]) if cycles < len(ramps) else 0.0
    return (float(ramps[-1, RAMP_END]) - start_m) / cycles


def scatter_of(steps_m: Array) -> tuple[float, float]:
    """Return standard deviation and correlation length of successive steps, m."""
    if len(steps_m) < 2:
        return 0.0, 0.0
    apart_m = steps_m - (mean_m := float(np.mean(steps_m)))
    scatter_m = math.sqrt(np.mean(apart_m * apart_m))
    if scatter_m <= STEADY_ROUNDING * abs(mean_m):
        return scatter_m, 0.0
    # By Fourier transform, as direct sums take quadratic time.
    length = 1 << (2 * len(steps_m) - 1).bit_length()  # no wrap-around
    power_m2 = np.abs(np.fft.rfft(apart_m, length)) ** 2
    products = np.fft.irfft(power_m2, length)[: len(steps_m)]
    correlation = products / products[0]
    lag = int(np.argmax(correlation < 1.0 / math.e))  # the sum is 0, so some are below
    lag -= (1.0 / math.e - correlation[lag]) / (correlation[lag - 1] - correlation[lag])
    return scatter_m, abs(mean_m) * float(lag)


def relative_residual(ledger: EnergyLedger) -> float:
    """Return the error of the energy balance, relative to the work of the feet."""
    return ledger.residual_j / ledger.feet_work_j if ledger.feet_work_j else 0.0


def voltage_for(parameters: Parameters, amplitude_m: float) -> float:
    """Return the saw-tooth voltage for a stroke, V; refuse a stroke out of reach."""
    STROKE_SPEC.check('amplitude', amplitude_m)
    largest_m = full_stroke_m(parameters)
    # A typed stroke may exceed the largest by rounding.
    if amplitude_m > largest_m * (1.0 + 1e-9):
        limit = f'above the {largest_m:.6g} m that the amplifier reaches'
        hint = 'lower it'
        if SMALLEST_MEANT_M <= amplitude_m * NANO <= largest_m:
            hint += f'; {amplitude_m:g} nm is {amplitude_m * NANO:g} m'
        raise OutOfRange('amplitude', amplitude_m, 'm', limit, hint)
    return min(amplitude_m / parameters.actuator.gain, parameters.amplifier.range_v)


def full_stroke_m(parameters: Parameters) -> float:
    """Return the largest stroke of the feet, m, over the range of the amplifier."""
    return parameters.amplifier.range_v * parameters.actuator.gain
