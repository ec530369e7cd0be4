# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Compare the messages of two recordings; compute a digest of all messages."""

import hashlib
from dataclasses import dataclass
from itertools import zip_longest

from mcap.records import Message as Stored

from stickslip_ros.recording.reader import Recording
from stickslip_ros.units import NANO


@dataclass(frozen=True)
class Difference:
    """The first different message of two recordings."""

    message: int  # its place in the file, from 0
    topic: str  # in the first recording, or in the second if the first has ended
    time_s: float  # its simulated time
    what: str  # missing, data, time, sequence or topic


def compare_data(first: Recording, second: Recording) -> Difference | None:
    """
    Return the first different message of two recordings, or None.

    For a bag of ros2 bag record, only the bytes of each topic are compared.

    """
    if first.is_copy:
        return _compare_topics(first, second)
    for place, (ours, theirs) in enumerate(zip_longest(first.records(), second.records())):
        topic, message = ours or theirs
        what = _different_in(ours, theirs) if ours and theirs else 'missing'
        if what:
            source = first if ours else second
            time_s = (message.log_time - source.time_origin_ns) * NANO
            return Difference(place, topic, time_s, what)
    return None


def _different_in(ours: tuple[str, Stored], theirs: tuple[str, Stored]) -> str:
    """Describe the difference of two messages with their topics, or return ''."""
    (topic, one), (other_topic, other) = ours, theirs
    differs = {
        'topic': topic != other_topic,
        'data': one.data != other.data,
        'sequence': one.sequence != other.sequence,
        'time': (one.log_time, one.publish_time) != (other.log_time, other.publish_time),
    }
    return next((name for name, applies in differs.items() if applies), '')


def _compare_topics(first: Recording, second: Recording) -> Difference | None:
    """Return the first difference in the bytes of the common topics."""
    for name in (each for each in second.types if each in first.types):
        both = (each.records([name]) for each in (first, second))
        for place, each in enumerate(zip_longest(*both)):
            if None in each or each[0][1].data != each[1][1].data:
                at_ns = next(filter(None, each))[1].log_time - first.time_origin_ns
                what = 'missing' if None in each else 'data'
                return Difference(place, name, at_ns * NANO, what)
    return None


def data_digest(recording: Recording) -> str:
    """Return the SHA-256 of all messages in file order."""
    digest = hashlib.sha256()
    for topic, each in recording.records():
        times_ns = each.log_time, each.publish_time
        digest.update(repr((topic, *times_ns, each.sequence, len(each.data))).encode())
        digest.update(each.data)
    return digest.hexdigest()
