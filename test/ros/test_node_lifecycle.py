# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The node goes through the states of a lifecycle, by itself or as a manager says."""

import itertools
from typing import Any

import pytest

from stickslip_ros.errors import StickSlipError
from stickslip_ros.interface.topics import COMMAND_TOPICS, READINGS, SERVICES, TOPICS
from stickslip_ros.parameters import Parameters
from stickslip_ros.recording.reader import Recording
from stickslip_ros.ros.connections import ALWAYS

OFFERED = {topic.key for topic in TOPICS if topic.exists(Parameters())}


def topics_of(stand: Any) -> set[str]:
    """Give the topics of the interface at which the drive is."""
    node = stand.drive
    name = stand.drive.get_name()
    published = dict(node.get_publisher_names_and_types_by_node(name, '/'))
    subscribed = dict(node.get_subscriber_names_and_types_by_node(name, '/'))
    return {
        topic.key
        for topics, there in ((READINGS, published), (COMMAND_TOPICS, subscribed))
        for topic in topics
        if topic.full_name() in there
    }


def services_of(stand: Any) -> set[str]:
    """Give the services of the interface that the drive offers."""
    full = {service.name.replace('~', '/stickslip_drive') for service in SERVICES}
    offered = stand.drive.get_service_names_and_types_by_node('stickslip_drive', '/')
    return full & {name for name, _ in offered}


def test_a_drive_without_autostart_waits_offers_all_runs_and_stops_as_it_is_led(manual: Any):
    operator = manual.operator
    assert operator.state() == 'unconfigured'
    assert topics_of(manual) == {ALWAYS}
    assert services_of(manual) == set()
    for transition in ('activate', 'deactivate', 'cleanup'):
        assert not operator.change_state(transition)
    assert operator.change_state('configure')
    assert operator.state() == 'inactive'
    assert topics_of(manual) == OFFERED
    assert len(services_of(manual)) == len(SERVICES)
    with pytest.raises(StickSlipError, match='inactive, not active; activate it first'):
        manual.drive.session  # noqa: B018 - it is the property that refuses
    assert operator.positions == {}
    assert operator.change_state('activate')
    assert operator.state() == 'active'
    operator.wait_for_drive()
    session = manual.drive.session
    assert operator.change_state('deactivate')
    assert operator.state() == 'inactive'
    operator.spin_until(lambda: operator.time_ns == session.bench.time_ns, 'the last position')
    assert session._thread is None


def test_a_drive_that_is_activated_again_goes_on_where_it_stopped(manual: Any):
    manual.operator.change_state('configure')
    manual.operator.change_state('activate')
    manual.operator.wait_for_drive()
    manual.operator.command('voltage', 150.0)
    manual.operator.wait_for_event('voltage', 0)
    session = manual.drive.session
    manual.operator.change_state('deactivate')
    stopped_ns, stopped = session.bench.time_ns, session.bench.state
    assert manual.operator.change_state('activate')
    assert manual.operator.state() == 'active'
    manual.operator.spin_until(lambda: manual.operator.time_ns > stopped_ns, 'a position')
    block_ns = session.parameters.block_ns
    times = sorted(manual.operator.positions)
    assert {b - a for a, b in itertools.pairwise(times)} == {block_ns}
    assert manual.drive.session.bench.state.voltage_v == stopped.voltage_v == 150.0


def test_a_drive_outlives_a_refused_rebuild(manual: Any):
    manual.operator.change_state('configure')
    kept = manual.drive._session
    assert manual.operator.set_parameter('fault.schedule', '/none.yaml').successful
    assert not manual.operator.change_state('activate')
    assert manual.drive._session is kept
    assert manual.operator.set_parameter('fault.schedule', '').successful
    assert manual.operator.change_state('activate')
    assert manual.drive.session is kept
    manual.operator.change_state('deactivate')
    assert manual.operator.set_parameter('stand.preload', 0.25).successful
    assert manual.operator.change_state('activate')
    assert manual.drive.session is not kept


@pytest.mark.usefixtures('default_blocks')
def test_cleanup_takes_topics_and_services_away_and_configure_begins_anew(start_drive, tmp_path):
    stand = start_drive({'autostart': False, 'record.on_start': True}, wait=False)
    stand.operator.change_state('configure')
    stand.operator.change_state('activate')
    stand.operator.wait_for_drive()
    first = stand.drive.session
    stand.operator.change_state('deactivate')
    assert stand.operator.change_state('cleanup')
    assert stand.operator.state() == 'unconfigured'
    assert topics_of(stand) == {ALWAYS}
    assert services_of(stand) == set()
    assert stand.operator.change_state('configure')
    assert stand.operator.change_state('activate')
    assert stand.drive.session is not first
    stand.operator.set_recording(wanted=False)
    for file in tmp_path.glob('*.mcap'):
        assert Recording(file).series('position').time_s[0] == pytest.approx(1e-3)
    assert len(list(tmp_path.glob('*.mcap'))) == 2


@pytest.mark.parametrize('way', [(), ('configure',), ('configure', 'activate')])
def test_shutdown_ends_the_drive_from_any_state(manual: Any, way: tuple[str, ...]):
    for transition in way:
        assert manual.operator.change_state(transition)
    session = manual.drive._session
    assert manual.operator.change_state('shutdown')
    assert manual.operator.state() == 'finalized'
    assert topics_of(manual) == {ALWAYS}
    assert session is None or session._thread is None


def test_commands_to_an_inactive_drive_move_nothing_then_or_later(start_drive, perfect_sensors):
    stand = start_drive({'autostart': False, **perfect_sensors}, wait=False)
    stand.operator.change_state('configure')
    operator = stand.operator
    operator.wait_for_topics()
    operator.command('voltage', 300.0)
    operator.command('sawtooth', (300.0, 1000.0, 50.0))
    operator.command('load', 1.0)
    assert not operator.trigger('stop').success  # they came before it
    stand.operator.change_state('activate')
    operator.wait_for_drive()
    operator.command('voltage', 0.0)
    event = operator.wait_for_event('voltage', 0)
    assert event['number'] == 1
    assert set(operator.positions.values()) == {0.0}
    assert [each['command'] for each in operator.events] == ['voltage']
