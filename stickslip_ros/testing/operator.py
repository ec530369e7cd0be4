# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A client of the virtual stand that waits with a time limit and keeps all messages."""

import json
import time
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import Any

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rcl_interfaces.srv import SetParameters
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor, TimeoutException
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.task import Future
from std_srvs.srv import SetBool, Trigger

from stickslip_ros.errors import StickSlipError
from stickslip_ros.instrument.reports import read_event
from stickslip_ros.interface.topics import PREFIX, READINGS
from stickslip_ros.parameters import NODE_NAME
from stickslip_ros.process.stopping import stop_if_asked
from stickslip_ros.recording.run_file import TIME_ORIGIN
from stickslip_ros.ros.client import DriveClient, Handshake, stamp_ns
from stickslip_ros.ros.executable import end_node
from stickslip_ros.units import NANO, NS_PER_S

TIMEOUT_S = 60.0
LISTEN_DEPTH = 10_000


def deep_queues(*topics: str) -> dict[str, int]:
    """
    Return parameters for a deep queue of some topics, so that an operator misses no message.

    By default a stream keeps one second of messages. On a busy machine DDS may deliver nothing
    for longer than that, and messages are lost.

    """
    return {f'qos_overrides./{topic}.publisher.depth': LISTEN_DEPTH for topic in topics}


def run_callbacks(
    executor: SingleThreadedExecutor,
    wait_s: float = 0.0,
    is_ending: Callable[[], bool] = lambda: False,
) -> None:
    """
    Run callbacks until none is ready, and none becomes ready within ``wait_s`` of wall-clock time.

    rclpy always takes a waiting coroutine for ready, so a round with only coroutines counts as no
    callback.

    """
    unfinished: set[Any] = set()
    is_idle = False
    while not (is_idle or is_ending()):
        is_idle = True
        try:
            while not is_ending():  # a round of the executor ends with the exception
                task, *_ = executor.wait_for_ready_callbacks(timeout_sec=wait_s)
                task()
                if task.done():
                    task.result()  # raises what the callback has raised
                is_idle = is_idle and task in unfinished and not task.done()
                unfinished.add(task)
        except TimeoutException:
            pass


class Operator(DriveClient):
    """
    A client with its own node that collects every message of a drive.

    Parameters
    ----------
    context : Context
        An initialised rclpy context.
    drive_name : str
        Name of the drive's node.

    Attributes
    ----------
    received : Counter
        Number of messages by key of topic; for a command, the number sent.
    positions : dict of int to float
        Interferometer readings in m by simulated time in ns.
    time_ns : int
        Simulated time of the last reading, ns.
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
    tell : callable
        Returns the state of the drive, for the error of a wait that fails.
    check : callable
        Called before every awaited message; may raise an error that ends the wait.

    """

    def __init__(self, context: Context, drive_name: str = NODE_NAME) -> None:
        super().__init__(Node('operator', context=context), drive_name)
        self.received: Counter[str] = Counter()
        self.positions: dict[int, float] = {}
        self.time_ns = 0
        self.events: list[dict[str, Any]] = []
        self.requests: list[dict[str, Any]] = []
        self.status: int | None = None
        self.diagnostics: list[dict[str, dict[str, str]]] = []
        self.check: Callable[[], None] = stop_if_asked
        self.tell: Callable[[], str] = lambda: f'simulated time {self.time_ns * NANO:.9g} s'
        self._undated: list[Any] = []
        self._activated_ns = 0  # the system's time
        self._info_before: dict[str, Any] = {}
        self._executor = SingleThreadedExecutor(context=context)
        self._executor.add_node(self.node)
        for topic in sorted(READINGS, key=lambda topic: topic.key != 'info'):
            self.subscribe(topic.key, partial(self._take, topic.key), depth=LISTEN_DEPTH)

    def add_node(self, node: Node) -> None:
        """Handle the messages of another node, such as a controller, during waits."""
        self._executor.add_node(node)

    def spin_until(
        self, condition: Callable[[], bool], what: str, timeout_s: float = TIMEOUT_S
    ) -> None:
        """
        Handle messages until a condition holds; it is tested after every message.

        Raises StickSlipError if simulated time has stood still for ``timeout_s`` of wall-clock
        time, or if ``timeout_s`` of both passed without the condition, which ``what`` names.

        """
        start_s = since_s = time.monotonic()
        last_ns, passed_ns = self.time_ns, 0
        while not condition():
            self.check()
            now_s = time.monotonic()
            if self.time_ns != last_ns:
                passed_ns += max(self.time_ns - last_ns, 0)
                last_ns, since_s = self.time_ns, now_s
            if max(now_s - since_s, min(now_s - start_s, passed_ns * NANO)) > timeout_s:
                why = f'{what} did not come within {timeout_s:g} s'
                raise StickSlipError(f'{why}: {self.tell()}')
            self._executor.spin_once(timeout_sec=0.05)

    def spin_for(self, simulated_s: float) -> None:
        """Handle messages for a simulated time, by the stamps of position."""
        self.spin_until(lambda: bool(self.positions), 'position')
        end_ns = self.time_ns + round(simulated_s * NS_PER_S)
        self.spin_until(lambda: self.time_ns >= end_ns, 'position')

    def catch_up(self) -> None:
        """Handle all messages that have arrived."""
        run_callbacks(self._executor)

    def wait_for_drive(self, timeout_s: float = TIMEOUT_S) -> None:
        """Wait until every topic is connected and the drive reports."""
        self.wait_for_topics(timeout_s)
        self.spin_until(
            lambda: bool(self.positions) and self.status is not None, 'the drive', timeout_s
        )

    def wait_for_topics(self, timeout_s: float = TIMEOUT_S) -> None:
        """Wait until all topics that every drive has are connected, both ways."""
        self.spin_until(self.is_connected, 'the drive', timeout_s)
        self.shake_hands(timeout_s)

    def shake_hands(self, timeout_s: float = TIMEOUT_S) -> str:
        """Wait until the drive knows all endpoints of this node; return the drive's state."""
        handshake = Handshake(self.node, self.drive)
        self.spin_until(handshake.is_done, 'an answer of the drive', timeout_s)
        handshake.close()
        return handshake.state

    def send(self, name: str, message: Any) -> None:
        """Send any message on ``command/NAME``, and count it."""
        super().send(name, message)
        self.received[PREFIX + name] += 1

    def wait_for_event(self, command: str, after: int, timeout_s: float = TIMEOUT_S) -> Any:
        """Wait for the end of a command, ignoring the first ``after`` events; return the event."""

        def found() -> list[dict[str, Any]]:
            return [e for e in self.events[after:] if e['command'] == command]

        self.spin_until(lambda: bool(found()), f'the end of {command}', timeout_s)
        return found()[0]

    def listen(self, key: str) -> list[Any]:
        """Collect future messages of a topic, by its key."""
        heard: list[Any] = []
        self.subscribe(key, heard.append, depth=LISTEN_DEPTH)
        return heard

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
        """Request ``configure``, ``activate`` and so on; return whether it succeeded."""
        request = ChangeState.Request(transition=Transition(label=transition))
        before = self.info
        if transition == 'activate':
            # Activation gives stamps a new origin, which may arrive after the first new stamps and
            # before the last old ones.
            self._activated_ns, self._info_before = time.time_ns(), before
            self.info = {}
        done = bool(self.call(ChangeState, 'change_state', request).success)
        self.info = self.info if done else before
        return done

    def simulated_ns(self, message: Any) -> int:
        """Return the simulated time of a message, ns; each activation has an origin of stamps."""
        is_late = stamp_ns(message) < self._activated_ns and self.info[TIME_ORIGIN]
        info = self._info_before if is_late and self._info_before else self.info
        return stamp_ns(message) - int(info[TIME_ORIGIN])

    def state(self) -> str:
        """Ask for the present state of the drive's lifecycle."""
        return self.shake_hands()

    def call(self, service_type: Any, name: str, request: Any) -> Any:
        future = self.ask(service_type, name, request)
        self.spin_until(future.done, f'answer of {name}')
        return future.result()

    def ask(self, service_type: Any, name: str, request: Any) -> Future:
        """
        Call a service of the drive; return the future of its answer.

        A handshake comes before the first call of a service: DDS drops an answer to a client that
        the drive does not know yet.

        """
        is_new = name not in self._services
        client = self.service(service_type, name)
        self.spin_until(client.service_is_ready, f'service {name}')
        if is_new:
            self.shake_hands()
        return client.call_async(request)

    def close(self) -> None:
        end_node(self._executor, self.node)

    def _take(self, key: str, message: Any) -> None:
        self.received[key] += 1
        match key:
            case 'event':
                self.events += filter(None, [read_event(message.data)])
            case 'request':
                with suppress(ValueError, RecursionError):  # of another sender
                    self.requests.append(json.loads(message.data))
            case 'status':
                self.status = message.data
            case 'diagnostics':
                parts = message.status
                self.diagnostics.append(
                    {part.name: {v.key: v.value for v in part.values} for part in parts}
                )
            case 'info':
                self.take_info(message)
            case 'position':
                self._undated.append(message)
        if self.info and self._undated:
            for position in self._undated:
                self.time_ns = self.simulated_ns(position)
                self.positions[self.time_ns] = position.point.x
            self._undated.clear()
