# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""
Travelling roughness: each foot has a window on a rough line that moves with the runner.

A foot presses the profile g(y) = y^2/R + h_foot(y) + h_runner(y - X) into the foundation; X is the
place of its window. While all springs slip, each is at its own limit mu f_z for any X: the force
is mu F_n, springs leave the contact with a force of zero, and springs enter it with none. So X
need not follow the slip. It is set to u = x - x_s when a full slip comes to rest, where the virgin
curve is tabulated again, and stays constant until the next full slip ends.

The line of the runner is a sum of waves of incommensurate lengths, with the power of the periodic
line of `roughness`. It never repeats, and is evaluated in tiles when a window needs them. The
evaluated part is as long as a window, and depends only on seed and place.

"""

import math
from functools import lru_cache

import numpy as np

from stickslip_ros.arrays import Array
from stickslip_ros.contact.profile import LineProfile, line_profile
from stickslip_ros.contact.roughness import Spectrum, line_power, rough_line
from stickslip_ros.contact.springs import GROUPS_MAX
from stickslip_ros.contact.virgin import CELLS
from stickslip_ros.errors import OutOfRange
from stickslip_ros.kernels.kernel import kernel, noinline_kernel
from stickslip_ros.kernels.record import COUNT, FLAG, FLOAT, Record, kind, record
from stickslip_ros.parameters import ContactParameters

TILE = 64
TILES = 193
RING = TILES * TILE
WINDOW_MAX = RING - TILE
"""Springs of the widest window; `track_of` guards it, and with it RING and TILES."""
WAVES = 384
"""Largest number of waves of the line; its long waves are those of `rough_line`. `waves_of_line`
makes no more bins."""
_STREAM = 41
"""Number of the random stream of the waves."""
WIDE = 6.0
"""Rise of the parabola over half a window, in standard deviations of the line's change over it."""
WIDTH_MIN = 0.05
"""Least half width of a window per radius; a smooth sphere has 0.03 under 2 N."""
PLACE_MAX = 1 << 50
"""Largest displacement of a window, in springs."""
NO_PLACE = -(1 << 62)
_REACH = 1.1
"""Height up to which springs are collected first, relative to the previous depth."""
PASSES = 100
"""Most of Newton's steps to a depth; they end, after about 5, when the touching springs stay."""

AMPLITUDE, ANGLE, COSINE, SINE = range(4)
"""Columns of ``waves``: amplitude, m; phase from spring to spring, rad; its cosine and sine."""

TRACK = kind(
    on=FLAG,  # Whether windows move
    springs=COUNT,  # Springs of a window
    spacing_m=FLOAT,  # Distance of the springs
    normal_n_per_m=(FLOAT, (GROUPS_MAX,)),  # Normal stiffness of a spring of each foot, E* dx
    waves_in_all=COUNT,  # Used rows of ``waves``
    waves=(FLOAT, (WAVES, 4)),  # The line of the runner
    phases=(FLOAT, (GROUPS_MAX, WAVES)),  # Phases at spring 0, different for each foot
    fixed_m=(FLOAT, (GROUPS_MAX, WINDOW_MAX)),  # Parabola and roughness of each foot
    # Evaluated heights of the runner's line, by the number of the spring modulo RING, and the
    # first of their tiles
    ring_m=(FLOAT, (GROUPS_MAX, RING)),
    tiles=(COUNT, (GROUPS_MAX,)),
    # Lowest height in each block of ``fixed_m``, and in each evaluated tile of the runner's line
    block_lows_m=(FLOAT, (GROUPS_MAX, WINDOW_MAX // TILE)),
    tile_lows_m=(FLOAT, (GROUPS_MAX, TILES)),
    # Place, in springs, at which the virgin curve of each contact was tabulated
    laid=(COUNT, (1 + GROUPS_MAX,)),
    depths_m=(FLOAT, (GROUPS_MAX,)),  # Depth of each foot there
    # Work space
    line_m=(FLOAT, (TILE,)),
    touching_m=(FLOAT, (GROUPS_MAX, WINDOW_MAX)),
    touch=(COUNT, (GROUPS_MAX,)),
    counts=(FLOAT, (CELLS + 1,)),
    swings_m=(FLOAT, (2, WAVES)),
)
"""Lines under the feet, and the windows on them."""


@lru_cache(maxsize=8)
def track_of(
    contact: ContactParameters,
    spectrum: Spectrum,
    radii_m: tuple[float, ...],
    normal_pa: tuple[float, ...],
) -> Record:
    """
    Return the lines under the feet, with windows at their start, read-only.

    Each foot has a radius and a modulus E*, Pa.

    Raises OutOfRange if a window holds too many springs.

    """
    spacing_m = contact.line_length / contact.line_points
    power_m2 = line_power(spectrum, contact.line_length, contact.line_points)
    waves = waves_of_line(contact.travel * power_m2, contact)
    places_m = spacing_m * (np.arange(contact.line_points // 2) + 0.5)
    radii = np.array(radii_m)[:, np.newaxis]
    rises_m = places_m**2 / radii.max()
    # From the spectrum, not from random waves, so the width is the same for all seeds.
    covariance_m2 = contact.line_points * np.fft.irfft(power_m2, contact.line_points)
    change_m = np.sqrt(2.0 * (covariance_m2[0] - covariance_m2[: len(places_m)]))
    is_wide = (rises_m > WIDE * change_m) & (places_m >= WIDTH_MIN * radii.max())
    half = int(np.argmax(is_wide)) + 1 if is_wide.any() else len(places_m)
    half = TILE // 2 * min(math.ceil(2 * half / TILE), 2 * len(places_m) // TILE)
    if not 0 < 2 * half <= WINDOW_MAX:
        limit = f'unfit for travelling roughness: a window has {2 * half} springs'
        hint = f'change it until a window has {TILE} to {WINDOW_MAX}'
        raise OutOfRange('contact.line_points', contact.line_points, '', limit, hint)
    both_m = np.concatenate((-places_m[half - 1 :: -1], places_m[:half]))
    rng = np.random.default_rng((contact.line_seed, _STREAM, 1))
    track = record(
        TRACK,
        on=True,
        springs=2 * half,
        spacing_m=spacing_m,
        normal_n_per_m=np.array(normal_pa) * spacing_m,
        waves_in_all=len(waves),
        tiles=NO_PLACE,
        laid=NO_PLACE,
        depths_m=spacing_m,
    )
    track.waves[: len(waves)] = waves
    track.phases[:] = rng.uniform(0.0, 2.0 * np.pi, track.phases.shape)
    track.fixed_m[:, : 2 * half] = both_m**2 / radii
    middle = slice(contact.line_points // 2 - half, contact.line_points // 2 + half)
    for foot in range(GROUPS_MAX if contact.travel < 1.0 else 0):
        seed = contact.line_seed + foot
        line_m = rough_line(spectrum, contact.line_length, contact.line_points, seed)
        track.fixed_m[foot, : 2 * half] += math.sqrt(1.0 - contact.travel) * line_m[middle]
    track.block_lows_m[:] = track.fixed_m.reshape(GROUPS_MAX, -1, TILE).min(axis=2)
    return track


def waves_of_line(power_m2: Array, contact: ContactParameters) -> Array:
    """
    Return the waves of the runner's line, rows of ``waves``, for a power spectrum, m^2.

    Notes
    -----
    The waves of `rough_line` are sorted into bins of equal width in octaves. One wave stands for
    a bin, with the total power and a random wavelength within the bin.

    """
    modes = np.flatnonzero(power_m2)
    edges = np.unique(np.rint(np.geomspace(modes[0], modes[-1] + 1, WAVES + 1)).astype(int))
    amplitude_m = 2.0 * np.sqrt(np.add.reduceat(power_m2, edges[:-1]))
    bounds = np.clip(edges - 0.5, modes[0], modes[-1])
    shares = np.random.default_rng((contact.line_seed, _STREAM, 0)).uniform(size=len(amplitude_m))
    angle = 2.0 * np.pi / contact.line_points * (bounds[:-1] + shares * np.diff(bounds))
    return np.column_stack((amplitude_m, angle, np.cos(angle), np.sin(angle)))


def window_profile(track: Record, foot: int, place: int = 0) -> LineProfile:
    """Return the profile of a foot after the runner has moved by ``place`` springs."""
    waves, springs = track.waves[: track.waves_in_all], np.arange(track.springs) - place
    phases = track.phases[foot, : len(waves)] + np.outer(springs, waves[:, ANGLE])
    line_m = track.fixed_m[foot, : len(springs)] + np.cos(phases) @ waves[:, AMPLITUDE]
    return line_profile(line_m, float(track.spacing_m))


@kernel
def extend_line(track: Record, foot: int, place: int) -> None:
    """Evaluate the missing part of the runner's line for a window at a place."""
    first, last = -place // TILE, (track.springs - 1 - place) // TILE
    known = track.tiles[foot]
    if known <= first and last < known + TILES:
        return
    for tile in range(first, first + TILES):
        if not known <= tile < known + TILES:
            _evaluate(track, foot, tile)
    track.tiles[foot] = first


@noinline_kernel
def _evaluate(track: Record, foot: int, tile: int) -> None:
    """Evaluate a tile of the runner's line; each wave is rotated from spring to spring."""
    waves, cosines_m, sines_m = track.waves, track.swings_m[0], track.swings_m[1]
    start, lowest_m = (tile % TILES) * TILE, math.inf
    for j in range(track.waves_in_all):
        phase = track.phases[foot, j] + waves[j, ANGLE] * (tile * TILE)
        cosines_m[j] = waves[j, AMPLITUDE] * math.cos(phase)
        sines_m[j] = waves[j, AMPLITUDE] * math.sin(phase)
    for i in range(start, start + TILE):
        height_m = 0.0
        for j in range(track.waves_in_all):
            height_m += cosines_m[j]
            turned_m = cosines_m[j] * waves[j, COSINE] - sines_m[j] * waves[j, SINE]
            sines_m[j] = sines_m[j] * waves[j, COSINE] + cosines_m[j] * waves[j, SINE]
            cosines_m[j] = turned_m
        track.ring_m[foot, i] = height_m
        lowest_m = min(lowest_m, height_m)
    track.tile_lows_m[foot, tile % TILES] = lowest_m


@kernel
def press_foot(track: Record, foot: int, place: int, normal_n: float) -> float:
    """Press a foot with a force; store the heights that it touches and return its depth, m."""
    extend_line(track, foot, place)
    blocks = track.springs // TILE
    line_m, touching_m = track.line_m, track.touching_m[foot]
    lowest_m = _heights(track, foot, place, blocks // 2)
    for block in range(blocks):
        if _lower_bound_m(track, foot, place, block) < lowest_m:
            lowest_m = min(lowest_m, _heights(track, foot, place, block))
    reach_m = _REACH * track.depths_m[foot]
    while True:
        touch = 0
        for block in range(blocks):
            if _lower_bound_m(track, foot, place, block) < lowest_m + reach_m:
                _heights(track, foot, place, block)
                for i in range(TILE):
                    touching_m[touch] = line_m[i] - lowest_m
                    touch += 1 if touching_m[touch] < reach_m else 0
        total_m = normal_n / track.normal_n_per_m[foot]
        depth_m = depth_of_sum(touching_m[:touch], total_m, track.depths_m[foot])
        if depth_m < reach_m or touch == track.springs:
            break
        reach_m = _REACH * depth_m  # too large, because some touching springs are missing
    track.touch[foot], track.depths_m[foot] = touch, depth_m
    return depth_m


@noinline_kernel
def _lower_bound_m(track: Record, foot: int, place: int, block: int) -> float:
    """Return a lower bound of the heights in a block of a window, m."""
    tile, lows_m = (block * TILE - place) // TILE, track.tile_lows_m[foot]
    return track.block_lows_m[foot, block] + min(lows_m[tile % TILES], lows_m[(tile + 1) % TILES])


@noinline_kernel
def _heights(track: Record, foot: int, place: int, block: int) -> float:
    """Store the heights of a block of a window in ``line_m``; return the lowest."""
    start, lowest_m = (block * TILE - place) % RING, math.inf
    for i in range(TILE):
        at = start + i if start + i < RING else start + i - RING
        height_m = track.fixed_m[foot, block * TILE + i] + track.ring_m[foot, at]
        track.line_m[i] = height_m
        lowest_m = min(lowest_m, height_m)
    return lowest_m


@kernel
def depth_of_sum(heights_m: Array, total_m: float, depth_m: float) -> float:
    """Return the depth at which the compressions sum to ``total_m``, by Newton from a depth."""
    before = -1
    for _ in range(PASSES):
        count, sum_m = 0, 0.0
        for i in range(len(heights_m)):
            is_pressed = heights_m[i] < depth_m
            count += 1 if is_pressed else 0
            sum_m += heights_m[i] if is_pressed else 0.0
        if count == before:
            break
        before, depth_m = count, (total_m + sum_m) / count
    return depth_m


@noinline_kernel
def tabulate_feet(
    track: Record,
    bank: Record,
    preload_n: float,
    curve: Record,
    first: int,
    last: int,
    place: int,
) -> None:
    """
    Tabulate the virgin curve of the feet from ``first`` to before ``last`` at a place of windows.

    ``bank`` has the load shares and the friction of all feet; the place is the displacement of
    the runner, in springs.

    """
    counts, cells = track.counts, curve.cells
    force_max_n, limit_m = 0.0, 0.0
    for foot in range(first, last):
        normal_n = bank.shares[foot] * preload_n + bank.weights_n[foot]
        depth_m = press_foot(track, foot, place, normal_n)
        limit_m = max(limit_m, bank.compliance[foot] * depth_m)
        force_max_n += bank.friction[foot] * normal_n
    cells_per_m, width_m = CELLS / limit_m, limit_m / CELLS
    for j in range(CELLS + 1):
        counts[j] = 0.0
    for foot in range(first, last):
        depth_m, compliance = track.depths_m[foot], bank.compliance[foot]
        # Stiffness of a spring relative to the first foot, exactly 1 for one material.
        own = track.normal_n_per_m[foot] * bank.friction[foot] * bank.compliance[first]
        own /= track.normal_n_per_m[first] * bank.friction[first] * compliance
        for i in range(track.touch[foot]):
            slips_at = compliance * (depth_m - track.touching_m[foot, i]) * cells_per_m
            if slips_at > 0.0:
                counts[min(math.ceil(slips_at), CELLS) - 1] += own
    sum_of_means = 0.0
    for j in range(CELLS - 1, -1, -1):
        counts[j] += counts[j + 1]
        sum_of_means += 0.5 * (counts[j] + counts[j + 1])
    scale, force_n, energy_j = force_max_n / (sum_of_means * width_m), 0.0, 0.0
    for j in range(CELLS):
        start, end = scale * counts[j], scale * counts[j + 1]
        if j == 0:
            start = end = 0.5 * (start + end)
        half_slope = 0.5 * (end - start) * cells_per_m
        cells[j, 0], cells[j, 1], cells[j, 2], cells[j, 3] = force_n, start, half_slope, energy_j
        energy_j += width_m * (force_n + width_m * (start / 2.0 + width_m * half_slope / 3.0))
        force_n += 0.5 * (start + end) * width_m
    curve.cells_per_m, curve.core_m, curve.limit_m = cells_per_m, width_m, limit_m
    curve.force_max_n, curve.energy_max_j = force_n, energy_j


@kernel
def place_of(track: Record, window_m: float) -> int:
    """Return the place of a window, in springs."""
    return int(min(max(round(window_m / track.spacing_m), -PLACE_MAX), PLACE_MAX))
