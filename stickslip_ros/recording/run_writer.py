"""A run on its way into a file: what the instrument says and what it was asked, by key."""

from collections.abc import Iterable
from pathlib import Path
from types import TracebackType

from stickslip_ros.instrument.commands import Request
from stickslip_ros.instrument.reports import Status
from stickslip_ros.parameters import Parameters
from stickslip_ros.recording.cdr import pack_string, pack_uint32
from stickslip_ros.recording.feed import Packed, pack_request
from stickslip_ros.recording.run_file import info_json, open_recorder
from stickslip_ros.recording.topics import COMMANDS, NODE_NAME, recorded_channels

COMMAND_KEYS = {topic.request: topic.key for topic in COMMANDS if topic.recorded}
"""Topic of each request that comes over one."""


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
    namespace, node_name : str
        Of the node, for the names of the topics.

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
        namespace: str = '/',
        node_name: str = NODE_NAME,
    ) -> None:
        channels = recorded_channels(parameters, namespace, node_name)
        self._topics = {key: channel.topic for key, channel in channels.items()}
        self._wait = wait
        self._info = pack_string(info_json(parameters))
        self.recorder = open_recorder(path, parameters, namespace, node_name)

    def begin(self, time_ns: int, status: Status) -> None:
        """Write what is latched: the recording starts at this simulated time."""
        self.write(Packed('info', time_ns, self._info))
        self.write(Packed('status', time_ns, pack_uint32(int(status))))

    def write(self, packed: Packed) -> None:
        """Hand one message over."""
        topic = self._topics[packed.key]
        self.recorder.put(topic, packed.time_ns, packed.data, wait=self._wait)

    def write_requests(self, requests: Iterable[Request], time_ns: int) -> None:
        """Hand over the requests of topics, at the time at which they take effect."""
        for request in requests:
            key = COMMAND_KEYS.get(request.name)
            if key is not None:
                self.write(Packed(key, time_ns, pack_request(request, time_ns)))

    def close(self) -> None:
        """Write what is queued and finish the file."""
        self.recorder.close()

    def __enter__(self) -> 'RunWriter':
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()
