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

from processes import finish, progress_of
from waiting import wait_until

BIN = Path(sys.executable).parent
DRIVE = (str(BIN / 'drive'),)
CLI_DRIVE = (str(BIN / 'stickslip'), 'drive')


def end(process: subprocess.Popen[str], *signals: int) -> tuple[int, str]:
    """Send signals; give exit status and what stands on stderr."""
    for number in signals:
        process.send_signal(number)
    _, errors = finish(process)
    return process.returncode, errors


def await_handlers(process: subprocess.Popen[str]) -> None:
    """Wait until an executable handles SIGTERM, which Python by itself does not."""
    status = Path(f'/proc/{process.pid}/status')

    def does() -> bool:
        assert process.poll() is None, process.communicate()
        [caught] = re.findall(r'^SigCgt:\s*(\w+)', status.read_text(), re.MULTILINE)
        return bool(int(caught, 16) >> (signal.SIGTERM - 1) & 1)

    wait_until(does, f'handlers of {process.args!r}', progress=progress_of(process))


def await_network(process: subprocess.Popen[str]) -> None:
    """
    Wait until a process has threads of DDS, unless it ends.

    Who opens a context before it may hear of it only with the next announcement, 3 s later.

    """

    def has_or_ended() -> bool:
        names = []
        with suppress(OSError):  # a thread may end meanwhile
            names += [
                name.read_text() for name in Path(f'/proc/{process.pid}/task').glob('*/comm')
            ]
        return process.poll() is not None or any(name.startswith('dds') for name in names)

    wait_until(has_or_ended, f'threads of DDS of {process.args!r}', progress=progress_of(process))


def pelt(process: subprocess.Popen[str], pauses_s: Iterator[float]) -> tuple[int, str]:
    """Send SIGINT and SIGTERM until a process is gone; give exit status and stderr."""
    numbers = cycle((signal.SIGINT, signal.SIGTERM))

    def has_ended() -> bool:
        process.send_signal(next(numbers))
        return process.poll() is not None

    wait_until(
        has_ended,
        f'the end of {process.args!r}',
        progress=progress_of(process),
        pause=lambda _: time.sleep(next(pauses_s)),
    )
    return end(process)
