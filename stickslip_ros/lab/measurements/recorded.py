# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Content of a recording or a part of it: quantities, commands, events."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from stickslip_ros.errors import Miscounted, OutOfRange, RecordingError, WrongKind
from stickslip_ros.instrument.commands import COMMANDS, JOINT, Request
from stickslip_ros.instrument.reports import read_event
from stickslip_ros.interface.messages import ArrayMessage
from stickslip_ros.interface.topics import FORMER_TYPES, READINGS
from stickslip_ros.message_types import FLOAT64_ARRAY
from stickslip_ros.parameters import SENSORS, Parameters, parse_yaml
from stickslip_ros.parameters.typed import to_si_list
from stickslip_ros.process.stopping import stop_if_asked
from stickslip_ros.recording.gaps import gaps_of
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.requests import recorded_requests
from stickslip_ros.recording.run_file import PARAMETERS_FILE, RUN_RECORD, TOPICS_RECORD
from stickslip_ros.recording.series import Series, split_columns
from stickslip_ros.sections import Section
from stickslip_ros.units import NANO, with_unit

RUN_QUANTITIES = {
    **{each.quantity: each.label for each in SENSORS},
    'voltage_v': 'voltage at the piezo',
    'foot_m': 'displacement of the feet',
}
"""Quantities of a run in words, by column of an experiment file. Without the unit the names are
columns of the trace, and topics."""
TRACE_SAMPLES_MIN = 2
STRETCH_BYTES = 1 << 23
"""Size of a stretch, unpacked: some seconds of a trace."""
_NO_SAMPLES = Series(np.empty(0), np.empty(0), '', '')


class TimeWindow(NamedTuple):
    """Start and end, s."""

    start_s: float
    end_s: float


_WHOLE = TimeWindow(-math.inf, math.inf)


class LoggedCommand(NamedTuple):
    """A command at the time of its effect, with its numbers as text."""

    time_s: float
    command: str
    numbers: str


class LoggedEvent(NamedTuple):
    """The end of a command."""

    time_s: float
    command: str
    result: str
    message: str


def sections_of(recording: Recording) -> Iterator[Section]:
    """Yield sections: topics, metadata of the run, changed parameters."""
    rows = []
    for each in recording.channels:
        rate = f'{each.rate_hz:.1f}' if each.rate_hz else '-'
        name = each.type_name.rpartition('/')[2]
        rows.append((each.topic, name, each.messages, rate, each.gaps))
    header = 'topic', 'type', 'messages', 'rate (Hz)', 'missing'
    yield Section(recording.origin, rows, header, [*recording.notes, *gaps_of(recording)])
    if run := recording.metadata.get(RUN_RECORD):
        yield Section('run', list(run.items()))
    if PARAMETERS_FILE in recording.attachments:
        yield from recorded_stand(recording).sections()
    else:
        yield Section(f'parameters: unknown, since the file has no {PARAMETERS_FILE}')


def recorded_stand(recording: Recording) -> Parameters:
    """Return the recorded parameters; RecordingError without them."""
    if PARAMETERS_FILE not in recording.attachments:
        problem = f'was recorded by another program: it has no {PARAMETERS_FILE} and no commands'
        topics = ', '.join(recording.types) or 'none'
        hint = f'map its topics, as --map voltage_v=TOPIC.FIELD; they are {topics}'
        raise RecordingError(recording.path, problem, hint)
    try:
        text = recording.attachments[PARAMETERS_FILE][1].decode()
    except UnicodeDecodeError:
        problem = f'its {PARAMETERS_FILE} is not text in UTF-8'
        raise RecordingError(recording.path, problem, 'record it again') from None
    return parse_yaml(text, f'{recording.path} {PARAMETERS_FILE}')


def recorded_series(recording: Recording, *, traced: bool = True) -> dict[str, Series]:
    """
    Return quantities by name, from a trace with two or more samples or (untraced) from topics.

    Topics have position and force at 1 kHz, voltage once per ``trace.period``, and no feet.

    """
    return _read_window(recording, _sources(recording, traced=traced))


def stretches_of(recording: Recording, window: TimeWindow | None = None) -> list[TimeWindow]:
    """
    Split a recording, or a window, at chunks into stretches of STRETCH_BYTES.

    A recording of another program is one stretch: its messages may be in any order.

    """
    outer = window or _WHOLE
    cuts_s = recording.cuts_s(STRETCH_BYTES) if recording.is_ours else []
    starts_s = [outer.start_s, *(each for each in cuts_s if outer.start_s < each <= outer.end_s)]
    ends_s = [*(math.nextafter(each, -math.inf) for each in starts_s[1:]), outer.end_s]
    return [TimeWindow(*each) for each in zip(starts_s, ends_s, strict=True)]


def series_by_stretch(
    recording: Recording, stretches: Sequence[TimeWindow], *, traced: bool = True
) -> Iterator[dict[str, Series]]:
    """Yield ``recorded_series`` of each stretch; Miscounted at the end if rows are missing."""
    sources = _sources(recording, traced=traced)
    recording.lost.clear()
    for stretch in stretches:
        stop_if_asked()
        part = recording.within(*stretch)
        if len(stretches) > 1:  # quantities may have samples in other stretches
            found = _read(part, sources)
            yield {name: found.get(name, _NO_SAMPLES) for name in sources}
        else:
            yield _read_window(part, sources)
    if any(recording.lost.values()) and (stretches[0][0], stretches[-1][1]) == _WHOLE:
        problem = f'rows of {", ".join(+recording.lost)} are not at the times of their blocks'
        raise Miscounted(recording.path, problem, 'export its topics alone, with --readings')


def _sources(recording: Recording, *, traced: bool) -> dict[str, str]:
    """Return the topic of each quantity; it may be the trace."""
    topic, columns, samples = topic_name(recording, 'trace') if traced else '', set[str](), 0
    for _, _, block in recording.messages([topic]) if topic else ():
        if isinstance(block, ArrayMessage):
            columns, samples = set(split_columns([block], topic)), samples + len(block.data)
        if samples >= TRACE_SAMPLES_MIN:
            break
    sources = {}
    for quantity in RUN_QUANTITIES:
        name = quantity.rpartition('_')[0]
        is_traced = name in columns and samples >= TRACE_SAMPLES_MIN
        if found := topic if is_traced else topic_name(recording, name):
            sources[quantity] = found
    return sources


def _read_window(recording: Recording, sources: Mapping[str, str]) -> dict[str, Series]:
    """Return the quantities of a window; refuse a window outside of the run."""
    found, window, run = _read(recording, sources), recording.window_s, recording.span_s
    if sources and not found and recording.is_ours:
        check_window(TimeWindow(*window), TimeWindow(*run))
    return found


def _read(recording: Recording, sources: Mapping[str, str]) -> dict[str, Series]:
    """Return the quantities with samples."""
    traces = {
        topic: recording.trace(topic)
        for topic in {*sources.values()}
        if recording.types[topic] == FLOAT64_ARRAY
    }
    found = {}
    for quantity, topic in sources.items():
        if topic in traces:
            series = traces[topic].get(quantity.rpartition('_')[0])
        else:
            series = recording.series(topic)
        if series is not None and len(series):
            found[quantity] = series
    return found


def topic_name(recording: Recording, name: str) -> str:
    """Return the full name of a published topic (no command, no truth); '' if absent."""
    kinds = {each.name.removeprefix('~/'): each.type_name for each in READINGS}
    known = {kinds.get(name), FORMER_TYPES.get(name)}
    found = [
        topic
        for topic, kind in recording.types.items()
        if topic.rpartition('/')[2] == name
        and kind in known
        and topic.rpartition('/')[0].rpartition('/')[2] not in {'command', 'truth'}
    ]
    return min(found, key=lambda topic: topic.count('/'), default='')


def recorded_commands(recording: Recording) -> list[LoggedCommand]:
    """Return the commands of a run; [] for another program."""
    if TOPICS_RECORD not in recording.metadata:
        return []
    return [
        LoggedCommand(time_ns * NANO, request.name, text_of_numbers(request))
        for time_ns, request in recorded_requests(recording)
    ]


def text_of_numbers(request: Request) -> str:
    """Return the numbers of a command with units; of a vector only x."""
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
    """Return the events in a window; other texts are skipped."""
    found = []
    for time_s, message in timed_messages(recording, 'event'):
        event = read_event(str(message))
        if event is not None and window.start_s <= time_s <= window.end_s:
            found.append(LoggedEvent(time_s, *(event[k] for k in LoggedEvent._fields[1:])))
    return found


def timed_messages(recording: Recording, name: str) -> Iterator[tuple[float, Any]]:
    """Yield times, s, and messages of a published topic, if present."""
    if topic := topic_name(recording, name):
        for _, at_ns, message in recording.messages([topic]):
            yield at_ns * NANO, message


def parse_window(text: str) -> TimeWindow:
    """Parse a window: ``2ms@0.3s`` starts at 0.3 s and lasts 2 ms."""
    length, at, start = text.partition('@')
    if not at:
        raise WrongKind('window', text, 'LENGTH@START', 'write it as 2ms@0.3s or 0.002@0.3')
    length_s, start_s = to_si_list('window', (length, start), 's')
    if not length_s > 0.0:
        raise OutOfRange('length of the window', length_s, 's', 'not above 0 s', 'raise it')
    return TimeWindow(start_s, start_s + length_s)


def check_window(window: TimeWindow, run: TimeWindow) -> TimeWindow:
    """Return the part of a window within a run; OutOfRange if empty."""
    if window.start_s > run.end_s or window.end_s < run.start_s:
        limit = f'outside of the run, {run.start_s:.6g} s to {run.end_s:.6g} s'
        raise OutOfRange('start of the window', window.start_s, 's', limit, 'move it')
    return TimeWindow(max(window.start_s, run.start_s), min(window.end_s, run.end_s))
