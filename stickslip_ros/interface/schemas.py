# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Definitions and type hashes of the recorded message types, for recordings."""

from typing import Final

from stickslip_ros.message_types import (
    FLOAT64,
    FLOAT64_ARRAY,
    INT32,
    JOINT_STATE,
    POINT_STAMPED,
    STRING,
    UINT32,
    VECTOR3_STAMPED,
    WRENCH_STAMPED,
)

_SEPARATOR: Final = '=' * 80

FIELDS: Final = {
    'builtin_interfaces/Time': 'int32 sec\nuint32 nanosec\n',
    'builtin_interfaces/Duration': 'int32 sec\nuint32 nanosec\n',
    'std_msgs/Header': 'builtin_interfaces/Time stamp\nstring frame_id\n',
    'std_msgs/Float64': 'float64 data\n',
    'std_msgs/Int32': 'int32 data\n',
    'std_msgs/UInt32': 'uint32 data\n',
    'std_msgs/String': 'string data\n',
    'std_msgs/MultiArrayDimension': 'string label\nuint32 size\nuint32 stride\n',
    'std_msgs/MultiArrayLayout': 'MultiArrayDimension[] dim\nuint32 data_offset\n',
    'std_msgs/Float64MultiArray': 'MultiArrayLayout layout\nfloat64[] data\n',
    'geometry_msgs/Point': 'float64 x\nfloat64 y\nfloat64 z\n',
    'geometry_msgs/Vector3': 'float64 x\nfloat64 y\nfloat64 z\n',
    'geometry_msgs/Wrench': 'Vector3 force\nVector3 torque\n',
    'geometry_msgs/PointStamped': 'std_msgs/Header header\nPoint point\n',
    'geometry_msgs/Vector3Stamped': 'std_msgs/Header header\nVector3 vector\n',
    'geometry_msgs/WrenchStamped': 'std_msgs/Header header\nWrench wrench\n',
    'sensor_msgs/JointState': (
        'std_msgs/Header header\n'
        'string[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n'
    ),
}


def _parts(name: str) -> list[str]:
    """List the messages inside a message, nearest first, each once."""
    package = name.partition('/')[0]
    found: list[str] = []
    for line in FIELDS[name].splitlines():
        kind = line.split()[0].removesuffix('[]')
        inner = kind if '/' in kind else f'{package}/{kind}'
        if inner in FIELDS:
            found += [inner, *_parts(inner)]
    return list(dict.fromkeys(found))


def _definition(type_name: str) -> str:
    """Join a message and the messages inside it in the ``ros2msg`` encoding."""
    name = type_name.replace('/msg/', '/')
    inner = (f'{_SEPARATOR}\nMSG: {part}\n{FIELDS[part]}' for part in _parts(name))
    return FIELDS[name] + ''.join(inner)


#: REP 2011 hash of each type: equal in every ROS 2 distribution since Iron.
TYPE_HASHES: Final = {
    FLOAT64: 'RIHS01_705ba9c3d1a09df43737eb67095534de36fd426c0587779bda2bc51fe790182a',
    INT32: 'RIHS01_b6578ded3c58c626cfe8d1a6fb6e04f706f97e9f03d2727c9ff4e74b1cef0deb',
    UINT32: 'RIHS01_a5c874829b752bc5fa190024b0ad76f578cc278271e855c7d02a818b3516fb4a',
    STRING: 'RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18',
    FLOAT64_ARRAY: 'RIHS01_1025ddc6b9552d191f89ef1a8d2f60f3d373e28b283d8891ddcc974e8c55397f',
    POINT_STAMPED: 'RIHS01_4c0296af86e01e562e9e0405d138a01537247580076c58ea38d7923ac1045897',
    VECTOR3_STAMPED: 'RIHS01_d4829622288cbb443886e7ea94ea5671a3b1be6bab4ad04224432a65f7d7887a',
    WRENCH_STAMPED: 'RIHS01_8dc3deaf06b2ab281f9f9a742a8961c328ca7cec16e3fd6586d3a5c83fa78f77',
    JOINT_STATE: 'RIHS01_a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e',
}

#: Definition of each type, with the definitions of its inner types.
SCHEMAS: Final = {type_name: _definition(type_name) for type_name in TYPE_HASHES}
