"""
The end of an executable: once, however many signals arrive at whatever moment.

This module imports neither rclpy nor anything else that takes time, so that an executable can
heed signals before it imports such things.

"""

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import TYPE_CHECKING

from stickslip_ros.errors import StickSlipError

if TYPE_CHECKING:
    from rclpy.executors import Executor
    from rclpy.node import Node

SIGNALS = (signal.SIGINT, signal.SIGTERM)
"""What ends an executable."""
STOPPED = 130
"""Exit status of a verb that a signal has stopped."""
STDERR = 2


class StillBusy(StickSlipError):
    """Something of a node could not be stopped; only the end of the process stops it."""


class Ending:
    """
    What ``threading.Event`` is, for signal handlers; for the rest of the life of a process.

    A second signal may interrupt the handler of the first, and one Ctrl-C often makes two: from
    the terminal and from the launch file, or from ``timeout`` to the process and to its group.
    The lock inside an event would then wait for itself; writing into a pipe is reentrant.

    """

    def __init__(self) -> None:
        self._is_set = False
        self._reading, self.writing = os.pipe()
        os.set_blocking(self.writing, False)

    def is_set(self) -> bool:
        """Return whether the end has been asked for."""
        return self._is_set

    def set(self) -> None:
        """Ask for the end, from any thread or signal handler, as often as one likes."""
        self._is_set = True
        with suppress(BlockingIOError):  # a full pipe wakes up too
            os.write(self.writing, b'.')

    def wait(self) -> None:
        """Wait, in one thread, until the end has been asked for; signals are handled meanwhile."""
        while not self._is_set:
            os.read(self._reading, 1)


def leave_on_signals(name: str, *, is_well: bool) -> None:
    """
    Have the first SIGINT or SIGTERM end the process at once, with one line.

    For the time before there is anything to close, such as that of imports: an exception would
    leave a traceback, or be lost in a callback of the import system. The status is 0 where a
    signal is how the executable ends well, else 130.

    """

    def leave(number: int, _frame: FrameType | None) -> None:
        line = f'{name}: ended by {signal.Signals(number).name} before it had started\n'
        os.write(STDERR, line.encode())
        os._exit(0 if is_well else STOPPED)

    for number in SIGNALS:
        signal.signal(number, leave)


def end_on_signals() -> Ending:
    """
    Return an ending that SIGINT and SIGTERM ask for, as often as they like.

    Of two signals that come together, Linux may give both to a thread that is running. Python
    notes them there, but has them handled by the main thread, which sleeps on: nothing has
    interrupted it. The byte that Python writes into the pipe wakes it up.

    """
    ending = Ending()

    def end(_number: int, _frame: FrameType | None) -> None:
        ending.set()

    for number in SIGNALS:
        signal.signal(number, end)
    signal.set_wakeup_fd(ending.writing, warn_on_full_buffer=False)
    return ending


def ignore_signals() -> None:
    """
    Have the system ignore SIGINT and SIGTERM until the process is gone.

    A handler, even one that does nothing, would not do: an interpreter that ends gives every
    signal that has one back to its default, which is death, and then takes some 0.1 s more to end.
    Not to be called by a handler: Python complains of another signal that has come meanwhile.

    """
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)


_interruptible: list[None] = []


@contextmanager
def interruptible() -> Iterator[None]:
    """Do what a process that is to end may cut: it takes long and leaves nothing to close."""
    _interruptible.append(None)
    try:
        yield
    finally:
        _interruptible.pop()


def is_interruptible() -> bool:
    """Return whether such a thing is being done."""
    return bool(_interruptible)


def end_node(executor: 'Executor', *nodes: 'Node') -> None:
    """
    End an executor that no thread spins any more, and its nodes, in the order that is safe.

    The executor forgets the nodes first, and with ``shutdown`` what it still holds of its last
    wait; only then do they go. Not to be called, nor ``shutdown`` alone, while another thread
    spins: rclpy takes the guard condition from a wait that is about to begin. Of 480 executors
    that were shut down while they spun 35 raised InvalidHandle in their thread and 5 to 8 never
    ended (rclpy 7.1.6 and 9.1.2). So whoever spins looks at a flag, and is joined first.

    """
    for node in nodes:
        executor.remove_node(node)
    executor.shutdown()
    for node in nodes:
        node.destroy_node()


def spin_until(ending: Ending, node: 'Node', executor: 'Executor') -> None:
    """
    Run a node until its end is asked for, then destroy it; the executor remains.

    The executor sleeps until there is work: whoever asks for the end wakes it with a task, since
    after ``wake()`` an executor without work sleeps again.

    Raises
    ------
    Exception
        What a callback raised, or the node when it was destroyed.

    """
    executor.add_node(node)
    try:
        while not ending.is_set():
            executor.spin_once()
    finally:
        executor.remove_node(node)
        node.destroy_node()
