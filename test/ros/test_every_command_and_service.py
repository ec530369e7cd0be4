"""Every command of docs/interface.md is obeyed and refused; every service acts and is refused."""

import math
from collections.abc import Callable, Mapping
from typing import Any

import pytest

from stickslip_ros.instrument.reports import Status
from stickslip_ros.recording.topics import COMMANDS, READINGS, SERVICES

LOCKSTEP = {'sim.lockstep': True}
BLOCK_S = 1e-3
GOOD: Mapping[str, Any] = {
    'voltage': 100.0,
    'sawtooth': (300.0, 1000.0, 5.0),
    'steps': -5,
    'jog': 0.0,
    'waveform': ((0.0, 0.0), (0.005, 100.0)),
    'position': 10e-9,
    'load': -0.1,
    'preload': 0.502,
    'grant': (2 * BLOCK_S, 1.0),
}
BAD: Mapping[str, Any] = {
    'voltage': 301.0,
    'sawtooth': (300.0, 0.0, 5.0),
    'steps': -(2**31),
    'jog': math.nan,
    'waveform': ((0.0, 0.0), (0.0, 100.0)),
    'position': math.inf,
    'load': 11.0,
    'preload': 0.0,
    'grant': (-1.0, 0.0),
}
NAMES = [topic.request for topic in COMMANDS]
MOVED = [name for name in NAMES if name != 'grant']


@pytest.mark.parametrize('name', MOVED)
def test_a_bad_command_is_refused_and_the_next_good_one_is_carried_out(
    start_drive: Callable, name: str
):
    stand = start_drive({'load_cell.contact': 'absent', 'runner.damping': 5.0})
    operator = stand.operator
    operator.command(name, BAD[name])
    refused = operator.wait_for_event(name, 0)
    assert (refused['number'], refused['result']) == (1, 'INVALID_PARAMETER')
    assert '; ' in refused['message']  # what is wrong; the mend
    operator.spin_until(lambda: bool(operator.status & Status.REFUSED), 'the refusal')
    operator.command(name, GOOD[name])
    done = operator.wait_for_event(name, 1)
    assert (done['number'], done['result']) == (2, 'DONE')
    operator.spin_until(lambda: not operator.status & Status.REFUSED, 'the good command')


def test_a_bad_grant_is_refused_and_the_next_good_one_is_carried_out(
    start_drive: Callable,
):
    stand = start_drive(LOCKSTEP, wait=False)
    operator = stand.operator
    operator.wait_for_topics()
    operator.command('grant', BAD['grant'])
    operator.command('voltage', 1.0)
    operator.command('grant', GOOD['grant'])
    event = operator.wait_for_event('voltage', 0)
    operator.spin_until(lambda: max(operator.positions, default=0) == 2_000_000, 'two blocks')
    assert event['result'] == 'DONE'
    assert stand.drive._refusals.messages == 1


def test_every_command_has_a_good_and_a_bad_value():
    assert GOOD.keys() == BAD.keys() == set(NAMES)


def still(stand: Any, name: str) -> None:
    """Do what a service without a better witness is known by: its event."""
    event = stand.operator.wait_for_event(name, 0)
    assert event['result'] == 'DONE'


def stopped(stand: Any, name: str) -> None:
    still(stand, name)
    assert stand.operator.wait_for_event('sawtooth', 0)['result'] == 'ABORTED'


def unloaded(stand: Any, name: str) -> None:
    still(stand, name)
    stand.operator.spin_until(lambda: not stand.operator.status & Status.LOADED, 'no load')


def referenced(stand: Any, name: str) -> None:
    still(stand, name)
    stand.operator.spin_until(
        lambda: bool(stand.operator.status & Status.IS_REFERENCED), 'the reference'
    )


def tared(stand: Any, name: str) -> None:
    still(stand, name)
    forces = stand.operator.listen('force')
    stand.operator.spin_until(lambda: bool(forces), 'a force')
    assert abs(forces[-1].wrench.force.x) < 0.5


def powerless(stand: Any, name: str) -> None:
    still(stand, name)
    stand.operator.spin_until(
        lambda: not stand.operator.status & Status.AMPLIFIER_ENABLED, 'no power'
    )


def sound(stand: Any, name: str) -> None:
    still(stand, name)
    stand.operator.spin_until(lambda: not stand.operator.status & Status.FAULT, 'no fault')


def held(stand: Any, name: str) -> None:
    time_ns = stand.drive.session.bench.time_ns
    assert stand.operator.trigger('step_simulation').success
    assert stand.drive.session.bench.time_ns == time_ns + 1_000_000


def recorded(stand: Any, name: str) -> None:
    assert stand.drive.session.worker.writer is not None


WITNESSES: Mapping[str, Callable[[Any, str], None]] = {
    'stop': stopped,
    'reset': unloaded,
    'zero_position': referenced,
    'tare_force': tared,
    'enable_amplifier': powerless,
    'set_paused': held,
    'step_simulation': held,
    'clear_faults': sound,
    'set_recording': recorded,
}
SERVICE_NAMES = [service.name.removeprefix('~/') for service in SERVICES]
SWITCHED = {'enable_amplifier': False, 'set_paused': True, 'set_recording': True}
"""Switches, and the side that is not that of the start."""


def call(stand: Any, name: str) -> Any:
    if name in SWITCHED:
        return stand.operator.switch(name, SWITCHED[name])
    return stand.operator.trigger(name)


@pytest.mark.parametrize('name', SERVICE_NAMES)
def test_a_service_does_what_it_is_for(start_drive: Callable, name: str):
    stand = start_drive({'fault.load_cell_offset': 1.0})
    operator = stand.operator
    operator.command('load', 0.1)
    operator.command('sawtooth', (300.0, 1000.0, 0.0))
    busy = Status.MOVING | Status.LOADED | Status.FAULT
    operator.spin_until(lambda: operator.status & busy == busy, 'a busy drive')
    if name == 'step_simulation':
        assert operator.switch('set_paused', wanted=True).success
    answer = call(stand, name)
    assert answer.success, answer.message
    WITNESSES[name](stand, name)


def test_every_service_of_an_inactive_drive_is_refused_with_its_state(manual: Any):
    manual.operator.change_state('configure')
    why = 'refused: the node is inactive, not active; activate it first'
    for name in SERVICE_NAMES:
        answer = call(manual, name)
        assert (answer.success, answer.message) == (False, f'{name} {why}')


def test_a_step_of_a_drive_that_runs_is_refused(stand: Any):
    answer = stand.operator.trigger('step_simulation')
    assert not answer.success
    assert 'simulated time runs' in answer.message


def test_every_service_has_its_witness():
    assert WITNESSES.keys() == set(SERVICE_NAMES)


def test_every_published_topic_is_heard(start_drive: Callable):
    stand = start_drive({'sim.publish_truth': True, 'sim.publish_clock': True})
    operator = stand.operator
    assert operator.trigger('stop').success
    operator.spin_until(
        lambda: all(operator.received[topic.key] for topic in READINGS), 'every topic'
    )
