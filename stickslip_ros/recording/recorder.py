# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Record messages during an experiment without delaying it."""

import atexit
from collections import deque
from collections.abc import Container, Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from threading import Condition, Lock, Thread
from typing import Final

from stickslip_ros.errors import RecordingError, UnknownName
from stickslip_ros.interface.channels import Channel
from stickslip_ros.interface.schemas import SCHEMAS
from stickslip_ros.recording.layout import FileForm, Layout
from stickslip_ros.recording.storage import PartMark, RunFiles
from stickslip_ros.recording.writer import Attachments, Metadata, Stored

#: Queued messages that wake the writer; with more it wakes less often, but holds the GIL longer.
BATCH: Final = 64
QUEUE_LENGTH: Final = 20_000
#: Share of the flush period after which the writer wakes even without a batch.
PATIENCE: Final = 1 / 4

_SEQUENCE_MASK: Final = 0xFFFF_FFFF


class Recorder:
    """
    An MCAP recording in progress: a bounded queue and a writing thread.

    If the queue is full, a message is dropped and counted, unless its topic is ``kept``.

    Equal messages in equal order give equal messages in the file; chunk boundaries may differ.
    Messages older than the flush period are on the disk, even if the process is killed or, in a
    ``synced`` form, the power fails; ``stickslip recover`` then makes a whole file of them. A
    recorder that is not closed is closed when the interpreter ends. Raises RecordingError if the
    file exists, cannot be written, or a topic is named twice; UnknownName if a type or the
    compression is unknown.

    """

    def __init__(
        self,
        path: str | Path,
        channels: Mapping[str, Channel] | Sequence[Channel],
        *,
        metadata: Metadata | None = None,
        attachments: Attachments | None = None,
        form: FileForm | None = None,
        queue_length: int = QUEUE_LENGTH,
        kept: Container[str] = (),
    ) -> None:
        form = form or FileForm()
        self._layout = Layout.plan(Path(path), bag=form.bag, split=form.in_parts)
        self.path = self._layout.path
        described = list(channels.values() if isinstance(channels, Mapping) else channels)
        self._topics = [channel.topic for channel in described]
        for channel in described:  # ROS tools would drop these without a message
            if channel.type_name not in SCHEMAS:
                known = f'the known ones are {", ".join(SCHEMAS)}'
                raise UnknownName('message type', channel.type_name, known)
            if self._topics.count(channel.topic) > 1:
                problem = f'{channel.topic} is named twice'
                raise RecordingError(self.path, problem, 'name each topic once')
        names = channels if isinstance(channels, Mapping) else self._topics
        self._ids = {name: number for number, name in enumerate(names, 1)}
        self._kept = {number for name, number in self._ids.items() if name in kept}
        self._sequences = [0] * len(described)
        self._dropped = [0] * len(described)
        self._files = RunFiles(
            self._layout, described, form, metadata or {}, attachments or {}, self._losses
        )
        self._patience_s = PATIENCE * form.flush_period_s
        self._latches = {n for n, channel in enumerate(described, 1) if channel.qos.latched}
        self._latched: dict[int, Stored] = {}
        self._queue: deque[Stored | PartMark] = deque()
        self._queue_length = queue_length
        self._batch = max(1, min(BATCH, queue_length // 2))
        self._last_ns = 0
        self.queue_peak = 0
        self._closed = False
        self.error: Exception | None = None
        self._lock = Lock()
        self._changed = Condition(self._lock)
        self._thread = Thread(target=self._run, name=f'record {self.path.name}', daemon=True)
        self._thread.start()
        # Close at exit: the interpreter would stop the daemon thread in the middle of a file.
        atexit.register(self.close)

    @property
    def files(self) -> list[Path]:
        """The files begun, in the order of time."""
        return [self._layout.part(number) for number in range(self._files.parts)]

    @property
    def place(self) -> str:
        """Place of the run in words: a file, the directory of a bag, or the parts of a run."""
        parts = [path for path in self.files if path.exists()]
        if self._layout.bag or not parts:
            return str(self.path)
        return str(parts[0]) if len(parts) == 1 else f'{parts[0]} to {parts[-1].name}'

    @property
    def size_bytes(self) -> int:
        size = 0
        for path in self.files:
            with suppress(OSError):
                size += path.stat().st_size
        return size

    @property
    def written(self) -> int:
        """Number of messages given to the file."""
        return self._files.written

    @property
    def stored(self) -> int:
        """Number of messages in all files, repeated messages included."""
        return self._files.stored

    @property
    def secured(self) -> int:
        """Number of messages on the disk, which survive a power failure."""
        return self._files.secured

    @property
    def dropped(self) -> int:
        """Number of messages lost to a full queue, a failed disk or a closed recorder."""
        return sum(self._dropped)

    @property
    def losses(self) -> str:
        """Number of lost messages in words, with their topics."""
        pairs = zip(self._topics, self._dropped, strict=True)
        lost = ', '.join(f'{count} of {topic}' for topic, count in pairs if count)
        return f'{self.dropped} dropped{": " * bool(lost)}{lost}'

    @property
    def queued(self) -> int:
        """Number of messages waiting for the writer."""
        return len(self._queue)

    def put(self, name: str, time_ns: int, data: bytes, *, wait: bool = False) -> bool:
        """Queue a message, waiting for room if asked; return False and count it if dropped."""
        return self.put_all([(name, time_ns, data)], wait=wait) == 1

    def put_all(
        self, messages: Iterable[tuple[str, int, bytes]], origin_ns: int = 0, *, wait: bool = False
    ) -> int:
        """Queue several messages, timed from an origin; return the number taken."""
        taken, queue, ids = 0, self._queue, self._ids
        with self._lock:
            for name, since_ns, data in messages:
                time_ns, channel_id = origin_ns + since_ns, ids.get(name)
                if channel_id is None:
                    raise UnknownName('recorded topic', name, f'known are {", ".join(self._ids)}')
                while wait and len(queue) >= self._queue_length and not self._has_ended:
                    self._changed.wait()
                if time_ns != self._last_ns:
                    self._check_time(time_ns)
                sequence = self._sequences[channel_id - 1]
                self._sequences[channel_id - 1] = (sequence + 1) & _SEQUENCE_MASK
                length = len(queue) + 1
                is_full = length > self._queue_length and channel_id not in self._kept
                if is_full or self._has_ended:
                    self._dropped[channel_id - 1] += 1
                    continue
                message = Stored(channel_id, time_ns, data, sequence)
                # Update the peak before the queue grows, so no reader sees a queue above it.
                self.queue_peak = max(self.queue_peak, length)
                queue.append(message)
                if channel_id in self._latches:
                    self._latched[channel_id] = message
                if length == self._batch:
                    self._changed.notify_all()
                taken += 1
        return taken

    def begin_part(self, time_ns: int, attachments: Attachments | None = None) -> None:
        """
        Begin the next file; before the first message, set the attachments of the first file.

        The file begins with the last message of each latched topic, under its old sequence number.

        """
        with self._lock:
            self._check_time(time_ns)
            repeated = [each._replace(time_ns=time_ns) for each in self._latched.values()]
            if not self._has_ended:
                self._queue.append(PartMark(attachments or {}, repeated))

    def continue_numbers(self, sequences: Mapping[str, int]) -> None:
        """Set the number of the next message of each channel, to continue a run."""
        with self._lock:
            for name, sequence in sequences.items():
                self._sequences[self._ids[name] - 1] = sequence

    def close(self) -> None:
        """
        Write the queue, finish the file and end the thread; a second call does nothing.

        A failed disk raises nothing here: its error is kept in `error`.

        """
        with self._lock:
            self._closed = True
            self._changed.notify_all()
        self._thread.join()
        atexit.unregister(self.close)

    def __enter__(self) -> 'Recorder':
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _check_time(self, time_ns: int) -> None:
        if time_ns < self._last_ns:
            raise RecordingError(
                self.path,
                f'a message of {time_ns} ns comes after one of {self._last_ns} ns',
                'write messages in the order of their times, from 0 ns on',
            )
        self._last_ns = time_ns

    @property
    def _has_ended(self) -> bool:
        return self._closed or self.error is not None

    def _run(self) -> None:
        """Run the writing thread; a failure ends it and is kept in `error`."""
        try:
            while self._await_work():
                # Messages leave the queue only after they are written.
                for _ in range(len(self._queue)):
                    match self._queue[0]:
                        case Stored() as message:
                            self._files.write(message)
                        case PartMark() as mark:
                            self._files.begin_part(mark)
                    self._queue.popleft()
                if not self._has_ended:  # closing a file syncs it too
                    self._files.keep()
            self._files.finish()
        except Exception as error:  # noqa: BLE001 - kept in `error`: a thread has no caller
            with self._lock:  # the queue is lost; no caller waits for room any more
                self.error = error
                for lost in self._queue:
                    if isinstance(lost, Stored):
                        self._dropped[lost.channel_id - 1] += 1
                self._queue.clear()
                self._changed.notify_all()
            self._files.abandon()

    def _await_work(self) -> bool:
        """Sleep until there is work; return False if all is written and the recorder closed."""
        with self._lock:
            self._changed.notify_all()
            self._changed.wait_for(
                lambda: len(self._queue) >= self._batch or self._closed, self._patience_s
            )
            return bool(self._queue) or not self._closed

    def _losses(self) -> dict[str, str]:
        """Return the number of lost messages by topic, for the closing record."""
        counts = zip(self._topics, self._dropped, strict=True)
        return {f'dropped {topic}': str(count) for topic, count in counts}
