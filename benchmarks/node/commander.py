# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A process that commands a voltage and waits until the position shows it.

``python -m benchmarks.node.commander`` is started by the benchmarks.

"""

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from geometry_msgs.msg import PointStamped
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from std_msgs.msg import Float64

from benchmarks.node.process import serve
from benchmarks.node.spinning import TIMEOUT_S, ros

VOLTAGES_V = (0.0, 50.0)
MOVED_M = 6e-9
"""A quarter of the move of the node; far above the noise of its readings."""
ATTEMPTS = 10
"""Commands are lost until the program knows who commands, under load for seconds."""
SETTLE_S = 0.012
"""Pause between commands; a random share of a block is added, so that they come at any phase."""
BLOCK_S = 1e-3
EFFECT_TIMEOUT_S = 1.0


class Commander:
    """Publisher of ``command/voltage`` and subscription to ``position``, in one thread."""

    def __init__(self, node: Node) -> None:
        profile = QoSProfile(depth=100)
        self._publisher = node.create_publisher(Float64, 'command/voltage', profile)
        node.create_subscription(PointStamped, 'position', self._take, profile)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(node)
        self._reading: tuple[float, float] | None = None  # when it came, s, and what it says, m

    def measure(self, commands: int, seed: int) -> dict[str, Any]:
        """Command some steps to and fro; return the delay of each and how many had no effect."""
        self._wait_for(self._publisher.get_subscription_count, 'a program that takes commands')
        random, number = np.random.default_rng(seed), 0
        while number < ATTEMPTS and self._delay(number) is None:
            number += 1
        delays_s = []
        for _ in range(commands):
            number += 1
            self._spin(SETTLE_S + random.uniform(0.0, BLOCK_S))
            delays_s.append(self._delay(number))
        found_s = [delay_s for delay_s in delays_s if delay_s is not None]
        return {'delays_s': found_s, 'lost': commands - len(found_s)}

    def _delay(self, number: int) -> float | None:
        """Command the voltage of this number; return the time until the position shows it."""
        self._reading = None
        self._wait_for(lambda: self._reading, 'a position')
        assert self._reading is not None
        before_m, begin_s = self._reading[1], time.monotonic()
        self._publisher.publish(Float64(data=VOLTAGES_V[number % 2]))
        while time.monotonic() < begin_s + EFFECT_TIMEOUT_S:
            self._executor.spin_once(timeout_sec=0.01)
            came_s, reading_m = self._reading
            if abs(reading_m - before_m) > MOVED_M:
                return came_s - begin_s
        return None

    def _wait_for(self, condition: Callable[[], object], what: str) -> None:
        end_s = time.monotonic() + TIMEOUT_S
        while not condition():
            if time.monotonic() > end_s:
                raise TimeoutError(f'{what} did not come in {TIMEOUT_S:g} s')
            self._executor.spin_once(timeout_sec=0.01)

    def _spin(self, seconds: float) -> None:
        end_s = time.monotonic() + seconds
        while (left_s := end_s - time.monotonic()) > 0.0:
            self._executor.spin_once(timeout_sec=left_s)

    def _take(self, message: PointStamped) -> None:
        self._reading = time.monotonic(), message.point.x


def main() -> None:
    """Measure until nobody asks any more."""
    with ros():
        serve(Commander(Node('commander')))


if __name__ == '__main__':
    main()
