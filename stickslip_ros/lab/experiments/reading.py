# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Experiments out of files: recordings of any rig, tables over time, tables by amplitude."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from scipy import signal

from stickslip_ros.arrays import Array
from stickslip_ros.errors import OutOfRange, RecordingError
from stickslip_ros.instrument.sensors.signal_chain import low_pass_gain
from stickslip_ros.lab.experiments.commanded import Commanded, commanded
from stickslip_ros.lab.experiments.experiment import (
    OF_TRACES,
    AtRest,
    Drive,
    Experiment,
    SawtoothSteps,
    Seen,
    Voltage,
    VoltageStep,
    ZeroAmplitudeRuns,
)
from stickslip_ros.lab.experiments.options import ReadingOptions
from stickslip_ros.lab.experiments.sensor import lone_outliers
from stickslip_ros.lab.experiments.sensor_clock import LEAD_S, check_limits
from stickslip_ros.lab.measurements.measurement import TimeRun, measured
from stickslip_ros.lab.measurements.recorded import recorded_stand
from stickslip_ros.lab.readers.clocks import are_even
from stickslip_ros.lab.readers.experiment import listed_sources, read_experiment
from stickslip_ros.lab.readers.measured import OVER_TIME, MeasuredTable
from stickslip_ros.lab.readers.numbers import BACK, NUMBERS, sigma_name
from stickslip_ros.lab.runs.replay import DriveInput
from stickslip_ros.lab.runs.zero_amplitude import WITHOUT_CELL
from stickslip_ros.lab.waveform.recognise import GIVE_COMMANDS, recognise
from stickslip_ros.parameters import SENSORS, Parameters, ReplaceableDefault, Scalar, bare_name
from stickslip_ros.recording.run_file import TOPICS_RECORD

_VOLTAGE = 'voltage_v'
_NEXT = 1.5  # periods within which the next sample follows
_SAMPLES_MIN = 32  # fewer readings make no trace
MOVES_MIN = 1.2  # least scatter of readings that move, per noise
LONGEST_S = 2.0
"""Longest recording simulated in full; longer ones need a window."""
_OWN = ('stand.', 'load_cell.contact', 'load_cell.gap', 'amplifier.voltage_')
"""Names of the parameters of this package that were set for a recording."""


def read_experiments(
    given: Any,
    stand: Parameters,
    options: ReadingOptions,
    report: Callable[[MeasuredTable], None] | None = None,
) -> list[Experiment]:
    """
    Return the experiments in files, frames, runs and experiments, one of these or a sequence.

    A recording or a table over time is one experiment, as is each row of a table by amplitude. The
    amplifier of the stand helps to recognise a voltage. Raises StickSlipError without a voltage or
    readings, or if the voltage cannot be played.

    """
    for name, value, hint in (
        ('steps', options.steps, 'give a number above 0, or 0 to wait for the steady state'),
        ('outliers', options.outliers, 'give 6, or 0 to keep all'),
    ):
        if value < 0.0:
            raise OutOfRange(name, value, '', 'below 0', hint)
    if not abs(options.slope_deg) <= 90.0:
        limit, hint = 'not from -90 to 90', 'give that of the rail'
        raise OutOfRange('slope', options.slope_deg, 'degrees', limit, hint)
    listed = listed_sources(given)
    reading = options.reading(report, stand).for_sources(listed)
    found = list[Experiment]()
    for number, each in enumerate(listed):
        if isinstance(each, Experiment):
            found.append(each)
            continue
        window_s = None if options.commands is not None else options.window_s
        stretch_s = window_s and (window_s[0] - LEAD_S, window_s[1])
        run = measured(each, reading, number=number, window_s=stretch_s)
        if isinstance(run, TimeRun):
            found.append(experiment_of(run, stand, reading.preload_n(number), options))
            continue
        for quantity in run.quantities:
            if not np.any(run.columns[quantity]):
                hint = f'check the column {quantity}'
                raise RecordingError(run.side.origin, f'has only 0 as {quantity}', hint)
        found += of_points(run.side.origin, run.columns, stand, options)
    return [replace(one, slope_deg=one.slope_deg or options.slope_deg) for one in found]


def _recognised(
    time_s: Array, voltage_v: Array, stand: Parameters, hint: str = GIVE_COMMANDS
) -> Voltage:
    """Return the voltage recognised in samples; NotRecognised ends in the hint."""
    found = recognise(time_s, voltage_v, stand)
    time_s, voltage_v = found.corners(hint)
    rows = np.column_stack((time_s - time_s[0], voltage_v))
    return Voltage(rows, tuple(found.lines()), begins_s=float(time_s[0]))


def _of_commands(commands: Any) -> Voltage:
    [file] = listed_sources(commands)
    table = read_experiment(file, kind=OVER_TIME, measured=(_VOLTAGE,))
    rows = np.column_stack((table.columns['time_s'], table.columns[_VOLTAGE]))
    rows[:, 0] -= rows[0, 0]
    return Voltage(rows, (f'commands of {table.origin}',))


def played(given: DriveInput, stand: Parameters) -> Voltage:
    """
    Return the voltage to play: the wave recognised in samples, or corners as they are.

    Uneven times are those of corners. Raises StickSlipError if samples show no wave to play.

    """
    is_sampled = len(given.time_s) > _SAMPLES_MIN and are_even(given.time_s)
    if is_sampled and given.is_voltage:
        hint = 'give a table of its corners, at uneven times'
        return _recognised(given.time_s, given.voltage_v, stand, hint)
    return Voltage(np.column_stack((given.time_s, given.voltage_v)))


def experiment_of(
    run: TimeRun, stand: Parameters, preload_n: float | None, options: ReadingOptions
) -> Experiment:
    """Return the experiment of a measurement over time, without its outliers."""
    recording, series, own = run.recording, run.series, None
    if recording is not None and recording.is_ours:
        own = recorded_stand(recording)
    elif recording is not None and not run.topics:
        hint = 'map its topics: --map voltage_v=TOPIC.FIELD --map position_m=TOPIC.FIELD'
        raise RecordingError(recording.path, f'holds {", ".join(recording.types)}', hint)
    names = [name for name in OF_TRACES if len(series.get(name, ())) >= _SAMPLES_MIN]
    if own and own.load_cell.contact == 'absent':  # its force is 0 by definition
        names = [name for name in names if name != 'force_n']
    settings = (
        {name: each for name, each in own.flat().items() if name.startswith(_OWN)} if own else {}
    )
    seen = [Seen(name, series[name].value, series[name].time_s, run.sigma(name)) for name in names]
    asked_for = None
    if own and recording and TOPICS_RECORD in recording.metadata:  # a twin records a rig instead
        asked_for = partial(commanded, recording, own)
        seen = [_of_own_sensor(each, own) for each in seen]
    voltage = series.get(_VOLTAGE)
    pair = None if voltage is None else (voltage.time_s, voltage.value)
    given = run.side.origin, pair, tuple(seen), stand, preload_n, options
    one = experiment_over_time(*given, settings, asked_for)
    if run.topics:  # what was found about the clocks of a rig
        one = replace(one, notes=(*run.side.notes, *one.notes))
    return without_outliers(one, options.outliers) if options.outliers else one


def _of_own_sensor(seen: Seen, own: Parameters) -> Seen:
    """
    Undo the low-pass of a sensor of this package, before which the noise is white.

    The first of consecutive samples is lost, as the sample before it is unknown.

    """
    [sensor] = [getattr(own, each.name) for each in SENSORS if each.quantity == seen.quantity]
    rate_hz, beam, is_held = own.trace.sample_rate, own.interferometer, False
    if seen.quantity == 'position_m':
        seen = seen.sensed(cyclic_m=beam.cyclic_error, fringe_m=0.5 * beam.wavelength)
        is_held = beam.sample_rate > 0.0
    if not sensor.bandwidth or seen.apart_s * rate_hz >= _NEXT or is_held:
        return seen
    gain = low_pass_gain(sensor.bandwidth, rate_hz)  # y' = y + gain (x - y)
    follows = np.diff(seen.time_s) * rate_hz < _NEXT
    before = seen.values[:-1] + np.diff(seen.values) / gain
    seen = seen.sensed(undone_hz=sensor.bandwidth)
    return replace(seen, values=before[follows], time_s=seen.time_s[1:][follows])


def behind_low_pass(shown: Seen, values: Array) -> Array:
    """Return values at the times of readings behind the low-pass of their sensor."""
    if not shown.sensor.undone_hz:
        return values
    gain = low_pass_gain(shown.sensor.undone_hz, 1.0 / shown.apart_s)
    return np.asarray(signal.lfilter((gain,), (1.0, gain - 1.0), values - values[0]) + values[0])


def experiment_over_time(
    origin: str,
    voltage: tuple[Array, Array] | None,
    seen: tuple[Seen, ...],
    stand: Parameters,
    preload_n: float | None,
    options: ReadingOptions,
    settings: Mapping[str, Scalar],
    asked_for: Callable[[tuple[Array, Array], float], Commanded] | None = None,
) -> Experiment:
    """
    Return the experiment of samples of a voltage and of readings over time, on one clock.

    Only ``commands``, ``load_n`` and ``window_s`` of the options are used. ``voltage`` is times,
    s, and volts, both of shape (n,); None with commands. Without ``preload_n`` that of the stand
    holds; ``settings`` were set too. ``asked_for`` returns the commands between the first of some
    samples of the voltage and an end, s. Raises StickSlipError if nothing drove it, nothing moved,
    or the voltage cannot be played.

    """
    commands, window_s = options.commands, options.window_s
    if not seen:
        hint = f'name one of {", ".join(OF_TRACES)}: --map position_m=TOPIC.FIELD'
        raise RecordingError(origin, 'shows neither a motion nor a force over time', hint)
    if voltage is None and commands is None:
        hint = 'name its voltage, --map voltage_v=TOPIC.FIELD, or give --commands'
        raise RecordingError(origin, 'does not hold the voltage that drove it', hint)
    if window_s is not None and commands is None and voltage is not None:
        start_s, end_s = window_s[0] - LEAD_S, window_s[1]
        inside = (voltage[0] >= start_s) & (voltage[0] <= end_s)
        voltage = voltage[0][inside], voltage[1][inside]
        seen = tuple(each.within(origin, start_s, end_s) for each in seen)
    time_s, voltage_v = voltage or (seen[0].time_s[:1], np.zeros(1))
    ends_s = window_s[1] if window_s else max(float(each.time_s[-1]) for each in seen)
    lasts_s = ends_s - float(time_s[0])
    if lasts_s > LONGEST_S:
        limit = f'above {LONGEST_S:g} s, the longest simulated in full'
        hint = f'choose a window of at most {LONGEST_S - LEAD_S:g} s, some waves: --window 0.3s@2s'
        raise OutOfRange(f'length of {origin}', lasts_s, 's', limit, hint)
    still = [each for each in seen if float(np.std(each.values)) <= MOVES_MIN * each.noise]
    if len(still) == len(seen):
        hint = 'check its topic or column, and that the runner moved'
        raise RecordingError(origin, f'has only noise in its {still[0].quantity}', hint)
    notes = tuple(f'{origin}: {each.quantity} is only noise and is left out' for each in still)
    seen = tuple(each for each in seen if each not in still)
    asked, begins_s = Commanded(), float(time_s[0])
    if commands is not None:
        drive = _of_commands(commands)
    else:
        asked = asked_for((time_s, voltage_v), ends_s) if asked_for else asked
        with_settings = stand.updated(dict(settings))
        drive = asked.voltage or _recognised(time_s, voltage_v, with_settings)
        begins_s = drive.begins_s
    own = {**settings, **asked.settings}
    own |= {} if preload_n is None else {'stand.preload': preload_n}
    if not settings and not any(each.quantity == 'force_n' for each in seen):
        own |= WITHOUT_CELL
    if 'stand.preload' not in own and isinstance(stand.stand.preload, ReplaceableDefault):
        text = f'no preload is given, and the {stand.stand.preload:g} N of the stand are used'
        notes += (f'{origin}: {text}; give it with --preload',)
    is_cut = window_s is not None and begins_s < window_s[0] - 0.9 * LEAD_S
    if is_cut and any(each.quantity == 'force_n' for each in seen):
        text = f'the run begins {1e3 * LEAD_S:g} ms before the window, at rest'
        notes += (f'{origin}: {text}, without the force of earlier steps',)
    seen = tuple(replace(each, time_s=each.time_s - begins_s) for each in seen)
    one = Experiment(origin, own, drive, seen, asked.load_n + options.load_n, notes)
    if window_s is not None:
        one = one.within(*(each_s - begins_s for each_s in window_s))
    if stand.updated(own).load_cell.contact == 'absent' and one.seen[0].quantity == 'position_m':
        check_limits(origin, one.seen[0], drive, begins_s, stand.actuator.gain)
    return one


def of_points(
    origin: str,
    columns: Mapping[str, Any],
    stand: Parameters,
    options: ReadingOptions,
    varied: Sequence[str] = (),
) -> list[Experiment]:
    """
    Return one experiment for each number of each row, in the order of NUMBERS.

    ``columns`` are those of POINT_COLUMNS, and ``varied`` columns of parameters. The frequency of
    the options holds without such a column. A blocking force without a voltage is that of the full
    range.

    """
    found, steps, amplifier = list[Experiment](), options.steps, stand.amplifier
    nothing = [0.0] * len(columns['preload_n'])
    strokes_m, volts, loads_n = (
        columns.get(name, nothing) for name in ('amplitude_m', 'voltage_v', 'load_n')
    )
    for quantity, kind in NUMBERS.items():
        values, sigma = columns.get(quantity, ()), columns.get(sigma_name(quantity))
        for row, value in enumerate(values):
            if math.isnan(value):
                continue
            settings: dict[str, Scalar] = {}
            if kind.runner == 'free' or (kind.runner != 'held' and 'force_n' not in columns):
                settings |= WITHOUT_CELL
            elif kind.runner == 'held' and stand.load_cell.contact == 'absent':
                settings['load_cell.contact'] = 'attached'
            settings['stand.preload'] = float(columns['preload_n'][row])
            settings |= {bare_name(name): columns[name][row] for name in varied}
            stroke_m, voltage_v = float(strokes_m[row]), float(volts[row])
            if kind.runner == 'held' and not (stroke_m or voltage_v):
                voltage_v = amplifier.voltage_max - amplifier.voltage_min
            hertz = float(columns.get('frequency_hz', [options.frequency_hz] * len(values))[row])
            if quantity in BACK.values():
                hertz = -abs(hertz)
            drives: dict[str, Drive] = {
                'rest': AtRest(),
                'zero': ZeroAmplitudeRuns(hertz, *filter(None, [steps])),
                'ring': VoltageStep(stroke_m, voltage_v),
                'steps': SawtoothSteps(stroke_m, hertz, steps, not steps, voltage_v),
            }
            error = None if sigma is None else float(sigma[row])
            seen = Seen(quantity, np.array([value]), sigma=error)
            load_n = 0.0 if kind.drive == 'rest' else float(loads_n[row]) + options.load_n
            where = f'{origin} row {row + 1}'
            found.append(Experiment(where, settings, drives[kind.drive], (seen,), load_n))
    return found


def without_outliers(one: Experiment, factor: float) -> Experiment:
    """Drop and count isolated readings that are far off their neighbours."""
    seen = (each.without(lone_outliers(each.values, factor)) for each in one.seen)
    return replace(one, seen=tuple(seen))
