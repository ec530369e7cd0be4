"""An executable ends once and cleanly, however many signals arrive at whatever moment."""

import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from types import FrameType
from typing import Any

import pytest
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from stickslip_ros.ros.ending import Ending, spin_until
from stickslip_ros.testing import open_context

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
def node(ros_domain: int) -> Iterator[Node]:
    context = open_context(ros_domain)
    yield Node('spun', context=context)
    context.try_shutdown()


def test_a_node_is_spun_until_its_end_and_then_destroyed(node: Node):
    ending = Ending()
    calls: list[None] = []

    def count() -> None:
        calls.append(None)
        if len(calls) > 2:
            ending.set()

    node.create_timer(1e-3, count)
    with SingleThreadedExecutor(context=node.context) as executor:
        spin_until(ending, node, executor)
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
        spin_until(Ending(), node, executor)
    assert not list(node.timers)


def test_a_signal_that_the_system_gives_to_another_thread_wakes_the_waiting_one():
    program = """
import signal, threading, time
from stickslip_ros.ros.ending import end_on_signals

def take_signal():
    time.sleep(0.2)  # the main thread most likely waits by then; if not, it has it easier
    signal.pthread_kill(threading.get_ident(), signal.SIGINT)

ending = end_on_signals()
threading.Thread(target=take_signal).start()
ending.wait()
"""
    subprocess.run([sys.executable, '-c', program], check=True, timeout=END_TIMEOUT_S)
