# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""No message ends a node: each subscription of each node refuses, counts, and goes on."""

import inspect
import json
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import WrenchStamped
from odd_messages import OddMessages
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from waiting import wait_until

import stickslip_ros
from stickslip_ros.lab.panel.link import Link
from stickslip_ros.lab.panel.twin_view import _READINGS_KEPT
from stickslip_ros.lab.twin.node import StickSlipTwin
from stickslip_ros.lab.twin.window import _KEPT_MAX
from stickslip_ros.ros.client import open_context
from stickslip_ros.ros.executable import end_node
from stickslip_ros.ros.guard import GuardedNode
from stickslip_ros.ros.node import StickSlipDrive
from stickslip_ros.testing.operator import Operator

MESSAGES, NO_MESSAGES, LOOK_EVERY = 200, 50, 10
OF_ANOTHER_NODE = {'testing/operator.py', 'testing/lockstep.py'}
"""Nodes of tests, whose errors belong to the test."""
MAP = 'voltage_v=/rig/amplifier.data, position_m=/rig/joints.position[0] (nm), '
MAP += 'force_n=/rig/cell.wrench.force.x'


@pytest.fixture
def context(ros_domain: int) -> Iterator[Context]:
    context = open_context(ros_domain)
    yield context
    context.try_shutdown()


@pytest.fixture
def start(context: Context) -> Iterator[Callable[..., Any]]:
    """Give a function that makes a node, which only the test spins."""
    executor, nodes = SingleThreadedExecutor(context=context), list[Any]()

    def make(kind: Any, given: dict[str, Any]) -> Any:
        overrides = [Parameter(name, value=value) for name, value in given.items()]
        nodes.append(kind(context=context, parameter_overrides=overrides))
        executor.add_node(nodes[-1])
        return nodes[-1]

    yield make
    end_node(executor, *nodes)


def throw(node: Any, seed: int, look: Callable[[], object] = lambda: None) -> None:
    """Throw generated messages, and bytes that are none, at every subscription; ``look`` often."""
    for subscription in node.subscriptions:
        odd, kind = OddMessages(seed), subscription.msg_type
        arguments = inspect.signature(subscription.callback).parameters
        info = {'source_timestamp': 10**18, 'received_timestamp': 10**18}
        rest = [info] * (len(arguments) - 1)
        for number in range(MESSAGES + NO_MESSAGES):
            is_message = number < MESSAGES
            data = serialize_message(odd.message(kind)) if is_message else odd.not_a_message(kind)
            subscription.callback(data, *rest)
            if number % LOOK_EVERY == 0:
                look()


def reported(node: GuardedNode, status: Any) -> None:
    """Check that a status tells the count and the last reason."""
    values = {each.key: each.value for each in status.values}
    assert values['messages_refused'] == str(node.guard.count)
    assert values['last_refused'] == node.guard.last != ''


def test_a_drive_outlives_what_is_thrown_at_each_of_its_subscriptions(start, monkeypatch):
    given = {'sim.publish_clock': False, 'use_sim_time': True, 'sim.real_time_factor': 0.0}
    drive = start(StickSlipDrive, given)
    assert {'/clock', '/command/joint'} <= {each.topic_name for each in drive.subscriptions}
    throw(drive, 1)
    session, said = drive.session, list[Any]()
    assert drive.guard.count > NO_MESSAGES * len(list(drive.subscriptions)) / 2
    monkeypatch.setattr(drive, '_send_diagnostics', lambda *status: said.extend(status))
    drive._publish_diagnostics()
    reported(drive, next(each for each in said if each.name.endswith(': drive')))
    at_ns = session.bench.time_ns
    wait_until(lambda: session.bench.time_ns > at_ns, 'time', progress=lambda: session.state)
    assert session.failure is None
    assert drive._state_machine.current_state[1] == 'active'


@pytest.mark.parametrize('topics', ['', MAP])
def test_a_twin_outlives_what_is_thrown_at_each_of_its_subscriptions(
    start: Callable[..., Any], context: Context, topics: str, monkeypatch: pytest.MonkeyPatch
):
    rig = Node('rig', context=context)
    for kind, name in ((Float64, 'amplifier'), (JointState, 'joints'), (WrenchStamped, 'cell')):
        rig.create_publisher(kind, f'/rig/{name}', 1)
    twin = start(StickSlipTwin, {'twin.map': topics, 'use_sim_time': True})

    def hears_all() -> bool:
        twin._join()
        return len(twin._heard) == (3 if topics else 1)

    wait_until(hears_all, 'the topics of the rig')
    throw(twin, 2)
    assert twin.guard.count > NO_MESSAGES
    assert all(len(each) <= _KEPT_MAX for each in twin._windows._stamps.values())
    said = list[Any]()
    monkeypatch.setattr(twin._diagnostics, 'publish', said.append)
    twin._report()
    reported(twin, said[0].status[0])
    assert twin._state_machine.current_state[1] == 'active'
    rig.destroy_node()


@pytest.mark.parametrize('field', ['/rig/amplifier.data-x', '/rig/amplifier.data'])
def test_a_twin_outlives_a_topic_that_it_cannot_read(start, context, field, monkeypatch):
    rig = Node('rig', context=context)
    rig.create_publisher(Float64, '/rig/amplifier', 1)
    twin, told = start(StickSlipTwin, {'twin.map': f'voltage_v={field}'}), list[str]()
    if field.endswith('data'):  # of a type whose support is broken
        monkeypatch.setattr('stickslip_ros.lab.twin.node.import_module', lambda _: None)
    monkeypatch.setattr(twin, '_tell', told.append)
    wait_until(lambda: twin._join() or told, 'the topic of the rig')
    assert '/rig/amplifier: std_msgs/msg/Float64 cannot be read: ' in told[0]
    assert twin._heard == {}
    rig.destroy_node()


def test_errors_and_bytes_that_are_no_message_are_told_in_words(context: Context):
    node, heard = GuardedNode('listener', context=context), list[Any]()

    def take(message: Any, info: dict[str, int]) -> None:
        heard.append((message.data, info))
        raise KeyError('a fault of the program')

    subscription = node.create_subscription(Float64, 'voltage', take, 1)
    subscription.callback(serialize_message(Float64(data=1.0)), {'source_timestamp': 1})
    assert heard == [(1.0, {'source_timestamp': 1})]
    assert node.guard.last == "voltage refused: KeyError: 'a fault of the program'"
    subscription.callback(b'odd', {})
    why = 'voltage refused: 3 bytes are no Float64; check their publisher'
    counts = {'messages_refused': '2', 'messages_lost': '0'}
    assert node.guard.values() == {**counts, 'last_refused': why}
    assert node.guard.news() == '2 refused since the last report'
    assert node.guard.news() == ''
    node.destroy_node()


def look(link: Link) -> None:
    """Make what a page would get next."""
    json.dumps(link.state(), allow_nan=False)
    link.model.choose({})
    assert link.frame()
    assert link.twin_frame()


def test_a_panel_outlives_what_is_thrown_at_each_of_its_subscriptions(ros_domain):
    link = Link(domain=ros_domain)
    try:
        throw(link._node, 3, lambda: look(link))
        assert link._node.guard.count > NO_MESSAGES
        heard = link.model._twin._heard.values()
        assert all(len(each) <= _READINGS_KEPT for each in heard)
    finally:
        link.close()


def test_a_client_of_tests_raises_nothing_for_messages_of_others(context: Context):
    operator = Operator(context)
    for subscription in operator.node.subscriptions:
        odd = OddMessages(4)
        for _ in range(MESSAGES):
            subscription.callback(odd.message(subscription.msg_type))
    operator.close()


def test_every_node_of_the_package_is_guarded():
    root = Path(stickslip_ros.__file__).parent
    for path in root.rglob('*.py'):
        text, place = path.read_text(encoding='utf-8'), str(path.relative_to(root))
        made = re.findall(r'\b(?:Lifecycle)?Node\(', re.sub(r'class \w+\(.*', '', text))
        assert not made or place in OF_ANOTHER_NODE, f'{place} makes a node without a guard'
        for bases in re.findall(r'class \w+\((.*\bLifecycleNode)\)', text):
            assert 'GuardedNode, ' in bases, place
