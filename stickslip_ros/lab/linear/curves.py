# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Bode curves in closed form: from voltage and from load to position."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stickslip_ros.arrays import Array

Complex = NDArray[np.complex128]

LEAD_RAD = 0.1  # largest lead, from rounding and creep; other phases lag


class BodeCurve(NamedTuple):
    """The response of the position to one input, in closed form."""

    source: str  # input
    unit: str
    response: Complex  # in metres per unit, shape (n,)
    phase_rad: Array  # without jumps by a turn, shape (n,)

    def phase_deg(self, measured: Complex | None = None) -> Array:
        """Return the phase in degrees, for a measured response the nearest turn."""
        if measured is None:
            return np.degrees(self.phase_rad)
        return np.degrees(self.phase_rad + np.angle(measured / self.response))


def curves_of(matrix: Complex) -> tuple[BodeCurve, BodeCurve]:
    """Return both curves of a matrix of shape (n, outputs, inputs); each lag is below one turn."""
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
