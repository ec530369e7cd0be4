# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Where the parts of the stand are, for those who draw it: nothing here enters the physics.

Eq. 19 fixes the directions: two upper normal forces of sqrt(2)/2 F_p and four lower ones of
sqrt(2)/4 F_p are in balance with the preload F_p where each is at 45 degrees to it, across the
motion. So the runner is drawn as a square bar that stands on an edge. Its length is what its
travel asks for, its width what its mass does; the paper says neither.

"""

import math
from typing import NamedTuple

from stickslip_ros.parameters import Parameters

STEEL_KG_PER_M3 = 7700.0  # of chromium steels, such as the X90CrMoV18 of Table 1
SPACING_RADII = 16.0  # between the two rows of lower feet; our choice
PIEZO_RADII = (3.2, 8.0)  # width and length of a piezo; our choice
DIAGONAL = math.sqrt(0.5)


class Foot(NamedTuple):
    """A hemisphere: where it touches the runner, and to which side of it it stands."""

    number: int  # from 1; the two upper ones first
    x_m: float
    side: int  # -1 or 1 along y
    up: int  # 1 above the runner, -1 below

    def at(self, distance_m: float) -> tuple[float, float, float]:
        """Return x, y and z at a distance from the axis of the runner, along the normal."""
        away_m = DIAGONAL * distance_m
        return self.x_m, self.side * away_m, self.up * away_m


class Geometry(NamedTuple):
    """Sizes and places, from the middle of the runner at position 0; x is the way it goes."""

    length_m: float  # of the runner
    width_m: float  # of its square section
    radius_m: float  # of a hemisphere
    piezo_m: tuple[float, float]  # width and length
    feet: tuple[Foot, ...]
    cell_m: float  # where the load cell begins, if there is one

    @property
    def reach_m(self) -> float:
        """Distance from the axis at which the piezos end on the carrier."""
        return 0.5 * self.width_m + self.radius_m + self.piezo_m[1]


def geometry_of(parameters: Parameters) -> Geometry:
    """Return where the parts of a stand are: the bar stays on its feet over all of its travel."""
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
