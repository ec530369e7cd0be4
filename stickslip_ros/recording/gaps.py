# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The messages that a recording lacks: which topic, how many, from when to when."""

from typing import Final, NamedTuple

from stickslip_ros.recording.reader import ChannelSummary, Recording
from stickslip_ros.recording.storage import CLOSING_RECORD
from stickslip_ros.units import NANO

DIGITS: Final = 9
"""Digits of a count of messages that are read."""


class Gap(NamedTuple):
    """Lost messages of a topic, between the times of two messages or ends of the recording."""

    topic: str
    messages: int
    start_s: float
    end_s: float

    def __str__(self) -> str:
        """Return the gap in words."""
        span = f'between {self.start_s:.9g} s and {self.end_s:.9g} s'
        return f'{self.messages} messages of {self.topic} {span}'


def gaps_of(recording: Recording) -> list[Gap]:
    """
    Return the gap of each topic that has lost messages, from its first loss to its last.

    Sequence numbers prove a loss between two messages. The recorder counts losses before the first
    and after the last message as well.

    """
    closing, origin_ns = recording.metadata.get(CLOSING_RECORD, {}), recording.time_origin_ns
    lost = {}
    for each in recording.channels:
        said = closing.get(f'dropped {each.topic}', '')[:DIGITS]
        if count := max(each.gaps, int(said) if said.isdecimal() else 0):
            lost[each.topic] = count
    seen = {topic: ChannelSummary(topic) for topic in lost}
    spans: dict[str, tuple[float, float]] = {}
    for topic, message in recording.records(list(lost)) if lost else ():
        before_s, gaps = (seen[topic].last_ns or 0) * NANO, seen[topic].gaps
        seen[topic].add(message.log_time - origin_ns, message.sequence)
        if seen[topic].gaps > gaps:
            now_s = (message.log_time - origin_ns) * NANO
            spans[topic] = spans.get(topic, (before_s, now_s))[0], now_s
    first_s, last_s = recording.span_s
    for topic, count in lost.items():
        ends, missing = seen[topic], count - seen[topic].gaps
        start_s, end_s = spans.get(
            topic, ((ends.last_ns or 0) * NANO, (ends.first_ns or 0) * NANO)
        )
        if 0 < ends.first_sequence <= missing or not ends.messages:
            start_s, missing = first_s, missing - ends.first_sequence
        spans[topic] = start_s, last_s if missing else end_s
    return [Gap(topic, count, *spans[topic]) for topic, count in lost.items()]
