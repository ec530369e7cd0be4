# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Waits of tests: they end 60 s after the last progress, however slow the machine is."""

import time
from collections.abc import Callable
from typing import TypeVar

T = TypeVar('T')

GIVE_UP_S = 60.0
"""Wall-clock time without progress after which a wait is given up."""
PROGRESS_S = 1.0
"""Wall-clock time between two looks at the progress, which may cost more than the condition."""
LOOK_S = 0.005
"""Wall-clock time between two looks at the condition."""


def wait_until(
    condition: Callable[[], T],
    what: str,
    *,
    progress: Callable[[], object] = lambda: None,
    clock: Callable[[], float] = time.monotonic,
    pause: Callable[[float], object] = time.sleep,
) -> T:
    """
    Wait until a condition holds; return what it has returned.

    Parameters
    ----------
    condition : callable
        Returns a true value when the wait is over; may raise an error that ends it.
    what : str
        Name of what is waited for, for the error.
    progress : callable
        Returns what changes as long as the condition can still come true, as a count of messages
        or the size of a file. Each change starts the clock of the wait again.
    clock, pause : callable
        The clock, s, and what sleeps between two looks.

    Raises
    ------
    TimeoutError
        If there was no progress for GIVE_UP_S, with the last progress.

    """
    seen, since_s = progress(), clock()
    looked_s = since_s
    while not (found := condition()):
        now_s = clock()
        if now_s - looked_s >= PROGRESS_S:
            looked_s, now = now_s, progress()
            if now != seen:
                seen, since_s = now, now_s
            elif now_s - since_s > GIVE_UP_S:
                last = '' if seen is None else f'; the last was {seen!r}'
                raise TimeoutError(f'waited for {what}: no progress for {GIVE_UP_S:g} s{last}')
        pause(LOOK_S)
    return found
