"""The controller on topics."""

import rclpy
from geometry_msgs.msg import PointStamped
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import Float64, String

from scan_controller.loop import ScanController

PATIENCE = 100
"""Readings without an event after which the last voltage counts as lost."""
NEWEST = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
"""For readings: on a network that loses some, none waits for another."""


class ScanControllerNode(Node):
    """
    Answer a `position` with a `command/voltage`; the parameter `target` is in m.

    One voltage is on its way at a time: a reading that does not show the effect of the last one is
    left out, as are all but the newest. Answered in a heap, each of them would add to the voltage.

    """

    def __init__(self):
        super().__init__('scan_controller')
        self.controller = ScanController()
        self.declare_parameter('target', 20e-9)
        self.waits = (
            0  # readings since a voltage that has had no event, with that which it answers
        )
        self.voltage = self.create_publisher(Float64, 'command/voltage', 10)
        # Of what came at the same time, the event is heard first.
        self.create_subscription(String, 'stickslip_drive/event', self.on_event, 10)
        self.create_subscription(PointStamped, 'position', self.on_position, NEWEST)

    def on_event(self, message):
        """Note that a voltage has been reached, or was refused."""
        if '"command": "voltage"' in message.data:  # read as JSON, an odd text would end the node
            self.waits = 0

    def on_position(self, message):
        """Answer a reading."""
        if 0 < self.waits < PATIENCE:
            self.waits += 1
            return
        error_m = self.get_parameter('target').value - message.point.x
        self.voltage.publish(Float64(data=self.controller.update(1e6 * error_m)))
        self.waits = 1


def main():
    """Run the node until Ctrl-C."""
    rclpy.init()
    try:
        rclpy.spin(ScanControllerNode())
    except KeyboardInterrupt:
        pass
    finally:
        rclpy.try_shutdown()
