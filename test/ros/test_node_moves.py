"""Moves over topics: steps, voltages, preloads, under every law and profile."""

import itertools
import math
from collections.abc import Callable
from itertools import cycle
from typing import Any

import pytest

from stickslip_ros.instrument.reports import Status
from stickslip_ros.parameters import Parameters, specs
from stickslip_ros.testing import deep_queues

AMPLITUDE_V = 300.0
FREQUENCY_HZ = 1000.0
STEPS = 30
STIFFNESS_N_PER_M = Parameters().load_cell.stiffness
#: Six standard deviations of the load cell's noise behind its low-pass, plus half a digit of the
#: load cell and of the interferometer: 1 uN/sqrt(Hz) over 2 kHz pi/2 is 56 uN.
FORCE_TOLERANCE_N = (
    6.0 * 1e-6 * math.sqrt(2e3 * math.pi / 2.0) + 0.5e-5 + 0.5e-10 * STIFFNESS_N_PER_M
)
#: Blocks in which filters and, with DAMPED, the runner come to rest: over 100 time constants.
SETTLED_BLOCKS = 50
#: Without it the runner rings at 8 kHz, which the load cell cannot follow.
DAMPED = {'runner.damping': 80.0}
MOVING, LOADED, REFUSED = Status.MOVING, Status.LOADED, Status.REFUSED
IDLE = Status.SENSOR_PRESENT | Status.AMPLIFIER_ENABLED


def settle(stand: Any) -> int:
    """Let the runner and the filters come to rest after the last event; give the time, ns."""
    operator = stand.operator
    start_ns = max([operator.time_ns, *(each['time_ns'] for each in operator.events)])
    end_ns = start_ns + SETTLED_BLOCKS * stand.drive.session.parameters.block_ns
    operator.spin_until(lambda: operator.time_ns >= end_ns, 'rest')
    return operator.time_ns


def spin_until_status(stand: Any, status: int) -> None:
    stand.operator.spin_until(lambda: stand.operator.status == IDLE | status, f'status {status}')


def test_a_sawtooth_is_done_after_its_steps_and_has_moved_the_runner(stand: Any):
    stand.operator.command('sawtooth', (AMPLITUDE_V, FREQUENCY_HZ, STEPS))
    event = stand.operator.wait_for_event('sawtooth', 0)
    assert (event['result'], event['steps'], event['number']) == ('DONE', STEPS, 1)
    assert event['message'] == ''
    assert stand.operator.positions[settle(stand)] > 100e-9


def test_a_sawtooth_takes_steps_over_frequency(stand: Any):
    operator, session = stand.operator, stand.drive.session
    assert operator.switch('set_paused', wanted=True).success
    operator.command('sawtooth', (AMPLITUDE_V, FREQUENCY_HZ, STEPS))
    operator.command('load', 0.0)  # its event tells when both have begun
    operator.spin_until(lambda: len(list(session._orders)) == 2, 'both commands')
    assert operator.switch('set_paused', wanted=False).success
    done_ns = operator.wait_for_event('sawtooth', 0)['time_ns']
    begun_ns = operator.wait_for_event('load', 0)['time_ns']
    whole_ns = round(STEPS / FREQUENCY_HZ * 1e9)
    last_fall_ns = session.parameters.block_ns  # in the update in which it has settled
    assert done_ns - begun_ns == whole_ns + last_fall_ns


def test_a_negative_frequency_moves_the_runner_backwards(start_drive: Callable):
    stand = start_drive({'amplifier.voltage_initial': AMPLITUDE_V})
    stand.operator.command('sawtooth', (AMPLITUDE_V, -FREQUENCY_HZ, STEPS))
    assert stand.operator.wait_for_event('sawtooth', 0)['steps'] == STEPS
    assert stand.operator.positions[settle(stand)] < -100e-9


def test_force_is_stiffness_times_position_within_the_noise(start_drive: Callable):
    stand = start_drive({**DAMPED, **deep_queues('position', 'force')})
    heard = stand.operator.listen('force')
    stand.operator.command('sawtooth', (AMPLITUDE_V, FREQUENCY_HZ, STEPS))
    stand.operator.wait_for_event('sawtooth', 0)
    first_ns = settle(stand)
    last_ns = settle(stand)
    forces = {stand.operator.simulated_ns(each): each.wrench.force.x for each in heard}
    both = [t for t in forces if first_ns <= t <= last_ns and t in stand.operator.positions]
    assert len(both) > SETTLED_BLOCKS // 2
    for time_ns in both:
        expected_n = STIFFNESS_N_PER_M * stand.operator.positions[time_ns]
        assert forces[time_ns] == pytest.approx(expected_n, abs=FORCE_TOLERANCE_N)


def test_a_voltage_is_reached_and_held(stand: Any):
    heard = stand.operator.listen('voltage')
    stand.operator.command('voltage', 123.0)
    event = stand.operator.wait_for_event('voltage', 0)
    assert (event['result'], event['steps']) == ('DONE', 0)
    stand.operator.spin_until(lambda: bool(heard) and heard[-1].data == 123.0, 'the voltage')
    heard.clear()
    stand.operator.spin_until(lambda: len(heard) >= 3, 'three voltages')
    assert {each.data for each in heard} == {123.0}


def test_a_slow_amplifier_is_still_moving_when_a_voltage_is_on_its_way(
    start_drive: Callable,
):
    stand = start_drive({**deep_queues('voltage'), 'amplifier.slew_rate': 5000.0})
    heard = stand.operator.listen('voltage')
    stand.operator.command('voltage', AMPLITUDE_V)
    event = stand.operator.wait_for_event('voltage', 0)
    assert event['result'] == 'DONE'
    stand.operator.spin_until(lambda: bool(heard) and heard[-1].data == AMPLITUDE_V, 'the voltage')
    seen = [each.data for each in heard]
    ramp = [value for value in seen if 0.0 < value < AMPLITUDE_V]
    period_s = stand.drive.session.parameters.trace.period
    assert len(ramp) >= 4
    assert ramp == sorted(ramp)
    steps = [b - a for a, b in itertools.pairwise(ramp)]
    assert steps == pytest.approx([5000.0 * period_s] * len(steps))


def test_a_load_moves_the_runner_by_less_than_the_load_cell_alone_would_give(
    start_drive: Callable,
):
    stand = start_drive(DAMPED)
    start_m = stand.operator.positions[settle(stand)]
    stand.operator.command('load', 0.1)
    assert stand.operator.wait_for_event('load', 0)['result'] == 'DONE'
    moved_m = stand.operator.positions[settle(stand)] - start_m
    assert 1e-9 < moved_m < 0.1 / STIFFNESS_N_PER_M


def test_a_load_does_not_end_a_running_move(stand: Any):
    stand.operator.command('sawtooth', (AMPLITUDE_V, FREQUENCY_HZ, 0.0))
    spin_until_status(stand, MOVING)
    stand.operator.command('load', 0.1)
    stand.operator.wait_for_event('load', 0)
    spin_until_status(stand, MOVING | LOADED)
    assert [each['command'] for each in stand.operator.events] == ['load']


def test_stop_aborts_with_the_steps_made_and_holds_the_voltage(stand: Any):
    trace = stand.operator.listen('trace')
    stand.operator.command('sawtooth', (AMPLITUDE_V, 40.0, 0.0))
    stand.operator.spin_until(
        lambda: bool(trace) and stand.drive.session.bench.state.clock.cycle >= 3, 'three steps'
    )
    answer = stand.operator.trigger('stop')
    event = stand.operator.wait_for_event('sawtooth', 0)
    assert answer.success
    assert event['result'] == 'ABORTED'
    assert event['message'] == 'stopped by command 2'
    assert event['steps'] >= 3
    assert stand.operator.wait_for_event('stop', 0)['result'] == 'DONE'
    held_v = stand.drive.session.bench.state.voltage_v
    settle(stand)
    stand.operator.spin_until(lambda: trace[-1].data[-4] == held_v, 'the held voltage')
    assert 0.0 < held_v < AMPLITUDE_V


def test_stop_without_a_move_is_done_and_aborts_nothing(stand: Any):
    assert stand.operator.trigger('stop').success
    stand.operator.wait_for_event('stop', 0)
    assert [(e['command'], e['result']) for e in stand.operator.events] == [('stop', 'DONE')]


def test_a_move_that_is_replaced_says_aborted_and_by_which(stand: Any):
    stand.operator.command('sawtooth', (AMPLITUDE_V, FREQUENCY_HZ, 0.0))
    spin_until_status(stand, MOVING)
    stand.operator.command('voltage', 50.0)
    aborted = stand.operator.wait_for_event('sawtooth', 0)
    done = stand.operator.wait_for_event('voltage', 0)
    assert (aborted['result'], aborted['message']) == ('ABORTED', 'replaced by command 2')
    assert (done['result'], done['number']) == ('DONE', 2)
    assert aborted['steps'] > 0
    assert aborted['number'] == 1


def test_reset_puts_everything_back_but_time(stand: Any):
    stand.operator.command('load', 0.5)
    stand.operator.command('sawtooth', (AMPLITUDE_V, FREQUENCY_HZ, 0.0))
    spin_until_status(stand, MOVING | LOADED)
    before_ns = stand.operator.time_ns
    assert stand.operator.trigger('reset').success
    aborted = stand.operator.wait_for_event('sawtooth', 0)
    reset = stand.operator.wait_for_event('reset', 0)
    assert (aborted['result'], aborted['message']) == ('ABORTED', 'reset by command 3')
    assert reset['time_ns'] >= before_ns
    spin_until_status(stand, 0)
    state = stand.drive.session.bench.state
    assert (state.position_m, state.voltage_v) == (0.0, 0.0)
    assert abs(stand.operator.positions[settle(stand)]) < 1e-9


def test_status_bits_follow_what_happens(stand: Any):
    heard = stand.operator.listen('status')
    stand.operator.spin_until(lambda: bool(heard), 'the first status')
    spin_until_status(stand, 0)
    stand.operator.command('load', 0.1)
    spin_until_status(stand, LOADED)
    stand.operator.command('voltage', 1e6)
    spin_until_status(stand, LOADED | REFUSED)
    stand.operator.command('sawtooth', (AMPLITUDE_V, FREQUENCY_HZ, 0.0))
    spin_until_status(stand, LOADED | MOVING)
    stand.operator.trigger('stop')
    spin_until_status(stand, LOADED)
    stand.operator.command('load', 0.0)
    spin_until_status(stand, 0)
    stand.operator.spin_until(lambda: heard[-1].data == IDLE, 'the last status')
    assert [each.data - IDLE for each in heard] == [
        0,
        LOADED,
        LOADED | REFUSED,
        LOADED | MOVING,
        LOADED,
        0,
    ]


PRELOAD_N = 0.8
LAWS, PROFILES = (specs()[f'contact.{name}'].choices for name in ('law', 'profile'))
BURST = (300.0, 1000.0, 50.0)


def test_a_preload_command_is_carried_out_at_its_rate_and_told_by_status_and_event(
    start_drive: Callable,
):
    stand = start_drive({'stand.preload': 0.5, 'stand.preload_rate': 0.6})
    stand.operator.command('preload', PRELOAD_N)
    stand.operator.spin_until(
        lambda: stand.operator.status == IDLE | Status.PRELOADING, 'the preloading bit'
    )
    event = stand.operator.wait_for_event('preload', 0)
    assert event['result'] == 'DONE'
    stand.operator.spin_until(lambda: stand.operator.status == IDLE, 'the end of the preloading')
    assert stand.drive.session.bench.state.preload_n == PRELOAD_N


def test_a_second_preload_command_replaces_the_first(start_drive: Callable):
    stand = start_drive({'stand.preload': 0.5, 'stand.preload_rate': 0.2})
    stand.operator.command('preload', PRELOAD_N)
    stand.operator.spin_until(
        lambda: stand.operator.status == IDLE | Status.PRELOADING, 'the preloading bit'
    )
    stand.operator.command('preload', 0.45)
    event = stand.operator.wait_for_event('preload', 0)
    assert (event['result'], event['number']) == ('DONE', 2)
    assert stand.drive.session.bench.replaced == 1


@pytest.mark.parametrize(
    ('law', 'profile'),
    list(zip(LAWS, cycle(PROFILES), strict=False)),
)
def test_the_node_steps_with_every_law_and_every_profile(
    start_drive: Callable, law: str, profile: str
):
    stand = start_drive({'contact.law': law, 'contact.profile': profile, 'stand.preload': 0.1})
    stand.operator.command('sawtooth', BURST)
    event = stand.operator.wait_for_event('sawtooth', 0)
    assert (event['result'], event['steps']) == ('DONE', BURST[2])
    # Ten times the stroke: every law steps at this preload.
    assert stand.drive.session.bench.state.position_m > 3e-7
