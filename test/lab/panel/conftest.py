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
def link(ros_domain: int) -> Iterator[Link]:
    """Give a client that waits for a drive."""
    link = Link(domain=ros_domain)
    yield link
    link.close()


@pytest.fixture
def wait(link: Link) -> Callable[..., None]:
    """Give a function that waits for a condition of the page's state."""

    def news() -> tuple[object, ...]:
        """Return what changes when the drive does something, not with its time alone."""
        told = link.state()
        return told['lifecycle'], told['bits'], told['drives'], told['events'], told['notes']

    def wait_for(condition: Callable[[dict], object]) -> None:
        wait_until(lambda: condition(link.state()), 'the state', progress=news)

    return wait_for
