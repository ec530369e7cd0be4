# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Faults come and go while the drive runs: by parameter, by schedule, by service."""

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticStatus

from stickslip_ros.instrument.reports import Status
from stickslip_ros.parameters import SENSORS, is_fault, specs
from stickslip_ros.recording.reader import Recording

TITLE = 'stickslip_drive: faults'


def fault_parts(heard: list[Any]) -> list[Any]:
    return [part for array in heard for part in array.status if part.name == TITLE]


def wait_for_faults(stand: Any, heard: list[Any], message: str) -> Any:
    """Wait until diagnostics name exactly these faults; give the part."""

    def shown() -> bool:
        parts = fault_parts(heard)
        return bool(parts) and parts[-1].message == message

    stand.operator.spin_until(shown, f'faults: {message}')
    return fault_parts(heard)[-1]


def written(tmp_path: Path, text: str) -> str:
    path = tmp_path / 'faults.yaml'
    path.write_text(text)
    return str(path)


def test_a_fault_parameter_takes_effect_while_the_drive_runs(stand: Any):
    operator, heard = stand.operator, stand.operator.listen('diagnostics')
    wait_for_faults(stand, heard, 'none')
    assert operator.set_parameter('fault.interferometer', 'freeze').successful
    part = wait_for_faults(stand, heard, 'interferometer')
    assert part.level == DiagnosticStatus.WARN
    assert [(pair.key, pair.value) for pair in part.values] == [('interferometer', 'freeze')]
    operator.spin_until(lambda: bool(operator.status & Status.FAULT), 'the bit')
    assert operator.requests == [
        {'name': 'fault', 'values': [], 'settings': {'fault.interferometer': 'freeze'}}
    ]
    assert operator.set_parameter('fault.interferometer', 'none').successful
    assert wait_for_faults(stand, heard, 'none').level == DiagnosticStatus.OK
    operator.spin_until(lambda: not operator.status & Status.FAULT, 'no bit')


@pytest.mark.parametrize(
    ('name', 'value', 'reason'),
    [
        ('fault.interferometer', 'broken', "fault.interferometer 'broken' is not one of"),
        ('fault.dead_foot', 7, 'above the number of feet, 6; lower it'),
        ('fault.dead_foot', 13, 'fault.dead_foot 13 is above the maximum 12; lower it'),
        ('fault.schedule', 'x.yaml', 'fault.schedule cannot change while the node is active'),
        ('fault.missed_steps', float('nan'), ''),
    ],
)
def test_a_bad_fault_is_refused_and_changes_nothing(stand, name, value, reason):
    answer = stand.operator.set_parameter(name, value)
    assert not answer.successful
    assert reason in answer.reason
    stand.operator.trigger('stop')
    assert stand.drive.session.worker.faults == {}
    stand.operator.spin_until(lambda: bool(stand.operator.requests), 'the note of the stop')
    assert [each['name'] for each in stand.operator.requests] == ['stop']


def test_a_fault_given_at_the_start_is_there_from_the_start(start_drive: Callable):
    stand = start_drive({'fault.runner_stuck': True, 'fault.dead_foot': 3})
    assert stand.drive.session.worker.faults == {'dead_foot': 3, 'runner_stuck': True}
    assert stand.operator.status & Status.FAULT
    assert stand.operator.requests == []


def test_clearing_ends_every_fault_and_the_parameters_tell_the_truth(start_drive: Callable):
    stand = start_drive({'fault.runner_stuck': True})
    operator = stand.operator
    assert operator.set_parameter('fault.command_delay', 0.01).successful
    assert operator.trigger('clear_faults').success
    assert stand.drive.session.worker.faults == {}
    for name, value in (('fault.runner_stuck', False), ('fault.command_delay', 0.0)):
        assert stand.drive.get_parameter(name).value == value
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


def test_a_reset_does_not_restart_the_schedule(start_drive: Callable, tmp_path: Path):
    stand = start_drive({'fault.schedule': written(tmp_path, '- {at: 0, set: {dead_foot: 1}}')})
    stand.operator.trigger('clear_faults')
    stand.operator.trigger('reset')
    stand.operator.spin_for(0.01)
    assert stand.drive.session.worker.faults == {}


def test_a_new_configuration_restarts_the_schedule(start_drive: Callable, tmp_path: Path):
    stand = start_drive({'fault.schedule': written(tmp_path, '- {at: 0, set: {dead_foot: 1}}')})
    stand.operator.trigger('clear_faults')
    for transition in ('deactivate', 'cleanup', 'configure', 'activate'):
        assert stand.operator.change_state(transition)
    stand.operator.spin_until(lambda: bool(stand.drive.session.worker.faults), 'the fault')


@pytest.mark.parametrize('text', ['', '- {at: -1, clear: true}', None])
def test_a_bad_schedule_leaves_the_node_unconfigured(start_drive, tmp_path, text):
    path = str(tmp_path / 'faults.yaml') if text is None else written(tmp_path, text)
    stand = start_drive({'fault.schedule': path}, wait=False)
    assert stand.operator.state() == 'unconfigured'
    Path(path).write_text('- {at: 0, set: {dead_foot: 1}}')
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


def test_every_fault_has_a_value():
    assert FAULTS.keys() == set(filter(is_fault, specs()))


def test_every_fault_comes_by_its_parameter_and_goes_by_one_service(stand: Any):
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
