# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Positions and sizes of the parts of the stand, for drawings only.

Eq. 19 fixes the directions: two upper normal forces of sqrt(2)/2 F_p and four lower ones of
sqrt(2)/4 F_p balance the preload F_p at 45 degrees to it, across the motion. So the runner is
drawn as a square bar on its edge; length (from travel) and width (from mass) are our choice.

"""

import math
from typing import NamedTuple

from stickslip_ros.parameters import Parameters

STEEL_KG_PER_M3 = 7700.0  # of chromium steels, such as the X90CrMoV18 of Table 1
SPACING_RADII = 16.0  # between the two rows of lower feet; our choice
PIEZO_RADII = (3.2, 8.0)  # width and length of a piezo; our choice
DIAGONAL = math.sqrt(0.5)


class Foot(NamedTuple):
    """A hemisphere: contact point, and side of the runner."""

    number: int  # from 1; the two upper ones first
    x_m: float
    side: int  # -1 or 1 along y
    up: int  # 1 above the runner, -1 below

    def at(self, distance_m: float) -> tuple[float, float, float]:
        """Return x, y, z at a distance from the runner axis, along the normal."""
        away_m = DIAGONAL * distance_m
        return self.x_m, self.side * away_m, self.up * away_m


class Geometry(NamedTuple):
    """Sizes and positions, from the middle of the runner at position 0; x is the motion."""

    length_m: float  # of the runner
    width_m: float  # of its square section
    radius_m: float  # of a hemisphere
    piezo_m: tuple[float, float]  # width and length
    feet: tuple[Foot, ...]
    cell_m: float  # start of the load cell, if any

    @property
    def reach_m(self) -> float:
        """Distance of the fixed ends of the piezos from the runner axis."""
        return 0.5 * self.width_m + self.radius_m + self.piezo_m[1]


def geometry_of(parameters: Parameters) -> Geometry:
    """Return the geometry of a stand: the bar stays on its feet over the whole travel."""
    stand, radius_m = parameters.stand, parameters.contact.radius
    spacing_m = SPACING_RADII * radius_m
    travel_m = max(stand.travel_max, -stand.travel_min)
    length_m = spacing_m + 4.0 * radius_m + 2.0 * travel_m
    places = (0.0, 1), (-0.5 * spacing_m, -1), (0.5 * spacing_m, -1)
    sides = [(x_m, side, up) for x_m, up in places for side in (-1, 1)]
    gap_m = parameters.load_cell.gap if parameters.load_cell.contact == 'one_sided' else 0.0
    return Geometry(
        length_m=length_m,
        width_m=math.sqrt(parameters.runner.mass / (STEEL_KG_PER_M3 * length_m)),
        radius_m=radius_m,
        piezo_m=(PIEZO_RADII[0] * radius_m, PIEZO_RADII[1] * radius_m),
        feet=tuple(Foot(number, *each) for number, each in enumerate(sides, 1)),
        cell_m=0.5 * length_m + gap_m,
    )
