# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""What the panel knows of a drive: what it heard, ready to be shown; neither ROS nor a browser."""

import json
import math
import struct
from collections import deque
from collections.abc import Mapping, Sequence
from contextlib import suppress
from threading import RLock
from time import monotonic
from typing import Any, Protocol

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.drive.records import FOOT, TIME, VOLTAGE
from stickslip_ros.errors import StickSlipError
from stickslip_ros.instrument.commands import COMMANDS
from stickslip_ros.instrument.reports import Status
from stickslip_ros.interface.topics import SERVICES
from stickslip_ros.lab.drawing.film import film_of
from stickslip_ros.lab.drawing.picture import stand_svg
from stickslip_ros.lab.panel.beside import Beside
from stickslip_ros.lab.panel.curves import (
    KEPT,
    POSITION_READING,
    RECENT,
    SAMPLE_COLUMNS,
    BinHistory,
    PanelCurve,
    SampleRing,
    Scope,
)
from stickslip_ros.parameters import SENSORS, TRUTH, Parameters, is_fault, specs

EVENTS_SHOWN = 60
FIGURE_S = 0.04
"""Time over which the large figures are means, s."""
VELOCITY_S = 0.2
"""Time over which the slope of the position is the velocity, s."""
SILENT_S = 1.5
"""Wall-clock time without a trace after which the page says so, s."""
SCOPE_CYCLES, HISTORY_SPANS_S = (1, 2, 3, 5, 10), (2, 5, 10, 60)
"""Cycles that the scope may show, and times that the history may, s."""
ACTIVE = 'active'
_ERROR = 2
"""Level of diagnostics from which the drive is late."""
PARTS = ('time', 'recorder', 'faults')
"""Parts of the diagnostics that the page shows."""
REBUILT = ('load_cell.contact',)
"""Parameters that the page sets while the node is not active; the drive then begins anew."""
PANEL = 'panel'
CONTROLS = {
    *(*COMMANDS, *REBUILT, PANEL, 'script', 'lifecycle'),
    *(service.name.removeprefix('~/') for service in SERVICES),
    *filter(is_fault, specs()),
}
"""What has a place for notes beside it; PANEL is that for all others."""
NOTE_MAX = 1000
"""Characters of a note."""
WELL = {'DONE', 'ABORTED'}
"""Results of commands that were carried out, or ended by another one."""


class Source(Protocol):
    """What a page shows: a drive that is there, or a run that was recorded."""

    def state(self) -> dict[str, Any]:
        """Return what changes now and then, for the page."""

    def frame(self) -> bytes | None:
        """Return the next picture for the page; None if it is the last one still."""

    def twin_frame(self) -> bytes | None:
        """Return a picture of the twin beside it; None if nothing was heard since the last one."""

    def do(self, wish: Mapping[str, Any]) -> None:
        """Do what somebody at the page wants."""

    def drawing(self) -> str:
        """Return the stand in its last cycles as SVG; empty if nothing is known of it."""

    def close(self) -> None:
        """End."""


def drawing_of(stand: Parameters, samples: Array) -> str:
    """Return a stand in the last cycles of some samples, or, without any, at rest."""
    for count in RECENT:
        trace = samples[-count:, [TIME, VOLTAGE, FOOT, POSITION_READING]].T
        film = film_of(stand, *trace) if len(samples) else None
        if film is not None or count >= len(samples):
            break
    return stand_svg(stand, film)


class View:
    """How the picture is taken, which those at the page choose."""

    def __init__(self) -> None:
        self.cycles = 3  # one of SCOPE_CYCLES
        self.span_s = 10  # one of HISTORY_SPANS_S
        self.triggers = True  # whether the scope waits for falls

    def choose(self, wish: Mapping[str, Any]) -> None:
        """Take a choice; anything else is passed over."""
        if wish.get('cycles') in SCOPE_CYCLES:
            self.cycles = int(wish['cycles'])
        if wish.get('span_s') in HISTORY_SPANS_S:
            self.span_s = int(wish['span_s'])
        if isinstance(wish.get('triggers'), bool):
            self.triggers = wish['triggers']


def packed_frame(
    time_s: float,
    samples: Array,
    history: BinHistory,
    scope: Scope,
    view: View,
) -> bytes:
    """Return the picture at a time, as the page reads it; samples are the last before the time."""
    header: dict[str, Any] = {'time_s': time_s, 'span_s': view.span_s, 'scope': None}
    header['figures'] = _figures(samples)
    curves = history.curves(time_s, view.span_s)
    picture = scope.picture(samples, view.cycles, triggers=view.triggers)
    if picture is not None:
        curves |= picture.curves
        header['scope'] = {
            'start_s': picture.start_s,
            'end_s': picture.end_s,
            'at_s': picture.at_s,
            'period_s': picture.period_s,
        }
    return _packed(header, curves)


def _packed(header: dict[str, Any], curves: Mapping[str, PanelCurve]) -> bytes:
    """
    Put a header and curves into bytes, as the page reads them.

    In front are the length of the header, a word, and the header, JSON; behind it, as float32, x
    and y of the curves in its order.

    """
    header['curves'] = [[name, len(each.x), each.base] for name, each in curves.items()]
    text = json.dumps(header, allow_nan=False).encode()
    text += b' ' * (-len(text) % 4)
    points = [part.astype('<f4').tobytes() for each in curves.values() for part in each[:2]]
    return b''.join((struct.pack('<I', len(text)), text, *points))


def _figures(samples: Array) -> dict[str, float | None]:
    """Return the means of the newest samples; of those that are numbers."""
    always = [*(each.reading for each in SENSORS if not each.switch), 'voltage']
    if not len(samples):
        return dict.fromkeys((*always, 'velocity'))
    begin = int(np.searchsorted(samples[:, TIME], samples[-1, TIME] - FIGURE_S))
    newest = dict(zip(SAMPLE_COLUMNS, samples[begin:].T, strict=True))
    shown = [*always, *(each.reading for each in SENSORS if each.switch)]
    figures = {
        name: float(np.mean(newest[name])) if np.isfinite(newest[name][-1]) else None
        for name in shown
        if name in always or not np.isnan(newest[name]).all()
    }
    begin = int(np.searchsorted(samples[:, TIME], samples[-1, TIME] - VELOCITY_S))
    time_s, position_m = (samples[begin:, each] for each in (TIME, POSITION_READING))
    apart_s = time_s - np.mean(time_s)
    spread = float(apart_s @ apart_s)
    slope = float(apart_s @ (position_m - position_m[0])) / spread if spread else math.nan
    return {**figures, 'velocity': slope if math.isfinite(slope) else None}


class Model:
    """A drive as the panel hears it; one thread tells it, another asks."""

    def __init__(self, drive: str) -> None:
        self._lock = RLock()
        self.drive = drive  # full name of its node
        self.drives: list[str] = []  # those that there are
        self.lifecycle = ''  # of the node as it last answered; empty as long as it does not
        self.is_there = False  # in the graph
        self.view = View()
        self._ring, self._history, self._scope = (
            SampleRing(len(SAMPLE_COLUMNS), KEPT),
            BinHistory(),
            Scope(),
        )
        self.forget()

    def forget(self, drive: str = '') -> None:
        """Forget what was heard; the model is now one of the same drive, or of another."""
        with self._lock:
            self.drive = drive or self.drive
            self.lifecycle, self.is_there = '', False
            self._bits = 0
            self._target_m: float | None = None
            self._events: deque[dict[str, Any]] = deque(maxlen=EVENTS_SHOWN)
            self._parts: dict[str, Any] = {}
            self._parameters: dict[str, Any] = {}
            self._stand: Parameters | None = None
            self._beside = Beside()
            self._notes: dict[str, Any] = {}
            self._notes_taken = 0
            self._begin_anew()

    def _begin_anew(self) -> None:
        self._ring.clear()
        self._history.bins.clear()
        self._scope.clear()
        self._heard_s, self._has_news = monotonic(), True

    def take_trace(self, block: Array, names: Sequence[str] = TRUTH) -> None:
        """Take a block of a trace; where time starts anew, what was before is forgotten."""
        samples = np.full((len(block), len(SAMPLE_COLUMNS)), np.nan)
        for name, column in zip(names, block.T, strict=False):
            if name in SAMPLE_COLUMNS:
                samples[:, SAMPLE_COLUMNS.index(name)] = column
        with self._lock:
            rows = self._ring.rows
            if len(rows) and samples[0, TIME] <= rows[-1, TIME]:
                self._begin_anew()
            self._ring.append(samples)
            self._history.add_all(samples)
            self._heard_s, self._has_news = monotonic(), True

    def take_reading_of_twin(self, name: str, stamp_ns: int, value_m: float) -> None:
        """Take a position or a residual of the twin."""
        with self._lock:
            self._beside.take_reading(name, stamp_ns, value_m)

    def take_row_of_twin(self, key: str, labels: Sequence[str], row: Sequence[float]) -> None:
        """Take a row of twin/steps or twin/parameters."""
        with self._lock:
            take = self._beside.take_fit if key == 'parameters' else self._beside.take_window
            take(labels, row)

    def take_status(self, bits: int) -> None:
        """Take the status bits."""
        with self._lock:
            self._bits = bits

    def take_event(self, event: Mapping[str, Any]) -> None:
        """Take the end of a command, which is noted where its control is."""
        with self._lock:
            self._events.append(dict(event))
            if event['command'] == 'position' and event['result'] not in WELL:
                self._target_m = None  # refused, or given up
            words = [event['result'], *filter(None, [event['message']])]
            self.note(event['command'], ': '.join(words), bad=event['result'] not in WELL)

    def take_target(self, position_m: float) -> None:
        """Take where somebody commands the runner to."""
        with self._lock:
            self._target_m = position_m if math.isfinite(position_m) else None

    def take_part(self, part: str, level: int, message: str, values: Mapping[str, str]) -> None:
        """Take the diagnostics of a part, if the page shows it."""
        with self._lock:
            if part not in PARTS:
                return
            self._parts[part] = {'level': level, 'message': message, 'values': dict(values)}

    def take_parameters(self, values: Mapping[str, Any], shown: Sequence[str]) -> None:
        """Take present values of all parameters, some of which the page needs."""
        with self._lock:
            self._parameters.update({name: values[name] for name in shown if name in values})
            with suppress(StickSlipError):  # of a drive of another version
                self._stand = Parameters().updated(values)

    def take_pause(self, *, is_paused: bool) -> None:
        """Take what the drive answered; its diagnostics say so later."""
        with self._lock:
            values = self._parts.get('time', {}).get('values', {})
            values['paused'] = str(is_paused).lower()
            self._heard_s = monotonic()

    def note(self, control: str, text: str, *, bad: bool = False, unsent: bool = False) -> None:
        """
        Keep what is to be read beside a control; what has none stands above the page.

        A command that was not sent, as the drive did not answer, may be sent again.

        """
        with self._lock:
            self._notes_taken += 1
            place = control if control in CONTROLS else PANEL
            told = {'text': text[:NOTE_MAX], 'bad': bad, 'unsent': unsent}
            self._notes[place] = told | {'number': self._notes_taken}

    def state(self) -> dict[str, Any]:
        """Return what changes now and then, for the page."""
        with self._lock:
            word, text = self.condition()
            return {
                'drive': self.drive,
                'drives': sorted({self.drive, *self.drives}),
                'lifecycle': self.lifecycle,
                'condition': {'word': word, 'text': text},
                'bits': self._bits,
                'target_m': self._target_m if self._bits & Status.CLOSED_LOOP else None,
                'events': list(self._events),
                'parts': self._parts,
                'parameters': self._parameters,
                'notes': self._notes,
                'view': vars(self.view),
            }

    def condition(self) -> tuple[str, str]:
        """Return in what condition the drive is: a word, and what it means."""
        if self.lifecycle == ACTIVE:
            return self._pace()
        if self.lifecycle:
            return self.lifecycle, f'the node is {self.lifecycle}: time stands still, no commands'
        if self.is_there:
            return 'silent', f'{self.drive} does not answer; waiting for it'
        return 'absent', f'no drive {self.drive} in this ROS domain; waiting for it'

    def _pace(self) -> tuple[str, str]:
        """Return how the time of an active drive runs."""
        time = self._parts.get('time', {'level': 0, 'message': '', 'values': {}})
        if time['values'].get('paused') == 'true':
            return 'paused', 'simulated time is held; commands wait for the next block'
        silent_s = monotonic() - self._heard_s
        if silent_s > SILENT_S:
            return 'waiting', f'no trace for {silent_s:.0f} s: waits for grants, or is held up'
        if time['level'] >= _ERROR:
            return 'late', time['message']
        return 'running', 'simulated time runs'

    def frame(self) -> bytes | None:
        """Return the next picture; None if nothing was heard since the last one."""
        with self._lock:
            if not self._has_news:
                return None
            self._has_news = False
            rows = self._ring.rows
            time_s = float(rows[-1, TIME]) if len(rows) else 0.0
            return packed_frame(time_s, rows, self._history, self._scope, self.view)

    def twin_frame(self) -> bytes | None:
        """Return a picture of the twin; None if nothing was heard of it since the last one."""
        with self._lock:
            if not self._beside.has_news:
                return None
            told, curves = self._beside.picture()
            return _packed({'twin': told}, curves)

    def drawing(self) -> str:
        """Return the stand in its last cycles as SVG; empty as long as it is not known."""
        with self._lock:
            stand, samples = self._stand, self._ring.rows.copy()
        return '' if stand is None else drawing_of(stand, samples)

    def choose(self, wish: Mapping[str, Any]) -> None:
        """Take another picture from now on."""
        with self._lock:
            self.view.choose(wish)
            self._has_news = self._beside.has_news = True
