# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The two curves of a Bode plot, in closed form: from voltage and from load to the position."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stickslip_ros.arrays import Array

Complex = NDArray[np.complex128]

LEAD_RAD = 0.1  # phases are lags but for rounding and creep; none leads by more


class BodeCurve(NamedTuple):
    """From one input to the position, in closed form at some frequencies."""

    source: str  # input, and its unit
    unit: str
    response: Complex  # in metres per unit, shape (n,)
    phase_rad: Array  # without jumps by a turn, shape (n,)

    def phase_deg(self, measured: Complex | None = None) -> Array:
        """Return the phase, or what was measured near it, in degrees."""
        if measured is None:
            return np.degrees(self.phase_rad)
        return np.degrees(self.phase_rad + np.angle(measured / self.response))


def curves_of(matrix: Complex) -> tuple[BodeCurve, BodeCurve]:
    """
    Return both curves of outputs over inputs, shape (n, outputs, inputs), as of a LinearDrive.

    The stages before the feet and the runner lag by less than a turn.

    """
    from_voltage, from_load = matrix[:, 0].T
    foot = matrix[:, 1, 0]
    lag_rad = _lag_rad(foot) + _lag_rad(from_voltage / foot)
    return (
        BodeCurve('voltage', 'V', from_voltage, lag_rad),
        BodeCurve('load', 'N', from_load, _lag_rad(from_load)),
    )


def _lag_rad(response: Complex) -> Array:
    lag_rad: Array = np.mod(LEAD_RAD - np.angle(response), 2.0 * np.pi)
    return LEAD_RAD - lag_rad
