# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Simulated time can be held, stepped and published; nothing waits for a tick that never comes."""

import itertools
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from reports import Reports

from stickslip_ros.interface.messages import StampedMessage
from stickslip_ros.recording.reader import Recording
from stickslip_ros.testing import deep_queues

BLOCK_NS = 1_000_000


def pause(stand: Any) -> int:
    """Hold simulated time; give it, ns."""
    assert stand.operator.switch('set_paused', wanted=True).success
    return int(stand.drive.session.bench.time_ns)


@pytest.mark.usefixtures('default_blocks')
def test_a_pause_holds_time_and_its_end_lets_it_go_on_without_a_hole(start_drive: Callable):
    stand = start_drive(deep_queues('position'))
    operator = stand.operator
    held_ns = pause(stand)
    operator.spin_until(lambda: operator.time_ns == held_ns, 'the last position')
    Reports(stand).next('time')  # a second of wall-clock time
    assert stand.drive.session.bench.time_ns == operator.time_ns == held_ns
    answer = operator.switch('set_paused', wanted=False)
    assert (answer.success, answer.message) == (True, 'running')
    operator.spin_until(lambda: operator.time_ns > held_ns, 'a position')
    times = sorted(operator.positions)
    assert {b - a for a, b in itertools.pairwise(times)} == {BLOCK_NS}


@pytest.mark.usefixtures('default_blocks')
def test_a_step_advances_by_exactly_one_block_and_is_refused_while_time_runs(stand: Any):
    operator = stand.operator
    answer = operator.trigger('step_simulation')
    runs = 'simulated time runs; call ~/set_paused with true first'
    assert (answer.success, answer.message) == (False, f'step_simulation refused: {runs}')
    held_ns = pause(stand)
    for number in range(1, 4):
        answer = operator.trigger('step_simulation')
        assert answer.success
        assert answer.message == f'advanced to {(held_ns + number * BLOCK_NS) * 1e-9:.9g} s'
    assert stand.drive.session.bench.time_ns == held_ns + 3 * BLOCK_NS
    operator.spin_until(lambda: operator.time_ns == held_ns + 3 * BLOCK_NS, 'the last position')


def test_services_faults_and_commands_of_a_paused_drive_are_answered_and_wait(stand: Any):
    held_ns = pause(stand)
    operator = stand.operator
    for wanted in (True, False):
        assert operator.set_recording(wanted=wanted).success
    operator.set_parameter('fault.dead_foot', 1)
    operator.spin_until(lambda: bool(stand.drive.session.worker.faults), 'the fault')
    operator.command('load', 0.1)
    names = ('stop', 'zero_position', 'tare_force', 'clear_faults')
    for name in names:  # after the load, and carried out before it
        assert operator.trigger(name).success
    operator.spin_until(lambda: len(operator.requests) > len(names), 'the notes')
    assert operator.events == []
    operator.trigger('step_simulation')
    assert operator.wait_for_event('load', 0)['time_ns'] == held_ns
    told = [each['command'] for each in operator.events if each['time_ns'] == held_ns]
    assert [each for each in told if each in (*names, 'load')] == [*names, 'load']
    assert stand.drive.session.failure is None


@pytest.mark.usefixtures('default_blocks')
def test_a_slow_drive_is_paused_at_once(start_drive: Callable):
    stand = start_drive({'sim.real_time_factor': 1e-6}, wait=False)
    operator = stand.operator
    operator.spin_until(lambda: stand.drive.session.bench.time_ns > 0, 'the first block')
    held_ns = pause(stand)
    assert operator.trigger('reset').success
    assert operator.trigger('step_simulation').success
    assert stand.drive.session.bench.time_ns == held_ns + BLOCK_NS


def test_a_paused_drive_can_be_deactivated_and_runs_when_activated(stand: Any):
    held_ns = pause(stand)
    assert stand.operator.change_state('deactivate')
    assert stand.operator.change_state('activate')
    stand.operator.spin_until(lambda: stand.operator.time_ns > held_ns, 'a position')


def test_a_node_does_not_follow_the_clock_that_it_publishes(start_drive: Callable):
    stand = start_drive({'sim.publish_clock': True, 'use_sim_time': True}, wait=False)
    assert stand.operator.state() == 'unconfigured'
    assert not stand.operator.change_state('configure')
    assert stand.operator.set_parameter('use_sim_time', value=False).successful
    assert stand.operator.change_state('configure')
    answer = stand.operator.set_parameter('use_sim_time', value=True)
    assert not answer.successful
    assert answer.reason == (
        'use_sim_time True is not possible while sim.publish_clock is true: '
        'the node would follow its own clock; set one of the two to false'
    )
    assert not stand.drive._time_source.ros_time_is_active


def test_following_another_clock_is_allowed_and_refused_is_then_to_publish_one(start_drive):
    stand = start_drive({'autostart': False, 'use_sim_time': True}, wait=False)
    answer = stand.operator.set_parameter('sim.publish_clock', value=True)
    assert not answer.successful
    assert 'use_sim_time' in answer.reason
    assert stand.operator.change_state('configure')
    assert stand.operator.change_state('activate')
    Reports(stand).await_part('time')  # 1 Hz of wall-clock time, though the clock stands still


@pytest.mark.usefixtures('default_blocks')
def test_the_truth_is_published_and_recorded_if_asked_for(start_drive, perfect_sensors):
    stand = start_drive({**perfect_sensors, 'sim.publish_truth': True})
    operator = stand.operator
    truth, force = stand.operator.listen('truth/position'), stand.operator.listen('truth/force')
    path = operator.set_recording(wanted=True).message
    start_ns = stand.drive.session.bench.time_ns
    operator.command('sawtooth', (300.0, 1000.0, 5.0))
    operator.wait_for_event('sawtooth', 0)
    end_ns = start_ns + 20 * BLOCK_NS
    for heard in (truth, force):
        operator.spin_until(
            lambda each=heard: bool(each) and operator.simulated_ns(each[-1]) > end_ns, 'the truth'
        )
    operator.set_recording(wanted=False)
    recorded: dict[str, dict[int, float]] = {'/position': {}, '/truth/position': {}}
    for topic, time_ns, message in Recording(Path(path)).messages(list(recorded)):
        assert isinstance(message, StampedMessage)
        recorded[topic][time_ns] = message.values[0]
    assert recorded['/position'] == recorded['/truth/position']
    kept = recorded['/truth/position']
    both = [each for each in truth if operator.simulated_ns(each) in kept]
    assert len(both) >= 10
    assert all(each.point.x == kept[operator.simulated_ns(each)] for each in both)


def test_topics_follow_a_parameter_that_was_changed_while_inactive(stand: Any):
    stand.operator.change_state('deactivate')
    assert stand.operator.set_parameter('sim.publish_truth', value=True).successful
    assert stand.operator.change_state('activate')
    truth = stand.operator.listen('truth/position')
    stand.operator.spin_until(lambda: bool(truth), 'the truth')
