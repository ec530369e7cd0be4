"""The sensors of the stand together: truth in, readings out."""

import math

import numpy as np

from stickslip_ros.contact.profile import Array
from stickslip_ros.instrument.interferometer import Interferometer
from stickslip_ros.instrument.load_cell import LoadCell
from stickslip_ros.instrument.reports import FORCE, POSITION, Readings, Status, bits_of
from stickslip_ros.parameters import FaultParameters, Parameters

SENSOR_PRESENT, IS_REFERENCED = int(Status.SENSOR_PRESENT), int(Status.IS_REFERENCED)
BEAM_LOST, FORCE_OVERRANGE = int(Status.BEAM_LOST), int(Status.FORCE_OVERRANGE)


class Sensing:
    """
    Interferometer and load cell.

    Parameters
    ----------
    parameters : Parameters
        The stand.

    Attributes
    ----------
    position_m : float
        Mean position reading of the last block, m; not a number where there is none.

    """

    def __init__(self, parameters: Parameters) -> None:
        self.interferometer = Interferometer(parameters)
        self.load_cell = LoadCell(parameters)
        self.position_m = 0.0

    def reset(self) -> None:
        """Go back to the state at the start."""
        self.interferometer.reset()
        self.load_cell.reset()
        self.position_m = 0.0

    def zero_position(self) -> None:
        """Make the present position reading 0."""
        self.interferometer.zero()
        self.position_m = 0.0

    def read(
        self, trace: Array, time_ns: int, voltage_v: float, faults: FaultParameters
    ) -> Readings:
        """Replace true position and force in a trace by readings; return what is published."""
        truth_m, truth_n = float(trace[-1, POSITION]), float(trace[-1, FORCE])
        trace[:, POSITION] = self.interferometer.read(trace[:, POSITION], faults)
        trace[:, FORCE] = self.load_cell.read(trace[:, FORCE], faults)
        position_m = trace[:, POSITION]
        mean_m = float(np.add.reduce(position_m)) / len(position_m)
        self.position_m = math.nan if self.interferometer.beam_lost else mean_m
        return Readings(
            time_ns=time_ns,
            position_m=float(trace[-1, POSITION]),
            force_n=float(trace[-1, FORCE]),
            voltage_v=voltage_v,
            trace=trace,
            truth_position_m=truth_m,
            truth_force_n=truth_n,
        )

    @property
    def status_bits(self) -> int:
        """Bits of Status that sensors set."""
        return bits_of(
            (SENSOR_PRESENT, not math.isnan(self.position_m)),
            (IS_REFERENCED, self.interferometer.is_referenced),
            (BEAM_LOST, self.interferometer.beam_lost),
            (FORCE_OVERRANGE, self.load_cell.overrange),
        )
