# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Synthetic measurements: the motion of a stand, and five points that are cheap to fit."""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from stickslip_ros.lab.experiments.experiment import Experiment, Readout, SawtoothSteps, Voltage
from stickslip_ros.lab.experiments.predict import predict
from stickslip_ros.lab.fitting.assumed import (
    ASSUMED_SHARES,
    CALIBRATIONS,
    FEET_NUMBER,
    LOAD_FACTOR,
)
from stickslip_ros.parameters import Parameters, Scalar

FREQUENCY_HZ = 2000.0
CYCLES = 400
"""Twice what the slowest of the points needs to be steady to 1e-9."""
SIGMA_N = 1e-3
TRUTH = {'contact.friction': 0.25, 'runner.damping': 80.0}
PRELOADS_N = (0.1,)
AMPLITUDES_M = (40e-9, 60e-9, 80e-9, 100e-9, 140e-9)
EXACT = dict.fromkeys((*ASSUMED_SHARES, *CALIBRATIONS, FEET_NUMBER, LOAD_FACTOR), '+-0%')
"""Constants of a rig whose contacts and feet are surely those of the stand."""


def motion_of(on: Parameters, rows: np.ndarray, noise_m: float = 0.0, seed: int = 1) -> Experiment:
    """Give the position of a free runner under a voltage, corners of shape (n, 2), at 50 kHz."""
    time_s = np.arange(0.0, rows[-1, 0], 2e-5)
    settings: dict[str, Scalar] = {
        'stand.preload': on.stand.preload,
        'load_cell.contact': 'absent',
    }
    blank = Readout('position_m', 0.0 * time_s, time_s)
    asked = Experiment('rig', settings, Voltage(rows), (blank,))
    [[shown]] = predict(on, [asked])
    noise = np.random.default_rng(seed).normal(0.0, noise_m, len(time_s))
    return dataclasses.replace(
        asked, observed=(dataclasses.replace(blank, values=shown.values + noise),)
    )


def steps_of(point: Experiment) -> SawtoothSteps:
    """Give the saw-tooth of a point."""
    assert isinstance(point.drive, SawtoothSteps)
    return point.drive


def exact_points(
    truth: Parameters,
    *,
    known: bool = True,
    preloads_n: Sequence[float] = PRELOADS_N,
    cycles: int = CYCLES,
    counted: bool = False,
) -> list[Experiment]:
    """Give the forces of a stand without noise, with or without their standard errors."""
    nothing = Readout('force_n', np.zeros(1), sigma=SIGMA_N if known else None)
    asked = [
        Experiment(
            '',
            {'stand.preload': preload_n},
            SawtoothSteps(amplitude_m, FREQUENCY_HZ, cycles),
            (nothing,),
        )
        for preload_n in preloads_n
        for amplitude_m in AMPLITUDES_M
    ]
    steps = cycles if counted else 0
    return [
        dataclasses.replace(
            one,
            drive=steps_of(one)._replace(steps=steps, is_steady=not counted),
            observed=(dataclasses.replace(nothing, values=found.values),),
        )
        for one, [found] in zip(asked, predict(truth, asked), strict=True)
    ]


def forces_n(points: Sequence[Experiment]) -> np.ndarray:
    """Give the forces of points."""
    return np.array([one.observed[0].values[0] for one in points])


def with_forces(
    points: Sequence[Experiment], force_n: np.ndarray, sigma_n: float | None
) -> list[Experiment]:
    """Give the points with other forces and errors."""
    return [
        dataclasses.replace(one, observed=(Readout('force_n', np.array([each]), sigma=sigma_n),))
        for one, each in zip(points, force_n, strict=True)
    ]


def noisy_points(
    truth: Parameters, seed: int, *, known: bool = True, sigma_n: float = SIGMA_N, **steps: Any
) -> list[Experiment]:
    """Give the forces of a stand with noise, perhaps after told steps."""
    points = exact_points(truth, known=known, **steps)
    noise_n = sigma_n * np.random.default_rng(seed).standard_normal(len(points))
    return with_forces(points, forces_n(points) + noise_n, sigma_n if known else None)
