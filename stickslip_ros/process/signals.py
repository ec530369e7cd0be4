# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Run a process so that a signal ends it once, in order, and at any moment.

The work, imports included, runs in its own thread. The main thread receives the signals and only
waits, so it can always end the process. This module imports nothing slow.

"""

import ctypes
import io
import os
import signal
import sys
import traceback
from collections.abc import Callable
from contextlib import suppress
from queue import Empty, SimpleQueue
from threading import Event, Thread
from typing import NoReturn

from stickslip_ros.process.stopping import request_stop

_HANGUPS = [each for each in signal.Signals if each.name == 'SIGHUP']  # Windows has none
UNDER_NOHUP = any(signal.getsignal(each) == signal.SIG_IGN for each in _HANGUPS)
SIGNALS = (signal.SIGINT, *(() if UNDER_NOHUP else _HANGUPS), signal.SIGTERM)
"""Signals that end a process; a closing terminal sends SIGHUP."""
ENDED, REFUSED, CUT, STOPPED = 0, 2, 3, 130
"""Exit status: success, refusal, a node that did not close in time, a verb that was stopped."""
GRACE_S = 8.0
"""Time for a node to close; then the process ends anyway."""
VERB_GRACE_S = 10
"""Time for a verb to end; the system kills a node that hangs for this long."""
RECOVER = '`stickslip recover` repairs a recording that was not finished'
INTERRUPTED = 'stopped during its work: the file being written is incomplete'
SHOW_CURSOR = '\x1b[?25h'
"""Sequence that a progress bar sends to a terminal at its end."""
_IGNORED = 'ignored due to race condition'

_has_begun = Event()


def begin() -> None:
    """Mark the start of work that must be closed; until then a signal ends the process at once."""
    _has_begun.set()


def run(name: str, work: Callable[[], int], *, is_node: bool) -> int:
    """
    Run the work of a process, which a signal asks to stop (see `stopping`); return its status.

    A node that a signal ends has the status ENDED, a verb STOPPED.

    """
    if not _has_streams():
        sys.stderr.write(
            f'{name}: standard output is closed; send it to a file, or to /dev/null\n'
        )
        return REFUSED
    reading, writing = os.pipe()
    if hasattr(os, 'set_blocking'):
        os.set_blocking(writing, False)
    signal.set_wakeup_fd(writing, warn_on_full_buffer=False)  # gets the number of each signal
    for each in SIGNALS:
        signal.signal(each, lambda *_: None)
    status: SimpleQueue[int] = SimpleQueue()

    def run_work() -> None:
        status.put(_status_of(work))
        with suppress(BlockingIOError):  # a full pipe wakes up too
            os.write(writing, b'\0')

    Thread(target=run_work, name=name, daemon=True).start()
    number = os.read(reading, 1)[0]
    _ignore_signals()
    if number and not _has_begun.is_set():
        why = f'ended by {signal.Signals(number).name} before it had started'
        leave(name, why, ENDED if is_node else STOPPED)
    if number:
        if is_node:
            signal.alarm(VERB_GRACE_S)
        request_stop()
    try:
        return status.get(timeout=GRACE_S if is_node else VERB_GRACE_S)
    except Empty:
        if is_node:
            leave(name, f'not closed within {GRACE_S:g} s; {RECOVER}', CUT)
        leave(name, INTERRUPTED, STOPPED)


def _has_streams() -> bool:
    """Make the standard streams take any text; return whether stdout was open."""
    was_open = sys.stdout is not None
    for name, number in (('stdin', 0), ('stdout', 1), ('stderr', 2)):
        if getattr(sys, name) is None:
            os.dup2(os.open(os.devnull, os.O_RDWR), number)
            setattr(sys, name, os.fdopen(number, 'w' if number else 'r', encoding='utf-8'))
    if isinstance(sys.stdout, io.TextIOWrapper):  # a character that a terminal lacks is escaped
        sys.stdout.reconfigure(errors='backslashreplace')
    return was_open


def _status_of(work: Callable[[], int]) -> int:
    """Run the work and return its status, also after an error: the main thread waits for it."""
    try:
        return work()
    except SystemExit as ended:  # of argparse
        return int(ended.code or 0)
    except BaseException:  # noqa: BLE001
        with suppress(OSError):
            traceback.print_exc()
        return 1


def _ignore_signals() -> None:
    """
    Ignore the SIGNALS until the process is gone; send output of a closed terminal to /dev/null.

    An empty handler is not enough: an ending interpreter resets handled signals to their default,
    death, about 0.1 s before it is gone. The system is told first: otherwise `signal.signal` would
    print "ignored due to race condition" for a signal that arrives during the change. The message
    remains possible for a signal that another thread has taken, so it is suppressed.

    """
    sys.unraisablehook = _print_unless_ignored
    for number in SIGNALS:
        ctypes.pythonapi.PyOS_setsig(number, ctypes.c_void_p(signal.SIG_IGN))
        signal.signal(number, signal.SIG_IGN)
    for stream in (1, 2):
        try:
            os.write(stream, b'')
        except OSError:  # noqa: PERF203 - there are two
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream)


def _print_unless_ignored(caught: 'sys.UnraisableHookArgs') -> None:
    """Print an unraisable error unless it reports an ignored signal."""
    error = caught.exc_value
    if not (isinstance(error, OSError) and str(error).endswith(_IGNORED)):
        sys.__unraisablehook__(caught)


def leave(name: str, why: str, status: int) -> NoReturn:
    """
    End the process without the interpreter's shutdown, which would wait for kernels or crash.

    It takes no lock that another thread may hold.

    """
    cursor = SHOW_CURSOR if os.isatty(2) else ''
    with suppress(OSError):
        os.write(2, f'{cursor}{name}: {why}\n'.encode())
    os._exit(status)
