# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Replay of a recording or of a measured voltage, on the same or another stand."""

import math
from array import array
from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.errors import OutOfRange, RecordingError
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request, TimedRequest, check_request
from stickslip_ros.interface.topics import recorded_channels
from stickslip_ros.lab.measurements.measurement import TimeRun, measured
from stickslip_ros.lab.measurements.recorded import recorded_stand
from stickslip_ros.lab.readers.instructions import AS_IT_IS, Reading
from stickslip_ros.lab.readers.measured import OVER_TIME
from stickslip_ros.lab.runs.batch import Progress
from stickslip_ros.parameters import Parameters
from stickslip_ros.process.stopping import stop_if_asked
from stickslip_ros.recording.gaps import gaps_of
from stickslip_ros.recording.reader import Difference, Recording, compare_data, data_digest
from stickslip_ros.recording.requests import channels_of, recorded_requests
from stickslip_ros.recording.run import ReportingBench, RunWriter
from stickslip_ros.recording.run_file import CHECKPOINT_FILE, RUN_RECORD, SOURCES
from stickslip_ros.sources import sources_digest
from stickslip_ros.units import NANO, NS_PER_S

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
    # all messages are the same, byte for byte; None for a measured voltage
    identical: bool | None
    difference: Difference | None  # the first difference
    digest: str  # SHA-256 of the messages of the replay
    position_m: float  # readings at the end of the replay
    force_n: float
    # the recording was computed by other sources, which may round differently
    other_sources: bool
    output: str  # the recording of the replay


def replay(
    source: Path,
    output: Path,
    changes: Mapping[str, object] | None = None,
    *,
    from_rest: bool = False,
    progress: Progress | None = None,
) -> Replay:
    """Repeat the requests of a complete recording, and record the run."""
    recording = Recording(source)
    parameters = recorded_stand(recording)
    first_ns, last_ns = _span(recording)
    start = None
    if not from_rest and CHECKPOINT_FILE in recording.attachments:
        start = Bench.restore(recording.attachments[CHECKPOINT_FILE][1], changes or {})
    elif not from_rest and first_ns > parameters.block_ns:
        problem = f'begins {first_ns * NANO:g} s into the run, in a state that was not recorded'
        hint = 'replay the whole run, or start from rest (--from-rest), which is not the same'
        raise RecordingError(recording.path, problem, hint)
    begin_ns = 0 if start else first_ns - parameters.block_ns
    lasts_ns = last_ns - first_ns + parameters.block_ns
    due = [TimedRequest(at_ns - begin_ns, each) for at_ns, each in recorded_requests(recording)]
    stand = parameters.updated(changes or {})
    before, after = parameters.flat(), stand.flat()
    changed: dict[str, object] = {
        name: after[name] for name in changes or {} if after[name] != before[name]
    }
    if 'fault.schedule' in changed:
        limit = 'without effect: a replay takes its faults from the recording'
        hint = 'leave it away, or record a new run with it'
        raise OutOfRange('fault.schedule', str(changed['fault.schedule']), '', limit, hint)
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
    again = Recording(writer.recorder.path)
    difference = compare_data(recording, again)
    return Replay(
        source=str(source),
        requests=len(due),
        changed=changed,
        identical=difference is None,
        difference=difference,
        other_sources=recording.metadata[RUN_RECORD].get(SOURCES) != sources_digest(),
        **_end_of(again, lasts_ns),
    )


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


def read_drive_input(path: Path, stand: Parameters, reading: Reading = AS_IT_IS) -> DriveInput:
    """Read a voltage over time, or a stroke in its place."""
    topics = {name: text for name, text in reading.headers.items() if not text.startswith('/')}
    topics |= {name: e for name, e in reading.topics.items() if name in {_VOLTAGE, _FOOT}}
    given = measured(
        path, replace(reading, headers=topics), kind=OVER_TIME, wanted=(_VOLTAGE, _FOOT)
    )
    assert isinstance(given, TimeRun)
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
