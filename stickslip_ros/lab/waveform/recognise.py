# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Recognise the wave in samples of an amplifier's voltage, or refuse it.

A fall of the amplifier takes microseconds. A monitor of some kilohertz shows it as a ramp of
hundreds, and a runner follows such a ramp without a slip: samples must not be played as they are.
A recognised wave has its true corners, and falls at the slew rate.

"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from stickslip_ros.arrays import Array
from stickslip_ros.errors import StickSlipError
from stickslip_ros.lab.waveform.course import (
    JUMP_UNSURE,
    SWING_UNSURE,
    CoursePart,
    joined,
    parts_of,
)
from stickslip_ros.lab.waveform.finder import (
    FALL_TAIL,
    NOISE_AGREES,
    STRAYS_IN_A_ROW,
    Finder,
    off_course_v,
)
from stickslip_ros.lab.waveform.monitor import RAIL_SHARE, Monitor, monitor_of
from stickslip_ros.parameters import Parameters

HOLD, RAMP, SAWTOOTH, AS_SAMPLED = 'hold', 'ramp', 'saw-tooth', 'samples'
CYCLE_SAMPLES_MIN = 10.0
"""Fewest samples in a cycle of a wave that is recognised."""
_LIMIT_ERROR = 0.02  # error of a fitted frequency at that limit, as a share
GIVE_COMMANDS = 'give the commands with --commands (Python: commands)'
_MISSED_MOST = 0.02
"""Share of a segment's samples that its corners may miss, besides a few."""
WHOLE_CYCLES = 0.05
"""Cycles this near to a whole number are whole."""
LOW_SHARE = 0.1
"""Share of the amplifier's range below which the monitor may be divided."""
SURE_SCATTER = 100
"""Samples of a hold with a scatter known to a twentieth."""
_QUOTED = 3  # refusals in a message


@dataclass(frozen=True)
class Segment:
    """A part of the wave: one of HOLD, RAMP, SAWTOOTH, AS_SAMPLED."""

    kind: str
    start_s: float
    end_s: float
    start_v: float
    end_v: float  # before the voltage jumps
    samples: int
    scatter_v: float = 0.0  # standard deviation of the samples about it
    amplitude_v: float = 0.0  # height of a fall of a saw-tooth
    base_v: float = 0.0  # lower end of a saw-tooth
    frequency_hz: float = 0.0  # negative if the ramps fall slowly
    cycles: float = 0.0

    def __str__(self) -> str:
        """Return the segment as a line of text."""
        base_v, start_v, end_v = (
            round(each, 2) + 0.0 for each in (self.base_v, self.start_v, self.end_v)
        )  # no -0.00
        way = 'forwards' if self.frequency_hz > 0.0 else 'backwards'
        text = {
            HOLD: f'hold at {start_v:.2f} V',
            RAMP: f'ramp from {start_v:.2f} to {end_v:.2f} V',
            SAWTOOTH: f'{self.cycles:.7g} cycles of a saw-tooth {way}, {self.amplitude_v:.2f} V '
            f'from {base_v:.2f} V, {abs(self.frequency_hz):.4f} Hz',
            AS_SAMPLED: 'played as sampled',
        }[self.kind]
        about = f'{self.samples} samples, scatter {self.scatter_v:.2g} V'
        return f'{self.start_s:.6f} to {self.end_s:.6f} s: {text}; {about}'


@dataclass(frozen=True, eq=False)
class RecognisedWave:
    """A wave that was recognised, whole or in part."""

    segments: tuple[Segment, ...]
    refusals: tuple[str, ...]  # reasons against playing the wave; empty if it can be played
    notes: tuple[str, ...]  # assumptions, and samples left out or clipped
    rows: Array  # corners, played or not, shape (n, 2): s, V

    def corners(self, hint: str = GIVE_COMMANDS) -> tuple[Array, Array]:
        """
        Return times, s, and voltages, V, of the corners of the wave, both of shape (n,).

        Straight lines join them; falls have the slew rate. Raises NotRecognised, ending in the
        hint, if the wave was refused.

        """
        if self.refusals:
            raise NotRecognised(self.refusals, hint)
        return self.rows[:, 0].copy(), self.rows[:, 1].copy()

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

    Values that are not finite are dropped; an error of the monitor's gain does not show. Raises
    OutOfRange or WrongKind if there are too few samples, or too many beyond the rails, or if their
    numbers differ.

    """
    amplifier = stand.amplifier
    low_v, high_v = amplifier.voltage_min, amplifier.voltage_max
    monitor = monitor_of(times_s, voltage_v, low_v, high_v, amplifier.slew_rate)
    finder = Finder(monitor, amplifier.slew_rate)
    parts = parts_of(finder.pieces(), finder)
    rows = joined(parts, amplifier.slew_rate)
    segments = tuple(_segment(part) for part in parts)
    refusals = _too_slow(parts, finder)
    for part, segment in zip(parts, segments, strict=True) if not refusals else ():
        at = f'{segment.start_s:.6f} to {segment.end_s:.6f} s'
        refusals += [f'{at}: {each}' for each in _refusals(part, rows, finder)]
    inside_v = np.clip(rows[:, 1], low_v, high_v)
    beyond_v = float(np.abs(rows[:, 1] - inside_v).max())
    if beyond_v > RAIL_SHARE * (high_v - low_v):
        refusals.append(
            f'the wave reaches {beyond_v:.2f} V beyond the rails {low_v:g} and {high_v:g} V; '
            'give the unit of the monitor, or set amplifier.voltage_min and voltage_max'
        )
    if all(each.kind == HOLD for each in segments):
        refusals.append('it consists of holds only; record the drive while it runs')
    notes = list(
        _notes(
            monitor, finder.noise_v, amplifier.frequency_max, int(np.sum(inside_v != rows[:, 1]))
        )
    )
    if np.ptp(inside_v) < LOW_SHARE * (high_v - low_v):
        notes.append(
            f'the wave covers {np.ptp(inside_v):.3g} V of the {high_v - low_v:g} V of the '
            'amplifier: if the monitor is divided, give its unit'
        )
    rows = np.column_stack((rows[:, 0], inside_v))
    return RecognisedWave(segments, tuple(refusals), tuple(notes), rows)


def _segment(part: CoursePart) -> Segment:
    """Return the segment of a part of the course."""
    (start_s, start_v), (end_s, end_v) = part.rows[[0, -1]].tolist()
    piece = part.piece
    samples = part.last - part.first
    if piece is None:
        return Segment(AS_SAMPLED, start_s, end_s, start_v, end_v, samples)
    cycles = (end_s - start_s) * abs(piece.frequency_hz)
    return Segment(
        SAWTOOTH if piece.height_v else RAMP if piece.slope_v_per_s else HOLD,
        *(start_s, end_s, start_v, end_v, samples),
        scatter_v=piece.scatter_v,
        amplitude_v=piece.amplitude_v,
        base_v=piece.base_v,
        frequency_hz=piece.frequency_hz,
        cycles=float(round(cycles)) if abs(cycles - round(cycles)) < WHOLE_CYCLES else cycles,
    )


def _too_slow(parts: Sequence[CoursePart], finder: Finder) -> list[str]:
    """Return a refusal if the fastest cycles have too few samples."""
    rate_hz, fastest_hz = 1.0 / finder.period_s, 0.0
    for part in parts:
        frequency_hz = abs(part.piece.frequency_hz) if part.piece else 0.0
        if part.rough_v > finder.smooth_v:
            times_s, volts_v = (
                each[part.first : part.last] for each in (finder.times_s, finder.volts_v)
            )
            changes_v = np.diff(volts_v)
            ways = np.sign(changes_v[np.abs(changes_v) > finder.smooth_v])
            cycles = 0.5 * np.count_nonzero(np.diff(ways))
            frequency_hz = cycles / float(np.ptp(times_s)) if cycles > 1.0 else 0.0
        fastest_hz = max(fastest_hz, frequency_hz)
    needed_hz = CYCLE_SAMPLES_MIN * fastest_hz
    if rate_hz >= needed_hz * (1.0 - _LIMIT_ERROR):
        return []
    text = (
        f'a monitor of {rate_hz:.6g} Hz takes {rate_hz / fastest_hz:.3g} samples in a cycle of '
        f'{fastest_hz:.5g} Hz, below the {CYCLE_SAMPLES_MIN:g} ({needed_hz:.4g} Hz) that show it'
    )
    return [text]


def _refusals(part: CoursePart, rows: Array, finder: Finder) -> Iterator[str]:
    """Yield the reasons against playing a part of the course."""
    times_s, volts_v = (each[part.first : part.last] for each in (finder.times_s, finder.volts_v))
    piece = part.piece
    if piece is None:
        if part.rough_v > finder.smooth_v:
            yield (
                f'{len(times_s)} samples fit neither a line nor a saw-tooth, and lie up to '
                f'{part.rough_v:.2f} V off their neighbours'
            )
        return
    near_s = FALL_TAIL * float(np.ptp(finder.volts_v)) / finder.slew_v_per_s
    off_v = off_course_v(times_s, volts_v, rows, near_s)
    missed = int(np.sum(off_v > finder.tolerance_v(piece)))
    if missed > STRAYS_IN_A_ROW + _MISSED_MOST * len(times_s):
        yield f'the recognised corners miss {missed} samples'
    is_hold = not piece.slope_v_per_s and len(times_s) >= SURE_SCATTER
    if is_hold and piece.scatter_v > NOISE_AGREES * finder.noise_v:
        yield (
            f'its samples scatter by {piece.scatter_v:.2g} V, above the noise of '
            f'{finder.noise_v:.2g} V: it contains a smaller wave'
        )
    for joint in (each for each in (part.before, part.after) if each):
        unsure_v = abs(piece.slope_v_per_s) * joint.unsure_s
        of_swing_v = SWING_UNSURE * float(np.ptp(finder.volts_v))
        most_v = max(finder.tolerance_v(piece), JUMP_UNSURE * joint.jump_v, of_swing_v)
        if joint.jump_v and unsure_v > most_v:
            yield (
                f'it jumps by {joint.jump_v:.2f} V between two samples, with {unsure_v:.2f} V '
                'unsure: record the voltage faster'
            )
        cycles = round(float(np.ptp(joint.others_s)) * abs(piece.frequency_hz))
        if cycles:
            yield f'its beginning or end is unsure by {cycles} cycles'


def _notes(
    monitor: Monitor, noise_v: float, frequency_max_hz: float, clipped: int
) -> Iterator[str]:
    """Yield assumptions, and counts of samples left out, missing or clipped."""
    rate_hz, gaps = 1.0 / monitor.period_s, np.diff(monitor.times_s) / monitor.period_s
    missing = round(float(gaps.sum())) - len(gaps)
    yield f'{len(monitor.times_s)} samples at {rate_hz:.2f} Hz, noise {noise_v:.2g} V'
    yield 'an error of the gain of the monitor does not show in its samples'
    if rate_hz < CYCLE_SAMPLES_MIN * frequency_max_hz:
        yield (
            f'waves above {rate_hz / CYCLE_SAMPLES_MIN:.4g} Hz would be mistaken for slower ones '
            f'or for holds: for these, {GIVE_COMMANDS}'
        )
    if monitor.left_out:
        yield f'{monitor.left_out} samples left out: not finite, repeated, or beyond the rails'
    if clipped:
        yield f'{clipped} corners clipped to the rails'
    if missing:
        longest = round(float(gaps.max())) - 1
        yield f'{missing} samples missing, {longest} in a row: the wave is assumed to continue'
