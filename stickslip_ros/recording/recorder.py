"""Records messages while an experiment runs, without ever holding it up."""

import atexit
from collections import deque
from collections.abc import Mapping, Sequence
from pathlib import Path
from threading import Condition, Lock, Thread
from typing import Final

from stickslip_ros.errors import RecordingError, UnknownName
from stickslip_ros.recording.channels import Channel
from stickslip_ros.recording.chunks import Stored
from stickslip_ros.recording.file_form import FileForm
from stickslip_ros.recording.layout import Layout
from stickslip_ros.recording.run_storage import Head, RunStorage
from stickslip_ros.recording.schemas import SCHEMAS

#: Messages that wake the writer: more wake it less often, but it then holds the GIL longer.
BATCH: Final = 64
QUEUE_LENGTH: Final = 20_000
#: Share of the flush period after which the writer looks at its queue even without a batch.
PATIENCE: Final = 1 / 4

_SEQUENCE_MASK: Final = 0xFFFF_FFFF


class _Track:
    """What is counted per topic."""

    __slots__ = ('channel_id', 'dropped', 'sequence')

    def __init__(self, channel_id: int) -> None:
        self.channel_id = channel_id
        self.sequence = 0
        self.dropped = 0


class Recorder:
    """
    An MCAP recording in progress: a bounded queue with one writing thread behind it.

    Equal messages put in equal order give equal files, byte for byte, whatever the timing.
    What was put longer ago than the flush period is on the disk, also when the process is killed
    or the power fails; a file that was not finished is then mended by ``stickslip recover``.
    A recorder that nobody closed is finished when the interpreter ends.

    Parameters
    ----------
    path : path-like
        The file, which must not exist; missing folders are made. A bag is a directory of that
        name, parts are numbered after it.
    channels : sequence of Channel
        Every topic that will be recorded.
    metadata : mapping of str to mapping of str to str
        Named records that describe the run.
    attachments : mapping of str to (media type, bytes)
        Files to keep inside the recording.
    form : FileForm
        Compression, chunks, parts, bag.
    queue_length : int
        Messages that may wait for the disk; what comes on top is dropped and counted.

    Raises
    ------
    RecordingError
        If the file exists or cannot be written, or a topic is named twice.
    UnknownName
        If a type or the compression is not known.

    """

    def __init__(
        self,
        path: str | Path,
        channels: Sequence[Channel],
        *,
        metadata: Mapping[str, Mapping[str, str]] | None = None,
        attachments: Mapping[str, tuple[str, bytes]] | None = None,
        form: FileForm | None = None,
        queue_length: int = QUEUE_LENGTH,
    ) -> None:
        form = form or FileForm()
        self._layout = Layout.plan(Path(path), bag=form.bag, split=form.splits)
        self.path = self._layout.path
        _check_channels(self.path, channels)
        head = Head(metadata or {}, attachments or {})
        self._tracks: dict[str, _Track] = {}
        self._storage = RunStorage(self._layout, channels, form, head, self._account)
        topics = (channel.topic for channel in channels)
        self._tracks = dict(zip(topics, map(_Track, self._storage.channel_ids), strict=True))
        self._patience_s = PATIENCE * form.flush_period_s
        self._queue: deque[tuple[_Track, int, bytes, int]] = deque()
        self._queue_length = queue_length
        self._batch = max(1, min(BATCH, queue_length // 2))
        self._last_ns = 0
        self._peak = 0
        self._written = 0
        self._closed = False
        self._error: Exception | None = None
        self._lock = Lock()
        self._changed = Condition(self._lock)
        self._thread = Thread(target=self._run, name=f'record {self.path.name}', daemon=True)
        self._thread.start()
        atexit.register(self.close)

    @property
    def files(self) -> list[Path]:
        """The files that were begun, in the order of time."""
        return [self._layout.part(number) for number in range(self._storage.parts)]

    @property
    def place(self) -> str:
        """What there is on the disk: a file, the directory of a bag, or the parts of a run."""
        parts = [path for path in self.files if path.exists()]
        if self._layout.bag or not parts:
            return str(self.path)
        return str(parts[0]) if len(parts) == 1 else f'{parts[0]} to {parts[-1].name}'

    @property
    def written(self) -> int:
        """Messages handed to the file."""
        return self._written

    @property
    def stored(self) -> int:
        """Messages in all files together, with those that every part repeats."""
        return self._storage.stored

    @property
    def secured(self) -> int:
        """Messages that are on the disk: they survive a power failure."""
        return self._storage.secured

    @property
    def dropped(self) -> int:
        """Messages lost to a full queue, a failed disk or a closed recorder."""
        return sum(track.dropped for track in self._tracks.values())

    @property
    def queued(self) -> int:
        """Messages that wait for the writer; it is woken by a batch, not by every message."""
        return len(self._queue)

    @property
    def queue_peak(self) -> int:
        """The longest that the queue has been."""
        return self._peak

    @property
    def error(self) -> Exception | None:
        """What stopped the writing, such as a full disk; None while all is well."""
        return self._error

    def put(self, topic: str, time_ns: int, data: bytes, *, wait: bool = False) -> bool:
        """
        Hand over a message to be written.

        Parameters
        ----------
        topic : str
            One of the recorded topics.
        time_ns : int
            Time of the message; not before that of any earlier one.
        data : bytes
            The packed message.
        wait : bool
            Wait for room in the queue instead of dropping.

        Returns
        -------
        bool
            Whether the message was taken. One that was not is counted, and its sequence number
            stays missing in the file.

        Raises
        ------
        UnknownName
            If the topic is not recorded here.
        RecordingError
            If the time runs backwards.

        """
        track = self._tracks.get(topic)
        if track is None:
            raise UnknownName('recorded topic', topic, f'known are {", ".join(self._tracks)}')
        with self._lock:
            if wait:
                self._changed.wait_for(self._has_room_or_ended)
            self._check_time(time_ns)
            return self._append(track, time_ns, data)

    def close(self) -> None:
        """
        Write what is queued, finish the file and end the thread; the second time, nothing.

        A disk that fails does not raise here: `error` tells.

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
                'put messages in the order of their times, from 0 on',
            )
        self._last_ns = time_ns

    def _append(self, track: _Track, time_ns: int, data: bytes) -> bool:
        """Queue a message, or drop it: its number is used up either way."""
        sequence = track.sequence
        track.sequence = (sequence + 1) & _SEQUENCE_MASK
        if self._ended() or len(self._queue) >= self._queue_length:
            track.dropped += 1
            return False
        self._peak = max(self._peak, len(self._queue) + 1)  # first: nobody sees more than the peak
        self._queue.append((track, time_ns, data, sequence))
        if len(self._queue) == self._batch:
            self._changed.notify_all()
        return True

    def _ended(self) -> bool:
        return self._closed or self._error is not None

    def _has_room_or_ended(self) -> bool:
        return len(self._queue) < self._queue_length or self._ended()

    def _has_batch_or_closed(self) -> bool:
        return len(self._queue) >= self._batch or self._closed

    def _run(self) -> None:
        """Be the writing thread: every failure ends here and is kept to be read."""
        try:
            while self._await_work():
                self._write_queue()
                self._storage.keep()
            self._storage.finish()
        except Exception as error:  # noqa: BLE001 - a thread has nobody to raise to
            self._fail(error)

    def _await_work(self) -> bool:
        """Sleep until there is work; False when all is written and the recorder closed."""
        with self._lock:
            self._changed.notify_all()
            self._changed.wait_for(self._has_batch_or_closed, self._patience_s)
            return bool(self._queue) or not self._closed

    def _write_queue(self) -> None:
        """Write what is queued now; a message leaves the queue when it is written."""
        for _ in range(len(self._queue)):
            track, time_ns, data, sequence = self._queue[0]
            self._storage.write(Stored(track.channel_id, time_ns, data, sequence))
            self._queue.popleft()
            self._written += 1

    def _account(self) -> dict[str, str]:
        """Say what is in the file and, per topic, what is not."""
        losses = {f'dropped {topic}': str(t.dropped) for topic, t in self._tracks.items()}
        return {'written': str(self._written), **losses}

    def _fail(self, error: Exception) -> None:
        """Give up writing: what waits is lost, and nobody waits for room any more."""
        with self._lock:
            self._error = error
            for track, *_ in self._queue:
                track.dropped += 1
            self._queue.clear()
            self._changed.notify_all()
        self._storage.abandon()


def _check_channels(path: Path, channels: Sequence[Channel]) -> None:
    """Refuse what ROS tools would drop in silence, before a file is made."""
    topics: set[str] = set()
    for channel in channels:
        if channel.type_name not in SCHEMAS:
            known = ', '.join(SCHEMAS)
            raise UnknownName('message type', channel.type_name, f'the known ones are {known}')
        if channel.topic in topics:
            raise RecordingError(path, f'{channel.topic} is named twice', 'name each topic once')
        topics.add(channel.topic)
