# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Clocks of quantities: source of their times, and whether quantities share a clock.

The rules hold for messages of a bag, columns of a table, and windows of a twin.

"""

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.errors import OutOfRange, RecordingError, quoted
from stickslip_ros.lab.readers.cells import TIME_DECIMALS, Rows

STAMP, LOG = 'stamps of its messages', 'log times'
"""Kinds of clocks of messages."""
APART_S = 1.0
"""Largest difference within one clock, s; a larger difference means two clocks."""
DRIFT = 1e-4  # largest difference of the rates of two clocks
_DRIFT_MIN_S = 1e-3  # least drift over a recording that is reported
_UNEVEN, _GAP = 0.2, 5.0
"""Times are even if 80 % of the intervals are within 20 % of the median; a gap is 5 medians."""
_TICK_ROUNDING = 1e-3  # largest relative difference of printed time steps


class Clock(NamedTuple):
    """Source of the times of a quantity."""

    source: str  # topic and field, or quantities
    kind: str  # STAMP, LOG, or a column of times
    time_s: Array  # shape (n,)
    ahead_s: Array | None = None  # times minus the log times, common to all topics, shape (n,)


def check_clocks(clocks: Sequence[Clock], origin: object, remedy: str) -> list[str]:
    """
    Return a note for each gap, step back and drift; refuse clocks that are APART_S apart.

    The distance of two topics is the difference of their leads over the log times; of two
    columns, the time from the end of one to the start of the other.

    """
    notes = []
    for one, other in combinations(clocks, 2):
        if one.ahead_s is None or other.ahead_s is None:
            ends = sorted((float(each.time_s[0]), float(each.time_s[-1])) for each in (one, other))
            apart_s = ends[1][0] - ends[0][1]
        else:
            apart_s = abs(float(np.median(one.ahead_s) - np.median(other.ahead_s)))
        if apart_s > APART_S:
            problem = (
                f'has two clocks, {apart_s:.6g} s apart: {one.source} is timed by {one.kind}, '
                f'{other.source} by {other.kind}; one clock differs by {APART_S:g} s at most'
            )
            raise RecordingError(origin, problem, remedy)
    for each in clocks:
        notes += _gaps_of(each)
        if each.ahead_s is None:
            continue
        ahead_s = each.ahead_s
        by_log_s = each.time_s[np.argsort(each.time_s - ahead_s, kind='stable')]
        back_s = np.diff(by_log_s, prepend=by_log_s[0])
        if np.min(back_s) < -APART_S:
            at = int(np.argmin(back_s))
            problem = f'has a clock that was set back by {-back_s[at]:.6g} s'
            where = f'before message {at + 1} of {each.source}, timed by {each.kind}'
            raise RecordingError(origin, f'{problem} {where}', remedy)
        if falls := int(np.sum(back_s < 0.0)):
            text = f'goes back by {-np.min(back_s):.3g} s at most, at {falls} of {len(ahead_s)}'
            notes.append(f'the clock of {each.source} {text} samples, which are sorted')
        fourth = len(ahead_s) // 4
        if fourth:
            drift_s = float(np.median(ahead_s[-fourth:]) - np.median(ahead_s[:fourth]))
            lasts_s = float(each.time_s[-1] - each.time_s[0])
            spread_s = float(np.ptp(np.quantile(ahead_s[:fourth], (0.1, 0.9))))
            if abs(drift_s) > max(_DRIFT_MIN_S, DRIFT * lasts_s, 2.0 * spread_s):
                text = (
                    f'drifts by {1e3 * drift_s:+.3g} ms against the log times in {lasts_s:.3g} s'
                )
                notes.append(f'the clock of {each.source} {text}')
    return notes


def are_even(time_s: Array) -> bool:
    """Return whether times are samples at a rate, some missing, not corners of a curve."""
    apart_s = np.diff(time_s)
    typical_s = float(np.median(apart_s)) if len(apart_s) else 0.0
    if not typical_s > 0.0:
        return False
    return bool(np.mean(np.abs(apart_s / typical_s - 1.0) >= _UNEVEN) < _UNEVEN)


def _gaps_of(clock: Clock) -> list[str]:
    """Return a note on the gaps between samples of an even rate, if any."""
    if not are_even(clock.time_s):
        return []
    apart_s = np.diff(clock.time_s)
    typical_s = float(np.median(apart_s))
    gaps = np.flatnonzero(apart_s > _GAP * typical_s)
    if not len(gaps):
        return []
    at = int(gaps[np.argmax(apart_s[gaps])])
    count = 'a gap' if len(gaps) == 1 else f'{len(gaps)} gaps'
    where = f'the longest of {apart_s[at]:.6g} s after {clock.time_s[at]:.6g} s'
    return [f'{clock.source} has {count}, {where}; samples are {typical_s:.3g} s apart']


def spread_blocks(time_s: Array) -> tuple[Array, str]:
    """
    Spread samples with equal times, as of simulated time, evenly; return the times and a note.

    Samples of an instant fill the time to the next instant, since a clock shows the last tick
    reached. Times count as shared if there are fewer than half as many as samples.

    """
    starts = np.flatnonzero(np.diff(time_s, prepend=-np.inf))
    if len(starts) < 2 or 2 * len(starts) > len(time_s):
        return time_s, ''
    spread_s, note = _spread(time_s)
    if note:
        return spread_s, note
    sizes = np.diff(np.append(starts, len(time_s)))
    steps_s = np.diff(time_s[starts]) / sizes[:-1]
    steps_s = np.minimum(steps_s, 1.5 * np.median(steps_s))  # keep pauses
    step_of = np.repeat(np.append(steps_s, steps_s[-1]), sizes)
    place = np.arange(len(time_s)) - np.repeat(starts, sizes)
    note = f'{len(time_s)} samples have {len(starts)} times; they are spread evenly, '
    return time_s + place * step_of, f'{note}{np.median(steps_s):.6g} s apart'


def times_in_blocks(
    time_s: Array, rate_hz: float, origin: str, *, is_first: bool
) -> tuple[Array, str]:
    """
    Return times of samples in blocks with one time each, by their rate; and a note.

    A block's time is that of its first sample (a stamp) or of its last. Blocks are contiguous; a
    longer distance means lost blocks. Raises OutOfRange if the blocks have another rate.

    """
    starts = np.flatnonzero(np.diff(time_s, prepend=-np.inf))
    sizes = np.diff(np.append(starts, len(time_s)))
    lasts_s = (sizes[:-1] if is_first else sizes[1:]) / rate_hz
    share = np.diff(time_s[starts]) / lasts_s
    typical = float(np.median(share)) if len(share) else 1.0
    blocks = np.maximum(np.rint(share / typical), 1.0)  # 1 without a lost block
    counted_s = np.append(0.0, np.cumsum(blocks * lasts_s))
    off_s = time_s[starts] - counted_s
    if abs(typical - 1.0) > _UNEVEN or np.ptp(off_s) > np.max(lasts_s, initial=0.0):
        block_hz = rate_hz * counted_s[-1] / np.ptp(time_s)
        limit = f'not the rate {block_hz:.6g} Hz of its blocks of {np.median(sizes):g} samples'
        raise OutOfRange(f'rate of {origin}', rate_hz, 'Hz', limit, f'write at {block_hz:.6g}Hz')
    lost = f', {np.sum(blocks - 1.0):g} are lost' if np.any(blocks > 1.0) else ''
    begin_s = counted_s + np.median(off_s) - (0.0 if is_first else (sizes - 1) / rate_hz)
    place = np.arange(len(time_s)) - np.repeat(starts, sizes)
    found_s = np.round(np.repeat(begin_s, sizes) + place / rate_hz, TIME_DECIMALS)
    return found_s, f'{len(starts)} blocks hold samples at {rate_hz:g} Hz{lost}'


def joined_clocks(rows: Rows, origin: str, hint: str) -> tuple[dict[str, Array], list[str]]:
    """
    Return columns over all times, NaN where unknown, and notes on changed times.

    The clock of a column is the nearest column ``time_s`` before it. Raises OutOfRange, with the
    hint, if the times of a quantity do not increase.

    """
    names, found = [each.name for each in rows.columns], dict[str, tuple[Array, Array]]()
    clocks = sorted((e.index, at) for at, e in enumerate(rows.columns) if names[at] == 'time_s')
    owners = [max(sum(at < each.index for at, _ in clocks) - 1, 0) for each in rows.columns]
    shown, notes = list[Clock](), list[str]()
    for owner, (_, clock) in enumerate(clocks):
        timed = np.flatnonzero(~np.isnan(rows.numbers[clock]))
        time_s, timed_by = rows.numbers[clock][timed], rows.columns[clock]
        members = [at for at, of in enumerate(owners) if of == owner and names[at] != 'time_s']
        if members and len(timed):
            label = f'column {1 + timed_by.index} {quoted(timed_by.header)}'
            shown.append(Clock(', '.join(names[at] for at in members), label, time_s))
        known = {at: ~np.isnan(rows.numbers[at][timed]) for at in members}
        if any(np.any(np.diff(time_s[each]) <= 0.0) for each in known.values()):
            time_s, note = _spread(time_s)
            notes += [f'{quoted(timed_by.header)}: {note}'] if note else []
        for at, is_known in known.items():
            kept = np.flatnonzero(is_known)
            for row in 1 + np.flatnonzero(np.diff(time_s[kept]) <= 0.0):
                limit = f'not after the {time_s[kept[row - 1]]:.9g} s of the row before'
                place = f'{origin}: line {rows.lines[timed[kept[row]]]}, column time_s:'
                raise OutOfRange(place, float(time_s[kept[row]]), 's', limit, hint)
            found[names[at]] = time_s[kept], rows.numbers[at][timed[kept]]
    first = rows.columns[clocks[0][1]]
    remedy = f'write --map time_s="#{1 + first.index} ({first.unit})" if each row is of one time, '
    notes += check_clocks(shown, origin, f'{remedy}else give a table of each clock')
    return over_all_times(found), notes


def over_all_times(found: Mapping[str, tuple[Array, Array]]) -> dict[str, Array]:
    """Return quantities (times, values) as columns over all times; NaN where unknown."""
    all_s = np.unique(np.concatenate([time_s for time_s, _ in found.values()]))
    columns = {'time_s': all_s, **{name: np.full(len(all_s), np.nan) for name in found}}
    for name, (time_s, values) in found.items():
        columns[name][np.searchsorted(all_s, time_s)] = values
    return columns


def _spread(time_s: Array) -> tuple[Array, str]:
    """Spread the rows of equal ticks evenly; return times and a note, '' if unchanged."""
    changes = np.flatnonzero(np.diff(time_s)) + 1
    sizes, ticks_s = np.diff(changes), np.diff(time_s)[changes - 1]
    ends = max([*changes[:1], *len(time_s) - changes[-1:]], default=0)
    # Rows per tick differ by one by rounding, by two with ties.
    is_even = len(sizes) > 1 < sizes.min() and np.ptp(sizes) <= 1 + (sizes.min() > 3)
    if not is_even or ends > sizes.max() or np.ptp(ticks_s) > _TICK_ROUNDING * ticks_s.min():
        return time_s, ''
    step_s = float(np.sum(ticks_s[1:]) / np.sum(sizes))
    rows_s = step_s * np.arange(len(time_s))
    note = f'times repeat, in steps of {ticks_s[0]:.6g} s; rows are spread evenly, '
    spread_s = np.max(time_s - rows_s) + rows_s
    return np.round(spread_s, TIME_DECIMALS), f'{note}{step_s:.6g} s apart'
