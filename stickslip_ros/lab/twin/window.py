# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Samples of a rig, ordered by their stamps, cut into windows that follow each other.

Stamps alone decide: windows begin at multiples of their length, so that a recording that is played
gives the windows that the rig gave. A window is complete when all quantities have gone beyond its
end, or one has by more than a lag. Behind a pause and where the clock of the rig begins anew, so
do the windows: none reaches over a gap.

"""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.lab.experiments.reading import LEAD_S
from stickslip_ros.parameters import to_nanoseconds
from stickslip_ros.units import NANO

_PAUSE_S = 0.5
"""Time without a sample after which a pause has ended."""
_SET_BACK_S = 1.0
"""Distance behind the newest stamp from which a stamp is of another clock rather than late."""
_CLOCKS_APART = 1e-4  # rate by which two clocks may differ
_LEAD_NS = to_nanoseconds(LEAD_S)


class Window(NamedTuple):
    """A stretch of samples: stamps of its start and end, and times since its start, s, by name."""

    start_ns: int
    end_ns: int
    samples: dict[str, tuple[Array, Array]]  # times from -LEAD_S on, and values


class RigClock:
    """
    The clock of a rig, as its stamps show it: the one in which messages without a stamp are told.

    It is behind that of the system by the least of what messages with a stamp were sent later.

    """

    def __init__(self) -> None:
        self._behind_ns: float | None = None
        self._sent_ns = 0

    def learn(self, stamp_ns: int, sent_ns: int) -> None:
        """Take a stamp, and when its message was sent by the clock of the system."""
        behind_ns, passed_ns = sent_ns - stamp_ns, max(sent_ns - self._sent_ns, 0)
        before_ns = self._behind_ns
        if before_ns is None or abs(behind_ns - before_ns) > _SET_BACK_S / NANO:
            before_ns = behind_ns
        self._behind_ns = min(behind_ns, before_ns + _CLOCKS_APART * passed_ns)
        self._sent_ns = sent_ns

    def stamp_of(self, sent_ns: int) -> int:
        """Return the stamp of a message without one."""
        return sent_ns - round(self._behind_ns or 0.0)


class Windows:
    """
    Takes samples as they come, and gives windows.

    Parameters
    ----------
    quantities : sequence of str
        What comes.
    length_s, lag_s : float
        Length of a window, and how long it waits for samples that come late.

    Attributes
    ----------
    late, doubled, reordered : int
        Samples that came after their window, twice, or behind a younger one.
    pauses, restarts : int
        How often there was none for _PAUSE_S, and how often the clock was set back.

    """

    def __init__(self, quantities: Sequence[str], length_s: float, lag_s: float) -> None:
        self._length_ns, self._lag_ns = to_nanoseconds(length_s), to_nanoseconds(lag_s)
        self._stamps: dict[str, list[int]] = {name: [] for name in quantities}
        self._values: dict[str, list[float]] = {name: [] for name in quantities}
        self._newest = dict.fromkeys(quantities, -1)
        self._last_ns = self._start_ns = self._oldest_ns = -1
        self.late = self.doubled = self.reordered = self.pauses = self.restarts = 0

    def add(self, quantity: str, stamps_ns: Sequence[int], values: Sequence[float]) -> None:
        """Take some samples of a quantity, whose stamps rise."""
        first_ns = stamps_ns[0]
        if self._last_ns < 0:
            self._begin(first_ns)
        elif first_ns > self._last_ns + _PAUSE_S / NANO:
            self.pauses += 1
            self._begin(first_ns)
        elif first_ns < self._last_ns - _SET_BACK_S / NANO:
            self.restarts += 1
            self._begin(first_ns)
        if first_ns < self._oldest_ns:
            place = int(np.searchsorted(stamps_ns, self._oldest_ns))
            self.late += place
            stamps_ns, values = stamps_ns[place:], values[place:]
            if not len(stamps_ns):
                return
        newest_ns = self._newest[quantity]
        self.reordered += stamps_ns[0] < newest_ns
        self._newest[quantity] = max(newest_ns, stamps_ns[-1])
        self._last_ns = max(self._last_ns, stamps_ns[-1])
        self._stamps[quantity].extend(stamps_ns)
        self._values[quantity].extend(values)

    def complete(self) -> Iterator[Window]:
        """Yield the windows that are complete, in their order."""
        while self._last_ns >= 0:
            end_ns = self._start_ns + self._length_ns
            if min(self._newest.values()) < end_ns and self._last_ns < end_ns + self._lag_ns:
                return
            yield self._cut(end_ns)

    def _begin(self, first_ns: int) -> None:
        """Begin anew with the first whole window that has a lead."""
        for name in self._stamps:
            self._stamps[name].clear()
            self._values[name].clear()
            self._newest[name] = -1
        self._last_ns = self._oldest_ns = first_ns
        self._start_ns = math.ceil((first_ns + _LEAD_NS) / self._length_ns) * self._length_ns

    def _cut(self, end_ns: int) -> Window:
        """Return the window that ends there, and keep what leads the next one."""
        start_ns, samples = self._start_ns, dict[str, tuple[Array, Array]]()
        for name, stamps in self._stamps.items():
            stamps_ns, first = np.unique(np.array(stamps, dtype=np.int64), return_index=True)
            values = np.array(self._values[name], dtype=np.float64)[first]
            self.doubled += len(stamps) - len(stamps_ns)
            inside = slice(*np.searchsorted(stamps_ns, (start_ns - _LEAD_NS, end_ns)))
            time_s = np.asarray((stamps_ns[inside] - start_ns) * NANO, dtype=np.float64)
            samples[name] = time_s, values[inside]
            kept = int(np.searchsorted(stamps_ns, end_ns - _LEAD_NS))
            self._stamps[name] = stamps_ns[kept:].tolist()
            self._values[name] = values[kept:].tolist()
        self._start_ns = self._oldest_ns = end_ns
        return Window(start_ns, end_ns, samples)
