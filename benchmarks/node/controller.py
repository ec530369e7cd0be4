# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A process that controls in lockstep: it answers every position by a grant of one more block.

``python -m benchmarks.node.controller`` is started by the benchmarks.

"""

import sys
import threading
import time
from array import array

from geometry_msgs.msg import PointStamped
from rclpy.node import Node
from rclpy.qos import QoSProfile
from std_msgs.msg import Float64MultiArray

from benchmarks.node.process import serve
from benchmarks.node.spinning import ros, spinning, wait_for
from benchmarks.node.traffic import BLOCK_NS, DEPTH
from stickslip_ros.ros.client import LockstepClient
from stickslip_ros.runtime.pacing import wake_in_time
from stickslip_ros.units import NS_PER_S

BLOCK_S = BLOCK_NS / NS_PER_S
WARM_UP = 20


class Controller:
    """
    Counts round trips with the drive; outside of ``rate`` both sides stand still.

    The client of the package begins by itself, and commands nothing.

    """

    def __init__(self, node: Node) -> None:
        self.going = threading.Event()
        self.count = 0
        self.open(node)

    def open(self, node: Node) -> None:
        """Answer the positions of the other side."""
        self._client = LockstepClient(node, BLOCK_S, lambda _stamp_s, _position_m: self.note())

    def note(self) -> tuple[()]:
        """Count a position, and wait until it may be answered."""
        self.count += 1
        self.going.wait()
        return ()

    def knock(self) -> None:
        """Begin, if nothing else does."""

    def rate(self, seconds: float) -> float:
        """Return round trips per second, after the first ones."""
        self.going.set()
        first = self.count + WARM_UP

        def has_begun() -> bool:
            if not self.count:
                self.knock()
            return self.count >= first

        wait_for(has_begun, 'the first round trips')
        begin, begin_s = self.count, time.monotonic()
        time.sleep(seconds)
        trips_per_s = (self.count - begin) / (time.monotonic() - begin_s)
        self.going.clear()
        return trips_per_s


class BareController(Controller):
    """The rival's: a position in, a grant out, nothing checked."""

    def open(self, node: Node) -> None:
        """Answer the positions of the other side."""
        profile = QoSProfile(depth=DEPTH)
        self._publisher = node.create_publisher(Float64MultiArray, 'command/grant', profile)
        self._knocks = 0
        node.create_subscription(PointStamped, 'position', self._take, profile)

    def knock(self) -> None:
        """
        Grant block after block until the first position comes.

        What is sent before both sides know of each other is lost. So each grant ends a block later
        than the one before: the other side ticks once more, and ignores a grant too many.

        """
        self._knocks += 1
        self._grant(self._knocks * BLOCK_S)

    def _take(self, message: PointStamped) -> None:
        self.note()
        stamp = message.header.stamp
        self._grant(stamp.sec + stamp.nanosec / NS_PER_S + BLOCK_S)

    def _grant(self, until_s: float) -> None:
        self._publisher.publish(Float64MultiArray(data=array('d', (until_s, 0.0))))


def main() -> None:
    """Control until nobody asks any more."""
    wake_in_time()
    with ros():
        node = Node('controller')
        controller = (BareController if '--bare' in sys.argv else Controller)(node)
        with spinning(node):
            serve(controller)
            controller.going.set()


if __name__ == '__main__':
    main()
