# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The amplifier, from the commanded voltage to the output.

Its stages are the digital-to-analogue converter, range and slew rate, and the low-pass.

"""

import math
from typing import NamedTuple

import numpy as np

from stickslip_ros.drive.records import Wave
from stickslip_ros.drive.waveform import CORNER_S, target
from stickslip_ros.kernels.kernel import kernel
from stickslip_ros.kernels.record import Record

SETTLED_V = 1e-9
"""Gap that counts as rounding; it moves the foot by half an attometre."""
FALL_SHARE = 0.01
"""A fall after a converter or a low-pass is over when this share of the rise remains."""
AIM = 0.999
"""Share of this gap at which the stretch ends, so rounding cannot hide the end of the fall."""
AIM_OF_CONVERTER = 0.5
"""AIM with a converter, whose level may differ from the command by half its step."""
ARRIVED_SHARE = 1e-4
"""Share of the range within which a voltage after a low-pass has arrived."""
LOOK_AHEAD_SHARE = 1e-9
"""Share of its step by which the converter looks ahead, past a level that it has just reached."""


class Stretch(NamedTuple):
    """The next straight stretch of the voltage."""

    # output of the amplifier before its low-pass, and its slope
    start_v: float
    rate_v_per_s: float
    # input of the amplifier, and its slope
    target_v: float
    slope_v_per_s: float
    caught_s: float  # time until a slewing output has caught up; inf if it does not slew
    lasts_s: float  # time until the next corner


@kernel
def stretch_ahead(plant: Record, wave: Wave, clock: Record, output_v: float, row: int) -> Stretch:
    """Return the output before the low-pass, from its present voltage to its next corner."""
    target_v, slope_v_per_s, corner_s = wanted(plant, wave, clock, row)
    start_v, rate_v_per_s, caught_s = follow(
        plant, output_v, target_v, slope_v_per_s, clock.ramp_s
    )
    lasts_s = min(corner_s, caught_s)
    return Stretch(start_v, rate_v_per_s, target_v, slope_v_per_s, caught_s, lasts_s)


@kernel
def has_caught_up(plant: Record, ahead: Stretch, output_v: float, stretch_s: float) -> bool:
    """Return whether a slewing output without low-pass has caught up at the end of a stretch."""
    gap_v = clamp(plant, ahead.target_v + ahead.slope_v_per_s * stretch_s) - output_v
    return ahead.caught_s < math.inf and abs(gap_v) <= SETTLED_V


@kernel
def clamp(plant: Record, voltage_v: float) -> float:
    """Limit a voltage to the range of the amplifier, V."""
    return min(max(voltage_v, plant.voltage_min_v), plant.voltage_max_v)


@kernel
def wanted(plant: Record, wave: Wave, clock: Record, row: int = 0) -> tuple[float, float, float]:
    """Return the input of the amplifier: voltage (V), its slope (V/s), time to a corner (s)."""
    target_v, slope_v_per_s, corner_s = target(wave, clock, row)
    if not plant.amplifier.on:
        return plant.voltage_min_v, 0.0, corner_s
    if plant.amplifier.resolution_v > 0.0:
        return convert(plant, target_v, slope_v_per_s, corner_s, clock.ramp_s)
    return target_v, slope_v_per_s, corner_s


@kernel
def convert(
    plant: Record, target_v: float, slope_v_per_s: float, corner_s: float, clock_s: float
) -> tuple[float, float, float]:
    """
    Return the level of the converter, a slope of 0, and the time until the next level.

    Levels that are finer than the steps of the drive, or than rounding, are replaced by the
    straight line. A level so near that the clock would not move counts as reached.

    """
    step_v = plant.amplifier.resolution_v
    if slope_v_per_s == 0.0:
        return round(target_v / step_v) * step_v, 0.0, corner_s
    if step_v < max(abs(slope_v_per_s) * plant.tread_s, SETTLED_V):
        return target_v, slope_v_per_s, corner_s
    level = float(round(target_v / step_v + math.copysign(LOOK_AHEAD_SHARE, slope_v_per_s)))
    next_v = (level + math.copysign(0.5, slope_v_per_s)) * step_v
    next_s = (next_v - target_v) / slope_v_per_s
    if clock_s + next_s <= clock_s:
        level += math.copysign(1.0, slope_v_per_s)
        next_s += step_v / abs(slope_v_per_s)
    return level * step_v, 0.0, min(corner_s, next_s)


@kernel
def follow(
    plant: Record, voltage_v: float, target_v: float, slope_v_per_s: float, clock_s: float
) -> tuple[float, float, float]:
    """
    Return voltage (V) and rate (V/s) of the output, and the time until the rate changes (s).

    The output is taken before the low-pass. The clock is the time since the start of the ramp: a
    voltage that would be reached before the clock moves counts as reached.

    """
    wanted_v = clamp(plant, target_v)
    gap_v = wanted_v - voltage_v
    slew = plant.slew_v_per_s
    rate_v_per_s = math.copysign(slew, gap_v)
    closing_v_per_s = rate_v_per_s - slope_v_per_s
    caught_s = gap_v / closing_v_per_s if closing_v_per_s * gap_v > 0.0 else math.inf
    if abs(gap_v) <= SETTLED_V or clock_s + caught_s <= clock_s:
        return wanted_v, min(max(slope_v_per_s, -slew), slew), math.inf
    return voltage_v, rate_v_per_s, caught_s


@kernel
def low_pass(
    plant: Record, output_v: float, from_v: float, to_v: float, h_s: float, share: float
) -> float:
    """Return the output after a step with a linear input; ``share`` is 1 - exp(-h/tau)."""
    if plant.amplifier.tau_s == 0.0:
        return to_v
    lag_v = (to_v - from_v) / h_s * plant.amplifier.tau_s
    return output_v + (to_v - from_v) + share * (from_v - lag_v - output_v)


@kernel
def time_to_settle(
    plant: Record, wave: Wave, output_v: float, input_v: float, rate_v_per_s: float
) -> float:
    """Return the time to the end of a fall after the low-pass under linear input, s; inf: over."""
    tau_s = plant.amplifier.tau_s
    if tau_s == 0.0:
        return math.inf
    aim = AIM_OF_CONVERTER if plant.amplifier.resolution_v > 0.0 else AIM
    aim_v = aim * fall_gap(plant, wave)
    off_v = abs(output_v - input_v + rate_v_per_s * tau_s)
    settles = off_v - aim_v > SETTLED_V and aim_v > 0.0
    return tau_s * math.log(off_v / aim_v) if settles else math.inf


@kernel
def is_fall_over(
    plant: Record, wave: Wave, after: Record, row: int, before_v: float, stretch_s: float
) -> bool:
    """Return whether a fall after a converter or a low-pass has ended in a stretch."""
    target_v, slope_v_per_s, _ = target(wave, after.clock, row)
    lag_v = slope_v_per_s * plant.amplifier.tau_s
    end_v = clamp(plant, target_v + slope_v_per_s * stretch_s)
    gap_v = fall_gap(plant, wave)
    is_over = abs(after.voltage_v - end_v + lag_v) <= gap_v
    return is_over and abs(before_v - clamp(plant, target_v) + lag_v) > gap_v


@kernel
def fall_gap(plant: Record, wave: Wave) -> float:
    """Return the remaining voltage at which a fall counts as over, V."""
    return max(FALL_SHARE * abs(wave.rise_v), plant.amplifier.resolution_v)


@kernel
def is_direct(plant: Record) -> bool:
    """Return whether the amplifier has neither converter nor low-pass."""
    return plant.amplifier.resolution_v == 0.0 and plant.amplifier.tau_s == 0.0


def corners_within(
    wave: Wave, lasts_s: float, slew_v_per_s: float, step_v: float, tread_s: float
) -> float:
    """
    Return the largest number of corners of the output in any ``lasts_s`` of a wave.

    A level of the converter has two corners: its end and the start of the next level.

    """
    ramp = np.array(((0.0, wave.start_v), (wave.period_s, wave.start_v + wave.rise_v)))
    times_s, voltages_v = (wave.rows if len(wave.rows) else ramp).T
    slopes_v_per_s, levels = np.diff(voltages_v) / np.diff(times_s), np.zeros(len(times_s) - 1)
    if step_v > 0.0:
        stairs = step_v >= np.maximum(abs(slopes_v_per_s) * tread_s, SETTLED_V)
        levels[stairs] = abs(np.diff(np.rint(voltages_v / step_v)))[stairs]
        slopes_v_per_s[stairs] = 0.0
    turns_v_per_s = abs(np.diff(slopes_v_per_s, prepend=math.inf))
    corners = 2.0 * levels + (turns_v_per_s > 0.0)
    # The output slews for a moment after a sharp corner, and catches up after a steep row.
    corners += turns_v_per_s * CORNER_S > SETTLED_V
    corners += abs(slopes_v_per_s) > slew_v_per_s
    corners[-1] += wave.rise_v != 0.0
    passed = np.append(0.0, np.cumsum(corners))
    cycles = min(wave.cycles, int(lasts_s / wave.period_s))
    within, rest_s = float(cycles * passed[-1]), lasts_s - cycles * wave.period_s
    if wave.cycles > cycles:
        if wave.cycles > 1:
            times_s = np.append(times_s, wave.period_s + times_s[1:])
            passed = np.append(passed, passed[-1] + passed[1:])
        starts_s = np.append(times_s, times_s - rest_s)
        ends = np.interp(starts_s + rest_s, times_s, passed)
        within += float(np.max(ends - np.interp(starts_s, times_s, passed)))
    return within


def has_arrived(plants: Record, wave: Wave, states: Record) -> bool:
    """
    Return whether a wave is over and the voltage has reached its final value.

    It is asked in each block of a move. Fields of arrays take a quarter of the time of attributes.

    """
    if states['clock']['cycle'].item() < wave.cycles:
        return False
    held_v, amplifier = wave.start_v, plants['amplifier']
    step_v = amplifier['resolution_v'].item()
    if step_v > 0.0:
        held_v = round(held_v / step_v) * step_v
    low_v, high_v = plants['voltage_min_v'].item(), plants['voltage_max_v'].item()
    held_v = min(max(held_v, low_v), high_v)
    within_v = ARRIVED_SHARE * (high_v - low_v) if amplifier['tau_s'].item() else SETTLED_V
    return bool(abs(states['voltage_v'].item() - held_v) <= within_v)
