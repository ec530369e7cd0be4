# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Delay of a sensor's clock, by the falls of the voltage, and its low-pass, by a model."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.stats import chi2

from stickslip_ros.arrays import Array
from stickslip_ros.lab.experiments.experiment import Experiment, Seen, Voltage
from stickslip_ros.lab.experiments.predict import predict
from stickslip_ros.parameters import Parameters

LATE_MAX_S = 0.05  # largest delay that is searched
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
_AROUND_S, _STEPS_S = 2e-4, (2e-5, 4e-6)
"""Range of the search for a delay with a model, and its steps, coarse and fine."""
_SLOW_S = (0.0, 4e-6, 8e-6, 1.6e-5, 3.2e-5, 6.4e-5, 1.28e-4, 2.56e-4, 5.12e-4)
"""Time constants of a sensor's low-pass to try with a model: 0 is none, 0.5 ms 310 Hz."""
_SURELY_SLOW = 20.0
"""Least fall of the squared differences, per mean of one, for a low-pass."""


class Lateness(NamedTuple):
    """The best delay of a sensor's clock by the falls of a voltage."""

    late_s: float
    is_clear: bool  # whether the clock is late rather than on time


def falls_of(voltage: Voltage) -> tuple[Array, Array]:
    """Return times, s, and heights, V, of the falls and fast rises of a voltage, shapes (n,)."""
    length_s, rise_v = np.diff(voltage.rows, axis=0).T
    is_fall = (length_s <= FALL_S) & (np.abs(rise_v) >= FALL_V)
    return voltage.rows[1:, 0][is_fall], rise_v[is_fall]


def lateness_of(seen: Seen, voltage: Voltage) -> Lateness | None:
    """
    Return the delay of readings against the voltage, to a sample; None without falls.

    At a fall the feet jerk, and the runner rings in the same way after each fall: the second
    differences of its readings, averaged over the falls, have the largest energy within RUNG_S if
    the clocks agree. Of similar lags the shortest counts. Nothing is assumed about the stand, nor
    that a larger fall makes a larger jerk. All of 32 rigs with 5 nm of noise and a clock up to
    4 ms late were found, 21 by the mean of the absolute differences. Nothing is clear with fewer
    than RUNG_MIN readings in the ringing, or if half of the falls come upon other falls.

    """
    seen = seen.averaged()  # second differences of faster readings show noise alone
    time_s, values = seen.time_s, seen.values
    falls_s, heights = falls_of(voltage)
    sample_s = float(np.median(np.diff(time_s)))
    if not len(falls_s) or len(values) < 16:
        return None
    ways = np.sign(heights)
    even_s = np.arange(time_s[0], time_s[-1], sample_s)
    jerk = np.diff(np.interp(even_s, time_s, values), 2, prepend=values[0], append=values[-1])
    jerk -= jerk.mean()
    lags = np.arange(-round(LATE_MAX_S / sample_s), round(LATE_MAX_S / sample_s) + 1)
    places = np.round((falls_s - even_s[0]) / sample_s).astype(np.intp)
    found = places + lags[:, np.newaxis]
    inside = (found >= 0) & (found < len(jerk))
    sums = np.where(inside, ways * jerk[np.clip(found, 0, len(jerk) - 1)], 0.0).sum(axis=1)
    counts = inside.sum(axis=1)  # more falls lie within the readings at some lags than at others
    seen_on_time = int(counts[len(lags) // 2]) or int(counts.max())
    sums[counts < ENOUGH_FALLS * seen_on_time] = 0.0
    variances = np.maximum(counts, 1) * max(float(np.mean(jerk**2)), 1e-300)
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
    found = lateness_of(experiment.seen[0], experiment.drive)
    rough_s = found.late_s if found is not None and found.is_clear else 0.0
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
    seen = experiment.seen[0]

    def missed(late_s: float, as_slow_s: float) -> float:
        one = replace(experiment, seen=(seen.sensed(late_s=late_s, slow_s=as_slow_s),))
        [[model]] = predict(stand, [one])
        return float(np.sum(np.diff(model.values - seen.values) ** 2))

    best = dict[float, tuple[float, float]]()  # misses and latenesses
    for as_slow_s in slow_s:
        middles_s, around_s = {rough_s, 0.0}, _AROUND_S
        for step_s in _STEPS_S:
            most = round(around_s / step_s)
            steps_s = step_s * np.arange(-most, most + 1)
            tried_s = np.add.outer(sorted(middles_s), steps_s).ravel().tolist()
            best[as_slow_s] = min((missed(each_s, as_slow_s), each_s) for each_s in tried_s)
            middles_s, around_s = {best[as_slow_s][1]}, step_s
    found_s = min(best, key=lambda each_s: best[each_s])
    least, at_once = best[found_s][0], best[0.0][0]
    if at_once - least < _SURELY_SLOW * least / len(seen.values):
        found_s = 0.0
    return best[found_s][1], found_s
