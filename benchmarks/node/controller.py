"""
A process that controls in lockstep: it answers every position by a grant of one more block.

``python -m benchmarks.node.controller`` is started by the benchmarks; with ``--inside`` the
program that it controls lives in the same process, on the same executor.

"""

import argparse
import threading
import time
from array import array

from geometry_msgs.msg import PointStamped
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile
from std_msgs.msg import Float64MultiArray

from benchmarks.node.bare_loop import Loop
from benchmarks.node.process import serve
from benchmarks.node.spinning import own_words, ros, spinning, wait_for
from benchmarks.node.traffic import BLOCK_NS, DEPTH, TYPES, Objects
from stickslip_ros.runtime.pacing import wake_in_time
from stickslip_ros.units import NS_PER_S

BLOCK_S = BLOCK_NS / NS_PER_S
RATE_HZ = 50e3
WARM_UP = 20


class Controller:
    """
    Counts round trips; stands still, and the other side with it, outside of ``rate``.

    Attributes
    ----------
    going : Event
        Whether positions are answered.

    """

    def __init__(self) -> None:
        self.going = threading.Event()
        self._count = 0
        self._has_begun = False

    def begin(self) -> None:
        """Grant the first block, if nothing else does."""

    def note(self) -> None:
        """Count a position, and wait until it may be answered."""
        self._count += 1
        self.going.wait()

    def rate(self, seconds: float) -> float:
        """Return round trips per second, after the first ones."""
        self.going.set()
        if not self._has_begun:
            self.begin()
            self._has_begun = True
        first = self._count + WARM_UP
        wait_for(lambda: self._count >= first, 'the first round trips')
        begin, begin_s = self._count, time.monotonic()
        time.sleep(seconds)
        trips_per_s = (self._count - begin) / (time.monotonic() - begin_s)
        self.going.clear()
        return trips_per_s


class BareController(Controller):
    """
    The rival's other side: a position in, a grant out, nothing checked.

    Parameters
    ----------
    node : Node
        Has the publisher and the subscription.

    """

    def __init__(self, node: Node) -> None:
        super().__init__()
        profile = QoSProfile(depth=DEPTH)
        self._publisher = node.create_publisher(Float64MultiArray, 'command/grant', profile)
        self._knocks = 0
        node.create_subscription(PointStamped, 'position', self._take, profile)

    def begin(self) -> None:
        """
        Grant block after block until the first position comes.

        What is sent before both sides know of each other is lost, a grant as well as a position.
        So each grant ends a block later than the one before: wherever the other side has come to
        it ticks once more. When round trips have begun, it ignores a grant that came too much.

        """
        wait_for(self._knock, 'the first position')

    def _knock(self) -> bool:
        if not self._count:
            self._knocks += 1
            self._grant(self._knocks * BLOCK_S)
        return self._count > 0

    def _take(self, message: PointStamped) -> None:
        self.note()
        stamp = message.header.stamp
        self._grant(stamp.sec + stamp.nanosec / NS_PER_S + BLOCK_S)

    def _grant(self, until_s: float) -> None:
        self._publisher.publish(Float64MultiArray(data=array('d', (until_s, 0.0))))


class DriveController(Controller):
    """
    The client of the package, which begins by itself and commands nothing.

    Parameters
    ----------
    node : Node
        Has what the client needs.

    """

    def __init__(self, node: Node) -> None:
        from stickslip_ros.ros.client import LockstepClient  # noqa: PLC0415 - not for rivals

        super().__init__()
        self._client = LockstepClient(node, BLOCK_S, self._take)

    def _take(self, _stamp_s: float, _position_m: float) -> tuple[()]:
        self.note()
        return ()


def inside(kind: str) -> Node | None:
    """Return the node that is controlled, if it lives here."""
    if kind == 'drive':
        from stickslip_ros.ros.node import StickSlipDrive  # noqa: PLC0415

        return StickSlipDrive(parameter_overrides=[Parameter('sim.lockstep', value=True)])
    if kind in {'position', 'all'}:
        node = Node('bare_loop')
        topics = ('position',) if kind == 'position' else tuple(TYPES)
        Loop(Objects(node, RATE_HZ, topics), 'grant', node)
        return node
    return None


def main() -> None:
    """Control until nobody asks any more."""
    parser = argparse.ArgumentParser()
    parser.add_argument('--of', choices=('drive', 'bare'), required=True)
    parser.add_argument('--inside', choices=('drive', 'position', 'all', 'none'), default='none')
    chosen = parser.parse_args(own_words())
    wake_in_time()
    with ros():
        node = Node('controller')
        controller = DriveController(node) if chosen.of == 'drive' else BareController(node)
        other = inside(chosen.inside)
        with spinning(*([node] if other is None else [node, other])):
            serve({'rate': controller.rate})
            controller.going.set()


if __name__ == '__main__':
    main()
