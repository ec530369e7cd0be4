# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Sensors for tests: with one error at a time, or with all of them."""

from collections.abc import Mapping

import numpy as np
from bench_runs import PERFECT

from stickslip_ros.drive.records import FORCE, POSITION
from stickslip_ros.instrument.reports import Status
from stickslip_ros.instrument.sensing import Sensing
from stickslip_ros.parameters import FaultParameters, Parameters

RATE_HZ = 50e3
HEALTHY = FaultParameters()
SIGMAS = 5.0
"""Standard errors by which an estimate from noise may be off; the seed is fixed."""
ROUNDING = 1e-12
"""A few dozen operations on doubles."""

SENSORS = {'interferometer': POSITION, 'load_cell': FORCE}
"""Columns of the trace that the sensors read."""
EVERYTHING = {
    'interferometer.sample_rate': 17e3,
    'interferometer.latency': 1.23e-4,
    'interferometer.cyclic_error': 2e-9,
    'interferometer.drift': 3e-6,
    'interferometer.random_walk': 1e-8,
    'interferometer.velocity_max': 0.04,
    'load_cell.hysteresis': 0.05,
    'load_cell.range': 0.3,
    'load_cell.drift': 0.2,
}
"""Each error large enough to be seen in a few hundred samples."""


def broken(**faults: object) -> FaultParameters:
    """Return faults by their names."""
    return Parameters().updated({f'fault.{name}': value for name, value in faults.items()}).fault


class Sensor(Sensing):
    """One of both sensors; the other one reads zeros."""

    def __init__(self, name: str, parameters: Parameters) -> None:
        super().__init__(parameters)
        self._column = SENSORS[name]

    def readings(self, truth: np.ndarray, faults: FaultParameters) -> np.ndarray:
        """Return the readings of consecutive true values."""
        trace = np.zeros((len(truth), FORCE + 1))
        trace[:, self._column] = truth
        if len(truth):
            self.read(trace, 0, faults)
        return trace[:, self._column]

    @property
    def beam_lost(self) -> bool:
        return bool(self.status_bits & Status.BEAM_LOST)

    @property
    def overrange(self) -> bool:
        return bool(self.status_bits & Status.FORCE_OVERRANGE)

    @property
    def is_referenced(self) -> bool:
        return bool(self.status_bits & Status.IS_REFERENCED)


def sensor_with(name: str, settings: Mapping[str, object]) -> Sensor:
    """Return a sensor that has no errors but those of ``settings``."""
    values = {**PERFECT, 'trace.sample_rate': RATE_HZ, **settings}
    return Sensor(name, Parameters().updated(values))


def interferometer_with(**settings: float) -> Sensor:
    """Return an interferometer that has no errors but the given ones."""
    return sensor_with('interferometer', {f'interferometer.{k}': v for k, v in settings.items()})


def load_cell_with(**settings: float) -> Sensor:
    """Return a load cell that has no errors but the given ones."""
    return sensor_with('load_cell', {f'load_cell.{k}': v for k, v in settings.items()})


def sensor_with_everything(name: str, changes: Mapping[str, float] | None = None) -> Sensor:
    """Return a sensor with all of its errors at once, but for some changes."""
    settings = {'trace.sample_rate': RATE_HZ, **EVERYTHING, **(changes or {})}
    return Sensor(name, Parameters().updated(settings))


def shaken(name: str, samples: int) -> np.ndarray:
    """Return a truth that loses the beam, or overloads the cell, in its second half."""
    phase = np.arange(1, samples + 1) / samples
    swing = np.sin(17.0 * phase) + 0.3 * np.sin(101.0 * phase)
    if name == 'load_cell':
        return 0.6 * phase * swing
    return 1e-6 * swing + 1e-5 * (phase > 0.6)


def times(samples: int) -> np.ndarray:
    """Return the times of the first samples of the trace, s."""
    return np.arange(1, samples + 1) / RATE_HZ
