# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Between two hosts, 5 ms and some lost frames apart: what arrives, and what is told as lost."""

import json
import signal
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import relay
from executables import DRIVE, end
from far_side import BLOCK_S, LOAD_N, LOADS
from processes import finish, start_process
from waiting import wait_until

from stickslip_ros.recording.reader import Recording

pytestmark = pytest.mark.slow

DELAY_S = 5e-3
ROOT = Path(__file__).resolve().parents[2]
PROFILES = (  # of Jazzy and of Kilted
    f'FASTRTPS_DEFAULT_PROFILES_FILE={ROOT}/config/two_hosts.xml',
    f'FASTDDS_DEFAULT_PROFILES_FILE={ROOT}/config/two_hosts_kilted.xml',
)
FAR_SIDE = (sys.executable, ROOT / 'test/ros/far_side.py')
SURROUNDINGS = ('ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET', f'PYTHONPATH={ROOT / "test"}')


class Hosts:
    """Two hosts on a relay: a drive on the one, and a program that asks it on the other."""

    def __init__(self, start: Callable, relay_at: Path, loss: float) -> None:
        self._start, self._relay_at = start, relay_at
        words = (sys.executable, relay.__file__, 'join', relay_at, DELAY_S, loss, 1)
        self._relay = start_process(words, stdin=-1)
        wait_until(relay_at.exists, 'the relay')

    def on(self, number: int, *words: object, profile: bool = False) -> Any:
        """Start a program on a host."""
        given = SURROUNDINGS + PROFILES * profile
        host = [*relay.HOST, 'host', self._relay_at, f'10.77.1.{number}']
        return self._start('env', *given, *map(str, (*host, *words)))

    def ask(self, *words: object, profile: bool = False) -> list[dict[str, Any]]:
        """Run a program on the second host; return what it prints of each profile."""
        process = self.on(2, *FAR_SIDE, *words, profile=profile)
        output, errors = finish(process)
        assert process.returncode == 0, errors
        answer: list[dict[str, Any]] = json.loads(output)
        return answer

    def close(self) -> None:
        self._relay.communicate()


@pytest.fixture
def join(start: Callable, tmp_path: Path) -> Iterator[Callable[..., Hosts]]:
    """Give a function that joins two hosts by a relay that loses a share of the frames."""
    if why := relay.obstacle():
        pytest.skip(f'no second host here: {why}')
    joined: list[Hosts] = []

    def join_hosts(loss: float) -> Hosts:
        joined.append(Hosts(start, tmp_path / f'relay{len(joined)}', loss))
        return joined[-1]

    yield join_hosts
    for hosts in joined:
        hosts.close()


def shares(hosts: Hosts, *profiles: str, has_profile: bool) -> list[float]:
    """Return which share of the positions arrives on the second host."""
    every = f'sim.block:={BLOCK_S}'  # seldom enough for a reader on a busy host
    drive = hosts.on(1, *DRIVE, '--ros-args', '-p', every, profile=has_profile)
    arrived = hosts.ask('read', *profiles, profile=has_profile)
    drive.send_signal(signal.SIGTERM)
    output, _ = finish(drive)
    assert drive.returncode == 0
    assert 'XMLPARSER' not in output
    assert all(each['age_s'] > DELAY_S for each in arrived)
    return [each['share'] for each in arrived]


def test_a_short_reliable_queue_starves_where_best_effort_does_not(join: Callable):
    newest, short, long = shares(
        join(0.01), 'best_effort:10', 'reliable:10', 'reliable:1000', has_profile=False
    )
    assert newest > 0.9
    assert short < 0.6
    assert long > 0.9
    [helped] = shares(join(0.01), 'reliable:10', has_profile=True)
    assert helped > 1.5 * short


@pytest.mark.parametrize('depth', [10, 1000])
def test_each_load_arrives_or_is_told_as_lost(join: Callable, tmp_path: Path, depth: int):
    hosts = join(0.05)
    options = ('record.on_start:=true', 'record.trace:=false', 'record.name:=far')
    drive = hosts.on(1, *DRIVE, '--ros-args', *(word for each in options for word in ('-p', each)))
    [said] = hosts.ask('send', f'reliable:{depth}')
    assert end(drive, signal.SIGTERM)[0] == 0
    [path] = tmp_path.rglob('far.mcap')
    forces_n = Recording(path).series('command/load').value
    arrived = int((forces_n == LOAD_N).sum())
    lost = int(said.get('command/load lost', 0))
    assert arrived + lost == LOADS
    assert (lost > 0) == (depth == 10)
    assert float(said['command_age_median_s']) > DELAY_S
