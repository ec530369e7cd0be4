# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Find the delay of a sensor's clock, by the falls of the voltage, and its low-pass, by a model.

Refuse positions of a sensor at its limit.

"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.special import chdtrc

from stickslip_ros.arrays import Array
from stickslip_ros.errors import RecordingError
from stickslip_ros.lab.experiments.experiment import Experiment, Readout, Voltage
from stickslip_ros.lab.experiments.predict import low_passed, perfect_samples, values_at
from stickslip_ros.lab.experiments.sensor import lone_outliers, rounding_of
from stickslip_ros.parameters import Parameters

LEAD_S = 0.05
"""Time simulated before a window, from rest, as contacts forget their start in a few steps; also
the largest delay of a clock in a search."""
FALL_S, FALL_V = 5e-5, 1.0
"""Longest duration, and least height, of a fall or a fast rise."""
RUNG_S, RUNG_MIN = 1.6e-4, 5
"""Duration of the ringing of a light runner after a fall, and fewest readings that show it."""
_CLEAR = 1.3  # least ratio of the best lag's energy to that at 0
JERK_CORRELATION = 35.0 / 18.0
"""Correlated second differences of noise per independent one: the sum of their squared
autocorrelation, 1, -2/3, 1/6."""
CHANCE_MAX = 1e-4  # largest chance that noise has as much energy at any lag
ENOUGH_FALLS = 0.5
"""Least share of the falls, as seen without a delay, that a lag leaves within the readings; and
least share that a lag does not move to other falls, as a whole period of the drive would."""
SIMILAR_ENERGY = 0.9  # share of the largest energy from which a shorter lag is preferred
LATE_MIN_S = 1e-4  # smaller delays are left to the model
_STEPS_S = 2e-5, 4e-6  # steps of tried delays, ten to either side, then again around the best
_SLOW_S = (0.0, *(4e-6 * 2.0 ** np.arange(8)).tolist())
"""Tried time constants of a sensor's low-pass: 0 is none, 0.5 ms is 310 Hz. Without them, a fit to
a sensor of 1 kHz passed its checks with a gain 5 standard errors off."""
_SURELY_SLOW = 20.0
"""Least fall of the sum of squared differences, per mean square, that shows a low-pass."""
_STILL_FALLS, _STILL_READINGS = 3, 8
"""Fewest falls of the voltage, and readings per fall, in a rest that is refused."""
_DIGITS_MIN = 4.0  # least stroke of the feet that a sensor must show, in its last digits


class Lateness(NamedTuple):
    """The best delay of a sensor's clock by the falls of a voltage."""

    late_s: float = 0.0
    is_clear: bool = False  # whether the clock is late rather than on time

    @property
    def clear_s(self) -> float:
        """The delay if it is clear, or else 0."""
        return self.late_s if self.is_clear else 0.0


def falls_of(voltage: Voltage) -> tuple[Array, Array]:
    """Return times, s, and heights, V, of the falls and fast rises of a voltage, shapes (n,)."""
    length_s, rise_v = np.diff(voltage.rows, axis=0).T
    is_fall = (length_s <= FALL_S) & (np.abs(rise_v) >= FALL_V)
    return voltage.rows[1:, 0][is_fall], rise_v[is_fall]


def lateness_of(observed: Readout, voltage: Voltage) -> Lateness:
    """
    Return the delay of readings against the voltage, to a sample; 0 without falls.

    The runner rings in the same way after each fall. The second differences of its readings,
    averaged over the falls, therefore have the largest energy within RUNG_S at the true lag. The
    shortest of similar lags is taken. The test assumes nothing about the stand, nor that a larger
    fall makes a larger jerk. It found the delay of all 32 rigs with 5 nm of noise and up to 4 ms;
    the mean of absolute differences found 21. The result is not clear with fewer than RUNG_MIN
    readings in the ringing, or if the lag moves half of the falls to other falls.

    """
    observed = observed.averaged()  # second differences of fast readings are only noise
    time_s, values = observed.time_s, observed.values
    falls_s, heights = falls_of(voltage)
    sample_s = observed.apart_s
    if not len(falls_s) or len(values) < 3 * RUNG_MIN:
        return Lateness()
    even_s = np.arange(time_s[0], time_s[-1], sample_s)
    jerk = np.diff(np.interp(even_s, time_s, values), 2, prepend=values[0], append=values[-1])
    jerk -= jerk.mean()
    most = round(LEAD_S / sample_s)
    lags = np.arange(-most, most + 1)
    places = np.round((falls_s - even_s[0]) / sample_s).astype(np.intp)
    found = np.add.outer(lags, places)
    inside = (found >= 0) & (found < len(jerk))
    jerks = np.sign(heights) * jerk[np.clip(found, 0, len(jerk) - 1)]
    sums = np.where(inside, jerks, 0.0).sum(axis=1)
    counts = inside.sum(axis=1)  # the number of falls within the readings depends on the lag
    count_on_time = counts[most] or counts.max()
    sums[counts < ENOUGH_FALLS * count_on_time] = 0.0
    variances = np.maximum(counts, 1) * (np.mean(jerk**2) or 1.0)
    after = max(round(RUNG_S / sample_s), 1)
    energy = np.convolve(sums**2 / variances, np.ones(after))[after - 1 :]
    around = max(round(LATE_MIN_S / sample_s), 1)
    similar = np.flatnonzero(energy >= SIMILAR_ENERGY * energy.max())  # several of a periodic wave
    least = int(similar[np.argmin(np.abs(lags[similar]))])
    best = int(np.argmax(np.where(np.abs(lags - lags[least]) <= around, energy, -np.inf)))
    near = np.add.outer(places, np.arange(-around, around + 1))
    others = float(np.mean(np.isin(places + lags[best], near)))  # 1 at lag 0
    chance = len(lags) * float(chdtrc(after / JERK_CORRELATION, energy[best] / JERK_CORRELATION))
    is_better = energy[best] > _CLEAR * energy[np.abs(lags) <= around].max()
    is_clear = after >= RUNG_MIN and others < ENOUGH_FALLS and chance < CHANCE_MAX and is_better
    return Lateness(float(lags[best] * sample_s), bool(is_clear))


def lateness_in(experiment: Experiment, stand: Parameters) -> float:
    """Return the delay of the first sensor of an experiment, s: by falls, then by a model."""
    if not isinstance(experiment.drive, Voltage):
        return 0.0
    rough_s = lateness_of(experiment.observed[0], experiment.drive).clear_s
    return sensor_near(experiment, stand, rough_s, (0.0,))[0]


def sensor_near(
    experiment: Experiment,
    stand: Parameters,
    rough_s: float,
    slow_s: Sequence[float] = _SLOW_S,
) -> tuple[float, float]:
    """
    Return the delay and time constant of a sensor, s, that best fit a model's motion.

    Delays near the rough one and near 0 are tried. Differences of neighbouring readings are
    compared, as they hardly depend on the step length.

    """
    observed = experiment.observed[0]
    samples = perfect_samples(stand, replace(experiment, observed=(observed,)))

    def best(as_slow_s: float) -> tuple[float, float]:
        behind = low_passed(samples, as_slow_s)

        def missed(late_s: float) -> float:
            values = values_at(behind, observed.time_s - late_s)
            return float(np.sum(np.diff(values - observed.values) ** 2))

        middles_s, ends = {rough_s, 0.0}, list[tuple[float, float]]()
        for step_s in _STEPS_S:
            tried_s = np.add.outer(sorted(middles_s), step_s * np.arange(-10, 11)).ravel().tolist()
            ends.append(min((missed(each_s), each_s) for each_s in tried_s))
            middles_s = {ends[-1][1]}
        return ends[-1]

    found = {each_s: best(each_s) for each_s in slow_s}
    found_s = min(found, key=lambda each_s: found[each_s])
    least, at_once = found[found_s][0], found[0.0][0]
    if at_once - least < _SURELY_SLOW * least / len(observed.values):
        found_s = 0.0
    return found[found_s][1], found_s


def check_limits(
    origin: str, observed: Readout, drive: Voltage, begins_s: float, gain_m_per_v: float
) -> None:
    """
    Refuse the position of a free runner that stays exactly constant.

    Each ramp carries a free runner along, whatever the stand, so it cannot rest while the voltage
    falls repeatedly. Raises RecordingError in clear cases; the checks of a fit find the others.

    """
    observed = observed.without(lone_outliers(observed.values))
    still = _still(observed, drive, gain_m_per_v)
    if still is not None:
        falls, first, last = still
        problem = (
            f'has a {observed.quantity} of exactly {observed.values[first]:.6g} m over {falls} '
            f'falls of the voltage, {begins_s + observed.time_s[first]:.6g} to '
            f'{begins_s + observed.time_s[last]:.6g} s: its sensor is at a limit, or has stopped'
        )
        hint = 'choose a window without these: --window LENGTH@START'
        raise RecordingError(origin, problem, hint)


def _still(observed: Readout, drive: Voltage, gain_m_per_v: float) -> tuple[int, int, int] | None:
    """Return falls, first and last reading of an impossible rest of a free runner, or None."""
    time_s, place_m = observed.time_s, observed.values
    changes = np.flatnonzero(np.diff(place_m))
    starts, ends = np.append(0, changes + 1), np.append(changes, len(place_m) - 1)
    longest = int(np.argmax(time_s[ends] - time_s[starts]))
    first, last = int(starts[longest]), int(ends[longest])
    moves = slice(first) if first > len(place_m) - last else slice(last, None)
    moving = replace(observed, values=place_m[moves], time_s=time_s[moves])
    falls_s, heights_v = falls_of(drive)
    falls_s = falls_s + lateness_of(moving, drive).clear_s
    digit_m = math.sqrt(12.0) * rounding_of(place_m)
    is_large = np.abs(heights_v) * gain_m_per_v >= _DIGITS_MIN * digit_m
    is_over = (falls_s > time_s[first]) & (falls_s < time_s[last])
    falls = np.count_nonzero(is_large & is_over)
    is_still = falls >= _STILL_FALLS and last - first >= _STILL_READINGS * falls
    return (falls, first, last) if is_still else None
