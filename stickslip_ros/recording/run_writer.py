"""A run on its way into a file: what the instrument says and what it was asked, by key."""

from collections.abc import Iterable, Mapping
from pathlib import Path

from stickslip_ros.instrument.commands import Request
from stickslip_ros.instrument.reports import Status
from stickslip_ros.parameters import Parameters
from stickslip_ros.recording.cdr import pack_string, pack_uint32
from stickslip_ros.recording.channels import Channel
from stickslip_ros.recording.feed import Packed, pack_note, pack_request
from stickslip_ros.recording.run_file import info_json, open_recorder
from stickslip_ros.recording.topics import COMMANDS, recorded_channels

COMMAND_KEYS = {topic.request: topic.key for topic in COMMANDS if topic.recorded}
"""Topic of each request that comes over one."""
NOTE_KEY = 'request'
"""Topic that tells of every other request."""


def pack_effect(request: Request, time_ns: int) -> Packed:
    """Return a request as the message of its topic, at the time at which it takes effect."""
    key = COMMAND_KEYS.get(request.name)
    if key is None:
        return Packed(NOTE_KEY, time_ns, pack_note(request))
    return Packed(key, time_ns, pack_request(request, time_ns))


class RunWriter:
    """
    Write a run to a new file.

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

    Attributes
    ----------
    waits : bool
        As given.

    Raises
    ------
    RecordingError
        If the file exists or cannot be written.

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
        self._topics = {key: channel.topic for key, channel in channels.items()}
        self.waits = wait
        self._info = pack_string(info_json(parameters))
        self.recorder = open_recorder(path, parameters, channels)

    def begin(self, time_ns: int, status: Status) -> None:
        """Write what is latched: the recording starts at this simulated time."""
        self.write(Packed('info', time_ns, self._info))
        self.write(Packed('status', time_ns, pack_uint32(int(status))))

    def write(self, packed: Packed) -> None:
        """Hand one message over."""
        topic = self._topics[packed.key]
        self.recorder.put(topic, packed.time_ns, packed.data, wait=self.waits)

    def write_requests(self, requests: Iterable[Request], time_ns: int) -> None:
        """Hand over requests, at the time at which they take effect."""
        for request in requests:
            self.write(pack_effect(request, time_ns))

    def check(self) -> None:
        """Raise what has ended the writing, such as a full disk, if anything has."""
        if self.recorder.error is not None:
            raise self.recorder.error

    def close(self) -> None:
        """Write what is queued and finish the file."""
        self.recorder.close()

    def __enter__(self) -> 'RunWriter':
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
