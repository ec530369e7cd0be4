"""Absolute deadlines: the drive neither drifts nor hides that it is late."""

import math
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

TICKS_KEPT = 100_000
"""Ticks that a report looks back on, at most."""
LAG_MAX_S = 0.1
"""Lag that is caught up; beyond it the deadlines are moved and simulated time stays behind."""


@dataclass(frozen=True)
class PaceReport:
    """
    How well the deadlines were met since the last report.

    Attributes
    ----------
    real_time_factor : float
        Simulated time per wall-clock time; time in which the loop was held does not count.
    lateness_mean_s, lateness_p99_s, lateness_max_s : float
        How long after its deadline a tick began.
    overruns : int
        Ticks that began more than a period late.
    ticks : int
        Ticks in the report.
    overruns_total : int
        Overruns since the start.
    behind_s : float
        Wall-clock time by which deadlines were moved since the start, because the lag was too
        large to catch up.
    missing_s : float
        Simulated time that there would be more, had the wanted pace been kept; never below 0.

    """

    real_time_factor: float
    lateness_mean_s: float
    lateness_p99_s: float
    lateness_max_s: float
    overruns: int
    ticks: int
    overruns_total: int
    behind_s: float
    missing_s: float


class Pacer:
    """
    Hold a loop to absolute deadlines.

    Parameters
    ----------
    block_s : float
        Simulated time per tick, s.
    real_time_factor : float
        Simulated seconds per wall-clock second; 0 is as fast as possible.

    """

    def __init__(self, block_s: float, real_time_factor: float) -> None:
        self.real_time_factor = real_time_factor
        self._block_s = block_s
        self._period_s = block_s / real_time_factor if real_time_factor > 0.0 else 0.0
        self._overruns_total = 0
        self._behind_s = 0.0
        self._lock = threading.Lock()
        self.start()

    def start(self) -> None:
        """Begin to count deadlines now."""
        with self._lock:
            self._held_since_s: float | None = None
            self._deadline_s = self._report_s = time.monotonic()
            self._lateness_s: deque[float] = deque(maxlen=TICKS_KEPT)

    def hold(self) -> None:
        """Note that the loop stands still on purpose from now on; the second time, nothing."""
        with self._lock:
            if self._held_since_s is None:
                self._held_since_s = time.monotonic()

    def resume(self) -> None:
        """Begin deadlines anew after a hold, which is no lateness; without one, nothing."""
        with self._lock:
            if self._held_since_s is not None:
                self._deadline_s = time.monotonic()
                self._report_s += self._deadline_s - self._held_since_s
                self._held_since_s = None

    def wait(self, sleep: Callable[[float], None] = time.sleep) -> None:
        """
        Sleep until the next deadline; note how late the loop wakes.

        Parameters
        ----------
        sleep : callable
            Sleeps for so many seconds; it may return early to end the loop or to hold it.

        """
        if self._period_s == 0.0:
            self._lateness_s.append(0.0)
            return
        self._deadline_s += self._period_s
        pause_s = self._deadline_s - time.monotonic()
        if pause_s > 0.0:
            sleep(pause_s)
        late_s = max(0.0, time.monotonic() - self._deadline_s)
        self._overruns_total += late_s > self._period_s  # first: a report reads it last
        self._lateness_s.append(late_s)
        if late_s > max(LAG_MAX_S, 2.0 * self._period_s):
            self._deadline_s += late_s
            self._behind_s += late_s

    def report(self) -> PaceReport:
        """Summarise the ticks since the last report, and begin a new one."""
        elapsed_s, ticks = self._turn_over()
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
            behind_s=self._behind_s,
            missing_s=max(0.0, elapsed_s * self.real_time_factor - simulated_s),
        )

    def _turn_over(self) -> tuple[float, deque[float]]:
        """Return the time in which the loop ran and its ticks; begin a new report."""
        with self._lock:
            now_s = time.monotonic()
            elapsed_s = now_s - self._report_s
            if self._held_since_s is not None:
                elapsed_s -= now_s - self._held_since_s
                self._held_since_s = now_s
            self._report_s = now_s
            ticks, self._lateness_s = self._lateness_s, deque(maxlen=TICKS_KEPT)
        return elapsed_s, ticks
