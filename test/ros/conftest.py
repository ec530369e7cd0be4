# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""What the tests of the node share: drives beside the test or as processes, and operators."""

import gc
import os
import subprocess
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import pytest
from executables import await_network
from processes import start_process
from rclpy.context import Context

from stickslip_ros.parameters import Scalar
from stickslip_ros.testing import Operator, Stand, open_context

REPORT_S = 0.2
BLOCK_S = 0.01
"""Simulated time of a block, where no test asks for another."""


@pytest.fixture(scope='session', autouse=True)
def _surroundings(quiet_ros: None) -> None:
    """Have what the machine has set up for ROS left out of every test."""
    gc.collect()
    gc.freeze()  # a stand that is closed collects garbage: of its own, not all there was


@pytest.fixture
def default_blocks() -> None:
    """Have drives in real time keep the default of ``sim.block``."""


@pytest.fixture
def start_drive(request, start_drive) -> Callable[..., Stand]:
    """Give the function with longer blocks in real time, which take less of the processor."""
    if 'default_blocks' in request.fixturenames:
        return start_drive

    def start(
        parameters: Mapping[str, Scalar] | None = None, namespace: str = '', **options: Any
    ) -> Stand:
        given = dict(parameters or {})
        if not given.get('sim.lockstep'):
            given.setdefault('sim.block', BLOCK_S)
        return start_drive(given, namespace, **options)

    return start


@pytest.fixture
def stand(start_drive: Callable[..., Stand]) -> Stand:
    """Give the stand of the paper, active, with an operator who hears it."""
    return start_drive()


@pytest.fixture
def manual(start_drive: Callable[..., Stand]) -> Stand:
    """Give a stand that waits, unconfigured, for a lifecycle manager."""
    return start_drive({'autostart': False}, wait=False)


@pytest.fixture
def started() -> list[subprocess.Popen[str]]:
    """Give the processes that a test has started."""
    return []


@pytest.fixture
def start(ros_domain, tmp_path, started) -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Give a function that starts the executable; what still runs at the end is killed."""

    def start_one(*words: str) -> subprocess.Popen[str]:
        process = start_process(
            words,
            env={**os.environ, 'ROS_DOMAIN_ID': str(ros_domain)},
            cwd=tmp_path,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )
        started.append(process)
        return process

    yield start_one
    for process in started:
        process.kill()
        process.communicate()


@pytest.fixture
def meet(ros_domain, started) -> Iterator[Callable[..., Operator]]:
    """Give a function that gives an operator who hears the drive."""
    met: list[tuple[Operator, Context]] = []

    def meet_drive(namespace: str = '', *, wait: bool = True) -> Operator:
        for process in started:
            await_network(process)
        context = open_context(ros_domain, namespace)
        met.append((Operator(context), context))
        if wait:
            met[-1][0].wait_for_drive()
        return met[-1][0]

    yield meet_drive
    for operator, context in met:
        operator.close()
        context.try_shutdown()


@pytest.fixture
def frequent_diagnostics(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have drives report often, for tests that wait for some reports."""
    monkeypatch.setattr('stickslip_ros.ros.node.DIAGNOSTICS_PERIOD_S', REPORT_S)


@pytest.fixture(scope='session')
def perfect_sensors() -> dict[str, float]:
    """Give parameters of sensors without errors: a reading is the truth, to the bit."""
    names = ('noise_density', 'resolution', 'bandwidth')
    return {
        f'{sensor}.{name}': 0.0 for sensor in ('interferometer', 'load_cell') for name in names
    }
