# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Monitors of an amplifier, made in plain numpy: a wave by its corners, and samples of it."""

from collections.abc import Sequence

import numpy as np

SLEW_V_PER_S = 150e6
Part = tuple[str, float, float, int]
"""``('hold', s, 0, 0)``, ``('saw', amplitude V, hertz, cycles)`` or ``('to', volts, s, 0)``."""


def hold(seconds: float) -> Part:
    return 'hold', seconds, 0.0, 0


def saw(amplitude_v: float, frequency_hz: float, cycles: int) -> Part:
    return 'saw', amplitude_v, frequency_hz, cycles


def ramp(volts: float, seconds: float) -> Part:
    return 'to', volts, seconds, 0


def corners_of(parts: Sequence[Part]) -> np.ndarray:
    """Give rows of time and voltage from 0 V; falls end, fast rises begin, where cycles do."""
    rows = [(0.0, 0.0)]
    for kind, first, second, cycles in parts:
        start_s, start_v = rows[-1]
        if kind == 'hold':
            rows.append((start_s + first, start_v))
        elif kind == 'to':
            rows.append((start_s + second, first))
        fall_s = first / SLEW_V_PER_S
        for cycle in range(cycles):
            begin_s, end_s = (start_s + number / abs(second) for number in (cycle, cycle + 1))
            top_s = end_s - fall_s if second > 0.0 else begin_s + fall_s
            rows += [(top_s, start_v + first), (end_s, start_v)]
    return np.array(rows)


def sampled(
    corners: np.ndarray,
    rate_hz: float,
    noise_v: float,
    seed: int,
    *,
    jitter_s: float = 0.0,
    late_s: float = 0.0,
    dropped: float = 0.0,
    gaps_s: Sequence[tuple[float, float]] = (),
) -> tuple[np.ndarray, np.ndarray]:
    """
    Give times and volts of samples.

    Jitter is that of the sampling, late are stamps of samples that were taken in time.

    """
    random = np.random.default_rng(seed)
    times = np.arange(random.random() / rate_hz, corners[-1, 0], 1.0 / rate_hz)
    times = np.sort(times + jitter_s * random.standard_normal(len(times)))
    volts = np.interp(times, *corners.T) + noise_v * random.standard_normal(len(times))
    times = times + late_s * random.standard_normal(len(times))
    kept = random.random(len(times)) >= dropped
    for start_s, end_s in gaps_s:
        kept &= (times < start_s) | (times > end_s)
    return times[kept], volts[kept]
