"""Faults come and go while the drive runs: by parameter, by schedule, by service."""

import json
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticStatus

from stickslip_ros.instrument.reports import Status
from stickslip_ros.parameters import SENSORS, Sensor, specs
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
        ('fault.dead_foot', 7, 'out of range'),
        ('fault.schedule', 'x.yaml', 'fault.schedule cannot change while the node is active'),
        ('fault.missed_steps', float('nan'), ''),
    ],
)
def test_a_bad_fault_is_refused_and_changes_nothing(
    stand: Any, name: str, value: Any, reason: str
):
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


def test_clearing_ends_every_fault_and_the_parameters_tell_the_truth(
    start_drive: Callable,
):
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


def test_a_changed_fault_does_not_make_another_drive_of_it(stand: Any):
    session = stand.drive.session
    stand.operator.set_parameter('fault.dead_foot', 2)
    stand.operator.trigger('stop')
    stand.operator.change_state('deactivate')
    stand.operator.change_state('activate')
    assert stand.drive.session is session
    assert session.worker.faults == {'dead_foot': 2}


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
        (time_ns, json.loads(str(message)))
        for topic, time_ns, message in Recording(tmp_path / 'run.mcap').messages()
        if topic == '/stickslip_drive/request'
    ]
    assert told == [
        (
            20_000_000,
            {'name': 'fault', 'values': [], 'settings': {'fault.interferometer': 'freeze'}},
        ),
        (
            31_000_000,
            {
                'name': 'fault',
                'values': [],
                'settings': {'fault.load_cell': 'dropout', 'fault.dead_foot': 1},
            },
        ),
        (50_000_000, {'name': 'clear_faults', 'values': [], 'settings': {}}),
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


@pytest.mark.parametrize('text', ['', '- {at: -1, clear: true}'])
def test_a_bad_schedule_leaves_the_node_unconfigured(
    start_drive: Callable, tmp_path: Path, text: str
):
    path = written(tmp_path, text)
    stand = start_drive({'fault.schedule': path}, wait=False)
    assert stand.operator.state() == 'unconfigured'
    Path(path).write_text('- {at: 0, set: {dead_foot: 1}}')
    assert stand.operator.change_state('configure')


def test_a_schedule_that_is_not_there_leaves_the_node_unconfigured(
    start_drive: Callable,
):
    stand = start_drive({'fault.schedule': 'missing.yaml'}, wait=False)
    assert stand.operator.state() == 'unconfigured'
    assert not stand.operator.change_state('configure')


BURST = (300.0, 1000.0, 10.0)
FREE = {
    'load_cell.contact': 'absent',
    'runner.damping': 80.0,
    **{row.switch: True for row in SENSORS if row.switch},
}
STOOD_M = 30e-9
"""More than the sensor's noise and what loosened contacts give way, less than one step."""
STANDING_BLOCKS = 20
"""More readings than noise of more than a step of the resolution would leave equal."""
FAULTS = [name for name, spec in specs().items() if spec.live]


def way_of_steps(stand: Any) -> float:
    """Step as often as always from the same start; give the way by the interferometer, m."""
    operator = stand.operator
    assert operator.trigger('reset').success
    seen = len(operator.events)
    operator.command('sawtooth', BURST)
    done_ns = operator.wait_for_event('sawtooth', seen)['time_ns']
    operator.spin_until(lambda: operator.time_ns > done_ns + 5_000_000, 'rest')
    return float(operator.positions[operator.time_ns])


def reading_of(message: Any) -> float:
    return message.point.x if hasattr(message, 'point') else message.wrench.force.x


def reads(row: Sensor, condition: Callable[[float], bool]) -> Callable[[Any], None]:
    def see(stand: Any) -> None:
        heard = stand.operator.listen(row.reading)
        stand.operator.spin_until(lambda: bool(heard) and condition(reading_of(heard[-1])), 'it')

    return see


def has_no_power(stand: Any) -> None:
    stand.operator.spin_until(
        lambda: not stand.operator.status & Status.AMPLIFIER_ENABLED, 'no power'
    )


def goes_another_way(stand: Any) -> None:
    faulty_m = way_of_steps(stand)
    assert stand.operator.trigger('clear_faults').success
    assert abs(way_of_steps(stand) - faulty_m) > STOOD_M


def stands_still(stand: Any) -> None:
    assert abs(way_of_steps(stand)) < STOOD_M


def is_slow_to_obey(stand: Any) -> None:
    stand.operator.command('load', 0.1)
    stand.operator.spin_until(
        lambda: bool(stand.operator.status & Status.MOVE_DELAYED), 'the delay'
    )


#: A value of each fault, one that is refused, and what shows that the fault is there.
CASES: Mapping[str, tuple[Any, Any, Callable[[Any], None]]] = {
    **{f'fault.{row.name}': ('dropout', 'broken', reads(row, math.isnan)) for row in SENSORS},
    **{
        f'fault.{row.name}_offset': (
            0.5,
            -1.1 * row.largest,
            reads(row, lambda value: value > 0.4),
        )
        for row in SENSORS
    },
    'fault.amplifier_off': (True, 1, has_no_power),
    'fault.dead_foot': (1, 7, goes_another_way),
    'fault.runner_stuck': (True, 'yes', stands_still),
    'fault.missed_steps': (1.0, 1.1, stands_still),
    'fault.command_delay': (5.0, -0.1, is_slow_to_obey),
}


def show(stand: Any, name: str, value: Any) -> None:
    """Set a fault; wait for its bit, and for diagnostics of it that do not wait for the report."""
    operator = stand.operator
    short, seen = name.removeprefix('fault.'), len(operator.diagnostics)
    assert operator.set_parameter(name, value).successful
    operator.spin_until(lambda: bool(operator.status & Status.FAULT), 'the bit')
    operator.spin_until(
        lambda: any(
            parts.keys() == {TITLE} and short in parts[TITLE]
            for parts in operator.diagnostics[seen:]
        ),
        'diagnostics of the faults alone',
    )


def clear(stand: Any) -> None:
    assert stand.operator.trigger('clear_faults').success
    stand.operator.spin_until(lambda: not stand.operator.status & Status.FAULT, 'no fault')


@pytest.mark.parametrize('name', FAULTS)
def test_a_fault_is_refused_shown_at_once_felt_and_cleared(start_drive: Callable, name: str):
    value, bad, is_felt = CASES[name]
    stand = start_drive(FREE)
    assert not stand.operator.set_parameter(name, bad).successful
    show(stand, name, value)
    clear(stand)
    show(stand, name, value)
    is_felt(stand)
    clear(stand)
    assert stand.drive.get_parameter(name).value == specs()[name].default


def test_the_sound_drive_goes_the_way_that_faults_change(start_drive: Callable):
    assert way_of_steps(start_drive(FREE)) > 2.0 * STOOD_M


def test_every_fault_comes_and_goes_by_schedule(start_drive: Callable, tmp_path: Path):
    path = tmp_path / 'faults.yaml'
    entries = [
        {'at': 0.01 * (number + 1), 'set': {name: CASES[name][0]}}
        for number, name in enumerate(FAULTS)
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
    assert told == [{name: CASES[name][0]} for name in FAULTS] + [{}]
    assert operator.requests[-1]['name'] == 'clear_faults'
    operator.spin_until(
        lambda: operator.status == Status.SENSOR_PRESENT | Status.AMPLIFIER_ENABLED, 'health'
    )


@pytest.mark.parametrize('row', SENSORS, ids=lambda row: row.name)
def test_a_frozen_reading_stands_still_until_it_is_cleared(start_drive: Callable, row: Sensor):
    stand = start_drive(FREE)
    heard = stand.operator.listen(row.reading)

    def last() -> set[float]:
        return set(map(reading_of, heard[-STANDING_BLOCKS:]))

    def stands() -> bool:
        return len(heard) >= STANDING_BLOCKS and len(last()) == 1

    stand.operator.spin_until(lambda: len(heard) >= STANDING_BLOCKS, 'readings')
    assert not stands()
    assert stand.operator.set_parameter(f'fault.{row.name}', 'freeze').successful
    stand.operator.spin_until(stands, 'the freeze')
    clear(stand)
    stand.operator.spin_until(lambda: not stands(), 'the noise')


def test_every_fault_has_a_case():
    assert CASES.keys() == set(FAULTS)
