"""Services are carried out, answered and noted; outside the active state they are refused."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from stickslip_ros.instrument.reports import Status
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.topics import SERVICES

SWITCHES = [
    service.name.removeprefix('~/') for service in SERVICES if service.type_name.endswith('Bool')
]
#: Time in which the damped runner comes to rest: over 100 time constants.
SETTLED_NS = 50_000_000
NOTED = (
    ('stop', None),
    ('zero_position', None),
    ('tare_force', None),
    ('enable_amplifier', True),
    ('clear_faults', None),
    ('reset', None),
)


def call(stand: Any, name: str, wanted: bool | None) -> Any:
    """Call a service: a switch if there is something to switch."""
    if wanted is None:
        return stand.operator.trigger(name)
    return stand.operator.switch(name, wanted)


def test_the_amplifier_is_switched_off_and_on(stand: Any):
    operator = stand.operator
    assert operator.switch('enable_amplifier', wanted=False).success
    operator.spin_until(lambda: not operator.status & Status.AMPLIFIER_ENABLED, 'the bit')
    operator.command('voltage', 100.0)
    assert operator.wait_for_event('voltage', 0)['result'] == 'AMPLIFIER_DISABLED'
    seen = len(operator.events)
    assert operator.switch('enable_amplifier', wanted=True).success
    operator.command('voltage', 100.0)
    assert operator.wait_for_event('voltage', seen)['result'] == 'DONE'


def test_a_zeroed_position_reads_zero_and_is_referenced(
    start_drive: Callable, perfect_sensors: dict[str, float]
):
    stand = start_drive({**perfect_sensors, 'runner.damping': 80.0})
    operator = stand.operator
    operator.command('load', 0.1)
    settled_ns = operator.wait_for_event('load', 0)['time_ns'] + SETTLED_NS
    operator.spin_until(lambda: max(operator.positions) > settled_ns, 'rest')
    assert operator.positions[max(operator.positions)] > 1e-9
    assert operator.trigger('zero_position').success
    done_ns = operator.wait_for_event('zero_position', 0)['time_ns']
    operator.spin_until(lambda: max(operator.positions) > done_ns, 'a position')
    assert abs(operator.positions[max(operator.positions)]) < 1e-10
    assert operator.status & Status.IS_REFERENCED


def test_a_tared_force_reads_zero(start_drive: Callable, perfect_sensors: dict[str, float]):
    stand = start_drive({**perfect_sensors, 'runner.damping': 80.0})
    operator, forces = stand.operator, stand.operator.listen('force')
    operator.command('load', 0.1)
    settled_ns = operator.wait_for_event('load', 0)['time_ns'] + SETTLED_NS
    operator.spin_until(lambda: max(operator.positions) > settled_ns, 'rest')
    operator.spin_until(lambda: bool(forces) and forces[-1].wrench.force.x > 1e-4, 'a force')
    assert operator.trigger('tare_force').success
    operator.spin_until(lambda: abs(forces[-1].wrench.force.x) < 1e-5, 'no force')


def test_what_came_by_service_is_noted_on_the_topic_and_in_the_file_at_its_time(stand: Any):
    operator = stand.operator
    path = operator.set_recording(wanted=True).message
    for name, wanted in NOTED:
        assert call(stand, name, wanted).success
    operator.set_recording(wanted=False)
    names = [name for name, _ in NOTED]
    operator.spin_until(lambda: len(operator.requests) == len(NOTED), 'the notes')
    assert [each['name'] for each in operator.requests] == names
    assert operator.requests[3] == {'name': 'enable_amplifier', 'values': [1.0], 'settings': {}}
    told = [
        (time_ns, json.loads(message))
        for topic, time_ns, message in Recording(Path(path)).messages()
        if topic == '/stickslip_drive/request'
    ]
    assert [note for _, note in told] == operator.requests
    done_ns = {event['command']: event['time_ns'] for event in operator.events}
    assert [time_ns for time_ns, _ in told] == [done_ns[name] for name in names]


def test_a_command_of_a_topic_is_not_noted_a_second_time(stand: Any):
    operator = stand.operator
    operator.command('voltage', 10.0)
    operator.wait_for_event('voltage', 0)
    operator.trigger('stop')
    operator.spin_until(lambda: bool(operator.requests), 'the note')
    assert [each['name'] for each in operator.requests] == ['stop']


@pytest.mark.parametrize('name', SWITCHES)
@pytest.mark.parametrize('wanted', [True, False])
def test_a_switch_of_an_inactive_drive_is_refused_with_its_state(
    manual: Any, name: str, wanted: bool
):
    manual.operator.change_state('configure')
    answer = manual.operator.switch(name, wanted)
    assert not answer.success
    assert answer.message == (
        f'{name} refused: the node is inactive, not active; activate it first'
    )


def test_what_an_inactive_drive_refuses_is_counted_and_told_once_as_news(manual: Any):
    operator = manual.operator
    manual.operator.change_state('configure')
    operator.wait_for_topics()
    operator.command('voltage', 10.0)
    assert not operator.trigger('stop').success
    heard = manual.operator.listen('diagnostics')
    manual.operator.change_state('activate')
    reports: list[Any] = []

    def look() -> bool:
        reports[:] = [
            part for array in heard for part in array.status if part.name.endswith(': drive')
        ]
        return len(reports) >= 2

    operator.spin_until(look, 'two reports')
    assert [part.message for part in reports[:2]] == [
        '2 refused since the last report',
        'running',
    ]
    assert {pair.key: pair.value for pair in reports[1].values}['messages_refused'] == '2'
