# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Units, definitions and hashes of messages: those of their commands, and those of ROS."""

from collections.abc import Iterator

import pytest
import rclpy
from geometry_msgs.msg import PointStamped, Vector3Stamped, WrenchStamped
from rclpy.context import Context
from rclpy.node import Node
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, Float64MultiArray, Int32, String, UInt32

from stickslip_ros.instrument.commands import COMMANDS
from stickslip_ros.interface.messages import find_quantity
from stickslip_ros.interface.schemas import SCHEMAS, TYPE_HASHES
from stickslip_ros.message_types import FLOAT64, INT32, JOINT_STATE


@pytest.mark.parametrize(
    ('topic', 'unit'),
    [('command/voltage', 'V'), ('command/jog', 'Hz'), ('/left/command/preload', 'N'), ('x', '')],
)
def test_a_plain_number_has_the_unit_of_its_command(topic: str, unit: str):
    assert find_quantity(topic, FLOAT64, '').unit == unit
    assert find_quantity('command/steps', INT32, '').unit == ''


def test_a_joint_has_the_units_of_its_command():
    for label in COMMANDS['joint'].numbers:
        field, _, unit = label.partition(' ')
        assert find_quantity('command/joint', JOINT_STATE, field).unit == unit


#: What reads ROS's definitions imports modules that Python has renamed since.
pytestmark = pytest.mark.filterwarnings('ignore:module .sre_:DeprecationWarning')

CLASSES = (
    Float64, Int32, UInt32, String, Float64MultiArray, PointStamped, Vector3Stamped,
    WrenchStamped, JointState,
)  # fmt: skip


@pytest.fixture(scope='module')
def node(ros_domain: int) -> Iterator[Node]:
    context = Context()
    rclpy.init(context=context, domain_id=ros_domain)
    node = rclpy.create_node('schemas', context=context)
    yield node
    node.destroy_node()
    context.try_shutdown()


@pytest.mark.parametrize('message', CLASSES, ids=lambda each: each.__name__)
def test_hashes_are_those_that_ros_announces(node: Node, message: type):
    name = f'{message.__module__.split(".")[0]}/msg/{message.__name__}'
    publisher = node.create_publisher(message, message.__name__, 1)
    info = node.get_publishers_info_by_topic(publisher.topic_name)[0]
    assert (info.topic_type, str(info.topic_type_hash)) == (name, TYPE_HASHES[name])


@pytest.mark.parametrize('name', SCHEMAS)
def test_a_definition_is_complete_and_has_the_hash_that_stands_beside_it(name: str):
    types = get_typestore(Stores.EMPTY)
    types.register(get_types_from_msg(SCHEMAS[name], name))
    assert types.hash_rihs01(name) == TYPE_HASHES[name]


@pytest.mark.parametrize('name', SCHEMAS)
def test_a_definition_names_each_inner_type_once_behind_a_line_of_80(name: str):
    _, *parts = SCHEMAS[name].split('=' * 80 + '\n')
    inner = [part.splitlines()[0] for part in parts]
    assert len(set(inner)) == len(inner)
    assert all(line.startswith('MSG: ') and '/msg/' not in line for line in inner)
