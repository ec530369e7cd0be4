# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
How late the clock of a sensor is, and how slow the sensor.

The runner jerks where the voltage falls, whatever it is; a model's motion tells the rest.

"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.stats import chi2

from stickslip_ros.arrays import Array
from stickslip_ros.lab.experiments.experiment import Experiment, Seen, Voltage
from stickslip_ros.lab.experiments.predict import predict
from stickslip_ros.parameters import Parameters

LATE_MAX_S = 0.05  # beyond which a clock is not looked for
FALL_S, FALL_V = 5e-5, 1.0
"""A corner follows a fall if the voltage has changed by so much within so short a time."""
RUNG_S = 1.6e-4  # after a fall, in which a runner of a few grams rings
_CLEAR = 1.3
"""Times by which the best lag must beat that of two clocks that agree, to be believed."""
ALIKE_JERKS = 35.0 / 18.0
"""Sum of the squared autocorrelation of second differences of noise, 1, -2/3, 1/6: so many of them
count as one."""
CHANCE_MAX = 1e-4  # that noise shows so much at one of the lags, to be believed
ENOUGH_FALLS = 0.5
"""Share of the falls that lie within the readings of a clock on time, which others must have too:
before a window there may be more falls than in it."""
ALIKE_FALLS = 0.9  # share of the largest energy that a shorter lag may have
LATE_MIN_S = 1e-4  # what is less is left to the model's motion
_AROUND_S, _STEPS_S = 2e-4, (2e-5, 4e-6)
"""How far around a lateness is looked with a model, and in which steps, coarse and fine."""
_SLOW_S = (0.0, 4e-6, 8e-6, 1.6e-5, 3.2e-5, 6.4e-5, 1.28e-4, 2.56e-4, 5.12e-4)
"""Time constants of a sensor's low-pass that are tried with a model: 0 is none, 0.5 ms 310 Hz."""
_SURELY_SLOW = 20.0
"""Fall of the squared differences, per mean of one, from which a low-pass is believed."""


class Lateness(NamedTuple):
    """What the clock of a sensor is late, and how clearly that is seen."""

    late_s: float
    energy: float  # of what follows a fall on average, in variances of the noise of that average
    energy_at_0: float
    rival_s: float  # the next best lag
    rival_energy: float
    chance: float  # that noise has such an energy

    @property
    def is_clear(self) -> bool:
        """Whether the clock is late rather than on time."""
        is_better = self.energy > _CLEAR * self.energy_at_0
        return abs(self.late_s) > LATE_MIN_S and self.chance < CHANCE_MAX and is_better

    @property
    def has_rival(self) -> bool:
        """Whether another lag is nearly as good."""
        return self.energy < _CLEAR * self.rival_energy


def falls_of(voltage: Voltage) -> tuple[Array, Array]:
    """Return when a voltage has fallen, or risen as fast, and by how much, V."""
    length_s, rise_v = np.diff(voltage.rows, axis=0).T
    is_fall = (length_s <= FALL_S) & (np.abs(rise_v) >= FALL_V)
    return voltage.rows[1:, 0][is_fall], rise_v[is_fall]


def lateness_of(seen: Seen, voltage: Voltage) -> Lateness | None:
    """
    Return by how much what was seen is late against the voltage; None without falls to go by.

    Where the voltage falls, the feet jerk, and the runner rings after it in the same way after
    each fall: the second differences of its readings, averaged over the falls, have the largest
    energy within RUNG_S where the clocks agree, and the average takes noise away. Of lags that are
    alike the shortest counts. Nothing is assumed of the stand, nor that a larger fall makes a
    larger jerk: a runner that slips hardly feels how far. To a sample; a fit finds the rest.
    Of 32 rigs with 5 nm of noise and a clock up to 4 ms late all were found, by the mean of the
    absolute differences 21.

    """
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
    alike = np.flatnonzero(energy >= ALIKE_FALLS * energy.max())  # a wave that repeats has several
    least = int(alike[np.argmin(np.abs(lags[alike]))])
    best = int(np.argmax(np.where(np.abs(lags - lags[least]) <= around, energy, -np.inf)))
    is_apart = np.abs(lags - lags[best]) > around
    rival = int(np.argmax(np.where(is_apart, energy, -np.inf)))
    return Lateness(
        float(lags[best] * sample_s),
        float(energy[best]),
        float(energy[np.abs(lags) <= around].max()),
        float(lags[rival] * sample_s),
        float(energy[rival]),
        len(lags) * float(chi2.sf(energy[best] / ALIKE_JERKS, after / ALIKE_JERKS)),
    )


def lateness_in(experiment: Experiment, stand: Parameters) -> float:
    """Return how late the clock of what was seen is, s: by the falls, then by a model's motion."""
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
    Return with which lateness and slowness, s, a model moves most alike from reading to reading.

    The differences from one reading to the next do not see steps that are too long or too short.

    """
    seen = experiment.seen[0]

    def missed(late_s: float, as_slow_s: float) -> float:
        one = replace(experiment, seen=(replace(seen, slow_s=as_slow_s),))
        [[model]] = predict(stand, [one], shifts_s=(late_s,))
        return float(np.sum(np.diff(model.values - seen.values) ** 2))

    best = dict[float, tuple[float, float]]()  # misses and latenesses
    for as_slow_s in slow_s:
        late_s, around_s = rough_s, _AROUND_S
        for step_s in _STEPS_S:
            most = round(around_s / step_s)
            tried_s = (late_s + step_s * np.arange(-most, most + 1)).tolist()
            best[as_slow_s] = min((missed(each_s, as_slow_s), each_s) for each_s in tried_s)
            late_s, around_s = best[as_slow_s][1], step_s
    found_s = min(best, key=lambda each_s: best[each_s])
    least, at_once = best[found_s][0], best[0.0][0]
    if at_once - least < _SURELY_SLOW * least / len(seen.values):
        found_s = 0.0
    return best[found_s][1], found_s
