# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A node is spun until work is to end, and then destroyed, whatever its callbacks raise."""

import sys
from collections.abc import Iterator
from io import StringIO
from threading import Event, Thread

import pytest
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.executors import SingleThreadedExecutor
from rclpy.lifecycle import LifecycleNode
from rclpy.node import Node
from std_msgs.msg import Empty
from waiting import wait_until

from stickslip_ros.process import stopping
from stickslip_ros.ros.executable import end_node, spin_until_stopped
from stickslip_ros.ros.guard import Summons
from stickslip_ros.testing import open_context


@pytest.fixture
def node(ros_domain: int) -> Iterator[Node]:
    context = open_context(ros_domain)
    yield Node('spun', context=context)
    context.try_shutdown()


@pytest.mark.parametrize(
    ('case', 'executor'),
    [
        ('this rclpy', 'EventsExecutor'),
        ('an older rclpy', 'SingleThreadedExecutor'),
        ('a notebook, whose stderr is no file', 'SingleThreadedExecutor'),
    ],
)
def test_a_node_is_spun_until_its_end_and_then_destroyed(
    node: Node, case: str, executor: str, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(stopping, '_stop', Event())
    if case == 'an older rclpy':
        monkeypatch.setitem(sys.modules, 'rclpy.experimental', None)
    if case == 'a notebook, whose stderr is no file':
        monkeypatch.setattr(sys, 'stderr', StringIO())
    calls: list[str] = []

    def count() -> None:
        calls.append(type(node.executor).__name__)
        ask = stopping.request_stop if len(calls) > 2 else summons.send
        Thread(target=ask).start()

    summons = Summons(node, count)
    summons.send()
    spin_until_stopped(node)
    assert calls == 3 * [executor]
    assert not list(node.timers)


def test_an_event_of_what_a_callback_has_destroyed_is_passed_over(
    node: Node, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(stopping, '_stop', Event())
    events = SubscriptionEventCallbacks(matched=lambda _: None)
    heard = [node.create_subscription(Empty, 'x', print, 1, event_callbacks=events)]

    def destroy() -> None:
        node.create_publisher(Empty, 'x', 1)  # matches: an event for the executor
        wait_until(heard[0].get_publisher_count, 'the match')
        node.destroy_subscription(heard.pop())
        end.send()

    end, begin = Summons(node, stopping.request_stop), Summons(node, destroy)
    begin.send()
    spin_until_stopped(node)
    assert not heard


def test_what_a_callback_raises_ends_the_node(node: Node):
    def fail() -> None:
        raise ZeroDivisionError

    node.create_timer(1e-3, fail)
    with pytest.raises(ZeroDivisionError):
        spin_until_stopped(node)
    assert not list(node.timers)


def test_a_lifecycle_node_that_is_ended_offers_no_transitions_while_something_holds_it(node: Node):
    def offers_transitions() -> bool:
        return '/ended/change_state' in dict(node.get_service_names_and_types())

    ended = LifecycleNode('ended', context=node.context)
    assert offers_transitions()
    end_node(SingleThreadedExecutor(context=node.context), ended)
    assert not offers_transitions()
