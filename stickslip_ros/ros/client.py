# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The client of a drive for panel, tests and controllers: handshake, commands, lockstep."""

import json
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import replace
from time import monotonic
from typing import Any

import rclpy
from lifecycle_msgs.srv import GetState
from rclpy.client import Client
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.context import Context
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from stickslip_ros.errors import UnknownName
from stickslip_ros.interface.requests import pack_command
from stickslip_ros.interface.topics import COMMAND_TOPICS, TOPICS, Topic
from stickslip_ros.parameters import NODE_NAME, to_nanoseconds
from stickslip_ros.recording.run_file import TIME_ORIGIN, to_time_ns
from stickslip_ros.ros.interface import MESSAGE_TYPES, to_profile
from stickslip_ros.units import NANO, NS_PER_S

RETRY_S = 0.2
"""Wall-clock time after which an unanswered call is repeated."""
BEGIN_PERIOD_S = 0.02
"""Wall-clock time after which the first grant is sent again, until a position arrives."""

_MARK_SERVICE = 'step_simulation'
"""A service that only drives have, from their configuration on."""

Commands = Iterable[tuple[str, Any]]
"""Commands: name after ``command/``, and value as for `pack_command`."""

_COMMANDS = {topic.request: topic for topic in COMMAND_TOPICS}
_TOPICS = {topic.key: topic for topic in TOPICS}


def command_topic(name: str, *, but: str = '') -> Topic:
    """Return the topic ``command/NAME``; refuse an unknown name."""
    if name not in _COMMANDS or name == but:
        choices = ', '.join(each for each in _COMMANDS if each != but)
        raise UnknownName('command', name, f'use {choices}')
    return _COMMANDS[name]


def stamp_ns(message: Any) -> int:
    """Return the stamp in the header of a message, in ns."""
    stamp = message.header.stamp
    return int(stamp.sec) * NS_PER_S + int(stamp.nanosec)


def drives_of(node: Node, namespace: str = '') -> list[str]:
    """Return the full names of the drives that a node sees, by default of all namespaces."""
    nodes = sorted(node.get_node_names_and_namespaces())
    names = {f'{place.rstrip("/")}/{name}': (name, place) for name, place in nodes}
    return [
        full
        for full, (name, place) in names.items()
        if namespace in ('', place)
        and (name == NODE_NAME or node.count_services(f'{full}/{_MARK_SERVICE}'))
    ]


def open_context(
    domain: int | None = None, namespace: str = '', remaps: Sequence[str] = ()
) -> Context:
    """
    Return a new context of rclpy, without signal handlers; end it with ``try_shutdown``.

    Parameters
    ----------
    domain : int or None
        ROS domain; that of the environment if None.
    namespace : str
        Namespace of its nodes, as ``/left``.
    remaps : sequence of str
        Further remapping rules, as ``command/voltage:=volts``.

    """
    rules = (f'__ns:={namespace}', *remaps) if namespace else remaps
    arguments = ['--ros-args', *(word for rule in rules for word in ('-r', rule))] if rules else []
    context = Context()
    rclpy.init(
        args=arguments,
        context=context,
        domain_id=domain,
        signal_handler_options=SignalHandlerOptions.NO,
    )
    return context


class Handshake:
    """
    A call to a drive, repeated until it is answered, so that no first command is lost.

    DDS informs the two ends of a topic one after the other, under load seconds apart. A message
    that a publisher sends before the drive knows of it is lost, although the publisher already
    counts a subscriber. A node announces its endpoints in order. So once a service has answered
    a client, the drive knows every endpoint that the node made before that client.

    Parameters
    ----------
    node : Node
        Its publishers and subscriptions exist already.
    drive : str
        Name of the drive's node, with its namespace if that is not the one of ``node``.

    Attributes
    ----------
    state : str
        Answer of the drive, the state of its lifecycle; empty before the answer.

    """

    def __init__(self, node: Node, drive: str) -> None:
        self._node = node
        self._client = node.create_client(GetState, f'{drive}/get_state')
        self._asked_s = -RETRY_S
        self.state = ''

    def is_done(self) -> bool:
        """Call if the last call is old; return whether an answer has come."""
        now_s = monotonic()
        is_due = now_s - self._asked_s >= RETRY_S
        if not self.state and is_due and self._client.service_is_ready():
            self._asked_s = now_s
            self._client.call_async(GetState.Request()).add_done_callback(self._take_answer)
        return bool(self.state)

    def close(self) -> None:
        self._node.destroy_client(self._client)

    def _take_answer(self, answer: Any) -> None:
        self.state = answer.result().current_state.label


class DriveClient:
    """
    Publishers of a drive's commands, with subscriptions and services on request, on any node.

    The owner of the node spins it. ``drive`` is the name of the drive's node, with its namespace
    if that differs from the one of ``node``; ``commands`` are the commands that can be sent. Make
    a `Handshake` after the client, and wait until it is done before the first command.

    """

    def __init__(
        self, node: Node, drive: str = NODE_NAME, commands: Iterable[str] = tuple(_COMMANDS)
    ) -> None:
        self.node = node
        self.drive = drive
        self.sent = 0  # commands so far
        self.info: dict[str, Any] = {}  # the last ``~/info``, if `take_info` is subscribed to it
        self._publishers = {
            name: node.create_publisher(*self._ends_of(topic), to_profile(topic.qos))
            for name, topic in ((name, command_topic(name)) for name in commands)
        }
        self._subscriptions: list[tuple[Topic, Any]] = []
        self._services: dict[str, Client] = {}

    def command(self, name: str, value: Any, cycles: int = 1, tag: str = '') -> None:
        """
        Send a command.

        Raises UnknownName if there is no such command.

        Parameters
        ----------
        name : str
            Name of its topic behind ``command/``.
        value : float, int or sequence of float
            Its number or numbers in SI units, in the order of docs/reference/interface.md:
            ``('voltage', 150.0)``, ``('sawtooth', (300.0, 500.0, 10.0))``, ``('waveform', rows)``.
        cycles : int
            Number of times that a waveform is played; 0 repeats until replaced.
        tag : str
            Word that comes back in its events, for a command with a header or a layout.

        """
        self.send(name, pack_command(command_topic(name), value, cycles=cycles, tag=tag))

    def send(self, name: str, message: Any) -> None:
        """Send any message on ``command/NAME``, even a message that the drive must refuse."""
        self._publishers[name].publish(message)
        self.sent += 1

    def subscribe(
        self,
        key: str,
        take: Callable[[Any], None],
        *,
        depth: int = 0,
        raw: bool = False,
        best_effort: bool = False,
    ) -> None:
        """
        Subscribe to a topic by its key; with ``raw`` the messages come as bytes.

        The queue is as deep as the topic declares, or ``depth``; for a latched topic, 1. With
        ``best_effort`` a lost message does not delay later ones.

        """
        topic = _TOPICS[key]
        profile = to_profile(replace(topic.qos, reliable=not best_effort))
        if depth and not topic.qos.latched:
            profile.depth = depth
        made = self.node.create_subscription(*self._ends_of(topic), take, profile, raw=raw)
        self._subscriptions.append((topic, made))

    def service(self, service_type: Any, name: str) -> Client:
        """Return the client of a service of the drive; made at the first call."""
        if name not in self._services:
            self._services[name] = self.node.create_client(service_type, f'{self.drive}/{name}')
        return self._services[name]

    def take_info(self, message: Any) -> None:
        """Subscribe to ``~/info`` of the drive, which is latched from its activation on."""
        with suppress(ValueError, RecursionError, TypeError, KeyError):
            said = json.loads(message.data)
            self.info = {**said, TIME_ORIGIN: to_time_ns(said[TIME_ORIGIN])}

    def simulated_ns(self, message: Any) -> int:
        """Return the simulated time of a stamped message, ns; needs the drive's info."""
        return stamp_ns(message) - int(self.info[TIME_ORIGIN])

    def is_connected(self) -> bool:
        """Return whether all topics that every drive has are connected."""
        heard = (made for topic, made in self._subscriptions if not topic.switches)
        obeyed = (made for name, made in self._publishers.items() if not _COMMANDS[name].switches)
        return all(each.get_publisher_count() for each in heard) and all(
            each.get_subscription_count() for each in obeyed
        )

    def close(self) -> None:
        """Leave the drive; the node remains."""
        for _, subscription in self._subscriptions:
            self.node.destroy_subscription(subscription)
        for publisher in self._publishers.values():
            self.node.destroy_publisher(publisher)
        for client in self._services.values():
            self.node.destroy_client(client)

    def _ends_of(self, topic: Topic) -> tuple[Any, str]:
        """Return the message type and the full name of a topic."""
        namespace, slash, node_name = self.drive.rpartition('/')
        name = topic.name.replace('~', node_name)
        is_absolute = name.startswith('/')
        return MESSAGE_TYPES[topic.type_name], name if is_absolute else namespace + slash + name


class LockstepClient(DriveClient):
    """
    Control a drive with ``sim.lockstep``, so that the result does not depend on any delay.

    The client waits until it is connected, sends the commands of the first block and grants it.
    For every position it then sends the commands that ``on_position`` returns, and grants the
    time up to the next one. It must be the only sender of commands and grants, and must begin
    with the activation of the drive. Spin its node as usual.

    Parameters
    ----------
    node : Node
        Has the publishers and subscriptions.
    block_s : float
        Time from one answer to the next: ``sim.block`` of the drive, or a multiple of it, s.
    on_position : callable
        Receives simulated time (s) and position (m); returns the next commands.
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
        place = f'{namespace.rstrip("/")}/' if namespace else ''
        super().__init__(node, place + drive_name)
        self.granted_ns = to_nanoseconds(start_s)
        self._block_ns = to_nanoseconds(block_s)
        self._on_position = on_position
        self._first: Commands | None = first
        self._has_begun = False
        self.subscribe('position', self._take_position)
        self.subscribe('info', self.take_info)
        self._handshake = Handshake(node, self.drive)
        clock = Clock(clock_type=ClockType.STEADY_TIME)
        self._timer = node.create_timer(BEGIN_PERIOD_S, self._begin, clock=clock)

    def command(self, name: str, value: Any, cycles: int = 1, tag: str = '') -> None:
        """Send a command; refuse grants, which the client sends by itself."""
        super().command(command_topic(name, but='grant').request, value, cycles, tag)

    def is_connected(self) -> bool:
        return super().is_connected() and self._publishers['grant'].get_subscription_count() > 0

    def close(self) -> None:
        """Leave the drive; it waits from now on."""
        self.node.destroy_timer(self._timer)
        self._handshake.close()
        super().close()

    def _begin(self) -> None:
        """Grant the first block again until it comes; a repeated grant changes nothing."""
        if self._has_begun:
            self._timer.cancel()
        elif self._first is None:
            self._grant()
        elif self.info and self.is_connected() and self._handshake.is_done():
            first, self._first = self._first, None
            self.granted_ns += self._block_ns
            self._send_all(first)

    def _take_position(self, message: Any) -> None:
        if self._first is not None or (time_ns := self.simulated_ns(message)) < self.granted_ns:
            return
        self._has_begun = True
        self.granted_ns = time_ns + self._block_ns
        self._send_all(self._on_position(time_ns * NANO, message.point.x))

    def _send_all(self, commands: Commands) -> None:
        for name, value in commands:
            self.command(name, value)
        self._grant()

    def _grant(self) -> None:
        grant = (self.granted_ns * NANO, self.sent)
        self._publishers['grant'].publish(pack_command(_COMMANDS['grant'], grant))
