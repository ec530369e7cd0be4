# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Quantities, settings and axes of measurements in words."""

from collections.abc import Mapping

from stickslip_ros.lab.measurements.numbers import NUMBERS
from stickslip_ros.parameters import SENSORS, Scalar
from stickslip_ros.units import NM, with_unit

_QUANTITIES: Mapping[str, str] = {
    **{name: each.words.partition(',')[0] for name, each in NUMBERS.items()},
    'zero_amplitude_m': '0-amplitude',
    'ringing_hz': 'frequency of ringing',
    'decay_s': 'decay of ringing',
    'energy_loss_per_step_j': 'friction loss per step',
    **{each.quantity: each.words for each in SENSORS},
    'voltage_v': 'voltage',
    'foot_m': 'foot displacement',
}
CURVE_AXES = {
    'time_s': (1.0, 'time (s)'),
    'amplitude_m': (NM, 'stroke of the feet (nm)'),
    'voltage_v': (1.0, 'voltage (V)'),
    'preload_n': (1.0, 'preload (N)'),
    'row': (NM, 'displacement (nm)'),  # axis of loop rows in figures
}
"""Axes of curves: factor to SI and label."""
LEGEND_MAX = 10  # most curves in a legend


def quantity_words(name: str) -> str:
    """Return a quantity in words, by its column."""
    return _QUANTITIES.get(name, name)


def setting_words(at: Mapping[str, Scalar]) -> str:
    """Return settings in words, ``0.5 N`` or ``0.5 N, contact.friction 0.3``."""
    parts = [f'{at["preload_n"]:g} N'] if 'preload_n' in at else []
    for name, value in at.items():
        if name in {'preload_n', 'amplitude_m', 'time_s'}:
            continue
        shown = f'{value:g}' if isinstance(value, float) else str(value)
        parts.append(f'{shown} Hz' if name == 'frequency_hz' else f'{name} {shown}')
    if 'amplitude_m' in at:
        parts.append(f'stroke {with_unit(float(at["amplitude_m"]), "m")}')
    if 'time_s' in at:
        parts.append(f'{at["time_s"]:.9g} s')
    return ', '.join(parts)
