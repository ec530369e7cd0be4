# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Join pieces to the course of a voltage: where they meet, and its corners."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.lab.waveform.finder import (
    FALL_TAIL,
    LINE_SURE,
    OUT,
    STRAYS_IN_A_ROW,
    Finder,
    off_course_v,
    off_neighbours_v,
)
from stickslip_ros.lab.waveform.wave_piece import WavePiece

NEAR_MOST = 64
"""Most samples on either side of a boundary that both pieces may explain."""
JUMP_COST = 25.0
"""Cost of a jump, in squares of standard deviations: a wave jumps only within its falls."""
ALIKE_COST = 9.0
"""Cost above the best meeting point of others that are as good: 3 deviations."""
JUMP_UNSURE = 0.02
"""Most change of the voltage between two samples beside a jump, as a share of it. The moment of
the jump between its samples is unknown, so the height is unsure by as much."""
SWING_UNSURE = 3e-3
"""The same as a share of the whole swing: one sample within a fall leaves a jump of a volt."""
MISSING_MOST = 3.5  # most periods between samples that are played as they are


@dataclass(frozen=True)
class Meeting:
    """The point between a piece and the next."""

    time_s: float
    unsure_s: float  # error of the time, where the voltage jumps
    jump_v: float  # height of the jump; 0 if both pieces meet
    others_s: tuple[float, ...]  # equally good times


@dataclass(frozen=True, eq=False)
class CoursePart:
    """A part of the course: a piece between two meetings, or samples as they are."""

    first: int  # samples [first, last)
    last: int
    piece: WavePiece | None
    rows: Array  # its corners, shape (n, 2), s and V
    before: Meeting | None = None
    after: Meeting | None = None
    rough_v: float = 0.0  # of samples as they are: largest distance from the neighbours


def settled(pieces: Sequence[WavePiece], finder: Finder) -> list[WavePiece]:
    """
    Return pieces with level holds and bases of saw-teeth.

    A slope of less than four standard errors counts as 0. Without a sample at the ends of a cycle,
    the base of a saw-tooth is free within bounds. A hold within these bounds is the base or the
    top; otherwise the base is in the middle, within the rails.

    """
    found, holds_v = list[WavePiece](), list[float]()
    for piece in pieces:
        lasts_s = float(finder.times_s[piece.last - 1] - finder.times_s[piece.first])
        error_v = finder.tolerance_v(piece) / OUT * (12.0 / (piece.last - piece.first)) ** 0.5
        if not piece.height_v and abs(piece.slope_v_per_s) * lasts_s < 4.0 * error_v:
            piece = replace(piece, slope_v_per_s=0.0)  # noqa: PLW2901
            holds_v.append(piece.level_v)
        found.append(piece)
    for index, piece in enumerate(found):
        if piece.height_v:
            volts_v = finder.volts_v[piece.samples]
            rest_v = piece.rest_v(finder.times_s[piece.samples], volts_v)
            seen_v = (volts_v - rest_v)[np.abs(rest_v) <= finder.tolerance_v(piece)]
            low_v, high_v = float(seen_v.max()) - piece.amplitude_v, float(seen_v.min())
            base_v = 0.5 * (low_v + high_v)
            if low_v < high_v:  # the samples leave it free, the amplifier does not
                least_v, most_v = finder.rails_v
                base_v = min(max(base_v, least_v), most_v - piece.amplitude_v)
                base_v = min(max(base_v, low_v), high_v)
            give_v = finder.tolerance_v(piece) + 0.5 * max(high_v - low_v, 0.0)
            levels_v = [*holds_v, *(each - piece.amplitude_v for each in holds_v)]
            nearest_v = min(levels_v, key=lambda each: abs(each - base_v), default=base_v)
            if abs(nearest_v - base_v) <= give_v:
                base_v = nearest_v
            found[index] = replace(piece, base_v=base_v)
    return found


def meeting(a: WavePiece, b: WavePiece, finder: Finder) -> Meeting:
    """
    Return the meeting of two pieces, between the last sample of A alone and the first of B alone.

    Candidates are corners of both pieces and their crossings. Each costs the squares of the
    deviations of the samples, and more where the voltage jumps.

    """
    times_s, limits_v = finder.times_s, [finder.reach_v(each) for each in (a, b)]
    low, high = max(a.first, a.last - NEAR_MOST), min(b.last, b.first + NEAR_MOST)
    not_b = np.flatnonzero(finder.misfits(b, low, a.last, limits_v[1]))
    not_a = np.flatnonzero(finder.misfits(a, b.first, high, limits_v[0]))
    # one sample more on either side: one within a fall may be explained by neither
    low = max(low + int(np.max(not_b, initial=0)) - 1, a.first)
    high = min(b.first + int(np.min(not_a, initial=high - b.first)) + 1, b.last - 1)
    corners = [each.corners(times_s[low], times_s[high]) for each in (a, b)]
    at_s = np.unique(np.concatenate([rows[:, 0] for rows in corners]))
    gap_v = np.interp(at_s, *corners[0].T) - np.interp(at_s, *corners[1].T)
    crossed = np.flatnonzero(gap_v[1:] * gap_v[:-1] < 0.0)
    share = gap_v[crossed] / (gap_v[crossed] - gap_v[crossed + 1])
    crossings_s = at_s[crossed] + share * (at_s[crossed + 1] - at_s[crossed])
    middle_s = 0.5 * float(times_s[a.last - 1] + times_s[b.first])
    at_s = np.unique(np.concatenate((at_s, crossings_s, [middle_s])))
    jumps_v = np.abs(np.interp(at_s, *corners[0].T) - np.interp(at_s, *corners[1].T))
    near_s, near_v = times_s[low : high + 1], finder.volts_v[low : high + 1]
    rests = list[Array]()
    for piece, rows, limit_v in zip((a, b), corners, limits_v, strict=True):
        off_v = np.abs(near_v - np.interp(near_s, *rows.T))
        fall_s = FALL_TAIL * piece.height_v / finder.slew_v_per_s
        off_v = np.where(off_v > limit_v, off_course_v(near_s, near_v, rows, fall_s), off_v)
        rests.append(np.minimum(OUT * off_v / limit_v, 2.0 * OUT) ** 2)
    costs = np.where(near_s < at_s[:, None], rests[0], rests[1]).sum(1)
    costs += JUMP_COST * np.minimum(jumps_v / max(limits_v), 1.0) ** 2
    best = int(np.argmin(costs + 1e-9 * np.abs(at_s - middle_s) / finder.period_s))
    jump_v = float(jumps_v[best]) if jumps_v[best] > max(limits_v) else 0.0
    time_s = middle_s if jump_v else float(at_s[best])
    unsure_s = 0.5 * float(times_s[b.first] - times_s[a.last - 1])
    return Meeting(
        time_s, unsure_s, jump_v, tuple(at_s[costs <= costs[best] + ALIKE_COST].tolist())
    )


def parts_of(pieces: Sequence[WavePiece], finder: Finder) -> list[CoursePart]:
    """
    Return the parts of a course, one after another, from the first sample to the last.

    A line of few samples that ends in a jump is dropped: any few samples make a line.

    """
    known = dict[tuple[WavePiece, WavePiece], Meeting]()
    while True:
        pieces = settled(pieces, finder)
        for pair in pairwise(pieces):
            if pair not in known and pair[1].first - pair[0].last <= STRAYS_IN_A_ROW:
                known[pair] = meeting(*pair, finder)
        joints = [None, *(known.get(pair) for pair in pairwise(pieces)), None]
        around = list(pairwise(joints))
        sure = [
            piece
            for piece, ends in zip(pieces, around, strict=False)
            if piece.last - piece.first >= LINE_SURE or not any(x and x.jump_v for x in ends)
        ]
        if len(sure) == len(pieces):
            break
        pieces = sure
    times_s, parts, last = finder.times_s, list[CoursePart](), 0
    for piece, (before, after) in zip(pieces, around, strict=False):
        if piece.first - last > (STRAYS_IN_A_ROW if last else 0):
            parts.append(_as_sampled(last, piece.first, finder))
        start_s = before.time_s if before else times_s[piece.first]
        end_s = after.time_s if after else times_s[piece.last - 1]
        rows = piece.corners(start_s, max(start_s, end_s))
        parts.append(CoursePart(piece.first, piece.last, piece, rows, before, after))
        last = piece.last
    if last < len(times_s):
        parts.append(_as_sampled(last, len(times_s), finder))
    return parts


def _as_sampled(first: int, last: int, finder: Finder) -> CoursePart:
    """
    Return samples as they are, with a neighbour on either side.

    A jump between two samples, with little change before and after, is a fall at the slew rate
    halfway between both.

    """
    stretch = slice(max(first - 1, 0), last + 1)
    times_s, volts_v = finder.times_s[stretch], finder.volts_v[stretch]
    rises_v = np.diff(volts_v)
    beside_v = np.abs(np.pad(rises_v, 1))
    most_v = np.maximum(beside_v[:-2], beside_v[2:])
    is_jump = np.abs(rises_v) > np.maximum(finder.smooth_v, most_v / JUMP_UNSURE)
    jumps = np.flatnonzero(is_jump)
    smooth_v = volts_v - np.concatenate(([0.0], np.cumsum(np.where(is_jump, rises_v, 0.0))))
    rough_v = float(off_neighbours_v(times_s, smooth_v).max()) if len(times_s) > 2 else 0.0
    if np.diff(times_s).max() > MISSING_MOST * finder.period_s:
        rough_v = float(np.ptp(volts_v))
    half_s = 0.5 * np.abs(rises_v[jumps]) / finder.slew_v_per_s
    middles_s = 0.5 * (times_s[jumps] + times_s[jumps + 1])
    rows = np.column_stack((times_s, volts_v))
    for side, off_s in ((0, -half_s), (1, half_s)):
        rows = np.concatenate((rows, np.column_stack((middles_s + off_s, volts_v[jumps + side]))))
    rows = rows[np.argsort(rows[:, 0], kind='stable')]
    return CoursePart(first, last, None, rows, rough_v=rough_v)


def joined(parts: Sequence[CoursePart], slew_v_per_s: float) -> Array:
    """Return the corners of a course, shape (n, 2), s and V, with falls between its parts."""
    found = [parts[0].rows]
    for part in parts[1:]:
        (time_s, from_v), rows = found[-1][-1], part.rows
        if part.before and part.before.jump_v:
            time_s += abs(rows[0, 1] - from_v) / slew_v_per_s
            found.append(np.array([(time_s, np.interp(time_s, *rows.T))]))
        later = rows[rows[:, 0] > time_s]
        if len(later):
            found.append(later)
    return np.concatenate(found)
