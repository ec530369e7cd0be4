"""What a recorded message says, without ROS: one small record per message type."""

from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

FLOAT64 = 'std_msgs/msg/Float64'
INT32 = 'std_msgs/msg/Int32'
UINT32 = 'std_msgs/msg/UInt32'
STRING = 'std_msgs/msg/String'
FLOAT64_ARRAY = 'std_msgs/msg/Float64MultiArray'
POINT_STAMPED = 'geometry_msgs/msg/PointStamped'
WRENCH_STAMPED = 'geometry_msgs/msg/WrenchStamped'

Vector: TypeAlias = tuple[float, float, float]


class ArrayMessage(NamedTuple):
    """
    A ``std_msgs/msg/Float64MultiArray``.

    Attributes
    ----------
    labels : tuple of str
        One label per dimension of the layout.
    sizes : tuple of int
        Length of each dimension.
    data : ndarray of float
        Shaped by `sizes` where the layout fits the data, otherwise flat.

    """

    labels: tuple[str, ...]
    sizes: tuple[int, ...]
    data: NDArray[np.float64]


class PointMessage(NamedTuple):
    """A ``geometry_msgs/msg/PointStamped``: time in ns, frame, coordinates in m."""

    stamp_ns: int
    frame_id: str
    x: float
    y: float
    z: float


class WrenchMessage(NamedTuple):
    """A ``geometry_msgs/msg/WrenchStamped``: time in ns, frame, force in N, torque in N m."""

    stamp_ns: int
    frame_id: str
    force: Vector
    torque: Vector


Message: TypeAlias = float | int | str | ArrayMessage | PointMessage | WrenchMessage
