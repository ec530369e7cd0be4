"""
Fixtures of pytest for tests of controllers.

They are not offered to every pytest of an environment, since they import ROS: a ``conftest.py``
asks for them with ``pytest_plugins = ['stickslip_ros.testing.pytest_plugin']``.

"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path

import pytest

from stickslip_ros.parameters import Scalar
from stickslip_ros.testing.stand import Stand, reserve_domain


@pytest.fixture(scope='session')
def ros_domain() -> Iterator[int]:
    """Give a ROS domain that no other test process of this machine has, on this host only."""
    with reserve_domain() as number:
        yield number


@pytest.fixture
def start_drive(ros_domain: int, tmp_path: Path) -> Iterator[Callable[..., Stand]]:
    """
    Give a function that starts a drive, which ends with the test and records into ``tmp_path``.

    It takes parameters, as ``{'stand.preload': 0.3}``, and ``namespace`` and ``remaps`` of Stand.
    With ``wait``, the default, the operator hears the drive when the function returns.

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
            stand = Stand(ros_domain, given, namespace=namespace, remaps=remaps)
            stack.callback(stand.close)
            if wait and given.get('sim.lockstep'):
                stand.operator.wait_for_topics()
            elif wait:
                stand.operator.wait_for_drive()
            return stand

        yield start


@pytest.fixture
def drive(start_drive: Callable[..., Stand]) -> Stand:
    """Give a drive with default parameters in lockstep: it waits for a LockstepClient."""
    return start_drive({'sim.lockstep': True})
