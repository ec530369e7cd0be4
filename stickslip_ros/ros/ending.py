"""The end of an executable: once, however many signals arrive at whatever moment."""

import signal
from concurrent.futures import ThreadPoolExecutor
from queue import SimpleQueue
from types import FrameType

from rclpy.executors import Executor
from rclpy.node import Node


class Ending:
    """
    What ``threading.Event`` is, for signal handlers.

    A second signal may interrupt the handler of the first, and one Ctrl-C often makes two: from
    the terminal and from the launch file, or from ``timeout`` to the process and to its group.
    The lock inside an event would then wait for itself; ``SimpleQueue.put`` is reentrant.

    """

    def __init__(self) -> None:
        self._news: SimpleQueue[None] = SimpleQueue()
        self._is_set = False

    def is_set(self) -> bool:
        """Tell whether the end has been asked for."""
        return self._is_set

    def set(self) -> None:
        """Ask for the end, from any thread or signal handler, as often as one likes."""
        self._is_set = True
        self._news.put(None)

    def wait(self) -> None:
        """Wait, in one thread, until the end has been asked for; signals are handled meanwhile."""
        while not self._is_set:
            self._news.get()


def end_on_signals() -> Ending:
    """Return an ending that SIGINT and SIGTERM ask for, as often as they like."""
    ending = Ending()

    def end(_number: int, _frame: FrameType | None) -> None:
        ending.set()

    signal.signal(signal.SIGINT, end)
    signal.signal(signal.SIGTERM, end)
    return ending


def spin_until(ending: Ending, node: Node, executor: Executor) -> None:
    """
    Run a node until its end is asked for, then destroy it.

    The executor has a thread of its own and sleeps until there is work: the calling thread, which
    is the only one to see signals, waits for the end.

    Raises
    ------
    Exception
        What a callback raised; it ends the node.

    """
    executor.add_node(node)

    def spin() -> None:
        try:
            while not ending.is_set():
                executor.spin_once()
        finally:
            ending.set()

    with ThreadPoolExecutor(1, 'executor') as threads:
        spinning = threads.submit(spin)
        ending.wait()
        executor.create_task(_do_nothing)  # after wake() a node without work would sleep again
        spinning.result()
    node.destroy_node()
    executor.shutdown()


def _do_nothing() -> None:
    """Be the work that lets an executor look around."""
