# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Quality of service can be overridden; what does not fit is told and counted."""

from collections.abc import Callable
from typing import Any

import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from reports import WARN, Reports, endpoint_of, values_of
from std_msgs.msg import Float64

from stickslip_ros.ros.connections import ALWAYS
from stickslip_ros.ros.interface import MESSAGE_TYPES

pytestmark = pytest.mark.usefixtures('frequent_diagnostics')

BEST_EFFORT = {'qos_overrides./position.publisher.reliability': 'best_effort'}


STREAMS = ('position', 'force', 'voltage', 'trace', 'joint_states')
OPTIONAL = ('truth/position', 'truth/force', 'clock')
SET_POINTS = ('voltage', 'jog', 'position', 'joint', 'load', 'preload')


@pytest.mark.parametrize('has_all', [False, True])
def test_only_overrides_that_make_sense_are_listed(start_drive: Callable, has_all: bool):
    stand = start_drive({'sim.publish_truth': has_all, 'sim.publish_clock': has_all}, wait=False)
    named = set(stand.drive.get_parameters_by_prefix('qos_overrides'))
    streams = STREAMS + OPTIONAL if has_all else STREAMS
    both = [f'/{name}.publisher' for name in streams]
    both += [f'/command/{name}.subscription' for name in SET_POINTS]
    depths = [f'/stickslip_drive/{name}.publisher' for name in ('event', 'request')]
    wanted = {f'{each}.depth' for each in both + depths}
    assert named == wanted | {f'{each}.reliability' for each in both}


def test_a_stream_keeps_what_comes_in_a_second_of_simulated_time(start_drive: Callable):
    stand = start_drive({'sim.block': 5e-4, 'sim.joint_states_rate': 250.0}, wait=False)
    depths = {key: stand.drive._topics._offered[key].qos_profile.depth for key in STREAMS}
    assert depths == {
        'position': 2000,
        'force': 2000,
        'voltage': 100,
        'trace': 100,
        'joint_states': 250,
    }


def test_an_override_names_the_resolved_topic_of_a_publisher_or_a_subscription(start_drive):
    name = 'qos_overrides./left/command/voltage.subscription'
    given = {f'{name}.reliability': 'best_effort', f'{name}.depth': 7}
    stand = start_drive({**given, 'qos_overrides./left/position.publisher.depth': 3}, '/left')
    profile = endpoint_of(stand, '/left/command/voltage', published=False).qos_profile
    assert profile.reliability == ReliabilityPolicy.BEST_EFFORT
    offered = stand.drive._topics._offered
    assert [offered[key].qos_profile.depth for key in ('command/voltage', 'position')] == [7, 3]


def test_overrides_hold_after_a_new_configuration_and_cannot_change(start_drive: Callable):
    stand = start_drive({**BEST_EFFORT, 'autostart': False}, wait=False)
    for transition in ('configure', 'cleanup', 'configure', 'activate'):
        assert stand.operator.change_state(transition)
    profile = endpoint_of(stand, '/position', published=True).qos_profile
    assert profile.reliability == ReliabilityPolicy.BEST_EFFORT
    [name] = BEST_EFFORT
    assert stand.drive.get_parameter(name).value == 'best_effort'
    assert not stand.operator.set_parameter(name, 'reliable').successful


@pytest.mark.usefixtures('default_blocks')
def test_a_recording_keeps_the_overridden_quality_of_service(start_drive: Callable):
    stand = start_drive({'qos_overrides./position.publisher.depth': 3})
    channels = stand.drive._topics.channels(stand.drive.session.parameters)
    assert (channels['position'].qos.depth, channels['force'].qos.depth) == (3, 1000)


@pytest.mark.parametrize(
    ('name', 'value'),
    [
        ('qos_overrides./position.publisher.reliability', 'perhaps'),
        ('qos_overrides./position.publisher.reliability', 'system_default'),
        ('qos_overrides./position.publisher.durability', 'transient_local'),
        ('qos_overrides./stickslip_drive/event.publisher.reliability', 'best_effort'),
        ('qos_overrides./position.publisher.depth', 0),
        ('qos_overrides./positon.publisher.depth', 5),
        ('qos_overrides./position.subscription.depth', 5),
        ('qos_overrides./position.publisher.history', 'keep_all'),
    ],
)
def test_a_bad_override_leaves_the_node_unconfigured(start_drive: Callable, name: str, value: Any):
    stand = start_drive({name: value}, wait=False)
    assert stand.operator.state() == 'unconfigured'
    assert stand.drive._topics._offered.keys() == {ALWAYS}
    assert not stand.operator.change_state('configure')


@pytest.mark.parametrize(
    ('direction', 'remedy'),
    [('publisher', 'that publisher reliable'), ('subscription', 'that subscription volatile')],
)
def test_an_endpoint_that_does_not_fit_is_told_and_counted(stand, direction, remedy, capfd):
    node = stand.operator.node
    if direction == 'publisher':
        profile = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
        node.create_publisher(Float64, 'command/voltage', profile)
        topic = 'command/voltage'
    else:
        profile = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        point = MESSAGE_TYPES['geometry_msgs/msg/PointStamped']
        node.create_subscription(point, 'position', lambda _: None, profile)
        topic = 'position'
    part = Reports(stand).await_part('connections', lambda part: part.level == WARN)
    assert part.message == '1 of incompatible quality of service since the configuration'
    assert values_of(part) == {topic: '1'}
    assert f'make {remedy}' in capfd.readouterr().err
