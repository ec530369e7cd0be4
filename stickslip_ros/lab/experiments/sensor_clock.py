# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The delay of a sensor's clock, by the falls of the voltage, and its low-pass, by a model.

Positions of a sensor that is at its limit are refused.

"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.stats import chi2

from stickslip_ros.arrays import Array
from stickslip_ros.errors import RecordingError
from stickslip_ros.lab.experiments.experiment import Experiment, Readout, Voltage
from stickslip_ros.lab.experiments.predict import predict
from stickslip_ros.lab.experiments.sensor import lone_outliers, rounding_of
from stickslip_ros.parameters import Parameters

LEAD_S = 0.05
"""Time that is run before a window, from rest, as contacts forget their start in a few steps; and
largest delay of a clock that is searched."""
FALL_S, FALL_V = 5e-5, 1.0
"""Longest duration of a fall or a fast rise, and its least height."""
RUNG_S, RUNG_MIN = 1.6e-4, 5
"""Ringing of a runner of a few grams after a fall, and the fewest readings that show it."""
_CLEAR = 1.3  # least ratio of the best lag's energy to that at 0
ALIKE_JERKS = 35.0 / 18.0
"""Sum of the squared autocorrelation of second differences of noise, 1, -2/3, 1/6: so many of them
count as one."""
CHANCE_MAX = 1e-4  # largest chance of as much energy from noise, over all lags
ENOUGH_FALLS = 0.5
"""Least share of the falls of a clock on time that lie within the readings at another lag (before
a window there may be more falls than in it), and that do not come upon other falls there: a whole
period of the drive is no delay."""
ALIKE_FALLS = 0.9  # share of the largest energy from which a shorter lag is preferred
LATE_MIN_S = 1e-4  # smaller delays are left to the model
_STEPS_S = 2e-5, 4e-6  # of delays to try with a model: ten to either side, then around the best
_SLOW_S = (0.0, *(4e-6 * 2.0 ** np.arange(8)).tolist())
"""Time constants of a sensor's low-pass to try with a model: 0 is none, 0.5 ms 310 Hz. Without
them a fit to a sensor of 1 kHz held with a gain 5 standard errors off."""
_SURELY_SLOW = 20.0
"""Least fall of the squared differences, per mean of one, for a low-pass."""
_STILL_FALLS, _STILL_READINGS = 3, 8
"""Falls of the voltage without a motion of a free runner, and readings for each."""
_DIGITS_MIN = 4.0  # least stroke of the feet that must show, in last digits of the sensor


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

    At a fall the feet jerk, and the runner rings in the same way after each fall: the second
    differences of its readings, averaged over the falls, have the largest energy within RUNG_S if
    the clocks agree. Of similar lags the shortest counts. Nothing is assumed about the stand, nor
    that a larger fall makes a larger jerk. All of 32 rigs with 5 nm of noise and a clock up to
    4 ms late were found, 21 by the mean of the absolute differences. Nothing is clear with fewer
    than RUNG_MIN readings in the ringing, or if half of the falls come upon other falls.

    """
    observed = observed.averaged()  # second differences of faster readings show noise alone
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
    counts = inside.sum(axis=1)  # more falls lie within the readings at some lags than at others
    seen_on_time = counts[most] or counts.max()
    sums[counts < ENOUGH_FALLS * seen_on_time] = 0.0
    variances = np.maximum(counts, 1) * (np.mean(jerk**2) or 1.0)
    after = max(round(RUNG_S / sample_s), 1)
    energy = np.convolve(sums**2 / variances, np.ones(after))[after - 1 :]
    around = max(round(LATE_MIN_S / sample_s), 1)
    similar = np.flatnonzero(energy >= ALIKE_FALLS * energy.max())  # several of a periodic wave
    least = int(similar[np.argmin(np.abs(lags[similar]))])
    best = int(np.argmax(np.where(np.abs(lags - lags[least]) <= around, energy, -np.inf)))
    near = np.add.outer(places, np.arange(-around, around + 1))
    others = float(np.mean(np.isin(places + lags[best], near)))  # all at 0
    chance = len(lags) * float(chi2.sf(energy[best] / ALIKE_JERKS, after / ALIKE_JERKS))
    is_better = energy[best] > _CLEAR * energy[np.abs(lags) <= around].max()
    is_clear = after >= RUNG_MIN and others < ENOUGH_FALLS and chance < CHANCE_MAX and is_better
    return Lateness(float(lags[best] * sample_s), bool(is_clear))


def lateness_in(experiment: Experiment, stand: Parameters) -> float:
    """Return the delay of the sensor of an experiment, s: by the falls, then by a model."""
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
    Return delay and time constant of a sensor, s, with which a model's motion agrees best.

    Delays near the rough one and near 0 are tried. Differences of neighbouring readings are
    compared: they hardly depend on the step length.

    """
    observed = experiment.observed[0]

    def missed(late_s: float, as_slow_s: float) -> float:
        one = replace(experiment, observed=(observed.sensed(late_s=late_s, slow_s=as_slow_s),))
        [[model]] = predict(stand, [one])
        return float(np.sum(np.diff(model.values - observed.values) ** 2))

    def best(as_slow_s: float) -> tuple[float, float]:
        middles_s, ends = {rough_s, 0.0}, list[tuple[float, float]]()
        for step_s in _STEPS_S:
            tried_s = np.add.outer(sorted(middles_s), step_s * np.arange(-10, 11)).ravel().tolist()
            ends.append(min((missed(each_s, as_slow_s), each_s) for each_s in tried_s))
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

    Each ramp carries a free runner along, whatever the stand: it cannot rest while the voltage
    falls repeatedly. Raises RecordingError in plain cases only; the checks of a fit find the
    others.

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
    """Return falls, first and last reading of the longest rest, if no free runner rests so."""
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
