# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Find the pieces of a wave in samples from the left, each as long as it explains them."""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from stickslip_ros.arrays import Array
from stickslip_ros.errors import OutOfRange
from stickslip_ros.lab.waveform.monitor import GAUSSIAN, Monitor
from stickslip_ros.lab.waveform.wave_piece import WavePiece

OUT = 4.5
"""Standard deviations within which a piece explains a sample: 7 of a million lie beyond."""
LINE_MIN, SAW_MIN = 3, 8
"""Samples of the shortest line, and of the shortest piece with a trusted scatter."""
LINE_SURE = 5
"""Samples of a line that counts beside a jump: fewer fit by chance."""
_CLEAR = 24.0
"""Least height of a saw-tooth, in standard deviations of its samples. Eight random samples come
that near by chance once in 2e5 times: each with probability 2/12, five of them."""
LOUD, UNLIKE = 2.0, 0.01
"""Most scatter about a piece, in that of the noise and as a share of a fall."""
NOISE_AGREES = 1.6
"""Factor by which a scatter may exceed the noise."""
STRAYS = 0.1
"""Share of samples, such as those within falls, that may lie off two cycles of a saw-tooth."""
STRAYS_IN_A_ROW = 2
"""Most strays in a row; more are a part of their own."""
SAW_CYCLES_MIN = 1.6
"""Cycles of the shortest saw-tooth: any two lines may make fewer."""
FALL_TAIL = 3.0
"""Time of a fall with its ringing, in falls at the slew rate."""
SMOOTH_SHARE = 0.01
"""Largest distance of a smooth sample from the straight line between its neighbours, as a share of
the range: the voltage between them is as near to the line."""
WEAK, WEAK_MOST = 128, 32
"""WEAK_MOST lines in a row, each shorter than WEAK samples, are a curve if they are smooth."""
ENDS, ENDS_FROM = (0.02, 0.98), 50
"""Quantiles beyond which samples may be strays, and the number of samples for this."""
_GAIN = 25.0
"""Variances of the noise by which two pieces must lower the sum of squares against one."""
PIECES_MOST = 10_000  # a minute of a processor
REFITS = 4


class Finder:
    """Finds pieces in the samples of a monitor whose amplifier falls at a slew rate."""

    def __init__(self, monitor: Monitor, slew_v_per_s: float) -> None:
        self.times_s, self.volts_v = monitor.times_s, monitor.volts_v
        self.period_s, self.jitter_s = monitor.period_s, monitor.jitter_s
        self.noise_v, self.shows_falls = monitor.noise_v, monitor.shows_falls
        self.slew_v_per_s, self.rails_v = slew_v_per_s, monitor.rails_v

    @property
    def smooth_v(self) -> float:
        """Largest distance of a sample from its neighbours; infinite if the samples show falls."""
        share_v = SMOOTH_SHARE * float(np.ptp(self.volts_v))
        return math.inf if self.shows_falls else max(share_v, OUT * self.noise_v)

    def pieces(self) -> list[WavePiece]:
        """
        Return the pieces in order, perhaps with other samples between them.

        If saw-teeth scatter more than the noise, by a hum, the search is repeated with more noise.

        """
        found = [] if self.shows_falls else self._pieces()
        teeth = [each for each in found if each.height_v]
        if teeth:
            counts = [each.last - each.first for each in teeth]
            scatter_v = float(np.median(np.repeat([each.scatter_v for each in teeth], counts)))
            if scatter_v > NOISE_AGREES * self.noise_v:
                self.noise_v *= LOUD
                return self._pieces()
        return found

    def _pieces(self) -> list[WavePiece]:
        found, first, lost, weak = list[WavePiece](), 0, 0, 0
        rough = np.flatnonzero(off_neighbours_v(self.times_s, self.volts_v) > self.smooth_v)
        while first <= len(self.times_s) - LINE_MIN:
            line = self._line(first)
            best = line and (self._sawtooth(line) or line)
            if best is None:  # the longer nothing is found, the further the next look
                lost += 1 + lost // 4
                first += 1 + lost // 4
                continue
            found.append(best)
            lost = 0 if best.last - best.first >= LINE_SURE else lost
            first = best.last + lost // 4
            if len(found) > PIECES_MOST:
                limit = f'after {PIECES_MOST} lines and saw-teeth, the most that are searched'
                hint = 'give the commands, or choose a shorter window'
                raise OutOfRange('time', float(self.times_s[first - 1]), 's', limit, hint)
            weak = weak + 1 if best.last - best.first < WEAK and not best.height_v else 0
            if weak > WEAK_MOST:
                next_rough = int(np.searchsorted(rough, first))
                first = int(rough[next_rough]) if next_rough < len(rough) else len(self.times_s)
        return self._polished(found)

    def noise_of(self, piece: WavePiece) -> float:
        """Return the noise about a piece, V: that of the monitor and of its time stamps."""
        return math.hypot(self.noise_v, self.jitter_s * piece.slope_v_per_s)

    def tolerance_v(self, piece: WavePiece) -> float:
        """Return the largest distance of a sample from its piece, V."""
        return OUT * max(self.noise_of(piece), min(piece.scatter_v, self.most_v(piece)))

    def most_v(self, piece: WavePiece) -> float:
        """Return the largest scatter of samples about their piece, V."""
        return max(LOUD * self.noise_of(piece), UNLIKE * piece.height_v)

    def reach_v(self, piece: WavePiece) -> float:
        """
        Return the tolerance for the samples beside a piece, V.

        A straight line through n samples is known to sigma sqrt(28/n) n samples behind them.

        """
        return self.tolerance_v(piece) * math.sqrt(1.0 + 28.0 / (piece.last - piece.first))

    def misfits(
        self, piece: WavePiece, first: int, last: int, limit_v: float
    ) -> NDArray[np.bool_]:
        """Return a mask of the samples that a piece does not explain within a limit."""
        volts_v = self.volts_v[first:last]
        off = np.abs(piece.rest_v(self.times_s[first:last], volts_v)) > limit_v
        if piece.height_v:  # all samples lie between a base and a top
            own_v = self.volts_v[piece.samples]
            least_v, most_v = np.quantile(own_v, ENDS if len(own_v) > ENDS_FROM else (0.0, 1.0))
            reach_v = piece.height_v + limit_v
            off |= (volts_v > least_v + reach_v) | (volts_v < most_v - reach_v)
        return np.asarray(off)

    def fitted(self, piece: WavePiece) -> WavePiece | None:
        """Return the least-squares fit of a piece to its samples, without strays."""
        times_s, volts_v = self.times_s[piece.samples], self.volts_v[piece.samples]
        for _ in range(REFITS):
            rest_v = np.abs(piece.rest_v(times_s, volts_v))
            kept = rest_v <= OUT * max(self.noise_of(piece), GAUSSIAN * float(np.median(rest_v)))
            found = piece.least_squares(times_s[kept], volts_v[kept])
            if found is None:
                return None
            before, piece = piece, found
            same = piece.falls(times_s, volts_v) == before.falls(times_s, volts_v)
            if same.all():
                break
        return piece

    def _line(self, first: int) -> WavePiece | None:
        """Return the line from a sample on; None if it explains too few."""
        times_s, volts_v = (x[first : first + LINE_MIN] for x in (self.times_s, self.volts_v))
        start = WavePiece(first, first + LINE_MIN, self.slew_v_per_s, times_s[0], volts_v[0])
        line = start.least_squares(times_s, volts_v)
        if line is None or np.abs(line.rest_v(times_s, volts_v)).max() > OUT * self.noise_of(line):
            return None
        return self._extended(replace(line, scatter_v=0.0))

    def _sawtooth(self, line: WavePiece) -> WavePiece | None:
        """Return the saw-tooth of a line and the next line, after a fall; None without one."""
        starts = range(line.last, min(line.last + 1 + STRAYS_IN_A_ROW, len(self.times_s)))
        other = next(filter(None, map(self._line, starts)), None)
        if other is None:
            return None
        longer = max(line, other, key=lambda each: each.last - each.first)
        at_s = self.times_s[other.first]
        fall_v = float(line.line_v(at_s) - other.line_v(at_s))
        if fall_v * longer.slope_v_per_s <= 0.0:
            return None
        found = self.fitted(
            replace(longer, first=line.first, last=other.last, height_v=abs(fall_v))
        )
        if not found or found.height_v < _CLEAR * max(found.scatter_v, 0.5 * self.noise_v):
            return None
        off = self.misfits(found, found.first, found.last, self.tolerance_v(found))
        count = found.last - found.first
        is_fit = found.scatter_v <= self.most_v(found) and off.sum() <= STRAYS * count
        if not is_fit or self._holds(off, found) < count:
            return None
        found = self._extended(found)
        lasts_s = float(self.times_s[found.last - 1] - self.times_s[found.first])
        return found if lasts_s * abs(found.frequency_hz) >= SAW_CYCLES_MIN else None

    def _extended(self, piece: WavePiece) -> WavePiece:
        """Return a piece fitted to all samples it explains, twice as many at a time."""
        while piece.last < len(self.times_s):
            count = piece.last - piece.first
            last = min(len(self.times_s), piece.last + count)
            end = piece.last + self._holds(
                self.misfits(piece, piece.last, last, self.reach_v(piece)), piece
            )
            longer = self.fitted(replace(piece, last=end)) if end > piece.last else None
            if longer is None:
                return piece
            limit_v = OUT * max(self.noise_of(piece), piece.scatter_v if count >= SAW_MIN else 0.0)
            kept = self._holds(self.misfits(longer, piece.first, end, limit_v), longer)
            if piece.first + kept < end:
                return (
                    self.fitted(replace(piece, last=max(piece.first + kept, piece.last))) or piece
                )
            piece = longer
            if end < last:
                return piece
        return piece

    def _holds(self, off: NDArray[np.bool_], piece: WavePiece) -> int:
        """Return the number of samples a piece explains; single samples may lie off, in falls."""
        if piece.height_v:
            fall_s = FALL_TAIL * piece.height_v / self.slew_v_per_s
            run = 2 + int(fall_s / self.period_s)
            sums = np.cumsum(np.concatenate(([0], off, np.ones(run))))
            off = off & (sums[run : run + len(off)] - sums[: len(off)] >= run - (run > 2))
        return int(np.argmax(off)) if off.any() else len(off)

    def _polished(self, pieces: list[WavePiece]) -> list[WavePiece]:
        """Return the fewest pieces that explain the samples, with the best boundaries."""
        settled = set[tuple[WavePiece, ...]]()
        for _ in range(REFITS):
            index = 0
            while index < len(pieces) - 1:
                a, b = around = tuple(pieces[index : index + 2])
                if b.first - a.last > STRAYS_IN_A_ROW or around in settled:
                    index += 1
                elif one := self._merged(a, b):
                    pieces[index : index + 2] = [one]
                else:
                    pieces[index : index + 2] = self._met(a, b)
                    settled |= {around} if pieces[index] is a else set()
                    index += 1
        return pieces

    def _merged(self, a: WavePiece, b: WavePiece) -> WavePiece | None:
        """Return a piece that explains the samples of two equally well, or None."""
        long, short = (a, b) if a.last - a.first > b.last - b.first else (b, a)
        rest_v = long.rest_v(self.times_s[short.samples], self.volts_v[short.samples])
        is_off = float(np.median(np.abs(rest_v))) >= 2.0 * self.tolerance_v(long)
        if (short.height_v and not long.height_v) or is_off:
            return None
        one = self.fitted(replace(long, first=a.first, last=b.last))
        if one is None:
            return None
        scatter_v = min(a.scatter_v, b.scatter_v)
        same = [replace(each, scatter_v=scatter_v) for each in (a, b, one)]
        costs = [float(self._cost(each, each.first, each.last)[-1]) for each in same]
        return one if costs[2] < costs[0] + costs[1] + _GAIN else None

    def _met(self, a: WavePiece, b: WavePiece) -> tuple[WavePiece, WavePiece]:
        """Return two pieces divided at the sample that lets them explain all samples best."""
        costs = [self._cost(each, a.first, b.last) for each in (a, b)]
        total = costs[0] + costs[1][-1] - costs[1]  # all up to a sample on a, those behind it on b
        low, high = LINE_MIN - 1, len(total) - LINE_MIN
        split = a.first + low + int(np.argmin(total[low:high])) + 1 if low < high else a.last
        if (a.last, b.first) == (split, split):
            return a, b
        new_a, new_b = self.fitted(replace(a, last=split)), self.fitted(replace(b, first=split))
        return (new_a, new_b) if new_a and new_b else (a, b)

    def _cost(self, piece: WavePiece, first: int, last: int) -> Array:
        """Return the running sum of squared deviations of samples, in variances of the noise."""
        limit_v = self.tolerance_v(piece)
        off = self.misfits(piece, first, last, limit_v)
        rest_v = piece.rest_v(self.times_s[first:last], self.volts_v[first:last])
        return np.cumsum((OUT * np.where(off, 1.0, rest_v / limit_v)) ** 2)


def off_course_v(times_s: Array, volts_v: Array, rows: Array, near_s: float) -> Array:
    """Return distances of samples from a course, corners of shape (n, 2), within a time, V."""
    corners_s = np.concatenate(([-math.inf], rows[:, 0], [math.inf]))
    behind = np.searchsorted(rows[:, 0], times_s) + 1
    low_s, high_s = times_s - near_s, times_s + near_s
    last_s, next_s = corners_s[behind - 1], corners_s[behind]
    at_s = low_s, np.maximum(last_s, low_s), times_s, np.minimum(next_s, high_s), high_s
    within_v = [np.interp(each, *rows.T) for each in at_s]
    return np.asarray(
        np.maximum(np.min(within_v, 0) - volts_v, volts_v - np.max(within_v, 0)).clip(0.0)
    )


def off_neighbours_v(times_s: Array, volts_v: Array) -> Array:
    """Return the distance of each sample from the straight line between its neighbours, V."""
    off_v = np.zeros(len(volts_v))
    share = (times_s[1:-1] - times_s[:-2]) / (times_s[2:] - times_s[:-2])
    off_v[1:-1] = np.abs(volts_v[1:-1] - volts_v[:-2] - share * (volts_v[2:] - volts_v[:-2]))
    return off_v
