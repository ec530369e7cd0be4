# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Topics and services are those of interface.md, in any namespace and under other names."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from rclpy.duration import Infinite
from rclpy.qos import LivelinessPolicy
from reports import endpoint_of

from stickslip_ros.instrument.reports import Status
from stickslip_ros.interface.topics import (
    COMMAND_TOPICS,
    READINGS,
    SERVICES,
    TOPICS,
    recorded_channels,
)
from stickslip_ros.parameters import Parameters, specs
from stickslip_ros.recording.reader import Recording
from stickslip_ros.ros.interface import to_qos

pytestmark = pytest.mark.usefixtures('frequent_diagnostics')

IDLE = Status.SENSOR_PRESENT | Status.AMPLIFIER_ENABLED
#: Parameters under which every topic exists.
ALL_TOPICS = {
    name: True for topic in TOPICS for name in topic.switches if specs()[name].kind is bool
}


def test_every_topic_has_the_declared_type_and_quality_and_every_reading_is_heard(start_drive):
    stand = start_drive(ALL_TOPICS, wait=False)
    for topic in TOPICS:
        endpoint = endpoint_of(stand, topic.full_name(), published=topic in READINGS)
        qos = to_qos(endpoint.qos_profile)
        assert endpoint.topic_type == topic.type_name
        assert (qos.reliable, qos.latched) == (topic.qos.reliable, topic.qos.latched)
        assert endpoint.qos_profile.deadline == endpoint.qos_profile.lifespan == Infinite
        assert endpoint.qos_profile.liveliness == LivelinessPolicy.AUTOMATIC
    stand.operator.wait_for_topics()
    assert stand.operator.trigger('stop').success
    stand.operator.command('grant', (1.0, 0))
    received = stand.operator.received
    stand.operator.spin_until(lambda: all(received[each.key] for each in READINGS), 'each topic')


def test_the_node_has_no_topics_but_the_declared_ones_and_every_service(stand: Any):
    drive = stand.drive
    published = {n for n, _ in drive.get_publisher_names_and_types_by_node(drive.get_name(), '/')}
    heard = {n for n, _ in drive.get_subscriber_names_and_types_by_node(drive.get_name(), '/')}
    every_node_has = {'/rosout', '/parameter_events', '/stickslip_drive/transition_event'}
    for there, topics in ((published, READINGS), (heard, COMMAND_TOPICS)):
        declared = {each.full_name() for each in topics if each.exists(Parameters())}
        assert there - every_node_has == declared
    offered = dict(drive.get_service_names_and_types_by_node(drive.get_name(), '/'))
    for service in SERVICES:
        assert offered[service.name.replace('~', '/stickslip_drive')] == [service.type_name]


def test_a_namespace_moves_every_relative_name(start_drive: Callable):
    stand = start_drive(namespace='/left')
    drive = stand.drive
    assert drive.get_fully_qualified_name() == '/left/stickslip_drive'
    names = {
        name
        for get in (
            drive.get_publisher_names_and_types_by_node,
            drive.get_subscriber_names_and_types_by_node,
        )
        for name, _ in get('stickslip_drive', '/left')
    }
    relative = [t for t in TOPICS if t.exists(Parameters()) and not t.name.startswith('/')]
    expected = {t.name.replace('~', 'stickslip_drive') for t in relative}
    assert {f'/left/{name}' for name in expected} <= names
    assert {n for n in names if not n.startswith('/left/')} == {
        '/diagnostics',
        '/rosout',
        '/parameter_events',
    }


def test_who_comes_late_gets_status_and_info_and_no_old_readings_or_events(start_drive: Callable):
    stand = start_drive({'stand.preload': 0.25})
    operator = stand.operator
    operator.command('load', 0.5)
    operator.wait_for_event('load', 0)
    operator.spin_until(lambda: operator.status == IDLE | Status.LOADED, 'the status')
    before_ns = operator.time_ns
    names = ('status', 'info', 'event', 'position')
    status, info, events, positions = map(operator.listen, names)
    operator.spin_until(lambda: bool(status and info and positions), 'what a newcomer gets')
    assert [each.data for each in status] == [IDLE | Status.LOADED]
    told = json.loads(info[0].data)
    assert told['parameters']['stand.preload'] == 0.25
    assert told['parameters'].keys() == specs().keys()
    assert told['units']['stand.preload'] == 'N'
    assert {'stickslip_ros', 'numpy', 'numba', 'python'} <= told['versions'].keys()
    assert events == []
    assert operator.simulated_ns(positions[0]) > before_ns


STEPS = 20.0


def recorded_topics(stand: Any) -> set[str]:
    path = stand.operator.set_recording(wanted=True).message
    stand.operator.set_recording(wanted=False)
    return set(Recording(Path(path)).types)


def test_a_remapped_topic_is_published_heard_and_recorded_under_its_new_name(
    start_drive: Callable,
):
    crossed = 'command/voltage:=/command/preload', 'command/preload:=/command/voltage'
    stand = start_drive(remaps=('position:=measured', *crossed), wait=False)
    operator = stand.operator
    operator.spin_until(lambda: operator.node.count_publishers('/measured') == 1, 'the topic')
    assert operator.node.count_publishers('/position') == 0
    operator.shake_hands()
    operator.command('preload', 50.0)  # on the topic that now means a voltage
    assert operator.wait_for_event('voltage', 0)['result'] == 'DONE'
    assert stand.drive.session.bench.state.voltage_v == 50.0
    topics = recorded_topics(stand)
    assert {'/measured', '/force'} <= topics
    assert '/position' not in topics


def test_a_recording_of_a_renamed_node_carries_its_names(start_drive: Callable):
    stand = start_drive(remaps=('__node:=twin',))
    expected = {c.topic for c in recorded_channels(Parameters(), '/', 'twin').values()}
    assert recorded_topics(stand) == expected
    heard = stand.operator.listen('diagnostics')
    stand.operator.spin_until(lambda: bool(heard), 'diagnostics')
    assert {part.name.partition(':')[0] for part in heard[0].status} == {'twin'}


def test_two_drives_have_their_own_seed_motion_and_time(start_drive: Callable, tmp_path: Path):
    kept = {'record.on_start': True, 'interferometer.resolution': 0.0}
    left = start_drive({**kept, 'record.name': 'left', 'sim.seed': 1}, '/left')
    values = {'record.name': 'right', 'sim.seed': 2, 'stand.preload': 0.25}
    right = start_drive({**kept, **values}, '/right')
    left.operator.switch('set_paused', wanted=True)
    held_ns = left.drive.session.bench.time_ns
    right.operator.command('sawtooth', (300.0, 1000.0, STEPS))
    assert right.operator.wait_for_event('sawtooth', 0)['steps'] == STEPS
    assert left.drive.session.bench.time_ns == held_ns
    assert left.drive.session.bench.state.position_m == 0.0
    assert right.drive.session.bench.state.position_m > 1e-8
    right.operator.set_parameter('fault.dead_foot', 1)
    right.operator.trigger('stop')
    assert left.drive.session.worker.faults == {}
    assert left.operator.events == []
    heard = left.operator.diagnostics  # of both
    wanted = {f'{side}/stickslip_drive: time' for side in ('left', 'right')}
    left.operator.spin_until(lambda: wanted <= {n for each in heard for n in each}, 'diagnostics')
    first = {}
    for name, stand in (('left', left), ('right', right)):
        assert stand.operator.set_recording(wanted=False).success
        series = Recording(tmp_path / f'{name}.mcap').series('position')
        first[name] = (series.time_s[0], series.value[0])
    assert first['left'][0] == first['right'][0]  # both stand still then
    assert first['left'][1] != first['right'][1]
