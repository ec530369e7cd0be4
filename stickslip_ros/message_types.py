# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Names of message and service types in ROS 2."""

from typing import Final

FLOAT64: Final = 'std_msgs/msg/Float64'
INT32: Final = 'std_msgs/msg/Int32'
UINT32: Final = 'std_msgs/msg/UInt32'
STRING: Final = 'std_msgs/msg/String'
FLOAT64_ARRAY: Final = 'std_msgs/msg/Float64MultiArray'
JOINT_STATE: Final = 'sensor_msgs/msg/JointState'
POINT_STAMPED: Final = 'geometry_msgs/msg/PointStamped'
VECTOR3_STAMPED: Final = 'geometry_msgs/msg/Vector3Stamped'
WRENCH_STAMPED: Final = 'geometry_msgs/msg/WrenchStamped'
TRIGGER: Final = 'std_srvs/srv/Trigger'
SET_BOOL: Final = 'std_srvs/srv/SetBool'
