"""The node stays on this host unless the user wants more; a profile of DDS closes its sockets."""

import os
import re
import signal
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest
from executables import DRIVE, end

from stickslip_ros.ros.executable import DISCOVERY_VARIABLE, stay_on_this_host

PROFILE = Path(__file__).resolve().parents[2] / 'config/loopback.xml'
EVERYWHERE = '00000000'
"""The address 0.0.0.0 as /proc/net/udp writes it."""
FIRST_PORT, PORTS_PER_DOMAIN = 7400, 250
"""Where the standard of DDS puts the ports of a domain."""


@pytest.mark.parametrize(
    ('given', 'kept'), [(None, 'LOCALHOST'), ('', 'LOCALHOST'), ('SUBNET', 'SUBNET')]
)
def test_discovery_leaves_this_host_only_if_it_was_told_to(
    monkeypatch: pytest.MonkeyPatch, given: str | None, kept: str
):
    monkeypatch.setenv(DISCOVERY_VARIABLE, given or '')
    if given is None:
        monkeypatch.delenv(DISCOVERY_VARIABLE)
    stay_on_this_host()
    assert os.environ[DISCOVERY_VARIABLE] == kept


def udp_sockets(pid: int) -> list[tuple[str, int]]:
    """Give address, in hexadecimal digits, and port of each UDP socket of a process."""
    own = set()
    for each in Path(f'/proc/{pid}/fd').iterdir():
        with suppress(OSError):  # it may be closed meanwhile
            own.update(re.findall(r'^socket:\[(\d+)\]$', str(each.readlink())))
    rows = [line.split() for line in Path(f'/proc/{pid}/net/udp').read_text().splitlines()[1:]]
    ends = [row[1].split(':') for row in rows if row[9] in own]
    return [(address, int(port, 16)) for address, port in ends]


@pytest.mark.parametrize('is_closed', [False, True], ids=['as it is', 'with the profile'])
def test_the_profile_binds_the_ports_of_the_domain_to_this_host(
    start: Callable, meet: Callable, ros_domain: int, is_closed: bool
):
    names = ('FASTRTPS_DEFAULT_PROFILES_FILE', 'FASTDDS_DEFAULT_PROFILES_FILE')  # Jazzy, Kilted
    words = [f'{name}={PROFILE}' for name in names] if is_closed else []
    process = start('env', *words, *DRIVE)
    operator = meet()  # has no profile, and hears the drive
    first = FIRST_PORT + PORTS_PER_DOMAIN * ros_domain
    of_domain = range(first, first + PORTS_PER_DOMAIN)
    addresses = {address for address, port in udp_sockets(process.pid) if port in of_domain}
    assert addresses == {'0100007F' if is_closed else EVERYWHERE}
    operator.command('voltage', 50.0)
    assert operator.wait_for_event('voltage', 0)['result'] == 'DONE'
    assert end(process, signal.SIGINT)[0] == 0
