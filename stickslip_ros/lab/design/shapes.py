# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Shapes of a wave: a cycle from 0 to 1 and back, as corners; an equal time is a jump."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from stickslip_ros.arrays import Array

CURVE_ROWS = 48  # rows of each curved part; enough for convergence
CORNER_TIME, CORNER_HEIGHT = 0, 1  # columns of the rows of a shape


class Trait(NamedTuple):
    """Bounds of a shape parameter, and its published or usual value."""

    low: float
    high: float
    usual: float


@dataclass(frozen=True)
class Shape:
    """A named shape, its parameters, and its source."""

    make: Callable[..., Array]  # corners, from rows per curve and parameters
    traits: Mapping[str, Trait]
    source: str

    def rows(self, rows: int = CURVE_ROWS, **values: float) -> Array:
        """Return one cycle forwards, with usual values by default."""
        usual = {name: trait.usual for name, trait in self.traits.items()}
        return self.make(rows, **{**usual, **values})


def spline(
    times: Sequence[float] | Array, heights: Sequence[float] | Array, rows: int = CURVE_ROWS
) -> Array:
    """Return a cycle through knots from 0 over 1 to 0, with monotone cubics (PCHIP)."""
    from scipy.interpolate import PchipInterpolator  # noqa: PLC0415 - a panel runs without it

    time, height = np.array((times, heights), dtype=np.float64)
    top, share = int(np.argmax(height)), 2 * rows // (len(time) - 1) + 1
    curves = list[Array]()
    for part in (np.s_[: top + 1], np.s_[top:]):
        knots = time[part]
        at = (knots[:-1, None] + np.outer(np.diff(knots), np.arange(share) / share)).ravel()
        curve = PchipInterpolator(knots, height[part])(at)
        curves.append(np.column_stack((at, np.clip(curve, 0.0, 1.0))))
    return np.vstack((*curves, (1.0, 0.0)))


def saw_shape(_: int, fall: float) -> Array:
    """Rise evenly, fall evenly in a share of the cycle; 0 is a jump."""
    return np.array(((0.0, 0.0), (1.0 - fall, 1.0), (1.0, 0.0)))


def cycloid(rows: int) -> Array:
    """Trace t = 1/2 + (a - sin a)/2pi, y = (1 + cos a)/2, with the cusp on top."""
    angle: Array = np.linspace(-np.pi, np.pi, 2 * rows + 1, dtype=np.float64)
    time = 0.5 + (angle - np.sin(angle)) / (2.0 * np.pi)
    return np.column_stack((time, 0.5 * (1.0 + np.cos(angle))))


def parabola(rows: int, rise: float) -> Array:
    """Rise as y = (t/r)^2, fall as its mirror image in the rest of the cycle."""
    up: Array = np.linspace(0.0, 1.0, rows + 1, dtype=np.float64)
    rising = np.column_stack((rise * up, up**2))
    falling = np.column_stack((1.0 - (1.0 - rise) * up, up**2))
    return np.vstack((rising, falling[-2::-1]))


def compensated(rows: int, sine: float) -> Array:
    """Rise as y = t - c sin(2 pi t)/(2 pi), at c = 1 from rest to rest; jump back."""
    time: Array = np.linspace(0.0, 1.0, 2 * rows + 1, dtype=np.float64)
    height = time - sine * np.sin(2.0 * np.pi * time) / (2.0 * np.pi)
    return np.vstack((np.column_stack((time, height)), (1.0, 0.0)))


def freeze_and_kick(_: int, rise: float, freeze: float) -> Array:
    """Rise evenly, hold, jump back, hold; the first hold is a share of the remaining time."""
    kick = rise + freeze * (1.0 - rise)
    return np.array(((0.0, 0.0), (rise, 1.0), (kick, 1.0), (kick, 0.0), (1.0, 0.0)))


def trapezoid(_: int, rise: float, fall: float, hold: float) -> Array:
    """Rise, hold, fall, hold; the first hold is a share of the remaining time."""
    high = rise + hold * (1.0 - rise - fall)
    return np.array(((0.0, 0.0), (rise, 1.0), (high, 1.0), (high + fall, 0.0), (1.0, 0.0)))


SHAPES: Mapping[str, Shape] = {
    'sawtooth': Shape(
        saw_shape, {'fall': Trait(0.0, 0.5, 0.0)}, 'D. W. Pohl, Rev. Sci. Instrum. 58, 54 (1987)'
    ),
    'cycloid': Shape(cycloid, {}, 'Ch. Renner et al., Rev. Sci. Instrum. 61, 965 (1990)'),
    'parabola': Shape(
        parabola,
        {'rise': Trait(0.5, 1.0, 1.0)},
        'K. Anantheshwara, M. S. Bobji, Sadhana 33, 221 (2008)',
    ),
    'sine-compensated': Shape(
        compensated, {'sine': Trait(-1.0, 1.0, 1.0)}, 'known to us by its name only'
    ),
    'freeze-and-kick': Shape(
        freeze_and_kick,
        {'rise': Trait(0.05, 0.95, 0.5), 'freeze': Trait(0.0, 1.0, 0.5)},
        'Coatings 8(2), 62 (2018)',
    ),
    'trapezoid': Shape(
        trapezoid,
        {
            'rise': Trait(0.05, 0.7, 0.6),
            'fall': Trait(0.0, 0.3, 0.0),
            'hold': Trait(0.0, 1.0, 0.5),
        },
        'M. Hunstig, Actuators 6(1), 7 (2017)',
    ),
}
"""Shapes by name."""
