# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The executables as processes: how they are started, and how they ended."""

import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from itertools import cycle
from pathlib import Path

#: A process compiles nothing here, but loads kernels and finds its peers.
END_TIMEOUT_S = 60.0
BIN = Path(sys.executable).parent
DRIVE = (str(BIN / 'drive'),)
CLI_DRIVE = (str(BIN / 'stickslip'), 'drive')


def end(process: subprocess.Popen[str], *signals: int) -> tuple[int, str]:
    """Send signals; give exit status and what stands on stderr."""
    for number in signals:
        process.send_signal(number)
    _, errors = process.communicate(timeout=END_TIMEOUT_S)
    return process.returncode, errors


def await_handlers(process: subprocess.Popen[str]) -> None:
    """Wait until an executable handles SIGTERM, which Python by itself does not."""
    status = Path(f'/proc/{process.pid}/status')
    deadline_s = time.monotonic() + END_TIMEOUT_S
    while time.monotonic() < deadline_s and process.poll() is None:
        [caught] = re.findall(r'^SigCgt:\s*(\w+)', status.read_text(), re.MULTILINE)
        if int(caught, 16) >> (signal.SIGTERM - 1) & 1:
            return
        time.sleep(1e-3)
    raise TimeoutError(f'{process.args!r} does not handle SIGTERM; status {process.poll()}')


def await_network(process: subprocess.Popen[str]) -> None:
    """
    Wait until a process has threads of DDS, unless it ends.

    Who opens a context before it may hear of it only with the next announcement, 3 s later.

    """
    deadline_s = time.monotonic() + END_TIMEOUT_S
    while process.poll() is None:
        names = []
        with suppress(OSError):  # a thread may end meanwhile
            names += [
                name.read_text() for name in Path(f'/proc/{process.pid}/task').glob('*/comm')
            ]
        if any(name.startswith('dds') for name in names):
            return
        if time.monotonic() > deadline_s:
            raise TimeoutError(f'{process.args!r} has no threads of DDS')
        time.sleep(1e-2)


def pelt(process: subprocess.Popen[str], pauses_s: Iterator[float]) -> tuple[int, str]:
    """Send SIGINT and SIGTERM until a process is gone; give exit status and stderr."""
    deadline_s = time.monotonic() + END_TIMEOUT_S
    numbers = cycle((signal.SIGINT, signal.SIGTERM))
    while process.poll() is None and time.monotonic() < deadline_s:
        process.send_signal(next(numbers))
        time.sleep(next(pauses_s))
    return end(process)
