# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Ctrl-C ends long work between two of its steps, where nothing is half done.

An exception that a signal raises at any moment may strike between a kernel and its caller, which
numba does not survive, or in a place where Python only prints it. So no signal raises one: long
work calls ``stop_if_asked`` between its steps, in any thread.

"""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Event, Lock
from typing import Any

from stickslip_ros.errors import StickSlipError

_asked = Event()
_sleepers: list[Callable[[], object]] = []
_lock = Lock()


class Stopped(StickSlipError):
    """Work has ended because somebody asked for it; the message says what is kept."""


class StillBusy(StickSlipError):
    """Something of a node could not be stopped; only the end of the process stops it."""


def is_stop_requested() -> bool:
    """Return whether somebody asked all work of this process to end."""
    return _asked.is_set()


@contextmanager
def woken_by_stop(wake: Callable[[], object]) -> Iterator[None]:
    """Have ``wake`` called when somebody asks work to end that sleeps meanwhile."""
    with _lock:
        _sleepers.append(wake)
    try:
        yield
    finally:
        with _lock:
            _sleepers.remove(wake)


def request_stop() -> None:
    """Ask all work of this process to end, also that of compiling kernels."""
    _asked.set()
    with _lock:
        for wake in _sleepers:
            wake()
    events: Any = sys.modules.get('numba.core.event')
    if events is not None:
        ways = {'on_start': lambda *_: stop_if_asked(), 'on_end': lambda *_: None}
        events.register('numba:run_pass', type('Stop', (events.Listener,), ways)())


def stop_if_asked() -> None:
    """Raise KeyboardInterrupt here, between two steps, if somebody asked the work to end."""
    if _asked.is_set():
        raise KeyboardInterrupt
