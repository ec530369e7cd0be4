# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Two hosts on this machine: network namespaces, joined by a relay that delays and drops frames.

    python relay.py join SOCKET DELAY_S LOSS SEED
    python relay.py host SOCKET ADDRESS COMMAND...

``join`` relays between the two hosts that come to its socket, until its standard input ends, and
then prints the frames of each direction, relayed and dropped. ``host`` runs a command in a network
of its own (``unshare`` of util-linux), whose only way out is the relay.

"""

import fcntl
import os
import random
import select
import socket
import struct
import subprocess
import sys
import time
from collections import deque

HOST = ('unshare', '--map-root-user', '--net', sys.executable, __file__)
"""Words in front of ``host``."""
TAP = 'tap0'
FRAME_MAX = 65536
"""Bytes of the longest frame."""
_TUNSETIFF, _IFF_TAP, _IFF_NO_PI = 0x400454CA, 0x0002, 0x1000


def obstacle() -> str:
    """Return why this machine allows no second host, or nothing."""
    try:
        tried = subprocess.run([*HOST, 'try'], capture_output=True, text=True, check=False)
    except FileNotFoundError as error:
        return str(error)
    last = (tried.stderr.splitlines() or [f'status {tried.returncode}'])[-1]
    return last if tried.returncode else ''


def _plug_in(address: str) -> int:
    """Give this network an address, and return the far end of its cable."""
    cable = os.open('/dev/net/tun', os.O_RDWR | os.O_NONBLOCK)
    fcntl.ioctl(cable, _TUNSETIFF, struct.pack('16sH22x', TAP.encode(), _IFF_TAP | _IFF_NO_PI))
    for words in (
        'link set lo up',
        f'addr add {address}/24 dev {TAP}',
        f'link set {TAP} up',
        f'route add 224.0.0.0/4 dev {TAP}',
    ):
        subprocess.run(['ip', *words.split()], check=True)
    return cable


def host(path: str, address: str, *command: str) -> None:
    """Become a command whose network is a cable to the relay."""
    cable = _plug_in(address)
    with socket.socket(socket.AF_UNIX) as relay:
        relay.connect(path)
        socket.send_fds(relay, [b' '], [cable])
    os.close(cable)
    os.execvp(command[0], command)


class Line:
    """One direction between two cables."""

    def __init__(self, entry: int, end: int, delay_s: float, loss: float, seed: int) -> None:
        self.entry, self._end, self._delay_s, self._loss = entry, end, delay_s, loss
        self._chance = random.Random(seed)
        self._on_its_way: deque[tuple[float, bytes]] = deque()
        self.relayed = self.dropped = 0

    def take(self) -> None:
        """Take a frame from the entry, or drop it."""
        frame = os.read(self.entry, FRAME_MAX)
        if self._chance.random() < self._loss:
            self.dropped += 1
        else:
            self._on_its_way.append((time.monotonic() + self._delay_s, frame))

    def deliver(self) -> float:
        """Deliver what is due; return the time until the next frame is due, s."""
        while self._on_its_way:
            wait_s = self._on_its_way[0][0] - time.monotonic()
            if wait_s > 0.0:
                return wait_s
            os.write(self._end, self._on_its_way.popleft()[1])
            self.relayed += 1
        return 1.0


def join(path: str, delay_s: str, loss: str, seed: str) -> None:
    """Relay between two hosts until the standard input ends."""
    cables: list[int] = []
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(path)
        server.listen()
        while len(cables) < 2:
            with server.accept()[0] as arrived:
                cables += socket.recv_fds(arrived, 1, 1)[1]
    one, other = cables
    lines = [
        Line(one, other, float(delay_s), float(loss), int(seed)),
        Line(other, one, float(delay_s), float(loss), int(seed) + 1),
    ]
    stdin = sys.stdin.fileno()
    while True:
        wait_s = min(line.deliver() for line in lines)
        ready, _, _ = select.select([stdin, *cables], [], [], wait_s)
        for line in lines:
            if line.entry in ready:
                line.take()
        if stdin in ready:
            break
    sys.stdout.write(f'{[(line.relayed, line.dropped) for line in lines]}\n')


if __name__ == '__main__':
    verb, *words = sys.argv[1:]
    if verb == 'join':
        join(*words)
    elif verb == 'host':
        host(*words)
    else:
        _plug_in('10.77.1.9')
