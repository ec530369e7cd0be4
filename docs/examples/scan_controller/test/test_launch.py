"""The executables as a launch file starts them: they meet, and the stage comes to its target."""

import time
import unittest

import pytest
import rclpy
from geometry_msgs.msg import PointStamped

pytest.importorskip('launch_testing_ros', reason='comes with an installed ROS 2')

import launch_testing.actions
from launch import LaunchDescription
from launch_ros.actions import Node

TARGET_M = 20e-9
TIMEOUT_S = 120.0
STAND = {'load_cell.contact': 'absent', 'runner.damping': 5.0}


@pytest.mark.launch_test
def generate_test_description():
    """Start drive and controller; the first drive on a machine compiles its kernels."""
    return LaunchDescription(
        [
            Node(package='stickslip_ros', executable='drive', parameters=[STAND]),
            Node(package='scan_controller', executable='scan_controller'),
            launch_testing.actions.ReadyToTest(),
        ]
    )


class TestTogether(unittest.TestCase):
    """Both processes run."""

    def test_the_stage_comes_to_its_target(self):
        """Listen until it is there."""
        rclpy.init()
        node, errors_m = rclpy.create_node('listener'), [1.0]
        node.create_subscription(
            PointStamped, 'position', lambda read: errors_m.append(read.point.x - TARGET_M), 10
        )
        end_s = time.monotonic() + TIMEOUT_S
        while time.monotonic() < end_s and abs(errors_m[-1]) > 1e-9:
            rclpy.spin_once(node, timeout_sec=0.1)
        rclpy.try_shutdown()
        assert abs(errors_m[-1]) < 1e-9
