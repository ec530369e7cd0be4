# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Times of rows: clocks of columns, and coarse times."""

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.errors import OutOfRange, quoted
from stickslip_ros.lab.tables.cells import TIME_DECIMALS, Rows

_ALIKE = 1e-3  # share by which distances of printed times may differ


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
        time_s = rows.numbers[clock]
        members = [at for at, of in enumerate(owners) if of == owner and names[at] != 'time_s']
        known = {at: np.flatnonzero(~np.isnan(time_s + rows.numbers[at])) for at in members}
        if any(np.any(np.diff(time_s[each]) <= 0.0) for each in known.values()):
            time_s, note = _spread(time_s)
            notes += [f'{quoted(rows.columns[clock].header)}: {note}'] if note else []
        for at, kept in known.items():
            for row in 1 + np.flatnonzero(np.diff(time_s[kept]) <= 0.0):
                limit = f'not after the {time_s[kept[row - 1]]:.9g} s of the row before'
                place = f'{origin}: line {rows.lines[kept[row]]}, column time_s:'
                raise OutOfRange(place, float(time_s[kept[row]]), 's', limit, hint)
            found[names[at]] = time_s[kept], rows.numbers[at][kept]
    all_s = np.unique(np.concatenate([time_s for time_s, _ in found.values()]))
    columns = {'time_s': all_s, **{name: np.full(len(all_s), np.nan) for name in found}}
    for name, (time_s, values) in found.items():
        columns[name][np.searchsorted(all_s, time_s)] = values
    return columns, notes


def _spread(time_s: Array) -> tuple[Array, str]:
    """Return times of evenly spaced rows that were printed with too few digits, if they are."""
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
