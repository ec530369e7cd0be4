# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A quantity over time, measured or simulated; columns of a trace."""

import re
from collections.abc import Iterable
from copy import copy
from dataclasses import dataclass
from typing import Final

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.errors import OutOfRange, WrongKind
from stickslip_ros.interface.messages import ArrayMessage

_TIME: Final = 't'  # column of a trace that holds the time, in s
_LABEL: Final = re.compile(r'(?P<name>[^\[\]]+)(\[(?P<unit>[^\[\]]*)\])?')


@dataclass(frozen=True, eq=False)
class Series:
    """A quantity sampled at rising times."""

    # times in s, shape (n,); finite, never falling. Two samples of one instant are a jump.
    time_s: Array
    value: Array  # the quantity in `unit`, shape (n,)
    unit: str  # SI unit; empty for a pure number
    origin: str  # where the samples come from, for a legend or an error message

    def __post_init__(self) -> None:
        object.__setattr__(self, 'time_s', np.asarray(self.time_s, dtype=np.float64))
        object.__setattr__(self, 'value', np.asarray(self.value, dtype=np.float64))
        shapes = self.time_s.shape, self.value.shape
        if self.time_s.ndim != 1 or shapes[0] != shapes[1]:
            raise WrongKind(
                f'shapes of time and value of {self.origin}',
                shapes,
                'a pair of equal one-dimensional shapes',
                'give a value for each time',
            )
        ends_s = self.time_s[:1], self.time_s[-1:]
        if np.isfinite(ends_s).all() and (self.time_s[1:] >= self.time_s[:-1]).all():
            return
        falls = np.diff(self.time_s, prepend=self.time_s[:1]) < 0.0
        for wrong, limit in (
            (~np.isfinite(self.time_s), 'not finite'),
            (falls, 'before the sample in front of it'),
        ):
            if wrong.any():
                index = int(np.argmax(wrong))
                raise OutOfRange(
                    f'time of sample {index} of {self.origin}',
                    float(self.time_s[index]),
                    's',
                    limit,
                    'sort the samples or split the run where time starts anew',
                )

    def __len__(self) -> int:
        return len(self.time_s)

    def window(self, start_s: float, end_s: float) -> 'Series':
        """Return the samples from `start_s` to `end_s`, both included."""
        if not start_s <= end_s:
            raise OutOfRange(
                'end of the window', end_s, 's', f'before its start {start_s:.6g} s', 'swap them'
            )
        first = int(np.searchsorted(self.time_s, start_s, 'left'))
        last = int(np.searchsorted(self.time_s, end_s, 'right'))
        return self._of_checked_times(time_s=self.time_s[first:last], value=self.value[first:last])

    def with_value(self, value: Array, unit: str, origin: str) -> 'Series':
        """Return another quantity, shape (n,), at the same times."""
        return self._of_checked_times(value=value, unit=unit, origin=origin)

    def _of_checked_times(self, **changed: Array | str) -> 'Series':
        made = copy(self)
        for name, each in changed.items():
            object.__setattr__(made, name, each)
        return made


class TraceColumns:
    """
    Joins the blocks of a trace, labelled ``t[s],voltage[V]``.

    ``room`` rows are allocated at first; the arrays grow as needed.

    """

    def __init__(self, origin: str, room: int = 0) -> None:
        self._origin, self._room = origin, room
        self._labels: tuple[str, ...] = ()
        self._units: dict[str, str] = {}
        self._table, self._rows = np.empty((0, 0)), 0

    def add(self, block: ArrayMessage) -> None:
        """Add a block; WrongKind if its layout differs from earlier blocks."""
        if not self._units:
            self._labels = block.labels[1:]  # the label of the rows changes with each activation
            names = block.labels[1].split(',') if len(block.labels) == 2 else []
            parts = [_LABEL.fullmatch(name) for name in names]
            self._units = {part['name']: part['unit'] or '' for part in parts if part}
            if self._units.get(_TIME) != 's' or len(self._units) != len(names):
                self._units = {}
            self._table = np.empty((len(self._units), self._room))
        is_like = block.labels[1:] == self._labels and block.data.shape[1:] == (len(self._units),)
        if not (self._units and is_like):
            raise WrongKind(
                f'layout of a block of {self._origin}',
                (block.labels, block.data.shape),
                'a table with distinct columns, one of them t[s]',
                'read a topic that carries a trace',
            )
        begin, self._rows = self._rows, self._rows + len(block.data)
        if self._rows > self._table.shape[1]:
            wider = np.empty((len(self._units), max(self._rows, 2 * self._table.shape[1])))
            wider[:, :begin] = self._table[:, :begin]
            self._table = wider
        self._table[:, begin : self._rows] = block.data.T

    def series(self) -> dict[str, Series]:
        """Return the columns by name without unit; {} without blocks."""
        if not self._units:
            return {}
        columns = dict(zip(self._units, self._table[:, : self._rows], strict=True))
        time_s = columns.pop(_TIME)
        times = Series(time_s, time_s, 's', f'{self._origin} {_TIME}')
        return {
            name: times.with_value(value, self._units[name], f'{self._origin} {name}')
            for name, value in columns.items()
        }


def split_columns(blocks: Iterable[ArrayMessage], origin: str) -> dict[str, Series]:
    """Join the blocks of a trace; return its columns by name."""
    columns = TraceColumns(origin)
    for block in blocks:
        columns.add(block)
    return columns.series()
