# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Predict the readings of a stand in an experiment."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from types import SimpleNamespace
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.drive.build import plant_of, start_clock, state_at_rest
from stickslip_ros.drive.records import FOOT, FORCE, POSITION
from stickslip_ros.errors import OutOfRange
from stickslip_ros.instrument.commands import Request, check_request
from stickslip_ros.lab.experiments.experiment import (
    AtRest,
    Excitation,
    Experiment,
    Readout,
    SawtoothSteps,
    Voltage,
    VoltageStep,
    ZeroAmplitudeRuns,
    stroke_m,
)
from stickslip_ros.lab.experiments.friction_loop import LoopRow, loop_forces
from stickslip_ros.lab.measurements.numbers import NUMBERS
from stickslip_ros.lab.runs.batch import Pool, Progress, run_courses
from stickslip_ros.lab.runs.courses import Course, bundle_for, run_in_lanes
from stickslip_ros.lab.runs.sawtooth_run import drive_course
from stickslip_ros.lab.runs.zero_amplitude import zero_amplitude_course
from stickslip_ros.parameters import Parameters
from stickslip_ros.process.stopping import stop_if_asked

Simulation: TypeAlias = tuple[Parameters, Excitation, float, float]
"""A run: stand, drive, load (N), time of the last sample (s; 0 for numbers)."""

SAMPLE_S = 5e-6
"""Sample interval of a trace: a runner of a few grams rings at 5 to 15 kHz on its contacts."""
_SAMPLES_MAX = 4_000_000
_AT_ONCE = 20_000  # samples between two checks for a stop
_COLUMNS = {'position_m': POSITION, 'force_n': FORCE, 'foot_position_m': FOOT}
"""Columns of a trace, by quantity."""
_SETTLED = 10.0  # time constants after which a low-pass has settled
_REST_S, _RINGS_S = 1e-4, 2e-3  # time before a step and after it, 10 to 30 periods of ringing
_FINE = 1e-12  # relative change that ends a search; small, as fits differentiate its results


@dataclass(frozen=True, eq=False)
class Prediction:
    """Predicted readings of a quantity."""

    values: Array  # shape (n,)
    # first and second time derivative, the errors of a late and of a slow sensor, shape (n,) or
    # (0,); behind a low-pass the second is taken behind another one of the same time constant
    rate: Array
    curvature: Array
    is_steady: bool = True  # whether a number was steady when read
    # returns the values, shape (n,), with a low-pass of the readings instead of the motion
    otherwise: Callable[[], Array] | None = None


class RingDown(NamedTuple):
    """Frequency and decay time of a ring-down of a runner on its contacts."""

    ringing_hz: float
    decay_s: float  # to 1/e


def predict(
    stand: Parameters, experiments: Sequence[Experiment], **how: Any
) -> list[list[Prediction]]:
    """Call ``predict_all`` for one stand."""
    return predict_all([stand], experiments, **how)[0]


def predict_all(
    stands: Sequence[Parameters],
    experiments: Sequence[Experiment],
    *,
    pool: Pool | None = None,
    progress: Progress | None = None,
) -> list[list[list[Prediction]]]:
    """
    Return the predicted readings of stands, for each stand, each experiment and each quantity.

    The settings of an experiment replace those of the stand. Equal runs are made once, in parallel
    in the pool if given; ``progress`` receives the number of finished runs and of all runs. Raises
    StickSlipError if a stand is impossible or cannot follow the drive.

    """
    pairs = [(stand.updated(dict(one.settings)), one) for stand in stands for one in experiments]
    results = _run_all(pairs, pool, progress)
    found = (
        [_look(result, there, each) for each in one.observed]
        for result, (there, one) in zip(results, pairs, strict=True)
    )
    return [[next(found) for _ in experiments] for _ in stands]


def perfect_samples(stand: Parameters, experiment: Experiment) -> Array:
    """Return a sample of the first quantity of a voltage per SAMPLE_S, as it truly is."""
    there = stand.updated(dict(experiment.settings))
    [trace] = _run_all([(there, experiment)])
    return _samples_of(trace, experiment.observed[0])


def _run_all(
    pairs: Sequence[tuple[Parameters, Experiment]],
    pool: Pool | None = None,
    progress: Progress | None = None,
) -> list[Any]:
    """Return a trace or numbers for each pair of a stand and an experiment."""
    for there, one in pairs:
        if there.load_cell.contact == 'absent' and any(
            x.quantity == 'force_n' for x in one.observed
        ):
            limit, hint = 'without the measured force', 'set load_cell.contact=attached'
            raise OutOfRange('load_cell.contact', 'absent', '', limit, hint)
    runs: list[Simulation] = [
        (there, one.drive, one.load_on(there), one.lasts_s) for there, one in pairs
    ]
    # each run has a list for its result, empty until the run has been made
    kept = {
        run: (_traces_kept if isinstance(run[1], Voltage) else _numbers_kept)(*run) for run in runs
    }
    new = [run for run, results in kept.items() if not results]
    if pool is None:
        made = run_in_lanes(map(_course, new))
    else:
        made = run_courses(_course, new, bundle_for(pairs[0][0]), pool=pool, progress=progress)
    for run, result in zip(new, made, strict=True):
        kept[run].append(result)
    return [kept[run][0] for run in runs]


@lru_cache(maxsize=4096)
def _numbers_kept(*_run: Any) -> list[Any]:
    """Keep the numbers of runs, as searches and slopes repeat runs."""
    return []


@lru_cache(maxsize=32)
def _traces_kept(*_run: Any) -> list[Any]:
    """Keep few traces, as each has megabytes."""
    return []


def _course(run: Simulation) -> Course[Any]:
    """Return the course of a run; its result is a trace or numbers."""
    stand, drive, load_n, end_s = run
    if isinstance(drive, SawtoothSteps):
        wave = (stroke_m(drive, stand), drive.frequency_hz, drive.steps)
        return drive_course(stand, *wave, load_n=load_n)
    if isinstance(drive, ZeroAmplitudeRuns):
        return zero_amplitude_course(stand, *drive)
    if isinstance(drive, VoltageStep):
        return _ring_down_course(stand, drive, load_n)
    if isinstance(drive, AtRest):
        return (none for none in list[Any]())
    if isinstance(drive, LoopRow):
        return _loop_course(stand, drive)
    return _trace_course(stand, drive.rows, load_n, end_s)


def _loop_course(stand: Parameters, at: LoopRow) -> Course[Any]:
    """Return the course of a row of a friction loop; it runs no drive."""
    yield from ()
    return SimpleNamespace(tangential_n=float(loop_forces(stand, at.loop)[at.row - 1]))


def _ring_down_course(stand: Parameters, step: VoltageStep, load_n: float) -> Course[RingDown]:
    """Return the course of a step down, from rest, at the slew rate."""
    amplifier = stand.amplifier
    rise_v = stroke_m(step, stand) / stand.actuator.gain
    times_s = np.array((0.0, _REST_S, _REST_S + rise_v / amplifier.slew_rate, _REST_S + _RINGS_S))
    volts_v = amplifier.voltage_min + np.array((rise_v, rise_v, 0.0, 0.0))
    rows = np.column_stack((times_s, volts_v))
    trace = yield from _trace_course(stand, rows, load_n, times_s[-1])
    time_s = SAMPLE_S * np.arange(len(trace))
    rings = (time_s >= times_s[2]) & (time_s <= times_s[3])
    return ring_down(time_s[rings], trace[rings, POSITION])


def ring_down(time_s: Array, position_m: Array) -> RingDown:
    """Fit a damped cosine, an offset and a drift to positions at even times, shape (n,)."""
    from scipy import optimize  # noqa: PLC0415 - a slow import

    since_s, sample_s = time_s - time_s[0], float(time_s[1] - time_s[0])

    def missed(place: Array) -> Array:
        phase, fallen = math.exp(place[0]) * since_s, np.exp(-math.exp(place[1]) * since_s)
        columns = fallen * np.cos(phase), fallen * np.sin(phase), np.ones_like(since_s), since_s
        basis = np.linalg.qr(np.column_stack(columns))[0]
        return np.asarray(scaled - basis @ (basis.T @ scaled))

    scaled = (position_m - position_m.mean()) / (np.ptp(position_m) or 1.0)
    # Differences have no offset; their spectrum gives the first frequency.
    power = np.abs(np.fft.rfft(np.diff(scaled) * np.hanning(len(scaled) - 1), 8 * len(scaled)))
    rate = 2.0 * math.pi * max(int(np.argmax(power)), 1) / (8 * len(scaled) * sample_s)
    lasts_s = float(since_s[-1])
    bounds = np.log(((math.pi / lasts_s, 1e-3 / lasts_s), (math.pi / sample_s, 1.0 / sample_s)))
    starts = (np.log((rate, share * rate)).clip(*bounds) for share in (0.01, 0.1))
    ends = (  # two starts, as the ratio of decay to frequency varies widely
        optimize.least_squares(missed, start, bounds=bounds, xtol=_FINE, ftol=_FINE)
        for start in starts
    )
    best = min(ends, key=lambda end: float(end.cost))
    return RingDown(math.exp(best.x[0]) / (2.0 * math.pi), math.exp(-best.x[1]))


def _trace_course(stand: Parameters, rows: Array, load_n: float, end_s: float) -> Course[Array]:
    """Return the course of a voltage from rest, to a trace with a row per SAMPLE_S, (n, 5)."""
    time_s, voltage_v = rows.T
    inside_v = np.clip(voltage_v, stand.amplifier.voltage_min, stand.amplifier.voltage_max)
    is_rounded = np.isclose(voltage_v, inside_v, rtol=0.0, atol=1e-9)
    rows = np.column_stack((time_s, np.where(is_rounded, inside_v, voltage_v)))
    samples = int(np.ceil(end_s / SAMPLE_S)) + 3
    if samples > _SAMPLES_MAX:
        limit = f'above {_SAMPLES_MAX * SAMPLE_S:g} s'
        raise OutOfRange('length of a run', end_s, 's', limit, 'choose a shorter window')
    wave = check_request(Request('waveform', tuple(rows.ravel().tolist())), stand)
    there = stand.updated({'amplifier.voltage_initial': float(rows[0, 1])})
    plants = plant_of(there)
    states = state_at_rest(plants, there.stand.preload)
    start_clock(states)
    trace, log = np.zeros((samples, FORCE + 1)), np.zeros((1, 3))
    yield plants, states, wave, load_n, 0.0, trace[:1], log
    for first in range(1, samples, _AT_ONCE):
        stop_if_asked()
        yield plants, states, wave, load_n, SAMPLE_S, trace[first : first + _AT_ONCE], log
    return trace


def _look(result: Any, stand: Parameters, observed: Readout) -> Prediction:
    """Return the predicted readings of a sensor from the result of a run."""
    if not observed.is_trace:
        shown = NUMBERS[observed.quantity].shown
        value = getattr(result, observed.quantity) if shown is None else shown(result, stand)
        number = np.array([value])
        none = np.empty(0)
        return Prediction(number, none, none, getattr(result, 'steady', True))
    true = _samples_of(result, observed)
    slow_s = observed.sensor.slow_s
    samples = low_passed(true, slow_s)
    time_s = observed.time_s - observed.sensor.late_s
    values, rate, curvature = at_times(samples, time_s)
    if not slow_s:
        return Prediction(values, rate, curvature)
    curvature = at_times(low_passed(samples, slow_s), time_s)[2]
    otherwise = partial(low_passed_readings, true, time_s, slow_s)
    return Prediction(values, rate, curvature, otherwise=otherwise)


def _samples_of(trace: Array, observed: Readout) -> Array:
    """Return the samples of a quantity in a trace, without the sensor."""
    return trace[:, _COLUMNS[observed.quantity]]


def low_passed(samples: Array, slow_s: float) -> Array:
    """Return samples behind a low-pass of first order, initially at rest at the first sample."""
    if not slow_s:
        return samples
    kept, share = math.exp(-SAMPLE_S / slow_s), -math.expm1(-SAMPLE_S / slow_s) * slow_s / SAMPLE_S
    weights = (1.0 - share, share - kept)  # exact for straight lines between the samples
    return _filtered(weights, kept, samples)


def low_passed_readings(samples: Array, time_s: Array, slow_s: float) -> Array:
    """
    Return readings behind a digital low-pass, which advances with each reading.

    Unlike a low-pass of the motion, it does not depend on the moment of a fall between two
    readings. It also advances at missing readings.

    """
    apart_s = np.diff(time_s)
    period_s = float(np.median(apart_s))
    settled = 2.0 + _SETTLED * slow_s / period_s
    steps = np.rint(np.clip(apart_s / period_s, 1.0, settled)).astype(np.intp)
    places = np.concatenate(([0], np.cumsum(steps)))
    due_s = np.interp(np.arange(places[-1] + 1), places, time_s)
    readings = values_at(samples, due_s)
    behind = low_passed_in_steps(readings, -math.expm1(-period_s / slow_s))
    return np.asarray(behind[places])


def low_passed_in_steps(readings: Array, gain: float) -> Array:
    """Return even readings y' = y + gain (x - y), from rest at the first reading."""
    return _filtered((gain,), 1.0 - gain, readings)


def _filtered(weights: Sequence[float], kept: float, samples: Array) -> Array:
    """Return samples behind a recursive filter, from rest at the first sample."""
    from scipy import signal  # noqa: PLC0415 - a slow import

    behind = signal.lfilter(weights, (1.0, -kept), samples - samples[0])
    return np.asarray(behind + samples[0])


def at_times(samples: Array, time_s: Array) -> tuple[Array, Array, Array]:
    """
    Return values and two derivatives of samples at times, by cubics through four samples.

    The curve is constant before the first and after the last sample.

    """
    values, u, first, second, third = _cubics(samples, time_s)
    is_inside = (time_s >= 0.0) & (time_s <= (len(samples) - 1) * SAMPLE_S)
    rate = np.where(is_inside, first + u * (2.0 * second + 3.0 * u * third), 0.0)
    curvature = np.where(is_inside, 2.0 * second + 6.0 * u * third, 0.0)
    return values, rate / SAMPLE_S, curvature / SAMPLE_S**2


def values_at(samples: Array, time_s: Array) -> Array:
    """Return the values of ``at_times`` without their derivatives."""
    return _cubics(samples, time_s)[0]


def _cubics(samples: Array, time_s: Array) -> tuple[Array, ...]:
    """Return values at times, and place and powers of the cubics there, each of shape (n,)."""
    last = len(samples) - 1
    place = np.clip(time_s / SAMPLE_S, 0.0, last)
    left = np.clip(place.astype(np.intp), 1, last - 2)
    u = place - left
    before, here, after, beyond = (samples.take(left + k) for k in (-1, 0, 1, 2))
    # Lagrange's cubic through u = -1, 0, 1, 2, by powers of u.
    first = after - before / 3.0 - here / 2.0 - beyond / 6.0
    second = (before + after) / 2.0 - here
    third = (beyond - before) / 6.0 + (here - after) / 2.0
    return here + u * (first + u * (second + u * third)), u, first, second, third
