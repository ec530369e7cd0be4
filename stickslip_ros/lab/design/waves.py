# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Waves of a search: shape with parameters, voltage, frequency, preload."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.drive.build import slew_of
from stickslip_ros.errors import OutOfRange
from stickslip_ros.files import replacing
from stickslip_ros.lab.design.shapes import CORNER_HEIGHT, CORNER_TIME, CURVE_ROWS, SHAPES, spline
from stickslip_ros.parameters import Parameters

SPLINE = 'spline'
KNOTS_MIN, KNOTS_MAX = 6, 16  # knots of a spline; first and last count once
SHORTEST = 1e-3  # time between two knots, relative to the longest
LOWEST = 1e-3  # height between two knots, relative to the largest, before scaling
SLEW_SLACK = 1e-9  # margin below the slew rate, so that the amplifier never limits


@dataclass(frozen=True)
class PeriodicWave:
    """A shape with its parameters (or knots), and its drive settings."""

    shape: str
    values: Mapping[str, Any]
    voltage_v: float  # peak to peak, from amplifier.voltage_min on
    frequency_hz: float
    preload_n: float

    def rows(self, stand: Parameters, curve_rows: int = CURVE_ROWS) -> Array:
        """Return one cycle as rows of time (s) and voltage (V), see ``playable``."""
        make = spline if self.shape == SPLINE else SHAPES[self.shape].rows
        unit = make(rows=curve_rows, **self.values)
        return playable(unit, stand, self.voltage_v, self.frequency_hz)


def playable(rows: Array, parameters: Parameters, voltage_v: float, frequency_hz: float) -> Array:
    """
    Return a shape as rows of time (s) and voltage (V), within range and slew rate.

    Steeper parts, such as jumps, take the time of the slew rate; the rest runs faster to keep the
    period. OutOfRange if the voltage or the time of rise and fall does not fit.

    """
    amplifier, period_s = parameters.amplifier, 1.0 / frequency_hz
    if not 0.0 < voltage_v <= amplifier.range_v * (1.0 + SLEW_SLACK):
        limit = f'not above 0 V and up to {amplifier.range_v:g} V'
        raise OutOfRange('voltage of a wave', voltage_v, 'V', limit, 'see amplifier.voltage_max')
    steps = np.diff(rows, axis=0)
    wanted_s = steps[:, CORNER_TIME] * period_s
    slew_v_per_s = slew_of(parameters)
    needed_s = np.abs(steps[:, CORNER_HEIGHT]) * voltage_v * (1.0 + SLEW_SLACK) / slew_v_per_s
    if needed_s.sum() >= period_s:
        limit = f'more than the slew rate of {slew_v_per_s:g} V/s allows at {voltage_v:g} V'
        raise OutOfRange('frequency', frequency_hz, 'Hz', limit, 'lower it or the voltage')
    steep = np.zeros(len(steps), dtype=np.bool_)
    while True:
        pace = (period_s - needed_s[steep].sum()) / wanted_s[~steep].sum()
        more = needed_s > pace * wanted_s
        if (more == steep).all():
            break
        steep = more
    lasts_s = np.where(steep, needed_s, pace * wanted_s)
    kept = np.concatenate(([True], lasts_s > 0.0))
    time_s = np.concatenate(([0.0], np.cumsum(lasts_s)))[kept]
    volts = amplifier.voltage_min + voltage_v * rows[kept, CORNER_HEIGHT]
    return np.column_stack((time_s * (period_s / time_s[-1]), volts))


def knots_of(shares: Sequence[float] | Array) -> dict[str, list[float]]:
    """Return knots from n logarithmic times and n heights in between; the first half rises."""
    count = len(shares) // 2
    times = np.cumsum(SHORTEST ** (1.0 - np.array(shares[:count])))
    heights = LOWEST + np.array(shares[count:])
    up, down = np.cumsum(heights[: count // 2]), np.cumsum(heights[count // 2 :])
    rise, fall = (up[:-1] / up[-1]).tolist(), (1.0 - down[:-1] / down[-1]).tolist()
    return {
        'times': [0.0, *(times[:-1] / times[-1]).tolist(), 1.0],
        'heights': [0.0, *rise, 1.0, *fall, 0.0],
    }


def write_wave(rows: Array, path: Path) -> None:
    """Write a wave as a table for the commands: time, s, and voltage, V."""
    lines = ['time_s,voltage_v', *(f'{time_s!r},{volts!r}' for time_s, volts in rows.tolist())]
    with replacing(path) as part:
        part.write_text('\n'.join(lines) + '\n', encoding='utf-8')
