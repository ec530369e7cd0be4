"""Clients of a drive: a handshake after discovery, and a controller's side of lockstep."""

import json
from collections.abc import Callable, Iterable
from time import monotonic
from typing import Any

from lifecycle_msgs.srv import GetState
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node

from stickslip_ros.errors import UnknownName
from stickslip_ros.parameters import to_nanoseconds
from stickslip_ros.recording.requests import pack_command
from stickslip_ros.recording.run_file import TIME_ORIGIN
from stickslip_ros.recording.topics import COMMAND_TOPICS, NODE_NAME, READINGS, Topic
from stickslip_ros.ros.interface import MESSAGE_TYPES, to_profile
from stickslip_ros.units import NANO, NS_PER_S

RETRY_S = 0.2
"""Wall-clock time after which a call without an answer is made again."""
BEGIN_PERIOD_S = 0.02
"""Wall-clock time after which the first grant is sent again, until a position arrives."""

Commands = Iterable[tuple[str, Any]]
"""Names of commands, as they follow ``command/``, and their values as for `pack_command`."""

_COMMANDS = {topic.request: topic for topic in COMMAND_TOPICS}


def command_topic(name: str, *, but: str = '') -> Topic:
    """Return the topic of a command, by what follows ``command/``; refuse an unknown one."""
    if name not in _COMMANDS or name == but:
        known = ', '.join(each for each in _COMMANDS if each != but)
        raise UnknownName('command', name, f'use {known}')
    return _COMMANDS[name]


def stamp_ns(message: Any) -> int:
    """Return the stamp in the header of a message, in ns."""
    stamp = message.header.stamp
    return int(stamp.sec) * NS_PER_S + int(stamp.nanosec)


class Handshake:
    """
    A call to a drive, made again until it is answered; without it a first command may be lost.

    DDS tells the two ends of a topic of each other one after the other, under load seconds apart.
    What a publisher sends before the drive knows of it is lost, although the publisher already
    counts a subscriber. A node announces what it offers in order, so once a service has answered
    a client of it, the drive knows all that the node has offered before that client.

    Parameters
    ----------
    node : Node
        Its publishers and subscriptions exist already.
    drive : str
        Name of the drive's node, with its namespace if that is not the one of ``node``.

    Attributes
    ----------
    state : str
        What the drive answered: the state of its lifecycle.

    """

    def __init__(self, node: Node, drive: str) -> None:
        self._node = node
        self._client = node.create_client(GetState, f'{drive}/get_state')
        self._asked_s = -RETRY_S
        self._is_answered = False
        self.state = ''

    def is_done(self) -> bool:
        """Call, unless that was done just now; tell whether an answer has come."""
        now_s = monotonic()
        is_due = now_s - self._asked_s >= RETRY_S
        if not self._is_answered and is_due and self._client.service_is_ready():
            self._asked_s = now_s
            self._client.call_async(GetState.Request()).add_done_callback(self._take_answer)
        return self._is_answered

    def close(self) -> None:
        """Take the client away."""
        self._node.destroy_client(self._client)

    def _take_answer(self, answer: Any) -> None:
        self._is_answered = True
        self.state = answer.result().current_state.label


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
        Receives simulated time (s) and position (m); returns what to command next.
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
        self._time_origin_ns: int | None = None
        self._has_begun = False
        self._prefix = f'{namespace.rstrip("/")}/' if namespace else ''
        self._drive_name = drive_name
        self._publishers = {
            name: node.create_publisher(*self._ends_of(topic), to_profile(topic.qos))
            for name, topic in _COMMANDS.items()
        }
        readings = {topic.key: topic for topic in READINGS}
        self._position = self._listen(readings['position'], self._take_position)
        # Latched: it comes as soon as there is an active drive.
        self._info = self._listen(readings['info'], self._take_info)
        self._handshake = Handshake(node, self._prefix + drive_name)
        clock = Clock(clock_type=ClockType.STEADY_TIME)
        self._timer = node.create_timer(BEGIN_PERIOD_S, self._begin, clock=clock)

    def send(self, name: str, value: Any, cycles: int = 1) -> None:
        """
        Send a command, and count it.

        Parameters
        ----------
        name : str
            What follows ``command/`` in the name of its topic.
        value : float, int or sequence of float
            Its numbers; see `pack_command`.
        cycles : int
            How often a waveform is played; 0 repeats until replaced.

        Raises
        ------
        UnknownName
            If there is no such command.

        """
        topic = command_topic(name, but='grant')
        self._publishers[name].publish(pack_command(topic, value, cycles=cycles))
        self.sent += 1

    def close(self) -> None:
        """Leave the drive, which waits from now on."""
        self._node.destroy_timer(self._timer)
        for subscription in (self._position, self._info):
            self._node.destroy_subscription(subscription)
        for publisher in self._publishers.values():
            self._node.destroy_publisher(publisher)
        self._handshake.close()

    def _listen(self, topic: Topic, callback: Callable[[Any], None]) -> Any:
        ends = self._ends_of(topic)
        return self._node.create_subscription(*ends, callback, to_profile(topic.qos))

    def _ends_of(self, topic: Topic) -> tuple[Any, str]:
        """Return what the ends of a topic have in common: type and name."""
        name = self._prefix + topic.name.replace('~', self._drive_name)
        return MESSAGE_TYPES[topic.type_name], name

    def _is_connected(self) -> bool:
        obeyed = all(each.get_subscription_count() for each in self._publishers.values())
        is_active = self._time_origin_ns is not None
        heard = is_active and bool(self._position.get_publisher_count())
        return heard and obeyed and self._handshake.is_done()

    def _begin(self) -> None:
        """Ask for the first block until it comes; the same grant twice is the same as once."""
        if self._has_begun:
            self._timer.cancel()
        elif self._first is None:
            self._grant()
        elif self._is_connected():
            first, self._first = self._first, None
            self.granted_ns += self._block_ns
            self._send_all(first)

    def _take_info(self, message: Any) -> None:
        self._time_origin_ns = int(json.loads(message.data)[TIME_ORIGIN])

    def _take_position(self, message: Any) -> None:
        time_ns = stamp_ns(message) - (self._time_origin_ns or 0)
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
        self._publishers['grant'].publish(pack_command(_COMMANDS['grant'], values))
