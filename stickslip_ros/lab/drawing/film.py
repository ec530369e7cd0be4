# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Two cycles of a stand in slow motion: feet, runner, and how much of each contact slips."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stickslip_ros.arrays import Array
from stickslip_ros.contact.mdr import Presliding
from stickslip_ros.drive.build import contacts_of
from stickslip_ros.parameters import Parameters

FILM_CYCLES = 2
FRAMES = 200
"""Pictures of these cycles."""
BEFORE = 3
"""Cycles before, in which a contact forgets that it is taken for relaxed where they begin."""
RINGS = 64
AT_LIMIT = 0.98
"""A ring slips from this share of its limit on: readings have noise."""
HIGH, LOW = 0.75, 0.25
"""An edge leads from below the one share of the range of the voltage to above the other."""
STEEP = 0.25
"""Largest share of a period that the edge takes."""


class Film(NamedTuple):
    """What moves, at equal times."""

    length_s: float  # from the first picture to the last
    foot_m: Array  # from the first picture on; shape (FRAMES,)
    runner_m: Array
    slipping: Array  # share of the area of each contact that slips, shape (feet, FRAMES)


def film_of(
    parameters: Parameters, time_s: Array, voltage_v: Array, foot_m: Array, runner_m: Array
) -> Film | None:
    """Return the last whole cycles of a trace; None if it has none, or places are not known."""
    falls = steep_edges(voltage_v)
    if len(falls) < FILM_CYCLES + 1:
        return None
    first, last = (float(time_s[falls[at]]) for at in (-1 - FILM_CYCLES, -1))
    step_s = (last - first) / (FRAMES - 1)
    begin_s = float(time_s[falls[max(0, len(falls) - 1 - FILM_CYCLES - BEFORE)]])
    at_s = last - step_s * np.arange(FRAMES + int((first - begin_s) / step_s))[::-1]
    foot, runner = (np.interp(at_s, time_s, each) for each in (foot_m, runner_m))
    if not np.isfinite(foot + runner).all():
        return None
    slipping = slipping_shares(contacts_of(parameters), runner - foot)
    foot, runner = foot[-FRAMES:], runner[-FRAMES:]
    return Film(last - first, foot - foot[0], runner - runner[0], slipping[:, -FRAMES:])


def slipping_shares(contacts: list[Presliding], way_m: Array) -> Array:
    """
    Return the share of the area of each contact that slips, shape (contacts, n).

    ``way_m``, shape (n,), is that of the runner against the feet, relaxed at its beginning. A
    contact is taken for rings, each with the displacement at which it slips on the virgin curve:
    it follows the runner, held back within this limit.

    """
    limits = np.linspace(0.0, 1.0, RINGS + 1)[1:] * [
        [each.max_displacement_m] for each in contacts
    ]
    radii = np.stack([each.stick_radius(row) for each, row in zip(contacts, limits, strict=True)])
    full = np.array([[each.indentation.radius_m] for each in contacts])
    areas = -np.diff((radii / full) ** 2, axis=1, prepend=1.0)
    held = np.full_like(limits, way_m[0])
    shares = np.empty((len(contacts), len(way_m)))
    for at, place_m in enumerate(way_m):
        held = np.clip(held, place_m - limits, place_m + limits)
        slips = np.abs(place_m - held) >= AT_LIMIT * limits
        shares[:, at] = np.sum(areas, axis=1, where=slips).clip(max=1.0)
    return shares


def steep_edges(voltage: Array) -> NDArray[np.intp]:
    """
    Return the last sample before each fall of a saw-tooth; of one that runs backwards, each rise.

    Falls are what leads through the middle of the range within STEEP of the time between two.

    """
    low, high = float(voltage.min()), float(voltage.max())
    level = (voltage > low + HIGH * (high - low)).astype(np.int8)
    level -= voltage < low + LOW * (high - low)
    places = np.flatnonzero(level)
    level = level[places]
    changes = np.flatnonzero(level[1:] != level[:-1])
    begins, ends, falling = places[changes], places[changes + 1], level[changes] > 0
    found = []
    for direction in (falling, ~falling):
        edges, lengths = begins[direction], (ends - begins)[direction]
        if len(edges) > 1 and np.median(lengths) < STEEP * np.median(np.diff(edges)):
            found.append((float(np.median(lengths)), edges))
    return min(found, key=lambda pair: pair[0])[1] if found else np.empty(0, np.intp)
