# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Start and end of the executables: discovery on this host, guarded services, cleanup."""

import gc
import os
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from io import UnsupportedOperation
from itertools import pairwise
from pathlib import Path
from typing import Any

import rclpy
from rcl_interfaces.msg import SetParametersResult
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.context import Context
from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.lifecycle import LifecycleNode, LifecycleState, ManagedEntity, TransitionCallbackReturn
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.service import Service
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future
from rclpy.utilities import remove_ros_args

import stickslip_ros
from stickslip_ros.errors import StickSlipError, printable, quoted
from stickslip_ros.parameters.yaml_form import check_parameter_file
from stickslip_ros.process.signals import CUT, ENDED, RECOVER, REFUSED, begin, leave
from stickslip_ros.process.stopping import (
    StillBusy,
    is_stop_requested,
    stop_if_asked,
    wake_on_stop,
)
from stickslip_ros.runtime.pacing import wake_in_time

DISCOVERY_VARIABLE = 'ROS_AUTOMATIC_DISCOVERY_RANGE'
SPIN_S = 3600.0
"""Limit of a wait: without one, EventsExecutor looks all the time (rclpy 7.1.6, 9.1.2)."""


def stay_on_this_host() -> None:
    """Limit discovery to this host unless the user has chosen a range; empty means no choice."""
    if not os.environ.get(DISCOVERY_VARIABLE):
        os.environ[DISCOVERY_VARIABLE] = 'LOCALHOST'


def describe_node(node: Node) -> str:
    """Return the first line of a node's log: version, name, domain, discovery range."""
    wheels = Path(rclpy.__file__).parents[1].glob('ros_*_rclpy-*.dist-info')
    named = os.environ.get('ROS_DISTRO') or next((each.name for each in wheels), '')
    distribution = named.removeprefix('ros_').partition('_')[0] or 'of unknown name'
    version = f'stickslip_ros {stickslip_ros.__version__}, ROS 2 {distribution}'
    found = os.environ.get(DISCOVERY_VARIABLE) or 'SUBNET'
    domain = node.context.get_domain_id()
    return f'{version}: {node.get_fully_qualified_name()}, domain {domain}, discovery {found}'


def guard_services(node: Node) -> None:
    """
    Make every present service of a node refuse requests for which rclpy raises an error.

    An error of rclpy's own services, as for a parameter of an unknown type or a transition that
    does not fit the state, would end the process, and the client would wait for ever.

    """
    for service in node.services:
        service.callback = partial(_call_guarded, node, service, service.callback)


def _call_guarded(node: Node, service: Service, callback: Any, request: Any, response: Any) -> Any:
    """
    Answer a request; if rclpy raises an error, answer that nothing has succeeded.

    rclpy sets parameters one after the other: it may refuse values that only fit together, or take
    half of them. So all values of a request are first set together. If that is refused, each
    value is set or refused by itself.

    """
    if isinstance(request, SetParameters.Request) and request.parameters:
        with suppress(Exception):
            together = [Parameter.from_parameter_msg(each) for each in request.parameters]
            result = node.set_parameters_atomically(together)
            if result.successful:
                return SetParameters.Response(results=[result] * len(together))
    try:
        return callback(request, response)
    except Exception as error:  # noqa: BLE001 - rclpy may raise anything
        node.get_logger().warning(f'{service.srv_name.rpartition("/")[2]} refused: {error}')
        result = SetParametersResult(reason=str(error))
    if isinstance(request, SetParameters.Request):  # values before the bad one stay set
        done = list(response.results)
        response.results = done + [result] * (len(request.parameters) - len(done))
        return response
    if isinstance(request, SetParametersAtomically.Request):
        return SetParametersAtomically.Response(result=result)
    return type(response)()


def run_node(name: str, make: Callable[[], Node], arguments: Sequence[str] | None) -> int:
    """
    Run a node until a signal or a request ends work; the process (see `process`) ends with it.

    Return its exit status: ENDED, REFUSED or CUT. ``make`` makes the node in the default context;
    ``name`` is the name of the executable, for messages. Without ROS arguments, those of the
    command line count.

    """
    begin()
    wake_in_time()
    stay_on_this_host()
    try:
        stop_if_asked()
        words = list(sys.argv if arguments is None else arguments)
        try:
            for option, path in pairwise(words):
                if option == '--params-file':
                    check_parameter_file(Path(path))
            _refuse_unknown_words(words)  # reads the parameter files too
            rclpy.init(args=words, signal_handler_options=SignalHandlerOptions.NO)
            node = make()
        except (StickSlipError, RuntimeError) as error:  # the base of RCLError
            sys.stderr.write(f'{name}: {printable(" ".join(str(error).split()))}\n')
            return REFUSED
        gc.freeze()  # see GarbageFreezer
        gc.enable()
        spin_until_stopped(node)
    except KeyboardInterrupt:  # while it compiled
        leave(name, 'ended before it had started', ENDED)
    except StillBusy as error:
        leave(name, f'{error}; {RECOVER}', CUT)
    finally:
        rclpy.try_shutdown()
    return ENDED


def _refuse_unknown_words(words: list[str]) -> None:
    """Refuse arguments that are not for ROS, or that ROS cannot read."""
    hint = 'put parameters and names after --ros-args, see --help'
    try:
        [_, *others] = remove_ros_args(words)
    except rclpy_implementation.UnknownROSArgsError as error:
        raise StickSlipError(f'{error} is not known to ROS; {hint}') from None
    except UnicodeEncodeError as error:
        raise StickSlipError(f'{quoted(error.object)} is not text in UTF-8; use UTF-8') from None
    if others:
        raise StickSlipError(f'{quoted(others[0])} is not known; {hint}')


def open_executor(context: Context) -> Executor:
    """Return the executor of the least cost for a node without guard conditions."""
    try:
        from rclpy.experimental import EventsExecutor  # noqa: PLC0415

        return EventsExecutor(context=context)
    except (ImportError, UnsupportedOperation):  # rclpy is older, or stderr is no file
        # It collects all entities of the node for each message: at 1 kHz half a processor.
        return SingleThreadedExecutor(context=context)


def end_node(executor: Executor, *nodes: Node) -> None:
    """
    End an executor that no thread spins any more, and its nodes, in the order that is safe.

    The executor first removes the nodes, and with ``shutdown`` the rest of its last wait; then
    the nodes are destroyed. Do not call this, nor ``shutdown`` alone, while another thread spins:
    rclpy destroys the guard condition of a wait that is about to begin. Of 480 executors that
    were shut down while they spun, 35 raised InvalidHandle in their thread and 5 to 8 never ended
    (rclpy 7.1.6 and 9.1.2). So the spinning thread looks at a flag, and is joined first.

    rclpy leaves the services of a lifecycle node in the graph until the node is collected, or for
    ever if a traceback holds it. They are destroyed here. Otherwise the next node would have a
    double, and a client that misses half of the double's end never finds its own service ready.

    """
    for node in nodes:
        executor.remove_node(node)
    executor.shutdown()
    for node in nodes:
        node.destroy_node()
        if isinstance(node, LifecycleNode):
            node._state_machine.destroy_when_not_in_use()  # noqa: SLF001


def spin(executor: Executor, until: Future, limit_s: float) -> None:
    """
    Spin until a future is done, a time is over, or an entity was destroyed.

    EventsExecutor keeps the events of an entity that a callback destroys, and then raises
    InvalidHandle (rclpy 7.1.6); SingleThreadedExecutor passes over them.

    """
    with suppress(rclpy_implementation.InvalidHandle):
        executor.spin_until_future_complete(until, timeout_sec=limit_s)


def spin_until_stopped(node: Node) -> None:
    """Run a node until work is asked to end, then destroy it; errors of callbacks are raised."""
    executor, stopped = open_executor(node.context), Future()
    executor.add_node(node)
    try:
        with wake_on_stop(lambda: stopped.set_result(None)):
            while node.context.ok() and not is_stop_requested():
                spin(executor, stopped, SPIN_S)
    finally:
        end_node(executor, node)


class GarbageFreezer(ManagedEntity):  # type: ignore[misc]
    """
    Exempts the objects of a configured lifecycle node from garbage collection.

    A full collection looks at every object, and the compiled kernels have more than 100 000.
    Without the exemption the drive stands still for 40 to 90 ms about ten seconds after its start.

    """

    def on_configure(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Collect the garbage of the last configuration, and exempt all other objects."""
        gc.unfreeze()
        gc.collect()
        gc.freeze()
        return TransitionCallbackReturn.SUCCESS
