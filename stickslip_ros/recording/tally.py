"""What a topic of a recording holds, counted message by message."""

from dataclasses import dataclass
from typing import Final

from stickslip_ros.units import NS_PER_S

_SEQUENCE_NUMBERS: Final = 1 << 32


@dataclass(frozen=True)
class ChannelSummary:
    """
    What a topic of a recording holds.

    Parameters
    ----------
    topic, type_name : str
        Name and message type.
    messages : int
        Messages in the file.
    first_ns, last_ns : int or None
        Earliest and latest time; None without messages.
    gaps : int
        Sequence numbers missing between messages: so many were lost on the way to the file.

    """

    topic: str
    type_name: str
    messages: int
    first_ns: int | None
    last_ns: int | None
    gaps: int

    @property
    def rate_hz(self) -> float:
        """Mean rate from the first to the last message; 0 where none can be told."""
        if self.first_ns is None or self.last_ns is None or self.first_ns == self.last_ns:
            return 0.0
        return (self.messages - 1) * NS_PER_S / (self.last_ns - self.first_ns)


class Tally:
    """Counts the messages of one topic in the order of the file."""

    def __init__(self) -> None:
        self._times_ns: tuple[int, int] | None = None
        self._messages = 0
        self._gaps = 0
        self._sequence = 0

    def add(self, time_ns: int, sequence: int) -> None:
        """Count a message."""
        first_ns, last_ns = self._times_ns or (time_ns, time_ns)
        self._times_ns = min(first_ns, time_ns), max(last_ns, time_ns)
        if self._messages:
            self._gaps += _skipped(self._sequence, sequence)
        self._messages += 1
        self._sequence = sequence

    def summary(self, topic: str, type_name: str) -> ChannelSummary:
        """Give what was counted."""
        first_ns, last_ns = self._times_ns or (None, None)
        return ChannelSummary(topic, type_name, self._messages, first_ns, last_ns, self._gaps)


def _skipped(before: int, after: int) -> int:
    """Give how many numbers lie between two; none where they repeat or run backwards."""
    step = (after - before) % _SEQUENCE_NUMBERS
    return step - 1 if 0 < step < _SEQUENCE_NUMBERS // 2 else 0
