"""
Kernel: a straight stretch of the voltage through amplifier and piezo, in short steps.

For everything that long steps cannot do: a rounded voltage, a piezo that is not linear, feet that
differ, a runner that is stuck. Steps are so short that the feet cross the presliding range in many
of them, however fast they are; how fast they can be is known beforehand, so the steps are chosen,
not tried.

"""

import math

from stickslip_ros.contact.kernel import kernel, kernel_apart
from stickslip_ros.drive.amplifier import clamp, low_pass
from stickslip_ros.drive.passes import may_pass
from stickslip_ros.drive.piezo import SCALARS, SLEWED_V, displace, fastest_m_per_s, prepare_step
from stickslip_ros.drive.records import DriveHistory, Plant, State
from stickslip_ros.drive.step import VERLET_REFINEMENT, step

SLEW_REFINEMENT = 64
"""Steps during a fall are so many times shorter: the feet cross the whole presliding range in
two microseconds, and their work is an integral over that range."""
SLOPE_STEPS_MIN = 6.0
"""Long steps in which feet that follow a steep slope cross the presliding range, at least."""
CROSSING_S = 3.2e-4
"""Feet that are rounded off, or ring, go at most sim.dt/CROSSING_S of the presliding range in one
step: a 64th of it at the default of 5 us."""
CROSSING_STEPS_MIN = 16.0
"""Steps in which they cross it, at least."""
BURST = 16
"""Steps of one length before the next length is chosen."""
STEP_SLACK = 1e-9
"""Share of a step by which a stretch may exceed a whole number of steps, for rounding."""


@kernel
def slewed_voltage(plant: Plant, history: DriveHistory, state: State) -> float:
    """Return the output of the amplifier before its low-pass, V."""
    if plant.amplifier.tau_s > 0.0:
        return float(history.piezo[SCALARS, SLEWED_V])
    return state.voltage_v


@kernel
def longest_on_slope(plant: Plant, rate_v_per_s: float) -> float:
    """Return the longest step along a straight voltage that the feet follow in proportion, s."""
    falls = abs(rate_v_per_s) >= plant.slew_v_per_s
    longest_s = plant.dt_s / SLEW_REFINEMENT if falls else plant.dt_s
    foot_m_per_s = plant.gain_m_per_v * abs(rate_v_per_s)
    travel_m = plant.contact.curve.limit_m / SLOPE_STEPS_MIN
    return longest_s if foot_m_per_s * longest_s <= travel_m else travel_m / foot_m_per_s


@kernel_apart
def ride_through(
    plant: Plant,
    history: DriveHistory,
    state: State,
    start_v: float,
    rate_v_per_s: float,
    load_n: float,
    stretch_s: float,
) -> State:
    """Advance along a straight stretch of the voltage before the low-pass."""
    tau_s = plant.amplifier.tau_s
    left_s, input_v = stretch_s, start_v
    while left_s > 0.0 and may_pass(history):
        dt_s, steps, left_s = _burst(plant, history, state, input_v, rate_v_per_s, left_s)
        ring = prepare_step(plant, history.piezo, dt_s)
        share = -math.expm1(-dt_s / tau_s) if tau_s > 0.0 else 1.0
        for i in range(1, steps + 1):
            voltage_v = clamp(plant, input_v + rate_v_per_s * (i * dt_s))
            if tau_s > 0.0:
                from_v = clamp(plant, input_v + rate_v_per_s * ((i - 1) * dt_s))
                voltage_v = low_pass(plant, state.voltage_v, from_v, voltage_v, dt_s, share)
            foot_m = displace(plant, history.piezo, voltage_v, ring, dt_s)
            state = step(plant, history, state, voltage_v, foot_m, load_n, dt_s)
        input_v = clamp(plant, start_v + rate_v_per_s * (stretch_s - left_s))
        history.piezo[SCALARS, SLEWED_V] = input_v
    return state


@kernel
def _burst(
    plant: Plant,
    history: DriveHistory,
    state: State,
    input_v: float,
    rate_v_per_s: float,
    left_s: float,
) -> tuple[float, int, float]:
    """Return length and number of the next equal steps, and the time that is left after them."""
    if plant.ideal and abs(rate_v_per_s) >= plant.slew_v_per_s:
        longest_s = longest_on_slope(plant, rate_v_per_s)
    else:
        longest_s = _longest_in_burst(plant, history, state, input_v, rate_v_per_s)
    steps = max(1, math.ceil(VERLET_REFINEMENT * left_s / longest_s - STEP_SLACK))
    dt_s = left_s / steps
    if plant.ideal or steps <= BURST:
        return dt_s, steps, 0.0
    return dt_s, BURST, left_s - BURST * dt_s


@kernel
def _longest_in_burst(
    plant: Plant, history: DriveHistory, state: State, input_v: float, rate_v_per_s: float
) -> float:
    """Return the longest step that resolves what the mean foot does next, however fast, s."""
    fastest_v_per_s = abs(rate_v_per_s)
    if plant.amplifier.tau_s > 0.0:
        fastest_v_per_s += abs(input_v - state.voltage_v) / plant.amplifier.tau_s
    speed_m_per_s = fastest_m_per_s(plant, history.piezo, fastest_v_per_s)
    share = min(plant.dt_s / CROSSING_S, 1.0 / CROSSING_STEPS_MIN)
    travel_m = VERLET_REFINEMENT * share * plant.contact.curve.limit_m
    if speed_m_per_s * plant.dt_s <= travel_m:
        return plant.dt_s
    return travel_m / speed_m_per_s
