"""The executable ``drive``: one node, ended cleanly by SIGINT and SIGTERM."""

import signal
import sys
import threading
from collections.abc import Sequence
from types import FrameType

import rclpy
from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from stickslip_ros.errors import StickSlipError
from stickslip_ros.ros.environment import stay_on_this_host
from stickslip_ros.ros.node import StickSlipDrive

SPIN_S = 0.1
"""Longest time that a signal waits to be seen."""
REFUSED = 2
SWITCH_S = 2e-4
"""Longest time that a callback may hold the interpreter while the drive's tick is due."""


def main(arguments: Sequence[str] | None = None) -> int:
    """
    Run the node until SIGINT or SIGTERM.

    Parameters
    ----------
    arguments : sequence of str, optional
        ROS arguments, such as ``--ros-args -p stand.preload:=0.25``; the command line if None.

    Returns
    -------
    int
        0 after a clean end, 2 if a parameter was refused.

    """
    ended = end_on_signals()
    sys.setswitchinterval(SWITCH_S)
    stay_on_this_host()
    try:
        rclpy.init(
            args=None if arguments is None else list(arguments),
            signal_handler_options=SignalHandlerOptions.NO,
        )
        node = StickSlipDrive()
    except (StickSlipError, RuntimeError) as error:  # a RuntimeError is the base of RCLError
        sys.stderr.write(f'drive: {error}\n')
        return REFUSED
    else:
        spin_until(ended, node, SingleThreadedExecutor())
        return 0
    finally:
        rclpy.try_shutdown()


def spin_until(ended: threading.Event, node: Node, executor: Executor) -> None:
    """Run a node until an event is set, then destroy it."""
    executor.add_node(node)
    while not ended.is_set():
        executor.spin_once(timeout_sec=SPIN_S)
    node.destroy_node()
    executor.shutdown()


def end_on_signals() -> threading.Event:
    """
    Return an event that SIGINT and SIGTERM set, as often as they like.

    Under a launch file one Ctrl-C arrives twice; the second must not break the clean-up.

    """
    ended = threading.Event()

    def end(_number: int, _frame: FrameType | None) -> None:
        ended.set()

    signal.signal(signal.SIGINT, end)
    signal.signal(signal.SIGTERM, end)
    return ended


if __name__ == '__main__':
    sys.exit(main())
