"""The declared topics and services as ROS types and quality of service."""

from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PointStamped, WrenchStamped
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, Float64MultiArray, Int32, String, UInt32
from std_srvs.srv import SetBool, Trigger

from stickslip_ros.interface.channels import Qos

MESSAGE_TYPES: dict[str, Any] = {
    'std_msgs/msg/Float64': Float64,
    'std_msgs/msg/Float64MultiArray': Float64MultiArray,
    'std_msgs/msg/Int32': Int32,
    'std_msgs/msg/String': String,
    'std_msgs/msg/UInt32': UInt32,
    'geometry_msgs/msg/PointStamped': PointStamped,
    'geometry_msgs/msg/WrenchStamped': WrenchStamped,
    'sensor_msgs/msg/JointState': JointState,
    'diagnostic_msgs/msg/DiagnosticArray': DiagnosticArray,
    'rosgraph_msgs/msg/Clock': Clock,
}
SERVICE_TYPES: dict[str, Any] = {
    'std_srvs/srv/SetBool': SetBool,
    'std_srvs/srv/Trigger': Trigger,
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


def to_qos(profile: QoSProfile) -> Qos:
    """Return what a recording keeps of a ROS profile."""
    return Qos(
        depth=profile.depth,
        reliable=profile.reliability == ReliabilityPolicy.RELIABLE,
        latched=profile.durability == DurabilityPolicy.TRANSIENT_LOCAL,
    )
