"""One run: a bench, and the outputs of its requests and readings: a file, a publisher."""

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.commands import Request
from stickslip_ros.instrument.reports import Output, Status
from stickslip_ros.parameters import Parameters
from stickslip_ros.recording.cdr import pack_string, pack_uint32
from stickslip_ros.recording.channels import Channel
from stickslip_ros.recording.feed import Feed, Packed
from stickslip_ros.recording.requests import BY_TOPIC, pack_request
from stickslip_ros.recording.run_file import CHECKPOINT_FILE, info_json, open_recorder
from stickslip_ros.recording.topics import recorded_channels

PENDING = 'pending'

Publish = Callable[[Packed], None]


class RunWriter:
    """
    The new file of a run; as a context it is finished at the end.

    Parameters
    ----------
    path : Path
        The file; it must not exist.
    parameters : Parameters
        The stand; kept in the file.
    wait : bool
        True to wait for the disk when its queue is full, False to drop and count.
    channels : mapping of str to Channel, optional
        What is recorded, by the key of its topic; by default under the declared names.

    Raises
    ------
    RecordingError
        If the file exists or cannot be written; at the end of a context, if it was not.

    """

    def __init__(
        self,
        path: Path,
        parameters: Parameters,
        *,
        wait: bool = False,
        channels: Mapping[str, Channel] | None = None,
    ) -> None:
        channels = recorded_channels(parameters) if channels is None else channels
        self.waits = wait
        self._info = pack_string(info_json(parameters))
        self.recorder = open_recorder(path, parameters, channels)

    def begin(self, time_ns: int, status: Status, checkpoint: bytes = b'') -> None:
        """Write what is latched, and a state that is not rest: the recording starts now."""
        if checkpoint:
            self.recorder.attach(CHECKPOINT_FILE, 'application/octet-stream', checkpoint)
        self.write(Packed('info', time_ns, self._info))
        self.write(Packed('status', time_ns, pack_uint32(int(status))))

    def write(self, packed: Packed) -> None:
        """Hand one message over."""
        self.recorder.put(packed.key, packed.time_ns, packed.data, wait=self.waits)

    def check(self) -> None:
        """Raise the error that has ended the writing, such as a full disk, if any."""
        if self.recorder.error is not None:
            raise self.recorder.error

    def close(self) -> None:
        """Write what is queued and finish the file."""
        self.recorder.close()

    def __enter__(self) -> 'RunWriter':
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self.close()
        if kind is None:
            self.check()


class Run:
    """
    A bench whose requests and reports are packed once, for a file and for who publishes.

    Parameters
    ----------
    parameters : Parameters
        The stand.
    publish : callable
        Receives every packed message but the requests that came over a topic.
    writer : RunWriter, optional
        Holds the run from its start.
    bench : Bench, optional
        One that was restored, to go on with; by default a new one.

    Attributes
    ----------
    bench : Bench
        The drive.
    writer : RunWriter or None
        The recording in progress.
    status : Status
        Of the drive, as last published.

    """

    def __init__(
        self,
        parameters: Parameters,
        publish: Publish = lambda _: None,
        writer: RunWriter | None = None,
        bench: Bench | None = None,
    ) -> None:
        self.bench = bench or Bench(parameters)
        self.status = self.bench.status
        self.writer: RunWriter | None = None
        self._feed = Feed(parameters)
        if not self.bench.is_at_start:
            self._feed.resume(self.bench.beside.get(PENDING, []), self.bench.status)
        self._publish = publish
        self.record(writer)

    def record(self, writer: RunWriter | None) -> RunWriter | None:
        """Record into another file, or none, from now on; return the one so far, still open."""
        previous, self.writer = self.writer, writer
        if writer is not None:
            checkpoint = b'' if self.bench.is_at_start else self.save()
            writer.begin(self.bench.time_ns, self.status, checkpoint)
        return previous

    def save(self) -> bytes:
        """Return a checkpoint of the bench, with the samples that no message has held yet."""
        return self.bench.save({PENDING: self._feed.pending})

    def update(self, until_ns: int, requests: Iterable[Request] = ()) -> Output:
        """
        Do what ``Bench.update`` does, publish and write it.

        Raises
        ------
        StickSlipError
            If the time is refused, the integration has failed, or the disk has ended the file.

        """
        for request in requests:
            self.accept(request)
        output = self.bench.update(until_ns)
        self.report(output)
        if self.writer is not None:
            self.writer.check()
        return output

    def accept(self, request: Request) -> None:
        """Carry out a request at the present time, and note it."""
        is_noted = request.name not in BY_TOPIC
        if is_noted or self.writer is not None:
            packed = pack_request(request, self.bench.time_ns)
            if is_noted:
                self._publish(packed)
            if self.writer is not None:
                self.writer.write(packed)
        self.bench.accept(request)

    def report(self, output: Output) -> None:
        """Publish and write what an update of the bench has given."""
        self.status = output.status
        for packed in self._feed.pack(output):
            self._publish(packed)
            if self.writer is not None:
                self.writer.write(packed)
