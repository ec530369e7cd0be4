"""The amplifier: follows the commanded voltage within its range and its slew rate."""

import math

from stickslip_ros.contact.kernel import kernel
from stickslip_ros.drive.records import Plant

SETTLED_V = 1e-9
"""A gap smaller than this is rounding: half an attometre at the foot."""


@kernel
def clamp(plant: Plant, voltage_v: float) -> float:
    """Return the voltage nearest to the wanted one that the amplifier can give, V."""
    return min(max(voltage_v, plant.voltage_min_v), plant.voltage_max_v)


@kernel
def follow(
    plant: Plant, voltage_v: float, target_v: float, slope_v_per_s: float
) -> tuple[float, float, float]:
    """
    Return how the output runs on: voltage now (V), its rate (V/s), time until it changes (s).

    Parameters
    ----------
    plant : Plant
        Range and slew rate.
    voltage_v : float
        Output so far, V.
    target_v, slope_v_per_s : float
        Commanded voltage and its slope.

    """
    wanted_v = clamp(plant, target_v)
    gap_v = wanted_v - voltage_v
    slew = plant.slew_v_per_s
    if abs(gap_v) <= SETTLED_V:
        return wanted_v, min(max(slope_v_per_s, -slew), slew), math.inf
    rate_v_per_s = math.copysign(slew, gap_v)
    closing_v_per_s = rate_v_per_s - slope_v_per_s
    if closing_v_per_s * gap_v <= 0.0:
        return voltage_v, rate_v_per_s, math.inf
    return voltage_v, rate_v_per_s, gap_v / closing_v_per_s
