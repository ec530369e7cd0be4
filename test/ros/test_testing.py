# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""What testers get: domains that nobody shares, and waits that end when no answer can come."""

import os
import socket
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from processes import is_gone, processor_ticks, progress_of, start_process
from waiting import wait_until

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


LITTLE = """
import signal, sys
from pathlib import Path
from processes import start_process

def test_for_ever(tmp_path):
    demo = Path(sys.executable).with_name('stickslip')
    start_process([demo, 'demo', '--output', tmp_path])
    signal.pause()
"""


def is_drive(pid: int) -> bool:
    """Return whether a process is the node of a drive."""
    try:
        return b'stickslip_ros.ros.node' in Path(f'/proc/{pid}/cmdline').read_bytes()
    except OSError:
        return False


@pytest.mark.slow
def test_what_a_killed_run_has_started_ends_with_it(
    tmp_path: Path, ros_domain: int, compiled_kernels: None
):
    (tmp_path / 'test_little.py').write_text(LITTLE)
    words = [sys.executable, '-m', 'pytest', '-p', 'conftest', '-n', '1', 'test_little.py']
    here = {'PYTHONPATH': str(Path(__file__).parents[1]), 'ROS_DOMAIN_ID': str(ros_domain)}
    environment, nothing = {**os.environ, **here}, subprocess.DEVNULL
    with start_process(words, cwd=tmp_path, env=environment, stdout=nothing) as run:
        wait_until(
            lambda: any(map(is_drive, processor_ticks(run.pid))),
            'the drive of the demo of a worker of pytest',
            progress=progress_of(run),
        )
        all_of_it = [*processor_ticks(run.pid)]
        run.kill()
    wait_until(lambda: all(map(is_gone, all_of_it)), 'the end of all processes')


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
