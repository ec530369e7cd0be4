# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Samples of a voltage monitor: rate, noise, and the samples that a piece explains."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stickslip_ros.arrays import Array
from stickslip_ros.errors import OutOfRange, WrongKind
from stickslip_ros.lab.waveform.wave_piece import WavePiece
from stickslip_ros.parameters import Parameters

OUT = 4.5
"""Largest distance of a sample from its piece, per noise; 7 of a million samples exceed it."""
NOISE_FACTOR_MAX = 2.0
"""Largest scatter of samples about a piece, per noise."""
EQUAL = 0.01
"""Share of the range within which voltages are equal, at a rail or between neighbours of a curve;
also the share of the samples that may lie beyond the rails."""
GAUSSIAN = 1.4826
"""Standard deviation of normal noise per median absolute deviation."""
_NOISE_LEAST, _NOISE_MOST = 2e-4, 0.015
"""Least and most noise, as shares of the range of the samples: the least is that of an 11-bit
converter and of an amplifier's overshoot; noise above the most hides a wave."""
FALL_SAMPLES_MIN = 3.0  # fewest samples within a fall that resolve it
_SAMPLES_MIN = 12
"""Fewest samples of a wave: a saw-tooth has four unknowns, and others must test it."""
REFITS = 4


@dataclass(frozen=True, eq=False)
class Monitor:
    """Samples of a voltage in the order of time."""

    times_s: Array  # rising, shape (n,)
    volts_v: Array  # shape (n,)
    period_s: float  # of the clock
    jitter_s: float  # standard deviation of the time stamps
    noise_v: float  # standard deviation of the volts about the wave
    shows_falls: bool  # whether the samples resolve a fall
    left_out: int  # number of samples not finite, repeated, or beyond the rails
    rails_v: tuple[float, float]  # of the amplifier
    slew_v_per_s: float

    @property
    def smooth_v(self) -> float:
        """Largest distance of a sample from its neighbours; infinite if samples resolve falls."""
        share_v = EQUAL * float(np.ptp(self.volts_v))
        return math.inf if self.shows_falls else max(share_v, OUT * self.noise_v)

    def noise_of(self, piece: WavePiece) -> float:
        """Return the noise about a piece, V, of the voltages and of the time stamps."""
        return math.hypot(self.noise_v, self.jitter_s * piece.slope_v_per_s)

    def tolerance_v(self, piece: WavePiece) -> float:
        """Return the largest distance of a sample from its piece, V."""
        noise_v = self.noise_of(piece)
        return OUT * min(max(piece.scatter_v, noise_v), NOISE_FACTOR_MAX * noise_v)

    def reach_v(self, piece: WavePiece) -> float:
        """
        Return the tolerance for samples outside a piece, V.

        A line through n samples has the error sigma sqrt(28/n) at n samples after its end.

        """
        return self.tolerance_v(piece) * math.sqrt(1.0 + 28.0 / (piece.last - piece.first))

    def misfits(
        self, piece: WavePiece, first: int, last: int, limit_v: float
    ) -> NDArray[np.bool_]:
        """Return a mask of the samples that a piece does not explain within a limit."""
        volts_v = self.volts_v[first:last]
        off = np.abs(piece.rest_v(self.times_s[first:last], volts_v)) > limit_v
        if piece.height_v:  # all samples must lie between base and top
            least_v, most_v = np.quantile(self.volts_v[piece.samples], (EQUAL, 1.0 - EQUAL))
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
            if np.array_equal(piece.falls(times_s, volts_v), before.falls(times_s, volts_v)):
                break
        return piece


def monitor_of(times_s: ArrayLike, voltage_v: ArrayLike, stand: Parameters) -> Monitor:
    """
    Return samples, shapes (n,), sorted and cleaned.

    Samples are dropped if they are not finite, repeat a time, or lie beyond the rails of the
    amplifier by more than noise. They are thinned if one or two would lie within each fall. Raises
    WrongKind for arrays of different lengths, OutOfRange for too few samples or too many beyond
    the rails.

    """
    times, volts = np.asarray(times_s, np.float64), np.asarray(voltage_v, np.float64)
    if times.ndim != 1 or times.shape != volts.shape:
        shapes = times.shape, volts.shape
        raise WrongKind('shapes of times and volts', shapes, 'a pair (n,), (n,)', 'give pairs')
    low_v, high_v = stand.amplifier.voltage_min, stand.amplifier.voltage_max
    given, margin_v = len(times), EQUAL * (high_v - low_v)
    known = np.isfinite(times) & np.isfinite(volts)
    times, volts = times[known], volts[known]
    inside = (volts >= low_v - margin_v) & (volts <= high_v + margin_v)
    if np.sum(~inside) > EQUAL * given:
        worst_v = float(volts[~inside][np.argmax(np.abs(volts[~inside] - low_v))])
        limit = f'beyond the rails {low_v:g} and {high_v:g} V, with {np.sum(~inside)} samples'
        hint = 'give the unit of the monitor, or set amplifier.voltage_min and voltage_max'
        raise OutOfRange('voltage', worst_v, 'V', limit, hint)
    times, first = np.unique(times[inside], return_index=True)
    volts, left_out = volts[inside][first], given - len(first)
    if len(times) < _SAMPLES_MIN:
        limit = f'below {_SAMPLES_MIN}, the fewest that show a wave'
        raise OutOfRange('number of samples', len(times), '', limit, 'record longer')
    if not np.ptp(volts) > 0.0:
        hint = 'record the drive while it runs'
        raise OutOfRange('voltage', float(volts[0]), 'V', 'at all times', hint)
    in_a_fall = float(np.ptp(volts) / stand.amplifier.slew_rate / np.median(np.diff(times)))
    shows_falls = in_a_fall >= FALL_SAMPLES_MIN
    every = 1 if shows_falls else max(round(in_a_fall), 1)
    times, volts = times[::every], volts[::every]
    spacing_s = np.diff(times)
    period_s = float(np.median(spacing_s))
    jitter_s = GAUSSIAN * float(np.median(np.abs(spacing_s - period_s))) / math.sqrt(2.0)
    # gaps count as whole periods
    period_s = float(np.sum(spacing_s) / np.maximum(np.rint(spacing_s / period_s), 1.0).sum())
    off_v = float(np.median(off_neighbours_v(times, volts)[1:-1]))
    shares = np.array((_NOISE_LEAST, _NOISE_MOST)) * np.ptp(volts)
    noise_v = float(np.clip(GAUSSIAN * off_v / math.sqrt(1.5), *shares))
    how = shows_falls, left_out, (low_v, high_v), stand.amplifier.slew_rate
    return Monitor(times, volts, period_s, jitter_s, noise_v, *how)


def off_neighbours_v(times_s: Array, volts_v: Array) -> Array:
    """Return the distance of each sample from the straight line between its neighbours, V."""
    off_v = np.zeros(len(volts_v))
    share = (times_s[1:-1] - times_s[:-2]) / (times_s[2:] - times_s[:-2])
    off_v[1:-1] = np.abs(volts_v[1:-1] - volts_v[:-2] - share * (volts_v[2:] - volts_v[:-2]))
    return off_v
