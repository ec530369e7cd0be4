# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Windows of samples of a rig, ordered by their stamps.

Windows start at multiples of their length, so a replayed recording gives the same windows. A
window is complete when all quantities have passed its end, or one quantity by more than the lag.
After a pause or a reset clock, windows restart: no window spans a gap.

"""

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.interface.requests import INT32_MAX
from stickslip_ros.lab.experiments.sensor_clock import LEAD_S
from stickslip_ros.lab.readers.clocks import APART_S, DRIFT
from stickslip_ros.parameters import to_nanoseconds
from stickslip_ros.units import NANO, NS_PER_S

_PAUSE_S = 0.5  # shortest time without samples that counts as a pause, s
_BLOCK_MAX_S = 2.0  # longest block; a drive sends at most 1 s
_KEPT_MAX = 1_000_000  # samples of a quantity that wait for the end of a window
_STAMP_END_NS = (INT32_MAX + 1) * NS_PER_S  # first time beyond those of a header
_LEAD_NS = to_nanoseconds(LEAD_S)


class Window(NamedTuple):
    """A stretch of samples: start, end, and by name times since the start, s, with values."""

    start_ns: int
    end_ns: int
    samples: dict[str, tuple[Array, Array]]  # from -LEAD_S on


def _fault_of(stamps_ns: Sequence[int]) -> str:
    """Return the reason to refuse a block with these stamps; empty without a reason."""
    first_ns, last_ns = stamps_ns[0], stamps_ns[-1]
    if not 0 <= first_ns <= last_ns < _STAMP_END_NS:
        span = f'{first_ns * NANO:.9g} to {last_ns * NANO:.9g} s'
        return f'stamps of {span} do not rise from 0 to {INT32_MAX} s; correct the clock'
    if last_ns - first_ns > _BLOCK_MAX_S / NANO:
        length = f'{(last_ns - first_ns) * NANO:.6g} s, above {_BLOCK_MAX_S:g} s'
        return f'a block has a length of {length}; send shorter ones'
    if len(stamps_ns) > 1 and (gap_ns := np.diff(stamps_ns).max()) > _PAUSE_S / NANO:
        gap = f'{gap_ns * NANO:.6g} s, above {_PAUSE_S:g} s'
        return f'a block has a gap of {gap}; send a block for each stretch'
    return ''


class RigClock:
    """The clock of a rig, for messages without a stamp, by the least delay of stamped ones."""

    def __init__(self) -> None:
        self._behind_ns: float | None = None
        self._sent_ns = 0

    def learn(self, stamp_ns: int, sent_ns: int) -> None:
        """Update the delay by a stamp and the send time of its message, in the system clock."""
        behind_ns, passed_ns = sent_ns - stamp_ns, max(sent_ns - self._sent_ns, 0)
        before_ns = self._behind_ns
        if before_ns is None or abs(behind_ns - before_ns) > APART_S / NANO:
            before_ns = behind_ns
        self._behind_ns = min(behind_ns, before_ns + DRIFT * passed_ns)
        self._sent_ns = sent_ns

    def stamp_of(self, sent_ns: int) -> int:
        return sent_ns - round(self._behind_ns or 0.0)


class Windows:
    """Cuts samples into windows; counts omitted, doubled and reordered samples, and gaps."""

    def __init__(self, quantities: Sequence[str], length_s: float, lag_s: float) -> None:
        self._length_ns, self._lag_ns = to_nanoseconds(length_s), to_nanoseconds(lag_s)
        self.late = self.doubled = self.reordered = self.not_finite = 0
        self.pauses = self.restarts = 0
        self.expect(quantities)

    def expect(self, quantities: Iterable[str]) -> None:
        """Restart with these quantities."""
        self._stamps: dict[str, list[int]] = {name: [] for name in quantities}
        self._values: dict[str, list[float]] = {name: [] for name in self._stamps}
        self.quantities = set(self._stamps)
        self._newest = dict.fromkeys(self._stamps, -1)
        self._came = dict[str, int]()  # last stamp of each quantity, kept or dropped
        self._last_ns = self._start_ns = self._oldest_ns = -1

    def add(self, quantity: str, stamps_ns: Sequence[int], values: Sequence[float]) -> str:
        """Add samples of a quantity with rising stamps; return the reason of a refusal."""
        if not len(stamps_ns) or quantity not in self.quantities:
            return f'{quantity} is not expected, or has no samples; send rows of the same columns'
        if why := _fault_of(stamps_ns):
            return why
        if not all(map(math.isfinite, values)):
            finite = np.isfinite(values)
            self.not_finite += int((~finite).sum())
            stamps_ns = np.asarray(stamps_ns)[finite].tolist()
            values = np.asarray(values)[finite].tolist()
        return self._keep(quantity, stamps_ns, values) if stamps_ns else ''

    def _keep(self, quantity: str, stamps_ns: Sequence[int], values: Sequence[float]) -> str:
        first_ns, before_ns = stamps_ns[0], self._came.get(quantity, -1)
        self._came[quantity] = stamps_ns[-1]
        pauses = first_ns > self._last_ns + _PAUSE_S / NANO
        restarts = first_ns < self._last_ns - APART_S / NANO
        if self._last_ns < 0:
            self._begin(first_ns)
        elif pauses or restarts:
            if before_ns >= 0 and abs(first_ns - before_ns) < _PAUSE_S / NANO:  # no pause here
                off_s = (first_ns - self._last_ns) * NANO
                return f'{quantity} is {off_s:+.3g} s off the other stamps; synchronise the clocks'
            self.pauses, self.restarts = self.pauses + pauses, self.restarts + restarts
            self._begin(first_ns)
        if first_ns < self._oldest_ns:
            place = int(np.searchsorted(stamps_ns, self._oldest_ns))
            self.late += place
            stamps_ns, values = stamps_ns[place:], values[place:]
            if not len(stamps_ns):
                return ''
        newest_ns = self._newest[quantity]
        if stamps_ns[0] == stamps_ns[-1] == newest_ns:
            self.doubled += len(stamps_ns)
            return ''
        self.reordered += stamps_ns[0] < newest_ns
        self._newest[quantity] = max(newest_ns, stamps_ns[-1])
        self._last_ns = max(self._last_ns, stamps_ns[-1])
        if len(self._stamps[quantity]) + len(stamps_ns) > _KEPT_MAX:
            why = f'{quantity} would have more than {_KEPT_MAX} samples before the end of a window'
            return f'{why}; send fewer samples, with advancing stamps'
        self._stamps[quantity].extend(stamps_ns)
        self._values[quantity].extend(values)
        return ''

    def complete(self) -> Iterator[Window]:
        while self._last_ns >= 0:
            end_ns = self._start_ns + self._length_ns
            if min(self._newest.values()) < end_ns and self._last_ns < end_ns + self._lag_ns:
                return
            yield self._cut(end_ns)

    def _begin(self, first_ns: int) -> None:
        """Restart at the first whole window with a lead."""
        for name in self._stamps:
            self._stamps[name].clear()
            self._values[name].clear()
            self._newest[name] = -1
        self._last_ns = self._oldest_ns = first_ns
        self._start_ns = math.ceil((first_ns + _LEAD_NS) / self._length_ns) * self._length_ns

    def _cut(self, end_ns: int) -> Window:
        """Return the window up to this end; keep the lead of the next one."""
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
