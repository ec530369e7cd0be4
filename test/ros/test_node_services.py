# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Services act, are answered and noted; outside the active state they are refused."""

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest
from reports import Reports, values_of
from wrong_checkpoints import with_value

from stickslip_ros.instrument.bench import Bench
from stickslip_ros.instrument.reports import Status
from stickslip_ros.interface.topics import SERVICES
from stickslip_ros.lab.runs.replay import replay
from stickslip_ros.parameters import Parameters
from stickslip_ros.recording.reader import Recording


def still(stand: Any, name: str) -> None:
    """Do what a service without a better witness is known by: its event."""
    event = stand.operator.wait_for_event(name, 0)
    assert event['result'] == 'DONE'


def stopped(stand: Any, name: str) -> None:
    still(stand, name)
    assert stand.operator.wait_for_event('sawtooth', 0)['result'] == 'ABORTED'


def tared(stand: Any, name: str) -> None:
    still(stand, name)
    forces = stand.operator.listen('force')
    stand.operator.spin_until(lambda: bool(forces), 'a force')
    assert abs(forces[-1].wrench.force.x) < 0.5


def told_by(bit: Status, *, is_set: bool = False) -> Callable[[Any, str], None]:
    """Give a witness that waits for a bit of the status."""

    def wait(stand: Any, name: str) -> None:
        still(stand, name)
        stand.operator.spin_until(lambda: bool(stand.operator.status & bit) == is_set, bit.name)

    return wait


def held(stand: Any, name: str) -> None:
    time_ns = stand.drive.session.bench.time_ns
    assert stand.operator.trigger('step_simulation').success
    assert stand.drive.session.bench.time_ns == time_ns + 1_000_000


def saved(stand: Any, name: str) -> None:
    folder = stand.drive.session.parameters.record.directory
    [path] = Path(folder).glob('checkpoint_*.bin')
    assert Bench.restore(path.read_bytes()).time_ns > 0


def recorded(stand: Any, name: str) -> None:
    assert stand.drive.session.worker.writer is not None


WITNESSES: Mapping[str, Callable[[Any, str], None]] = {
    'stop': stopped,
    'reset': told_by(Status.LOADED),
    'zero_position': told_by(Status.IS_REFERENCED, is_set=True),
    'tare_force': tared,
    'enable_amplifier': told_by(Status.AMPLIFIER_ENABLED),
    'set_paused': held,
    'step_simulation': held,
    'clear_faults': told_by(Status.FAULT),
    'save_checkpoint': saved,
    'set_recording': recorded,
}
SERVICE_NAMES = [service.name.removeprefix('~/') for service in SERVICES]
SWITCHED = {'enable_amplifier': False, 'set_paused': True, 'set_recording': True}
"""Switches, and the side that is not that of the start."""


def call(stand: Any, name: str, wanted: bool | None = None) -> Any:
    if name in SWITCHED:
        return stand.operator.switch(name, SWITCHED[name] if wanted is None else wanted)
    return stand.operator.trigger(name)


@pytest.mark.usefixtures('default_blocks')
def test_each_service_does_what_it_is_for(stand: Any):
    assert WITNESSES.keys() == set(SERVICE_NAMES)
    operator, busy = stand.operator, Status.MOVING | Status.LOADED | Status.FAULT
    for name in SERVICE_NAMES:
        assert operator.set_parameter('fault.load_cell_offset', 1.0).successful
        operator.command('load', 0.1)
        operator.command('sawtooth', (300.0, 1000.0, 0.0))
        operator.spin_until(lambda: operator.status & busy == busy, 'a busy drive')
        if name == 'step_simulation':
            assert operator.switch('set_paused', wanted=True).success
        answer = call(stand, name)
        assert answer.success, answer.message
        WITNESSES[name](stand, name)
        for switch in (name, 'set_paused', 'enable_amplifier'):
            if switch in SWITCHED:
                operator.switch(switch, not SWITCHED[switch])


def test_every_service_of_an_inactive_drive_is_refused_with_its_state(manual: Any):
    manual.operator.change_state('configure')
    why = 'refused: the node is inactive, not active; activate it first'
    for name in SERVICE_NAMES:
        answer = call(manual, name)
        assert (answer.success, answer.message) == (False, f'{name} {why}')


NOTED = 'stop', 'zero_position', 'tare_force', 'enable_amplifier', 'clear_faults', 'reset'


def test_what_came_by_service_is_noted_on_the_topic_and_in_the_file_at_its_time(stand: Any):
    operator = stand.operator
    path = operator.set_recording(wanted=True).message
    for name in NOTED:
        assert call(stand, name, wanted=True).success
    operator.set_recording(wanted=False)
    operator.spin_until(lambda: len(operator.requests) == len(NOTED), 'the notes')
    assert [each['name'] for each in operator.requests] == [*NOTED]
    assert operator.requests[3] == {'name': 'enable_amplifier', 'values': [1.0], 'settings': {}}
    told = [
        (time_ns, json.loads(str(message)))
        for topic, time_ns, message in Recording(Path(path)).messages()
        if topic == '/stickslip_drive/request'
    ]
    assert [note for _, note in told] == operator.requests
    done_ns = {event['command']: event['time_ns'] for event in operator.events}
    assert [time_ns for time_ns, _ in told] == [done_ns[name] for name in NOTED]


def test_what_an_inactive_drive_refuses_is_counted_and_told_once_as_news(manual: Any):
    operator = manual.operator
    manual.operator.change_state('configure')
    operator.wait_for_topics()
    operator.command('voltage', 10.0)
    assert not operator.trigger('stop').success
    reports = Reports(manual)
    operator.shake_hands()  # the first report is heard
    manual.operator.change_state('activate')

    def of_a_drive_that_runs() -> list[Any]:
        return [part for part in reports.parts('drive') if part.values]

    operator.spin_until(lambda: len(of_a_drive_that_runs()) >= 2, 'two reports')
    first, second, *_ = of_a_drive_that_runs()
    assert (first.message, second.message) == ('2 refused since the last report', 'running')
    assert values_of(second)['messages_refused'] == '2'


@pytest.mark.usefixtures('default_blocks')
def test_a_drive_starts_where_another_one_was_saved(start_drive: Callable, tmp_path: Path):
    first = start_drive({'stand.preload': 0.37, 'sim.lockstep': False})
    first.operator.command('sawtooth', (113.76725643485543, 1153.3955451232346, 0.0))
    first.operator.spin_until(lambda: bool(first.operator.status & Status.MOVING), 'steps')
    path = first.operator.trigger('save_checkpoint').message
    first.close()
    saved = Bench.restore(Path(path).read_bytes())
    values = {'stand.preload': 0.37, 'sim.checkpoint': path, 'record.on_start': True}
    second = start_drive({**values, 'record.name': 'second'})
    second.operator.spin_for(0.03)
    second.close()
    recording = Recording(tmp_path / 'second.mcap')
    assert recording.series('position').time_s[0] == pytest.approx(saved.time_ns * 1e-9 + 1e-3)
    block = saved.update(saved.time_ns + saved.parameters.block_ns)
    assert recording.series('position').value[0] == block.readings.position_m
    assert block.status & Status.MOVING
    assert replay(tmp_path / 'second.mcap', tmp_path / 'again.mcap').identical


@pytest.mark.usefixtures('default_blocks')
def test_a_checkpoint_of_another_stand_or_of_no_possible_state_is_refused(
    start_drive: Callable, tmp_path: Path, capfd: pytest.CaptureFixture[str]
):
    path, saved = tmp_path / 'saved.bin', Bench(Parameters()).save()
    path.write_bytes(saved)
    values = {'autostart': False, 'sim.checkpoint': str(path)}
    stand = start_drive({**values, 'stand.preload': 0.37}, wait=False)
    assert not stand.operator.change_state('configure')
    assert 'stand.preload 0.37 is not 0.5, as in the checkpoint' in capfd.readouterr().err
    assert stand.operator.set_parameter('stand.preload', 0.5).successful
    path.write_bytes(with_value(saved, 'state.stand.states.contacts[0].memory.depth', 100_000))
    assert not stand.operator.change_state('configure')
    assert 'memory.depth 100000' in capfd.readouterr().err
    path.write_bytes(saved)
    assert stand.operator.change_state('configure')
