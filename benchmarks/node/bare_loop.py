# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A bare rclpy program with the outer shape of the node: an executor, and a thread that ticks.

It publishes what the node publishes; nothing is simulated. As the node does, it asks for timely
wake-ups and keeps its objects from garbage collection. ``python -m benchmarks.node.bare_loop`` is
started by the benchmarks.

"""

import gc
import sys
import threading
import time
from array import array
from typing import Any

from rclpy.node import Node
from rclpy.qos import QoSProfile
from std_msgs.msg import Float64MultiArray

from benchmarks.node.lateness import Window, windows_of
from benchmarks.node.process import serve
from benchmarks.node.spinning import ros, spinning
from benchmarks.node.traffic import BLOCK_NS, DEPTH, Traffic
from stickslip_ros.runtime.pacing import wake_in_time
from stickslip_ros.units import NS_PER_S

PERIOD_S = BLOCK_NS / NS_PER_S


class Loop:
    """Ticks of one period, by absolute deadlines."""

    def __init__(self, traffic: Traffic) -> None:
        self._traffic = traffic
        self._tick = 0
        self._lateness_s = array('d')
        self._ended = threading.Event()
        self._thread = threading.Thread()

    def start(self) -> None:
        """Begin to tick."""
        self._ended.clear()
        self._lateness_s = array('d')
        self._thread = threading.Thread(target=self._run, name='loop', daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the ticks."""
        self._ended.set()
        if self._thread.is_alive():
            self._thread.join()

    def windows(self) -> list[Window]:
        """Return the lateness since the last call, or since the start."""
        lateness_s, self._lateness_s = self._lateness_s, array('d')
        return windows_of(lateness_s, PERIOD_S)

    def advance(self) -> None:
        """Do what belongs to a tick."""
        self._tick += 1
        self._traffic.send(self._tick)

    def take_grant(self, message: Any) -> None:
        """Tick when told to, in lockstep."""
        # Half a block on, against rounding: a grant taken twice would make two trips at once.
        if message.data[0] * NS_PER_S > (self._tick + 0.5) * BLOCK_NS:
            self.advance()

    def _run(self) -> None:
        deadline_s = time.monotonic()
        while not self._ended.is_set():
            self.advance()
            deadline_s += PERIOD_S
            pause_s = deadline_s - time.monotonic()
            if pause_s > 0.0:
                time.sleep(pause_s)
            self._lateness_s.append(max(0.0, time.monotonic() - deadline_s))


def main() -> None:
    """Run until nobody asks any more."""
    wake_in_time()
    with ros():
        node = Node('bare_loop')
        loop = Loop(Traffic(node))
        if '--granted' in sys.argv:  # tick when told to
            profile = QoSProfile(depth=DEPTH)
            node.create_subscription(Float64MultiArray, 'command/grant', loop.take_grant, profile)
        gc.freeze()
        with spinning(node):
            serve(loop)
            loop.stop()


if __name__ == '__main__':
    main()
