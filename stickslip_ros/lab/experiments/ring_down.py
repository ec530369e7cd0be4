# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The ring-down of a runner on its contacts after a step: frequency and decay."""

import math
from typing import NamedTuple

import numpy as np
from scipy import optimize

from stickslip_ros.arrays import Array
from stickslip_ros.lab.experiments.experiment import Voltage, VoltageStep, stroke_m
from stickslip_ros.parameters import Parameters

_REST_S, _SEEN_S = 1e-4, 2e-3  # before the step, and after it: 10 to 30 periods of a runner
LEAST_M = 1e-18  # range of a runner at rest
FINE = 1e-12  # relative change that ends a search: slopes are differences of its results


class RingDown(NamedTuple):
    """Frequency and decay time of a ring-down."""

    ringing_hz: float
    decay_s: float  # to 1/e


def voltage_of_step(step: VoltageStep, stand: Parameters) -> Voltage:
    """Return the voltage of a step down, from rest, as fast as the amplifier falls."""
    low_v = stand.amplifier.voltage_min
    high_v = low_v + stroke_m(step, stand) / stand.actuator.gain
    fall_s = (high_v - low_v) / stand.amplifier.slew_rate
    rows = (0.0, high_v), (_REST_S, high_v), (_REST_S + fall_s, low_v), (_REST_S + _SEEN_S, low_v)
    return Voltage(np.array(rows))


def ring_down(time_s: Array, position_m: Array) -> RingDown:
    """Fit a damped cosine to positions at even times, shape (n,); rest and drift are free."""
    since_s, sample_s = time_s - time_s[0], float(time_s[1] - time_s[0])

    def missed(place: Array) -> Array:
        phase, fallen = math.exp(place[0]) * since_s, np.exp(-math.exp(place[1]) * since_s)
        columns = fallen * np.cos(phase), fallen * np.sin(phase), np.ones_like(since_s), since_s
        basis = np.linalg.qr(np.column_stack(columns))[0]
        return np.asarray(scaled - basis @ (basis.T @ scaled))

    scaled = (position_m - position_m.mean()) / max(float(np.ptp(position_m)), LEAST_M)
    # The velocity has neither rest nor drift: its spectrum gives the first frequency.
    power = np.abs(np.fft.rfft(np.diff(scaled) * np.hanning(len(scaled) - 1), 8 * len(scaled)))
    rate = 2.0 * math.pi * max(int(np.argmax(power)), 1) / (8 * len(scaled) * sample_s)
    lasts_s = float(since_s[-1])
    bounds = np.log(((math.pi / lasts_s, 1e-3 / lasts_s), (math.pi / sample_s, 1.0 / sample_s)))
    ends = [
        optimize.least_squares(
            missed,
            np.clip(np.log((rate, share * rate)), *bounds),
            bounds=bounds,
            xtol=FINE,
            ftol=FINE,
        )
        for share in (0.01, 0.1)  # first decay per rate: the true one may be far off
    ]
    best = min(ends, key=lambda end: float(end.cost))
    return RingDown(math.exp(best.x[0]) / (2.0 * math.pi), math.exp(-best.x[1]))
