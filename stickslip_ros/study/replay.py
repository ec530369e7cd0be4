"""Runs a recording again: the same requests at the same ticks, on the same stand or another."""

import math
from array import array
from collections import defaultdict
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stickslip_ros.errors import OutOfRange, RecordingError
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request, check_request
from stickslip_ros.parameters import Parameters, parse_yaml
from stickslip_ros.recording.channels import Channel
from stickslip_ros.recording.feed import Feed
from stickslip_ros.recording.fingerprint import Difference, compare_data, data_digest
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.request_log import channels_of, recorded_requests
from stickslip_ros.recording.run_file import PARAMETERS_FILE
from stickslip_ros.recording.run_storage import CLOSING_RECORD
from stickslip_ros.recording.run_writer import RunWriter
from stickslip_ros.recording.topics import recorded_channels
from stickslip_ros.stopping import heed_stop
from stickslip_ros.study.drive_input import DriveInput
from stickslip_ros.units import NANO, NS_PER_S

Progress = Callable[[int, int], None]
"""Called with the simulated time so far and the end, ns."""


@dataclass(frozen=True)
class Replay:
    """
    What came of running a recording again.

    Attributes
    ----------
    source, output : str
        The recording, and the one of the replay.
    requests : int
        Requests that were carried out again.
    simulated_s : float
        Length of the run.
    changed : dict
        Parameters that were set differently.
    identical : bool
        Whether the data sections are the same, byte for byte.
    difference : Difference or None
        The first place where they are not.
    compared : bool
        Whether there is a recording to compare with; a measured voltage is none.
    digest : str
        SHA-256 of the messages of the replay.
    position_m, force_n : float
        Readings at the end of the replay.

    """

    source: str
    output: str
    requests: int
    simulated_s: float
    changed: dict[str, object]
    identical: bool
    difference: Difference | None
    compared: bool
    digest: str
    position_m: float
    force_n: float


def replay(
    source: Path,
    output: Path,
    changes: Mapping[str, object] | None = None,
    *,
    from_rest: bool = False,
    progress: Progress | None = None,
) -> Replay:
    """
    Carry out the requests of a recording once more and record what happens.

    Parameters
    ----------
    source : Path
        A recording of this package.
    output : Path
        Recording to write; it must not exist.
    changes : mapping of str to object, optional
        Parameters to set differently, ``{'stand.preload': 0.25}``.
    from_rest : bool
        Start from rest also where the recording began in the middle of a run.
    progress : callable, optional
        Told how far the run is.

    Raises
    ------
    RecordingError
        If the recording has no parameters, lacks messages, or began after the run did.
    StickSlipError
        If a parameter is refused.

    """
    recording = Recording(source)
    parameters = parameters_of(recording)
    first_ns, last_ns = _span(recording)
    if first_ns > parameters.block_ns and not from_rest:
        mend = (
            'record from the start (record.on_start), or start from rest instead (--from-rest), '
            'which is not the same run'
        )
        problem = f'begins {first_ns * NANO:g} s into the run, in a state that nobody recorded'
        raise RecordingError(recording.path, problem, mend)
    begin_ns = first_ns - parameters.block_ns
    due: defaultdict[int, list[Request]] = defaultdict(list)
    for time_ns, request in recorded_requests(recording):
        due[time_ns - begin_ns].append(request)
    stand = parameters.updated(changes or {})
    before, after = parameters.flat(), stand.flat()
    checked = {name: after[name] for name in changes or {} if after[name] != before[name]}
    _refuse_schedule(checked)
    channels = _channels_for(recording, stand)
    written = _record(stand, output, channels, due, last_ns - begin_ns, progress)
    difference = compare_data(recording, Recording(written))
    return _summarise(
        source, written, due, last_ns - begin_ns, checked, difference=difference, compared=True
    )


def replay_input(
    given: DriveInput, output: Path, stand: Parameters, *, progress: Progress | None = None
) -> Replay:
    """
    Let a stand follow a measured voltage, from rest at its first value, and record the run.

    Parameters
    ----------
    given : DriveInput
        The voltage.
    output : Path
        Recording to write; it must not exist.
    stand : Parameters
        The stand.
    progress : callable, optional
        Told how far the run is.

    Raises
    ------
    StickSlipError
        If the amplifier cannot give the voltage, or the recording exists.

    """
    rows = np.column_stack((given.time_s, given.voltage_v))
    request = Request('waveform', array('d', rows.tobytes()))
    check_request(request, stand)
    stand = stand.updated({'amplifier.voltage_initial': float(given.voltage_v[0])})
    blocks = math.ceil(float(given.time_s[-1]) * NS_PER_S / stand.trace_period_ns)
    end_ns = (blocks + 1) * stand.trace_period_ns
    due = {0: [request]}
    written = _record(stand, output, recorded_channels(stand), due, end_ns, progress)
    return _summarise(Path(given.origin), written, due, end_ns, stand.changed())


def _record(
    stand: Parameters,
    output: Path,
    channels: Mapping[str, Channel],
    due: Mapping[int, list[Request]],
    end_ns: int,
    progress: Progress | None,
) -> Path:
    with RunWriter(output, stand, wait=True, channels=channels) as writer:
        _run(Bench(stand), writer, due, end_ns, progress)
    writer.check()
    return writer.recorder.path


def _summarise(
    source: Path,
    output: Path,
    due: Mapping[int, list[Request]],
    end_ns: int,
    changed: Mapping[str, object],
    *,
    difference: Difference | None = None,
    compared: bool = False,
) -> Replay:
    again = Recording(output)
    channels = channels_of(again)
    return Replay(
        source=str(source),
        output=str(output),
        requests=sum(map(len, due.values())),
        simulated_s=end_ns * NANO,
        changed=dict(changed),
        identical=compared and difference is None,
        difference=difference,
        compared=compared,
        digest=data_digest(again),
        position_m=float(again.series(channels['position'].topic).value[-1]),
        force_n=float(again.series(channels['force'].topic).value[-1]),
    )


def parameters_of(recording: Recording) -> Parameters:
    """
    Return the parameters of a recorded run.

    Raises
    ------
    RecordingError
        If the recording does not hold them.

    """
    if PARAMETERS_FILE not in recording.attachments:
        problem = f'has no attachment {PARAMETERS_FILE}'
        mend = 'record with a drive of this package, or give the voltages as a table'
        raise RecordingError(recording.path, problem, mend)
    return parse_yaml(recording.attachments[PARAMETERS_FILE][1].decode(), PARAMETERS_FILE)


def _span(recording: Recording) -> tuple[int, int]:
    """Return the times of the first and the last block of a recording, ns."""
    name = channels_of(recording)['position'].topic
    [channel] = [each for each in recording.channels if each.topic == name]
    if channel.first_ns is None or channel.last_ns is None:
        raise RecordingError(recording.path, 'holds no position', 'record a longer run')
    for topic, lost in _losses(recording).items():
        problem = f'lacks {lost} messages of {topic}'
        raise RecordingError(recording.path, problem, 'record with a longer record.queue_length')
    return channel.first_ns, channel.last_ns


def _losses(recording: Recording) -> dict[str, int]:
    """Return how many messages were lost, by topic: between others, or at the end."""
    closing = recording.metadata.get(CLOSING_RECORD, {})
    lost = {
        each.topic: max(each.gaps, int(closing.get(f'dropped {each.topic}', '0')))
        for each in recording.channels
    }
    return {topic: count for topic, count in lost.items() if count}


def _channels_for(recording: Recording, stand: Parameters) -> dict[str, Channel]:
    """Return the channels as they were recorded, and those that only the new stand has."""
    known = channels_of(recording)
    new = {key: each for key, each in recorded_channels(stand).items() if key not in known}
    return {**known, **new}


def _refuse_schedule(changed: Mapping[str, object]) -> None:
    if 'fault.schedule' in changed:
        limit = 'without effect: a replay takes its faults from the recording'
        mend = 'leave it away, or record a new run with it'
        raise OutOfRange('fault.schedule', str(changed['fault.schedule']), '', limit, mend)


def _run(
    bench: Bench,
    writer: RunWriter,
    due: Mapping[int, list[Request]],
    end_ns: int,
    progress: Progress | None,
) -> None:
    feed = Feed(bench.parameters)
    waiting = sorted(due)
    writer.begin(bench.time_ns, bench.status)
    while bench.time_ns < end_ns:
        heed_stop()
        requests: list[Request] = []
        while waiting and waiting[0] <= bench.time_ns:
            requests += due[waiting.pop(0)]
        writer.write_requests(requests, bench.time_ns)
        output = bench.update(bench.time_ns + bench.parameters.block_ns, requests)
        for packed in feed.pack(output):
            writer.write(packed)
        writer.check()
        if progress is not None:
            progress(bench.time_ns, end_ns)
    for time_ns in waiting:  # asked after the last block: of a held drive, for example
        writer.write_requests(due[time_ns], bench.time_ns)
