# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Absolute deadlines for a loop, and threads that wake up in time to meet them."""

import ctypes
import math
import os
import platform
import re
import sys
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from stickslip_ros.units import NS_PER_S

TICKS_KEPT = 100_000
"""Largest number of ticks in a report."""

SWITCH_S: Final = 5e-5
"""Longest time that a callback may hold the interpreter while the drive's tick is due."""
SLICE_S: Final = 3e-4
"""Slice requested from Linux: longer than a tick computes, shorter than the default slice."""
SLACK_S: Final = 1e-9
"""Largest delay that Linux may add to a sleep."""

THIS_THREAD: Final = 0
_SET_ATTRIBUTES, _GET_ATTRIBUTES = 314, 315
"""sched_setattr and sched_getattr on x86-64: C libraries have no name for them before 2025."""
KNOWS_SLICES: Final = platform.machine() == 'x86_64' and (
    tuple(map(int, re.findall(r'\d+', platform.release())[:2])) >= (6, 12)
)
"""Whether a thread may ask for its own slices; older kernels ignore it."""
_SET_TIMER_SLACK: Final = 29


@dataclass(frozen=True)
class PaceReport:
    """Deadlines met and missed since the last report."""

    # Simulated time per wall-clock time, without the time in which the loop was held.
    real_time_factor: float
    lateness_mean_s: float  # delay of a tick's begin after its deadline
    lateness_p99_s: float
    lateness_max_s: float
    overruns: int  # ticks that began more than a period late
    ticks: int
    overruns_total: int  # since the start
    lag_s: float  # present delay of the next tick; it is being made up
    given_up_s: float  # lag above lag_max_s, which is not made up
    behind_s: float  # sum of given_up_s since the start
    missing_s: float  # simulated time missing against the wanted pace; at least 0


class Pacer:
    """
    Holds a loop to absolute deadlines; the real-time factor 0 is as fast as possible.

    A lag is made up: the next ticks begin at once. A lag above ``lag_max_s`` (at least two ticks)
    is given up: deadlines begin again from now.

    """

    def __init__(self, block_s: float, real_time_factor: float, lag_max_s: float) -> None:
        self.real_time_factor = real_time_factor
        self._block_s = block_s
        self._period_s = block_s / real_time_factor if real_time_factor > 0.0 else 0.0
        self._lag_max_s = max(lag_max_s, 2.0 * self._period_s)
        self._overruns_total = 0
        self._behind_s = self._behind_reported_s = 0.0
        self._lock = threading.Lock()
        self.start()

    def start(self, at_s: float | None = None) -> None:
        """Set the first deadline to now, or to a moment of the monotonic clock."""
        with self._lock:
            self._held_since_s: float | None = None
            self._deadline_s = self._report_s = time.monotonic() if at_s is None else at_s
            self._lateness_s: deque[float] = deque(maxlen=TICKS_KEPT)

    def hold(self) -> None:
        """Mark the begin of an intended standstill; a second call does nothing."""
        with self._lock:
            if self._held_since_s is None:
                self._held_since_s = time.monotonic()

    def resume(self) -> None:
        """End a standstill and move the deadlines by its length; else do nothing."""
        if self._held_since_s is None:
            return
        with self._lock:
            held_s = time.monotonic() - self._held_since_s
            self._deadline_s += held_s
            self._report_s += held_s
            self._held_since_s = None

    def wait(self, sleep: Callable[[float], None] = time.sleep) -> None:
        """Sleep until the next deadline, and note the lateness; ``sleep`` may end early."""
        if self._period_s == 0.0:
            self._lateness_s.append(0.0)
            return
        # From the last deadline, not from now: one late tick must not delay all that follow.
        self._deadline_s += self._period_s
        pause_s = self._deadline_s - time.monotonic()
        if pause_s > 0.0:
            sleep(pause_s)
        late_s = max(0.0, time.monotonic() - self._deadline_s)
        self._overruns_total += late_s > self._period_s  # first: a report reads it last
        self._lateness_s.append(late_s)
        # Given up: simulated time stays behind, rather than a burst that would never catch up.
        if late_s > self._lag_max_s:
            self._deadline_s += late_s
            self._behind_s += late_s

    def report(self) -> PaceReport:
        """Summarise the ticks since the last report, and begin the next report."""
        with self._lock:
            now_s = time.monotonic()
            elapsed_s = now_s - self._report_s
            if self._held_since_s is not None:
                elapsed_s -= now_s - self._held_since_s
                self._deadline_s += now_s - self._held_since_s
                self._held_since_s = now_s
            self._report_s = now_s
            ticks, self._lateness_s = self._lateness_s, deque(maxlen=TICKS_KEPT)
            behind_s, before_s = self._behind_s, self._behind_reported_s
            self._behind_reported_s = behind_s
            lag_s = now_s - self._deadline_s - self._period_s if self._period_s else 0.0
        lateness = np.array(ticks)
        simulated_s = len(lateness) * self._block_s
        late = lateness if len(lateness) else np.array([math.nan])
        return PaceReport(
            real_time_factor=simulated_s / elapsed_s if elapsed_s else 0.0,
            lateness_mean_s=float(late.mean()),
            lateness_p99_s=float(np.quantile(late, 0.99)),
            lateness_max_s=float(late.max()),
            overruns=int(np.count_nonzero(lateness > self._period_s)) if self._period_s else 0,
            ticks=len(lateness),
            overruns_total=self._overruns_total,
            lag_s=max(0.0, lag_s),
            given_up_s=behind_s - before_s,
            behind_s=behind_s,
            missing_s=max(0.0, elapsed_s * self.real_time_factor - simulated_s),
        )


class SchedulingAttributes(ctypes.Structure):
    """``struct sched_attr`` of Linux."""

    _fields_ = (
        ('size', ctypes.c_uint32),
        ('policy', ctypes.c_uint32),
        ('flags', ctypes.c_uint64),
        ('nice', ctypes.c_int32),
        ('priority', ctypes.c_uint32),
        ('runtime_ns', ctypes.c_uint64),
        ('deadline_ns', ctypes.c_uint64),
        ('period_ns', ctypes.c_uint64),
    )


def wake_in_time() -> None:
    """
    Make the threads of this process, and of its children, wake up in time.

    Call it before threads start: they inherit the settings. Settings unknown to this Linux are
    left out.

    - The interpreter changes threads after `SWITCH_S`.
    - Linux extends a sleep by up to 50 us, to wake up less often; the extension is switched off.
    - From Linux 6.12 on, a waking thread with a short slice takes the processor from a thread with
      a long slice, instead of waiting for the end of that slice (2.8 ms on two cores). Its share
      of the processor stays the same.

    """
    sys.setswitchinterval(SWITCH_S)
    ctypes.CDLL(None).prctl(_SET_TIMER_SLACK, ctypes.c_ulong(round(SLACK_S * NS_PER_S)))
    attributes = scheduling(THIS_THREAD)
    # A thread whose policy was chosen by ``chrt`` is left alone.
    if attributes is not None and attributes.policy == os.SCHED_OTHER:
        attributes.runtime_ns = round(SLICE_S * NS_PER_S)
        ctypes.CDLL(None).syscall(_SET_ATTRIBUTES, THIS_THREAD, ctypes.byref(attributes), 0)


def scheduling(thread: int) -> SchedulingAttributes | None:
    """Return the scheduling of a thread; None if Linux does not report it or has no slices."""
    if not KNOWS_SLICES:
        return None
    attributes = SchedulingAttributes()
    size = ctypes.sizeof(attributes)
    failed = ctypes.CDLL(None).syscall(_GET_ATTRIBUTES, thread, ctypes.byref(attributes), size, 0)
    return None if failed else attributes
