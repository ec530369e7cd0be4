# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Waits of the panel's tests: they end 60 s after the last progress, however slow the machine."""

import time
from collections.abc import Callable

IDLE_S = 60.0
"""Wall-clock time without progress after which a wait ends."""


def await_that(
    condition: Callable[[], object], name: str, progress: Callable[[], object] = lambda: None
) -> None:
    """Wait until a condition holds; give up when ``progress`` has returned the same for 60 s."""
    seen, since_s = progress(), time.monotonic()
    while not condition():
        now = progress()
        if now != seen:
            seen, since_s = now, time.monotonic()
        if time.monotonic() - since_s > IDLE_S:
            raise TimeoutError(f'no {name}, and no progress for {IDLE_S:g} s after {seen}')
        time.sleep(0.01)
