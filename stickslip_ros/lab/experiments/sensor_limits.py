# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Refuse positions of a sensor that is at its limit, or that wraps around."""

import math
from dataclasses import replace

import numpy as np

from stickslip_ros.errors import RecordingError
from stickslip_ros.lab.experiments.experiment import Seen, Voltage
from stickslip_ros.lab.experiments.sensor import lone_outliers, rounding_of
from stickslip_ros.lab.experiments.sensor_clock import falls_of, lateness_of

_FALLS_MIN, _READINGS_MIN = 3, 8
"""Falls of the voltage without a motion of a free runner, and readings for each."""
_DIGITS_MIN = 4.0  # least stroke of the feet that must show, in last digits of the sensor
_OTHERS, _TRAVEL_MIN = 0.125, 1.5
"""Largest of the other changes, and least travel, as shares of a jump."""


def check_limits(
    origin: str, seen: Seen, drive: Voltage, begins_s: float, gain_m_per_v: float
) -> None:
    """
    Refuse the position of a free runner that stays exactly constant, or jumps back by a period.

    Each ramp carries a free runner along, whatever the stand: it cannot rest while the voltage
    falls repeatedly. A sensor that wraps around jumps rarely, by its whole range. Raises
    RecordingError in plain cases only; the checks of a fit find the others.

    """
    kept = ~lone_outliers(seen.values)
    time_s, place_m = seen.time_s[kept], seen.values[kept]
    changes = np.flatnonzero(np.diff(place_m))
    starts, ends = np.append(0, changes + 1), np.append(changes, len(place_m) - 1)
    longest = int(np.argmax(time_s[ends] - time_s[starts]))
    first, last = int(starts[longest]), int(ends[longest])
    moves = slice(first) if first > len(place_m) - last else slice(last, None)
    late = lateness_of(replace(seen, values=place_m[moves], time_s=time_s[moves]), drive)
    late_s = late.late_s if late is not None and late.is_clear else 0.0
    falls_s, heights_v = falls_of(drive)
    digit_m = math.sqrt(12.0) * rounding_of(place_m)
    large_s = late_s + falls_s[np.abs(heights_v) * gain_m_per_v >= _DIGITS_MIN * digit_m]
    over = np.count_nonzero((large_s > time_s[first]) & (large_s < time_s[last]))
    if over >= _FALLS_MIN and last - first >= _READINGS_MIN * over:
        problem = (
            f'has a {seen.quantity} of exactly {place_m[first]:.6g} m over {over} falls of the '
            f'voltage, {begins_s + time_s[first]:.6g} to {begins_s + time_s[last]:.6g} s: its '
            'sensor is at a limit, or has stopped'
        )
        hint = 'choose a window without these: --window LENGTH@START'
        raise RecordingError(origin, problem, hint)
    steps_m = np.diff(place_m)
    period_m = float(np.abs(steps_m).max())
    jumps = np.where(np.abs(steps_m) > 0.5 * period_m, np.sign(steps_m), 0.0)
    others_m = float(np.abs(steps_m[jumps == 0.0]).max(initial=0.0))
    travel_m = float(np.ptp(np.cumsum(steps_m - period_m * jumps)))
    count = np.count_nonzero(jumps)
    if (
        2 <= count <= 0.5 * len(falls_s)
        and others_m < _OTHERS * period_m
        and np.ptp(place_m) < period_m + 2.0 * others_m
        and travel_m > _TRAVEL_MIN * period_m
    ):
        problem = f'has a {seen.quantity} that jumps {count} times by about {period_m:.4g} m'
        hint = 'its sensor wraps around: unwrap it, as numpy.unwrap does with a period'
        raise RecordingError(origin, problem, hint)
