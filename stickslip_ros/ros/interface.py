"""The declared topics as ROS types and quality of service."""

from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PointStamped, WrenchStamped
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import Float64, Float64MultiArray, String, UInt32

from stickslip_ros.recording.channels import Qos

MESSAGE_TYPES: dict[str, Any] = {
    'std_msgs/msg/Float64': Float64,
    'std_msgs/msg/Float64MultiArray': Float64MultiArray,
    'std_msgs/msg/String': String,
    'std_msgs/msg/UInt32': UInt32,
    'geometry_msgs/msg/PointStamped': PointStamped,
    'geometry_msgs/msg/WrenchStamped': WrenchStamped,
    'diagnostic_msgs/msg/DiagnosticArray': DiagnosticArray,
}


def to_profile(qos: Qos) -> QoSProfile:
    """Return the ROS profile of a declared quality of service."""
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=qos.depth,
        reliability=ReliabilityPolicy.RELIABLE if qos.reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=(
            DurabilityPolicy.TRANSIENT_LOCAL if qos.latched else DurabilityPolicy.VOLATILE
        ),
    )
