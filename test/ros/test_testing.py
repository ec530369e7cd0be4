# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""What testers get: domains that nobody shares, and waits that end when no answer can come."""

import os
import socket
import subprocess
from collections.abc import Callable

import pytest

from stickslip_ros.errors import StickSlipError
from stickslip_ros.lab.cli.demo import await_start
from stickslip_ros.ros.executable import DISCOVERY_VARIABLE
from stickslip_ros.ros.guard import Summons
from stickslip_ros.testing import reserve_domain, stand
from stickslip_ros.testing.stand import FIRST_PORT, PORTS_PER_DOMAIN, Stand


def test_every_reserved_domain_is_another_one_and_can_be_had_again(ros_domain: int):
    with reserve_domain() as one, reserve_domain() as other:
        assert len({ros_domain, one, other}) == 3
    with reserve_domain() as again:
        assert again not in {ros_domain, None}


def test_where_all_domains_are_taken_that_is_said(
    monkeypatch: pytest.MonkeyPatch, ros_domain: int
):
    monkeypatch.setattr(stand, 'DOMAINS', range(ros_domain, ros_domain + 1))
    with pytest.raises(StickSlipError, match='are taken; end a test run'), reserve_domain():
        pass


def test_a_domain_in_which_a_program_speaks_is_not_given(monkeypatch: pytest.MonkeyPatch):
    with reserve_domain() as free:
        monkeypatch.setattr(stand, 'DOMAINS', range(free, free + 1))
    with socket.socket(type=socket.SOCK_DGRAM) as program:
        program.bind(('127.0.0.1', FIRST_PORT + PORTS_PER_DOMAIN * free + 10))
        with pytest.raises(StickSlipError, match='are taken'), reserve_domain():
            pass
    with reserve_domain() as again:
        assert again == free


@pytest.mark.parametrize('chosen', [None, 'SUBNET'])
def test_discovery_stays_on_this_host_while_a_domain_is_reserved(
    monkeypatch: pytest.MonkeyPatch, chosen: str | None
):
    monkeypatch.setenv(DISCOVERY_VARIABLE, chosen or '')
    if chosen is None:
        monkeypatch.delenv(DISCOVERY_VARIABLE)
    with reserve_domain():
        assert os.environ[DISCOVERY_VARIABLE] == 'LOCALHOST'
    assert os.environ.get(DISCOVERY_VARIABLE) == chosen


def test_what_ends_the_executor_of_the_drive_is_raised_where_the_test_waits(
    start_drive: Callable[..., Stand],
):
    def fail() -> None:
        raise ZeroDivisionError

    stand = start_drive({'autostart': False}, wait=False)
    Summons(stand.drive, fail).send()
    with pytest.raises(ZeroDivisionError):
        stand.operator.spin_until(lambda: False, 'nothing')
    stand.close()  # has nothing more to say


def test_a_drive_that_ends_while_the_demo_waits_is_reported_at_once_with_its_status(
    start_drive: Callable[..., Stand],
):
    operator = start_drive().operator
    process = subprocess.Popen(['cat'], stdin=subprocess.PIPE)  # in place of the drive's own
    await_start(operator, process)
    process.communicate()
    with pytest.raises(StickSlipError, match='the drive ended with status 0; see its log'):
        operator.spin_until(lambda: False, 'nothing')
