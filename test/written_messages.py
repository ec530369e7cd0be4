# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""What messages say, written out alike for records of ours and messages of any ROS library."""

from typing import Any

import numpy as np

from stickslip_ros.interface import messages as m
from stickslip_ros.message_types import (
    FLOAT64_ARRAY,
    JOINT_STATE,
    POINT_STAMPED,
    VECTOR3_STAMPED,
    WRENCH_STAMPED,
)


def _plain_array(message: Any) -> m.ArrayMessage:
    dims = message.layout.dim
    sizes = tuple(int(dim.size) for dim in dims)
    data = np.array(message.data, dtype=float)
    return m.ArrayMessage(tuple(dim.label for dim in dims), sizes, data.reshape(sizes))


def _stamp_ns(header: Any) -> int:
    return int(header.stamp.sec) * 1_000_000_000 + int(header.stamp.nanosec)


def _plain_point(message: Any) -> m.StampedMessage:
    header = message.header
    point = message.point if hasattr(message, 'point') else message.vector
    return m.StampedMessage(_stamp_ns(header), header.frame_id, (point.x, point.y, point.z))


def _plain_wrench(message: Any) -> m.StampedMessage:
    header, force, torque = message.header, message.wrench.force, message.wrench.torque
    values = (force.x, force.y, force.z, torque.x, torque.y, torque.z)
    return m.StampedMessage(_stamp_ns(header), header.frame_id, values)


def _plain_joints(message: Any) -> m.JointMessage:
    arrays = message.position, message.velocity, message.effort
    positions, velocities, efforts = (tuple(map(float, each)) for each in arrays)
    stamp_ns, frame_id = _stamp_ns(message.header), message.header.frame_id
    return m.JointMessage(stamp_ns, frame_id, tuple(message.name), positions, velocities, efforts)


def plain(type_name: str, message: Any) -> str:
    """Write out what a message of any ROS library says, as `repr` does for our records."""
    kinds = {
        FLOAT64_ARRAY: _plain_array,
        POINT_STAMPED: _plain_point,
        VECTOR3_STAMPED: _plain_point,
        WRENCH_STAMPED: _plain_wrench,
        JOINT_STATE: _plain_joints,
    }
    return written(kinds.get(type_name, lambda each: each.data)(message))


def written(record: Any) -> str:
    """Write out a record so that NaN equals NaN and -0.0 differs from 0.0."""
    if isinstance(record, m.ArrayMessage):
        return repr((record.labels, record.sizes, record.data.shape, record.data.tolist()))
    return repr(record)
