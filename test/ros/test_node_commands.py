"""Every command topic is obeyed, and refused with an event; steps, jogging, waveforms, targets."""

import math
from collections.abc import Callable, Mapping
from typing import Any

import pytest
from geometry_msgs.msg import PointStamped
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray, MultiArrayDimension

from stickslip_ros.instrument.reports import Status
from stickslip_ros.interface.topics import COMMAND_TOPICS
from stickslip_ros.ros.client import LockstepClient

LOCKSTEP = {'sim.lockstep': True}
BLOCK_S = 1e-3
GOOD: Mapping[str, Any] = {
    'voltage': 100.0,
    'sawtooth': (300.0, 1000.0, 5.0),
    'steps': -5,
    'jog': 0.0,
    'waveform': ((0.0, 0.0), (0.005, 100.0)),
    'position': 10e-9,
    'joint': 10e-9,
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
    'joint': math.inf,
    'load': 11.0,
    'preload': 0.0,
    'grant': (-1.0, 0.0),
}
NAMES = [topic.request for topic in COMMAND_TOPICS]
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
    assert '; ' in refused['message']  # what is wrong; the hint
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
    operator.spin_until(lambda: operator.time_ns == 2_000_000, 'two blocks')
    assert event['result'] == 'DONE'
    assert stand.drive._refusals.messages == 1


def test_every_command_has_a_good_and_a_bad_value():
    assert GOOD.keys() == BAD.keys() == set(NAMES)


STEPS = 12
FAST_JOG_HZ = 500.0
NAN = math.nan


def test_steps_are_counted_and_their_sign_is_the_direction(start_drive: Callable):
    stand = start_drive({'amplifier.voltage_initial': 300.0})
    operator = stand.operator
    for number, steps in enumerate((STEPS, -2 * STEPS)):
        before_m = stand.drive.session.bench.state.position_m
        operator.command('steps', steps)
        event = operator.wait_for_event('steps', number)
        assert (event['result'], event['steps']) == ('DONE', abs(steps))
        moved_m = stand.drive.session.bench.state.position_m - before_m
        assert math.copysign(1.0, moved_m) == math.copysign(1.0, steps)


def test_no_step_is_done_at_once(stand: Any):
    stand.operator.command('steps', 0)
    event = stand.operator.wait_for_event('steps', 0)
    assert (event['result'], event['steps']) == ('DONE', 0)


def test_jogging_goes_on_while_it_is_asked_for_and_ends_with_zero(stand: Any):
    operator = stand.operator
    operator.command('jog', FAST_JOG_HZ)
    operator.spin_until(lambda: stand.drive.session.bench.state.clock.cycle >= 3, 'three steps')
    assert operator.events == []
    operator.command('jog', 0.0)
    event = operator.wait_for_event('jog', 0)
    assert event['steps'] >= 3


def test_jogging_ends_when_its_watchdog_hears_nothing(start_drive: Callable):
    stand = start_drive({'jog.timeout': 0.05})
    stand.operator.command('jog', FAST_JOG_HZ)
    event = stand.operator.wait_for_event('jog', 0)
    assert event['message'].startswith('jog.timeout passed')
    assert event['steps'] == pytest.approx(0.05 * FAST_JOG_HZ, abs=1)
    stand.operator.spin_until(lambda: not stand.operator.status & Status.MOVING, 'its end')


def test_a_waveform_is_played_once_to_its_last_voltage(stand: Any):
    stand.operator.command('waveform', ((0.0, 0.0), (0.01, 100.0), (0.02, 40.0)))
    event = stand.operator.wait_for_event('waveform', 0)
    assert event['result'] == 'DONE'
    assert stand.drive.session.bench.state.voltage_v == pytest.approx(40.0)


def test_a_waveform_repeats_over_topics_until_the_next_at_the_end_of_a_cycle(stand: Any):
    operator, bench = stand.operator, stand.drive.session.bench
    hill = ((0.0, 0.0), (0.01, 100.0), (0.0137, 0.0))
    operator.command('waveform', hill, cycles=0)
    operator.spin_until(lambda: operator.status & Status.STREAMING, 'the waveform')
    later_ns = bench.time_ns + 100_000_000
    operator.spin_until(lambda: bench.time_ns > later_ns, 'seven cycles')
    operator.command('waveform', ((0.0, 0.0), (0.003, 40.0)))
    first, last = (operator.wait_for_event('waveform', n) for n in range(2))
    assert (first['result'], last['result']) == ('ABORTED', 'DONE')
    assert first['steps'] >= 7
    assert bench.state.voltage_v == pytest.approx(40.0)


def test_a_target_is_reached_in_closed_loop(start_drive: Callable):
    stand = start_drive({'load_cell.contact': 'absent'})
    stand.operator.command('position', 1e-6)
    event = stand.operator.wait_for_event('position', 0)
    assert event['result'] == 'DONE'
    operator = stand.operator
    operator.spin_until(lambda: operator.time_ns >= event['time_ns'], 'a position')
    assert operator.positions[operator.time_ns] == pytest.approx(
        1e-6, abs=2.0 * stand.drive.session.parameters.closed_loop.tolerance
    )


FREE_RUNNER = {'load_cell.contact': 'absent', 'runner.damping': 5.0}
VELOCITY_M_PER_S = 2e-5


def test_a_joint_follows_a_velocity_as_long_as_it_comes(start_drive: Callable):
    stand = start_drive({**FREE_RUNNER, 'sim.lockstep': True}, wait=False)
    positions_m: list[float] = []

    def on_position(_: float, position_m: float) -> list[tuple[str, Any]]:
        positions_m.append(position_m)
        goes_on = len(positions_m) < 200 and len(positions_m) % 10 == 0
        return [('joint', (NAN, VELOCITY_M_PER_S))] if goes_on else []

    client = LockstepClient(stand.operator.node, BLOCK_S, on_position)
    event = stand.operator.wait_for_event('joint', 0)
    assert positions_m[199] - positions_m[99] == pytest.approx(0.1 * VELOCITY_M_PER_S, rel=0.2)
    assert (event['result'], event['time_ns']) == ('DONE', 690_000_000)  # jog.timeout
    client.close()


def test_joints_whose_arrays_have_other_sizes_are_refused_with_an_event(stand: Any):
    stand.operator.send('joint', JointState(name=['arm', 'runner_joint'], position=[1e-6]))
    event = stand.operator.wait_for_event('joint', 0)
    assert event['result'] == 'INVALID_PARAMETER'
    assert event['message'].startswith('joint position [1e-06] is not a list of 2 numbers; give')


def bad_rows() -> Float64MultiArray:
    """Give an odd number of numbers."""
    return Float64MultiArray(data=[0.0, 1.0, 2.0])


def bad_target(x_m: float, y_m: float, frame_id: str = '') -> PointStamped:
    message = PointStamped()
    message.header.frame_id = frame_id
    message.point.x, message.point.y = x_m, y_m
    return message


@pytest.mark.parametrize(
    ('name', 'message'),
    [
        ('jog', 1e6),
        ('waveform', bad_rows()),
        ('position', bad_target(0.0, 1e-9)),
        ('position', bad_target(0.0, 0.0, 'camera')),
    ],
)
def test_a_bad_command_is_refused_with_an_event(stand: Any, name: str, message: Any):
    if isinstance(message, float):
        stand.operator.command(name, message)
    else:
        stand.operator.send(name, message)
    event = stand.operator.wait_for_event(name, 0)
    assert event['result'] == 'INVALID_PARAMETER'
    assert len(event['message']) > 20


def test_a_waveform_with_a_layout_of_other_columns_is_refused_and_counted(stand: Any):
    operator = stand.operator
    message = Float64MultiArray(data=[0.0] * 6)
    message.layout.dim = [MultiArrayDimension(size=2), MultiArrayDimension(size=3)]
    operator.send('waveform', message)
    title = 'stickslip_drive: drive'
    operator.spin_until(
        lambda: (
            bool(operator.diagnostics)
            and operator.diagnostics[-1].get(title, {}).get('messages_refused') == '1'
        ),
        'the refusal',
    )
    assert operator.events == []
    operator.command('voltage', 10.0)
    assert operator.wait_for_event('voltage', 0)['number'] == 1
