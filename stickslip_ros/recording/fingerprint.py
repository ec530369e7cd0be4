"""Whether two recordings hold the same data, byte for byte, and where they part."""

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import zip_longest
from typing import NamedTuple

from stickslip_ros.recording.reader import Recording
from stickslip_ros.units import NANO


class MessageRecord(NamedTuple):
    """One message as it stands in a file."""

    topic: str
    log_time_ns: int
    publish_time_ns: int
    sequence: int
    data: bytes


@dataclass(frozen=True)
class Difference:
    """The first message in which two recordings differ."""

    message: int  # its place in the file, from 0
    topic: str  # in the first recording; in the second where the first has ended
    time_s: float  # its simulated time
    what: str  # missing, data, time, sequence or topic


def compare_data(first: Recording, second: Recording) -> Difference | None:
    """Return the first difference of the messages of two recordings; None if there is none."""
    pairs = zip_longest(_entries(first), _entries(second))
    for place, (ours, theirs) in enumerate(pairs):
        if ours != theirs:
            known = ours or theirs
            source = first if ours else second
            time_s = (known.log_time_ns - source.time_origin_ns) * NANO
            return Difference(place, known.topic, time_s, _what(ours, theirs))
    return None


def data_digest(recording: Recording) -> str:
    """Return the SHA-256 of all messages of a recording, in the order of the file."""
    digest = hashlib.sha256()
    for entry in _entries(recording):
        digest.update(repr((*entry[:4], len(entry.data))).encode())
        digest.update(entry.data)
    return digest.hexdigest()


def _entries(recording: Recording) -> Iterator[MessageRecord]:
    for topic, message in recording.records():
        yield MessageRecord(
            topic, message.log_time, message.publish_time, message.sequence, message.data
        )


def _what(ours: MessageRecord | None, theirs: MessageRecord | None) -> str:
    if ours is None or theirs is None:
        return 'missing'
    if ours.topic != theirs.topic:
        return 'topic'
    if ours.data != theirs.data:
        return 'data'
    return 'sequence' if ours.sequence != theirs.sequence else 'time'
