# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Times of rows: clocks of columns, coarse and unsorted times."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from stickslip_ros.arrays import Array
from stickslip_ros.errors import OutOfRange, quoted
from stickslip_ros.lab.tables.columns import Column

_ALIKE = 1e-3  # share by which distances of printed times may differ
_LOCAL, _SHUFFLED = 0.02, 0.4
"""Rows are sorted if each is off by this share of all, or so many are earlier than the last."""
TIME_DECIMALS = 15  # of computed times, s


def joined_clocks(
    chosen: Sequence[Column],
    numbers: Sequence[Array],
    lines: NDArray[np.intp],
    origin: str,
    hint: str,
) -> tuple[dict[str, Array], list[str]]:
    """
    Return columns over all times, NaN where unknown, and notes on changed times.

    Values belong to the clock, a column ``time_s``, before them. Raises OutOfRange, with the hint,
    if the times of a quantity do not increase.

    """
    clocks = sorted((each.index, at) for at, each in enumerate(chosen) if each.name == 'time_s')
    owners = [max(sum(place < each.index for place, _ in clocks) - 1, 0) for each in chosen]
    found, notes = dict[str, tuple[Array, Array]](), list[str]()
    for owner, (_, at) in enumerate(clocks):
        rows = np.flatnonzero(~np.isnan(numbers[at]))
        members = {
            each.name: values[rows]
            for each, values, of_this in zip(chosen, numbers, owners, strict=True)
            if of_this == owner and each.name != 'time_s'
        }
        known = [~np.isnan(values) for values in members.values()]
        time_s, note = _mended(numbers[at][rows], known)
        notes += [f'{quoted(chosen[at].header)}: {note}'] if note else []
        order = np.argsort(time_s, kind='stable') if note else np.arange(len(rows))
        for name, values in members.items():
            kept = order[~np.isnan(values[order])]
            wrong = np.flatnonzero(np.diff(time_s[kept]) <= 0.0)
            if len(wrong):
                before_s, after_s = time_s[kept][wrong[0] :][:2].tolist()
                limit = f'not after the {before_s:.9g} s of the row before'
                place = f'{origin}: line {lines[rows[kept[wrong[0] + 1]]]}, column time_s:'
                raise OutOfRange(place, after_s, 's', limit, hint)
            found[name] = time_s[kept], values[kept]
    all_s = np.unique(np.concatenate([time_s for time_s, _ in found.values()]))
    columns = {'time_s': all_s, **{name: np.full(len(all_s), np.nan) for name in found}}
    for name, (time_s, values) in found.items():
        columns[name][np.searchsorted(all_s, time_s)] = values
    return columns, notes


def _mended(time_s: Array, known: Sequence[NDArray[np.bool_]]) -> tuple[Array, str]:
    """Return times of rows, spread if coarse, and a note if changed or to be sorted."""
    if all(np.all(np.diff(time_s[each]) > 0.0) for each in known):
        return time_s, ''
    count, falls = len(time_s), int(np.sum(np.diff(time_s) < 0.0))
    if not falls:
        return _spread(time_s)
    off = np.argsort(np.argsort(time_s, kind='stable'), kind='stable') - np.arange(count)
    # A clock that begins anew has long runs, which sorting would mix.
    is_local = np.max(np.abs(off)) <= max(1.0, _LOCAL * count)
    if is_local or falls == count - 1 or falls > _SHUFFLED * count:
        return time_s, f'{np.sum(off != 0)} rows were not in the order of time, and are sorted'
    return time_s, ''


def _spread(time_s: Array) -> tuple[Array, str]:
    """Return times spread evenly if they were printed with too few digits."""
    changes = np.flatnonzero(np.diff(time_s)) + 1
    # A tick has a row more or less than another by rounding, two by ties.
    sizes, ticks_s = np.diff(changes), np.diff(time_s)[changes - 1]
    if len(changes) < 3 or sizes.min() < 2 or np.ptp(sizes) > 1 + (sizes.min() > 3):
        return time_s, ''
    ends = max(changes[0], len(time_s) - changes[-1])
    if ends > sizes.max() or np.ptp(ticks_s) > _ALIKE * ticks_s.min():
        return time_s, ''
    tick_s, step_s = float(ticks_s[0]), float(np.sum(ticks_s[1:]) / np.sum(sizes))
    rows_s = step_s * np.arange(len(time_s))
    begins_s = time_s - rows_s
    begin_s = max(min(time_s[0], begins_s.min() + 0.5 * tick_s), begins_s.max() - 0.5 * tick_s)
    note = f'times repeat, as they are printed to {tick_s:.6g} s; rows are spread evenly, '
    return np.round(begin_s + rows_s, TIME_DECIMALS), f'{note}{step_s:.6g} s apart'
