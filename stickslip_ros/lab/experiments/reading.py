# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Read experiments: recordings of any rig, tables over time, tables by amplitude."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.errors import OutOfRange, RecordingError
from stickslip_ros.instrument.sensors.signal_chain import low_pass_gain
from stickslip_ros.lab.experiments.commanded import Commanded, commanded
from stickslip_ros.lab.experiments.experiment import (
    OF_TRACES,
    AtRest,
    Excitation,
    Experiment,
    Readout,
    SawtoothSteps,
    Voltage,
    VoltageStep,
    ZeroAmplitudeRuns,
)
from stickslip_ros.lab.experiments.friction_loop import LoopRow, loops_of
from stickslip_ros.lab.experiments.options import ReadingOptions
from stickslip_ros.lab.experiments.predict import low_passed_in_steps
from stickslip_ros.lab.experiments.sensor import lone_outliers
from stickslip_ros.lab.experiments.sensor_clock import LEAD_S, check_limits
from stickslip_ros.lab.measurements.measurement import TimeRun, measured
from stickslip_ros.lab.measurements.numbers import BACK, NUMBERS, sigma_name
from stickslip_ros.lab.measurements.recorded import recorded_stand
from stickslip_ros.lab.measurements.tables import listed_sources, read_experiment
from stickslip_ros.lab.measurements.vocabulary import OVER_TIME, MeasuredTable
from stickslip_ros.lab.readers.clocks import are_even
from stickslip_ros.lab.runs.replay import DriveInput
from stickslip_ros.lab.runs.zero_amplitude import WITHOUT_CELL
from stickslip_ros.lab.waveform.recognise import GIVE_COMMANDS, recognise
from stickslip_ros.parameters import SENSORS, Parameters, ReplaceableDefault, Scalar, bare_name
from stickslip_ros.recording.run_file import TOPICS_RECORD

_VOLTAGE, _LOOP = 'voltage_v', 'tangential_n'
_NEXT = 1.5  # largest distance of consecutive samples, in periods
_SAMPLES_MIN = 32  # fewer readings make no trace
MOVES_MIN = 1.2  # least scatter of the readings of a motion, per noise
LONGEST_S = 2.0
"""Longest recording simulated in full; longer ones need a window."""
_STEADY = 1e-9  # least drift of a sensor of this package, m/s, as the fit divides by it
_OWN = ('stand.', 'load_cell.contact', 'load_cell.gap', 'amplifier.voltage_')
"""Prefixes of the parameters that a recording of this package sets."""


def read_experiments(
    given: Any,
    stand: Parameters,
    options: ReadingOptions,
    report: Callable[[MeasuredTable], None] | None = None,
) -> list[Experiment]:
    """
    Return the experiments in a file, frame, run or experiment, or in a sequence of them.

    A recording or a table over time is an experiment, and so is each row of a table by amplitude.
    The amplifier of the stand helps to recognise a voltage. Raises StickSlipError without a
    voltage or readings, or if the voltage cannot be played.

    """
    if options.steps < 0:
        hint = 'give a number above 0, or 0 to wait for the steady state'
        raise OutOfRange('steps', options.steps, '', 'below 0', hint)
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
    """Return the voltage recognised in samples; ``hint`` ends the message of NotRecognised."""
    found = recognise(time_s, voltage_v, stand)
    rows = found.corners(hint)
    begins_s = float(rows[0, 0])
    return Voltage(rows - (begins_s, 0.0), tuple(found.lines()), begins_s)


def _of_commands(commands: Any) -> Voltage:
    [file] = listed_sources(commands)
    table = read_experiment(file, kind=OVER_TIME, measured=(_VOLTAGE,))
    rows = np.column_stack((table.columns['time_s'], table.columns[_VOLTAGE]))
    rows[:, 0] -= rows[0, 0]
    return Voltage(rows, (f'commands of {table.origin}',))


def played(given: DriveInput, stand: Parameters) -> Voltage:
    """
    Return the voltage to play: the wave recognised in samples, or given corners.

    Rows at uneven times are corners. Raises StickSlipError if samples show no wave.

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
    recording, series = run.recording, run.series
    own = recorded_stand(recording) if recording and recording.is_ours else None
    observed = [
        Readout(name, series[name].value, series[name].time_s, run.sigma(name))
        for name in OF_TRACES
        if len(series.get(name, ())) >= _SAMPLES_MIN
    ]
    settings: dict[str, Scalar] = {}
    asked_for = None
    if recording and own:
        settings = {name: each for name, each in own.flat().items() if name.startswith(_OWN)}
        if own.load_cell.contact == 'absent':  # its force is 0 by definition
            observed = [each for each in observed if each.quantity != 'force_n']
        if TOPICS_RECORD in recording.metadata:  # absent if a twin recorded a rig
            asked_for = partial(commanded, recording, own)
            observed = [_of_own_sensor(each, own) for each in observed]
    if not observed:
        _check_count(run)
    voltage = series.get(_VOLTAGE)
    pair = None if voltage is None else (voltage.time_s, voltage.value)
    given = run.side.origin, pair, tuple(observed), stand, preload_n, options
    one = experiment_over_time(*given, settings, asked_for)
    notes = run.side.notes if run.topics else ()  # on the clocks of a rig
    return replace(one, notes=(*notes, *one.notes))


def _check_count(run: TimeRun) -> None:
    """Refuse a run whose quantities all have too few readings."""
    counts = {name: len(run.series[name]) for name in OF_TRACES if name in run.series}
    name = max(counts, key=counts.__getitem__, default='')
    if name and counts[name] < _SAMPLES_MIN:
        what = f'number of readings of {name} in {run.side.origin}'
        limit, hint = f'below the {_SAMPLES_MIN} of a run', 'give a longer or a faster record'
        raise OutOfRange(what, counts[name], '', limit, hint)


def _of_own_sensor(observed: Readout, own: Parameters) -> Readout:
    """
    Undo the low-pass of a sensor of this package, so that its noise is white.

    The first sample of each series is lost, as the sample before it is unknown.

    """
    [sensor] = [getattr(own, each.name) for each in SENSORS if each.quantity == observed.quantity]
    rate_hz, beam, is_held = own.trace.sample_rate, own.interferometer, False
    if observed.quantity == 'position_m':
        lasts_s = float(np.ptp(observed.time_s))
        drift_m_per_s = math.hypot(beam.drift, beam.random_walk / math.sqrt(lasts_s), _STEADY)
        observed = observed.sensed(
            cyclic_m=beam.cyclic_error, fringe_m=0.5 * beam.wavelength, drift_per_s=drift_m_per_s
        )
        is_held = beam.sample_rate > 0.0
    if not sensor.bandwidth or observed.apart_s * rate_hz >= _NEXT or is_held:
        return observed
    gain = low_pass_gain(sensor.bandwidth, rate_hz)  # y' = y + gain (x - y)
    follows = np.diff(observed.time_s) * rate_hz < _NEXT
    before = observed.values[:-1] + np.diff(observed.values) / gain
    observed = observed.sensed(undone_hz=sensor.bandwidth)
    return replace(observed, values=before[follows], time_s=observed.time_s[1:][follows])


def behind_low_pass(shown: Readout, values: Array) -> Array:
    """Return values at the times of readings behind the low-pass of their sensor."""
    if not shown.sensor.undone_hz:
        return values
    gain = low_pass_gain(shown.sensor.undone_hz, 1.0 / shown.apart_s)
    return low_passed_in_steps(values, gain)


def experiment_over_time(
    origin: str,
    voltage: tuple[Array, Array] | None,
    observed: tuple[Readout, ...],
    stand: Parameters,
    preload_n: float | None,
    options: ReadingOptions,
    settings: Mapping[str, Scalar],
    asked_for: Callable[[tuple[Array, Array], float], Commanded] | None = None,
) -> Experiment:
    """
    Return the experiment of a sampled voltage and of readings over time, on one clock.

    Only ``commands``, ``load_n`` and ``window_s`` of the options are used.
    ``voltage`` is times, s, and volts, both of shape (n,), or None with commands. ``preload_n``
    and ``settings`` replace values of the stand. ``asked_for`` returns the commands from the first
    of some samples of the voltage to an end, s. Raises StickSlipError without a drive or a motion,
    or if the voltage cannot be played.

    """
    window_s = options.window_s
    if not observed:
        hint = f'name one of {", ".join(OF_TRACES)}: --map position_m=TOPIC.FIELD'
        raise RecordingError(origin, 'shows neither a motion nor a force over time', hint)
    if options.commands is None:
        if voltage is None:
            hint = 'name its voltage, --map voltage_v=TOPIC.FIELD, or give --commands'
            raise RecordingError(origin, 'does not hold the voltage that drove it', hint)
        if window_s is not None:
            start_s, end_s = window_s[0] - LEAD_S, window_s[1]
            inside = (voltage[0] >= start_s) & (voltage[0] <= end_s)
            voltage = voltage[0][inside], voltage[1][inside]
            observed = tuple(each.within(origin, start_s, end_s) for each in observed)
    samples = voltage or (observed[0].time_s[:1], np.zeros(1))
    ends_s = window_s[1] if window_s else max(float(each.time_s[-1]) for each in observed)
    begins_s, asked = float(samples[0][0]), Commanded()
    if ends_s - begins_s > LONGEST_S:
        limit = f'above {LONGEST_S:g} s, the longest simulated in full'
        hint = f'choose a window of at most {LONGEST_S - LEAD_S:g} s, some waves: --window 0.3s@2s'
        raise OutOfRange(f'length of {origin}', ends_s - begins_s, 's', limit, hint)
    observed, notes = _moving(origin, observed)
    if options.commands is not None:
        drive = _of_commands(options.commands)
    else:
        asked = asked_for(samples, ends_s) if asked_for else asked
        drive = asked.voltage or _recognised(*samples, stand.updated(dict(settings)))
        begins_s = drive.begins_s
    own, doubts = _set_for(origin, settings, asked, observed, stand, preload_n)
    observed = tuple(replace(each, time_s=each.time_s - begins_s) for each in observed)
    one = Experiment(
        origin, own, drive, observed, asked.load_n + options.load_n, (*notes, *doubts)
    )
    if window_s is not None:
        one = _within_window(one, window_s, begins_s)
    if (
        stand.updated(own).load_cell.contact == 'absent'
        and one.observed[0].quantity == 'position_m'
    ):
        check_limits(origin, one.observed[0], drive, begins_s, stand.actuator.gain)
    return replace(one, observed=tuple(map(without_outliers, one.observed)))


def _moving(origin: str, observed: tuple[Readout, ...]) -> tuple[tuple[Readout, ...], list[str]]:
    """Return the quantities that are more than noise, and a note on each of the others."""
    still = [each for each in observed if float(np.std(each.values)) <= MOVES_MIN * each.noise]
    if len(still) == len(observed):
        hint = 'check its topic or column, and that the runner moved'
        raise RecordingError(origin, f'has only noise in its {still[0].quantity}', hint)
    notes = [f'{origin}: {each.quantity} is only noise and is left out' for each in still]
    return tuple(each for each in observed if each not in still), notes


def _set_for(
    origin: str,
    settings: Mapping[str, Scalar],
    asked: Commanded,
    observed: tuple[Readout, ...],
    stand: Parameters,
    preload_n: float | None,
) -> tuple[dict[str, Scalar], list[str]]:
    """Return the settings of an experiment, and a note if the preload is that of the stand."""
    own = {**settings, **asked.settings}
    if preload_n is not None:
        own['stand.preload'] = preload_n
    if not settings and all(each.quantity != 'force_n' for each in observed):
        own |= WITHOUT_CELL
    assumed_n = stand.stand.preload
    if 'stand.preload' in own or not isinstance(assumed_n, ReplaceableDefault):
        return own, []
    text = f'no preload is given, and the {assumed_n:g} N of the stand are used'
    return own, [f'{origin}: {text}; give it with --preload']


def _within_window(one: Experiment, window_s: tuple[float, float], begins_s: float) -> Experiment:
    """Return the readings of a window, with a note if the force of earlier steps is unknown."""
    is_cut = begins_s < window_s[0] - 0.9 * LEAD_S
    if is_cut and any(each.quantity == 'force_n' for each in one.observed):
        text = f'the run begins {1e3 * LEAD_S:g} ms before the window, at rest'
        note = f'{one.origin}: {text}, without the force of earlier steps'
        one = replace(one, notes=(*one.notes, note))
    return one.within(*(each_s - begins_s for each_s in window_s))


def of_points(
    origin: str,
    columns: Mapping[str, Any],
    stand: Parameters,
    options: ReadingOptions,
    varied: Sequence[str] = (),
) -> list[Experiment]:
    """
    Return one experiment for each number of each row, in the order of NUMBERS.

    ``columns`` are those of POINT_COLUMNS, and ``varied`` columns of parameters. Without a column
    of frequencies, that of the options is used. A blocking force without a voltage is that of the
    full range.

    """
    found, steps, amplifier = list[Experiment](), options.steps, stand.amplifier
    nothing = [0.0] * len(columns['preload_n'])
    if _LOOP in columns:
        return _of_loops(origin, columns)
    strokes_m, volts, loads_n = (
        columns.get(name, nothing) for name in ('amplitude_m', 'voltage_v', 'load_n')
    )
    for quantity, kind in NUMBERS.items():
        values, sigma = columns.get(quantity, ()), columns.get(sigma_name(quantity))
        for row, value in enumerate(values):
            if math.isnan(value):
                continue
            settings = _cell_for(kind.runner, 'force_n' in columns, stand)
            settings['stand.preload'] = float(columns['preload_n'][row])
            settings |= {bare_name(name): columns[name][row] for name in varied}
            stroke_m, voltage_v = float(strokes_m[row]), float(volts[row])
            if kind.runner == 'held' and not (stroke_m or voltage_v):
                voltage_v = amplifier.range_v
            hertz = float(columns.get('frequency_hz', [options.frequency_hz] * len(values))[row])
            if quantity in BACK.values():
                hertz = -abs(hertz)
            drives: dict[str, Excitation] = {
                'rest': AtRest(),
                'zero': ZeroAmplitudeRuns(hertz, *filter(None, [steps])),
                'ring': VoltageStep(stroke_m, voltage_v),
                'steps': SawtoothSteps(stroke_m, hertz, steps, not steps, voltage_v),
            }
            error = None if sigma is None else float(sigma[row])
            observed = Readout(quantity, np.array([value]), sigma=error)
            load_n = 0.0 if kind.drive == 'rest' else float(loads_n[row]) + options.load_n
            where = f'{origin} row {row + 1}'
            found.append(Experiment(where, settings, drives[kind.drive], (observed,), load_n))
    return found


def _cell_for(runner: str, has_force: bool, stand: Parameters) -> dict[str, Scalar]:
    """Return the setting of the load cell for a number of a free or a held runner."""
    if runner == 'free' or (runner != 'held' and not has_force):
        return {**WITHOUT_CELL}
    is_missing = runner == 'held' and stand.load_cell.contact == 'absent'
    return {'load_cell.contact': 'attached'} if is_missing else {}


def _of_loops(origin: str, columns: Mapping[str, Any]) -> list[Experiment]:
    """Return one experiment for each row of friction loops."""
    loops = loops_of(columns)
    rows = [
        LoopRow(loop, k + 1, number if len(loops) > 1 else 0)
        for number, loop in enumerate(loops, start=1)
        for k in range(len(loop.normal_n))
    ]
    sigmas = columns.get(sigma_name(_LOOP), [None] * len(rows))
    readouts = (
        Readout(_LOOP, np.array([value]), sigma=sigma)
        for value, sigma in zip(columns[_LOOP], sigmas, strict=True)
    )
    return [
        Experiment(f'{origin} row {at.row}', {}, at, (each,))
        for at, each in zip(rows, readouts, strict=True)
        if not math.isnan(each.values[0])
    ]


def without_outliers(each: Readout) -> Readout:
    """Drop and count isolated readings that are far off their neighbours."""
    return each.without(lone_outliers(each.values))
