# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Recognise the wave in samples of an amplifier's voltage, or refuse it.

A fall of the amplifier takes microseconds. A monitor of some kilohertz shows it as a ramp of
hundreds of microseconds, which a runner follows without a slip: samples must not be played as they
are. A recognised wave has its true corners, and falls at the slew rate.

"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from stickslip_ros.arrays import Array
from stickslip_ros.errors import StickSlipError
from stickslip_ros.lab.waveform.finder import FALL_TAIL, STRAYS_IN_A_ROW, pieces_of
from stickslip_ros.lab.waveform.monitor import EQUAL, Monitor, monitor_of, off_neighbours_v
from stickslip_ros.lab.waveform.wave_piece import WavePiece
from stickslip_ros.parameters import Parameters

HOLD, RAMP, SAWTOOTH, AS_SAMPLED = 'hold', 'ramp', 'saw-tooth', 'samples'
WHOLE_CYCLES = 0.05  # largest distance at which a number of cycles is rounded
CYCLE_SAMPLES_MIN = 10.0  # fewest samples in a cycle of a recognised wave
_UNSURE = 0.02
"""Accepted errors: of a frequency at that limit, and of the height of a jump at an unknown time
between two samples, as shares; and share of its samples that the corners of a segment miss."""
GIVE_COMMANDS = 'give the commands with --commands (Python: commands)'
LOW_SHARE = 0.1  # share of the amplifier's range below which a divider of the monitor is likely
_QUOTED = 3  # refusals in a message


@dataclass(frozen=True, eq=False)
class Segment:
    """A part of a voltage: a piece of a wave, or samples as they are."""

    first: int  # samples [first, last)
    last: int
    piece: WavePiece | None
    rows: Array  # its corners, shape (n, 2), s and V
    jump_v: float = 0.0  # from the piece before; 0 if both meet
    unsure_v: float = 0.0  # error of the jump, as its time between two samples is unknown
    rough_v: float = 0.0  # largest distance of unexplained samples from their neighbours

    @property
    def kind(self) -> str:
        """One of HOLD, RAMP, SAWTOOTH, AS_SAMPLED."""
        if self.piece is None:
            return AS_SAMPLED
        return SAWTOOTH if self.piece.height_v else RAMP if self.piece.slope_v_per_s else HOLD

    @property
    def samples(self) -> int:
        """Number of its samples."""
        return self.last - self.first

    @property
    def start_s(self) -> float:
        """Time of its first corner."""
        return float(self.rows[0, 0])

    @property
    def end_s(self) -> float:
        """Time of its last corner."""
        return float(self.rows[-1, 0])

    @property
    def at(self) -> str:
        """Times of the first and last corner as text."""
        return f'{self.start_s:.6f} to {self.end_s:.6f} s'

    @property
    def cycles(self) -> float:
        """Cycles of a saw-tooth; 0 for others."""
        hertz = self.piece.frequency_hz if self.piece else 0.0
        cycles = (self.end_s - self.start_s) * abs(hertz)
        return float(round(cycles)) if abs(cycles - round(cycles)) < WHOLE_CYCLES else cycles

    def __str__(self) -> str:
        piece, (start_v, end_v) = self.piece, np.round(self.rows[[0, -1], 1], 2) + 0.0  # no -0.00
        if piece is None:
            text = 'played as sampled'
        elif piece.height_v:
            way = 'forwards' if piece.slope_v_per_s > 0.0 else 'backwards'
            text = f'{self.cycles:.7g} cycles of a saw-tooth {way}, {piece.amplitude_v:.2f} V'
            text += f' from {round(piece.base_v, 2) + 0.0:.2f} V, {abs(piece.frequency_hz):.4f} Hz'
        elif piece.slope_v_per_s:
            text = f'ramp from {start_v:.2f} to {end_v:.2f} V'
        else:
            text = f'hold at {start_v:.2f} V'
        scatter_v = piece.scatter_v if piece else 0.0
        about = f'{self.samples} samples, scatter {scatter_v:.2g} V'
        return f'{self.at}: {text}; {about}'


@dataclass(frozen=True, eq=False)
class RecognisedWave:
    """A wave that was recognised, whole or in part."""

    segments: tuple[Segment, ...]
    refusals: tuple[str, ...]  # reasons against playing the wave; empty if it can be played
    notes: tuple[str, ...]  # assumptions, and samples left out or clipped
    rows: Array  # corners, played or not, shape (n, 2): s, V

    def corners(self, hint: str = GIVE_COMMANDS) -> Array:
        """
        Return the corners of the wave, shape (n, 2): s, V.

        Straight lines join them; falls have the slew rate. Raises NotRecognised if the wave was
        refused; ``hint`` ends the message.

        """
        if self.refusals:
            raise NotRecognised(self.refusals, hint)
        return self.rows

    def lines(self) -> list[str]:
        """Return segments, notes and refusals, one a line."""
        return [*map(str, self.segments), *self.notes, *self.refusals]


class NotRecognised(StickSlipError, ValueError):
    """A voltage cannot be played, for the reasons in ``refusals``."""

    def __init__(self, refusals: Sequence[str], hint: str) -> None:
        more = f'; and {len(refusals) - _QUOTED} more' if len(refusals) > _QUOTED else ''
        reasons = '; '.join(refusals[:_QUOTED]) + more
        super().__init__(f'the voltage cannot be played: {reasons}; {hint}')
        self.refusals = tuple(refusals)


def recognise(times_s: ArrayLike, voltage_v: ArrayLike, stand: Parameters) -> RecognisedWave:
    """
    Recognise the wave in samples of a voltage, shapes (n,), in any order.

    Values that are not finite are dropped; an error of the monitor's gain is not detected. Raises
    WrongKind for arrays of different lengths, OutOfRange for too few samples or too many beyond
    the rails.

    """
    low_v, high_v = stand.amplifier.voltage_min, stand.amplifier.voltage_max
    pieces, monitor = pieces_of(monitor_of(times_s, voltage_v, stand))
    segments = _segments(pieces, monitor)
    rows = _joined(segments, monitor.slew_v_per_s)
    refusals = list(_too_slow(segments, monitor))
    if not refusals:
        for each in segments:
            refusals += (f'{each.at}: {reason}' for reason in _refusals(each, rows, monitor))
    inside_v = np.clip(rows[:, 1], low_v, high_v)
    beyond_v = float(np.abs(rows[:, 1] - inside_v).max())
    if beyond_v > EQUAL * (high_v - low_v):
        refusals.append(
            f'the wave reaches {beyond_v:.2f} V beyond the rails {low_v:g} and {high_v:g} V; '
            'give the unit of the monitor, or set amplifier.voltage_min and voltage_max'
        )
    if all(each.kind == HOLD for each in segments):
        refusals.append('it consists of holds only; record the drive while it runs')
    notes = list(_notes(monitor, stand.amplifier.frequency_max))
    if clipped := int(np.sum(inside_v != rows[:, 1])):
        notes.append(f'{clipped} corners clipped to the rails')
    if np.ptp(inside_v) < LOW_SHARE * (high_v - low_v):
        notes.append(
            f'the wave covers {np.ptp(inside_v):.3g} V of the {high_v - low_v:g} V of the '
            'amplifier: if the monitor is divided, give its unit'
        )
    rows = np.column_stack((rows[:, 0], inside_v))
    return RecognisedWave(tuple(segments), tuple(refusals), tuple(notes), rows)


def _segments(pieces: Sequence[WavePiece], monitor: Monitor) -> list[Segment]:
    """Return the successive segments of a voltage, from the first sample to the last."""
    pieces, times_s = _settled(pieces, monitor), monitor.times_s
    met = [
        _meeting(a, b, monitor) if b.first - a.last <= STRAYS_IN_A_ROW else None
        for a, b in pairwise(pieces)
    ]
    segments, last = list[Segment](), 0
    for piece, before, after in zip(pieces, [None, *met], [*met, None], strict=False):
        if piece.first - last > (STRAYS_IN_A_ROW if last else 0):
            segments.append(_as_sampled(last, piece.first, monitor))
        start_s, *jump_v = before or (times_s[piece.first], 0.0, 0.0)
        end_s = after[0] if after else times_s[piece.last - 1]
        rows = piece.corners(start_s, max(start_s, end_s))
        segments.append(Segment(piece.first, piece.last, piece, rows, *jump_v))
        last = piece.last
    if last < len(times_s):
        segments.append(_as_sampled(last, len(times_s), monitor))
    return segments


def _settled(pieces: Sequence[WavePiece], monitor: Monitor) -> list[WavePiece]:
    """
    Return pieces with level holds and bases of saw-teeth.

    A slope within its error is set to 0. Without a sample at the ends of a cycle, the base of a
    saw-tooth is known only within bounds. If a hold lies within these bounds of the base or the
    top, it sets them; otherwise the base is in the middle, within the rails.

    """
    found, holds_v = list[WavePiece](), list[float]()
    for piece in pieces:
        lasts_s = float(np.ptp(monitor.times_s[piece.samples]))
        error_v = monitor.tolerance_v(piece) * (12.0 / (piece.last - piece.first)) ** 0.5
        if not piece.height_v and abs(piece.slope_v_per_s) * lasts_s < error_v:
            piece = replace(piece, slope_v_per_s=0.0)  # noqa: PLW2901
            holds_v.append(piece.level_v)
        found.append(piece)
    return [_with_base(each, holds_v, monitor) if each.height_v else each for each in found]


def _with_base(piece: WavePiece, holds_v: Sequence[float], monitor: Monitor) -> WavePiece:
    """Return a saw-tooth with its base set."""
    volts_v, tolerance_v = monitor.volts_v[piece.samples], monitor.tolerance_v(piece)
    rest_v = piece.rest_v(monitor.times_s[piece.samples], volts_v)
    fitted_v = (volts_v - rest_v)[np.abs(rest_v) <= tolerance_v]
    low_v, high_v = float(fitted_v.max()) - piece.amplitude_v, float(fitted_v.min())
    base_v, free_v = 0.5 * (low_v + high_v), max(high_v - low_v, 0.0)
    if free_v:  # the rails bound a base that the samples leave free
        least_v, most_v = monitor.rails_v
        base_v = min(max(base_v, least_v), most_v - piece.amplitude_v)
        base_v = min(max(base_v, low_v), high_v)
    levels_v = [*holds_v, *(each - piece.amplitude_v for each in holds_v)]
    nearest_v = min(levels_v, key=lambda each: abs(each - base_v), default=base_v)
    is_near = abs(nearest_v - base_v) <= tolerance_v + 0.5 * free_v
    return replace(piece, base_v=nearest_v if is_near else base_v)


def _meeting(a: WavePiece, b: WavePiece, monitor: Monitor) -> tuple[float, float, float]:
    """
    Return the time at which two pieces meet, s, the jump there, and the error of its height, V.

    Candidates are the corners of both pieces and their crossings, between the last sample of A
    alone and the first of B alone. The smallest gap, nearest to the boundary, is taken. A jump
    lies halfway between two samples.

    """
    times_s, limits_v = monitor.times_s, [monitor.reach_v(each) for each in (a, b)]
    not_b = np.flatnonzero(monitor.misfits(b, a.first, a.last, limits_v[1]))
    not_a = np.flatnonzero(monitor.misfits(a, b.first, b.last, limits_v[0]))
    # one sample more on either side, as neither piece may explain a sample within a fall
    low = a.first + max(int(np.max(not_b, initial=0)) - 1, 0)
    high = min(b.first + int(np.min(not_a, initial=b.last - b.first)) + 1, b.last - 1)
    rows_a, rows_b = (each.corners(times_s[low], times_s[high]) for each in (a, b))
    at_s = np.unique(np.concatenate((rows_a[:, 0], rows_b[:, 0])))
    gaps_v = np.interp(at_s, *rows_a.T) - np.interp(at_s, *rows_b.T)
    crossed = np.flatnonzero(gaps_v[1:] * gaps_v[:-1] < 0.0)
    share = gaps_v[crossed] / (gaps_v[crossed] - gaps_v[crossed + 1])
    crossings_s = at_s[crossed] + share * np.diff(at_s)[crossed]
    middle_s = 0.5 * float(times_s[a.last - 1] + times_s[b.first])
    at_s = np.concatenate((at_s, crossings_s, [middle_s]))
    at_s = at_s[np.argsort(np.abs(at_s - middle_s), kind='stable')]
    gaps_v = np.abs(np.interp(at_s, *rows_a.T) - np.interp(at_s, *rows_b.T))
    best = int(np.argmin(np.minimum(gaps_v, max(limits_v))))
    if gaps_v[best] <= max(limits_v):
        return float(at_s[best]), 0.0, 0.0
    steepest = max(abs(each.slope_v_per_s) for each in (a, b))
    unsure_v = 0.5 * float(times_s[b.first] - times_s[a.last - 1]) * steepest
    return middle_s, float(gaps_v[best]), unsure_v


def _as_sampled(first: int, last: int, monitor: Monitor) -> Segment:
    """
    Return samples as they are, with a neighbour on either side.

    A jump between two samples, with little change before and after, is a fall at the slew rate
    halfway between both.

    """
    stretch = slice(max(first - 1, 0), last + 1)
    times_s, volts_v = monitor.times_s[stretch], monitor.volts_v[stretch]
    rises_v = np.diff(volts_v)
    padded_v = np.abs(np.pad(rises_v, 1))
    most_v = np.maximum(padded_v[:-2], padded_v[2:])
    is_jump = np.abs(rises_v) > np.maximum(monitor.smooth_v, most_v / _UNSURE)
    smooth_v = volts_v - np.concatenate(([0.0], np.cumsum(np.where(is_jump, rises_v, 0.0))))
    rough_v = float(off_neighbours_v(times_s, smooth_v).max())
    if np.diff(times_s).max() > (STRAYS_IN_A_ROW + 1.5) * monitor.period_s:  # some are missing
        rough_v = float(np.ptp(volts_v))
    rows, jumps = np.column_stack((times_s, volts_v)), np.flatnonzero(is_jump)
    half_s = 0.5 * np.abs(rises_v[jumps]) / monitor.slew_v_per_s
    middles_s = 0.5 * (times_s[jumps] + times_s[jumps + 1])
    for side, off_s in ((0, -half_s), (1, half_s)):
        rows = np.concatenate((rows, np.column_stack((middles_s + off_s, volts_v[jumps + side]))))
    rows = rows[np.argsort(rows[:, 0], kind='stable')]
    return Segment(first, last, None, rows, rough_v=rough_v)


def _joined(segments: Sequence[Segment], slew_v_per_s: float) -> Array:
    """Return the corners of all segments, shape (n, 2), s and V, with falls between them."""
    found = [segments[0].rows]
    for segment in segments[1:]:
        (time_s, from_v), rows = found[-1][-1], segment.rows
        if segment.jump_v:
            time_s += abs(rows[0, 1] - from_v) / slew_v_per_s
            found.append(np.array([(time_s, np.interp(time_s, *rows.T))]))
        later = rows[rows[:, 0] > time_s]
        if len(later):
            found.append(later)
    return np.concatenate(found)


def _too_slow(segments: Sequence[Segment], monitor: Monitor) -> Iterator[str]:
    """Yield a refusal if the fastest cycles have too few samples."""
    rate_hz, fastest_hz = 1.0 / monitor.period_s, 0.0
    for each in segments:
        frequency_hz = abs(each.piece.frequency_hz) if each.piece else 0.0
        if each.rough_v > monitor.smooth_v:
            changes_v = np.diff(monitor.volts_v[each.first : each.last])
            ways = np.sign(changes_v[np.abs(changes_v) > monitor.smooth_v])
            cycles = 0.5 * np.count_nonzero(np.diff(ways))
            lasts_s = float(np.ptp(monitor.times_s[each.first : each.last]))
            frequency_hz = cycles / lasts_s if cycles > 1.0 else 0.0
        fastest_hz = max(fastest_hz, frequency_hz)
    needed_hz = CYCLE_SAMPLES_MIN * fastest_hz
    if rate_hz < needed_hz * (1.0 - _UNSURE):
        yield (
            f'a monitor of {rate_hz:.6g} Hz takes {rate_hz / fastest_hz:.3g} samples in a cycle '
            f'of {fastest_hz:.5g} Hz, below the {CYCLE_SAMPLES_MIN:g} ({needed_hz:.4g} Hz) that '
            'show it'
        )


def _refusals(segment: Segment, rows: Array, monitor: Monitor) -> Iterator[str]:
    """Yield the reasons against playing a segment."""
    piece, samples = segment.piece, slice(segment.first, segment.last)
    if piece is None:
        if segment.rough_v > monitor.smooth_v:
            yield (
                f'{segment.samples} samples fit neither a line nor a saw-tooth, and lie up to '
                f'{segment.rough_v:.2f} V off their neighbours'
            )
        return
    near_s = FALL_TAIL * float(np.ptp(monitor.volts_v)) / monitor.slew_v_per_s
    off_v = _off_course_v(monitor.times_s[samples], monitor.volts_v[samples], rows, near_s)
    missed = int(np.sum(off_v > monitor.tolerance_v(piece)))
    if missed > STRAYS_IN_A_ROW + _UNSURE * segment.samples:
        yield f'the recognised corners miss {missed} samples'
    if segment.unsure_v > max(monitor.tolerance_v(piece), _UNSURE * segment.jump_v):
        yield (
            f'it jumps by {segment.jump_v:.2f} V between two samples, with '
            f'{segment.unsure_v:.2f} V unsure: record the voltage faster'
        )


def _off_course_v(times_s: Array, volts_v: Array, rows: Array, near_s: float) -> Array:
    """Return distances of samples, V, from the range of a wave with corners within a time."""
    corners_s = np.concatenate(([-np.inf], rows[:, 0], [np.inf]))
    behind = np.searchsorted(rows[:, 0], times_s) + 1
    low_s, high_s = times_s - near_s, times_s + near_s
    last_s, next_s = corners_s[behind - 1], corners_s[behind]
    at_s = low_s, np.maximum(last_s, low_s), times_s, np.minimum(next_s, high_s), high_s
    within_v = [np.interp(each, *rows.T) for each in at_s]
    return np.asarray(
        np.maximum(np.min(within_v, 0) - volts_v, volts_v - np.max(within_v, 0)).clip(0.0)
    )


def _notes(monitor: Monitor, frequency_max_hz: float) -> Iterator[str]:
    """Yield assumptions, and counts of samples left out or missing."""
    rate_hz, gaps = 1.0 / monitor.period_s, np.diff(monitor.times_s) / monitor.period_s
    yield f'{len(monitor.times_s)} samples at {rate_hz:.2f} Hz, noise {monitor.noise_v:.2g} V'
    if rate_hz < CYCLE_SAMPLES_MIN * frequency_max_hz:
        yield (
            f'waves above {rate_hz / CYCLE_SAMPLES_MIN:.4g} Hz would be mistaken for slower ones '
            f'or for holds: for these, {GIVE_COMMANDS}'
        )
    if monitor.left_out:
        yield f'{monitor.left_out} samples left out: not finite, repeated, or beyond the rails'
    if missing := round(float(gaps.sum())) - len(gaps):
        longest = round(float(gaps.max())) - 1
        yield f'{missing} samples missing, {longest} in a row: the wave is assumed to continue'
