# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
A piece of a wave: a straight line, or a saw-tooth that falls at the slew rate.

Within a saw-tooth, at any sampling rate, v = c + s t - H m with the number m of falls before the
sample. A line is a saw-tooth without falls, H = 0. The fit is linear for known m, and m is the
whole number next to (c + s t - v)/H.

"""

import math
from dataclasses import dataclass, replace

import numpy as np

from stickslip_ros.arrays import Array

BENT = 1e-6  # least relative singular value of a fit that determines the height of falls


@dataclass(frozen=True)
class WavePiece:
    """Samples ``[first, last)`` on ``level + slope (t - origin) - height m``."""

    first: int
    last: int
    slew_v_per_s: float  # of its falls
    origin_s: float
    level_v: float
    slope_v_per_s: float = 0.0
    height_v: float = 0.0  # of an instantaneous fall; 0: a line
    scatter_v: float = 0.0  # standard deviation of the samples about the piece
    base_v: float = 0.0  # lower end of a saw-tooth

    @property
    def samples(self) -> slice:
        """Slice of its samples."""
        return slice(self.first, self.last)

    @property
    def frequency_hz(self) -> float:
        """Cycles per second, positive if ramps rise; 0 for a line."""
        return self.slope_v_per_s / self.height_v if self.height_v else 0.0

    @property
    def amplitude_v(self) -> float:
        """Height of a fall: it lasts A/S while the ramp continues, so A = H/(1 + |s|/S)."""
        return self.height_v / (1.0 + abs(self.slope_v_per_s) / self.slew_v_per_s)

    @property
    def ramp_s(self) -> float:
        """Time at which one of its ramps begins."""
        begin_v = self.base_v + (self.amplitude_v if self.slope_v_per_s < 0.0 else 0.0)
        return self.origin_s + (begin_v - self.level_v) / self.slope_v_per_s

    def line_v(self, times_s: Array) -> Array:
        """Return the voltage without falls."""
        return self.level_v + self.slope_v_per_s * (times_s - self.origin_s)

    def falls(self, times_s: Array, volts_v: Array) -> Array:
        """Return the number of falls before each sample."""
        if not self.height_v:
            return np.zeros(len(times_s))
        return np.asarray(np.rint((self.line_v(times_s) - volts_v) / self.height_v))

    def rest_v(self, times_s: Array, volts_v: Array) -> Array:
        """Return the distance of each sample above the piece."""
        return volts_v - self.line_v(times_s) + self.height_v * self.falls(times_s, volts_v)

    def corners(self, start_s: float, end_s: float) -> Array:
        """Return times and voltages of both ends and of all corners between, shape (n, 2)."""
        ends_s = np.array((start_s, end_s))
        if not self.height_v:
            return np.column_stack((ends_s, self.line_v(ends_s)))
        period_s, ramp_s = 1.0 / abs(self.frequency_hz), self.ramp_s
        low, high = (ends_s - ramp_s) / period_s
        ramps_s = ramp_s + period_s * np.arange(math.floor(low), math.ceil(high) + 2.0)
        ends_v = self.base_v, self.base_v + self.amplitude_v
        begin_v, fall_v = ends_v if self.slope_v_per_s > 0.0 else ends_v[::-1]
        times_s = np.column_stack(
            (ramps_s - self.amplitude_v / self.slew_v_per_s, ramps_s)
        ).ravel()
        volts_v = np.tile((fall_v, begin_v), len(ramps_s))
        inside = times_s[(times_s > start_s) & (times_s < end_s)]
        all_s = np.concatenate((ends_s[:1], inside, ends_s[1:]))
        return np.column_stack((all_s, np.interp(all_s, times_s, volts_v)))

    def least_squares(self, times_s: Array, volts_v: Array) -> 'WavePiece | None':
        """Return the piece with level, slope and height by least squares, or None."""
        origin_s, lasts_s = float(times_s.mean()), float(np.ptp(times_s)) or 1.0
        columns = [np.ones(len(times_s)), (times_s - origin_s) / lasts_s]
        if self.height_v:
            columns.append(-self.falls(times_s, volts_v))
        basis = np.column_stack(columns)
        values, _, rank, _ = np.linalg.lstsq(basis, volts_v, rcond=BENT)
        level_v, rise_v, height_v = np.append(values, 0.0)[:3].tolist()
        if rank < len(columns) or (self.height_v and height_v <= 0.0):
            return None
        rest_v = volts_v - basis @ values
        free = max(len(volts_v) - len(columns), 1)
        scatter_v = math.sqrt(float(rest_v @ rest_v) / free)
        return replace(
            self,
            origin_s=origin_s,
            level_v=level_v,
            slope_v_per_s=rise_v / lasts_s,
            height_v=height_v,
            scatter_v=scatter_v,
        )
