# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Clock of a drive of this package in recordings of other programs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.interface.cdr import unpack
from stickslip_ros.message_types import FLOAT64_ARRAY
from stickslip_ros.recording.any_message import numbers_of
from stickslip_ros.recording.chunks import Places
from stickslip_ros.recording.integrity import open_whole
from stickslip_ros.units import NS_PER_S

TRACE_END_MAX_S: Final = 1e9  # later times of a trace are invalid


@dataclass(frozen=True, eq=False)
class DriveClock:
    """Log times and stamps of readings, ns, each counted from the first."""

    logs: Array
    stamps: Array
    first_log_ns: int
    first_stamp_ns: int
    origin_ns: int  # time origin of the drive

    @classmethod
    def fit(
        cls, files: Sequence[Path], topics: Mapping[str, str], origin_ns: int
    ) -> 'DriveClock | None':
        """Return the clock of ``position`` or ``trace``; None if log times are simulated times."""
        logs_ns: Places = np.empty(0, np.int64)
        stamps_ns = logs_ns
        if 'position' in topics:
            stamps_ns, _, logs_ns = numbers_of(files, topics['position'], 'point.x')
            logs_ns = np.sort(logs_ns)
        elif 'trace' in topics:
            logs_ns, ends_s = _ends_of_blocks(files, topics['trace'])
            stamps_ns = np.rint(ends_s * NS_PER_S).astype(np.int64) + origin_ns
        if not len(logs_ns) or np.array_equal(logs_ns, stamps_ns):
            return None
        elapsed = [(each - each[0]).astype(np.float64) for each in (logs_ns, stamps_ns)]
        return cls(elapsed[0], elapsed[1], int(logs_ns[0]), int(stamps_ns[0]), origin_ns)

    def drive_times(self, log_ns: Any) -> Any:
        """Convert log times to times of the drive, ns."""
        at = log_ns - self.first_log_ns
        outside = np.minimum(at, 0) + np.maximum(at - int(self.logs[-1]), 0)
        inside = np.rint(np.interp(at, self.logs, self.stamps)).astype(np.int64)
        return np.maximum(self.first_stamp_ns + inside + outside, self.origin_ns)


def _ends_of_blocks(files: Sequence[Path], topic: str) -> tuple[Places, Array]:
    """Return log time, ns, and last sample time, s, of each block of a trace."""
    ends = list[tuple[int, float]]()
    for file in files:
        with open_whole(file) as reader:
            for _, _, message in reader.messages([topic]):
                data = getattr(unpack(FLOAT64_ARRAY, message.data), 'data', np.empty(0))
                if data.ndim == 2 and len(data) and abs(data[-1, 0]) < TRACE_END_MAX_S:
                    ends.append((message.log_time, float(data[-1, 0])))
    ends_s = np.maximum.accumulate([each for _, each in ends] or [0.0])[: len(ends)]
    return np.array([each for each, _ in ends], np.int64), ends_s
