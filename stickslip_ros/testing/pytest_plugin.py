# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Fixtures of pytest for tests of controllers.

They are not offered to every pytest of an environment, since they import ROS: a ``conftest.py``
asks for them with ``pytest_plugins = ['stickslip_ros.testing.pytest_plugin']``.

"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path

import pytest
import rclpy
from rclpy.signals import SignalHandlerOptions

from stickslip_ros.parameters import Scalar
from stickslip_ros.testing.stand import Stand, reserve_domain

NO_SIGNALS = SignalHandlerOptions.NO


@pytest.fixture(scope='session')
def ros_domain() -> Iterator[int]:
    """Give a ROS domain that nothing else on this machine uses, on this host only."""
    with reserve_domain() as number:
        yield number


@pytest.fixture(scope='session')
def compiled_kernels(pytestconfig: pytest.Config) -> None:
    """Compile missing kernels before the first drive, and so before any time limit."""
    # Tests without a drive do without the kernels.
    from stickslip_ros.instrument.compilation import compile_kernels  # noqa: PLC0415
    from stickslip_ros.kernels.kernel import compilation_reported  # noqa: PLC0415

    terminal = pytestconfig.pluginmanager.getplugin('terminalreporter')

    def report(done: int) -> None:
        if done == 0 and terminal is not None:
            terminal.write('\nstickslip_ros: compiling kernels, once\n', flush=True)

    with compilation_reported(report):
        compile_kernels()


@pytest.fixture
def start_drive(
    ros_domain: int,
    tmp_path: Path,
    compiled_kernels: None,  # noqa: ARG001 - before any time limit
) -> Iterator[Callable[..., Stand]]:
    """
    Give a function that starts a drive; it ends with the test and records into ``tmp_path``.

    The function takes parameters, as ``{'stand.preload': 0.3}``, and ``namespace`` and ``remaps``
    of Stand. With ``wait``, the default, the operator hears the drive when the function returns.
    A drive with ``sim.lockstep`` publishes ``/clock`` unless told otherwise; nodes made later
    without a context are in its domain and follow that clock. Between two drives of one test,
    close the first and call ``rclpy.try_shutdown``: a node that outlives a drive discovers the
    next one up to 3 s later, and one node in fifty never does (a fault of Fast DDS).

    """
    with ExitStack() as stack:

        def start(
            parameters: Mapping[str, Scalar] | None = None,
            namespace: str = '',
            *,
            wait: bool = True,
            remaps: Sequence[str] = (),
        ) -> Stand:
            given = {'record.directory': str(tmp_path), **(parameters or {})}
            lockstep = bool(given.get('sim.lockstep'))
            has_clock = bool(given.setdefault('sim.publish_clock', lockstep))
            if not rclpy.ok():
                follow = f'use_sim_time:={has_clock}'.lower()
                words = ['--ros-args', '-p', follow]
                words += ['-r', f'__ns:={namespace}'] if namespace else []
                rclpy.init(args=words, domain_id=ros_domain, signal_handler_options=NO_SIGNALS)
                stack.callback(rclpy.try_shutdown)
            stand = Stand(ros_domain, given, namespace=namespace, remaps=remaps)
            stack.callback(stand.close)
            if wait and lockstep:
                stand.operator.wait_for_topics()
            elif wait:
                stand.operator.wait_for_drive()
            return stand

        yield start


@pytest.fixture(name='drive')
def drive_in_lockstep(start_drive: Callable[..., Stand]) -> Stand:
    """Give a drive with default parameters in lockstep: it waits for `Stand.run_lockstep`."""
    return start_drive({'sim.lockstep': True})
