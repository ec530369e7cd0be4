# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""What a bare loop sends: the topics of the node, of the same types, sizes and rates."""

from array import array
from itertools import cycle
from typing import Any

import numpy as np
from geometry_msgs.msg import PointStamped, Vector3Stamped, WrenchStamped
from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray, MultiArrayDimension

from stickslip_ros.arrays import Array
from stickslip_ros.units import NS_PER_S

DEPTH = 100
COLUMNS = 't[s],voltage[V],foot[m],position[m],force[N]'
BLOCK_NS = 1_000_000
TRACE_BLOCKS = 10
"""Ticks per message of trace, voltage and joint_states."""
RATE_HZ = 50e3
"""Samples per second of the trace."""
TABLES = 64
"""Different contents of the trace, made beforehand."""
TYPES = {
    'position': PointStamped,
    'force': WrenchStamped,
    'joint_states': JointState,
    'voltage': Vector3Stamped,
    'trace': Float64MultiArray,
}
ROWS = 'sample; time_origin_ns=0'
"""Label of the samples in a trace, as of the drive."""
FRAMES = dict.fromkeys(('position', 'joint_states', 'voltage'), 'stage_base')
FRAMES['force'] = 'load_cell'


class Traffic:
    """
    Message objects, made once; a tick sets the stamp and the values, and publishes them.

    Nothing is computed: the trace comes from tables made beforehand.

    """

    def __init__(self, node: Node) -> None:
        profile = QoSProfile(depth=DEPTH)
        self._publishers = {
            name: node.create_publisher(kind, name, profile) for name, kind in TYPES.items()
        }
        tables = tables_of_trace()
        self._shape = tables[0].shape
        self._tables = cycle([table.tobytes() for table in tables])
        self._kept = {name: self._made(name) for name in TYPES}

    def _made(self, name: str) -> Any:
        """Return a new message with what never changes in it."""
        message = TYPES[name]()
        if name in FRAMES:
            message.header.frame_id = FRAMES[name]
        if name == 'joint_states':
            message.name = ['runner_joint']
            message.position = message.velocity = message.effort = array('d', [0.0])
        if name == 'trace':
            rows, columns = self._shape
            message.layout.dim = [
                MultiArrayDimension(label=ROWS, size=rows, stride=rows * columns),
                MultiArrayDimension(label=COLUMNS, size=columns, stride=columns),
            ]
        return message

    def send(self, tick: int) -> None:
        """Fill and publish the messages of the tick of this number, the first of which is 1."""
        seconds, nanoseconds = divmod(tick * BLOCK_NS, NS_PER_S)
        position, force, joint, voltage, trace = self._kept.values()
        for message in (position, force, joint, voltage):
            message.header.stamp.sec = seconds
            message.header.stamp.nanosec = nanoseconds
        position.point.x = force.wrench.force.x = 0.0
        self._publishers['position'].publish(position)
        self._publishers['force'].publish(force)
        if tick % TRACE_BLOCKS == 0:
            joint.position[0] = joint.effort[0] = voltage.vector.x = 0.0
            trace.data = array('d', next(self._tables))
            self._publishers['joint_states'].publish(joint)
            self._publishers['voltage'].publish(voltage)
            self._publishers['trace'].publish(trace)


def tables_of_trace() -> list[Array]:
    """Return blocks of samples like those of the drive: a saw-tooth and noisy readings."""
    rows = round(RATE_HZ * TRACE_BLOCKS * BLOCK_NS / NS_PER_S)
    random = np.random.default_rng(1)
    time_s = np.arange(TABLES * rows) / RATE_HZ
    voltage_v = 300.0 * ((50.0 * time_s) % 1.0)
    foot_m = 1e-9 * voltage_v
    position_m = foot_m + random.normal(0.0, 1e-10, len(time_s))
    force_n = 0.1 + random.normal(0.0, 1e-4, len(time_s))
    table = np.column_stack((time_s, voltage_v, foot_m, position_m, force_n))
    return np.split(table, TABLES)
