"""An operator at the virtual stand: commands it and listens to it, over topics only."""

import json
from collections import Counter
from collections.abc import Callable
from functools import partial
from time import monotonic
from typing import Any

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.msg import Log
from rcl_interfaces.srv import SetParameters
from rclpy.client import Client
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy
from rclpy.task import Future
from std_srvs.srv import SetBool, Trigger

from stickslip_ros.errors import StickSlipError
from stickslip_ros.recording.requests import pack_command
from stickslip_ros.recording.run_file import TIME_ORIGIN
from stickslip_ros.recording.topics import COMMAND_TOPICS, NODE_NAME, READINGS, TOPICS, Topic
from stickslip_ros.ros.client import Handshake, command_topic, stamp_ns
from stickslip_ros.ros.ending import end_node
from stickslip_ros.ros.interface import MESSAGE_TYPES, to_profile
from stickslip_ros.stopping import heed_stop
from stickslip_ros.units import NS_PER_S

TIMEOUT_S = 30.0
LISTEN_DEPTH = 10_000
TRANSITIONS = {
    'configure': Transition.TRANSITION_CONFIGURE,
    'cleanup': Transition.TRANSITION_CLEANUP,
    'activate': Transition.TRANSITION_ACTIVATE,
    'deactivate': Transition.TRANSITION_DEACTIVATE,
    'shutdown unconfigured': Transition.TRANSITION_UNCONFIGURED_SHUTDOWN,
    'shutdown inactive': Transition.TRANSITION_INACTIVE_SHUTDOWN,
    'shutdown active': Transition.TRANSITION_ACTIVE_SHUTDOWN,
}


def deep_queues(*topics: str) -> dict[str, int]:
    """
    Return parameters with which a drive keeps all that an operator hears of some topics.

    By default a hundred messages wait for whoever listens: on a machine that is busy a tenth of
    a second may pass in which DDS delivers nothing, and there is a hole.

    """
    return {f'qos_overrides./{topic}.publisher.depth': LISTEN_DEPTH for topic in topics}


class Operator:
    """
    A node that commands a drive and collects everything that it publishes.

    Parameters
    ----------
    context : Context
        An initialised rclpy context.
    drive_name : str
        Name of the drive's node.

    Attributes
    ----------
    received : Counter
        Messages by the key of their topic; of commands, those that were sent.
    positions : dict of int to float
        Interferometer readings in m by simulated time in ns.
    time_ns : int
        Simulated time of the last of these, ns.
    requests : list of dict
        Decoded ``~/request`` messages.
    events : list of dict
        Decoded ``~/event`` messages.
    status : int or None
        Last ``~/status``.
    info : dict
        Last ``~/info``.
    diagnostics : list of dict
        Decoded ``/diagnostics`` messages: values by the name of the part.
    check : callable
        Called before every message that is waited for; may raise what ends the wait.

    """

    def __init__(self, context: Context, drive_name: str = NODE_NAME) -> None:
        self.node = Node('operator', context=context)
        self.received: Counter[str] = Counter()
        self.positions: dict[int, float] = {}
        self.time_ns = 0
        self._early: list[Any] = []
        self.events: list[dict[str, Any]] = []
        self.requests: list[dict[str, Any]] = []
        self.status: int | None = None
        self.info: dict[str, Any] = {}
        self.diagnostics: list[dict[str, dict[str, str]]] = []
        self.check: Callable[[], None] = heed_stop
        self._executor = SingleThreadedExecutor(context=context)
        self._executor.add_node(self.node)
        self._drive = drive_name
        self._clients: dict[str, Client] = {}
        self._publishers = {
            topic.request: self.node.create_publisher(
                MESSAGE_TYPES[topic.type_name], topic.name, to_profile(topic.qos)
            )
            for topic in COMMAND_TOPICS
        }
        takers: dict[str, Callable[[Any], None]] = {
            'event': lambda message: self.events.append(json.loads(message.data)),
            'request': lambda message: self.requests.append(json.loads(message.data)),
            'status': self._take_status,
            'info': self._take_info,
            'diagnostics': self._take_diagnostics,
            'position': self._take_position,
        }
        self._subscriptions = {
            topic.key: self._subscribe(topic, partial(self._take, topic.key, takers))
            for topic in sorted(READINGS, key=lambda topic: topic.key != 'info')
        }

    def add_node(self, node: Node) -> None:
        """Handle the messages of another node, such as a controller, whenever this one waits."""
        self._executor.add_node(node)

    def spin_until(
        self, condition: Callable[[], bool], what: str, timeout_s: float = TIMEOUT_S
    ) -> None:
        """
        Handle messages until a condition holds, which is tested after every one.

        Raises
        ------
        StickSlipError
            If it does not come true in time; ``what`` was waited for.

        """
        end_s = monotonic() + timeout_s
        while not condition():
            self.check()
            if monotonic() > end_s:
                raise StickSlipError(f'{what} did not come within {timeout_s:g} s')
            self._executor.spin_once(timeout_sec=0.05)

    def spin_for(self, simulated_s: float) -> None:
        """Handle messages until so much simulated time has passed, by the stamps of position."""
        self.spin_until(lambda: bool(self.positions), 'position')
        end_ns = self.time_ns + round(simulated_s * NS_PER_S)
        self.spin_until(lambda: self.time_ns >= end_ns, 'position')

    def wait_for_drive(self, timeout_s: float = TIMEOUT_S) -> None:
        """Wait until every topic is connected and the drive reports."""
        self.wait_for_topics(timeout_s)
        self.spin_until(self._is_heard, 'the drive', timeout_s)

    def wait_for_topics(self, timeout_s: float = TIMEOUT_S) -> None:
        """Wait until every topic is connected, both ways, that a drive has in any case."""
        self.spin_until(self._is_connected, 'the drive', timeout_s)
        self.shake_hands(timeout_s)

    def shake_hands(self, timeout_s: float = TIMEOUT_S) -> None:
        """Wait until the drive knows every publisher and subscription of this node."""
        handshake = Handshake(self.node, self._drive)
        self.spin_until(handshake.is_done, 'an answer of the drive', timeout_s)
        handshake.close()

    def command(self, name: str, value: Any, cycles: int = 1) -> None:
        """
        Send a command.

        Parameters
        ----------
        name : str
            What follows ``command/`` in the name of its topic.
        value : float, int or sequence of float
            Its number or numbers in SI units, in the order of docs/interface.md: ``('voltage',
            150.0)``, ``('sawtooth', (300.0, 500.0, 10.0))``, ``('waveform', rows)``.
        cycles : int
            How often a waveform is played; 0 repeats until replaced.

        Raises
        ------
        UnknownName
            If there is no such command.

        """
        topic = command_topic(name)
        self.send(name, pack_command(topic, value, cycles=cycles))

    def send(self, name: str, message: Any) -> None:
        """Send any message on ``command/NAME``: for example one that the drive must refuse."""
        self._publishers[name].publish(message)
        self.received[f'command/{name}'] += 1

    def wait_for_event(self, command: str, after: int, timeout_s: float = TIMEOUT_S) -> Any:
        """Wait for the end of a command, ignoring the first ``after`` events; return the event."""

        def found() -> list[dict[str, Any]]:
            return [e for e in self.events[after:] if e['command'] == command]

        self.spin_until(lambda: bool(found()), f'the end of {command}', timeout_s)
        return found()[0]

    def listen(self, key: str) -> list[Any]:
        """Collect the messages of a topic, by its key, that come from now on."""
        [topic] = [each for each in TOPICS if each.key == key]
        heard: list[Any] = []
        self._subscribe(topic, heard.append)
        return heard

    def simulated_ns(self, message: Any) -> int:
        """Return the simulated time of a message with a stamp, ns; the drive's info has come."""
        return stamp_ns(message) - int(self.info[TIME_ORIGIN])

    def listen_to_log(self) -> list[str]:
        """Collect what all nodes write into their logs from now on."""
        lines: list[str] = []

        def take(entry: Any) -> None:
            lines.append(entry.msg)

        self.node.create_subscription(Log, '/rosout', take, LISTEN_DEPTH)
        return lines

    def trigger(self, name: str) -> Any:
        """Call a Trigger service of the drive (``stop``, ``reset``); return its answer."""
        return self.call(Trigger, name, Trigger.Request())

    def switch(self, name: str, wanted: bool) -> Any:
        """Call a SetBool service of the drive (``set_paused``); return its answer."""
        return self.call(SetBool, name, SetBool.Request(data=wanted))

    def set_recording(self, wanted: bool) -> Any:
        """Start or end the recording; return the service's answer."""
        return self.switch('set_recording', wanted)

    def set_parameter(self, name: str, value: Any) -> Any:
        """Set a parameter of the drive, such as a fault; return the result."""
        parameter = Parameter(name, value=value).to_parameter_msg()
        request = SetParameters.Request(parameters=[parameter])
        return self.call(SetParameters, 'set_parameters', request).results[0]

    def change_state(self, transition: str) -> bool:
        """Ask for one of TRANSITIONS as a lifecycle manager does; return whether it was made."""
        request = ChangeState.Request(transition=Transition(id=TRANSITIONS[transition]))
        return bool(self.call(ChangeState, 'change_state', request).success)

    def state(self) -> str:
        """Ask for the present state of the drive's lifecycle."""
        return str(self.call(GetState, 'get_state', GetState.Request()).current_state.label)

    def call(self, service_type: Any, name: str, request: Any) -> Any:
        """Call a service of the drive; return its answer."""
        future = self.ask(service_type, name, request)
        self.spin_until(future.done, f'answer of {name}')
        return future.result()

    def ask(self, service_type: Any, name: str, request: Any) -> Future:
        """
        Call a service of the drive; return what will hold its answer.

        Before a service is first called, hands are shaken: DDS drops an answer to a client that
        the drive does not know yet.

        """
        is_new = name not in self._clients
        if is_new:
            self._clients[name] = self.node.create_client(service_type, f'{self._drive}/{name}')
        client = self._clients[name]
        self.spin_until(client.service_is_ready, f'service {name}')
        if is_new:
            self.shake_hands()
        return client.call_async(request)

    def close(self) -> None:
        """Leave the stand."""
        end_node(self._executor, self.node)

    def _subscribe(self, topic: Topic, callback: Callable[[Any], None]) -> Any:
        profile = to_profile(topic.qos)
        if profile.durability == DurabilityPolicy.VOLATILE:
            profile.depth = LISTEN_DEPTH
        name = topic.name.replace('~', self._drive)
        message_type = MESSAGE_TYPES[topic.type_name]
        return self.node.create_subscription(message_type, name, callback, profile)

    def _is_connected(self) -> bool:
        heard = (self._subscriptions[topic.key] for topic in READINGS if not topic.switch)
        obeyed = (self._publishers[topic.request] for topic in COMMAND_TOPICS if not topic.switch)
        return all(each.get_publisher_count() for each in heard) and all(
            each.get_subscription_count() for each in obeyed
        )

    def _is_heard(self) -> bool:
        return bool(self.info) and self.status is not None and self.received['position'] > 0

    def _take(self, key: str, takers: dict[str, Callable[[Any], None]], message: Any) -> None:
        self.received[key] += 1
        if key in takers:
            takers[key](message)

    def _take_position(self, message: Any) -> None:
        if self.info:
            self.time_ns = self.simulated_ns(message)
            self.positions[self.time_ns] = message.point.x
        else:
            self._early.append(message)

    def _take_status(self, message: Any) -> None:
        self.status = message.data

    def _take_info(self, message: Any) -> None:
        self.info = json.loads(message.data)
        early, self._early = self._early, []
        for position in early:
            self._take_position(position)

    def _take_diagnostics(self, message: Any) -> None:
        parts = {part.name: {v.key: v.value for v in part.values} for part in message.status}
        self.diagnostics.append(parts)
