"""What both executables do: discovery on this host, timely wake-ups, a clean end on signals."""

import gc
import os
import signal
import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future, wait
from functools import partial
from pathlib import Path
from threading import Thread
from typing import Any, NoReturn

import rclpy
from rcl_interfaces.msg import SetParametersResult
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.service import Service
from rclpy.signals import SignalHandlerOptions

import stickslip_ros
from stickslip_ros.errors import StickSlipError
from stickslip_ros.ros.ending import (
    Ending,
    StillBusy,
    end_on_signals,
    ignore_signals,
    is_interruptible,
    spin_until,
)
from stickslip_ros.ros.pacing import wake_in_time

DISCOVERY_VARIABLE = 'ROS_AUTOMATIC_DISCOVERY_RANGE'
ENDED, REFUSED, CUT = 0, 2, 3
"""Exit status: as it should be, a parameter refused at the start, closing cut short."""
CLOSING_S = 8.0
"""Time that a node has to close before its process ends without it."""
LAST_S = 10
"""Time after which the system kills what then still hangs, such as a library that ends."""
PATIENCE_S = 0.5
"""Time that a node has to end what it need not finish."""
LOOK_S = 0.05
HINT = '`stickslip recover` repairs a recording that was not finished'


def stay_on_this_host() -> None:
    """Limit discovery to this host, unless the user has chosen a range; an empty one is none."""
    if not os.environ.get(DISCOVERY_VARIABLE):
        os.environ[DISCOVERY_VARIABLE] = 'LOCALHOST'


def describe_node(node: Node) -> str:
    """Return the first line of a node's log: version, name, and where it can be found."""
    version = f'stickslip_ros {stickslip_ros.__version__}, ROS 2 {_distribution()}'
    found = os.environ.get(DISCOVERY_VARIABLE) or 'SUBNET'
    domain = node.context.get_domain_id()
    return f'{version}: {node.get_fully_qualified_name()}, domain {domain}, discovery {found}'


def _distribution() -> str:
    """Return the distribution of ROS 2: that of the environment, or that of the wheels."""
    wheels = Path(rclpy.__file__).parents[1].glob('ros_*_rclpy-*.dist-info')
    named = os.environ.get('ROS_DISTRO') or next((each.name for each in wheels), '')
    return named.removeprefix('ros_').partition('_')[0] or 'of unknown name'


def guard_services(node: Node) -> None:
    """
    Have every service that a node offers by now refuse what rclpy does not expect.

    What rclpy raises in a service of its own, such as for a parameter of a type that does not
    exist or for a transition that does not fit the state, would end the executor, and with it
    the process; whoever asked would wait for ever.

    """
    for service in node.services:
        service.callback = partial(_call_guarded, node, service, service.callback)


def _call_guarded(node: Node, service: Service, callback: Any, request: Any, response: Any) -> Any:
    try:
        return callback(request, response)
    except Exception as error:  # noqa: BLE001 - rclpy may raise what it likes
        node.get_logger().warning(f'{service.srv_name.rpartition("/")[2]} refused: {error}')
        return _refusal(request, response, SetParametersResult(reason=str(error)))


def _refusal(request: Any, response: Any, result: SetParametersResult) -> Any:
    """Return an answer in which nothing has succeeded, but what was set before the bad one."""
    if isinstance(request, SetParameters.Request):
        done = list(response.results)
        response.results = done + [result] * (len(request.parameters) - len(done))
        return response
    if isinstance(request, SetParametersAtomically.Request):
        return SetParametersAtomically.Response(result=result)
    return type(response)()


def run_node(name: str, make: Callable[[], Node], arguments: Sequence[str] | None) -> int:
    """
    Run a node until SIGINT or SIGTERM; the process is to end with it.

    The node is made, spun and destroyed by a thread of its own. The calling thread, which is the
    only one to see signals, does nothing but wait: whatever the node does, it ends.

    Return its exit status: ENDED, REFUSED or CUT. ``make`` makes the node, in the default context;
    ``name`` is that of the executable, for messages. Without ROS arguments those of the command
    line are taken.

    """
    ending = end_on_signals()
    wake_in_time()
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
            status = _start(name, make, ending, executor)
            ending.wait()
            ignore_signals()
            executor.create_task(lambda: None)  # work, for which the executor looks around
            return _await_end(name, status)
    finally:
        rclpy.try_shutdown()


def _start(
    name: str, make: Callable[[], Node], ending: Ending, executor: Executor
) -> 'Future[int]':
    """Run a node in a thread; give what will be its status, or what has ended it."""
    status: Future[int] = Future()

    def run() -> None:
        try:
            status.set_result(_run(name, make, ending, executor))
        except BaseException as error:  # noqa: BLE001 - who waits for the status gets it
            status.set_exception(error)
        finally:
            ending.set()

    Thread(target=run, name='node', daemon=True).start()
    return status


def _run(name: str, make: Callable[[], Node], ending: Ending, executor: Executor) -> int:
    try:
        node = make()
    except (StickSlipError, RuntimeError) as error:
        return _refuse(name, error)
    gc.freeze()  # see GarbageFreezer
    spin_until(ending, node, executor)
    return ENDED


def _await_end(name: str, status: 'Future[int]') -> int:
    """Return the status of a node that is to end; leave the process where it does not."""
    signal.alarm(LAST_S)
    asked_s = time.monotonic()
    while not wait([status], LOOK_S).done:
        waited_s = time.monotonic() - asked_s
        if waited_s > PATIENCE_S and is_interruptible():
            _leave(name, 'ended before it had started', ENDED)
        if waited_s > CLOSING_S:
            _leave(name, f'not closed within {CLOSING_S:g} s; {HINT}', CUT)
    try:
        return status.result()
    except StillBusy as error:
        _leave(name, f'{error}; {HINT}', CUT)


def _refuse(name: str, error: Exception) -> int:
    sys.stderr.write(f'{name}: {error}\n')
    return REFUSED


def _leave(name: str, why: str, status: int) -> NoReturn:
    """End the process at once: threads that never end would keep it alive."""
    sys.stderr.write(f'{name}: {why}\n')
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    os._exit(status)
