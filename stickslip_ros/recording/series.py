# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A quantity over time: the one type of measured and of simulated runs; columns of a trace."""

import re
from collections.abc import Sequence
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

    # times in s; finite, never falling. Two samples of one instant are a jump, shape (n,)
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
                'give one value per time',
            )
        ends_s = self.time_s[:1], self.time_s[-1:]
        if np.isfinite(ends_s).all() and (self.time_s[1:] >= self.time_s[:-1]).all():
            return
        fallen = np.diff(self.time_s, prepend=self.time_s[:1]) < 0.0
        for wrong, limit in (
            (~np.isfinite(self.time_s), 'not finite'),
            (fallen, 'before the sample in front of it'),
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
        """Give the samples from `start_s` to `end_s`, both included."""
        if not start_s <= end_s:
            raise OutOfRange(
                'end of the window', end_s, 's', f'before its start {start_s:.6g} s', 'swap them'
            )
        first = int(np.searchsorted(self.time_s, start_s, 'left'))
        last = int(np.searchsorted(self.time_s, end_s, 'right'))
        return self._of_checked_times(time_s=self.time_s[first:last], value=self.value[first:last])

    def beside(self, value: Array, unit: str, origin: str) -> 'Series':
        """Give another quantity at the same times, shape (n,)."""
        return self._of_checked_times(value=value, unit=unit, origin=origin)

    def _of_checked_times(self, **changed: Array | str) -> 'Series':
        made = copy(self)
        for name, each in changed.items():
            object.__setattr__(made, name, each)
        return made


def split_columns(blocks: Sequence[ArrayMessage], origin: str) -> dict[str, Series]:
    """Join the blocks of a trace, labelled ``t[s],voltage[V]``; give columns by bare names."""
    if not blocks:
        return {}
    labels = blocks[0].labels[1].split(',') if len(blocks[0].labels) == 2 else []
    parts = [_LABEL.fullmatch(label) for label in labels]
    units = {part['name']: part['unit'] or '' for part in parts if part}
    is_table = units.get(_TIME) == 's' and len(units) == len(labels)
    for block in blocks:
        same = block.labels == blocks[0].labels and block.data.shape[1:] == (len(units),)
        if not (is_table and same):
            raise WrongKind(
                f'layout of a block of {origin}',
                (block.labels, block.data.shape),
                'that of one table with distinct columns, one of them t[s]',
                'read a topic that carries a trace',
            )
    table = np.empty((len(units), sum(len(block.data) for block in blocks)))
    begin = 0
    for block in blocks:
        end = begin + len(block.data)
        table[:, begin:end] = block.data.T
        begin = end
    columns = dict(zip(units, table, strict=True))
    time_s = columns.pop(_TIME)
    times = Series(time_s, time_s, 's', f'{origin} {_TIME}')
    return {
        name: times.beside(value, units[name], f'{origin} {name}')
        for name, value in columns.items()
    }
