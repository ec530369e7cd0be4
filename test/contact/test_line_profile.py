# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The rough line on a sphere against sums over its springs, one by one."""

import math

import numpy as np
import pytest
from evidence.springs import pull, springs_of_line
from hypothesis import given
from hypothesis import strategies as st

from stickslip_ros.contact.hemisphere import (
    elasticity_of,
    line_places,
    profile_of,
    rough_line_profile,
)
from stickslip_ros.contact.mdr import indent, solve_presliding
from stickslip_ros.contact.profile import LineProfile, line_profile, smooth_profile
from stickslip_ros.contact.roughness import Spectrum, rough_line
from stickslip_ros.contact.virgin import CELLS, tabulate, virgin_force
from stickslip_ros.drive.layout import contacts_of
from stickslip_ros.errors import OutOfRange
from stickslip_ros.kernels.kernel import entry_point
from stickslip_ros.parameters import ContactParameters, Parameters

virgin_force = entry_point(virgin_force)

FRICTION = 0.3
LENGTH_M, RADIUS_M = 1e-3, 0.5e-3
ROUNDING = 1e-11
"""Prefix sums over up to 1e5 heights, of which the pressed ones are a difference."""
WORST_TABLE = 2.0 / CELLS
"""A spring that begins to slip inside a cell is taken to do so half a cell off, at most: at most
half a cell of the full-stick force, which is up to twice the friction force, and as much again
from the scaling to the exact friction force."""
FEW_SPRINGS, FEW_SPRINGS_TABLE = 60, 1e-4
MANY_SPRINGS, MANY_SPRINGS_TABLE = 2000, 1e-5
"""With n springs these errors have random signs: the sum is about 0.5/(CELLS sqrt(n)); measured
with 20 seeds at most 3.3e-5 and 3.7e-6."""
SMOOTH_GRID = 1e-4
"""2000 springs on a smooth sphere, by the midpoint rule."""
GRIDS = {'few': (1 << 11, 5e6), 'many': (1 << 17, 1e8)}
"""Points and upper cut-off, rad/m."""


def make_line(points: int, upper_per_m: float, seed: int = 1) -> LineProfile:
    spectrum = Spectrum(0.7, 1.1221e-6, 2.0 * math.pi / LENGTH_M, upper_per_m)
    return rough_line_profile(spectrum, RADIUS_M, LENGTH_M, points, seed)


LINES = {name: make_line(*grid) for name, grid in GRIDS.items()}


@pytest.fixture(scope='module', params=LINES)
def line(request) -> LineProfile:
    return LINES[request.param]


@pytest.fixture(scope='module')
def elasticity():
    return elasticity_of(ContactParameters())


def test_the_profile_is_the_parabola_plus_the_line_above_its_lowest_point():
    spectrum = Spectrum(0.7, 1e-6, 1e4, 1e5)
    profile = rough_line_profile(spectrum, RADIUS_M, LENGTH_M, 64, seed=4)
    x_m = line_places(LENGTH_M, 64)
    heights_m = x_m**2 / RADIUS_M + rough_line(spectrum, LENGTH_M, 64, seed=4)
    np.testing.assert_array_equal(profile.heights_m, heights_m - heights_m.min())
    assert profile.spacing_m == LENGTH_M / 64
    np.testing.assert_allclose(x_m, -x_m[::-1], atol=1e-15 * LENGTH_M)
    np.testing.assert_allclose(np.diff(x_m), profile.spacing_m)


def test_length_and_area_in_contact_are_sums_over_the_springs(line):
    for depth_m in (0.0, 1e-10, 50e-9, 300e-9, 2e-6):
        compressed_m = np.maximum(depth_m - line.heights_m, 0.0)
        half_m = 0.5 * line.spacing_m * np.count_nonzero(compressed_m)
        area_m2 = 0.5 * line.spacing_m * np.sum(compressed_m)
        assert float(line.half_width(depth_m)) == pytest.approx(half_m, rel=ROUNDING, abs=0.0)
        got_m2 = float(line.pressed_area_at(depth_m))
        assert got_m2 == pytest.approx(area_m2, rel=ROUNDING, abs=0.0)


def test_many_depths_at_once_give_what_each_gives_alone(line):
    depths_m = np.linspace(0.0, 1e-6, 12).reshape(3, 4)
    for law in (line.half_width, line.pressed_area_at, line.springs_in_contact):
        together = law(depths_m)
        assert together.shape == (3, 4)
        alone = [float(law(float(depth_m))) for depth_m in depths_m.ravel()]
        assert together.ravel().tolist() == alone


@given(st.floats(-21.0, -12.0))
def test_the_depth_for_an_area_is_the_exact_inverse(exponent):
    line = LINES['few']
    area_m2 = 10.0**exponent
    depth_m = line.depth_for(area_m2)
    assert float(line.pressed_area_at(depth_m)) == pytest.approx(area_m2, rel=ROUNDING, abs=0.0)


@given(st.floats(1e-10, 20e-6))
def test_the_area_at_a_depth_leads_back_to_the_depth(depth_m):
    line = LINES['few']
    back_m = line.depth_for(float(line.pressed_area_at(depth_m)))
    assert back_m == pytest.approx(depth_m, rel=ROUNDING, abs=0.0)


def test_a_line_without_roughness_is_the_smooth_sphere(elasticity):
    x_m = line_places(50e-6, 4000)
    profile = line_profile(x_m**2 / RADIUS_M, 50e-6 / 4000)
    got = indent(profile, elasticity, 0.5)
    closed = indent(smooth_profile(RADIUS_M), elasticity, 0.5)
    assert got.depth_m == pytest.approx(closed.depth_m, rel=SMOOTH_GRID, abs=0.0)
    assert got.radius_m == pytest.approx(closed.radius_m, abs=profile.spacing_m)


@pytest.mark.parametrize(
    ('grid', 'tolerance'), [('few', FEW_SPRINGS_TABLE), ('many', MANY_SPRINGS_TABLE)]
)
def test_the_table_of_a_rough_line_is_the_sum_over_its_springs(grid, tolerance, elasticity):
    contact = solve_presliding(LINES[grid], elasticity, FRICTION, 0.5)
    springs = 2.0 * contact.indentation.radius_m / LINES[grid].spacing_m
    assert springs < FEW_SPRINGS if grid == 'few' else springs > MANY_SPRINGS
    curve = tabulate([contact])
    u_m = np.linspace(0.0, 1.1, 397, dtype=float) * contact.max_displacement_m
    springs_n = pull(springs_of_line(contact), u_m).force_n
    table_n = np.array([virgin_force(curve, float(u)) for u in u_m])
    error = np.max(np.abs(table_n - springs_n)) / contact.max_force_n
    assert error < tolerance < WORST_TABLE


def test_a_line_too_short_for_the_load_is_refused_with_the_way_out(elasticity):
    spectrum = Spectrum(0.7, 10e-9, 4.0 * math.pi / 10e-6, 1e8)
    short = rough_line_profile(spectrum, RADIUS_M, 10e-6, 1024, seed=1)
    assert indent(short, elasticity, 0.01).depth_m < short.limit_m
    message = (
        r'indentation of the rough line .* m is beyond .* m, at which the contact reaches an end '
        r'of the line: profile too short for the load; lengthen contact\.line_length or lower the'
    )
    with pytest.raises(OutOfRange, match=message) as caught:
        indent(short, elasticity, 1.0)
    assert caught.value.unit == 'm'
    assert float(str(caught.value.value)) > short.limit_m
    for law in (short.half_width, short.pressed_area_at, short.springs_in_contact):
        law(short.limit_m)
        with pytest.raises(OutOfRange, match='profile too short for the load'):
            law(np.array([0.0, 1.001 * short.limit_m]))


def test_a_load_that_presses_every_spring_is_refused(elasticity):
    bowl = line_profile(np.array([2e-9, 0.0, 1e-9, 2e-9]), 1e-6)
    assert indent(bowl, elasticity, 1e-6).depth_m < bowl.limit_m == 2e-9
    with pytest.raises(OutOfRange, match='profile too short for the load'):
        indent(bowl, elasticity, 1.0)


def test_the_lowest_spring_at_the_end_of_the_line_carries_no_load(elasticity):
    slope = line_profile(np.linspace(0.0, 1e-6, 10, dtype=float), 1e-6)
    with pytest.raises(OutOfRange, match=r'is beyond 0 m, at which the contact reaches an end'):
        indent(slope, elasticity, 1e-9)


def test_the_parameters_make_a_line_of_their_own_for_every_contact():
    stand = Parameters().updated({'contact.profile': 'rough_line'})
    contacts = contacts_of(stand)
    depths_m = {contact.indentation.depth_m for contact in contacts}
    assert len(depths_m) == len(contacts) == 6
    next_seed = ContactParameters(profile='rough_line', line_seed=2)
    again, second = profile_of(next_seed), contacts[1].profile
    assert isinstance(again, LineProfile)
    assert isinstance(second, LineProfile)
    np.testing.assert_array_equal(again.heights_m, second.heights_m)
