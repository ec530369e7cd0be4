"""
How late the clock of a sensor is, and how slow the sensor.

The runner jerks where the voltage falls, whatever it is; a model's motion tells the rest.

"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.lab.experiments.experiment import Experiment, Seen, Voltage
from stickslip_ros.lab.experiments.predict import predict
from stickslip_ros.parameters import Parameters

LATE_MAX_S = 0.05  # beyond which a clock is not looked for
FALL_S, FALL_V = 5e-5, 1.0
"""A corner follows a fall if the voltage has changed by so much within so short a time."""
_CLEAR = 1.3
"""Times by which the best lag must beat that of two clocks that agree, to be believed."""
SEEN_MIN = 8.0
"""Standard errors of the mean of the falls that a jerk must be above, to be one: noise of 10 to
50 nm came to 5 at the best of 5,000 lags, rigs of 1.5 nm to 13 and more."""
ENOUGH_FALLS = 0.5
"""Share of the falls that lie within the readings at the best lag, which others must have too."""
ALIKE_FALLS = 0.9  # share of the largest average that a shorter lag may have
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
    score: float  # jerk at the falls, per jerk elsewhere
    score_at_0: float
    rival_s: float  # the next best lag
    rival_score: float
    falls: int

    @property
    def is_clear(self) -> bool:
        """Whether the clock is late rather than on time."""
        is_seen = self.score * math.sqrt(self.falls) > SEEN_MIN
        is_better = self.score > _CLEAR * max(self.score_at_0, 0.0)
        return abs(self.late_s) > LATE_MIN_S and is_seen and is_better

    @property
    def has_rival(self) -> bool:
        """Whether another lag is nearly as good."""
        return self.score < _CLEAR * self.rival_score


def lateness_of(seen: Seen, voltage: Voltage) -> Lateness | None:
    """
    Return by how much what was seen is late against the voltage; None without falls to go by.

    Where the voltage falls, the feet jerk and so does the runner: the absolute second difference
    of its readings, on average over the falls, is largest where the clocks agree; of lags that
    are alike the shortest counts. Nothing is assumed of the stand. To a sample; a fit finds the
    rest.

    """
    time_s, values = seen.time_s, seen.values
    length_s, rise_v = np.diff(voltage.rows, axis=0).T
    falls_s = voltage.rows[1:, 0][(length_s <= FALL_S) & (np.abs(rise_v) >= FALL_V)]
    sample_s = float(np.median(np.diff(time_s)))
    if not len(falls_s) or len(values) < 16:
        return None
    even_s = np.arange(time_s[0], time_s[-1], sample_s)
    jerk = np.abs(
        np.diff(np.interp(even_s, time_s, values), 2, prepend=values[0], append=values[-1])
    )
    jerk -= jerk.mean()
    lags = np.arange(-round(LATE_MAX_S / sample_s), round(LATE_MAX_S / sample_s) + 1)
    places = np.round((falls_s - even_s[0]) / sample_s).astype(np.intp)
    found = places + lags[:, np.newaxis]
    inside = (found >= 0) & (found < len(jerk))
    sums: Array = np.where(inside, jerk[np.clip(found, 0, len(jerk) - 1)], 0.0).sum(axis=1)
    counts = inside.sum(axis=1)  # more falls lie within the readings at some lags than at others
    is_enough = counts >= ENOUGH_FALLS * counts.max()
    score = np.where(is_enough, sums / np.maximum(counts, 1), 0.0) / max(float(jerk.std()), 1e-300)
    around = max(round(LATE_MIN_S / sample_s), 1)
    alike = np.flatnonzero(score >= ALIKE_FALLS * score.max())  # a wave that repeats has several
    least = int(alike[np.argmin(np.abs(lags[alike]))])
    best = int(np.argmax(np.where(np.abs(lags - lags[least]) <= around, score, -np.inf)))
    is_apart = np.abs(lags - lags[best]) > around
    rival = int(np.argmax(np.where(is_apart, score, -np.inf)))
    zero = float(score[np.abs(lags) <= around].max())
    return Lateness(
        float(lags[best] * sample_s),
        float(score[best]),
        zero,
        float(lags[rival] * sample_s),
        float(score[rival]),
        int(counts[best]),
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
