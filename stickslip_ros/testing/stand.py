# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A drive for a test, in a separate ROS domain, and an operator that commands it."""

import gc
import os
import socket
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.task import Future

from stickslip_ros.errors import StickSlipError
from stickslip_ros.parameters import Scalar
from stickslip_ros.process.stopping import stop_if_asked
from stickslip_ros.ros.client import open_context
from stickslip_ros.ros.executable import DISCOVERY_VARIABLE, end_node, open_executor, spin
from stickslip_ros.testing.lockstep import Lockstep
from stickslip_ros.testing.operator import LISTEN_DEPTH, TIMEOUT_S, Operator
from stickslip_ros.units import NS_PER_S

DOMAINS = range(1, 102)
"""Domains whose ports lie below the ephemeral ports of Linux."""
FIRST_PORT, PORTS_PER_DOMAIN = 7400, 250
"""First port of domain 0, and number of ports of a domain, by the standard of DDS."""
_SPIN_S = 0.02
HEARD_MAX = LISTEN_DEPTH // 2
"""Blocks after which the operator handles its messages: a topic may have several in one block."""


@contextmanager
def reserve_domain() -> Iterator[int]:
    """
    Give a ROS domain that nothing on this machine uses, on this host only.

    An abstract socket, which ends with its process, reserves the domain.

    Raises StickSlipError if all are taken.

    """
    for number in DOMAINS:
        with socket.socket(socket.AF_UNIX) as lock:
            try:
                lock.bind(f'\0stickslip_ros/domain/{number}')
            except OSError:
                continue
            if _is_used(number):
                continue
            chosen = os.environ.get(DISCOVERY_VARIABLE)
            os.environ[DISCOVERY_VARIABLE] = 'LOCALHOST'
            try:
                yield number
            finally:
                os.environ.pop(DISCOVERY_VARIABLE, None)
                if chosen is not None:
                    os.environ[DISCOVERY_VARIABLE] = chosen
            return
    limits = f'{DOMAINS[0]} to {DOMAINS[-1]}'
    raise StickSlipError(f'all ROS domains for tests, {limits}, are taken; end a test run')


def _is_used(domain: int) -> bool:
    """Return whether a program of this host has a port of a domain."""
    first = FIRST_PORT + PORTS_PER_DOMAIN * domain
    rows = [
        line.split()
        for table in Path('/proc/net').glob('udp*')
        for line in table.read_text(encoding='ascii').splitlines()[1:]
    ]
    ports = [int(row[1].rpartition(':')[2], 16) for row in rows]
    return any(port in range(first, first + PORTS_PER_DOMAIN) for port in ports)


class Stand:
    """
    A drive, its executor on a separate thread, and an operator that a test spins.

    The operator has a separate context, as it would in a separate process. An error that ends the
    executor of the drive is raised once, in a wait of the operator or in ``close``.

    Parameters
    ----------
    domain : int
        ROS domain.
    parameters : mapping of str to float, int, bool or str
        Values that differ from the defaults, as ``{'stand.preload': 0.3}``.
    namespace : str
        Namespace of the drive and of the operator, as ``/left``.
    remaps : sequence of str
        Further remapping rules of the drive, as ``command/voltage:=volts``.

    Attributes
    ----------
    drive : StickSlipDrive
        The node.
    operator : Operator
        Client that commands the drive.
    context : Context
        Context of the operator, for other nodes of the test: ``operator.add_node`` spins them.

    Raises
    ------
    StickSlipError
        If a parameter is not known or not allowed.

    """

    def __init__(
        self,
        domain: int,
        parameters: Mapping[str, Scalar],
        *,
        namespace: str = '',
        remaps: Sequence[str] = (),
    ) -> None:
        # An operator alone needs no kernels, which a drive loads.
        from stickslip_ros.ros.node import StickSlipDrive  # noqa: PLC0415

        self.domain = domain
        self._crash: Exception | None = None
        self._ended = threading.Event()
        self._context = open_context(domain, namespace, remaps)
        self.drive: StickSlipDrive = StickSlipDrive(
            context=self._context,
            parameter_overrides=[Parameter(name, value=v) for name, v in parameters.items()],
        )
        self._executor = open_executor(self._context)
        self._executor.add_node(self.drive)
        self._thread = threading.Thread(target=self._spin, name='executor of the drive')
        self._thread.start()
        self.context = open_context(domain, namespace)
        self.operator = Operator(self.context, self.drive.get_name())
        self.operator.check, self.operator.tell = self._check, self._tell
        self._spun: dict[Node, SingleThreadedExecutor] = {}

    def run_lockstep(
        self, node: Node, simulated_s: float, *, timeout_s: float = TIMEOUT_S
    ) -> None:
        """
        Run an unmodified node beside the drive for some simulated time.

        The drive, which has ``sim.lockstep``, gets its next block after all callbacks of the node
        have returned and all its service calls to the drive were answered. So the result depends
        on neither the machine nor its load: two runs give the same bytes. No other node may send
        commands or grants meanwhile. The messages for the operator are handled at the end.

        Raises StickSlipError if there was no progress, with the node's action and line; or if the
        result would depend on the wall clock.

        Parameters
        ----------
        node : Node
            A node of the domain of this stand, whose timers follow ``use_sim_time``; it is spun
            here alone.
        simulated_s : float
            Simulated time from now on, up to the end of a block, s.
        timeout_s : float
            Wall-clock time without progress after which the run is given up, s.

        """
        session, executor = self.drive.session, self._spun.get(node)
        if executor is None:
            executor = self._spun[node] = SingleThreadedExecutor(context=node.context)
            executor.add_node(node)
        end_ns = session.bench.time_ns + round(simulated_s * NS_PER_S)
        while session.bench.time_ns < end_ns:
            pause_ns = session.bench.time_ns + HEARD_MAX * session.parameters.block_ns
            lockstep = Lockstep(self.drive, node, executor)
            try:
                lockstep.run(min(pause_ns, end_ns), self._check, timeout_s)
            finally:
                if lockstep.is_stuck:
                    del self._spun[node]  # a callback of it never returns
            self.operator.catch_up()

    def close(self) -> None:
        """End the drive as its executable does, then leave; a second call does nothing."""
        if self._ended.is_set():
            return
        self._ended.set()
        self._thread.join()
        end_node(self._executor, self.drive)
        self._context.try_shutdown()
        for node, executor in self._spun.items():
            executor.remove_node(node)
            executor.shutdown()
        self.operator.close()
        self.context.try_shutdown()
        del self.drive, self.operator, self._executor, self._spun
        gc.collect()
        self._check()

    def _tell(self) -> str:
        """Return the state of the drive, or its failure, in words."""
        try:
            return self.drive.session.state
        except StickSlipError as error:
            return str(error)

    def _spin(self) -> None:
        try:
            while not self._ended.is_set():
                spin(self._executor, Future(), _SPIN_S)
        except Exception as error:  # noqa: BLE001 - it is raised where the test waits
            self._crash = error

    def _check(self) -> None:
        stop_if_asked()
        crash, self._crash = self._crash, None
        if crash is not None:
            raise crash
