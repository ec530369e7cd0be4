"""What executables have in common: one node, prompt, ended cleanly by SIGINT and SIGTERM."""

import sys
from collections.abc import Callable, Sequence

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from stickslip_ros.errors import StickSlipError
from stickslip_ros.ros.ending import end_on_signals, spin_until
from stickslip_ros.ros.environment import stay_on_this_host
from stickslip_ros.ros.timeliness import be_prompt, keep_what_there_is

REFUSED = 2


def run_node(name: str, make: Callable[[], Node], arguments: Sequence[str] | None) -> int:
    """
    Run a node until SIGINT or SIGTERM.

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
        node = make()
        keep_what_there_is()
    except (StickSlipError, RuntimeError) as error:  # a RuntimeError is the base of RCLError
        sys.stderr.write(f'{name}: {error}\n')
        return REFUSED
    else:
        spin_until(ending, node, SingleThreadedExecutor())
        return 0
    finally:
        rclpy.try_shutdown()
