# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The messages that a recording lacks: which topic, how many, from when to when."""

from stickslip_ros.recording.reader import ChannelSummary, Recording
from stickslip_ros.recording.storage import CLOSING_RECORD
from stickslip_ros.units import NANO


def gaps_of(recording: Recording) -> list[str]:
    """Return the loss of each topic in words; one beyond its ends is known to the recorder."""
    closing = recording.metadata.get(CLOSING_RECORD, {})
    counts = {}
    for each in recording.channels:
        said = closing.get(f'dropped {each.topic}', '')[:9]
        counts[each.topic] = max(each.gaps or 0, int(said) if said.isdecimal() else 0)
    lossy = [topic for topic, count in counts.items() if count]
    begin_s, end_s = recording.span_s
    told = []
    for topic, (each, gap_s) in _gaps_within(recording, lossy).items() if lossy else ():
        first_s, last_s = gap_s or ((each.last_ns or 0) * NANO, end_s)
        if counts[topic] > (each.gaps or 0):  # beyond the ends
            has_first = each.messages and not each.first_sequence
            first_s, last_s = first_s if has_first else begin_s, end_s
        span = f'between {first_s:.9g} s and {last_s:.9g} s'
        told.append(f'lacks {counts[topic]} messages of {topic} {span}')
    return told


def _gaps_within(
    recording: Recording, topics: list[str]
) -> dict[str, tuple[ChannelSummary, tuple[float, float] | None]]:
    """Return the content of topics, and from when to when messages are missing between others."""
    seen = {topic: ChannelSummary(topic) for topic in topics}
    gaps_s: dict[str, tuple[float, float]] = {}
    for topic, message in recording.records(topics):
        before_s, gaps = (seen[topic].last_ns or 0) * NANO, seen[topic].gaps or 0
        seen[topic].add(message.log_time - recording.time_origin_ns, message.sequence)
        if (seen[topic].gaps or 0) > gaps:
            gaps_s[topic] = gaps_s.get(topic, (before_s,))[0], (seen[topic].last_ns or 0) * NANO
    return {topic: (each, gaps_s.get(topic)) for topic, each in seen.items()}
