# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Faults come and go while the drive runs: by parameter, by schedule, by service."""

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest
from reports import OK, WARN, Reports, values_of

from stickslip_ros.instrument.reports import Status
from stickslip_ros.parameters import SENSORS, is_fault, specs
from stickslip_ros.recording.reader import Recording


def written(tmp_path: Path, text: str) -> str:
    path = tmp_path / 'faults.yaml'
    path.write_text(text)
    return str(path)


def test_a_fault_parameter_takes_effect_while_the_drive_runs(stand: Any):
    operator, reports = stand.operator, Reports(stand)
    reports.await_part('faults', lambda part: part.message == 'none')
    assert operator.set_parameter('fault.interferometer', 'freeze').successful
    part = reports.await_part('faults', lambda part: part.message == 'interferometer')
    assert (part.level, values_of(part)) == (WARN, {'interferometer': 'freeze'})
    operator.spin_until(lambda: bool(operator.status & Status.FAULT), 'the bit')
    assert operator.requests == [
        {'name': 'fault', 'values': [], 'settings': {'fault.interferometer': 'freeze'}}
    ]
    reports.heard.clear()
    assert operator.set_parameter('fault.interferometer', 'none').successful
    assert reports.await_part('faults', lambda part: part.message == 'none').level == OK
    operator.spin_until(lambda: not operator.status & Status.FAULT, 'no bit')


BAD = (
    ('fault.interferometer', 'broken', "fault.interferometer 'broken' is not one of"),
    ('fault.dead_foot', 7, 'above the number of feet, 6; lower it'),
    ('fault.dead_foot', 13, 'fault.dead_foot 13 is above the maximum 12; lower it'),
    ('fault.schedule', 'x.yaml', 'fault.schedule cannot change while the node is active'),
    ('fault.missed_steps', float('nan'), ''),
)


def test_a_bad_fault_is_refused_and_changes_nothing(stand: Any):
    operator = stand.operator
    for name, value, reason in BAD:
        answer = operator.set_parameter(name, value)
        assert not answer.successful
        assert reason in answer.reason
    operator.trigger('stop')
    assert stand.drive.session.worker.faults == {}
    operator.spin_until(lambda: bool(operator.requests), 'the note of the stop')
    assert [each['name'] for each in operator.requests] == ['stop']


def test_clearing_ends_faults_of_the_start_too_and_the_parameters_tell_the_truth(
    start_drive: Callable,
):
    stand = start_drive({'fault.runner_stuck': True, 'fault.dead_foot': 3})
    operator, worker = stand.operator, stand.drive.session.worker
    assert worker.faults == {'dead_foot': 3, 'runner_stuck': True}
    assert operator.status & Status.FAULT
    assert operator.set_parameter('fault.command_delay', 0.01).successful
    assert operator.trigger('clear_faults').success
    assert worker.faults == {}
    for name, value in (('runner_stuck', False), ('dead_foot', 0), ('command_delay', 0.0)):
        assert stand.drive.get_parameter(f'fault.{name}').value == value
    operator.trigger('stop')
    operator.spin_until(lambda: len(operator.requests) == 3, 'the notes')
    assert [each['name'] for each in operator.requests] == ['fault', 'clear_faults', 'stop']


def test_a_fault_set_while_the_drive_is_inactive_holds_when_it_goes_on(stand: Any):
    session = stand.drive.session
    stand.operator.change_state('deactivate')
    assert stand.operator.set_parameter('fault.dead_foot', 2).successful
    stand.operator.change_state('activate')
    stand.operator.spin_until(lambda: bool(stand.drive.session.worker.faults), 'the fault')
    assert stand.drive.session is session
    assert session.worker.faults == {'dead_foot': 2}


@pytest.mark.usefixtures('default_blocks')
def test_a_schedule_is_kept_to_the_block_and_recorded(start_drive: Callable, tmp_path: Path):
    text = """
    - {at: 0.02, set: {fault.interferometer: freeze}}
    - {at: 0.0305, set: {load_cell: dropout, dead_foot: 1}}
    - {at: 0.05, clear: true}
    """
    stand = start_drive(
        {
            'fault.schedule': written(tmp_path, text),
            'record.on_start': True,
            'record.name': 'run.mcap',
        }
    )
    operator = stand.operator
    operator.spin_until(lambda: operator.time_ns > 60_000_000, 'the end of the schedule')
    assert operator.set_recording(wanted=False).success
    told = [
        (time_ns, json.loads(str(message))['settings'])
        for topic, time_ns, message in Recording(tmp_path / 'run.mcap').messages()
        if topic == '/stickslip_drive/request'
    ]
    assert told == [
        (20_000_000, {'fault.interferometer': 'freeze'}),
        (31_000_000, {'fault.load_cell': 'dropout', 'fault.dead_foot': 1}),
        (50_000_000, {}),
    ]
    assert stand.drive.session.worker.faults == {}
    assert stand.drive.get_parameter('fault.interferometer').value == 'none'


def test_a_new_configuration_restarts_the_schedule_and_a_reset_does_not(start_drive, tmp_path):
    stand = start_drive({'fault.schedule': written(tmp_path, '- {at: 0, set: {dead_foot: 1}}')})
    stand.operator.trigger('clear_faults')
    stand.operator.trigger('reset')
    stand.operator.spin_for(0.01)
    assert stand.drive.session.worker.faults == {}
    for transition in ('deactivate', 'cleanup', 'configure', 'activate'):
        assert stand.operator.change_state(transition)
    stand.operator.spin_until(lambda: bool(stand.drive.session.worker.faults), 'the fault')


def test_a_bad_schedule_leaves_the_node_unconfigured(start_drive: Callable, tmp_path: Path):
    path = tmp_path / 'faults.yaml'
    stand = start_drive({'fault.schedule': str(path)}, wait=False)
    assert stand.operator.state() == 'unconfigured'
    for text in ('', '- {at: -1, clear: true}'):
        written(tmp_path, text)
        assert not stand.operator.change_state('configure')
    written(tmp_path, '- {at: 0, set: {dead_foot: 1}}')
    assert stand.operator.change_state('configure')


FAULTS: Mapping[str, Any] = {
    **{f'fault.{row.name}': 'dropout' for row in SENSORS},
    **{f'fault.{row.name}_offset': 1e-3 * row.largest for row in SENSORS},
    'fault.amplifier_off': True,
    'fault.dead_foot': 1,
    'fault.runner_stuck': True,
    'fault.missed_steps': 1.0,
    'fault.command_delay': 5.0,
}
"""A value of each fault."""


def test_every_fault_comes_by_its_parameter_and_goes_by_one_service(stand: Any):
    assert FAULTS.keys() == set(filter(is_fault, specs()))
    operator = stand.operator
    for number, (name, value) in enumerate(FAULTS.items()):
        assert operator.set_parameter(name, value).successful
        operator.spin_until(lambda n=number: len(operator.requests) > n, 'the note')
    assert [each['settings'] for each in operator.requests] == [
        {name: value} for name, value in FAULTS.items()
    ]
    assert len(stand.drive.session.worker.faults) == len(FAULTS)
    assert operator.trigger('clear_faults').success
    for name in FAULTS:
        assert stand.drive.get_parameter(name).value == specs()[name].default


def test_every_fault_comes_and_goes_by_schedule(start_drive: Callable, tmp_path: Path):
    path = tmp_path / 'faults.yaml'
    entries = [
        {'at': 0.01 * (number + 1), 'set': {name: value}}
        for number, (name, value) in enumerate(FAULTS.items())
    ]
    path.write_text(json.dumps([*entries, {'at': 0.2, 'clear': True}]))
    stand = start_drive({'sim.lockstep': True, 'fault.schedule': str(path)}, wait=False)
    operator = stand.operator
    operator.wait_for_topics()
    # The run is over in a moment: the drive must know who listens before it begins.
    notes = stand.drive._topics._offered['request']
    operator.spin_until(lambda: notes.get_subscription_count() > 0, 'the connection')
    operator.command('grant', (0.3, 0))
    operator.spin_until(lambda: len(operator.requests) > len(FAULTS), 'the schedule')
    told = [each['settings'] for each in operator.requests]
    assert told == [{name: value} for name, value in FAULTS.items()] + [{}]
    assert operator.requests[-1]['name'] == 'clear_faults'
    operator.spin_until(
        lambda: operator.status == Status.SENSOR_PRESENT | Status.AMPLIFIER_ENABLED, 'health'
    )
