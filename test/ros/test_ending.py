"""An executable ends once and cleanly, however many signals arrive at whatever moment."""

import sys
import threading
from collections.abc import Callable, Iterator
from types import FrameType
from typing import Any

import pytest
from contexts import open_context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from stickslip_ros.ros.ending import Ending, spin_until

END_TIMEOUT_S = 20.0


def interrupted(action: Callable[[], None], interrupt: Callable[[], None]) -> threading.Thread:
    """Run an action in a thread, and before each of its lines what a signal handler does."""

    def trace(_frame: FrameType, event: str, _argument: object) -> Any:
        if event == 'line':
            interrupt()  # Python traces nothing meanwhile
        return trace

    def run() -> None:
        sys.settrace(trace)
        action()

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    thread.join(END_TIMEOUT_S)
    return thread


@pytest.mark.parametrize('method', ['set', 'wait'])
def test_a_signal_between_any_two_lines_of_an_ending_ends_it(method: str):
    ending = Ending()
    assert not interrupted(getattr(ending, method), ending.set).is_alive()
    assert ending.is_set()


@pytest.fixture
def node(domain: int) -> Iterator[Node]:
    context = open_context(domain, '')
    yield Node('spun', context=context)
    context.try_shutdown()


def test_a_node_is_spun_until_its_end_and_then_destroyed(node: Node):
    ending, calls = Ending(), []

    def count() -> None:
        calls.append(threading.current_thread())
        if len(calls) > 2:
            ending.set()

    node.create_timer(1e-3, count)
    spin_until(ending, node, SingleThreadedExecutor(context=node.context))
    assert threading.main_thread() not in calls
    assert not list(node.timers)


def test_what_a_callback_raises_ends_the_node(node: Node):
    def fail() -> None:
        raise ZeroDivisionError

    node.create_timer(1e-3, fail)
    with pytest.raises(ZeroDivisionError):
        spin_until(Ending(), node, SingleThreadedExecutor(context=node.context))


def test_a_node_without_work_ends_when_it_is_asked_to(domain: int):
    context = open_context(domain, '')
    node = Node('idle', context=context, enable_rosout=False, start_parameter_services=False)
    executor = SingleThreadedExecutor(context=context)
    ending = Ending()
    spinning = threading.Thread(target=spin_until, args=(ending, node, executor), daemon=True)
    spinning.start()
    is_waiting = threading.Event()
    executor.create_task(is_waiting.set)
    assert is_waiting.wait(END_TIMEOUT_S)
    ending.set()
    spinning.join(END_TIMEOUT_S)
    assert not spinning.is_alive()
    context.try_shutdown()
