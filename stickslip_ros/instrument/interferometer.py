"""The laser interferometer: true position of the runner in, reading out, with all its errors."""

import math

import numpy as np

from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.repeated import Repeated
from stickslip_ros.instrument.display import (
    INTERFEROMETER_STREAM,
    NO_FAULT,
    fault_of,
)
from stickslip_ros.instrument.filters import low_pass_gain
from stickslip_ros.instrument.optics import Beam, Optics, read_positions
from stickslip_ros.parameters import FaultParameters, InterferometerParameters, Parameters

DRIFT_STREAM = 1
"""Number of the random walk below INTERFEROMETER_STREAM: it leaves the white noise alone."""


class Interferometer:
    """
    Turn true positions into readings, sample by sample.

    Parameters
    ----------
    parameters : Parameters
        The stand; it uses ``interferometer``, ``trace.sample_rate`` and ``sim.seed``.

    Notes
    -----
    In this order: loss of the beam, cyclic error, drift of the zero, white noise, low-pass,
    samples of its own, latency, faults, zero, quantisation. docs/sensors.md has the formulas.

    """

    def __init__(self, parameters: Parameters) -> None:
        self._optics = _optics_of(parameters.interferometer, parameters.trace.sample_rate)
        self._read = Repeated(read_positions, records=3)
        self._seed = parameters.sim.seed
        self._past = np.zeros(math.ceil(self._optics.lag) + 3)
        self.reset()

    def reset(self) -> None:
        """Go back to the start: at rest at zero, the beam found, the same noise again."""
        self._noise = np.random.default_rng((self._seed, INTERFEROMETER_STREAM))
        self._walk = np.random.default_rng((self._seed, INTERFEROMETER_STREAM, DRIFT_STREAM))
        self._past.fill(0.0)
        self._samples = 0
        self._beam = Beam()
        self._fault = NO_FAULT
        self._zero_m = 0.0
        self._is_referenced = False

    def zero(self) -> None:
        """Make the present reading 0; a lost beam is found, and the count starts anew here."""
        if self.beam_lost:
            self._find_beam()
        self._zero_m = self._beam.standing
        self._is_referenced = True

    @property
    def beam_lost(self) -> bool:
        """Whether the runner was too fast, so that the count stands still."""
        return self._beam.lost > 0.0

    @property
    def is_referenced(self) -> bool:
        """Whether the zero was set since the start or the last reset."""
        return self._is_referenced

    def read(self, truth: Array, fault: FaultParameters) -> Array:
        """
        Return the readings of consecutive true positions.

        Parameters
        ----------
        truth : array, shape (samples,)
            True positions of the runner, m, one per sample of the trace.
        fault : FaultParameters
            What is broken during these samples.

        Returns
        -------
        array, shape (samples,)
            Readings, m; not a number where the sensor dropped out.

        """
        readings = self._noise.standard_normal(len(truth))
        walks = self._walk.standard_normal(len(truth) if self._optics.walk > 0.0 else 0)
        self._fault = fault_of(fault.interferometer, fault.interferometer_offset)
        self._beam = self._read(
            self._optics,
            self._fault,
            self._beam,
            self._zero_m,
            self._samples,
            np.array(truth, dtype=float),
            walks,
            self._past,
            readings,
        )
        self._samples += len(truth)
        return readings

    def _find_beam(self) -> None:
        level_m = self._beam.level
        self._past.fill(level_m)
        self._beam = self._beam._replace(
            lost=0.0,
            counted=level_m,
            held=level_m,
            standing=level_m + self._fault.offset,
        )


def _optics_of(setting: InterferometerParameters, rate_hz: float) -> Optics:
    return Optics(
        step_max=setting.velocity_max / rate_hz if setting.velocity_max > 0.0 else math.inf,
        cyclic_error=setting.cyclic_error,
        fringe=4.0 * math.pi / setting.wavelength,
        drift=setting.drift / rate_hz,
        walk=setting.random_walk / math.sqrt(rate_hz),
        noise=setting.noise_density * math.sqrt(rate_hz / 2.0),
        gain=low_pass_gain(setting.bandwidth, rate_hz),
        period=rate_hz / setting.sample_rate if setting.sample_rate > 0.0 else 0.0,
        lag=setting.latency * rate_hz,
        resolution=setting.resolution,
    )
