"""What a recording was asked: every request, at the tick at which it took effect."""

import json
from collections.abc import Iterator
from typing import NamedTuple

from stickslip_ros.errors import RecordingError
from stickslip_ros.instrument.commands import Request
from stickslip_ros.recording.messages import (
    ArrayMessage,
    Message,
    PointMessage,
    WrenchMessage,
)
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.topics import COMMANDS, Topic


class TimedRequest(NamedTuple):
    """A request and the simulated time at which it took effect, ns."""

    time_ns: int
    request: Request


def recorded_requests(recording: Recording) -> Iterator[TimedRequest]:
    """
    Give every request of a run, in the order in which the drive carried them out.

    Parameters
    ----------
    recording : Recording
        Of a run of this package.

    Raises
    ------
    RecordingError
        If a note of a request cannot be read.

    """
    names = {recording.find(topic.name): topic for topic in COMMANDS if topic.recorded}
    notes = recording.find('request')
    for topic, time_ns, message in recording.messages([*names, notes]):
        if topic == notes:
            yield TimedRequest(time_ns, _request_of_note(recording, message))
        else:
            yield TimedRequest(time_ns, request_of(names[topic], message))


def request_of(topic: Topic, message: Message) -> Request:
    """Return what a recorded message of a command topic asked for."""
    values: tuple[float, ...]
    match message:
        case WrenchMessage():
            values = (*message.force, *message.torque)
        case PointMessage():
            values = (message.x, message.y, message.z)
        case ArrayMessage():
            values = tuple(message.data.ravel().tolist())
        case _:
            values = (float(message),)
    return Request(topic.request, values)


def _request_of_note(recording: Recording, message: Message) -> Request:
    try:
        note = json.loads(str(message))
        return Request(note['name'], tuple(note['values']), tuple(note['settings'].items()))
    except (ValueError, KeyError, TypeError, AttributeError):
        problem = f'holds a request that cannot be read: {str(message)[:80]}'
        mend = 'record with a drive of this package'
        raise RecordingError(recording.path, problem, mend) from None
