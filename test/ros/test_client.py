# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A handshake ends when a drive answers, and not before; then nothing that is sent is lost."""

from typing import Any

import pytest
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Float64, String
from std_srvs.srv import Trigger

from stickslip_ros.errors import StickSlipError
from stickslip_ros.ros.client import RETRY_S, Handshake

NEWCOMERS = 20


def test_nobody_answers_where_no_drive_is(stand: Any):
    handshake = Handshake(stand.operator.node, 'nobody')
    with pytest.raises(StickSlipError, match='did not come'):
        stand.operator.spin_until(handshake.is_done, 'an answer', timeout_s=3 * RETRY_S)
    handshake.close()


def test_the_first_command_of_a_newcomer_arrives(stand: Any):
    node: Node = stand.operator.node
    for number in range(NEWCOMERS):
        voltage = node.create_publisher(Float64, 'command/voltage', 10)
        stand.operator.shake_hands()
        voltage.publish(Float64(data=float(number)))
        stand.operator.spin_until(
            lambda wanted=number + 1: len(stand.operator.events) >= wanted, 'its event'
        )
        node.destroy_publisher(voltage)
    assert {each['command'] for each in stand.operator.events} == {'voltage'}


def test_an_answer_that_cannot_be_delivered_does_not_end_the_drive(stand: Any):
    """A client that wants more durability than a service has can ask, but gets no answer."""
    operator = stand.operator
    profile = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    deaf = operator.node.create_client(Trigger, 'stickslip_drive/reset', qos_profile=profile)
    operator.shake_hands()
    answer = deaf.call_async(Trigger.Request())
    operator.spin_until(lambda: bool(operator.requests), 'what was asked')
    assert operator.trigger('stop').success
    operator.spin_until(lambda: len(operator.requests) > 1, 'what was asked next')
    assert [each['name'] for each in operator.requests] == ['reset', 'stop']
    assert not answer.done()


@pytest.mark.parametrize('key', ['info', 'request'])
def test_what_no_drive_says_of_itself_ends_no_operator(stand: Any, key: str):
    operator, deep = stand.operator, '[' * 100_000
    operator.spin_until(lambda: bool(operator.info), 'the information of the drive')
    told = dict(operator.info)
    profile = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    stranger = operator.node.create_publisher(String, f'stickslip_drive/{key}', profile)
    for text in ('', 'null', '5', '[]', '{}', deep, '{"time_origin_ns": "-1"}'):
        before = operator.received[key]
        stranger.publish(String(data=text))
        operator.spin_until(lambda heard=before: operator.received[key] > heard, 'what is said')
    assert operator.info == told
    operator.node.destroy_publisher(stranger)
