"""The controller itself, without ROS: a discrete linear system, reading by reading."""

import numpy as np

DT_S = 1e-3
"""From one reading to the next: sim.block of the drive."""
INTEGRAL = ([[1.0]], [[1.0]], [[450.0]], [[450.0]])
"""A, B, C, D of the controller that was designed, from um to V: 450 V/um more in each period."""


class ScanController:
    """
    A linear system whose output is limited; where it is, its state stands still.

    The system is A, B, C, D, or a StateSpace of python-control.

    """

    def __init__(self, system=INTEGRAL, low_v=0.0, high_v=300.0):
        if hasattr(system, 'A'):
            system = system.A, system.B, system.C, system.D
        self.system = [np.asarray(each, dtype=float) for each in system]
        self.state = np.zeros(len(self.system[0]))
        self.low_v, self.high_v = low_v, high_v

    def update(self, error_um):
        """Return the voltage, V, that answers a reading: target minus position, um."""
        a, b, c, d = self.system
        wanted_v = float((c @ self.state + d[:, 0] * error_um).item())
        voltage_v = min(max(wanted_v, self.low_v), self.high_v)
        if voltage_v == wanted_v:
            self.state = a @ self.state + b[:, 0] * error_um
        return voltage_v
