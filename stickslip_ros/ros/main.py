"""The executable ``drive``: one node, ended cleanly by SIGINT and SIGTERM."""

import signal
import sys
import threading
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from types import FrameType

import rclpy
from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from stickslip_ros.errors import StickSlipError
from stickslip_ros.ros.environment import stay_on_this_host
from stickslip_ros.ros.node import StickSlipDrive
from stickslip_ros.ros.timeliness import Keeper, be_prompt, keep_what_there_is

REFUSED = 2


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
    be_prompt()
    stay_on_this_host()
    try:
        rclpy.init(
            args=None if arguments is None else list(arguments),
            signal_handler_options=SignalHandlerOptions.NO,
        )
        node = StickSlipDrive()
        node.add_managed_entity(Keeper())
        keep_what_there_is()
    except (StickSlipError, RuntimeError) as error:  # a RuntimeError is the base of RCLError
        sys.stderr.write(f'drive: {error}\n')
        return REFUSED
    else:
        spin_until(ended, node, SingleThreadedExecutor())
        return 0
    finally:
        rclpy.try_shutdown()


def spin_until(ended: threading.Event, node: Node, executor: Executor) -> None:
    """
    Run a node until an event is set, then destroy it.

    The executor has a thread of its own and sleeps until there is work: the calling thread, which
    is the only one to see signals, waits for the event.

    Raises
    ------
    Exception
        What a callback raised; it ends the node.

    """
    executor.add_node(node)

    def spin() -> None:
        try:
            while not ended.is_set():
                executor.spin_once()
        finally:
            ended.set()

    with ThreadPoolExecutor(1, 'executor') as threads:
        spinning = threads.submit(spin)
        ended.wait()
        executor.wake()
        spinning.result()
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
