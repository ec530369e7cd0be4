"""A ROS domain of its own for every test process, so that none receives another."""

import fcntl
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from stickslip_ros.errors import StickSlipError
from stickslip_ros.ros.executable import DISCOVERY_VARIABLE

DOMAINS = range(1, 21)


@contextmanager
def reserve_domain() -> Iterator[int]:
    """
    Give a ROS domain that no other test process of this machine has, on this host only.

    Raises
    ------
    StickSlipError
        If all are taken.

    """
    for number in DOMAINS:
        with Path(tempfile.gettempdir(), f'stickslip_ros_domain_{number}').open('w') as file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                continue
            with _stay_on_this_host():
                yield number
            return
    limits = f'{DOMAINS[0]} to {DOMAINS[-1]}'
    raise StickSlipError(f'all ROS domains for tests, {limits}, are taken; end a test run')


@contextmanager
def _stay_on_this_host() -> Iterator[None]:
    """Limit discovery to this host, whatever the user has chosen outside of tests."""
    chosen = os.environ.pop(DISCOVERY_VARIABLE, None)
    os.environ[DISCOVERY_VARIABLE] = 'LOCALHOST'
    try:
        yield
    finally:
        del os.environ[DISCOVERY_VARIABLE]
        if chosen is not None:
            os.environ[DISCOVERY_VARIABLE] = chosen
