"""What executables have in common: one node, prompt, ended cleanly by SIGINT and SIGTERM."""

import os
import signal
import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future, wait
from threading import Thread
from typing import NoReturn

import rclpy
from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from stickslip_ros.errors import StickSlipError
from stickslip_ros.ros.ending import (
    Ending,
    StillBusy,
    end_on_signals,
    ignore_signals,
    is_expendable,
    spin_until,
)
from stickslip_ros.ros.environment import stay_on_this_host
from stickslip_ros.ros.timeliness import be_prompt, keep_what_there_is

ENDED, REFUSED, CUT = 0, 2, 3
"""Exit status: as it should be, a parameter refused at the start, closing cut short."""
CLOSING_S = 8.0
"""Time that a node has to close before its process ends without it."""
LAST_S = 10
"""Time after which the system kills what then still hangs, such as a library that ends."""
PATIENCE_S = 0.5
"""Time that a node has to end what it need not finish."""
LOOK_S = 0.05
MEND = 'a recording that was not finished is mended by `stickslip recover`'


def run_node(name: str, make: Callable[[], Node], arguments: Sequence[str] | None) -> int:
    """
    Run a node until SIGINT or SIGTERM; the process is to end with it.

    The node is made, spun and destroyed by a thread of its own. The calling thread, which is the
    only one to see signals, does nothing but wait: whatever the node does, it ends.

    Parameters
    ----------
    name : str
        The executable, for messages.
    make : callable
        Makes the node, in the default context.
    arguments : sequence of str or None
        ROS arguments; those of the command line if None.

    Returns
    -------
    int
        0 after a clean end, 2 if a parameter was refused.

    """
    ending = end_on_signals()
    be_prompt()
    stay_on_this_host()
    try:
        rclpy.init(
            args=None if arguments is None else list(arguments),
            signal_handler_options=SignalHandlerOptions.NO,
        )
    except RuntimeError as error:  # the base of RCLError
        ignore_signals()
        return _refuse(name, error)
    try:
        with SingleThreadedExecutor() as executor:
            life = _start(name, make, ending, executor)
            ending.wait()
            ignore_signals()
            executor.create_task(_do_nothing)
            return _await_end(name, life)
    finally:
        rclpy.try_shutdown()


def _start(
    name: str, make: Callable[[], Node], ending: Ending, executor: Executor
) -> 'Future[int]':
    """Begin the life of a node; give what will be its status, or what has ended it."""
    life: Future[int] = Future()

    def live() -> None:
        try:
            life.set_result(_live(name, make, ending, executor))
        except BaseException as error:  # noqa: BLE001 - who waits for the status gets it
            life.set_exception(error)
        finally:
            ending.set()

    Thread(target=live, name='node', daemon=True).start()
    return life


def _live(name: str, make: Callable[[], Node], ending: Ending, executor: Executor) -> int:
    try:
        node = make()
    except (StickSlipError, RuntimeError) as error:
        return _refuse(name, error)
    keep_what_there_is()
    spin_until(ending, node, executor)
    return ENDED


def _await_end(name: str, life: 'Future[int]') -> int:
    """Return the status of a node that is to end; leave the process where it does not."""
    signal.alarm(LAST_S)
    asked_s = time.monotonic()
    while not wait([life], LOOK_S).done:
        waited_s = time.monotonic() - asked_s
        if waited_s > PATIENCE_S and is_expendable():
            _leave(name, 'ended before it had started', ENDED)
        if waited_s > CLOSING_S:
            _leave(name, f'not closed within {CLOSING_S:g} s; {MEND}', CUT)
    try:
        return life.result()
    except StillBusy as error:
        _leave(name, f'{error}; {MEND}', CUT)


def _refuse(name: str, error: Exception) -> int:
    sys.stderr.write(f'{name}: {error}\n')
    return REFUSED


def _leave(name: str, why: str, status: int) -> NoReturn:
    """End the process without a look back: threads that will never end would hold it up."""
    sys.stderr.write(f'{name}: {why}\n')
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    os._exit(status)


def _do_nothing() -> None:
    """Be the work that lets an executor look around."""
