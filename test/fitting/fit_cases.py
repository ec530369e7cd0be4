"""Synthetic measurements that are cheap to fit: five points, some milliseconds for all of them."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from stickslip_ros.fitting.problem import Points, force_course
from stickslip_ros.parameters import Parameters
from stickslip_ros.runs.courses import together

FREQUENCY_HZ = 2000.0
CYCLES = 400
"""Twice what the slowest of the points needs to be steady to 1e-9."""
SIGMA_N = 1e-3
TRUTH = {'contact.friction': 0.25, 'runner.damping': 80.0}
PRELOADS_N = (0.1,)
AMPLITUDES_M = (40e-9, 60e-9, 80e-9, 100e-9, 140e-9)


def exact_points(
    truth: Parameters,
    *,
    known: bool = True,
    preloads_n: Sequence[float] = PRELOADS_N,
    cycles: int = CYCLES,
) -> Points:
    """Give the forces of a stand without noise, with or without their standard errors."""
    preload_n = np.repeat(preloads_n, len(AMPLITUDES_M))
    amplitude_m = np.tile(AMPLITUDES_M, len(preloads_n))
    pairs = zip(preload_n.tolist(), amplitude_m.tolist(), strict=True)
    force_n = together(force_course(truth, *pair, FREQUENCY_HZ, cycles) for pair in pairs)
    return Points(
        preload_n=preload_n,
        amplitude_m=amplitude_m,
        frequency_hz=np.full(len(force_n), FREQUENCY_HZ),
        force_n=np.array(force_n),
        sigma_n=np.full(len(force_n), SIGMA_N) if known else None,
    )


def noisy_points(truth: Parameters, seed: int, *, known: bool = True) -> Points:
    """Give the forces of a stand with noise of SIGMA_N."""
    points = exact_points(truth, known=known)
    noise_n = SIGMA_N * np.random.default_rng(seed).standard_normal(len(points))
    return dataclasses.replace(points, force_n=points.force_n + noise_n)
