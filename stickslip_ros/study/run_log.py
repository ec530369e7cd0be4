"""What a recorded run says in words: events, and which status bits were set when."""

import json
from typing import NamedTuple

from stickslip_ros.instrument.reports import Status
from stickslip_ros.recording.reader import Recording
from stickslip_ros.study.run_quantities import topic_name
from stickslip_ros.study.time_window import TimeWindow
from stickslip_ros.units import NANO


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


def events_within(recording: Recording, window: TimeWindow) -> list[LoggedEvent]:
    """Return the events of a stretch; text that is no event of ours is passed over."""
    topic = topic_name(recording, 'event')
    found = []
    for _, at_ns, message in recording.messages([topic]) if topic else ():
        time_s = at_ns * NANO
        content = _object(str(message))
        if window.start_s <= time_s <= window.end_s and 'result' in content:
            name = str(content.get('command', '?'))
            found.append(LoggedEvent(time_s, name, str(content['result'])))
    return found


def bits_within(recording: Recording, window: TimeWindow) -> list[BitSpan]:
    """Return when each status bit was set, in the order of the bits."""
    topic = topic_name(recording, 'status')
    changes = [
        (at_ns * NANO, int(message))
        for _, at_ns, message in (recording.messages([topic]) if topic else ())
        if isinstance(message, int)
    ]
    ends = [time_s for time_s, _ in changes[1:]] + [window.end_s]
    spans = []
    for bit in Status:
        stretches = [
            (max(start_s, window.start_s), min(end_s, window.end_s))
            for (start_s, status), end_s in zip(changes, ends, strict=True)
            if status & bit
        ]
        spans += [BitSpan(bit.name or '', *pair) for pair in _merged(stretches)]
    return spans


def _merged(stretches: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Join what follows without a gap, and drop what ends before it starts."""
    merged: list[tuple[float, float]] = []
    for start_s, end_s in stretches:
        if merged and start_s <= merged[-1][1]:
            merged[-1] = merged[-1][0], max(end_s, merged[-1][1])
        elif end_s > start_s:
            merged.append((start_s, end_s))
    return merged


def _object(text: str) -> dict[str, object]:
    try:
        content = json.loads(text)
    except ValueError:
        return {}
    return content if isinstance(content, dict) else {}
