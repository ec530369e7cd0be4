# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Playback of a recorded run on the scope of the panel."""

import math
from bisect import bisect_right
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from threading import RLock
from time import monotonic
from typing import Any

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.drive.records import TIME
from stickslip_ros.errors import RecordingError, StickSlipError
from stickslip_ros.instrument.reports import read_event
from stickslip_ros.lab.measurements.recorded import RUN_QUANTITIES, timed_messages
from stickslip_ros.lab.measurements.recorded_run import Run
from stickslip_ros.lab.panel.curves import (
    KEPT,
    POSITION_READING,
    SAMPLE_COLUMNS,
    BinHistory,
    Scope,
    curve_of,
    table_within,
)
from stickslip_ros.lab.panel.model import EVENTS_SHOWN, View, drawing_of, packed_frame, saved
from stickslip_ros.recording.reader import Recording
from stickslip_ros.units import NANO

SPEEDS = (*(0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5), 1, 2, 5, 10, 20, 50, 100)
"""Choices of simulated seconds per second."""
SHOW_S = 10.0  # approximate time that a run lasts at the first speed, s


def samples_of(run: Run, window_s: tuple[float, float] | None = None) -> Array:
    """Return a run, or a stretch, as rows of a trace, NaN where unknown; else use the topics."""
    held = run.series if window_s is None else run.series_within(*window_s)
    found = {name: each for name, each in held.items() if name in RUN_QUANTITIES}
    if 'position_m' not in found:
        problem = 'has neither a trace nor positions'
        hint = 'of another program, say which topic it is: --map position_m=/rig/encoder.point.x'
        raise RecordingError(run.measurement.side.origin, problem, hint)
    time_s = found['position_m'].time_s
    samples = np.full((len(time_s), len(SAMPLE_COLUMNS)), np.nan)
    samples[:, TIME] = time_s
    for name, series in found.items():
        is_same = len(series) == len(time_s) and np.array_equal(series.time_s, time_s)
        samples[:, SAMPLE_COLUMNS.index(name.rpartition('_')[0])] = (
            series.value if is_same else np.interp(time_s, series.time_s, series.value)
        )
    return samples


class Player:
    """A recording and the current time in it, the same for all pages."""

    def __init__(
        self,
        path: Path,
        topics: Mapping[str, str] | None = None,
        window_s: tuple[float, float] | None = None,
    ) -> None:
        run = Run(path, topics=topics)
        self._name = path.name
        self._samples = samples_of(run, window_s)
        self._stand = None
        with suppress(StickSlipError):  # from another program or version
            self._stand = run.parameters
        self._start_s, self._end_s = self._samples[[0, -1], TIME].tolist()
        self._history = BinHistory(len(self._samples))
        self._history.add_all(self._samples)
        recording = run.source if isinstance(run.source, Recording) else None
        self._bits = list(timed_messages(recording, 'status')) if recording else []
        texts = timed_messages(recording, 'event') if recording else ()
        self._events = [each for _, text in texts if (each := read_event(str(text))) is not None]
        self._lock = RLock()
        self._scope, self._view = Scope(), View()
        self._time_s, self._since_s = self._start_s, 0.0
        wanted = max(self._end_s - self._start_s, SPEEDS[0]) / SHOW_S
        self._speed = min(SPEEDS, key=lambda each: abs(math.log(each / wanted)))
        self._plays, self._is_shown = False, False

    def overview(self) -> dict[str, Any]:
        """Return ends and positions (m) of the run for the time line."""
        samples = self._samples
        curve = curve_of(samples[:, TIME], samples[:, POSITION_READING])
        y_m = curve.base + curve.y.astype(float)
        points = [[round(x, 6), y] for x, y in zip(curve.x.tolist(), y_m.tolist(), strict=True)]
        shown = [point if np.isfinite(point[1]) else [point[0], None] for point in points]
        ends = {'start_s': self._start_s, 'end_s': self._end_s}
        return {**ends, 'name': self._name, 'speeds': SPEEDS, 'points': shown}

    def state(self) -> dict[str, Any]:
        """Return the slowly changing state for the page."""
        with self._lock:
            time_ns = self._time_s / NANO
            past = bisect_right(self._events, time_ns, key=lambda event: float(event['time_ns']))
            events = self._events[:past]
            place = bisect_right(self._bits, self._time_s, key=lambda pair: pair[0])
            return {
                'condition': {'word': 'recording', 'text': self._name},
                'bits': self._bits[place - 1][1] if place else 0,
                'events': events[-EVENTS_SHOWN:],
                'player': {'plays': self._plays, 'speed': self._speed},
                'view': vars(self._view),
            }

    def twin_frame(self) -> None:
        """Return None: a recording is played without a twin."""

    def frame(self) -> bytes | None:
        """Return the next picture for the page; None if it has not changed."""
        with self._lock:
            if self._plays:  # time advances to the end of the run
                now_s = monotonic()
                self._time_s += self._speed * (now_s - self._since_s)
                self._since_s, self._is_shown = now_s, False
                if self._time_s >= self._end_s:
                    self._time_s, self._plays = self._end_s, False
            if self._is_shown:
                return None
            self._is_shown = True
            samples = self._before()
            return packed_frame(self._time_s, samples, self._history, self._scope, self._view)

    def drawing(self) -> str:
        """Return the stand in the last cycles before this time; empty if it is not known."""
        with self._lock:
            samples = self._before()
        return '' if self._stand is None else drawing_of(self._stand, samples)

    def settings(self) -> str:
        """Return the parameters of the run as a file; empty if they are not known."""
        return '' if self._stand is None else saved(self._stand, f'Parameters of {self._name}.')

    def table(self, plot: str, origin_s: float, start_s: float, end_s: float) -> str:
        """Return the samples of a plot between two times after its origin as CSV."""
        rows = self._history.samples.rows if plot == 'history' else self._samples
        return table_within(plot, rows, origin_s, start_s, end_s)

    def do(self, wish: Mapping[str, Any]) -> None:
        """Carry out an action of the page."""
        with self._lock:
            match wish.get('do'):
                case 'play':
                    self._plays, self._since_s = bool(wish.get('wanted')), monotonic()
                    if self._plays and self._time_s >= self._end_s:
                        self._seek(self._start_s)
                case 'seek':
                    self._seek(wish.get('time_s'))
                case 'speed':
                    self._speed = wish['speed'] if wish.get('speed') in SPEEDS else self._speed
                case 'view':
                    self._view.choose(wish)
            self._is_shown = False

    def close(self) -> None:
        """Do nothing; the recording is closed already."""

    def _before(self) -> Array:
        last = int(np.searchsorted(self._samples[:, TIME], self._time_s, 'right'))
        return self._samples[max(0, last - KEPT) : last]

    def _seek(self, time_s: object) -> None:
        if isinstance(time_s, int | float) and math.isfinite(time_s):
            self._time_s = min(max(float(time_s), self._start_s), self._end_s)
            self._scope.clear()
