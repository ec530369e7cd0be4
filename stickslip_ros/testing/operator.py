"""An operator at the virtual stand: commands it and listens to it, over topics only."""

import json
from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial
from time import monotonic
from typing import Any

from rcl_interfaces.srv import SetParameters
from rclpy.client import Client
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy
from rclpy.task import Future
from std_srvs.srv import SetBool, Trigger

from stickslip_ros.errors import StickSlipError
from stickslip_ros.recording.topics import COMMANDS, NODE_NAME, READINGS, Topic
from stickslip_ros.ros.client import Handshake
from stickslip_ros.ros.ending import end_node
from stickslip_ros.ros.interface import MESSAGE_TYPES, to_profile
from stickslip_ros.ros.requests import to_message
from stickslip_ros.stopping import heed_stop
from stickslip_ros.units import NS_PER_S

TIMEOUT_S = 30.0
LISTEN_DEPTH = 10_000


class Operator:
    """
    A node that commands a drive and collects everything that it says.

    Parameters
    ----------
    context : Context
        An initialised rclpy context.
    drive_name : str
        Name of the drive's node.
    keep : bool
        Whether readings are kept in ``positions``; counts and events always are.

    Attributes
    ----------
    received : Counter
        Messages by the key of their topic; of commands, those that were sent.
    positions : dict of int to float
        Interferometer readings in m by their stamp in ns.
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

    """

    def __init__(
        self, context: Context, drive_name: str = NODE_NAME, *, keep: bool = True
    ) -> None:
        self.node = Node('operator', context=context)
        self.received: Counter[str] = Counter()
        self.positions: dict[int, float] = {}
        self.events: list[dict[str, Any]] = []
        self.requests: list[dict[str, Any]] = []
        self.status: int | None = None
        self.info: dict[str, Any] = {}
        self.diagnostics: list[dict[str, dict[str, str]]] = []
        self._executor = SingleThreadedExecutor(context=context)
        self._executor.add_node(self.node)
        self._drive = drive_name
        self._clients: dict[str, Client] = {}
        self._publishers = {
            topic.key: self.node.create_publisher(
                MESSAGE_TYPES[topic.type_name], topic.name, to_profile(topic.qos)
            )
            for topic in COMMANDS
        }
        self._commands = {topic.request: topic for topic in COMMANDS}
        takers: dict[str, Callable[[Any], None]] = {
            'event': lambda message: self.events.append(json.loads(message.data)),
            'request': lambda message: self.requests.append(json.loads(message.data)),
            'status': self._on_status,
            'info': self._on_info,
            'diagnostics': self._on_diagnostics,
        }
        if keep:
            takers['position'] = self._on_position
        self._subscriptions = {
            topic.key: self._listen(topic, takers.get(topic.key)) for topic in READINGS
        }
        self._needed = [
            *(self._subscriptions[topic.key] for topic in READINGS if not topic.switch),
            *(self._publishers[topic.key] for topic in COMMANDS if not topic.switch),
        ]

    def _listen(self, topic: Topic, taker: Callable[[Any], None] | None) -> Any:
        profile = to_profile(topic.qos)
        if profile.durability == DurabilityPolicy.VOLATILE:
            profile.depth = LISTEN_DEPTH
        name = topic.name.replace('~', self._drive)
        message_type = MESSAGE_TYPES[topic.type_name]
        callback = partial(self._take, topic.key, taker)
        return self.node.create_subscription(message_type, name, callback, profile)

    def spin_until(
        self, condition: Callable[[], bool], what: str, timeout_s: float = TIMEOUT_S
    ) -> None:
        """
        Handle messages until a condition holds.

        Parameters
        ----------
        condition : callable
            Tested after every message.
        what : str
            What is waited for, for the message.
        timeout_s : float
            Longest wait, s.

        Raises
        ------
        StickSlipError
            If the condition does not come true in time.

        """
        end_s = monotonic() + timeout_s
        while not condition():
            heed_stop()
            if monotonic() > end_s:
                raise StickSlipError(f'{what} did not come within {timeout_s:g} s')
            self._executor.spin_once(timeout_sec=0.05)

    def spin_for(self, simulated_s: float) -> None:
        """Handle messages until so much simulated time has passed, by the stamps of position."""
        start_ns = max(self.positions, default=0)
        end_ns = start_ns + round(simulated_s * NS_PER_S)
        self.spin_until(lambda: max(reversed(self.positions), default=0) >= end_ns, 'position')

    def wait_for_drive(self, timeout_s: float = TIMEOUT_S) -> None:
        """Wait until every topic is connected and the drive reports."""
        self.wait_for_topics(timeout_s)
        self.spin_until(self._is_heard, 'the drive', timeout_s)

    def wait_for_topics(self, timeout_s: float = TIMEOUT_S) -> None:
        """Wait until every topic is connected, both ways, that a drive has in any case."""
        self.spin_until(lambda: all(map(_is_matched, self._needed)), 'the drive', timeout_s)
        self.shake_hands(timeout_s)

    def shake_hands(self, timeout_s: float = TIMEOUT_S) -> None:
        """Wait until the drive knows every publisher and subscription of this node."""
        handshake = Handshake(self.node, self._drive)
        self.spin_until(handshake.is_done, 'an answer of the drive', timeout_s)
        handshake.close()

    def _is_heard(self) -> bool:
        return self.status is not None and self.received['position'] > 0

    def command(self, name: str, value: Any) -> None:
        """
        Send a command.

        Parameters
        ----------
        name : str
            What follows ``command/`` in the name of its topic.
        value : float, int or sequence of float
            See `to_message`.

        """
        topic = self._commands[name]
        self._send(topic.key, to_message(topic, value))

    def command_voltage(self, voltage_v: float) -> None:
        """Ask for a direct piezo voltage."""
        self.command('voltage', voltage_v)

    def command_preload(self, preload_n: float) -> None:
        """Ask for another preload, N."""
        self.command('preload', preload_n)

    def command_sawtooth(self, *values: float) -> None:
        """Ask for a saw-tooth: amplitude (V), frequency (Hz), steps."""
        self.command('sawtooth', values)

    def command_steps(self, steps: int) -> None:
        """Ask for a signed number of steps."""
        self.command('steps', steps)

    def command_jog(self, frequency_hz: float) -> None:
        """Ask for steps per second, until the watchdog or another command ends them."""
        self.command('jog', frequency_hz)

    def command_waveform(self, rows: Sequence[tuple[float, float]]) -> None:
        """Ask for a wave: rows of time (s) and voltage (V)."""
        self.command('waveform', rows)

    def command_position(self, position_m: float) -> None:
        """Ask for a position reading in closed loop, m."""
        self.command('position', position_m)

    def command_load(self, force_n: float) -> None:
        """Ask for an external force on the runner, N."""
        self.command('load', force_n)

    def grant(self, until_s: float, commands: int) -> None:
        """Let a drive in lockstep go on to a simulated time, once so many commands came."""
        self.command('grant', (until_s, commands))

    def _send(self, key: str, message: Any) -> None:
        self._publishers[key].publish(message)
        self.received[key] += 1

    def wait_for_event(self, command: str, after: int, timeout_s: float = TIMEOUT_S) -> Any:
        """Wait for the end of a command, ignoring the first ``after`` events; return the event."""

        def found() -> list[dict[str, Any]]:
            return [e for e in self.events[after:] if e['command'] == command]

        self.spin_until(lambda: bool(found()), f'the end of {command}', timeout_s)
        return found()[0]

    def trigger(self, name: str) -> Any:
        """Call a Trigger service of the drive (``stop``, ``reset``); return its answer."""
        return self._call(Trigger, name, Trigger.Request())

    def switch(self, name: str, wanted: bool) -> Any:
        """Call a SetBool service of the drive (``set_paused``); return its answer."""
        return self._call(SetBool, name, SetBool.Request(data=wanted))

    def set_recording(self, wanted: bool) -> Any:
        """Start or end the recording; return the service's answer."""
        return self.switch('set_recording', wanted)

    def set_parameter(self, name: str, value: Any) -> Any:
        """Set a parameter of the drive, such as a fault; return the result."""
        parameter = Parameter(name, value=value).to_parameter_msg()
        request = SetParameters.Request(parameters=[parameter])
        return self._call(SetParameters, 'set_parameters', request).results[0]

    def ask(self, service_type: Any, name: str, request: Any) -> Future:
        """
        Call a service of the drive, and return what will hold its answer.

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

    def _call(self, service_type: Any, name: str, request: Any) -> Any:
        future = self.ask(service_type, name, request)
        self.spin_until(future.done, f'answer of {name}')
        return future.result()

    def close(self) -> None:
        """Leave the stand."""
        end_node(self._executor, self.node)

    def _take(self, key: str, taker: Callable[[Any], None] | None, message: Any) -> None:
        self.received[key] += 1
        if taker is not None:
            taker(message)

    def _on_position(self, message: Any) -> None:
        stamp = message.header.stamp
        time_ns = stamp.sec * NS_PER_S + stamp.nanosec
        self.positions[time_ns] = message.point.x

    def _on_status(self, message: Any) -> None:
        self.status = message.data

    def _on_info(self, message: Any) -> None:
        self.info = json.loads(message.data)

    def _on_diagnostics(self, message: Any) -> None:
        parts = {part.name: {v.key: v.value for v in part.values} for part in message.status}
        self.diagnostics.append(parts)


def _is_matched(endpoint: Any) -> bool:
    """Tell whether a publisher or a subscription has found its other end."""
    if isinstance(endpoint, Publisher):
        return bool(endpoint.get_subscription_count())
    return bool(endpoint.get_publisher_count())
