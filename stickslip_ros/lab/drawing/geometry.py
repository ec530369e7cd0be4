# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Positions and sizes of the parts of the stand, for drawings only.

Eq. 19 fixes the directions: two upper normal forces of sqrt(2)/2 F_p and four lower ones of
sqrt(2)/4 F_p balance the preload F_p at 45 degrees to it, across the motion. So the runner is
drawn as a square bar on its edge; length (from travel) and width (from mass) are our choice.

Other feet are drawn in pairs along the motion: an odd foot below, the even one opposite above,
and every second pair across the first.

"""

import math
from typing import NamedTuple

from stickslip_ros.parameters import FeetParameters, FootGroup, Parameters

STEEL_KG_PER_M3 = 7700.0  # of chromium steels, such as the X90CrMoV18 of Table 1
SPACING_RADII = 16.0  # between the two rows of lower feet; our choice
PIEZO_RADII = (3.2, 8.0)  # width and length of a piezo; our choice
DIAGONAL = math.sqrt(0.5)
_PAPER = FeetParameters()


class Foot(NamedTuple):
    """A hemisphere: contact point, and side of the runner."""

    number: int  # from 1, in the order of feet.count
    x_m: float
    side: int  # -1 or 1 along y
    up: int  # 1 above the runner, -1 below
    radius_m: float
    base: str  # piezo, or frame for a guide at rest
    base_m: float  # length of that
    alike: str  # name of the drawing of feet of equal size and motion
    place: str  # above or below in the stand of the paper, else the number of its group
    group: FootGroup

    def at(self, distance_m: float) -> tuple[float, float, float]:
        """Return x, y, z at a distance from the runner axis, along the normal."""
        away_m = DIAGONAL * distance_m
        return self.x_m, self.side * away_m, self.up * away_m


class Geometry(NamedTuple):
    """Sizes and positions, from the middle of the runner at position 0; x is the motion."""

    length_m: float  # of the runner
    width_m: float  # of its square section
    radius_m: float  # of the largest hemisphere
    piezo_m: tuple[float, float]  # its width and length
    feet: tuple[Foot, ...]
    cell_m: float  # start of the load cell, if any
    is_of_paper: bool  # two feet above, four below

    @property
    def reach_m(self) -> float:
        """Distance of the fixed ends of the piezos from the runner axis."""
        return 0.5 * self.width_m + self.radius_m + self.piezo_m[1]


def _sides_of(total: int, spacing_m: float, *, is_of_paper: bool) -> list[tuple[float, int, int]]:
    """Return the place along the runner, and the side and the height of each foot, as signs."""
    if is_of_paper:
        places = (0.0, 1), (-0.5 * spacing_m, -1), (0.5 * spacing_m, -1)
        return [(x_m, side, up) for x_m, up in places for side in (-1, 1)]
    first_m, gaps = -0.5 * spacing_m * (total > 2), max(1, (total - 1) // 2)
    order = [(first_m + k // 2 * spacing_m / gaps, k, k // 2) for k in range(total)]
    return [(x_m, -((-1) ** (k + pair)), -((-1) ** k)) for x_m, k, pair in order]


def geometry_of(parameters: Parameters) -> Geometry:
    """Return the geometry of a stand: the bar stays on its feet over the whole travel."""
    stand, feet = parameters.stand, parameters.feet
    groups = [(k, group) for k, group in enumerate(feet.groups, 1) for _ in range(group.feet)]
    looks = [group._replace(feet=0, share=0.0, weight=0.0) for _, group in groups]
    radii_m = [each.radius_m or parameters.contact.radius for each in looks]
    radius_m, is_of_paper = max(radii_m), (feet.count, feet.share) == (_PAPER.count, _PAPER.share)
    piezo_m = PIEZO_RADII[0] * radius_m, PIEZO_RADII[1] * radius_m
    spacing_m = SPACING_RADII * radius_m
    travel_m = max(stand.travel_max, -stand.travel_min)
    length_m = spacing_m + 4.0 * radius_m + 2.0 * travel_m
    sides = _sides_of(feet.total, spacing_m, is_of_paper=is_of_paper)
    drawn = []
    for k, own_m in enumerate(radii_m):
        base = 'piezo' if looks[k].gain else 'frame', piezo_m[1] + radius_m - own_m
        alike, (number, group) = looks.index(looks[k]), groups[k]
        name = f'foot_{alike + 1}' if alike else 'foot'
        place = ('above', 'below')[k > 1] if is_of_paper else f'group {number}'
        drawn.append(Foot(k + 1, *sides[k], own_m, *base, name, place, group))
    gap_m = parameters.load_cell.gap if parameters.load_cell.contact == 'one_sided' else 0.0
    return Geometry(
        length_m=length_m,
        width_m=math.sqrt(parameters.runner.mass / (STEEL_KG_PER_M3 * length_m)),
        radius_m=radius_m,
        piezo_m=piezo_m,
        feet=tuple(drawn),
        cell_m=0.5 * length_m + gap_m,
        is_of_paper=is_of_paper,
    )
