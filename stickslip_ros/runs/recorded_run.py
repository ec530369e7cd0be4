"""What a recorded run says, within a stretch: quantities over time, commands, events, status."""

import json
import math
import shutil
import weakref
from collections.abc import Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from stickslip_ros.errors import OutOfRange, RecordingError, StickSlipError, WrongKind
from stickslip_ros.files import prepare_output
from stickslip_ros.instrument.commands import COMMANDS, JOINT, Request
from stickslip_ros.instrument.reports import Status
from stickslip_ros.interface.topics import READINGS
from stickslip_ros.notebook import html_table
from stickslip_ros.parameters import SENSORS, Parameters, parse_yaml
from stickslip_ros.parameters.typed import to_si_list
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.requests import recorded_requests
from stickslip_ros.recording.run_file import PARAMETERS_FILE, TOPICS_RECORD
from stickslip_ros.recording.series import Series
from stickslip_ros.units import NANO, with_unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

    from stickslip_ros.runs.sawtooth_run import SawtoothRun

RUN_QUANTITIES = {
    **{each.quantity: each.label for each in SENSORS},
    'voltage_v': 'voltage at the piezo',
    'foot_m': 'displacement of the feet',
}
"""Quantities of a run in words, by their columns in an experiment file: without the unit they are
the columns of the trace, and the topics."""
TRACE_SAMPLES_MIN = 2


class TimeWindow(NamedTuple):
    """Start and end, s."""

    start_s: float
    end_s: float


class LoggedCommand(NamedTuple):
    """A command that took effect: when, which, and its numbers as people read them."""

    time_s: float
    command: str
    numbers: str


class LoggedEvent(NamedTuple):
    """The end of a command: when, which, how."""

    time_s: float
    command: str
    result: str


class BitSpan(NamedTuple):
    """A stretch of time during which a status bit was set."""

    bit: str
    start_s: float
    end_s: float


class Run:
    """
    A recorded run: a file, or one that lives as long as this object.

    Parameters
    ----------
    path : path-like, optional
        An MCAP file, a bag directory, or the name that parts share; none if nothing was recorded.
    result : SawtoothRun, optional
        What the run came to, known of a run that was simulated here.
    folder : Path, optional
        A folder that is removed with this object.
    topics : mapping of str to str, optional
        Of a recording of another program: topic and field of its quantities.

    """

    def __init__(
        self,
        path: str | Path | None,
        result: 'SawtoothRun | None' = None,
        folder: Path | None = None,
        topics: Mapping[str, str] | None = None,
    ) -> None:
        self._path = path
        self._result = result
        self.topics = topics or {}
        if folder is not None:
            weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)

    @cached_property
    def recording(self) -> Recording:
        """Topics, messages, metadata, attachments; refused if there are none or damaged ones."""
        if self._path is None:
            raise StickSlipError('the run was not recorded; simulate with is_recorded=True')
        return Recording(self._path)

    @property
    def path(self) -> Path:
        """The file."""
        return self.recording.path

    @cached_property
    def parameters(self) -> Parameters:
        """The stand; RecordingError if the file does not say."""
        return recorded_stand(self.recording)

    @property
    def result(self) -> 'SawtoothRun':
        """What the saw-tooth came to; StickSlipError of a run that ``simulate`` did not make."""
        if self._result is None:
            raise StickSlipError(f'{self.path} was opened, not simulated; use its frame')
        return self._result

    @property
    def force_mean_n(self) -> float:
        """Generated force of a simulated run, mean over the last cycle, N."""
        return self.result.force_mean_n

    @property
    def step_length_m(self) -> float:
        """Net motion per cycle of a simulated run, mean over the last cycles, m."""
        return self.result.step_length_m

    @cached_property
    def series(self) -> dict[str, Series]:
        """Quantities over time, by the names of the columns of ``frame``."""
        if self.topics:
            from stickslip_ros.runs.mapped import mapped_series  # it reads tables

            return mapped_series(self.recording, self.topics)
        return recorded_series(self.recording)

    @cached_property
    def frame(self) -> 'DataFrame':
        """
        Table of the run: ``voltage_v``, ``foot_m`` and readings, ``position_m``, over ``time_s``.

        From the trace where the run has one, else from its topics, whose times differ: what is
        not known at a time is not a number. ``attrs`` hold the units and what was recorded.

        """
        return frame_of(self.series, str(self.path))

    def plot(
        self,
        start_s: float | None = None,
        end_s: float | None = None,
        *,
        width_mm: float | None = None,
        font_pt: float | None = None,
    ) -> 'Figure':
        """
        Draw the run, or a stretch of it, with its events and status bits.

        With a width it is as a journal prints it: 85 mm are a column, with letters of 8 pt.

        Raises
        ------
        RecordingError, OutOfRange
            If there is nothing to draw, or not in that stretch, or not of such a size.

        """
        window = None
        if start_s is not None or end_s is not None:
            window = TimeWindow(start_s or 0.0, float('inf') if end_s is None else end_s)
        # ruff: noqa: PLC0415 - the first takes long, the second imports this
        from stickslip_ros.runs.plotting import look_of, looking
        from stickslip_ros.runs.run_figure import draw_run

        with looking(look_of(width_mm=width_mm, font_pt=font_pt)):
            return draw_run(self, window)[0]

    def save(self, path: str | Path) -> Path:
        """
        Copy the recording to a new file.

        Raises
        ------
        RecordingError
            If it exists, cannot be written, or the run is no single file.

        """
        if self.recording.files != [self.path]:
            raise RecordingError(self.path, 'is in parts', 'copy its files')
        target = Path(path)
        prepare_output(target, is_new=True)
        shutil.copyfile(self.path, target)
        return target

    def _repr_html_(self) -> str:
        shown = '' if self._result is None else self._result._repr_html_()
        if self._path is None:
            return shown
        rows = [(each.topic, each.type_name, each.messages) for each in self.recording.channels]
        return shown + html_table(str(self.path), rows, ('topic', 'type', 'messages'))


def open_run(path: str | Path, topics: Mapping[str, str] | None = None) -> Run:
    """
    Open a recording: an MCAP file, a bag directory, or the name that parts of a run share.

    Parameters
    ----------
    path : path-like
        The recording.
    topics : mapping of str to str, optional
        Of a recording of another program: topic, field and unit of its quantities, as
        ``{'position_m': '/rig/encoder.point.x', 'force_n': '/rig/cell.data (mN)'}``.

    Raises
    ------
    StickSlipError
        If it cannot be read, or has no such topics.

    """
    run = Run(path, topics=topics)
    _ = run.series if topics else run.recording  # refuses now what cannot be read
    return run


def frame_of(found: Mapping[str, Series], source: str) -> 'DataFrame':
    """Return quantities as one table over their times; what is not known then is no number."""
    import pandas as pd

    columns = {
        name: pd.Series(each.value, pd.Index(each.time_s, name='time_s'))
        for name, each in found.items()
    }
    if len({len(each) for each in columns.values()}) > 1:  # topics have one sample an instant
        columns = {name: each.groupby(level=0).last() for name, each in columns.items()}
    frame: DataFrame = pd.DataFrame(columns)
    frame.attrs['units'] = {'time_s': 's', **{name: each.unit for name, each in found.items()}}
    frame.attrs['source'] = source
    return frame


def recorded_stand(recording: Recording) -> Parameters:
    """Return the parameters that a recording carries; RecordingError if it carries none."""
    if PARAMETERS_FILE not in recording.attachments:
        problem = f'has no attachment {PARAMETERS_FILE}'
        hint = 'record with a drive of this package, or give the voltages as a table'
        raise RecordingError(recording.path, problem, hint)
    return parse_yaml(recording.attachments[PARAMETERS_FILE][1].decode(), PARAMETERS_FILE)


def recorded_series(recording: Recording, *, traced: bool = True) -> dict[str, Series]:
    """
    Return each quantity of a recording by its name: of the trace if wanted, else of its topic.

    A trace counts from two samples on. The topics have position and force at 1 kHz, the voltage
    once per ``trace.period``, and no displacement of the feet.

    """
    trace = recording.trace() if traced and topic_name(recording, 'trace') else {}
    found = {}
    for quantity in RUN_QUANTITIES:
        name = quantity.rpartition('_')[0]
        series = trace.get(name)
        if series is None or len(series) < TRACE_SAMPLES_MIN:
            topic = topic_name(recording, name)
            if not topic:
                continue
            series = recording.series(topic)
        if len(series):
            found[quantity] = series
    return found


def topic_name(recording: Recording, name: str) -> str:
    """Return the full name of a published topic, not of command or truth; empty if not there."""
    kinds = {each.name.removeprefix('~/'): each.type_name for each in READINGS}
    found = [
        topic
        for topic, kind in recording.types.items()
        if topic.rpartition('/')[2] == name
        and kind == kinds.get(name)
        and topic.rpartition('/')[0].rpartition('/')[2] not in {'command', 'truth'}
    ]
    return min(found, key=lambda topic: topic.count('/'), default='')


def recorded_commands(recording: Recording) -> list[LoggedCommand]:
    """Return the commands of a run; a recording of another program holds none."""
    if TOPICS_RECORD not in recording.metadata:
        return []
    return [
        LoggedCommand(time_ns * NANO, request.name, _numbers(request))
        for time_ns, request in recorded_requests(recording)
    ]


def _numbers(request: Request) -> str:
    """Return the numbers of a command over a topic, with units; of a vector its x."""
    command = COMMANDS[request.name]
    if not command.has_topic:
        return ''
    if command.is_table:
        return f'{len(request.values) // len(command.numbers)} rows'
    if command.name == JOINT:
        joints, shown = request.joints, []
        if len(joints.names) > 1:
            return f'{len(joints.names)} joints'
        for label, numbers in zip(command.numbers, joints[1:], strict=True):
            unit = label.partition(' ')[2]
            shown += [with_unit(each, unit) for each in numbers if not math.isnan(each)]
        return ', '.join(shown)
    shown = []
    for label, value in zip(command.numbers, request.values, strict=True):
        name, _, unit = label.partition(' ')
        shown.append(with_unit(value, unit) if unit else f'{value:g} {name}')
    return ', '.join(shown[:1] if command.frame else shown)


def events_within(recording: Recording, window: TimeWindow) -> list[LoggedEvent]:
    """Return the events of a stretch; text that is no event of ours is passed over."""
    found = []
    for time_s, message in timed_messages(recording, 'event'):
        try:
            content = json.loads(str(message))
        except ValueError:
            continue
        if not isinstance(content, dict):
            continue
        if window.start_s <= time_s <= window.end_s and 'result' in content:
            name = str(content.get('command', '?'))
            found.append(LoggedEvent(time_s, name, str(content['result'])))
    return found


def bits_within(recording: Recording, window: TimeWindow) -> list[BitSpan]:
    """Return when each status bit was set, in the order of the bits."""
    changes = [each for each in timed_messages(recording, 'status') if isinstance(each[1], int)]
    ends = [time_s for time_s, _ in changes[1:]] + [window.end_s]
    spans = []
    for bit in Status:
        merged: list[tuple[float, float]] = []  # what follows without a gap is one
        for (since_s, status), until_s in zip(changes, ends, strict=False):  # there may be none
            start_s, end_s = max(since_s, window.start_s), min(until_s, window.end_s)
            if status & bit and merged and start_s <= merged[-1][1]:
                merged[-1] = merged[-1][0], max(end_s, merged[-1][1])
            elif status & bit and end_s > start_s:
                merged.append((start_s, end_s))
        spans += [BitSpan(bit.name or '', *pair) for pair in merged]
    return spans


def timed_messages(recording: Recording, name: str) -> Iterator[tuple[float, Any]]:
    """Give times, s, and messages of a published topic; none if it is not there."""
    if topic := topic_name(recording, name):
        for _, at_ns, message in recording.messages([topic]):
            yield at_ns * NANO, message


def parse_window(text: str) -> TimeWindow:
    """Return the stretch of a text: ``2ms@0.3s`` is two milliseconds from 0.3 s on."""
    length, at, start = text.partition('@')
    if not at:
        raise WrongKind('window', text, 'LENGTH@START', 'write it as 2ms@0.3s or 0.002@0.3')
    length_s, start_s = to_si_list('window', (length, start), 's')
    if not length_s > 0.0:
        raise OutOfRange('length of the window', length_s, 's', 'not above 0 s', 'raise it')
    return TimeWindow(start_s, start_s + length_s)


def check_window(window: TimeWindow, run: TimeWindow) -> TimeWindow:
    """Return the part of a stretch that lies within a run; OutOfRange if nothing of it does."""
    if window.start_s > run.end_s or window.end_s < run.start_s:
        limit = f'outside of the run, {run.start_s:.6g} s to {run.end_s:.6g} s'
        raise OutOfRange('start of the window', window.start_s, 's', limit, 'move it')
    return TimeWindow(max(window.start_s, run.start_s), min(window.end_s, run.end_s))
