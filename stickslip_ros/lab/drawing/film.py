# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""Two cycles of a stand in slow motion: feet, runner, and the slipping share of each contact."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stickslip_ros.arrays import Array
from stickslip_ros.contact.mdr import Presliding
from stickslip_ros.drive.layout import contacts_of, ratios_of
from stickslip_ros.parameters import Parameters

FILM_CYCLES = 2
FRAMES = 200  # frames of these cycles
CYCLES_BEFORE = 3  # cycles before, until the assumed relaxed start is forgotten
RINGS = 64
AT_LIMIT = 0.98  # a ring slips from this share of its limit on, as readings have noise
HIGH, LOW = 0.75, 0.25  # an edge crosses these shares of the voltage range
STEEP = 0.25  # largest share of a period that an edge takes


class Film(NamedTuple):
    """Motion at equal times."""

    length_s: float  # from the first frame to the last
    foot_m: Array  # nominal foot, relative to the first frame; shape (FRAMES,)
    runner_m: Array
    feet_m: Array  # each foot: its share of that motion, after its delay; shape (feet, FRAMES)
    slipping: Array  # slipping share of each contact area, shape (feet, FRAMES)


def film_of(
    parameters: Parameters, time_s: Array, voltage_v: Array, foot_m: Array, runner_m: Array
) -> Film | None:
    """Return the last whole cycles of a trace; None without cycles or positions."""
    falls = steep_edges(voltage_v)
    if len(falls) < FILM_CYCLES + 1:
        return None
    first, last = (float(time_s[falls[at]]) for at in (-1 - FILM_CYCLES, -1))
    step_s = (last - first) / (FRAMES - 1)
    begin_s = float(time_s[falls[max(0, len(falls) - 1 - FILM_CYCLES - CYCLES_BEFORE)]])
    at_s = last - step_s * np.arange(FRAMES + int((first - begin_s) / step_s))[::-1]
    foot, runner = (np.interp(at_s, time_s, each) for each in (foot_m, runner_m))
    if not np.isfinite(foot + runner).all():
        return None
    delays_s = [each.delay_s for each in parameters.feet.groups for _ in range(each.feet)]
    feet = np.stack([np.interp(at_s - each, time_s, foot_m) for each in delays_s])
    feet *= ratios_of(parameters)[:, np.newaxis]
    slipping = slipping_shares(contacts_of(parameters), runner - feet)
    foot, runner, feet = foot[-FRAMES:], runner[-FRAMES:], feet[:, -FRAMES:]
    moved = foot - foot[0], runner - runner[0], feet - feet[:, :1]
    return Film(last - first, *moved, slipping[:, -FRAMES:])


def slipping_shares(contacts: tuple[Presliding, ...], ways_m: Array) -> Array:
    """
    Return the slipping share of each contact area, shape (contacts, n).

    ``ways_m``, shape (contacts, n), is the runner relative to each foot, relaxed at the start. A
    contact is a set of rings, each of which slips at its own displacement of the virgin curve.

    """
    largest_m = [[each.max_displacement_m] for each in contacts]
    limits = np.linspace(0.0, 1.0, RINGS + 1)[1:] * largest_m
    radii = np.stack([each.stick_radius(row) for each, row in zip(contacts, limits, strict=True)])
    full = np.array([[each.indentation.radius_m] for each in contacts])
    areas = -np.diff((radii / full) ** 2, axis=1, prepend=1.0)
    held = np.repeat(ways_m[:, :1], RINGS, axis=1)
    shares = np.empty(ways_m.shape)
    for at in range(ways_m.shape[1]):
        place_m = ways_m[:, at, np.newaxis]
        held = np.clip(held, place_m - limits, place_m + limits)
        slips = np.abs(place_m - held) >= AT_LIMIT * limits
        shares[:, at] = np.sum(areas, axis=1, where=slips).clip(max=1.0)
    return shares


def steep_edges(voltage: Array) -> NDArray[np.intp]:
    """Return the last sample before each steep edge of a saw-tooth: falls, or rises backwards."""
    low, high = float(np.fmin.reduce(voltage)), float(np.fmax.reduce(voltage))  # past gaps
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
