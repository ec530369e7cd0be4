"""
A process that commands a voltage and waits until the position shows it.

``python -m benchmarks.node.commander`` is started by the benchmarks.

"""

import time
from collections import deque
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
REST_READINGS, PLACE_READINGS = 300, 100
"""Readings to wait for after a command; the last of them tell a place. They are counted, for after
a stall 200 may be older than the command: those in the queues of both sides."""
ATTEMPTS = 10
"""Commands are lost until the program knows who commands, under load for seconds."""
SETTLE_S = 0.012
"""Pause between commands; a random share of a block is added, so that they come at any phase."""
BLOCK_S = 1e-3
EFFECT_TIMEOUT_S = 1.0
NOISES = 6.0
"""A quarter of the move must be larger than so many standard deviations of the readings."""


class Commander:
    """
    Publisher of ``command/voltage`` and subscription to ``position``, in one thread.

    Parameters
    ----------
    node : Node
        Has both.

    """

    def __init__(self, node: Node) -> None:
        self._node = node
        profile = QoSProfile(depth=100)
        self._publisher = node.create_publisher(Float64, 'command/voltage', profile)
        node.create_subscription(PointStamped, 'position', self._take, profile)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(node)
        self._readings: deque[tuple[float, float]] = deque(maxlen=PLACE_READINGS)
        self._taken = 0

    def measure(self, commands: int, seed: int) -> dict[str, Any]:
        """Command some steps to and fro; return the delay of each and how many had no effect."""
        self._connect()
        random = np.random.default_rng(seed)
        threshold_m = self._threshold()
        delays_s, lost = [], 0
        for number in range(commands):
            self._spin(SETTLE_S + random.uniform(0.0, BLOCK_S))
            delay_s = self._delay(VOLTAGES_V[(number + 1) % 2], threshold_m)
            if delay_s is None:
                lost += 1
            else:
                delays_s.append(delay_s)
        return {'delays_s': delays_s, 'lost': lost, 'threshold_m': threshold_m}

    def _connect(self) -> None:
        self._wait_for(
            lambda: self._publisher.get_subscription_count() and self._readings,
            'a program that takes commands and gives positions',
        )

    def _threshold(self) -> float:
        """Return a quarter of the whole move; it ends at the first voltage."""
        for _ in range(ATTEMPTS):
            places_m = [self._place(voltage_v) for voltage_v in (*VOLTAGES_V, VOLTAGES_V[0])]
            threshold_m = 0.25 * abs(float(np.mean(places_m[1]) - np.mean(places_m[2])))
            noise_m = float(np.std(places_m[2]))
            if threshold_m > NOISES * noise_m:
                return threshold_m
        raise ValueError(f'a move of {4.0 * threshold_m} m is lost in noise of {noise_m} m')

    def _place(self, voltage_v: float) -> list[float]:
        """Command a voltage; return readings of the position at rest, m."""
        self._publisher.publish(Float64(data=voltage_v))
        enough = self._taken + REST_READINGS
        self._wait_for(lambda: self._taken >= enough, f'{REST_READINGS} positions')
        return [reading_m for _, reading_m in self._readings]

    def _delay(self, voltage_v: float, threshold_m: float) -> float | None:
        self._wait_for(lambda: self._readings, 'a position')
        _, before_m = self._readings[-1]
        self._readings.clear()
        begin_s = time.monotonic()
        self._publisher.publish(Float64(data=voltage_v))
        while time.monotonic() < begin_s + EFFECT_TIMEOUT_S:
            self._executor.spin_once(timeout_sec=0.01)
            if self._readings and abs(self._readings[-1][1] - before_m) > threshold_m:
                return self._readings[-1][0] - begin_s
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
        self._readings.append((time.monotonic(), message.point.x))
        self._taken += 1


def main() -> None:
    """Measure until nobody asks any more."""
    with ros():
        commander = Commander(Node('commander'))
        serve({'measure': commander.measure})


if __name__ == '__main__':
    main()
