# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Options of reading tables."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from stickslip_ros.errors import OutOfRange, RecordingError, UnknownName
from stickslip_ros.lab.measurements.vocabulary import (
    BY_AMPLITUDE,
    EXPERIMENT_COLUMNS,
    OVER_TIME,
    POINT_COLUMNS,
    TIME_COLUMNS,
    MeasuredTable,
)
from stickslip_ros.parameters import Spec
from stickslip_ros.recording.integrity import is_recording

_RATE = Spec(float, 0.0, 'Hz', 'measured', 'rows per second', 1e-6, 1e12)


@dataclass(frozen=True)
class TableOptions:
    """Options of reading tables, given by the user."""

    # header by quantity, {'force_n': 'Force (mN)'}; the unit overrides the file's. For recordings
    # of other programs: topic and field by quantity
    headers: Mapping[str, str] = field(default_factory=dict)
    preloads_n: Sequence[float] = ()  # for tables without a column of it: one each or one for all
    report: Callable[[MeasuredTable], None] | None = None  # called with each table
    is_run: bool = False  # tables over time are simulated: preloads_n apply
    stand_n: float | None = None  # default preload of tables by amplitude; None: refused
    rate_hz: float | None = None  # rate of rows; columns of times are then ignored
    only_tables: bool = True  # no source is a recording: no header is a topic
    is_shared: bool = False  # several sources are recordings: a topic may be in one only

    def __post_init__(self) -> None:
        """Check column names, preloads and rate."""
        for name in self.headers:
            if name not in {**POINT_COLUMNS, **TIME_COLUMNS}:
                points, times = ', '.join(POINT_COLUMNS), ', '.join(TIME_COLUMNS)
                hint = f'known are, by amplitude {points}; over time {times}'
                raise UnknownName('column of --map', name, hint)
        for preload_n in self.preloads_n:
            POINT_COLUMNS['preload_n'].check('--preload', preload_n)
        if self.rate_hz is not None:
            _RATE.check('--rate', self.rate_hz)

    @property
    def topics(self) -> dict[str, str]:
        """Headers that are topic and field, ``/rig/cell.wrench.force.x (mN)``."""
        return {name: text for name, text in self.headers.items() if text.startswith('/')}

    def for_sources(self, listed: Sequence[Any]) -> 'TableOptions':
        """Return the options for these sources; refuse more preloads than sources."""
        if len(self.preloads_n) > len(listed):
            limit = f'above the number of tables, {len(listed)}'
            hint = 'give one for all tables, or one for each'
            raise OutOfRange('number of preloads', len(self.preloads_n), '', limit, hint)
        is_table = [
            hasattr(each, 'to_csv') or (isinstance(each, Path) and not is_recording(each))
            for each in listed
        ]
        if self.rate_hz is not None and not any(is_table):
            hint = 'leave it out: a recording has times'
            raise OutOfRange('--rate', self.rate_hz, 'Hz', 'without effect on recordings', hint)
        is_shared = is_table.count(False) > 1
        return dataclasses.replace(self, only_tables=all(is_table), is_shared=is_shared)

    def preload_n(self, number: int) -> float | None:
        """Return the preload given for a table, counted from 0."""
        given = self.preloads_n
        if len(given) == 1:
            return given[0]
        return given[number] if number < len(given) else None

    def check_use(self, kind: str, where: str) -> None:
        """Refuse options that do not apply to a table of this kind."""
        known = EXPERIMENT_COLUMNS[kind]
        useless = [f'--map {name}=' for name in self.headers if name not in known]
        if self.preloads_n and kind == OVER_TIME and not self.is_run:
            useless.append('--preload')
        if self.rate_hz is not None and (kind == BY_AMPLITUDE or 'time_s' in self.headers):
            useless.append('--rate' if kind == BY_AMPLITUDE else '--rate with --map time_s=')
        if useless:
            problem = f'{useless[0]} is without effect on an {kind}'
            raise RecordingError(where, problem, 'leave it out')


TABLE_DEFAULTS = TableOptions()
