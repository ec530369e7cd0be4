"""The other side of lockstep: a controller that answers every position, then grants a block."""

from collections.abc import Callable, Iterable
from typing import Any

from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node

from stickslip_ros.errors import UnknownName
from stickslip_ros.parameters import to_nanoseconds
from stickslip_ros.recording.topics import COMMANDS, NODE_NAME, READINGS, Topic
from stickslip_ros.ros.handshake import Handshake
from stickslip_ros.ros.interface import MESSAGE_TYPES, to_profile
from stickslip_ros.ros.requests import to_message
from stickslip_ros.units import NANO, NS_PER_S

KNOCK_PERIOD_S = 0.02
"""Wall-clock time after which the first grant is sent again, until a position arrives."""

Commands = Iterable[tuple[str, Any]]
"""Names of commands, as they follow ``command/``, and their values as `to_message` takes them."""


class LockstepClient:
    """
    Control a drive with ``sim.lockstep``, so that the result does not depend on any delay.

    The client waits until it is connected, sends the commands of the first block and grants it.
    For every position it then sends the commands that ``on_position`` returns, and grants the
    time up to the next one. It must be the only one that sends commands and grants, and must
    begin with the activation of the drive. Spin its node as usual.

    Parameters
    ----------
    node : Node
        Has the publishers and subscriptions.
    block_s : float
        Time from one answer to the next: ``sim.block`` of the drive, or a multiple of it, s.
    on_position : callable
        Receives stamp (s) and position (m); returns what to command next.
    first : iterable of (str, value)
        Commands for the time before the first position.
    namespace : str
        Namespace of the drive; by default that of the node.
    drive_name : str
        Name of the drive's node.
    start_s : float
        Simulated time at which the drive waits: 0 after a configuration.

    Attributes
    ----------
    sent : int
        Commands sent so far.
    granted_ns : int
        Simulated time granted so far.

    """

    def __init__(
        self,
        node: Node,
        block_s: float,
        on_position: Callable[[float, float], Commands],
        *,
        first: Commands = (),
        namespace: str = '',
        drive_name: str = NODE_NAME,
        start_s: float = 0.0,
    ) -> None:
        self.sent = 0
        self.granted_ns = to_nanoseconds(start_s)
        self._node = node
        self._block_ns = to_nanoseconds(block_s)
        self._on_position = on_position
        self._first: Commands | None = first
        self._is_active = self._has_begun = False
        self._prefix = f'{namespace.rstrip("/")}/' if namespace else ''
        self._drive_name = drive_name
        self._commands = {topic.request: topic for topic in COMMANDS}
        self._publishers = {name: self._publish(topic) for name, topic in self._commands.items()}
        readings = {topic.key: topic for topic in READINGS}
        self._position = self._listen(readings['position'], self._take_position)
        # Latched: it comes as soon as there is an active drive.
        self._status = self._listen(readings['status'], self._take_status)
        self._handshake = Handshake(node, self._prefix + drive_name)
        clock = Clock(clock_type=ClockType.STEADY_TIME)
        self._timer = node.create_timer(KNOCK_PERIOD_S, self._knock, clock=clock)

    def send(self, name: str, value: Any) -> None:
        """
        Send a command, and count it.

        Parameters
        ----------
        name : str
            What follows ``command/`` in the name of its topic.
        value : float, int or sequence of float
            Its numbers; see `to_message`.

        Raises
        ------
        UnknownName
            If there is no such command.

        """
        if name not in self._commands or name == 'grant':
            known = ', '.join(each for each in self._commands if each != 'grant')
            raise UnknownName('command', name, f'use {known}')
        self._publishers[name].publish(to_message(self._commands[name], value))
        self.sent += 1

    def close(self) -> None:
        """Leave the drive, which waits from now on."""
        self._node.destroy_timer(self._timer)
        for subscription in (self._position, self._status):
            self._node.destroy_subscription(subscription)
        for publisher in self._publishers.values():
            self._node.destroy_publisher(publisher)
        self._handshake.close()

    def _publish(self, topic: Topic) -> Any:
        message_type = MESSAGE_TYPES[topic.type_name]
        return self._node.create_publisher(
            message_type, self._name_of(topic), to_profile(topic.qos)
        )

    def _listen(self, topic: Topic, callback: Callable[[Any], None]) -> Any:
        message_type = MESSAGE_TYPES[topic.type_name]
        return self._node.create_subscription(
            message_type, self._name_of(topic), callback, to_profile(topic.qos)
        )

    def _name_of(self, topic: Topic) -> str:
        return self._prefix + topic.name.replace('~', self._drive_name)

    def _is_connected(self) -> bool:
        obeyed = all(each.get_subscription_count() for each in self._publishers.values())
        heard = self._is_active and bool(self._position.get_publisher_count())
        return heard and obeyed and self._handshake.knock()

    def _knock(self) -> None:
        """Ask for the first block until it comes; the same grant twice is the same as once."""
        if self._has_begun:
            self._timer.cancel()
        elif self._first is None:
            self._grant()
        elif self._is_connected():
            first, self._first = self._first, None
            self.granted_ns += self._block_ns
            self._send_all(first)

    def _take_status(self, _: Any) -> None:
        self._is_active = True

    def _take_position(self, message: Any) -> None:
        stamp = message.header.stamp
        time_ns = stamp.sec * NS_PER_S + stamp.nanosec
        if self._first is not None or time_ns < self.granted_ns:
            return
        self._has_begun = True
        self.granted_ns = time_ns + self._block_ns
        self._send_all(self._on_position(time_ns * NANO, message.point.x))

    def _send_all(self, commands: Commands) -> None:
        for name, value in commands:
            self.send(name, value)
        self._grant()

    def _grant(self) -> None:
        values = (self.granted_ns * NANO, self.sent)
        self._publishers['grant'].publish(to_message(self._commands['grant'], values))
