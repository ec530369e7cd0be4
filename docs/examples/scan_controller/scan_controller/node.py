"""The controller on topics."""

import rclpy
from geometry_msgs.msg import PointStamped
from rclpy.node import Node
from std_msgs.msg import Float64

from scan_controller.loop import ScanController


class ScanControllerNode(Node):
    """Answer every `position` with a `command/voltage`; the parameter `target` is in m."""

    def __init__(self):
        super().__init__('scan_controller')
        self.controller = ScanController()
        self.declare_parameter('target', 20e-9)
        self.voltage = self.create_publisher(Float64, 'command/voltage', 10)
        self.create_subscription(PointStamped, 'position', self.on_position, 10)

    def on_position(self, message):
        """Answer a reading."""
        error_m = self.get_parameter('target').value - message.point.x
        self.voltage.publish(Float64(data=self.controller.update(1e6 * error_m)))


def main():
    """Run the node until Ctrl-C."""
    rclpy.init()
    try:
        rclpy.spin(ScanControllerNode())
    except KeyboardInterrupt:
        pass
    finally:
        rclpy.try_shutdown()
