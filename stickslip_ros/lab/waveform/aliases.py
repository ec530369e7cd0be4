# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Frequencies that a slow monitor cannot tell apart, and what else decides between them.

Samples at even times t = n/f_s see of a saw-tooth the phase f t modulo 1: f + m f_s with a whole
number m gives the same ones. Samples at uneven times do not, if their stamps are exact.

"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from stickslip_ros.arrays import Array
from stickslip_ros.lab.waveform.finder import OUT, Finder
from stickslip_ros.lab.waveform.wave_piece import WavePiece

FREQUENCY_MAX_HZ = 5000.0
"""Taken where nobody says how fast the drive can be: stick-slip drives step a few thousand times
a second at most."""
SAME_SCATTER = 4.0
"""Standard errors of a scatter within which another is the same."""
LINE_SHARE = 0.03
"""Power of a line in the position, as a share of the strongest, that a frequency must show."""
LINE_POWER = 30.0
"""Power of a line as a multiple of that above it; two of ten thousand lines in noise have it."""
ABOVE = (0.0, 2.5, 3.25, 4.0)
"""Where above it is, in cycles of the stretch: a line, shaped by Hann, is two to either side. What
is below may be the drift of the position."""
HARMONIC = 0.02
"""Ratios of frequencies this near to a whole number are harmonics."""
POSITIONS_MIN = 64


@dataclass(frozen=True, eq=False)
class Evidence:
    """What is known beside the samples of the voltage."""

    frequency_max_hz: float
    direction: int  # 1, -1; 0 if it is not known
    times_s: Array  # of the position, rising; empty if there is none
    position_m: Array

    @classmethod
    def of(
        cls, frequency_max_hz: float, direction: int, position: tuple[ArrayLike, ArrayLike] | None
    ) -> 'Evidence':
        """Return evidence with a position in order, without what is not finite."""
        times_s, place_m = (np.asarray(each, np.float64) for each in position or ((), ()))
        known = np.isfinite(times_s) & np.isfinite(place_m)
        order = np.argsort(times_s[known], kind='stable')
        return cls(frequency_max_hz, direction, times_s[known][order], place_m[known][order])

    def motion(
        self, start_s: float, end_s: float, frequencies_hz: list[float]
    ) -> tuple[Array | None, float]:
        """
        Return the powers of lines in a stretch of the position, and the way that was made, m.

        What does not stand out of its surroundings is no line and has no power. None where the
        position is too slow, or has too few samples, to show the fastest of them.

        """
        low, high = np.searchsorted(self.times_s, (start_s, end_s))
        times_s, place_m = self.times_s[low:high] - start_s, self.position_m[low:high]
        if len(times_s) < POSITIONS_MIN:
            return None, 0.0
        for _ in range(2):  # strays bend the first line
            slope, level_m = np.polyfit(times_s, place_m, 1)
            rough_m = place_m - level_m - slope * times_s
            kept = np.abs(rough_m) <= 4.0 * OUT * float(np.median(np.abs(rough_m)))
            times_s, place_m, rough_m = times_s[kept], place_m[kept], rough_m[kept]
        lasts_s = end_s - start_s
        moved_m = float(slope) * lasts_s
        moved_m = moved_m if abs(moved_m) > float(np.std(rough_m)) else 0.0
        apart_s = float(np.median(np.diff(times_s)))
        if 2.0 * (max(frequencies_hz) + ABOVE[-1] / lasts_s) * apart_s > 1.0:
            return None, moved_m
        shaped_m = np.hanning(len(rough_m)) * rough_m
        near_hz = np.add.outer(np.array(ABOVE) / lasts_s, frequencies_hz)
        powers = np.array([_power(times_s, shaped_m, each) for each in near_hz.ravel()])
        powers = powers.reshape(near_hz.shape)
        is_line = powers[0] > LINE_POWER * powers[1:].max(0)
        return np.where(is_line, powers[0], 0.0), moved_m


def images(
    piece: WavePiece, finder: Finder, on_even: Finder, evidence: Evidence
) -> list[WavePiece]:
    """
    Return the saw-teeth that explain the same samples, the slowest first; none if none may.

    More falls of the same height, a whole number more in each period of the clock, make the ramp
    steeper by so many heights. With uneven stamps the scatter about each tells them apart, unless
    the samples lie as well on the even clock: then the stamps may be late and the samples even.

    """
    times_s, rate_hz = finder.times_s[piece.samples], 1.0 / finder.period_s
    at_sample = replace(piece, origin_s=times_s[0], level_v=float(piece.line_v(times_s[:1])[0]))
    most = math.ceil(evidence.frequency_max_hz / rate_hz) + 1
    found = []
    for more in range(-most, most + 1):
        slope = piece.slope_v_per_s + more * piece.height_v * rate_hz
        other = finder.fitted(replace(at_sample, slope_v_per_s=slope)) if more else piece
        if other and abs(other.frequency_hz) <= evidence.frequency_max_hz * (1.0 + 1e-3):
            found.append(other)
    if not found:
        return []
    even = on_even.fitted(piece)
    even_v = even.scatter_v if even else math.inf
    least_v = min(even_v, *(each.scatter_v for each in found))
    limit_v = least_v * (1.0 + SAME_SCATTER / math.sqrt(2.0 * len(times_s)))
    found = [each for each in found if min(each.scatter_v, even_v) <= limit_v]
    if evidence.direction:
        found = [each for each in found if each.frequency_hz * evidence.direction > 0.0]
    if len(found) > 1:
        found = _moved(found, float(times_s[0]), float(times_s[-1]), evidence)
    return sorted(found, key=lambda each: abs(each.frequency_hz))


def _moved(
    found: list[WavePiece], start_s: float, end_s: float, evidence: Evidence
) -> list[WavePiece]:
    """Return those whose frequency is a line of the position, in the direction of its motion."""
    powers, moved_m = evidence.motion(start_s, end_s, [abs(x.frequency_hz) for x in found])
    if powers is not None and powers.any():
        is_shown = powers > LINE_SHARE * powers.max()
        found = [each for each, shown in zip(found, is_shown, strict=True) if shown]
        least_hz = min(abs(each.frequency_hz) for each in found)
        ratios = [abs(each.frequency_hz) / least_hz for each in found]
        own = [ratio < 1.5 or abs(ratio - round(ratio)) > HARMONIC for ratio in ratios]
        found = [each for each, is_own in zip(found, own, strict=True) if is_own]
    if moved_m:
        found = [each for each in found if each.frequency_hz * moved_m > 0.0] or found
    return found


def hidden_hz(start_s: float, end_s: float, rate_hz: float, evidence: Evidence) -> float | None:
    """
    Return the frequency of a saw-tooth that a straight line of samples hides; 0 if there is none.

    At a multiple of the monitor's rate each sample sees the same phase; the position moves. None
    if no position tells.

    """
    if evidence.frequency_max_hz < rate_hz:
        return 0.0
    lines_hz = [n * rate_hz for n in range(1, int(evidence.frequency_max_hz / rate_hz) + 1)]
    powers, _ = evidence.motion(start_s, end_s, lines_hz)
    return None if powers is None else lines_hz[int(np.argmax(powers))] if powers.any() else 0.0


def _power(times_s: Array, values: Array, frequency_hz: float) -> float:
    return float(abs(np.mean(values * np.exp(-2j * np.pi * frequency_hz * times_s))) ** 2)
