# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Messages missing in a recording: topic, number, time span."""

from stickslip_ros.recording.reader import ChannelSummary, Recording
from stickslip_ros.recording.storage import CLOSING_RECORD
from stickslip_ros.units import NANO


def gaps_of(recording: Recording) -> list[str]:
    """Describe the loss of each topic; the recorder counts losses at the ends of a topic too."""
    closing = recording.metadata.get(CLOSING_RECORD, {})
    counts = {}
    for each in recording.channels:
        dropped = closing.get(f'dropped {each.topic}', '')[:9]
        counts[each.topic] = max(each.gaps or 0, int(dropped) if dropped.isdecimal() else 0)
    lossy = [topic for topic, count in counts.items() if count]
    begin_s, end_s = recording.span_s
    sentences = []
    for topic, (each, gap_s) in _gaps_within(recording, lossy).items() if lossy else ():
        first_s, last_s = gap_s or ((each.last_ns or 0) * NANO, end_s)
        if counts[topic] > (each.gaps or 0):  # some are before the first or after the last message
            has_first = each.messages and not each.first_sequence
            first_s, last_s = first_s if has_first else begin_s, end_s
        span = f'between {first_s:.9g} s and {last_s:.9g} s'
        sentences.append(f'lacks {counts[topic]} messages of {topic} {span}')
    return sentences


def _gaps_within(
    recording: Recording, topics: list[str]
) -> dict[str, tuple[ChannelSummary, tuple[float, float] | None]]:
    """Return content of topics, and the span, s, of their missing messages, or None."""
    sums = {topic: ChannelSummary(topic) for topic in topics}
    gaps_s: dict[str, tuple[float, float]] = {}
    for topic, message in recording.records(topics):
        before_s, gaps = (sums[topic].last_ns or 0) * NANO, sums[topic].gaps or 0
        sums[topic].add(message.log_time - recording.time_origin_ns, message.sequence)
        if (sums[topic].gaps or 0) > gaps:
            gaps_s[topic] = gaps_s.get(topic, (before_s,))[0], (sums[topic].last_ns or 0) * NANO
    return {topic: (each, gaps_s.get(topic)) for topic, each in sums.items()}
