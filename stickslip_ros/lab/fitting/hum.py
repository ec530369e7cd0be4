# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Hum of the mains, or a vibration of the table, in what a fit leaves over."""

from collections.abc import Sequence

import numpy as np
from scipy import signal

from stickslip_ros.arrays import Array

_HIGHEST_HZ = 1000.0  # above which a runner rings
_MOST = 0.4
"""Share of what is left that a hum has: what a model misses is in many lines, those of a wave."""
_WIDTH = 2
"""Bins on either side of a line that belong to it, behind Hann's window."""
_SAMPLES_MAX = 1 << 20


def hum_in(time_s: Array, left: Array, waves_hz: Sequence[float]) -> tuple[float, float] | None:
    """
    Return frequency, Hz, and amplitude of a hum in a residual; None without one.

    A line at a multiple of the frequencies of the waves that drove it is no hum.

    """
    apart_s = max(float(np.median(np.diff(time_s))), float(np.ptp(time_s)) / _SAMPLES_MAX)
    even = np.interp(np.arange(time_s[0], time_s[-1], apart_s), time_s, left)
    even -= even.mean()
    power = np.abs(np.fft.rfft(even * signal.windows.hann(len(even), sym=False))) ** 2
    bin_hz = 1.0 / (apart_s * len(even))
    last = min(int(_HIGHEST_HZ / bin_hz), len(power) - _WIDTH - 1)
    if last <= _WIDTH or not power.any():
        return None
    line = _WIDTH + int(np.argmax(power[_WIDTH : last + 1]))
    around = slice(line - _WIDTH, line + _WIDTH + 1)
    share = float(power[around].sum() / power.sum())
    hz = bin_hz * float(np.average(np.arange(len(power))[around], weights=power[around]))
    is_of_wave = any(
        abs(hz - each * max(round(hz / each), 1)) < _WIDTH * bin_hz for each in waves_hz
    )
    if share < _MOST or is_of_wave:
        return None
    return hz, float(np.sqrt(2.0 * share) * even.std())
