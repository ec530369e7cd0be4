# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Find the pieces of a wave in samples, from left to right, each as long as possible."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from stickslip_ros.arrays import Array
from stickslip_ros.errors import OutOfRange
from stickslip_ros.lab.waveform.monitor import (
    NOISE_FACTOR_MAX,
    OUT,
    REFITS,
    Monitor,
    off_neighbours_v,
)
from stickslip_ros.lab.waveform.wave_piece import WavePiece

LINE_MIN = 3  # samples of the shortest line
STRAYS_IN_A_ROW = 2
"""Most unexplained samples in a row; more are a segment of their own."""
SAW_CYCLES_MIN = 1.5
"""Cycles of the shortest saw-tooth, as any two lines could make fewer."""
FALL_TAIL = 3.0
"""Time of a fall with its ringing, in durations of a fall at the slew rate."""
_WEAK, _WEAK_MOST = 128, 32
"""Samples of a short line, and most short lines in a row; more are a curve if smooth."""
_COST = 25.0  # least decrease of the sum of squares by a boundary, in variances of the noise
PIECES_MOST = 10_000  # most pieces in a search, a minute of a processor


def pieces_of(monitor: Monitor) -> tuple[list[WavePiece], Monitor]:
    """
    Return the pieces in order, possibly with gaps between them, and their monitor.

    If hum makes saw-teeth scatter more than the noise, the search is repeated with more noise.

    """
    if monitor.shows_falls:
        return [], monitor
    found = _pieces(monitor)
    teeth = [each for each in found if each.height_v]
    counts = [each.last - each.first for each in teeth]
    scatters_v = np.repeat([each.scatter_v for each in teeth], counts)
    if teeth and np.median(scatters_v) > NOISE_FACTOR_MAX * monitor.noise_v:
        louder = replace(monitor, noise_v=NOISE_FACTOR_MAX * monitor.noise_v)
        return _pieces(louder), louder
    return found, monitor


def _pieces(monitor: Monitor) -> list[WavePiece]:
    """Return the fewest pieces that explain the samples, with the best boundaries."""
    pieces, settled = list(_from_left(monitor)), set[tuple[WavePiece, ...]]()
    for _ in range(REFITS):
        index = 0
        while index < len(pieces) - 1:
            a, b = around = tuple(pieces[index : index + 2])
            if b.first - a.last > STRAYS_IN_A_ROW or around in settled:
                index += 1
            elif one := _merged(monitor, a, b):
                pieces[index : index + 2] = [one]
            else:
                pieces[index : index + 2] = _met(monitor, a, b)
                settled |= {around} if pieces[index] is a else set()
                index += 1
    return pieces


def _from_left(monitor: Monitor) -> Iterator[WavePiece]:
    """Yield pieces from left to right; skip the smooth parts of a curve."""
    times_s, first, weak = monitor.times_s, 0, 0
    off_v = off_neighbours_v(times_s, monitor.volts_v)
    rough = np.append(np.flatnonzero(off_v > monitor.smooth_v), len(monitor.times_s))
    for _ in range(PIECES_MOST):
        best = None
        while best is None and first <= len(monitor.times_s) - LINE_MIN:
            line = _line(monitor, first)
            best = line and (_sawtooth(monitor, line) or line)
            first = best.last if best else first + 1
        if best is None:
            return
        yield best
        weak = weak + 1 if best.last - best.first < _WEAK and not best.height_v else 0
        if weak > _WEAK_MOST:
            first = int(rough[np.searchsorted(rough, first)])
    limit = f'after {PIECES_MOST} lines and saw-teeth, the most that are searched'
    hint = 'give the commands, or choose a shorter window'
    raise OutOfRange('time', float(times_s[first - 1]), 's', limit, hint)


def _line(monitor: Monitor, first: int) -> WavePiece | None:
    """Return the line that begins at a sample; None if it explains too few samples."""
    samples = slice(first, first + LINE_MIN)
    times_s, volts_v = monitor.times_s[samples], monitor.volts_v[samples]
    start = WavePiece(first, first + LINE_MIN, monitor.slew_v_per_s, times_s[0], volts_v[0])
    line = start.least_squares(times_s, volts_v)
    limit_v = OUT * monitor.noise_of(line) if line else 0.0
    if line is None or np.abs(line.rest_v(times_s, volts_v)).max() > limit_v:
        return None
    return _extended(monitor, replace(line, scatter_v=0.0))


def _sawtooth(monitor: Monitor, line: WavePiece) -> WavePiece | None:
    """Return the saw-tooth of a line and the next line after a fall, or None."""
    starts = range(
        line.last, min(line.last + STRAYS_IN_A_ROW, len(monitor.times_s) - LINE_MIN) + 1
    )
    other = next(filter(None, (_line(monitor, each) for each in starts)), None)
    if other is None:
        return None
    longer = max(line, other, key=lambda each: each.last - each.first)
    at_s = monitor.times_s[other.first]
    fall_v = float(line.line_v(at_s) - other.line_v(at_s))
    if fall_v * longer.slope_v_per_s <= 0.0:
        return None
    both = replace(longer, first=line.first, last=other.last, height_v=abs(fall_v))
    found = monitor.fitted(both)
    if found is None:
        return None
    off = monitor.misfits(found, found.first, found.last, monitor.tolerance_v(found))
    is_clear = found.height_v > OUT * monitor.noise_of(found)
    if not is_clear or _holds(monitor, off, found) < len(off):
        return None
    found = _extended(monitor, found)
    lasts_s = float(monitor.times_s[found.last - 1] - monitor.times_s[found.first])
    return found if lasts_s * abs(found.frequency_hz) >= SAW_CYCLES_MIN else None


def _extended(monitor: Monitor, piece: WavePiece) -> WavePiece:
    """Extend a piece to all samples that it explains, doubling their number in each step."""
    while piece.last < len(monitor.times_s):
        count = piece.last - piece.first
        last = min(len(monitor.times_s), piece.last + count)
        off = monitor.misfits(piece, piece.last, last, monitor.reach_v(piece))
        end = piece.last + _holds(monitor, off, piece)
        longer = monitor.fitted(replace(piece, last=end)) if end > piece.last else None
        if longer is None:
            return piece
        off = monitor.misfits(longer, piece.first, end, monitor.tolerance_v(piece))
        kept = _holds(monitor, off, longer)
        if piece.first + kept < end:
            shorter = replace(piece, last=max(piece.first + kept, piece.last))
            return monitor.fitted(shorter) or piece
        piece = longer
        if end < last:
            return piece
    return piece


def _holds(monitor: Monitor, off: NDArray[np.bool_], piece: WavePiece) -> int:
    """Return how many first samples a piece explains; short runs of misfits may be falls."""
    if piece.height_v:
        fall_s = FALL_TAIL * piece.height_v / piece.slew_v_per_s
        run = 2 + int(fall_s / monitor.period_s)
        sums = np.cumsum(np.concatenate(([0], off, np.ones(run))))
        off = off & (sums[run : run + len(off)] - sums[: len(off)] >= run)
    return int(np.argmax(off)) if off.any() else len(off)


def _merged(monitor: Monitor, a: WavePiece, b: WavePiece) -> WavePiece | None:
    """Return a piece that explains the samples of two equally well, or None."""
    long, short = (a, b) if a.last - a.first > b.last - b.first else (b, a)
    if short.height_v and not long.height_v:
        return None
    one = monitor.fitted(replace(long, first=a.first, last=b.last))
    if one is None:
        return None
    scatter_v = min(a.scatter_v, b.scatter_v)
    same = [replace(each, scatter_v=scatter_v) for each in (a, b, one)]
    costs = [float(_cost(monitor, each, each.first, each.last)[-1]) for each in same]
    return one if costs[2] < costs[0] + costs[1] + _COST else None


def _met(monitor: Monitor, a: WavePiece, b: WavePiece) -> tuple[WavePiece, WavePiece]:
    """Return two pieces with the boundary that minimises their sum of squares."""
    costs = [_cost(monitor, each, a.first, b.last) for each in (a, b)]
    total = costs[0] + costs[1][-1] - costs[1]  # samples up to each one on a, the rest on b
    low, high = LINE_MIN - 1, len(total) - LINE_MIN
    split = a.first + low + int(np.argmin(total[low:high])) + 1 if low < high else a.last
    if (a.last, b.first) == (split, split):
        return a, b
    new_a = monitor.fitted(replace(a, last=split))
    new_b = monitor.fitted(replace(b, first=split))
    return (new_a, new_b) if new_a and new_b else (a, b)


def _cost(monitor: Monitor, piece: WavePiece, first: int, last: int) -> Array:
    """Return the running sum of squared deviations of samples, in variances of the noise."""
    limit_v = monitor.tolerance_v(piece)
    off = monitor.misfits(piece, first, last, limit_v)
    rest_v = piece.rest_v(monitor.times_s[first:last], monitor.volts_v[first:last])
    return np.cumsum((OUT * np.where(off, 1.0, rest_v / limit_v)) ** 2)
