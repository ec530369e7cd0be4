# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Times of rows: clocks of columns, coarse and unsorted times."""

import numpy as np
from numpy.typing import NDArray

from stickslip_ros.arrays import Array
from stickslip_ros.errors import OutOfRange, quoted
from stickslip_ros.lab.readers.cells import TIME_DECIMALS, Rows

_ALIKE = 1e-3  # share by which distances of printed times may differ
_LOCAL, _SHUFFLED = 0.02, 0.4
"""Rows are sorted if each is off by this share of all, or so many are earlier than the last."""


def joined_clocks(rows: Rows, origin: str, hint: str) -> tuple[dict[str, Array], list[str]]:
    """
    Return columns over all times, NaN where unknown, and notes on changed times.

    Values belong to the clock, a column ``time_s``, before them. Raises OutOfRange, with the hint,
    if the times of a quantity do not increase.

    """
    names = [each.name for each in rows.columns]
    clocks = sorted(
        (each.index, at) for at, each in enumerate(rows.columns) if names[at] == 'time_s'
    )
    owners = [max(sum(at < each.index for at, _ in clocks) - 1, 0) for each in rows.columns]
    found, notes = dict[str, tuple[Array, Array]](), list[str]()
    for owner, (_, clock) in enumerate(clocks):
        timed = np.flatnonzero(~np.isnan(rows.numbers[clock]))
        time_s = rows.numbers[clock][timed]
        order: NDArray[np.intp] = np.arange(len(timed))
        members = [at for at, of in enumerate(owners) if of == owner and names[at] != 'time_s']
        known = {at: ~np.isnan(rows.numbers[at][timed]) for at in members}
        if any(np.any(np.diff(time_s[each]) <= 0.0) for each in known.values()):
            time_s, note = _spread(time_s)
            order, note = (order, note) if note else _sorted(time_s)
            notes += [f'{quoted(rows.columns[clock].header)}: {note}'] if note else []
        for at, is_known in known.items():
            kept = order[is_known[order]]
            for row in 1 + np.flatnonzero(np.diff(time_s[kept]) <= 0.0):
                limit = f'not after the {time_s[kept[row - 1]]:.9g} s of the row before'
                place = f'{origin}: line {rows.lines[timed[kept[row]]]}, column time_s:'
                raise OutOfRange(place, float(time_s[kept[row]]), 's', limit, hint)
            found[names[at]] = time_s[kept], rows.numbers[at][timed[kept]]
    all_s = np.unique(np.concatenate([time_s for time_s, _ in found.values()]))
    columns = {'time_s': all_s, **{name: np.full(len(all_s), np.nan) for name in found}}
    for name, (time_s, values) in found.items():
        columns[name][np.searchsorted(all_s, time_s)] = values
    return columns, notes


def _sorted(time_s: Array) -> tuple[NDArray[np.intp], str]:
    """Return the order of rows by time and a note, or that of the file if a clock begins anew."""
    order, count = np.argsort(time_s, kind='stable'), len(time_s)
    off, falls = np.argsort(order) - np.arange(count), np.sum(np.diff(time_s) < 0.0)
    # A clock that begins anew has long runs, which sorting would mix.
    is_local = np.max(np.abs(off)) <= max(1.0, _LOCAL * count)
    if falls and (is_local or falls == count - 1 or falls > _SHUFFLED * count):
        return order, f'{np.sum(off != 0)} rows were not in the order of time, and are sorted'
    return np.arange(count), ''


def _spread(time_s: Array) -> tuple[Array, str]:
    """Return times spread evenly if they were printed with too few digits."""
    changes = np.flatnonzero(np.diff(time_s)) + 1
    sizes, ticks_s = np.diff(changes), np.diff(time_s)[changes - 1]
    ends = max([*changes[:1], *len(time_s) - changes[-1:]], default=0)
    # A tick has a row more or less than another by rounding, two by ties.
    is_even = len(sizes) > 1 < sizes.min() and np.ptp(sizes) <= 1 + (sizes.min() > 3)
    if not is_even or ends > sizes.max() or np.ptp(ticks_s) > _ALIKE * ticks_s.min():
        return time_s, ''
    tick_s, step_s = float(ticks_s[0]), float(np.sum(ticks_s[1:]) / np.sum(sizes))
    rows_s = step_s * np.arange(len(time_s))
    begins_s = time_s - rows_s
    begin_s = max(min(time_s[0], begins_s.min() + 0.5 * tick_s), begins_s.max() - 0.5 * tick_s)
    note = f'times repeat, as they are printed to {tick_s:.6g} s; rows are spread evenly, '
    return np.round(begin_s + rows_s, TIME_DECIMALS), f'{note}{step_s:.6g} s apart'
