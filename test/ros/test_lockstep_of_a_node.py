# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""An unmodified node and a drive in lockstep: the same bytes, whatever the node is made of."""

import re
import threading
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pytest
import rclpy
from geometry_msgs.msg import PointStamped
from mcap_records import rows_of
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_msgs.msg import Float64, Float64MultiArray
from std_srvs.srv import Trigger

from stickslip_ros.errors import StickSlipError
from stickslip_ros.recording.reader import Recording
from stickslip_ros.testing import LockstepClient, open_context

LOCKSTEP = {'sim.lockstep': True, 'load_cell.contact': 'absent', 'runner.damping': 5.0}
PERIOD_S = 0.01
BLOCK_S = 1e-3
NEAR_M = 4e-9
"""A tenth of the way is left 30 ms after the position was zeroed."""
SOON_S = 1.0
"""A time-out of tests of time-outs, wall-clock."""
AT_ONCE_S = 0.01
"""The same where nothing is under way."""


class Controller(Node):
    """A controller as anybody writes one: it knows nothing of lockstep, nor of its context."""

    def __init__(self, target_m: float = 40e-9, delay_s: float = 0.0) -> None:
        super().__init__('controller')
        self.target_m, self.delay_s = target_m, delay_s
        self.voltage_v, self.position_m = 0.0, 0.0
        self.ticks_s: list[float] = []
        self.answers: list[tuple[float, str]] = []
        self.voltage = self.create_publisher(Float64, 'command/voltage', 10)
        self.create_subscription(PointStamped, 'position', self.on_position, 10)
        self.zero = self.create_client(
            Trigger, 'stickslip_drive/zero_position', callback_group=ReentrantCallbackGroup()
        )
        self.create_timer(PERIOD_S, self.on_timer)

    @property
    def now_s(self) -> float:
        return round(self.get_clock().now().nanoseconds * 1e-9, 9)

    def on_position(self, message: PointStamped) -> None:
        self.position_m = message.point.x
        time.sleep(self.delay_s)
        self.voltage_v += 2e8 * (self.target_m - self.position_m)
        self.voltage.publish(Float64(data=min(max(self.voltage_v, 0.0), 300.0)))

    async def on_timer(self) -> None:
        self.ticks_s.append(self.now_s)
        if len(self.ticks_s) == 2:
            answer = await self.zero.call_async(Trigger.Request())
            self.answers.append((self.now_s, answer.message))


def run(start_drive: Callable, path: Path, delay_s: float = 0.0) -> tuple[Any, Controller]:
    stand = start_drive({**LOCKSTEP, 'record.on_start': True, 'record.name': path.name})
    controller = Controller(delay_s=delay_s)
    stand.run_lockstep(controller, 0.03)
    stand.run_lockstep(controller, 0.02)
    return stand, controller


def test_an_unmodified_node_with_timers_and_services_gets_the_same_bytes(start_drive, tmp_path):
    files = []
    for delay_s in (0.0, 2e-3):
        stand, controller = run(start_drive, tmp_path / 'run.mcap', delay_s)
        assert controller.ticks_s == [0.01, 0.02, 0.03, 0.04, 0.05]
        assert controller.answers == [(0.02, '')]
        assert stand.operator.time_ns == stand.drive.session.bench.time_ns == 50_000_000
        assert len(stand.operator.positions) == 50
        assert stand.operator.positions[50_000_000] == controller.position_m
        assert 'zero_position' in [each['command'] for each in stand.operator.events]
        stand.close()
        rclpy.try_shutdown()  # a context that outlives a drive may never be heard by the next one
        files.append((tmp_path / 'run.mcap').rename(tmp_path / f'{delay_s:g}.mcap'))
    assert rows_of(files[0]) == rows_of(files[1])
    counts = {each.topic: each.messages for each in Recording(files[0]).channels}
    assert counts['/command/voltage'] == 49  # the answer to the last reading has no block
    assert abs(controller.position_m - controller.target_m) < NEAR_M


def test_an_error_of_a_callback_is_raised_in_the_test(start_drive: Callable):
    stand = start_drive(LOCKSTEP)
    controller = Controller()
    controller.target_m = None
    with pytest.raises(TypeError, match='unsupported operand'):
        stand.run_lockstep(controller, 0.01)


def publisher_on(topic: str) -> Node:
    """Give a node that publishes on a topic at each position."""
    node = Node('speaker')
    publisher = node.create_publisher(Float64, topic, 10)
    node.create_subscription(
        PointStamped, 'position', lambda _: publisher.publish(Float64(data=100.0)), 10
    )
    return node


@pytest.mark.parametrize('namespace', ['', '/left'])
def test_a_publisher_among_the_commands_that_nobody_hears_is_named(start_drive, namespace: str):
    stand = start_drive(LOCKSTEP, namespace)
    node, topic = publisher_on('command/volts'), f'{namespace}/command/volts'
    told = rf'^{topic}, published by \S*/speaker, has no subscriber; did you mean {namespace}/comm'
    with pytest.raises(StickSlipError, match=f'{told}.*, subscribe to it in the test$'):
        stand.run_lockstep(node, 0.005)
    stand.operator.node.create_subscription(Float64, 'command/volts', lambda _: None, 10)
    [publisher] = [each for each in node.publishers if each.topic_name == topic]
    stand.operator.spin_until(lambda: publisher.get_subscription_count() == 1, 'the test')
    stand.run_lockstep(node, 0.005)


def test_a_publisher_for_others_needs_no_subscriber(start_drive: Callable):
    stand = start_drive(LOCKSTEP)
    for topic in ('voltage_wanted', '/right/command/voltage', '~/command'):
        stand.run_lockstep(publisher_on(topic), 0.005)


class Stuck(Node):
    """A node with a callback that does not come to its end."""

    def __init__(self, what: str) -> None:
        super().__init__('stuck')
        self.what = what
        self.released = threading.Event()
        self.again = self.create_publisher(Float64, 'again', 10)
        self.create_subscription(Float64, 'again', self.again.publish, 10)
        self.create_subscription(PointStamped, 'position', self.on_position, 10)
        self.zero = self.create_client(Trigger, 'stickslip_drive/zero_position')

    def on_position(self, _: PointStamped) -> None:
        if self.what == 'returns':
            self.released.wait()  # for ever
        elif self.what == 'ends':
            self.again.publish(Float64())
        else:
            self.zero.call(Trigger.Request())


@pytest.mark.parametrize('what', ['returns', 'ends', 'is answered'])
def test_a_node_that_never_answers_is_told_with_its_line_and_the_state_of_the_drive(
    start_drive: Callable, what: str
):
    stand = start_drive(LOCKSTEP)
    node = Stuck(what)
    heard = [each for each in node.subscriptions if each.topic_name in {'/clock', '/position'}]
    stand.operator.spin_until(
        lambda: all(each.get_publisher_count() for each in heard) and node.zero.service_is_ready(),
        'the drive at the node',
    )
    at = '.*' if what == 'ends' else r', at .+test_lockstep_of_a_node\.py:\d+'
    state = f'for {SOON_S:g} s; simulated time 0.001 s; lockstep, granted to 0.001 s'
    told = rf'^/stuck runs callbacks without end{at}, {re.escape(state)}$'
    with pytest.raises(StickSlipError, match=told):
        stand.run_lockstep(node, 0.01, timeout_s=SOON_S)
    node.released.set()


class Deaf(Node):
    def __init__(self, message_type: Any) -> None:
        super().__init__('deaf')
        self.create_publisher(message_type, 'command/voltage', 10)


def test_a_topic_that_does_not_join_them_is_named(start_drive: Callable):
    stand = start_drive(LOCKSTEP)
    told = '/deaf has no other end on /command/voltage that fits its type and quality'
    with pytest.raises(StickSlipError, match=rf'{told}, .*; simulated time 0 s; lockstep, no g'):
        stand.run_lockstep(Deaf(Float64MultiArray), 0.01, timeout_s=SOON_S)


def test_commands_from_elsewhere_are_told(start_drive: Callable):
    stand = start_drive(LOCKSTEP)
    publish = stand.operator.node.create_publisher(Float64, 'command/voltage', 10).publish
    node = Node('hidden')
    node.create_subscription(PointStamped, 'position', lambda _: publish(Float64(data=1.0)), 10)
    stand.operator.shake_hands()
    with pytest.raises(StickSlipError, match='commands came from elsewhere; let one node send'):
        stand.run_lockstep(node, 0.05)


def test_what_the_wall_clock_would_decide_is_refused(start_drive: Callable):
    stand = start_drive({**LOCKSTEP, 'sim.publish_clock': False})
    node = Controller()
    with pytest.raises(StickSlipError, match='wall-clock time; set its parameter use_sim_time'):
        stand.run_lockstep(node, 0.01)
    follower = Node('follower', parameter_overrides=[Parameter('use_sim_time', value=True)])
    follower.create_timer(PERIOD_S, print)
    with pytest.raises(StickSlipError, match=r"/follower waits for /clock, .*'sim.publish_clock'"):
        stand.run_lockstep(follower, 0.01)
    elsewhere = open_context(0)
    with pytest.raises(StickSlipError, match=r'/away is in domain 0, not .*=stand.context'):
        stand.run_lockstep(Node('away', context=elsewhere), 0.01)
    elsewhere.try_shutdown()
    LockstepClient(follower, BLOCK_S, lambda *_: [])
    follower.destroy_timer(next(iter(follower.timers)))
    with pytest.raises(StickSlipError, match='/follower sends grants by itself'):
        stand.run_lockstep(follower, 0.01)


def test_a_drive_with_a_pace_is_refused(start_drive: Callable):
    stand = start_drive()
    with pytest.raises(StickSlipError, match='the drive has a pace; start it with'):
        stand.run_lockstep(Node('anybody'), 0.01)


def test_a_wait_that_was_in_vain_says_what_holds_the_drive(start_drive: Callable):
    stand = start_drive(LOCKSTEP)
    operator, session = stand.operator, stand.drive.session
    wait = partial(operator.spin_until, lambda: False, 'the end', AT_ONCE_S)
    held = f'the end did not come within {AT_ONCE_S:g} s: simulated time 0 s; lockstep, '
    with pytest.raises(StickSlipError, match=f'{held}no grant came'):
        wait()
    operator.command('grant', (5 * BLOCK_S, 3))
    operator.spin_until(lambda: 'no grant' not in session.state, 'the grant')
    with pytest.raises(StickSlipError, match=f'{held}0 of 3 commands came'):
        wait()
    operator.switch('set_paused', wanted=True)
    with pytest.raises(StickSlipError, match='simulated time 0 s; paused'):
        wait()
    operator.change_state('deactivate')
    with pytest.raises(StickSlipError, match='the node is inactive, not active; activate it'):
        wait()
