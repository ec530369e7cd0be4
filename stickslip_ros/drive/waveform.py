# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Commanded voltages: saw-teeth of either direction, levels, tables."""

import math
from collections.abc import Sequence

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.drive.records import ENDLESS, TIME, VOLTAGE, Wave
from stickslip_ros.kernels.kernel import kernel
from stickslip_ros.kernels.record import Record

CORNER_S = 1e-15
"""Time to a corner that counts as 0, as it is only rounding."""
LOW_31_BITS = (1 << 31) - 1
LOW_32_BITS = (1 << 32) - 1
MIXER = 0x45D9F3B
"""Odd factor that mixes the bits of a 32-bit number well; products fit into 64 bits."""
CYCLE_FACTOR = 0x3C6EF372
"""Large factor without a pattern, so ramps of neighbouring seeds are independent."""


def level(voltage_v: float) -> Wave:
    """Return a wave of constant voltage."""
    return Wave(float(voltage_v))


def sawtooth(base_v: float, amplitude_v: float, frequency_hz: float, steps: int) -> Wave:
    """
    Return a saw-tooth between ``base_v`` and ``base_v + amplitude_v``.

    Ramps of a positive frequency rise slowly and fall at once (forwards). Ramps of a negative
    frequency start at the upper end, fall slowly and rise at once (backwards). ``steps`` is their
    number; 0 repeats until replaced.

    """
    forwards = frequency_hz > 0.0
    return Wave(
        start_v=float(base_v if forwards else base_v + amplitude_v),
        rise_v=float(math.copysign(amplitude_v, frequency_hz)),
        period_s=1.0 / abs(frequency_hz),
        cycles=int(steps) if steps > 0 else ENDLESS,
    )


def table(rows: Array | Sequence[Sequence[float]], cycles: int = 1) -> Wave:
    """
    Return a wave that plays a table and then holds its last voltage.

    Rows, shape (n, 2), have a time, s, and a voltage, V. Times begin at 0 and do not decrease.
    Straight lines join the rows; two rows of the same time are a jump. ``cycles`` is the number of
    plays; 0 repeats until replaced.

    """
    rows = np.array(rows, dtype=np.float64, order='C').reshape(-1, 2)
    end_s, end_v = float(rows[-1, TIME]), float(rows[-1, VOLTAGE])
    if end_s == 0.0:
        return level(end_v)
    return Wave(start_v=end_v, period_s=end_s, cycles=cycles or ENDLESS, rows=rows)


def can_be_played(wave: Wave, cycle: int, ramp_s: float) -> bool:
    """Return whether kernels can play a loaded wave from a cycle and a time of its clock."""
    times_s = wave.rows[:, TIME]
    is_table = len(times_s) > 1 and times_s[0] == 0.0 and times_s[-1] == wave.period_s
    return bool(
        0 <= wave.cycles <= ENDLESS
        and 0.0 <= wave.lead_s < wave.period_s
        and (len(times_s) == 0 or (is_table and (np.diff(times_s) >= 0.0).all()))
        and (cycle >= wave.cycles or -2.0 * CORNER_S <= ramp_s <= wave.period_s)
    )


def repeats(wave: Wave) -> bool:
    """Return whether a wave is a table that is played more than once."""
    return wave.cycles > 1 and len(wave.rows) > 0


def after(wave: Wave, ramp_s: float, following: Wave) -> Wave:
    """
    Return a wave that plays the present cycle of a table to its end, then another table.

    A table that is still waiting for its first cycle is dropped.

    """
    times_s, voltages_v = wave.rows.T
    end_s = wave.lead_s if ramp_s < wave.lead_s else wave.period_s
    ahead = (times_s > ramp_s + CORNER_S) & (times_s <= end_s)
    now_v = np.interp(ramp_s, times_s, voltages_v)
    rest = wave.rows[ahead] - np.array((ramp_s, 0.0))
    lead_s = end_s - ramp_s
    then = following.rows + np.array((lead_s, 0.0))
    rows = np.concatenate(([(0.0, now_v)], rest, then))
    return following._replace(rows=rows, lead_s=lead_s, period_s=float(rows[-1, TIME]))


def mean_rise_v(wave: Wave) -> float:
    """Return the mean voltage over a cycle minus the voltage at its start, V."""
    if not len(wave.rows):
        return 0.5 * wave.rise_v
    times_s, voltages_v = wave.rows.T
    areas_v_s = np.diff(times_s) * (voltages_v[1:] + voltages_v[:-1]) / 2.0
    return float(areas_v_s.sum()) / wave.period_s - float(voltages_v[0])


def with_missed_steps(wave: Wave, share: float, seed: int) -> Wave:
    """Return a wave in which a share of the ramps is skipped; a seed selects them."""
    return wave._replace(missed_share=float(share), missed_seed=int(seed))


@kernel
def target(wave: Wave, clock: Record, near: int = 0) -> tuple[float, float, float]:
    """Return the commanded voltage (V), its slope (V/s) and the time to its next corner (s)."""
    if clock.cycle >= wave.cycles:
        return wave.start_v, 0.0, math.inf
    time_s, rows = clock.ramp_s, wave.rows
    if len(rows) > 0:
        row = row_at(rows, time_s, near)
        start_s, start_v, end_s = rows[row, TIME], rows[row, VOLTAGE], rows[row + 1, TIME]
        slope_v_per_s = (rows[row + 1, VOLTAGE] - start_v) / (end_s - start_s)
        return start_v + slope_v_per_s * (time_s - start_s), slope_v_per_s, end_s - time_s
    if wave.missed_share > 0.0 and is_missed(wave, clock.cycle):
        return wave.start_v, 0.0, wave.period_s - time_s
    slope_v_per_s = wave.rise_v / wave.period_s
    return wave.start_v + slope_v_per_s * time_s, slope_v_per_s, wave.period_s - time_s


@kernel
def row_at(rows: Array, time_s: float, near: int) -> int:
    """Return the last row, except the end, that a time has reached, searching from ``near``."""
    low, high = 0, len(rows) - 2
    if near > 0 and rows[near, TIME] - time_s <= CORNER_S:
        while near < high and rows[near + 1, TIME] - time_s <= CORNER_S:
            near += 1
        return near
    while low < high:
        middle = (low + high + 1) // 2
        if rows[middle, TIME] - time_s <= CORNER_S:
            low = middle
        else:
            high = middle - 1
    return low


@kernel
def is_missed(wave: Wave, cycle: int) -> bool:
    """Return whether the amplifier skips a ramp, from a hash of seed and cycle."""
    bits = (wave.missed_seed & LOW_31_BITS) * CYCLE_FACTOR + (cycle & LOW_31_BITS)
    bits = (bits ^ (bits >> 31)) & LOW_32_BITS
    for _ in range(3):
        bits = (((bits >> 16) ^ bits) * MIXER) & LOW_32_BITS
    bits = (bits >> 16) ^ bits
    return bits < wave.missed_share * (LOW_32_BITS + 1)


@kernel
def ramp_is_over(wave: Wave, clock: Record) -> bool:
    """Return whether the present ramp has reached its corner."""
    return clock.cycle < wave.cycles and wave.period_s - clock.ramp_s <= CORNER_S
