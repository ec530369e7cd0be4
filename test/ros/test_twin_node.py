# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A twin beside a rig of topics, and beside a drive, over DDS."""

import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PointStamped
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from mcap_records import rows_of
from rcl_interfaces.srv import SetParameters
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from std_msgs.msg import Float64MultiArray

from stickslip_ros.interface.cdr import pack_float64_array
from stickslip_ros.lab.experiments.experiment import Experiment, Readout, Voltage
from stickslip_ros.lab.experiments.predict import predict
from stickslip_ros.lab.twin.node import StickSlipTwin
from stickslip_ros.parameters import Parameters
from stickslip_ros.ros.client import Handshake, open_context
from stickslip_ros.ros.executable import end_node
from stickslip_ros.testing.operator import Operator

RATE_HZ, CYCLES, HZ, VOLTS, NOISE_M = 5170.0, 105, 500.0, 300.0, 1.5e-9
MAP = 'voltage_v=/rig/amplifier.point.x, position_m=/rig/encoder.point.x (nm)'
STAND = {'runner.damping': 20.0, 'load_cell.contact': 'absent'}
FREE = {'twin.free': 'contact.friction, actuator.gain', 'twin.window': 0.1}
KEPT = 0.97
"""Share of the messages that are not lost."""


@pytest.fixture
def start_twin() -> Iterator[Callable[..., StickSlipTwin]]:
    """
    Give a function that starts a twin beside an operator; its executor has a thread of its own.

    Both have one context: DDS does not always discover a further participant of the process.

    """
    with ExitStack() as stack:

        def start(operator: Operator, given: dict[str, Any]) -> StickSlipTwin:
            values = {**STAND, **FREE, **given}
            overrides = [Parameter(name, value=value) for name, value in values.items()]
            context, ended = operator.node.context, threading.Event()
            twin = StickSlipTwin(context=context, parameter_overrides=overrides)
            executor = SingleThreadedExecutor(context=context)
            executor.add_node(twin)

            def spin() -> None:
                while not ended.is_set():
                    executor.spin_once(timeout_sec=0.02)

            thread = threading.Thread(target=spin)
            thread.start()
            for end in (partial(end_node, executor, twin), thread.join, ended.set):
                stack.callback(end)
            return twin

        yield start


@pytest.fixture
def operator(ros_domain: int) -> Iterator[Operator]:
    context: Context = open_context(ros_domain)
    operator = Operator(context)
    yield operator
    operator.close()
    context.try_shutdown()


def is_heard(publisher: Publisher) -> bool:
    return bool(publisher.get_subscription_count() > 0)


class Listener:
    """Hears a twin, and calls its services."""

    def __init__(self, operator: Operator, twin: StickSlipTwin) -> None:
        self.operator, self.name = operator, twin.get_fully_qualified_name()
        self.twin = twin
        self.heard = {key: list[Any]() for key in ('residual', 'parameters', 'steps')}
        self.said = dict[str, DiagnosticStatus]()
        for key, into in self.heard.items():
            topic = f'/twin/{key}'
            [publisher] = [each for each in twin.publishers if each.topic_name == topic]
            operator.node.create_subscription(publisher.msg_type, topic, into.append, 10_000)
            operator.spin_until(partial(is_heard, publisher), topic)
        operator.node.create_subscription(DiagnosticArray, '/diagnostics', self._take, 10)

    def _take(self, message: DiagnosticArray) -> None:
        of_twin = [each for each in message.status if each.name.startswith(self.name.lstrip('/'))]
        self.said |= {each.name.rpartition(' ')[2]: each for each in of_twin}

    def call(self, kind: Any, service: str, request: Any) -> Any:
        client = self.operator.node.create_client(kind, f'{self.name}/{service}')
        self.operator.spin_until(client.service_is_ready, service)
        handshake = Handshake(self.operator.node, self.name)  # an answer might be lost before
        self.operator.spin_until(handshake.is_done, service)
        handshake.close()
        answer = client.call_async(request)
        self.operator.spin_until(answer.done, service)
        return answer.result()

    def wait_for_fits(self, count: int) -> None:
        fits = self.heard['parameters']
        self.operator.spin_until(lambda: len(fits) >= count, f'{count} fits')
        work: Any = self.twin._work  # a fit that is due before this one has ended is left out
        self.operator.spin_until(work._fitting.done, 'the end of a fit')

    def rows(self, key: str) -> list[dict[str, float]]:
        return [
            dict(zip(each.layout.dim[1].label.split(','), each.data, strict=True))
            for each in self.heard[key]
        ]

    def wait_for(self, part: str, condition: Callable[[DiagnosticStatus], bool]) -> None:
        self.operator.spin_until(
            lambda: part in self.said and condition(self.said[part]), f'{part} as wanted'
        )


def numbers_of(said: DiagnosticStatus) -> dict[str, str]:
    return {each.key: each.value for each in said.values}


def has_listeners(publisher: Any, count: int) -> bool:
    return bool(publisher.get_subscription_count() == count)


def motion(friction: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Give times, voltage and positions of a stand like that of the twin, with noise."""
    fall_s, starts_s = 2e-6, np.arange(CYCLES) / HZ
    corners = [(s + t, v) for s in starts_s for t, v in ((0.0, 0.0), (1.0 / HZ - fall_s, VOLTS))]
    rows = np.array([*corners, (CYCLES / HZ, 0.0)])
    time_s = np.arange(1.7e-4, rows[-1, 0], 1.0 / RATE_HZ)
    seen = Readout('position_m', np.zeros(len(time_s)), time_s)
    rig = Parameters().updated(STAND | {'contact.friction': friction})
    [[found]] = predict(rig, [Experiment('', {}, Voltage(rows), (seen,))])
    return time_s, np.interp(time_s, *rows.T), found.values


def play_on(operator: Operator) -> Callable[..., None]:
    """Give a function that publishes a fifth of a second of a rig, with some messages lost."""
    both = [
        operator.node.create_publisher(PointStamped, f'/rig/{name}', 10_000)
        for name in ('amplifier', 'encoder')
    ]
    _, encoder = both
    operator.spin_until(lambda: all(x.get_subscription_count() for x in both), 'a twin')
    rng = np.random.default_rng(1)

    def run(start_s: int, rows: tuple[np.ndarray, ...], late_s: float = 0.0) -> None:
        for time_s, *values in zip(*rows, strict=True):
            for publisher, value in zip(both, values, strict=True):
                message = PointStamped()
                stamp_s = start_s + time_s + (late_s if publisher is encoder else 0.0)
                second, part = divmod(stamp_s, 1.0)
                message.header.stamp.sec, message.header.stamp.nanosec = (
                    int(second),
                    int(1e9 * part),
                )
                noise_m = rng.normal(0.0, NOISE_M)
                message.point.x = 1e9 * (value + noise_m) if publisher is encoder else value
                if rng.random() < KEPT:
                    publisher.publish(message)

    return run


@pytest.mark.slow  # 10 s of windows in real time
def test_a_rig_whose_encoder_has_a_clock_that_moves_is_told_so(operator, start_twin):
    listener = Listener(operator, start_twin(operator, {'twin.map': MAP}))
    run, rows = play_on(operator), motion(0.3)
    for number, late_s in enumerate((0.0, 0.0, 0.0, 3e-4, 3e-4), 1):
        run(10 * number - 3, rows, late_s)
        listener.wait_for_fits(number)
    listener.wait_for('health', lambda said: said.level == DiagnosticStatus.WARN)
    assert listener.said['health'].message.startswith('the clock of position_m is +0.3 ms late')


def test_of_a_topic_each_number_has_the_clock_that_the_map_gives_it(operator, start_twin):
    by_log = f'{MAP} by log time, force_n=/rig/encoder.point.x'
    twin: Any = start_twin(operator, {'twin.map': by_log})
    play_on(operator)(7, tuple(each[:200] for each in motion(0.3)), late_s=0.4)
    newest = twin._windows._newest
    operator.spin_until(lambda: min(newest.values()) > 7e9, 'numbers of all topics')
    assert newest['force_n'] - newest['voltage_v'] == pytest.approx(4e8, rel=0.1)


@pytest.mark.slow  # 16 s of windows in real time
def test_a_rig_of_topics_that_pauses_and_begins_anew_has_a_twin_that_finds_what_has_changed(
    operator: Operator, start_twin: Callable
):
    settings = {'twin.map': MAP}
    listener = Listener(operator, start_twin(operator, settings))
    run, before, after = play_on(operator), motion(0.3), motion(0.24)
    bursts = (7, before), (17, before), (27, before), (37, after), (47, after)
    for number, burst in enumerate(bursts, 1):
        run(*burst)
        listener.wait_for_fits(number)
    listener.wait_for('health', lambda said: said.message.startswith('contact.friction 0.2'))
    assert listener.said['health'].level == DiagnosticStatus.WARN
    run(2, after)
    listener.wait_for_fits(len(bursts) + 1)
    listener.wait_for('rig', lambda said: numbers_of(said)['restarts'] == '1')
    counts = numbers_of(listener.said['rig'])
    assert (counts['pauses'], counts['dropped']) == ('4', '0')
    fits, steps = listener.rows('parameters'), listener.rows('steps')
    assert [each['t[s]'] for each in fits] == pytest.approx([7.2, 17.2, 27.2, 37.2, 47.2, 2.2])
    for number, each in enumerate(fits):
        true, error = 0.3 if number < 3 else 0.24, each['contact.friction_sigma']
        assert each['contact.friction'] == pytest.approx(true, rel=0.0, abs=4.0 * error)
        assert error < 0.03
    for each in steps[:3]:
        assert each['steps'] in (48.0, 49.0)
        assert each['twin[m]'] == pytest.approx(each['rig[m]'], rel=3e-3, abs=0.0)
        assert each['residual_rms[m]'] < 3.0 * NOISE_M
    assert {each.header.stamp.sec for each in listener.heard['residual']} == {2, 7, 17, 27, 37, 47}


def test_a_recording_of_a_drive_that_is_played_gives_the_fits_of_the_drive_to_the_digit(
    start_drive: Callable, start_twin: Callable
):
    stand = start_drive({**STAND, 'sim.lockstep': True, 'sim.publish_clock': False})
    operator = stand.operator
    twin = start_twin(operator, {'twin.period': 0.2, 'twin.free': 'actuator.gain'})
    listener = Listener(operator, twin)

    def hears_all(publishers: Any, count: int) -> bool:
        [trace] = [each for each in publishers if each.topic_name == '/trace']
        return bool(trace.get_subscription_count() >= count)

    operator.spin_until(lambda: hears_all(stand.drive.publishers, 2), 'the trace')
    assert operator.set_recording(wanted=True).success
    operator.command('sawtooth', (VOLTS, HZ, 0.0))
    operator.command('grant', (0.26, 1))
    listener.wait_for_fits(1)
    operator.command('grant', (0.46, 1))
    listener.wait_for_fits(2)
    blocks = [
        row
        for row in rows_of(Path(operator.set_recording(wanted=False).message))
        if row[0] == '/trace'
    ]
    player = operator.node.create_publisher(Float64MultiArray, '/trace', 100)
    ends = (Transition.TRANSITION_DEACTIVATE, 1), (Transition.TRANSITION_ACTIVATE, 2)
    for transition, listeners in ends:  # the operator hears the trace, and an active twin
        request = ChangeState.Request(transition=Transition(id=transition))
        assert listener.call(ChangeState, 'change_state', request).success
        there = partial(has_listeners, player, listeners)
        operator.spin_until(there, f'{listeners} who hear the trace')
    for _, time_ns, _, data in blocks:
        player.publish(data)
        if time_ns == 260_000_000:
            listener.wait_for_fits(3)
    listener.wait_for_fits(4)
    fits = [each.data for each in listener.heard['parameters']]
    assert fits[2:] == fits[:2]


def block(time_s: Any, columns: str = 't[s],voltage[V],position[m]') -> bytes:
    """Return a block of a trace at rest."""
    table = np.zeros((len(time_s), columns.count(',') + 1))
    table[:, 0] = time_s
    return pack_float64_array(table, ('sample', columns))


def test_odd_messages_on_a_trace_are_refused_told_and_survived(operator, start_twin):
    twin = start_twin(operator, {})
    listener = Listener(operator, twin)
    rig = operator.node.create_publisher(Float64MultiArray, '/trace', 100)
    operator.spin_until(partial(has_listeners, rig, 2), 'a twin beside the operator')
    good_s, other = np.arange(0.0, 0.05, 1e-3), 't[s],voltage[V],force[N]'
    odd = [
        Float64MultiArray(data=[1.0, 2.0, 3.0]),
        block([]),
        block(good_s + 0.05, other),
        block(good_s + 0.05),  # the columns have changed again
        block([0.1, 0.05, 0.0]),
        block([0.1, np.nan, 0.3]),
        block([0.1, 0.2, np.inf]),
        block([0.05, 0.051, 3.15e7]),
        block(good_s, 't[s],position[m],force[N]'),
        b'\0\1\0\0not a message',
    ]
    for each in (block(good_s), *odd, block(good_s + 0.1)):
        rig.publish(each)
    count = str(len(odd))
    listener.wait_for('rig', lambda said: numbers_of(said)['messages_refused'] == count)
    assert 'trace refused: ' in numbers_of(listener.said['rig'])['last_refused']
    assert twin._state_machine.current_state[1] == 'active'


def test_its_parameters_are_refused_by_name_and_remedy(operator: Operator, start_twin: Callable):
    listener = Listener(operator, start_twin(operator, {}))
    asked = {
        'twin.fre': 'x',
        'twin.window': 0.2,
        'stand.preload': [0.1],
        'twin.free': FREE['twin.free'],
    }
    parameters = [Parameter(name, value=each).to_parameter_msg() for name, each in asked.items()]
    request = SetParameters.Request(parameters=parameters)
    unknown, fixed, wrong, same = listener.call(SetParameters, 'set_parameters', request).results
    assert unknown.reason.startswith("parameter 'twin.fre' is not known; did you mean twin.free")
    assert fixed.reason.startswith('twin.window 0.2 is refused: it is read-only; give it at the')
    assert wrong.reason.startswith('stand.preload [0.1] is not a finite number; give a number')
    assert same.successful
