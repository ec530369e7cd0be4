# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A process of this package: signals end it once and in order, at any moment and for certain.

What it does has a thread of its own, imports included. The main thread, the only one to see
signals, does nothing but wait, so that it can always end the process. This module imports nothing
that takes time.

"""

import ctypes
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

UNDER_NOHUP = signal.getsignal(signal.SIGHUP) == signal.SIG_IGN
SIGNALS = (signal.SIGINT, *(() if UNDER_NOHUP else (signal.SIGHUP,)), signal.SIGTERM)
"""What ends a process; SIGHUP comes from a terminal that is closed."""
ENDED, REFUSED, CUT, STOPPED = 0, 2, 3, 130
"""Exit status: as it should be, refused, a node that did not close, a verb that was stopped."""
GRACE_S = 8.0
"""Time that a node has to close before its process ends without it."""
LAST_S = 10
"""Time that a verb has to end; the system kills a node that hangs for so long."""
RECOVER = '`stickslip recover` repairs a recording that was not finished'
NOT_WHOLE = 'stopped in the midst of its work: what it was writing is not whole'
SHOW_CURSOR = '\x1b[?25h'
"""What a progress bar would send to a terminal at its end."""
_IGNORED = 'ignored due to race condition'

_has_begun = Event()


def begin() -> None:
    """Note that from now on there is something to close; until then a signal ends at once."""
    _has_begun.set()


def run(name: str, work: Callable[[], int], *, is_node: bool) -> int:
    """
    Do the work of a process, which signals ask to stop (see `stopping`); return its exit status.

    Of a node a signal is the proper end, status ENDED; a verb that it stops has STOPPED.

    """
    if not _has_streams():
        sys.stderr.write(
            f'{name}: standard output is closed; send it to a file, or to /dev/null\n'
        )
        return REFUSED
    reading, writing = os.pipe()
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
        signal.alarm(LAST_S if is_node else 0)
        request_stop()
    try:
        return status.get(timeout=GRACE_S if is_node else LAST_S)
    except Empty:
        if is_node:
            leave(name, f'not closed within {GRACE_S:g} s; {RECOVER}', CUT)
        leave(name, NOT_WHOLE, STOPPED)


def _has_streams() -> bool:
    """Take the places of closed streams, which files would get; return whether stdout was open."""
    was_open = sys.stdout is not None
    for name, number in (('stdin', 0), ('stdout', 1), ('stderr', 2)):
        if getattr(sys, name) is None:
            os.dup2(os.open(os.devnull, os.O_RDWR), number)
            setattr(sys, name, os.fdopen(number, 'w' if number else 'r', encoding='utf-8'))
    return was_open


def _status_of(work: Callable[[], int]) -> int:
    """Return a status, whatever happens: the main thread waits for it."""
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
    Have the system ignore the SIGNALS until the process is gone; forget a terminal that is.

    A handler, even one that does nothing, would not do: an interpreter that ends gives every
    signal that has one back to its default, which is death, and then takes some 0.1 s more to end.
    The system is asked before Python is: of a signal that comes between its last look and the
    change, `signal.signal` would print "ignored due to race condition". One that another thread
    has taken by then can still come between; that it is ignored is then no news.

    """
    sys.unraisablehook = _tell_unless_ignored
    for number in SIGNALS:
        ctypes.pythonapi.PyOS_setsig(number, ctypes.c_void_p(signal.SIG_IGN))
        signal.signal(number, signal.SIG_IGN)
    for stream in (1, 2):
        try:
            os.write(stream, b'')
        except OSError:  # noqa: PERF203 - there are two
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream)


def _tell_unless_ignored(caught: 'sys.UnraisableHookArgs') -> None:
    """Print an error that nobody can catch, unless it says that a signal was ignored."""
    error = caught.exc_value
    if not (isinstance(error, OSError) and str(error).endswith(_IGNORED)):
        sys.__unraisablehook__(caught)


def leave(name: str, why: str, status: int) -> NoReturn:
    """
    End the process without its interpreter, which would wait for threads in kernels, or crash.

    Nothing here takes a lock that another thread may hold.

    """
    cursor = SHOW_CURSOR if os.isatty(2) else ''
    with suppress(OSError):
        os.write(2, f'{cursor}{name}: {why}\n'.encode())
    os._exit(status)
