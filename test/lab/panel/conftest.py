# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""What the tests of the panel share: logs out of the home folder, and links to drives."""

from collections.abc import Callable, Iterator

import pytest
from waiting import wait_until

from stickslip_ros.lab.panel.link import Link


@pytest.fixture(scope='session', autouse=True)
def _surroundings(quiet_ros: None) -> None:
    """Have what the machine has set up for ROS left out of every test."""


@pytest.fixture
def eventually() -> Callable[[Callable[[], object], str], None]:
    """Give what waits until a condition holds."""
    return wait_until


@pytest.fixture
def link(ros_domain: int) -> Iterator[Link]:
    """Give a client that waits for a drive."""
    link = Link(domain=ros_domain)
    yield link
    link.close()


@pytest.fixture
def wait(link: Link) -> Callable[..., None]:
    """Give what waits for a condition of the page's state, and says that state if it fails."""

    def wait_for(condition: Callable[[dict], object]) -> None:
        try:
            wait_until(lambda: condition(link.state()), 'the state')
        except TimeoutError:
            raise AssertionError(link.state()) from None

    return wait_for
