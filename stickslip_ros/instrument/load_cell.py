"""The load cell: true force in its spring in, reading out, with all its errors."""

import math
from typing import NamedTuple

import numpy as np

from stickslip_ros.contact.kernel import entry_point
from stickslip_ros.contact.profile import Array
from stickslip_ros.contact.repeated import Repeated
from stickslip_ros.instrument.display import (
    LOAD_CELL_STREAM,
    Fault,
    displayed,
    fault_of,
    standing,
)
from stickslip_ros.instrument.filters import Swing, low_pass_gain, swing, swing_of
from stickslip_ros.instrument.play import PLAYS, Loop, follow, loop_of
from stickslip_ros.parameters import FaultParameters, LoadCellParameters, Parameters


class Cell(NamedTuple):
    """
    Constants of a load cell.

    Attributes
    ----------
    loop : Loop
        Its hysteresis; ``loop.weight`` is 0 where it has none.
    noise : float
        Standard deviation of the white noise of one sample, N.
    gain : float
        Share of the way that the low-pass goes to its input in one sample.
    swing : Swing
        Its own resonance, in place of the low-pass.
    swings : float
        1 with its own resonance, 0 with the low-pass.
    drift : float
        Drift of the zero in one sample, N.
    limit : float
        Force at which it saturates, N; inf is none.
    resolution : float
        Quantisation step, N; 0 is none.

    """

    loop: Loop
    noise: float
    gain: float
    swing: Swing
    swings: float
    drift: float
    limit: float
    resolution: float


class Strain(NamedTuple):
    """
    State of a load cell between two samples of the trace.

    Attributes
    ----------
    level, speed : float
        Output of the low-pass, N, and how fast it changes, in the unit of ``filters.Swing``.
    standing : float
        Value behind the display, before the tare is subtracted, N.
    overrange : float
        1 if a sample of the last block reached the limit, else 0.

    """

    level: float = 0.0
    speed: float = 0.0
    standing: float = 0.0
    overrange: float = 0.0


class LoadCell:
    """
    Turn true forces into readings, sample by sample.

    Parameters
    ----------
    parameters : Parameters
        The stand; it uses ``load_cell``, ``trace.sample_rate`` and ``sim.seed``.

    Notes
    -----
    In this order: hysteresis, white noise, own resonance or low-pass, drift of the zero, faults,
    saturation, tare, quantisation. docs/sensors.md has the formulas.

    """

    def __init__(self, parameters: Parameters) -> None:
        self._cell = _cell_of(parameters.load_cell, parameters.trace.sample_rate)
        self._read = Repeated(read_forces, records=3)
        self._seed = parameters.sim.seed
        self._plays = np.zeros(PLAYS)
        self.reset()

    def reset(self) -> None:
        """Go back to the start: at rest without force, no tare, the same noise again."""
        self._noise = np.random.default_rng((self._seed, LOAD_CELL_STREAM))
        self._plays.fill(0.0)
        self._samples = 0
        self._strain = Strain()
        self._tare_n = 0.0

    def tare(self) -> None:
        """Make the present reading 0."""
        self._tare_n = self._strain.standing

    @property
    def overrange(self) -> bool:
        """Whether a sample of the last block reached the end of the range."""
        return self._strain.overrange > 0.0

    def read(self, truth: Array, fault: FaultParameters) -> Array:
        """
        Return the readings of consecutive true forces.

        Parameters
        ----------
        truth : array, shape (samples,)
            True forces in the spring of the load cell, N, one per sample of the trace.
        fault : FaultParameters
            What is broken during these samples.

        Returns
        -------
        array, shape (samples,)
            Readings, N; not a number where the sensor dropped out.

        """
        readings = self._noise.standard_normal(len(truth))
        self._strain = self._read(
            self._cell,
            fault_of(fault.load_cell, fault.load_cell_offset),
            self._strain,
            self._tare_n,
            self._samples,
            np.array(truth, dtype=float),
            self._plays,
            readings,
        )
        self._samples += len(truth)
        return readings


def _cell_of(setting: LoadCellParameters, rate_hz: float) -> Cell:
    swings = setting.resonance > 0.0
    return Cell(
        loop=loop_of(setting.hysteresis, setting.range),
        noise=setting.noise_density * math.sqrt(rate_hz / 2.0),
        gain=low_pass_gain(setting.bandwidth, rate_hz),
        swing=swing_of(setting.resonance, setting.damping_ratio, rate_hz),
        swings=float(swings),
        drift=setting.drift / rate_hz,
        limit=setting.range if setting.range > 0.0 else math.inf,
        resolution=setting.resolution,
    )


@entry_point
def read_forces(
    cell: Cell,
    fault: Fault,
    strain: Strain,
    tare_n: float,
    samples: int,
    truth: Array,
    plays: Array,
    readings: Array,
) -> Strain:
    """
    Replace unit noise in ``readings`` by readings of ``truth``; return the state after them.

    Parameters
    ----------
    cell, fault, strain
        Constants, what is broken, and state before.
    tare_n : float
        Value that is shown as 0, N.
    samples : int
        Number of samples of the trace before these.
    truth, readings : array, shape (samples,)
        True forces, N; unit noise, replaced by readings, N.
    plays : array
        Plays of the hysteresis, N; changed in place.

    """
    level, speed, value, overrange = strain.level, strain.speed, strain.standing, 0.0
    for i in range(len(truth)):
        force = truth[i]
        if cell.loop.weight > 0.0:
            force = follow(cell.loop, plays, force)
        force += cell.noise * readings[i]
        if cell.swings > 0.0:
            level, speed = swing(cell.swing, level, speed, force)
        else:
            level += cell.gain * (force - level)
        sensed = level + cell.drift * (samples + i + 1) + fault.offset
        if abs(sensed) >= cell.limit:
            sensed = math.copysign(cell.limit, sensed)
            overrange = 1.0
        value = standing(fault, value, sensed)
        readings[i] = displayed(fault, value, tare_n, cell.resolution)
    return Strain(level, speed, value, overrange)
