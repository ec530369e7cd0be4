# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A node is spun until work is to end, and then destroyed, whatever its callbacks raise."""

from collections.abc import Iterator
from threading import Event

import pytest
from rclpy.executors import SingleThreadedExecutor
from rclpy.lifecycle import LifecycleNode
from rclpy.node import Node

from stickslip_ros.process import stopping
from stickslip_ros.ros.executable import end_node, spin_until_stopped
from stickslip_ros.testing import open_context


@pytest.fixture
def node(ros_domain: int) -> Iterator[Node]:
    context = open_context(ros_domain)
    yield Node('spun', context=context)
    context.try_shutdown()


def test_a_node_is_spun_until_its_end_and_then_destroyed(
    node: Node, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(stopping, '_stop', Event())
    calls: list[None] = []

    def count() -> None:
        calls.append(None)
        if len(calls) > 2:
            stopping._stop.set()

    node.create_timer(1e-3, count)
    with SingleThreadedExecutor(context=node.context) as executor:
        spin_until_stopped(node, executor)
        assert not executor.get_nodes()
    assert not list(node.timers)


def test_what_a_callback_raises_ends_the_node(node: Node):
    def fail() -> None:
        raise ZeroDivisionError

    node.create_timer(1e-3, fail)
    with (
        SingleThreadedExecutor(context=node.context) as executor,
        pytest.raises(ZeroDivisionError),
    ):
        spin_until_stopped(node, executor)
    assert not list(node.timers)


def test_a_lifecycle_node_that_is_ended_offers_no_transitions_while_something_holds_it(node: Node):
    def offers_transitions() -> bool:
        return '/ended/change_state' in dict(node.get_service_names_and_types())

    ended = LifecycleNode('ended', context=node.context)
    assert offers_transitions()
    end_node(SingleThreadedExecutor(context=node.context), ended)
    assert not offers_transitions()
