# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Replay of a recording or of a measured voltage, on the same or another stand."""

import math
from array import array
from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.errors import OutOfRange, RecordingError
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request, TimedRequest, check_request
from stickslip_ros.instrument.reports import read_event
from stickslip_ros.interface.topics import recorded_channels
from stickslip_ros.lab.measurements.measurement import TimeRun, measured
from stickslip_ros.lab.measurements.recorded import recorded_stand
from stickslip_ros.lab.measurements.table_options import TABLE_DEFAULTS, TableOptions
from stickslip_ros.lab.measurements.vocabulary import OVER_TIME
from stickslip_ros.lab.runs.batch import Progress
from stickslip_ros.parameters import Parameters
from stickslip_ros.process.stopping import stop_if_asked
from stickslip_ros.recording.differences import Difference, compare_data, data_digest
from stickslip_ros.recording.gaps import gaps_of
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.requests import channels_of, recorded_requests
from stickslip_ros.recording.run import ReportingBench, RunWriter
from stickslip_ros.recording.run_file import CHECKPOINT_FILE, RUN_RECORD, SOURCES, TOPICS_RECORD
from stickslip_ros.sources import sources_digest
from stickslip_ros.units import NANO, NS_PER_S

_PASSES, _LATE_BLOCKS = 4, 50
"""Runs that time commands by their events, and the most blocks that one is moved."""
_TIME, _VOLTAGE, _FOOT = 'time_s', 'voltage_v', 'foot_m'


@dataclass(frozen=True, eq=False)
class DriveInput:
    """Voltages over time, for the drive to follow."""

    origin: str  # file
    time_s: Array  # rising, from 0, shape (rows,)
    voltage_v: Array  # voltage at these times; straight lines in between, shape (rows,)
    is_voltage: bool = True  # measured; False if computed from a displacement of the feet


@dataclass(frozen=True)
class Replay:
    """The result of a replay."""

    source: str  # the recording, or the file of a measured voltage
    requests: int  # repeated requests
    simulated_s: float  # length of the run
    changed: dict[str, object]  # changed parameters
    # all messages are the same, byte for byte; None for a measured voltage, and for a bag by
    # ros2 bag record whose position differs by less than the noise of its sensor
    identical: bool | None
    difference: Difference | None  # the first difference
    digest: str  # SHA-256 of the messages of the replay
    position_m: float  # readings at the end of the replay
    force_n: float
    # the recording was computed by other sources, which may round differently
    other_sources: bool
    output: str  # the recording of the replay
    # RMS difference of the position readings from those of a bag by ros2 bag record
    apart_m: float | None = None


def replay(
    source: Path,
    output: Path,
    changes: Mapping[str, object] | None = None,
    *,
    from_rest: bool = False,
    progress: Progress | None = None,
) -> Replay:
    """
    Repeat the requests of a complete recording, and record the run.

    A bag that ``ros2 bag record`` made of the drive holds no state: its run begins at rest.

    """
    recording, changes = Recording(source), changes or {}
    parameters = recorded_stand(recording)
    first_ns, last_ns = _span(recording)
    before_ns = first_ns - parameters.block_ns
    start = None
    if not from_rest and CHECKPOINT_FILE in recording.attachments:
        start = Bench.restore(recording.attachments[CHECKPOINT_FILE][1], changes)
    elif not (from_rest or recording.is_copy) and before_ns > 0:
        problem = f'begins {first_ns * NANO:g} s into the run, in a state that was not recorded'
        hint = 'replay the whole run, or start from rest (--from-rest), which is not the same'
        raise RecordingError(recording.path, problem, hint)
    begin_ns = 0 if start or recording.is_copy else before_ns
    due = [TimedRequest(at_ns - begin_ns, each) for at_ns, each in recorded_requests(recording)]
    if recording.is_copy:
        due = _timed_by_events(recording, parameters, due)
    stand = parameters.updated(changes)
    changed = _changed(parameters, stand, changes)
    channels = channels_of(recording)  # as recorded, then those of the new stand
    for key, channel in recorded_channels(stand).items():
        channels.setdefault(key, channel)
    first_numbers = {each.topic: each.first_sequence for each in recording.channels}
    origin_ns = recording.time_origin_ns
    run = ReportingBench(stand, bench=start, time_origin_ns=origin_ns)
    with RunWriter(
        output, run.bench.parameters, wait=True, channels=channels, time_origin_ns=origin_ns
    ) as writer:
        writer.recorder.continue_numbers(
            {key: first_numbers.get(each.topic, 0) for key, each in channels.items()}
        )
        _play(run, writer, due, last_ns - begin_ns, progress)
    again, said = Recording(writer.recorder.path), recording.metadata[RUN_RECORD]
    return Replay(
        source=str(source),
        requests=len(due),
        changed=changed,
        other_sources=sources_digest() != said.get(SOURCES, sources_digest()),
        **_compared(recording, again, channels['position'].topic, stand),
        **_end_of(again, last_ns - before_ns * (not recording.is_copy)),
    )


def _changed(
    before: Parameters, after: Parameters, changes: Mapping[str, object]
) -> dict[str, object]:
    """Return the parameters that differ; refuse other faults than those of the recording."""
    old, new = before.flat(), after.flat()
    changed = {name: new[name] for name in changes if new[name] != old[name]}
    if 'fault.schedule' in changed:
        limit = 'without effect: a replay takes its faults from the recording'
        hint = 'leave it away, or record a new run with it'
        raise OutOfRange('fault.schedule', str(changed['fault.schedule']), '', limit, hint)
    return changed


def _compared(
    recording: Recording, again: Recording, position: str, stand: Parameters
) -> dict[str, Any]:
    """Return the fields of a result that compare both recordings."""
    difference, apart_m = compare_data(recording, again), None
    identical: bool | None = difference is None
    if recording.is_copy:
        read, anew = (each.series(position) for each in (recording, again))
        _, ours, theirs = np.intersect1d(read.time_s, anew.time_s, return_indices=True)
        apart_m = float(np.sqrt(np.mean((read.value[ours] - anew.value[theirs]) ** 2)))
        if not identical and apart_m <= _noise_m(stand):
            identical = difference = None
    return {'identical': identical, 'difference': difference, 'apart_m': apart_m}


def _noise_m(stand: Parameters) -> float:
    """Return the scatter of a position reading: its white noise, and half of its resolution."""
    beam, half_hz = stand.interferometer, 0.5 * stand.trace.sample_rate
    band_hz = min(half_hz, 0.5 * math.pi * beam.bandwidth) if beam.bandwidth else half_hz
    return math.hypot(beam.noise_density * math.sqrt(band_hz), 0.5 * beam.resolution)


def _timed_by_events(
    recording: Recording, stand: Parameters, due: Sequence[TimedRequest]
) -> list[TimedRequest]:
    """
    Return requests at the blocks whose ends of commands are those of the recorded events.

    A foreign recorder knows when a command came to it, to some blocks; the event of the command
    of the same number tells how many.

    """
    block_ns, told = stand.block_ns, {}
    for _, _, text in recording.messages([channels_of(recording)['event'].topic]):
        if event := read_event(str(text)):
            told[event['number']] = event['time_ns']
    if (asked := max(told, default=0)) > len(due):
        problem = f'holds {len(due)} of {asked} commands: rosbag2 misses those that are sent once'
        hint = 'compare and fit read its trace; to replay a run, record it with record.on_start'
        raise RecordingError(recording.path, problem, hint)
    found = [each._replace(time_ns=each.time_ns // block_ns * block_ns) for each in due]
    ends_ns = max(told.values(), default=0) + _LATE_BLOCKS * block_ns
    for _ in range(_PASSES):
        bench, waiting, late_ns = Bench(stand), deque(found), dict[int, int]()
        while bench.time_ns <= ends_ns:
            stop_if_asked()
            while waiting and waiting[0].time_ns <= bench.time_ns:
                bench.accept(waiting.popleft().request)
            events = bench.update(bench.time_ns + block_ns).events
            known = {each.number: each.time_ns for each in events}
            late_ns |= {key: told[key] - known[key] for key in known.keys() & told.keys()}
        moves = {key: ns for key, ns in late_ns.items() if abs(ns) <= _LATE_BLOCKS * block_ns}
        if not any(moves.values()):
            break
        for number, ns in moves.items():
            place = found[number - 1]
            found[number - 1] = place._replace(time_ns=max(place.time_ns + ns, 0))
    return found


def replay_input(
    given: DriveInput, output: Path, stand: Parameters, *, progress: Progress | None = None
) -> Replay:
    """Run a stand with a measured voltage, from rest at its first value, and record it."""
    rows = np.column_stack((given.time_s, given.voltage_v))
    request = Request('waveform', array('d', rows.tobytes()))
    check_request(request, stand)
    stand = stand.updated({'amplifier.voltage_initial': float(given.voltage_v[0])})
    blocks = math.ceil(float(given.time_s[-1]) * NS_PER_S / stand.trace_period_ns)
    end_ns = (blocks + 1) * stand.trace_period_ns
    due = [TimedRequest(0, request)]
    run = ReportingBench(stand)
    with RunWriter(output, stand, wait=True) as writer:
        _play(run, writer, due, end_ns, progress)
    again = Recording(writer.recorder.path)
    return Replay(
        source=given.origin,
        requests=1,
        changed=dict(stand.changed()),
        identical=None,
        difference=None,
        other_sources=False,
        **_end_of(again, end_ns),
    )


def _play(
    run: ReportingBench,
    writer: RunWriter,
    due: Iterable[TimedRequest],
    end_ns: int,
    progress: Progress | None,
) -> None:
    """Record a run with timed requests."""
    waiting = deque(sorted(due, key=lambda each: each.time_ns))
    block_ns = run.bench.parameters.block_ns
    run.record(writer)
    while run.bench.time_ns < end_ns:
        stop_if_asked()
        while waiting and waiting[0].time_ns <= run.bench.time_ns:
            run.accept(waiting.popleft().request)
        run.update(run.bench.time_ns + block_ns)
        if progress is not None:
            progress(run.bench.time_ns, end_ns)
    for _, request in waiting:  # after the last block, e.g. of a held drive
        run.accept(request)


def _end_of(again: Recording, lasts_ns: int) -> dict[str, Any]:
    """Return the fields of a result that come from the new recording."""
    channels = channels_of(again)
    return {
        'output': str(again.path),
        'simulated_s': lasts_ns * NANO,
        'digest': data_digest(again),
        'position_m': float(again.series(channels['position'].topic).value[-1]),
        'force_n': float(again.series(channels['force'].topic).value[-1]),
    }


def _span(recording: Recording) -> tuple[int, int]:
    """Return the times of first and last block, ns; refuse a recording with lost messages."""
    name = channels_of(recording)['position'].topic
    [channel] = [each for each in recording.channels if each.topic == name]
    if channel.first_ns is None or channel.last_ns is None:
        raise RecordingError(recording.path, 'holds no position', 'record a longer run')
    if gaps := gaps_of(recording):
        hint = 'record with a longer record.queue_length'
        raise RecordingError(recording.path, '; '.join(gaps), hint)
    return channel.first_ns, channel.last_ns


def read_drive_input(
    path: Path, stand: Parameters, reading: TableOptions = TABLE_DEFAULTS
) -> DriveInput:
    """Read a voltage over time, or a stroke in its place."""
    topics = {name: text for name, text in reading.headers.items() if not text.startswith('/')}
    topics |= {name: e for name, e in reading.topics.items() if name in {_VOLTAGE, _FOOT}}
    given = measured(
        path, replace(reading, headers=topics), kind=OVER_TIME, wanted=(_VOLTAGE, _FOOT)
    )
    assert isinstance(given, TimeRun)
    if given.recording and TOPICS_RECORD in given.recording.metadata:
        problem = 'is a recording of this package, of which a replay repeats the commands'
        raise RecordingError(path, problem, 'leave --map away')
    name = _VOLTAGE if _VOLTAGE in given.series else _FOOT
    if name not in given.series or (given.recording and not given.topics):
        hint = f'say which topic is the voltage: --map {_VOLTAGE}=/rig/amplifier.data'
        raise RecordingError(path, 'gives no voltage to play', hint)
    time_s, values = given.series[name].time_s, given.series[name].value
    if len(time_s) < 2:
        raise RecordingError(path, f'has {len(time_s)} rows', 'give at least two')
    if name == _FOOT:
        values = stand.amplifier.voltage_min + values / stand.actuator.gain
    return DriveInput(str(path), time_s - time_s[0], values, is_voltage=name == _VOLTAGE)
