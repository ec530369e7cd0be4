# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A run: a bench whose requests and readings go to a file and to a publisher."""

import math
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

import numpy as np

from stickslip_ros.errors import RecordingError
from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request
from stickslip_ros.instrument.reports import Output, Status, trace_columns
from stickslip_ros.instrument.state_tree import ANY_FLOAT, read_tree
from stickslip_ros.interface.cdr import pack_string, pack_uint32
from stickslip_ros.interface.channels import Channel
from stickslip_ros.interface.feed import Feed, IsHeard, Packed
from stickslip_ros.interface.requests import BY_TOPIC, pack_request
from stickslip_ros.interface.topics import recorded_channels
from stickslip_ros.kernels.record import FLOAT
from stickslip_ros.parameters import Parameters, to_nanoseconds
from stickslip_ros.recording.run_file import CHECKPOINT_FILE, info_json, open_recorder

_PENDING, _STATUS, _JOINT = 'pending', 'status', 'joint'
"""Names of a checkpoint's attachments."""

Publish = Callable[[Packed], None]


class RunWriter:
    """
    The new file of a run; a context manager that finishes the file.

    The file holds the parameters; log times are the time origin plus simulated time. If the queue
    is full, the writer waits for the disk, or drops and counts readings; commands and events are
    never dropped. Raises RecordingError if the file exists or cannot be written; at the end of a
    context, if writing has failed.

    """

    def __init__(
        self,
        path: Path,
        parameters: Parameters,
        *,
        wait: bool = False,
        channels: Mapping[str, Channel] | None = None,
        time_origin_ns: int = 0,
        synced: bool = True,
    ) -> None:
        channels = recorded_channels(parameters) if channels is None else channels
        self.waits = wait
        self._held = channels.keys()
        self.begun_ns = 0  # simulated time
        self._time_origin_ns = time_origin_ns
        self._info = pack_string(info_json(parameters, time_origin_ns))
        self._record = parameters.record
        self._split_ns = to_nanoseconds(parameters.record.split_duration)
        self._part_start_ns = self._part_bytes = 0
        self.recorder = open_recorder(path, parameters, channels, time_origin_ns, synced=synced)

    def begin(self, time_ns: int, status: Status, checkpoint: bytes = b'') -> None:
        """Start the recording: write the latched topics, and the state if it is not rest."""
        self.begun_ns = time_ns
        self._begin_part(time_ns, checkpoint)
        packed = pack_uint32(int(status))
        self.write(Packed('info', time_ns, self._info), Packed('status', time_ns, packed))
        self._part_bytes = 0

    @property
    def splits(self) -> bool:
        """Whether the recording has several parts."""
        return self._split_ns > 0 or self._record.split_size > 0

    def split_if_full(self, time_ns: int, save: Callable[[], bytes]) -> None:
        """Begin the next part, with the present state, if this one is full."""
        is_full = (
            0 < self._split_ns <= time_ns - self._part_start_ns
            or 0 < self._record.split_size <= self._part_bytes
        )
        if is_full and (self.waits or self.recorder.queued < self._record.queue_length):
            self._begin_part(time_ns, save())

    def _begin_part(self, time_ns: int, checkpoint: bytes) -> None:
        state = {CHECKPOINT_FILE: ('application/octet-stream', checkpoint)} if checkpoint else {}
        self.recorder.begin_part(self._time_origin_ns + time_ns, state)
        self._part_start_ns, self._part_bytes = time_ns, 0

    def write(self, *packed: Packed) -> None:
        """Queue the messages of recorded topics."""
        recorded = [each for each in packed if each.key in self._held]
        self._part_bytes += sum([len(each.data) for each in recorded])
        self.recorder.put_all(recorded, self._time_origin_ns, wait=self.waits)

    def check(self) -> None:
        """Raise the error that has ended the writing, such as a full disk."""
        error = self.recorder.error
        if isinstance(error, OSError):
            problem = f'cannot be written further ({error.strerror})'
            raise RecordingError(self.recorder.path, problem, 'make room, or choose another place')
        if error is not None:
            raise error

    def close(self) -> None:
        """Write the queue and finish the file."""
        self.recorder.close()

    def __enter__(self) -> 'RunWriter':
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self.close()
        if kind is None:
            self.check()


class ReportingBench:
    """
    A bench whose requests and reports are packed once, for a file and for a publisher.

    `publish` receives the messages of topics that are heard, except requests that came over a
    topic. A `writer` records the run from its start; a `bench` was restored and is continued.
    Stamps are the time origin, which may be set before the first update, plus simulated time.
    Readings and events without a file or a subscriber are not packed.

    """

    def __init__(
        self,
        parameters: Parameters,
        publish: Publish = lambda _: None,
        writer: RunWriter | None = None,
        bench: Bench | None = None,
        time_origin_ns: int = 0,
        is_heard: IsHeard = lambda _: True,
    ) -> None:
        self._is_heard = is_heard
        self.bench = bench or Bench(parameters)
        self.time_origin_ns = time_origin_ns
        self.writer: RunWriter | None = None
        self._feed = Feed(parameters)
        self._columns = len(trace_columns(parameters))
        self._publish = publish
        if not self.bench.is_at_start:
            self._resume()
        self.record(writer)

    def _resume(self) -> None:
        """Continue from the attachments of the checkpoint, if there are any."""
        time_ns, block_ns = self.bench.time_ns, self.bench.parameters.block_ns
        if not self.bench.attached:
            self._feed.resume([], self.bench.status, (time_ns, math.nan))
            return
        forms = {
            _PENDING: (FLOAT, (-1, self._columns)),
            _STATUS: Status | None,
            _JOINT: {'time_ns': range(time_ns + 1), 'position_m': ANY_FLOAT},
        }
        attached = read_tree(forms, self.bench.attached, 'checkpoint.attached')
        read_tree(range(0, time_ns + 1, block_ns), time_ns, 'checkpoint.time_ns')
        time_ns, position_m = attached[_JOINT].values()
        self._feed.resume([attached[_PENDING]], attached[_STATUS], (time_ns, position_m))

    @property
    def status(self) -> Status:
        """Last published status of the drive; the present status before the first."""
        return self.bench.status if self._feed.status is None else self._feed.status

    def record(self, writer: RunWriter | None) -> RunWriter | None:
        """Switch to another file or none; return the previous file, still open."""
        previous, self.writer = self.writer, writer
        if writer is not None:
            checkpoint = b'' if self.bench.is_at_start else self.save()
            writer.begin(self.bench.time_ns, self.status, checkpoint)
        return previous

    def save(self) -> bytes:
        """Return a checkpoint of the bench, with the state of its reports."""
        feed = self._feed
        pending = np.concatenate([np.empty((0, self._columns)), *feed.pending])
        joint = dict(zip(('time_ns', 'position_m'), feed.joint, strict=True))
        return self.bench.save({_PENDING: pending, _STATUS: feed.status, _JOINT: joint})

    def update(self, until_ns: int, requests: Iterable[Request] = ()) -> Output:
        """Run ``Bench.update``, publish and write its output; raise an error of the file."""
        for request in requests:
            self.accept(request)
        output = self.advance_bench(until_ns)
        self.report(output)
        if self.writer is not None:
            self.writer.check()
        return output

    def accept(self, request: Request) -> None:
        """Execute a request at the present time, and record it."""
        is_noted = request.name not in BY_TOPIC
        if is_noted or self.writer is not None:
            packed = pack_request(request, self.bench.time_ns)
            if is_noted:
                self._publish(packed)
            if self.writer is not None:
                self.writer.write(packed)
        before = self.bench.parameters
        self.bench.accept(request)
        if self.bench.parameters is not before:  # for the start of the next part
            info = pack_string(info_json(self.bench.parameters, self.time_origin_ns))
            self._tell(Packed('info', self.bench.time_ns, info))

    def advance_bench(self, until_ns: int) -> Output:
        """Advance without a report; first begin the next part if this one is full."""
        if self.writer is not None:
            self.writer.split_if_full(self.bench.time_ns, self.save)
        return self.bench.update(until_ns)

    def report(self, output: Output) -> None:
        """Publish and write the output of an update."""
        is_heard = self._is_heard if self.writer is None else lambda _: True
        self._tell(*self._feed.pack(output, self.time_origin_ns, is_heard))

    def _tell(self, *packed: Packed) -> None:
        for each in packed:
            if self._is_heard(each.key):
                self._publish(each)
        if self.writer is not None:
            self.writer.write(*packed)
