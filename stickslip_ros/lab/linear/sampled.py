# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The linear drive at the sampling times of a controller."""

import math
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm

from stickslip_ros.arrays import Array
from stickslip_ros.errors import OutOfRange
from stickslip_ros.instrument.sensors.interferometer import ON_TIME
from stickslip_ros.instrument.sensors.signal_chain import low_pass_gain
from stickslip_ros.parameters import Parameters
from stickslip_ros.units import NANO

LASTING = 1e-9  # motion that decays by less per period is not at rest; creep loses 1e-6
DOUBLINGS = 36  # doublings of a sum over periods: decaying motion is gone by then


class StateSpace(NamedTuple):
    """Next state (or, in continuous time, rate) A x + B u, output C x + D u."""

    A: Array
    B: Array
    C: Array
    D: Array


def zero_order_hold(system: StateSpace, dt_s: float) -> StateSpace:
    """Discretise a continuous system with zero-order hold, exact at the samples."""
    n, inputs = system.B.shape
    over_period = expm(dt_s * np.block([[system.A, system.B], [np.zeros((inputs, n + inputs))]]))
    return StateSpace(over_period[:n, :n], over_period[:n, n:], system.C, system.D)


def read(system: StateSpace, dt_s: float, parameters: Parameters) -> StateSpace:
    """
    Discretise a system whose first output the interferometer reads, once per period.

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
    step = zero_order_hold(system, sample_s)
    gain = low_pass_gain(setting.bandwidth, 1.0 / sample_s)
    n, inputs = step.B.shape
    once: Array = np.eye(n + 1 + inputs)  # of state, level of the low-pass, inputs
    once[:n] = np.hstack((step.A, np.zeros((n, 1)), step.B))
    once[n] = gain * system.C[0] @ once[:n]
    once[n, n] = 1.0 - gain

    periods = math.ceil(lag / samples)
    whole, part = divmod(periods * samples - lag, 1.0)
    power: Array = np.linalg.matrix_power(once, int(whole))
    seen = power[n]
    if part:
        seen = (1.0 - part) * seen + part * (power @ once)[n]
    over_period = np.linalg.matrix_power(once, samples)
    m = n + 1
    next_state: Array = np.zeros((m + periods, m + periods + inputs))
    next_state[:m, :m], next_state[:m, m + periods :] = np.split(over_period[:m], [m], axis=1)
    if periods:
        next_state[m, :m], next_state[m, m + periods :] = np.split(seen, [m])
        next_state[m + 1 :, m : m + periods - 1] = np.eye(periods - 1)
    shown: Array = np.zeros((1, m + periods))
    shown[0, -1] = 1.0
    a, b = np.split(next_state, [m + periods], axis=1)
    return StateSpace(a, b, shown, np.zeros((1, inputs)))


def reduce_order(system: StateSpace, order: int, largest: Array) -> StateSpace:
    """
    Return a sampled system with fewer states, by balanced truncation (square-root method).

    ``largest``, shape (inputs,), weighs the inputs (Moore, IEEE Trans. Autom. Control 26, 1981).

    """
    slowest = float(np.abs(np.linalg.eigvals(system.A)).max())
    if slowest > 1.0 - LASTING:
        hint = 'set runner.damping: without it the runner rings for ever'
        raise OutOfRange('order', order, '', 'of a plant that does not come to rest', hint)
    if not 1 <= order <= len(system.A):
        limit = f'not from 1 to the number of states, {len(system.A)}'
        raise OutOfRange('order', order, '', limit, 'stay in these limits')
    moved = system.B * largest

    def root(a: Array, seen: Array) -> Array:
        total = seen @ seen.T
        for _ in range(DOUBLINGS):  # the sum of a^k total a^k.T
            total, a = total + a @ total @ a.T, a @ a
        squares, axes = np.linalg.eigh(total)
        half: Array = axes * np.sqrt(np.maximum(squares, 0.0))
        return half

    reached, shown = root(system.A, moved), root(system.A.T, system.C.T)
    left, weights, right = np.linalg.svd(shown.T @ reached)
    scale = 1.0 / np.sqrt(weights[:order])
    out, into = reached @ right[:order].T * scale, (shown @ left[:, :order] * scale).T
    return StateSpace(into @ system.A @ out, into @ system.B, system.C @ out, system.D)
