# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""How late the ticks of a loop began, as the diagnostics of the node put it."""

from collections.abc import Sequence

import numpy as np

from benchmarks.outcome import Row
from stickslip_ros.arrays import Array
from stickslip_ros.units import MICRO

Window = dict[str, float]
"""Ticks, mean, 99th percentile and maximum of lateness (us), overruns, of about one second."""


def windows_of(lateness_s: Sequence[float], period_s: float) -> list[Window]:
    """Return windows of about a second each, that hold all ticks."""
    late_s = np.array(lateness_s)
    windows = max(1, round(len(late_s) * period_s))
    return [_window(each, period_s) for each in np.array_split(late_s, windows) if len(each)]


def _window(late_s: Array, period_s: float) -> Window:
    return {
        'ticks': len(late_s),
        'mean_us': float(np.mean(late_s)) / MICRO,
        'p99_us': float(np.quantile(late_s, 0.99)) / MICRO,
        'max_us': float(np.max(late_s)) / MICRO,
        'overruns': int(np.count_nonzero(late_s > period_s)),
    }


def windows_of_diagnostics(parts: Sequence[dict[str, str]]) -> list[Window]:
    """Return the windows of what the node said of its time, once a second."""
    return [
        {
            'ticks': int(part['ticks']),
            'overruns': int(part['overruns']),
            **{name: float(part[f'lateness_{name}']) for name in ('mean_us', 'p99_us', 'max_us')},
        }
        for part in parts
        if int(part['ticks'])
    ]


def summary(windows: Sequence[Window]) -> Row:
    """
    Return the lateness over some windows.

    The percentile is the median of those of the windows, for that is all the node tells.

    """
    ticks = sum(window['ticks'] for window in windows)
    if not ticks:
        nan = float('nan')
        return {'mean_us': nan, 'p99_us': nan, 'max_us': nan, 'ticks': 0, 'overruns': 0}
    return {
        'mean_us': sum(window['mean_us'] * window['ticks'] for window in windows) / ticks,
        'p99_us': float(np.median([window['p99_us'] for window in windows])),
        'max_us': max(window['max_us'] for window in windows),
        'ticks': int(ticks),
        'overruns': int(sum(window['overruns'] for window in windows)),
    }
