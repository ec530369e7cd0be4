"""What a recording was asked: every request, at the tick at which it took effect."""

import json
from array import array
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from stickslip_ros.errors import RecordingError
from stickslip_ros.instrument.commands import Request
from stickslip_ros.recording.cdr import unpack
from stickslip_ros.recording.channels import Channel
from stickslip_ros.recording.messages import (
    STRING,
    ArrayMessage,
    Message,
    PointMessage,
    WrenchMessage,
)
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.run import NOTE_KEY
from stickslip_ros.recording.run_file import read_channels
from stickslip_ros.recording.topics import COMMANDS, Topic


class TimedRequest(NamedTuple):
    """A request and the simulated time at which it took effect, ns."""

    time_ns: int
    request: Request


def channels_of(recording: Recording) -> dict[str, Channel]:
    """
    Return the channels of a run by the keys of their topics.

    Raises
    ------
    RecordingError
        If the recording does not say which topic is which.

    """
    try:
        channels = read_channels(recording.metadata)
    except (ValueError, KeyError, TypeError):
        channels = {}
    if 'position' not in channels or NOTE_KEY not in channels:
        problem = 'does not say which topic is which'
        raise RecordingError(recording.path, problem, 'record with a drive of this package')
    return channels


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
        If it is none, or a note of a request cannot be read.

    """
    channels = channels_of(recording)
    commands = {channels[each.key].topic: each for each in COMMANDS if each.key in channels}
    notes = channels[NOTE_KEY].topic
    for topic, stored in recording.records():
        if topic == notes:
            message = unpack(STRING, stored.data)
            yield TimedRequest(stored.log_time, _request_of_note(recording, message))
        elif topic in commands:
            command = commands[topic]
            message = unpack(command.type_name, stored.data)
            yield TimedRequest(stored.log_time, request_of(command, message))


def request_of(topic: Topic, message: Message) -> Request:
    """Return what a recorded message of a command topic asked for."""
    values: Sequence[float]
    match message:
        case WrenchMessage():
            values = (*message.force, *message.torque)
        case PointMessage():
            values = (message.x, message.y, message.z)
        case ArrayMessage():
            values = array('d', message.data.tobytes())
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
