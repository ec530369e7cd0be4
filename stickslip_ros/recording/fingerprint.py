"""Whether two recordings hold the same data, byte for byte, and where they part."""

import hashlib
from dataclasses import dataclass
from itertools import zip_longest

from stickslip_ros.recording.reader import Recording
from stickslip_ros.units import NANO


@dataclass(frozen=True)
class Difference:
    """The first message in which two recordings differ."""

    message: int  # its place in the file, from 0
    topic: str  # in the first recording; in the second where the first has ended
    time_s: float  # its simulated time
    what: str  # missing, data, time, sequence or topic


def compare_data(first: Recording, second: Recording) -> Difference | None:
    """Return the first difference of the messages of two recordings; None if there is none."""
    for place, (ours, theirs) in enumerate(zip_longest(first.records(), second.records())):
        topic, message = ours or theirs
        what = 'missing'
        if ours and theirs:
            differs = {
                'topic': topic != theirs[0],
                'data': message.data != theirs[1].data,
                'sequence': message.sequence != theirs[1].sequence,
                'time': (message.log_time, message.publish_time)
                != (theirs[1].log_time, theirs[1].publish_time),
            }
            what = next((name for name, applies in differs.items() if applies), '')
        if what:
            source = first if ours else second
            time_s = (message.log_time - source.time_origin_ns) * NANO
            return Difference(place, topic, time_s, what)
    return None


def data_digest(recording: Recording) -> str:
    """Return the SHA-256 of all messages of a recording, in the order of the file."""
    digest = hashlib.sha256()
    for topic, each in recording.records():
        times_ns = each.log_time, each.publish_time
        digest.update(repr((topic, *times_ns, each.sequence, len(each.data))).encode())
        digest.update(each.data)
    return digest.hexdigest()
