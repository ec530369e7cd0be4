# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The state of a drive as the panel shows it, without ROS or browser."""

import json
import math
import re
import struct
from collections import deque
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from threading import RLock
from typing import Any, Protocol

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.drive.records import FOOT, TIME, VOLTAGE
from stickslip_ros.errors import MESSAGE, StickSlipError, WrongKind
from stickslip_ros.instrument.commands import COMMANDS
from stickslip_ros.instrument.reports import Status
from stickslip_ros.interface.requests import INT32_MAX
from stickslip_ros.interface.topics import SERVICES
from stickslip_ros.lab.drawing.film import film_of
from stickslip_ros.lab.drawing.picture import stand_svg
from stickslip_ros.lab.panel.curves import (
    DRAWN_MAX,
    KEPT,
    POSITION_READING,
    RECENT,
    SAMPLE_COLUMNS,
    BinHistory,
    PanelCurve,
    SampleRing,
    Scope,
    table_of,
    table_within,
)
from stickslip_ros.lab.panel.settings import changed_values, in_shown_units
from stickslip_ros.lab.panel.twin_view import TwinView
from stickslip_ros.parameters import (
    SENSORS,
    TRUTH,
    Parameters,
    differ_when_built,
    dump_yaml,
    specs,
)
from stickslip_ros.units import NS_PER_S

EVENTS_SHOWN = 60
FIGURE_S = 0.04  # time over which the large figures are averaged, s
VELOCITY_S = 0.2  # time over which the slope of the position is the velocity, s
SILENT_S = 1.5  # time without a trace until the page reports it, s
SCOPE_CYCLES, HISTORY_SPANS_S = (1, 2, 3, 5, 10), (2, 5, 10, 60)
"""Choices of cycles of the scope, and of seconds of the history."""
ACTIVE = 'active'
_ERROR = 2  # level of diagnostics from which the drive is late
PARTS = ('time', 'recorder', 'faults')  # parts of the diagnostics that the page shows
FEET, RANGE = 'feet.total', 'amplifier.range'  # number of feet, range in V, beside parameters
PANEL = 'panel'
APPLY = 'settings'  # what the page applies; events name the command parameters
OWN_CONTROLS = {PANEL, 'script', 'lifecycle', APPLY}  # no command has such a name
CONTROLS = {
    *COMMANDS,
    *OWN_CONTROLS,
    *(service.name.removeprefix('~/') for service in SERVICES),
    *(name for name, spec in specs().items() if spec.live),
}
"""Controls with a place for notes; PANEL takes all other notes."""
NOTE_MAX = 1000  # characters
SENT_KEPT = 100  # commands of a name, the newest
SUCCESSES = {'DONE', 'ABORTED'}  # results of commands without an error


class Source(Protocol):
    """The source of a page: a live drive or a recorded run."""

    def state(self) -> dict[str, Any]: ...

    def frame(self) -> bytes | None: ...

    def twin_frame(self) -> bytes | None: ...

    def do(self, wish: Mapping[str, Any]) -> None: ...

    def drawing(self) -> str: ...

    def settings(self) -> str: ...

    def table(self, plot: str, origin_s: float, start_s: float, end_s: float) -> str: ...

    def close(self) -> None: ...


def drawing_of(stand: Parameters, samples: Array) -> str:
    """Return a stand in the last cycles of samples, or at rest without samples."""
    for count in RECENT:
        trace = samples[-count:, [TIME, VOLTAGE, FOOT, POSITION_READING]].T
        film = film_of(stand, *trace) if len(samples) else None
        if film is not None or count >= len(samples):
            break
    return stand_svg(stand, film)


def saved(stand: Parameters, heading: str) -> str:
    """Return a file of parameters that ``--params`` reads."""
    return dump_yaml(stand, f'{heading} SI units.\n\n  stickslip drive --params FILE')


@dataclass
class View:
    """Settings of the scope, chosen on the page."""

    cycles: int = 3  # one of SCOPE_CYCLES
    span_s: int = 10  # one of HISTORY_SPANS_S

    def choose(self, wish: Mapping[str, Any]) -> None:
        """Apply the valid choices; ignore others."""
        if wish.get('cycles') in SCOPE_CYCLES:
            self.cycles = int(wish['cycles'])
        if wish.get('span_s') in HISTORY_SPANS_S:
            self.span_s = int(wish['span_s'])


def packed_frame(
    time_s: float, samples: Array, history: BinHistory, scope: Scope, view: View
) -> bytes:
    """Return the picture at a time as bytes; the samples end at that time."""
    header: dict[str, Any] = {'time_s': time_s, 'span_s': view.span_s, 'scope': None}
    header['figures'] = _figures(samples)
    curves = history.curves(time_s, view.span_s)
    picture = scope.picture(samples, view.cycles)
    if picture is not None:
        header['scope'] = picture._asdict()
        curves |= header['scope'].pop('curves')
    return _packed(header, curves)


def _packed(header: dict[str, Any], curves: Mapping[str, PanelCurve]) -> bytes:
    """Return length of the header (a word), header (JSON), x and y of the curves (float32)."""
    header['curves'] = [[name, len(each.x), each.base] for name, each in curves.items()]
    text = json.dumps(header, allow_nan=False).encode()
    text += b' ' * (-len(text) % 4)
    points = [part.astype('<f4').tobytes() for each in curves.values() for part in each[:2]]
    return b''.join((struct.pack('<I', len(text)), text, *points))


def _figures(samples: Array) -> dict[str, float | None]:
    """Return the means of the newest samples; None for NaN."""
    always = [*(each.reading for each in SENSORS if not each.switch), 'voltage']
    if not len(samples):
        return dict.fromkeys((*always, 'velocity'))
    begin = int(np.searchsorted(samples[:, TIME], samples[-1, TIME] - FIGURE_S))
    newest = dict(zip(SAMPLE_COLUMNS, samples[begin:].T, strict=True))
    shown = [*always, *(each.reading for each in SENSORS if each.switch)]
    figures = {
        name: mean if math.isfinite(mean := float(np.mean(newest[name]))) else None
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
    """State of a drive; one thread writes it, another reads it."""

    def __init__(self, drive: str) -> None:
        self._lock = RLock()
        self.drive = drive  # full name of the node
        self.drives: list[str] = []  # drives in the graph
        self.lifecycle = ''  # last answered state; empty if silent
        self.is_there = False  # in the graph
        self.view = View()
        self._ring = SampleRing(len(SAMPLE_COLUMNS), KEPT)
        self._history, self._scope = BinHistory(), Scope()
        self.forget()

    def forget(self, drive: str = '') -> None:
        """Clear the model; from now on it holds this drive."""
        with self._lock:
            self.drive = drive or self.drive
            self.lifecycle, self.is_there = '', False
            self._bits = 0
            self._events: deque[dict[str, Any]] = deque(maxlen=EVENTS_SHOWN)
            self._parts: dict[str, Any] = {}
            self._parameters: dict[str, Any] = {}
            self._stand: Parameters | None = None
            self._changed: dict[str, str] = {}
            self._twin = TwinView()
            self._notes: dict[str, Any] = {}
            self._notes_taken = 0
            self._begin_anew()

    def _begin_anew(self) -> None:
        self._ring.clear()
        self._history.samples.clear()
        self._scope.clear()
        self._sent: dict[str, deque[tuple[int, float]]] = {}  # not refused: stamp, ns; number, SI
        self._noted: dict[str, int] = {}  # number of the newest command with a note, by name
        self._preload: tuple[int, float] | None = None  # that a command has set
        self._zeroed_s, self._is_foreign = -math.inf, False
        self._silent_s, self._has_news = 0.0, True

    def take_trace(self, block: Array, names: Sequence[str] = TRUTH) -> None:
        """Take a block of a trace with rising times; clear older samples if time restarts."""
        samples = np.full((len(block), len(SAMPLE_COLUMNS)), np.nan)
        for name, column in zip(names, block.T, strict=False):
            if name in SAMPLE_COLUMNS:
                samples[:, SAMPLE_COLUMNS.index(name)] = column
        samples[~(np.abs(samples) < DRAWN_MAX)] = np.nan
        time_s = samples[:, TIME]
        rises = len(samples) and time_s[0] >= 0.0 and (np.diff(time_s) >= 0.0).all()
        if not (rises and time_s[-1] <= INT32_MAX):
            wanted = f'a list that rises from 0 to at most {INT32_MAX} s'
            raise WrongKind('t[s] of a trace', time_s[:8].tolist(), wanted, 'sort its rows')
        with self._lock:
            rows = self._ring.rows
            if len(rows) and samples[0, TIME] <= rows[-1, TIME]:
                self._begin_anew()
            self._ring.append(samples)
            self._history.add_all(samples)
            self._silent_s, self._has_news = 0.0, True
            self._is_foreign = not self.is_there

    def take_twin_reading(self, name: str, stamp_ns: int, value_m: float) -> None:
        with self._lock:
            self._twin.take_reading(name, stamp_ns, value_m)

    def take_twin_row(self, key: str, labels: Sequence[str], row: Sequence[float]) -> None:
        with self._lock:
            take = self._twin.take_fit if key == 'parameters' else self._twin.take_window
            take(labels, row)

    def take_status(self, bits: int) -> None:
        with self._lock:
            self._bits = bits

    def take_event(self, event: Mapping[str, Any]) -> None:
        """Take the end of a command, and note it at its control."""
        with self._lock:
            name, number, result = event['command'], event['number'], event['result']
            is_bad = result not in SUCCESSES
            if is_bad:
                self._drop_sent(event)
            elif name == 'preload' and result == 'DONE':
                self._preload = self._newest(name)
            elif name == 'preload':
                is_bad, event = True, {**event, 'message': f'stopped midway, {event["message"]}'}
            elif name in {'zero_position', 'reset'}:
                self._preload = self._preload if name == 'zero_position' else None
                self._zeroed_s = event['time_ns'] / NS_PER_S
            event = {**event, 'message': in_shown_units(event['message'])}
            self._events.append(event)
            if 0 < number < self._noted.get(name, 0):
                return  # the note is of a later command
            self._noted[name] = number
            words = [result, *filter(None, [event['message']])]
            self.note(name, ': '.join(words), bad=is_bad)

    def take_sent(self, name: str, value: float, stamp_ns: int = 0) -> None:
        """Take the number of a command, m or N, that may still be refused."""
        with self._lock:
            self._sent.setdefault(name, deque(maxlen=SENT_KEPT)).append((stamp_ns, value))

    def _newest(self, name: str) -> tuple[int, float] | None:
        """Return stamp and number of the newest command that is not refused."""
        return next(reversed(self._sent.get(name, ())), None)

    def _drop_sent(self, refusal: Mapping[str, Any]) -> None:
        """Drop the number of a refusal: that with its stamp or at its head, else the newest."""
        name, stamp_ns = str(refusal['command']), refusal.get('sent_ns')
        told, sent = re.split(' [mN] ', refusal['message'])[0], self._sent.get(name, deque())
        own = [
            e for e in sent if (e[0] == stamp_ns if stamp_ns else told.endswith(f' {e[1]:.6g}'))
        ]
        if own or (sent and not stamp_ns):
            sent.remove(own[-1] if own else sent[-1])
        if name == 'preload' and self._preload not in sent:
            self._preload = self._preload and self._newest(name)

    def take_part(self, part: str, level: int, message: str, values: Mapping[str, str]) -> None:
        """Take the diagnostics of a part that the page shows."""
        with self._lock:
            if part in PARTS:
                self._parts[part] = {'level': level, 'message': message, 'values': dict(values)}

    def take_parameters(self, values: Mapping[str, Any]) -> None:
        """Take the values of all parameters."""
        with self._lock:
            self._parameters |= values
            with suppress(StickSlipError):  # from a drive of another version
                stand, before = Parameters().updated(values), self._stand
                self._stand = stand
                self._parameters[FEET] = stand.feet.total
                self._parameters[RANGE] = stand.amplifier.range_v
                if before is not None and differ_when_built(before, stand):
                    for command in COMMANDS:  # judged by limits that are gone
                        self._notes.pop(command, None)
                self._changed = changed_values(stand)

    @property
    def stand(self) -> Parameters:
        """The parameters of the drive; raises StickSlipError before they are known."""
        if self._stand is None:
            raise StickSlipError(f'the parameters are not known: {self.condition()[1]}')
        return self._stand

    def settings(self) -> str:
        """Return the parameters of the drive as a file; empty if they are not known."""
        stand = self._present_stand()
        heading = f'Parameters of {self.drive}, present preload.'
        return '' if stand is None else saved(stand, heading)

    def _present_stand(self) -> Parameters | None:
        """Return the parameters of the drive, with the preload of the last command."""
        if self._stand is None or self._preload is None:
            return self._stand
        return self._stand.updated({'stand.preload': self._preload[1]})

    def take_pause(self, *, is_paused: bool) -> None:
        """Take the answer to a pause; the diagnostics follow later."""
        with self._lock:
            values = self._parts.get('time', {}).get('values', {})
            values['paused'] = str(is_paused).lower()
            self._silent_s = 0.0

    def note(self, control: str, text: str, *, bad: bool = False) -> None:
        """Keep a note for a control, else for the panel."""
        with self._lock:
            self._notes_taken += 1
            place = control if control in CONTROLS else PANEL
            text = in_shown_units(text[:MESSAGE])[:NOTE_MAX]  # a foreign text may be long
            self._notes[place] = {'text': text, 'bad': bad, 'number': self._notes_taken}

    def state(self) -> dict[str, Any]:
        """Return the slowly changing state for the page."""
        with self._lock:
            word, text = self.condition()
            _, target_m = self._newest('position') or (0, math.nan)
            is_held = self._bits & Status.CLOSED_LOOP and math.isfinite(target_m)
            return {
                'drive': self.drive,
                'drives': sorted({self.drive, *self.drives}),
                'lifecycle': self.lifecycle,
                'condition': {'word': word, 'text': text},
                'bits': self._bits,
                'target_m': target_m if is_held else None,
                'events': list(self._events),
                'parts': self._parts,
                'parameters': self._parameters,
                'changed': self._changed,
                'notes': self._notes,
                'view': vars(self.view),
            }

    def condition(self) -> tuple[str, str]:
        """Return the condition of the drive: a word and its meaning."""
        if self.lifecycle == ACTIVE:
            return self._pace()
        if self.lifecycle:
            return self.lifecycle, f'the node is {self.lifecycle}: time stands still, no commands'
        is_lost = len(self._ring.rows) > 0 and self._silent_s >= SILENT_S
        gone = f': no data for {self._silent_s:.0f} s, its process may be gone' * is_lost
        if self._is_foreign and not (self.is_there or is_lost):
            return 'foreign', f'data without a drive {self.drive}, as of a bag: no commands'
        if self.is_there:
            return 'silent', f'{self.drive} does not answer{gone}; waiting for it'
        seen = f' (seen: {", ".join(self.drives)})' if self.drives else ''
        return 'absent', f'no drive {self.drive} in this ROS domain{gone}; waiting for it{seen}'

    def count_silence(self, time_s: float) -> None:
        """Count a time without data; a panel that is held up itself does not count."""
        with self._lock:
            self._silent_s += time_s

    def _pace(self) -> tuple[str, str]:
        """Return the condition of an active drive."""
        time = self._parts.get('time', {'level': 0, 'message': '', 'values': {}})
        if time['values'].get('paused') == 'true':
            return 'paused', 'simulated time is held; commands wait for the next block'
        if self._silent_s >= SILENT_S:
            why = 'the drive waits for grants, or is held up'
            return 'waiting', f'no data for {self._silent_s:.0f} s: {why}'
        if time['level'] >= _ERROR:
            return 'late', time['message']
        return 'running', 'simulated time runs'

    def frame(self) -> bytes | None:
        """Return the next picture; None if it has not changed."""
        with self._lock:
            if not self._has_news:
                return None
            self._has_news = False
            rows = self._ring.rows
            time_s = float(rows[-1, TIME]) if len(rows) else 0.0
            return packed_frame(time_s, rows, self._history, self._scope, self.view)

    def twin_frame(self) -> bytes | None:
        """Return the next picture of the twin; None if it has not changed."""
        with self._lock:
            if not self._twin.has_news:
                return None
            numbers, curves = self._twin.picture()
            return _packed({'twin': numbers}, curves)

    def drawing(self) -> str:
        """Return the stand in its last cycles as SVG; empty if it is not known."""
        with self._lock:
            stand, rows = self._present_stand(), self._ring.rows
            samples = rows[rows[:, TIME] > self._zeroed_s].copy()
        return '' if stand is None else drawing_of(stand, samples)

    def table(self, plot: str, origin_s: float, start_s: float, end_s: float) -> str:
        """Return the samples of a plot between two times after its origin as CSV."""
        with self._lock:
            if plot == 'twin':
                return table_of(self._twin.columns())
            rows = (self._history.samples if plot == 'history' else self._ring).rows.copy()
            held = self._scope.samples
        is_gone = len(rows) and rows[0, TIME] > origin_s + start_s and plot != 'history'
        return table_within(
            plot, held if is_gone and held is not None else rows, origin_s, start_s, end_s
        )

    def choose(self, wish: Mapping[str, Any]) -> None:
        with self._lock:
            self.view.choose(wish)
            self._has_news = self._twin.has_news = True
