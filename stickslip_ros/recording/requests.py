# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The requests of a recorded run, in the order of their execution."""

from collections.abc import Iterator

from stickslip_ros.budget import load_json
from stickslip_ros.errors import RecordingError
from stickslip_ros.instrument.commands import Request, TimedRequest
from stickslip_ros.interface.cdr import unpack
from stickslip_ros.interface.channels import Channel, Qos, name_in_file
from stickslip_ros.interface.requests import NOTES, read_request
from stickslip_ros.interface.topics import COMMAND_TOPICS, TOPICS
from stickslip_ros.message_types import STRING
from stickslip_ros.recording.reader import Recording
from stickslip_ros.recording.run_file import TOPICS_RECORD


def channels_of(recording: Recording) -> dict[str, Channel]:
    """Return the channels of a run of this package by topic key."""
    topics = {name_in_file(topic.key): topic for topic in TOPICS}
    channels = {}
    try:
        for name, text in recording.metadata.get(TOPICS_RECORD, {}).items():
            content, topic = load_json(text), topics[name]
            channels[topic.key] = Channel(content.pop('topic'), topic.type_name, Qos(**content))
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        channels = {}
    if 'position' not in channels or NOTES not in channels:
        problem = 'does not say which topic is which'
        raise RecordingError(recording.path, problem, 'record with a drive of this package')
    return channels


def recorded_requests(recording: Recording) -> Iterator[TimedRequest]:
    """Yield every request of a run of this package in the order of execution."""
    channels = channels_of(recording)
    commands = {channels[each.key].topic: each for each in COMMAND_TOPICS if each.key in channels}
    notes = channels[NOTES].topic
    for topic, stored in recording.records([notes, *commands]):
        at_ns = stored.log_time - recording.time_origin_ns
        if topic == notes:
            text = str(unpack(STRING, stored.data))
            try:
                note = load_json(text)
                settings = tuple(note['settings'].items())
                values, tag = tuple(note['values']), str(note.get('tag', ''))
                request = Request(note['name'], values, settings, tag=tag)
            except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
                problem = f'holds a request that cannot be read: {text[:80]}'
                hint = 'record with a drive of this package'
                raise RecordingError(recording.path, problem, hint) from None
            yield TimedRequest(at_ns, request)
        elif topic in commands:
            yield TimedRequest(at_ns, read_request(commands[topic], stored.data))
