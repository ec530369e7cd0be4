"""A sensor: white noise, a first-order low-pass, quantisation, and a generator of its own."""

import math
from typing import NamedTuple

import numpy as np

from stickslip_ros.contact.kernel import kernel
from stickslip_ros.contact.profile import Array
from stickslip_ros.parameters import InterferometerParameters, LoadCellParameters, Parameters

INTERFEROMETER_STREAM, LOAD_CELL_STREAM = 1, 2
"""Numbers of the random streams: sensors never share noise."""


class SensorSetup(NamedTuple):
    """
    Constants of a sensor.

    Attributes
    ----------
    noise : float
        Standard deviation of the noise of one sample, in the unit of the reading.
    gain : float
        Share of the way that the low-pass goes to its input in one sample; 1 is no low-pass.
    resolution : float
        Quantisation step, in the unit of the reading; 0 is none.

    """

    noise: float
    gain: float
    resolution: float


class Sensor:
    """
    Turn true values into readings, sample by sample.

    Parameters
    ----------
    noise_density : float
        One-sided density of the white noise, unit/sqrt(Hz).
    bandwidth_hz : float
        Corner frequency of the low-pass, Hz; 0 is none.
    resolution : float
        Quantisation step, unit; 0 is none.
    sample_rate_hz : float
        Rate of the samples, Hz.
    seed : tuple of int
        Seed of the noise.

    Notes
    -----
    Noise of density n sampled at f_s has the standard deviation n sqrt(f_s/2). It passes the
    low-pass with the signal. The low-pass y' = 2 pi f_c (x - y) is solved exactly for an input
    that is constant between two samples. The order is noise, low-pass, quantisation.

    """

    def __init__(
        self,
        noise_density: float,
        bandwidth_hz: float,
        resolution: float,
        sample_rate_hz: float,
        seed: tuple[int, ...],
    ) -> None:
        decay = math.exp(-2.0 * math.pi * bandwidth_hz / sample_rate_hz)
        self.setup = SensorSetup(
            noise=noise_density * math.sqrt(sample_rate_hz / 2.0),
            gain=1.0 - decay if bandwidth_hz > 0.0 else 1.0,
            resolution=resolution,
        )
        self._seed = seed
        self.reset()

    def reset(self) -> None:
        """Go back to the start: a settled low-pass at zero, the same noise again."""
        self._random = np.random.default_rng(self._seed)
        self._level = 0.0

    def read(self, truth: Array) -> Array:
        """Return the readings of consecutive true values, shape (samples,)."""
        readings = self._random.standard_normal(len(truth))
        self._level = read_samples(self.setup, self._level, truth, readings)
        return readings


def interferometer(parameters: Parameters) -> Sensor:
    """Return the laser interferometer: true position of the runner to reading, m."""
    return _sensor(parameters.interferometer, parameters, INTERFEROMETER_STREAM)


def load_cell(parameters: Parameters) -> Sensor:
    """Return the load cell: force in its spring to reading, N."""
    return _sensor(parameters.load_cell, parameters, LOAD_CELL_STREAM)


def _sensor(
    setting: InterferometerParameters | LoadCellParameters, parameters: Parameters, stream: int
) -> Sensor:
    return Sensor(
        setting.noise_density,
        setting.bandwidth,
        setting.resolution,
        parameters.trace.sample_rate,
        (parameters.sim.seed, stream),
    )


@kernel
def read_samples(setup: SensorSetup, level: float, truth: Array, readings: Array) -> float:
    """Replace unit noise in ``readings`` by readings of ``truth``; return the filter's level."""
    for i in range(len(truth)):
        level += setup.gain * (truth[i] + setup.noise * readings[i] - level)
        if setup.resolution > 0.0:
            readings[i] = np.rint(level / setup.resolution) * setup.resolution
        else:
            readings[i] = level
    return level
