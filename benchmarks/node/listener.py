# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A process that listens to every topic of a program, and starts and stops a drive.

``python -m benchmarks.node.listener`` is started by the benchmarks.

"""

import time
from functools import partial
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from lifecycle_msgs.srv import ChangeState
from rclpy.node import Node
from rclpy.qos import QoSProfile
from std_msgs.msg import Float64MultiArray

from benchmarks.node.process import serve
from benchmarks.node.spinning import ros, spinning, wait_for
from stickslip_ros.interface.topics import READINGS
from stickslip_ros.parameters import NODE_NAME
from stickslip_ros.ros.client import Handshake
from stickslip_ros.ros.interface import MESSAGE_TYPES, to_profile

DEPTH = 10_000
SETTLE_S = 0.2


class Listener:
    """Subscriptions to all topics that a drive publishes; a bare loop has the same names."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._commands = node.create_publisher(Float64MultiArray, 'command/sawtooth', 10)
        self._change_state = node.create_client(ChangeState, f'{NODE_NAME}/change_state')
        self.reset()
        for topic in READINGS:
            if topic.key == 'diagnostics' or topic.type_name not in MESSAGE_TYPES:
                continue
            profile = to_profile(topic.qos)
            profile.depth = max(DEPTH, profile.depth)
            name = topic.name.replace('~', NODE_NAME)
            take = partial(self._take, topic.key)
            node.create_subscription(MESSAGE_TYPES[topic.type_name], name, take, profile, raw=True)
        node.create_subscription(
            DiagnosticArray, '/diagnostics', self._take_diagnostics, QoSProfile(depth=100)
        )
        self._handshake = Handshake(node, NODE_NAME)  # the last: it vouches for what was before

    def reset(self) -> None:
        """Begin to count anew."""
        self._since_s = time.monotonic()
        self._messages = 0
        self._bytes = 0
        self._has_position = False
        self._parts: dict[str, list[dict[str, str]]] = {}

    def report(self) -> dict[str, Any]:
        """Return what came since the last reset."""
        elapsed_s = time.monotonic() - self._since_s
        parts = list(self._parts.items())  # at once: the executor may add a part meanwhile
        return {
            'messages_per_s': self._messages / elapsed_s,
            'bytes_per_s': self._bytes / elapsed_s,
            'diagnostics': {part: list(values) for part, values in parts},
        }

    def wait_for_publishers(self) -> None:
        """Wait until ``position`` is offered."""
        wait_for(lambda: self._node.count_publishers('position'), 'a publisher of position')
        time.sleep(SETTLE_S)

    def wait_for_position(self) -> None:
        """Wait for a position since the last reset."""
        wait_for(lambda: self._has_position, 'a position')

    def wait_for_ticks(self) -> None:
        """Wait until the drive has reported its time: later reports hold nothing of its start."""
        wait_for(self._has_report, 'diagnostics of a drive that ticks')

    def _has_report(self) -> bool:
        return any(int(part['ticks']) for part in list(self._parts.get('time', ())))

    def change_state(self, transition: int) -> bool:
        """Ask the drive for a transition, once it knows where its answer goes."""
        wait_for(self._handshake.is_done, 'an answer of the drive')
        wait_for(self._change_state.service_is_ready, 'the service change_state')
        request = ChangeState.Request()
        request.transition.id = transition
        answer = self._change_state.call_async(request)
        wait_for(answer.done, 'a change of state')
        return bool(answer.result().success)

    def move(self, values: list[float]) -> None:
        """Start a saw-tooth: amplitude (V), frequency (Hz), steps."""
        wait_for(self._commands.get_subscription_count, 'a drive that takes commands')
        self._commands.publish(Float64MultiArray(data=values))

    def _take(self, key: str, data: bytes) -> None:
        self._messages += 1
        self._bytes += len(data)
        self._has_position |= key == 'position'

    def _take_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            name, _, part = status.name.partition(': ')
            if name.startswith(self._node.get_namespace().lstrip('/')):
                values = {pair.key: pair.value for pair in status.values}
                self._parts.setdefault(part, []).append(values)


def main() -> None:
    """Listen until nobody asks any more."""
    with ros():
        node = Node('listener')
        listener = Listener(node)
        with spinning(node):
            serve(listener)


if __name__ == '__main__':
    main()
