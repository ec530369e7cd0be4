"""What a bare loop sends: the topics of the node, of the same types, sizes and rates."""

from abc import ABC, abstractmethod
from array import array
from collections.abc import Sequence
from contextlib import ExitStack
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np
from geometry_msgs.msg import PointStamped, WrenchStamped
from numpy.typing import NDArray
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, Float64MultiArray, MultiArrayDimension

from stickslip_ros.units import NS_PER_S

DEPTH = 100
COLUMNS = 't[s],voltage[V],foot[m],position[m],force[N]'
BLOCK_NS = 1_000_000
TRACE_BLOCKS = 10
"""Ticks per message of trace, voltage and joint_states."""
TABLES = 64
"""Different contents of the trace, made beforehand."""
TYPES = {
    'position': PointStamped,
    'force': WrenchStamped,
    'joint_states': JointState,
    'voltage': Float64,
    'trace': Float64MultiArray,
}
FRAMES = {'position': 'stage_base', 'force': 'load_cell', 'joint_states': 'stage_base'}


class Traffic:
    """
    What a tick publishes: nothing, so that the loop itself is left; others publish readings.

    Attributes
    ----------
    reading_m : float
        What ``position`` says.

    """

    reading_m = 0.0

    def send(self, tick: int) -> None:
        """Publish what belongs to the tick of this number, the first of which is 1."""

    def close(self) -> None:
        """Finish the file, if there is one; nothing is sent any more."""


def publishers_of(node: Node, topics: Sequence[str] = tuple(TYPES)) -> dict[str, Any]:
    """Return a publisher for each topic."""
    profile = QoSProfile(depth=DEPTH)
    return {name: node.create_publisher(TYPES[name], name, profile) for name in topics}


class Objects(Traffic):
    """
    Message objects, made once; a tick sets the stamp and the values, and publishes them.

    Nothing is computed: the trace comes from tables made beforehand.

    Parameters
    ----------
    node : Node
        Has the publishers.
    rate_hz : float
        Samples per second of the trace.
    topics : sequence of str
        Topics to publish.

    """

    def __init__(self, node: Node, rate_hz: float, topics: Sequence[str]) -> None:
        self._publishers = publishers_of(node, topics)
        tables = tables_of(rate_hz)
        self._shape = tables[0].shape
        self._tables = cycle([table.tobytes() for table in tables])
        self._kept = {name: self.make(name) for name in TYPES}

    def make(self, name: str) -> Any:
        """Return a new message with what never changes in it."""
        message = TYPES[name]()
        if name in FRAMES:
            message.header.frame_id = FRAMES[name]
        if name == 'joint_states':
            message.name = ['runner_joint']
            message.position = message.velocity = message.effort = array('d', [0.0])
        if name == 'trace':
            rows, columns = self._shape
            message.layout.dim = [
                MultiArrayDimension(label='sample', size=rows, stride=rows * columns),
                MultiArrayDimension(label=COLUMNS, size=columns, stride=columns),
            ]
        return message

    def message(self, name: str) -> Any:
        """Return the message to fill."""
        return self._kept[name]

    def send(self, tick: int) -> None:
        """Fill and publish the messages of a tick."""
        seconds, nanoseconds = divmod(tick * BLOCK_NS, NS_PER_S)
        position, force = self.message('position'), self.message('force')
        joint = self.message('joint_states')
        for message in (position, force, joint):
            message.header.stamp.sec = seconds
            message.header.stamp.nanosec = nanoseconds
        position.point.x = self.reading_m
        force.wrench.force.x = self.reading_m
        self.publish('position', position, tick)
        self.publish('force', force, tick)
        if tick % TRACE_BLOCKS == 0:
            voltage, trace = self.message('voltage'), self.message('trace')
            joint.position[0] = joint.effort[0] = self.reading_m
            voltage.data = self.reading_m
            trace.data = array('d', next(self._tables))
            self.publish('joint_states', joint, tick)
            self.publish('voltage', voltage, tick)
            self.publish('trace', trace, tick)

    def publish(self, name: str, message: Any, _tick: int) -> None:
        """Publish a message, if its topic was asked for."""
        publisher = self._publishers.get(name)
        if publisher is not None:
            publisher.publish(message)


class Fresh(Objects):
    """The same with new message objects in every tick."""

    def message(self, name: str) -> Any:
        """Return the message to fill."""
        return self.make(name)


class Recorded(Objects, ABC):
    """
    The same, on all topics, and each message goes into a file.

    Parameters
    ----------
    node, rate_hz
        See `Objects`.
    path : Path
        The file.

    """

    def __init__(self, node: Node, rate_hz: float, path: Path) -> None:
        super().__init__(node, rate_hz, tuple(TYPES))
        self._end = ExitStack()
        self._open(path, self._end)

    @abstractmethod
    def _open(self, path: Path, end: ExitStack) -> None:
        """Open the file, and put on the stack what finishes it."""

    @abstractmethod
    def _write(self, name: str, message: Any, time_ns: int) -> None:
        """Write a message as it was published."""

    def publish(self, name: str, message: Any, tick: int) -> None:
        """Publish and write a message."""
        super().publish(name, message, tick)
        self._write(name, message, tick * BLOCK_NS)

    def close(self) -> None:
        """Finish the file."""
        self._end.close()


class RecordedInline(Recorded):
    """Recorded by mcap_ros2's writer, in the thread that publishes."""

    def _open(self, path: Path, end: ExitStack) -> None:
        from mcap_ros2.writer import Writer  # noqa: PLC0415 - only this rival needs them

        from stickslip_ros.interface.schemas import SCHEMAS  # noqa: PLC0415

        self._writer = Writer(end.enter_context(path.open('wb')))
        end.callback(self._writer.finish)
        self._schemas = {}
        for name, kind in TYPES.items():
            full = f'{kind.__module__.split(".")[0]}/msg/{kind.__name__}'
            self._schemas[name] = self._writer.register_msgdef(full, SCHEMAS[full])

    def _write(self, name: str, message: Any, time_ns: int) -> None:
        self._writer.write_message(f'/{name}', self._schemas[name], message, log_time=time_ns)


class RecordedApart(Recorded):
    """Recorded by the recorder of the node, in a thread of its own; it takes packed messages."""

    def _open(self, path: Path, end: ExitStack) -> None:
        from stickslip_ros.interface.topics import recorded_channels  # noqa: PLC0415
        from stickslip_ros.parameters import Parameters  # noqa: PLC0415 - only this rival does
        from stickslip_ros.recording.recorder import Recorder  # noqa: PLC0415

        channels = recorded_channels(Parameters())
        self._recorder = Recorder(path, {name: channels[name] for name in TYPES})
        end.callback(self._recorder.close)

    def _write(self, name: str, message: Any, time_ns: int) -> None:
        self._recorder.put(name, time_ns, message)

    def publish(self, name: str, message: Any, tick: int) -> None:
        """Pack a message, once for both."""
        super().publish(name, serialize_message(message), tick)


class Packed(Traffic):
    """Bytes packed once and published again and again: what publishing alone costs."""

    def __init__(self, node: Node, rate_hz: float) -> None:
        messages = {name: Objects(node, rate_hz, ()).make(name) for name in TYPES}
        messages['trace'].data = array('d', tables_of(rate_hz)[0].tobytes())
        self._publishers = publishers_of(node)
        self._bytes = {name: serialize_message(each) for name, each in messages.items()}

    def send(self, tick: int) -> None:
        """Publish the messages of a tick."""
        self._publish('position')
        self._publish('force')
        if tick % TRACE_BLOCKS == 0:
            self._publish('joint_states')
            self._publish('voltage')
            self._publish('trace')

    def _publish(self, name: str) -> None:
        self._publishers[name].publish(self._bytes[name])


def tables_of(rate_hz: float) -> list[NDArray[np.float64]]:
    """Return blocks of samples like those of the drive: a saw-tooth and noisy readings."""
    rows = round(rate_hz * TRACE_BLOCKS * BLOCK_NS / NS_PER_S)
    random = np.random.default_rng(1)
    time_s = np.arange(TABLES * rows) / rate_hz
    voltage_v = 300.0 * ((50.0 * time_s) % 1.0)
    foot_m = 1e-9 * voltage_v
    position_m = foot_m + random.normal(0.0, 1e-10, len(time_s))
    force_n = 0.1 + random.normal(0.0, 1e-4, len(time_s))
    table = np.column_stack((time_s, voltage_v, foot_m, position_m, force_n))
    return np.split(table, TABLES)
