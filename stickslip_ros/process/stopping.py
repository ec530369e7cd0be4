# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Let Ctrl-C end long work between two steps, so no step is left half done.

Signals raise no exception: between a kernel and its caller numba would not survive it, and in
some places Python only prints it. Long work calls ``stop_if_asked`` between its steps instead, in
any thread.

"""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Event, Lock
from typing import Any

from stickslip_ros.errors import StickSlipError

_stop = Event()
_sleepers: list[Callable[[], object]] = []
_lock = Lock()


class Stopped(StickSlipError):
    """Work ended on request; the message says what is kept."""


class StillBusy(StickSlipError):
    """Part of a node could not be stopped; it ends with the process."""


def is_stop_requested() -> bool:
    """Return whether all work of this process was asked to end."""
    return _stop.is_set()


@contextmanager
def wake_on_stop(wake: Callable[[], object]) -> Iterator[None]:
    """Call ``wake`` if a stop is requested while the code in the block sleeps."""
    with _lock:
        _sleepers.append(wake)
    try:
        yield
    finally:
        with _lock:
            _sleepers.remove(wake)


def request_stop() -> None:
    """Ask all work of this process to end, including the compilation of kernels."""
    _stop.set()
    with _lock:
        for wake in _sleepers:
            wake()
    events: Any = sys.modules.get('numba.core.event')
    if events is not None:
        ways = {'on_start': lambda *_: stop_if_asked(), 'on_end': lambda *_: None}
        events.register('numba:run_pass', type('Stop', (events.Listener,), ways)())


def stop_if_asked() -> None:
    """Raise KeyboardInterrupt if a stop was requested."""
    if _stop.is_set():
        raise KeyboardInterrupt
