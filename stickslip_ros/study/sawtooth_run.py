"""A saw-tooth run of the virtual stand without ROS, and what a scientist reads off it."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stickslip_ros.contact.profile import Array
from stickslip_ros.drive.ledger import EnergyLedger
from stickslip_ros.drive.records import Wave
from stickslip_ros.errors import OutOfRange, WrongKind
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request, check_request
from stickslip_ros.instrument.reports import Output, Status
from stickslip_ros.parameters import Parameters, Unchosen, spec_of
from stickslip_ros.recording.feed import Feed
from stickslip_ros.recording.run_writer import RunWriter
from stickslip_ros.stopping import heed_stop
from stickslip_ros.study.ramps import (
    STEADY_STEPS_MAX,
    STEADY_STEPS_MIN,
    is_steady,
    mean_force_n,
    start_force_n,
    step_length_m,
)
from stickslip_ros.units import NANO

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class SawtoothRun:
    """
    Result of a saw-tooth run.

    Attributes
    ----------
    preload_n, voltage_v, amplitude_m, frequency_hz : float
        What was asked for.
    force_mean_n : float
        Generated force k x, mean over the last cycle; of a one-sided load cell k (x - gap) at
        the mean position.
    force_ramp_start_n : float
        Generated force at the start of the last cycle's ramp, when the fall before it is over.
    step_length_m : float
        Net motion per cycle, mean of the last 10 cycles.
    steady : bool
        Whether at least 200 steps were made, and force (of a free runner: step length) changed
        by less than 0.1 % over the last 20.
    steps : int
        Cycles made.
    simulated_s, wall_s, real_time_factor : float
        Time simulated, time it took, and their ratio.
    energy_residual : float
        What the energy balance misses, relative to the work of the feet.
    recording : str
        File of the run; empty if none was asked for.

    """

    preload_n: float
    voltage_v: float
    amplitude_m: float
    frequency_hz: float
    force_mean_n: float
    force_ramp_start_n: float
    step_length_m: float
    steady: bool
    steps: int
    simulated_s: float
    wall_s: float
    real_time_factor: float
    energy_residual: float
    recording: str = ''


def run_sawtooth(
    parameters: Parameters,
    voltage_v: float,
    frequency_hz: float,
    steps: int = 0,
    *,
    path: Path | None = None,
    progress: Progress | None = None,
) -> SawtoothRun:
    """
    Drive the stand with a saw-tooth and report force and step length.

    Parameters
    ----------
    parameters : Parameters
        The stand.
    voltage_v : float
        Amplitude of the saw-tooth, V peak to peak.
    frequency_hz : float
        Steps per second; negative ones go backwards.
    steps : int
        Number of steps; 0 goes on until the steady state, at most 5000.
    path : Path, optional
        Recording to write.
    progress : callable, optional
        Called with steps done and steps wanted (0: not known).

    Raises
    ------
    StickSlipError
        If amplitude, frequency or steps are refused, or the recording cannot be written.

    """
    request = Request('sawtooth', (voltage_v, frequency_hz, float(steps)))
    parameters = start_on_wave(parameters, request)
    Bench(parameters).update(parameters.block_ns)  # compiles, so that wall_s does not
    bench = Bench(parameters if path else _in_long_blocks(parameters))
    start_s = time.perf_counter()
    if path is None:
        ramps = _drive(bench, request, None, progress, parameters.block_ns)
    else:
        with RunWriter(path, parameters, wait=True) as writer:
            ramps = _drive(bench, request, writer, progress, parameters.block_ns)
        writer.check()
    return _summarise(bench, request, ramps, time.perf_counter() - start_s, path)


def start_on_wave(parameters: Parameters, request: Request) -> Parameters:
    """
    Return parameters whose drive rests at the first voltage of a wave, unless one was chosen.

    Whoever gives ``amplifier.voltage_initial`` has chosen it, also at the default. A saw-tooth
    backwards starts at its upper end; resting there, a run backwards is the mirror
    image of the run forwards.

    """
    wave = check_request(request, parameters)
    is_chosen = not isinstance(parameters.amplifier.voltage_initial, Unchosen)
    if is_chosen or not isinstance(wave, Wave):
        return parameters
    return parameters.updated({'amplifier.voltage_initial': wave.start_v})


def _in_long_blocks(parameters: Parameters) -> Parameters:
    """Return parameters with the longest blocks: what nobody records is looked at seldom."""
    longest_s = parameters.trace.period
    if longest_s > (spec_of('sim.block').maximum or 0.0):
        return parameters
    return parameters.updated({'sim.block': longest_s})


def _drive(
    bench: Bench,
    request: Request,
    writer: RunWriter | None,
    progress: Progress | None,
    block_ns: int,
) -> Array:
    """
    Update block by block until the saw-tooth has ended; return the log of its ramps.

    The bench may have longer blocks than asked for: it takes them while the end is far, and ends
    at the same time.

    """
    feed = Feed(bench.parameters)
    if writer is not None:
        writer.begin(bench.time_ns, bench.status)
    wanted = int(request.values[2])
    requests = [request]
    logs: list[Array] = []
    done = 0
    while True:
        heed_stop()
        if writer is not None:
            writer.write_requests(requests, bench.time_ns)
        sure_s = ((wanted or STEADY_STEPS_MIN) - done) / abs(request.values[1])
        is_far = sure_s > 2.0 * bench.parameters.sim.block
        step_ns = bench.parameters.block_ns if is_far else block_ns
        output = bench.update(bench.time_ns + step_ns, requests)
        requests = []
        if writer is not None:
            _write(writer, feed, output)
        if len(output.ramps):
            logs.append(output.ramps)
            done += len(output.ramps)
            if progress is not None:
                progress(done, wanted)
        if not output.status & Status.MOVING and feed.is_flushed:
            return np.concatenate(logs)
        if not wanted and done >= STEADY_STEPS_MIN and len(output.ramps):
            ramps = np.concatenate(logs)
            if done >= STEADY_STEPS_MAX or is_steady(bench.plant, ramps):
                requests = [Request('stop')]


def _write(writer: RunWriter, feed: Feed, output: Output) -> None:
    for packed in feed.pack(output):
        writer.write(packed)
    writer.check()


def _summarise(
    bench: Bench, request: Request, ramps: Array, wall_s: float, path: Path | None
) -> SawtoothRun:
    voltage_v, frequency_hz, _ = request.values
    simulated_s = bench.time_ns * NANO
    return SawtoothRun(
        preload_n=bench.parameters.stand.preload,
        voltage_v=voltage_v,
        amplitude_m=voltage_v * bench.parameters.actuator.gain,
        frequency_hz=frequency_hz,
        force_mean_n=mean_force_n(bench.plant, ramps),
        force_ramp_start_n=start_force_n(bench.plant, ramps),
        step_length_m=step_length_m(ramps),
        steady=is_steady(bench.plant, ramps),
        steps=len(ramps),
        simulated_s=simulated_s,
        wall_s=wall_s,
        real_time_factor=simulated_s / wall_s,
        energy_residual=relative_residual(bench.ledger),
        recording=str(path) if path else '',
    )


def relative_residual(ledger: EnergyLedger) -> float:
    """Return what the energy balance misses, relative to the work of the feet."""
    return ledger.residual_j / ledger.feet_work_j if ledger.feet_work_j else 0.0


def voltage_for(parameters: Parameters, amplitude_m: float) -> float:
    """
    Return the saw-tooth voltage for a stroke of the feet, V.

    Parameters
    ----------
    parameters : Parameters
        Gives the gain of the piezo.
    amplitude_m : float
        Stroke peak to peak, m.

    Raises
    ------
    OutOfRange
        If it is negative, or the amplifier cannot reach it.
    WrongKind
        If it is not finite.

    """
    mend = 'give the stroke of the feet in metres, as 60e-9'
    if not math.isfinite(amplitude_m):
        raise WrongKind('amplitude', amplitude_m, 'a finite number', mend)
    if amplitude_m < 0.0:
        raise OutOfRange('amplitude', amplitude_m, 'm', 'below 0 m', mend)
    amplifier = parameters.amplifier
    largest_m = (amplifier.voltage_max - amplifier.voltage_min) * parameters.actuator.gain
    # A stroke typed in nanometres may exceed the largest by rounding only.
    if amplitude_m > largest_m * (1.0 + 1e-9):
        limit = f'above the {largest_m:.6g} m that the amplifier reaches'
        raise OutOfRange('amplitude', amplitude_m, 'm', limit, 'lower it, or give it in metres')
    return min(amplitude_m, largest_m) / parameters.actuator.gain
