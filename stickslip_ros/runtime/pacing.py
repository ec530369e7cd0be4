# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A loop keeps absolute deadlines, and its threads wake up in time to meet them."""

import ctypes
import math
import os
import platform
import re
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from stickslip_ros.units import NS_PER_S

TICKS_KEPT = 100_000
"""Ticks that a report looks back on, at most."""
SCHEDSTAT = '/proc/thread-self/schedstat'
"""Where Linux tells of a thread, in ns: its time on a processor, its waiting for one; slices."""

SWITCH_S: Final = 5e-5
"""Longest time that a callback may hold the interpreter while the drive's tick is due."""
SLICE_S: Final = 3e-4
"""Slice that is asked of Linux: longer than a tick computes, shorter than what others have."""
SLACK_S: Final = 1e-9
"""By how much Linux may let a sleep last longer."""

THIS_THREAD: Final = 0
_SET_ATTRIBUTES, _GET_ATTRIBUTES = 314, 315
"""sched_setattr and sched_getattr on x86-64: C libraries have no name for them before 2025."""
KNOWS_SLICES: Final = platform.machine() == 'x86_64' and (
    tuple(map(int, re.findall(r'\d+', platform.release())[:2])) >= (6, 12)
)
"""Whether a thread may ask for slices of its own; older kernels take no notice."""
_SET_TIMER_SLACK: Final = 29


class Stalls(NamedTuple):
    """Where the time of ticks that began too late went; not a number where Linux does not tell."""

    work_s: float = math.nan  # the thread computed
    processor_s: float = math.nan  # it waited for a processor
    rest_s: float = math.nan  # it waited for something else, mostly for the interpreter

    @property
    def most(self) -> str:
        """In words what took most of it; empty where nothing did, or nobody knows."""
        words = 'computing', 'waiting for a processor', 'waiting for the interpreter'
        return f', mostly {words[int(np.argmax(self))]}' if sum(self) > 0.0 else ''


@dataclass(frozen=True)
class PaceReport:
    """How well the deadlines were met since the last report."""

    # Simulated time per wall-clock time; time in which the loop was held does not count.
    real_time_factor: float
    lateness_mean_s: float  # how long after its deadline a tick began
    lateness_p99_s: float
    lateness_max_s: float
    overruns: int  # ticks that began more than a period late
    ticks: int
    overruns_total: int  # since the start
    lag_s: float  # how late the next tick is by now; it is being made up
    given_up_s: float  # lag that is not made up, being above the largest one
    behind_s: float  # all that was given up since the start
    missing_s: float  # simulated time that there would be more at the wanted pace; not below 0
    stalls: Stalls  # of the overruns


class Pacer:
    """
    Holds a loop to absolute deadlines; the real-time factor 0 is as fast as possible.

    A lag is made up: the next ticks begin at once. One above ``lag_max_s``, or two ticks if that
    is longer, is given up: deadlines begin anew.

    """

    def __init__(self, block_s: float, real_time_factor: float, lag_max_s: float) -> None:
        self.real_time_factor = real_time_factor
        self._block_s = block_s
        self._period_s = block_s / real_time_factor if real_time_factor > 0.0 else 0.0
        self._lag_max_s = max(lag_max_s, 2.0 * self._period_s)
        self._overruns_total = 0
        self._behind_s = self._behind_reported_s = 0.0
        self._schedstat: int | None = None
        self._stalls = self._stalls_reported = Stalls()  # since the start; at the last report
        self._lock = threading.Lock()
        self.start()

    def start(self) -> None:
        """Begin to count deadlines now."""
        with self._lock:
            self._held_since_s: float | None = None
            self._deadline_s = self._report_s = time.monotonic()
            self._lateness_s: deque[float] = deque(maxlen=TICKS_KEPT)
            self._noted: tuple[bytes, float] | None = None  # of the tick before: counts, time

    @contextmanager
    def accounted(self) -> Iterator[None]:
        """Meanwhile note, in the thread that waits, where the time of late ticks goes."""
        try:
            self._schedstat = os.open(SCHEDSTAT, os.O_RDONLY)
        except OSError:
            yield
            return
        if int(os.pread(self._schedstat, 64, 0).split()[2]):  # else this Linux does not count
            self._stalls = self._stalls_reported = Stalls(0.0, 0.0, 0.0)
        try:
            yield
        finally:
            closed, self._schedstat = self._schedstat, None
            os.close(closed)

    def _account(self, now_s: float, pause_s: float, *, is_late: bool) -> None:
        """Note what the thread has done since the tick before: ``rest_s`` is all time but that."""
        if self._schedstat is None:
            return
        if pause_s <= 0.0:
            time.thread_time()  # Linux counts up to now where this is asked, or the thread sleeps
        before, self._noted = self._noted, (os.pread(self._schedstat, 64, 0), now_s)
        if is_late and before is not None:
            counts = [[int(ns) for ns in each[0].split()[:2]] for each in (before, self._noted)]
            work_s, processor_s = np.diff(counts, axis=0)[0] / NS_PER_S
            rest_s = max(0.0, now_s - before[1] - max(0.0, pause_s) - work_s - processor_s)
            self._stalls = Stalls(*np.add(self._stalls, (work_s, processor_s, rest_s)).tolist())

    def hold(self) -> None:
        """Note that the loop stands still on purpose from now on; the second time, nothing."""
        with self._lock:
            if self._held_since_s is None:
                self._held_since_s = time.monotonic()

    def resume(self) -> None:
        """Move deadlines by a hold, which is no lateness; without one, do nothing."""
        if self._held_since_s is None:
            return
        with self._lock:
            held_s = time.monotonic() - self._held_since_s
            self._deadline_s += held_s
            self._report_s += held_s
            self._held_since_s = self._noted = None

    def wait(self, sleep: Callable[[float], None] = time.sleep) -> None:
        """Sleep until the next deadline, unless ``sleep`` ends early; note how late it is then."""
        if self._period_s == 0.0:
            self._lateness_s.append(0.0)
            return
        self._deadline_s += self._period_s
        pause_s = self._deadline_s - time.monotonic()
        if pause_s > 0.0:
            sleep(pause_s)
        now_s = time.monotonic()
        late_s = max(0.0, now_s - self._deadline_s)
        self._account(now_s, pause_s, is_late=late_s > self._period_s)
        self._overruns_total += late_s > self._period_s  # first: a report reads it last
        self._lateness_s.append(late_s)
        if late_s > self._lag_max_s:
            self._deadline_s += late_s
            self._behind_s += late_s

    def report(self) -> PaceReport:
        """Summarise the ticks since the last report, and begin a new one."""
        with self._lock:
            now_s = time.monotonic()
            elapsed_s = now_s - self._report_s
            if self._held_since_s is not None:
                elapsed_s -= now_s - self._held_since_s
                self._held_since_s = now_s
            self._report_s = now_s
            ticks, self._lateness_s = self._lateness_s, deque(maxlen=TICKS_KEPT)
            stalls = self._stalls
            before, self._stalls_reported = self._stalls_reported, stalls
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
            stalls=Stalls(*np.subtract(stalls, before).tolist()),
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
    Have the threads of this process, and of those that it starts, wake up when they are due.

    To be called before threads start: they inherit it. Where Linux knows only a part of it, the
    rest is done.

    - The interpreter changes threads after `SWITCH_S`.
    - Linux lets a sleep last 50 us longer than asked for, to wake up seldom; now it does not.
    - From Linux 6.12 on, a thread with a short slice that wakes up takes the processor from one
      with a long slice, instead of waiting for the end of that (2.8 ms on two cores). Its share of
      the processor stays the same.

    """
    sys.setswitchinterval(SWITCH_S)
    ctypes.CDLL(None).prctl(_SET_TIMER_SLACK, ctypes.c_ulong(round(SLACK_S * NS_PER_S)))
    attributes = scheduling(THIS_THREAD)
    # A thread whose policy was chosen by ``chrt`` is left alone.
    if attributes is not None and attributes.policy == os.SCHED_OTHER:
        attributes.runtime_ns = round(SLICE_S * NS_PER_S)
        ctypes.CDLL(None).syscall(_SET_ATTRIBUTES, THIS_THREAD, ctypes.byref(attributes), 0)


def scheduling(thread: int) -> SchedulingAttributes | None:
    """Return how Linux schedules a thread; None where it does not tell, or knows no slices."""
    if not KNOWS_SLICES:
        return None
    attributes = SchedulingAttributes()
    size = ctypes.sizeof(attributes)
    failed = ctypes.CDLL(None).syscall(_GET_ATTRIBUTES, thread, ctypes.byref(attributes), size, 0)
    return None if failed else attributes
