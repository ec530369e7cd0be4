"""
A verb as a process: signals end it in one line, at any moment and for certain.

The verb has a thread of its own. The main thread, which is the only one to see signals, does
nothing but wait, so that it can always end the process.

"""

import os
import sys
import traceback
from collections.abc import Callable
from contextlib import suppress
from queue import Empty, SimpleQueue
from threading import Thread
from typing import NoReturn

from stickslip_ros.ros.ending import STOPPED, end_on_signals, ignore_signals
from stickslip_ros.stopping import request_stop

REFUSED = 2
"""Exit status of a verb that has done nothing."""
GRACE_S = 10.0
"""Time that a verb has to keep what it has finished and to end."""
SHOW_CURSOR = '\x1b[?25h'
"""What a progress bar would send to a terminal at its end."""
CUT = 'stopped in the midst of its work: what it was writing is not whole'


def run_verb(main: Callable[[], int]) -> int:
    """Return the exit status of a verb, which signals ask to stop; see `stopping`."""
    ending = end_on_signals()
    status: SimpleQueue[int] = SimpleQueue()

    def run() -> None:
        status.put(_status_of(main))
        ending.set()

    Thread(target=run, name='verb', daemon=True).start()
    ending.wait()
    ignore_signals()
    if status.empty():
        request_stop()
    try:
        return status.get(timeout=GRACE_S)
    except Empty:
        _end_at_once()


def _status_of(main: Callable[[], int]) -> int:
    """Return a status, whatever happens: the main thread waits for it."""
    try:
        return main()
    except SystemExit as ended:  # of argparse
        return int(ended.code or 0)
    except BaseException:  # noqa: BLE001
        traceback.print_exc()
        return 1


def _end_at_once() -> NoReturn:
    """
    End the process without its interpreter, which would wait for threads in kernels, or crash.

    Nothing here takes a lock that another thread may hold.

    """
    cursor = SHOW_CURSOR if os.isatty(2) else ''
    with suppress(OSError):
        os.write(2, f'{cursor}stickslip: {CUT}\n'.encode())
    os._exit(STOPPED)


def has_streams() -> bool:
    """Take the places of closed streams, which files would get; without stdout, say what to do."""
    was_open = sys.stdout is not None
    for name, number in (('stdin', 0), ('stdout', 1), ('stderr', 2)):
        if getattr(sys, name) is None:
            os.dup2(os.open(os.devnull, os.O_RDWR), number)
            setattr(sys, name, os.fdopen(number, 'w' if number else 'r', encoding='utf-8'))
    if not was_open:
        hint = 'send it to a file, or to /dev/null'
        sys.stderr.write(f'stickslip: standard output is closed; {hint}\n')
    return was_open
