# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The linear drive as the interferometer reads it, at the sampling times of a controller."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stickslip_ros.arrays import Array
from stickslip_ros.errors import OutOfRange
from stickslip_ros.instrument.sensors.interferometer import ON_TIME
from stickslip_ros.instrument.sensors.signal_chain import low_pass_gain
from stickslip_ros.parameters import Parameters
from stickslip_ros.units import NANO

Complex = NDArray[np.complex128]
Matrices = tuple[Array, Array, Array, Array]  # A, B, C, D


def read(system: Any, dt_s: float, parameters: Parameters) -> tuple[Matrices, list[str]]:
    """
    Return a continuous system whose first output the interferometer reads, once per period.

    The low-pass runs at the samples of the trace. A reading that is d periods old, less a part of
    one, is formed from the state d periods ago, and delayed.

    """
    setting, sample_s = parameters.interferometer, parameters.sample_ns * NANO
    if setting.reference != 'table':
        limit = 'not the reference of the linear drive'
        raise OutOfRange('interferometer.reference', setting.reference, '', limit, "take 'table'")
    samples = round(dt_s / sample_s)
    own_s = 1.0 / setting.sample_rate if setting.sample_rate else 0
    for name, period_s in (('trace', sample_s), ('interferometer', own_s or dt_s)):
        share = dt_s / period_s % 1.0
        if samples < 1 or min(share, 1.0 - share) > ON_TIME * samples:
            limit = f'not a multiple of the period of {name}.sample_rate'
            raise OutOfRange('dt', dt_s, 's', limit, 'change one of them')
    lag = setting.latency / sample_s
    if own_s:
        lag = math.ceil(setting.latency / own_s - ON_TIME) * own_s / sample_s
    step, gain = system.sample(sample_s), low_pass_gain(setting.bandwidth, 1.0 / sample_s)
    n, inputs = step.B.shape
    m = n + 1
    once: Array = np.eye(m + inputs)  # of state, level of the low-pass, inputs
    once[:n] = np.hstack((step.A, np.zeros((n, 1)), step.B))
    once[n] = gain * step.C[0] @ once[:n]
    once[n, n] = 1.0 - gain
    periods = math.ceil(lag / samples)
    rows, states = np.linalg.matrix_power(once, samples)[:m], [*step.state_labels, 'reading_um']
    if periods:
        whole, part = divmod(periods * samples - lag, 1.0)
        level = np.linalg.matrix_power(once, int(whole))[n]
        rows = np.vstack((rows, (1.0 - part) * level + part * (level @ once)))
        states += [f'reading_{k}_um' for k in range(periods)]
    next_state: Array = np.eye(m + periods, k=-1)  # each delays the one before
    pushed: Array = np.zeros((m + periods, inputs))
    next_state[: len(rows)] = 0.0
    next_state[: len(rows), :m], pushed[: len(rows)] = np.split(rows, [m], axis=1)
    shown: Array = np.eye(1, m + periods, m + periods - 1)
    return (next_state, pushed, shown, np.zeros((1, inputs))), states
