"""
Kernel: a straight stretch of the voltage through the whole drive, in short steps.

For everything that long steps cannot do: a rounded voltage, a piezo that is not linear, feet that
differ, a runner that is stuck. Steps are so short that the feet cross the presliding range in many
of them, however fast they are; how fast they can be is known beforehand, so the steps are chosen,
not tried.

"""

import math

from stickslip_ros.contact.kernel import kernel, kernel_apart
from stickslip_ros.contact.record import Record
from stickslip_ros.drive.amplifier import clamp
from stickslip_ros.drive.glide import longest_on_slope
from stickslip_ros.drive.passes import may_pass
from stickslip_ros.drive.piezo import fastest_m_per_s
from stickslip_ros.drive.plant import VERLET_REFINEMENT, pace_of, step
from stickslip_ros.drive.records import ALL

CROSSING_S = 3.2e-4
"""Feet that are rounded off, or ring, go at most sim.dt/CROSSING_S of the presliding range in one
step: a 64th of it at the default of 5 us."""
CROSSING_STEPS_MIN = 16.0
"""Steps in which they cross it, at least."""
BURST = 16
"""Steps of one length before the next length is chosen."""
STEP_SLACK = 1e-9
"""Share of a step by which a stretch may exceed a whole number of steps, for rounding."""


@kernel_apart
def ride_through(
    plant: Record,
    state: Record,
    start_v: float,
    rate_v_per_s: float,
    load_n: float,
    stretch_s: float,
) -> None:
    """Advance along a straight stretch of the voltage before the low-pass."""
    state.places_m[ALL] = state.foot_m
    left_s, input_v = stretch_s, start_v
    while left_s > 0.0 and may_pass(state):
        dt_s, steps, left_s = _burst(plant, state, input_v, rate_v_per_s, left_s)
        pace = pace_of(plant, state, dt_s)
        from_v = clamp(plant, input_v)
        for i in range(1, steps + 1):
            to_v = clamp(plant, input_v + rate_v_per_s * (i * dt_s))
            step(plant, state, from_v, to_v, load_n, pace)
            from_v = to_v
        input_v = clamp(plant, start_v + rate_v_per_s * (stretch_s - left_s))
        state.piezo.slewed_v = input_v


@kernel
def _burst(
    plant: Record, state: Record, input_v: float, rate_v_per_s: float, left_s: float
) -> tuple[float, int, float]:
    """Return length and number of the next equal steps, and the time that is left after them."""
    if plant.ideal and abs(rate_v_per_s) >= plant.slew_v_per_s:
        longest_s = longest_on_slope(plant, rate_v_per_s)
    else:
        longest_s = _longest_in_burst(plant, state, input_v, rate_v_per_s)
    steps = max(1, math.ceil(VERLET_REFINEMENT * left_s / longest_s - STEP_SLACK))
    dt_s = left_s / steps
    if plant.ideal or steps <= BURST:
        return dt_s, steps, 0.0
    return dt_s, BURST, left_s - BURST * dt_s


@kernel
def _longest_in_burst(plant: Record, state: Record, input_v: float, rate_v_per_s: float) -> float:
    """Return the longest step that resolves what the mean foot does next, however fast, s."""
    fastest_v_per_s = abs(rate_v_per_s)
    if plant.amplifier.tau_s > 0.0:
        fastest_v_per_s += abs(input_v - state.voltage_v) / plant.amplifier.tau_s
    speed_m_per_s = fastest_m_per_s(plant, state.piezo, fastest_v_per_s)
    share = min(plant.dt_s / CROSSING_S, 1.0 / CROSSING_STEPS_MIN)
    travel_m = VERLET_REFINEMENT * share * plant.contacts[ALL].curve.limit_m
    if speed_m_per_s * plant.dt_s <= travel_m:
        return plant.dt_s
    return travel_m / speed_m_per_s
