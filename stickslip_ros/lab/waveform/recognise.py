# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The wave in a slow, noisy monitor of an amplifier's voltage: recognised, said, or refused.

A fall of the amplifier takes microseconds, a monitor of some kilohertz shows it as a ramp of
hundreds, and a runner follows such a ramp without a slip: samples must not be played as they
are. What is recognised is played with its true corners and falls.

"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from stickslip_ros.arrays import Array
from stickslip_ros.errors import OutOfRange, StickSlipError
from stickslip_ros.lab.waveform.aliases import FREQUENCY_MAX_HZ, Evidence, hidden_hz, images
from stickslip_ros.lab.waveform.course import JUMP_UNSURE, CoursePart, joined, parts_of
from stickslip_ros.lab.waveform.finder import (
    FALL_TAIL,
    LOUD,
    STRAYS_IN_A_ROW,
    Finder,
    off_course_v,
)
from stickslip_ros.lab.waveform.monitor import (
    GAUSSIAN,
    NOISE_LEAST,
    RAIL_SHARE,
    STEADY_CLOCK,
    Monitor,
    monitor_of,
)
from stickslip_ros.lab.waveform.wave_piece import WavePiece
from stickslip_ros.parameters import Parameters

HOLD, RAMP, SAWTOOTH, AS_SAMPLED = 'hold', 'ramp', 'saw-tooth', 'as it is'
UNSEEN_MOST = 0.24
"""Share of the cycle that may lie between samples of neighbouring phases: in what was never seen
anything may happen. At a quarter of the monitor's rate and above nothing is left to test."""
_MISSED_MOST = 0.02
"""Share of a segment's samples that its corners may miss, beside a few."""
WHOLE_CYCLES = 0.05
"""Cycles this near to a whole number are whole."""
NOISE_AGREES = 1.6
"""Factor by which noise may differ from what was left over."""
LOW_SHARE = 0.1
"""Share of the amplifier's range below which a monitor may be divided, without a word of it."""
SURE_SCATTER = 100
"""Samples of a hold whose scatter differs from the noise by a twentieth, as standard deviation."""
STRAY_COST = 8.0
"""What a sample that follows nothing adds to the measure by which two clocks are compared: the
logarithm of the range of voltages in standard deviations of noise."""
TOLD = 3  # refusals that a message quotes
_ALIKE = 6  # frequencies that look alike, which one of them quotes


@dataclass(frozen=True)
class Segment:
    """A stretch of the wave: one of HOLD, RAMP, SAWTOOTH, AS_SAMPLED."""

    kind: str
    start_s: float
    end_s: float
    start_v: float  # where it begins, and where it ends before the voltage jumps
    end_v: float
    samples: int
    scatter_v: float = 0.0  # standard deviation of the samples about it
    amplitude_v: float = 0.0  # of a saw-tooth: way of a fall
    base_v: float = 0.0  # its lower end
    frequency_hz: float = 0.0  # negative where ramps fall slowly
    cycles: float = 0.0
    phase_s: float = 0.0  # a time at which a ramp begins
    unseen: float = 0.0  # largest share of the cycle between two samples
    others_hz: tuple[float, ...] = ()  # frequencies that give the same samples

    @property
    def at(self) -> str:
        """When it is, in words."""
        return f'{self.start_s:.6f} to {self.end_s:.6f} s'

    def said(self) -> str:
        """Return the segment as a line of text."""
        text = f'{self.at}: '
        base_v, start_v, end_v = (
            round(each, 2) + 0.0 for each in (self.base_v, self.start_v, self.end_v)
        )  # no -0.00
        if self.kind == SAWTOOTH:
            way = 'forwards' if self.frequency_hz > 0.0 else 'backwards'
            text += (
                f'{self.cycles:.7g} cycles of a saw-tooth {way}, {self.amplitude_v:.2f} V from '
                f'{base_v:.2f} V, {abs(self.frequency_hz):.4f} Hz'
            )
        elif self.kind == HOLD:
            text += f'hold at {start_v:.2f} V'
        elif self.kind == RAMP:
            text += f'ramp from {start_v:.2f} to {end_v:.2f} V'
        else:
            text += 'as it is'
        return f'{text}; {self.samples} samples, scatter {self.scatter_v:.2g} V'


@dataclass(frozen=True, eq=False)
class Recognised:
    """
    A wave that was recognised, whole or in part.

    Attributes
    ----------
    segments : tuple of Segment
        What was recognised, in its order.
    refusals : tuple of str
        Why the wave cannot be played; empty if it can.
    notes : tuple of str
        What was taken for granted, left out or clipped.

    """

    segments: tuple[Segment, ...]
    refusals: tuple[str, ...]
    notes: tuple[str, ...]
    noise_v: float
    rate_hz: float  # of the monitor
    rows: Array  # corners, whether they may be played or not, shape (n, 2): s, V

    def corners(self) -> tuple[Array, Array]:
        """
        Return times, s, and voltages, V, of the corners of the wave, both of shape (n,).

        Straight lines join them; falls have the slew rate. A wave that was refused raises
        NotRecognised.

        """
        if self.refusals:
            raise NotRecognised(self.refusals)
        return self.rows[:, 0].copy(), self.rows[:, 1].copy()

    def said(self) -> list[str]:
        """Return what was recognised, line by line, then notes and refusals."""
        return [*(each.said() for each in self.segments), *self.notes, *self.refusals]

    def as_dict(self) -> dict[str, Any]:
        """Return the same as plain values."""
        return {
            'segments': [asdict(each) for each in self.segments],
            'refusals': list(self.refusals),
            'notes': list(self.notes),
            'noise_v': self.noise_v,
            'rate_hz': self.rate_hz,
        }


class NotRecognised(StickSlipError, ValueError):
    """A voltage is no wave that can be played; ``refusals`` say why and what to do."""

    def __init__(self, refusals: Sequence[str]) -> None:
        more = f'; and {len(refusals) - TOLD} more' if len(refusals) > TOLD else ''
        super().__init__('the voltage is not played: ' + '; '.join(refusals[:TOLD]) + more)
        self.refusals = tuple(refusals)


def recognise(
    times_s: ArrayLike,
    voltage_v: ArrayLike,
    stand: Parameters,
    *,
    frequency_max_hz: float = FREQUENCY_MAX_HZ,
    direction: int = 0,
    position: tuple[ArrayLike, ArrayLike] | None = None,
) -> Recognised:
    """
    Recognise the wave in samples of a voltage.

    A saw-tooth of frequency f, sampled f_s times a second, gives the samples of one of f + m f_s
    for each whole m, of either direction: what is known beside the samples decides.

    Parameters
    ----------
    times_s, voltage_v : array_like, shape (n,)
        Samples, s and V; in any order. What is not finite is left out.
    stand : Parameters
        Slew rate and range of the amplifier.
    frequency_max_hz : float
        Frequency that no saw-tooth exceeds.
    direction : {0, 1, -1}
        That of all saw-teeth, if it is known: 1 where ramps rise.
    position : (times, positions), array_like, shapes (m,), optional
        Position of the runner on the same clock, s and m. A drive moves in the direction of its
        ramps, and its motion has a line at their frequency.

    Returns
    -------
    Recognised
        Segments, corners, and what is refused of them. An error of the monitor's gain cannot be
        seen.

    Raises
    ------
    OutOfRange, WrongKind
        If the samples are too few, too far beyond the rails, or of unequal number.

    """
    amplifier = stand.amplifier
    low_v, high_v = amplifier.voltage_min, amplifier.voltage_max
    if not frequency_max_hz > 0.0:
        hint = 'give the highest frequency the drive may have had'
        raise OutOfRange('frequency_max_hz', frequency_max_hz, 'Hz', 'not above 0', hint)
    given = monitor_of(times_s, voltage_v, low_v, high_v, amplifier.slew_rate)
    even = given.on_even_clock()
    finder, pieces = _found(given, amplifier.slew_rate)
    if given.jitter_s > STEADY_CLOCK * given.period_s and not given.shows_falls:
        both = (finder, pieces), _found(even, amplifier.slew_rate)
        finder, pieces = min(both, key=_cost)
    evidence = Evidence.of(frequency_max_hz, direction, position)
    on_even = Finder(even, finder.noise_v, amplifier.slew_rate)
    alike = dict[int, list[WavePiece]]()
    for index, piece in enumerate(pieces):
        if piece.height_v:
            alike[piece.first] = images(piece, finder, on_even, evidence)
            pieces[index] = (alike[piece.first] or [piece])[0]
    parts = parts_of(pieces, finder)
    rows = joined(parts, amplifier.slew_rate)
    found = [_segment(part, rows, finder, alike.get(part.first, []), evidence) for part in parts]
    refusals = [each for _, against in found for each in against]
    beyond_v = max(low_v - rows[:, 1].min(), rows[:, 1].max() - high_v)
    if beyond_v > RAIL_SHARE * (high_v - low_v):
        refusals.append(
            f'the wave reaches {beyond_v:.2f} V beyond the rails {low_v:g} and {high_v:g} V; '
            'give the unit of the monitor, or set amplifier.voltage_min and voltage_max'
        )
    if all(segment.kind == HOLD for segment, _ in found):
        refusals.append('nothing but holds was recognised; record the drive while it runs')
    inside_v = np.clip(rows[:, 1], low_v, high_v)
    notes = _notes(given, finder, evidence, int(np.sum(inside_v != rows[:, 1])))
    if np.ptp(inside_v) < LOW_SHARE * (high_v - low_v):
        notes.append(
            f'the wave covers {np.ptp(inside_v):.3g} V of the {high_v - low_v:g} V of the '
            'amplifier: if the monitor is divided, give its unit'
        )
    return Recognised(
        tuple(segment for segment, _ in found),
        tuple(refusals),
        tuple(notes),
        finder.noise_v,
        1.0 / given.period_s,
        np.column_stack((rows[:, 0], inside_v)),
    )


def _found(monitor: Monitor, slew_v_per_s: float) -> tuple[Finder, list[WavePiece]]:
    """Return the pieces, looked for again if they leave over another noise than was thought."""
    finder = Finder(monitor, monitor.noise_v, slew_v_per_s)
    if monitor.shows_falls:
        return finder, []
    pieces = finder.pieces()
    teeth = [each for each in pieces if each.height_v]
    if teeth:  # where ramps are too short for straight windows, noise was thought larger
        counts = [each.last - each.first for each in teeth]
        left_v = float(np.median(np.repeat([each.scatter_v for each in teeth], counts)))
        least_v = NOISE_LEAST * float(np.ptp(monitor.volts_v))
        left_v = max(min(left_v, LOUD * finder.noise_v), least_v)
        if not 1.0 / NOISE_AGREES < left_v / finder.noise_v < NOISE_AGREES:
            finder = Finder(monitor, left_v, slew_v_per_s)
            pieces = finder.pieces()
    return finder, pieces


def _cost(found: tuple[Finder, list[WavePiece]]) -> float:
    """Return how badly pieces describe the samples: logarithm of their likelihood, reversed."""
    finder, pieces = found
    cost = STRAY_COST * (len(finder.times_s) - sum(each.last - each.first for each in pieces))
    for each in pieces:
        rest_v = each.rest_v(finder.times_s[each.samples], finder.volts_v[each.samples])
        scatter_v = GAUSSIAN * float(np.median(np.abs(rest_v)))
        least_v = NOISE_LEAST * float(np.ptp(finder.volts_v))
        cost += STRAY_COST + (each.last - each.first) * math.log(max(scatter_v, least_v))
    return cost


def _segment(
    part: CoursePart, rows: Array, finder: Finder, alike: list[WavePiece], evidence: Evidence
) -> tuple[Segment, list[str]]:
    """Return what a part of the course is, and why it cannot be played."""
    times_s, piece = finder.times_s[part.first : part.last], part.piece
    (start_s, start_v), (end_s, end_v) = part.rows[0].tolist(), part.rows[-1].tolist()
    segment = Segment(AS_SAMPLED, start_s, end_s, start_v, end_v, len(times_s))
    against = list[str]()
    if piece is None and part.rough_v > finder.smooth_v:
        against.append(
            f'{len(times_s)} samples follow no line and no saw-tooth, and lie up to '
            f'{part.rough_v:.2f} V off their neighbours; give the commands, or a faster monitor'
        )
    if piece is not None:
        segment = replace(
            segment,
            kind=SAWTOOTH if piece.height_v else RAMP if piece.slope_v_per_s else HOLD,
            scatter_v=piece.scatter_v,
        )
        against += [*_missed(part, piece, rows, finder), *_unsure(part, piece, finder)]
    if piece is not None and piece.height_v:
        phases = np.sort((times_s - piece.ramp_s) * abs(piece.frequency_hz) % 1.0)
        cycles = (end_s - start_s) * abs(piece.frequency_hz)
        segment = replace(
            segment,
            amplitude_v=piece.amplitude_v,
            base_v=piece.base_v,
            frequency_hz=piece.frequency_hz,
            cycles=float(round(cycles)) if abs(cycles - round(cycles)) < WHOLE_CYCLES else cycles,
            phase_s=piece.ramp_s,
            unseen=float(np.diff(phases, append=phases[0] + 1.0).max()),
            others_hz=tuple(each.frequency_hz for each in alike[1:]),
        )
        against += _ambiguous(segment, bool(alike), 1.0 / finder.period_s)
    elif piece is not None:
        against += _hidden(part, segment, finder, evidence)
    return segment, [f'{segment.at}: {each}' for each in against]


def _missed(part: CoursePart, piece: WavePiece, rows: Array, finder: Finder) -> Iterator[str]:
    """Yield a refusal if the samples of a part lie off its corners, or scatter too much."""
    times_s, volts_v = (each[part.first : part.last] for each in (finder.times_s, finder.volts_v))
    near_s = FALL_TAIL * float(np.ptp(finder.volts_v)) / finder.slew_v_per_s
    off_v = off_course_v(times_s, volts_v, rows, near_s)
    missed = int(np.sum(off_v > finder.tolerance_v(piece)))
    if missed > STRAYS_IN_A_ROW + _MISSED_MOST * len(times_s):
        yield f'what was recognised misses {missed} samples; give the commands'
    is_hold = not piece.slope_v_per_s and len(times_s) >= SURE_SCATTER
    if is_hold and piece.scatter_v > NOISE_AGREES * finder.noise_v:
        yield (
            f'its samples scatter by {piece.scatter_v:.2g} V, the noise is '
            f'{finder.noise_v:.2g} V: something smaller is in it; give the commands'
        )


def _unsure(part: CoursePart, piece: WavePiece, finder: Finder) -> Iterator[str]:
    """Yield a refusal for each end of a part that lies between samples which leave it open."""
    for joint in (each for each in (part.before, part.after) if each):
        unsure_v = abs(piece.slope_v_per_s) * joint.unsure_s
        most_v = max(finder.tolerance_v(piece), JUMP_UNSURE * joint.jump_v)
        if joint.jump_v and unsure_v > most_v:
            yield (
                f'it jumps by {joint.jump_v:.2f} V between two samples, {unsure_v:.2f} V of it '
                'are unsure; give the commands, or a faster monitor'
            )
        cycles = round(float(np.ptp(joint.others_s)) * abs(piece.frequency_hz))
        if cycles:
            yield (
                f'its beginning or end is unsure by {cycles} cycles; give the commands, or a '
                'recording that shows it'
            )


def _ambiguous(segment: Segment, is_allowed: bool, rate_hz: float) -> Iterator[str]:
    """Yield refusals of a saw-tooth of which the monitor sees too little."""
    if segment.unseen > UNSEEN_MOST:
        yield (
            f'{segment.frequency_hz:.2f} Hz and the {rate_hz:.2f} Hz of the monitor beat so that '
            f'{segment.unseen:.0%} of the cycle was never seen; give the commands'
        )
    if not is_allowed:
        yield (
            f'these are samples of {segment.frequency_hz:.2f} Hz, which the highest frequency or '
            'the direction that was given rules out; give others'
        )
    if segment.others_hz:
        alike_hz = segment.frequency_hz, *segment.others_hz
        all_hz = ', '.join(f'{each:+.2f} Hz' for each in alike_hz[:_ALIKE])
        if len(alike_hz) > _ALIKE:
            all_hz += f' and {len(alike_hz) - _ALIKE} others'
        yield (
            f'{all_hz} give the same samples at {rate_hz:.2f} Hz (+ forwards, - backwards); give '
            'the highest frequency of the drive, its direction, or the position'
        )


def _hidden(
    part: CoursePart, segment: Segment, finder: Finder, evidence: Evidence
) -> Iterator[str]:
    """Yield a refusal of a straight line that may be, or is, a saw-tooth seen at one phase."""
    rate_hz = 1.0 / finder.period_s
    hidden = hidden_hz(segment.start_s, segment.end_s, rate_hz, evidence)
    if hidden:
        yield (
            f'samples at {rate_hz:.2f} Hz show a {segment.kind}, the position moves at '
            f'{hidden:.2f} Hz; give the commands'
        )
    if hidden is None and all(joint and joint.jump_v for joint in (part.before, part.after)):
        yield (
            f'samples at {rate_hz:.2f} Hz cannot tell a {segment.kind} between two jumps from a '
            'saw-tooth at a multiple of that; give the highest frequency of the drive, or the '
            'position'
        )


def _notes(monitor: Monitor, finder: Finder, evidence: Evidence, clipped: int) -> list[str]:
    """Return what was taken for granted, left out or clipped."""
    rate_hz, longest = 1.0 / monitor.period_s, int(np.diff(monitor.counts).max())
    missing = int(monitor.counts[-1]) + 1 - len(monitor.counts)
    notes = [
        f'{len(monitor.times_s)} samples at {rate_hz:.2f} Hz, noise {finder.noise_v:.2g} V',
        'an error of the gain of the monitor cannot be seen in its samples',
        f'no saw-tooth is taken to be faster than {evidence.frequency_max_hz:g} Hz',
    ]
    if monitor.left_out:
        notes.append(f'{monitor.left_out} samples left out: not finite, twice, or off the rails')
    if clipped:
        notes.append(f'{clipped} corners clipped to the rails')
    if missing:
        notes.append(
            f'{missing} samples missing, {longest - 1} in a row: the wave is taken to go on'
        )
    if rate_hz <= evidence.frequency_max_hz and not len(evidence.times_s):
        notes.append(f'a saw-tooth at a multiple of {rate_hz:.2f} Hz would look like a hold')
    return notes
