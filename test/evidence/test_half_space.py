# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The 3-D half-space solver where the answer is known: disc, Hertz, punch, cone, its order."""

import numpy as np
import pytest

from evidence.closed_forms import CONE_SLOPE, E_STAR_PA, RADIUS_M, hertz_force
from evidence.half_space import (
    ORDER,
    disc_displacement,
    press,
    press_punch,
    ring_mesh,
    rough_gap,
    smooth_gap,
    solved,
)

DEPTH_M = 80e-9
RINGS = 128
PRESSURE_ERROR = 0.002
"""At the middles of rings away from the edge; a ring has one pressure only."""
ROUNDING = 1e-13
SMALLEST_SHARE = -1e-9
"""Of the mean pressure: the last ring has none, up to rounding."""


def test_a_loaded_disc_sinks_by_two_in_its_centre_and_by_four_over_pi_at_its_edge():
    inside = disc_displacement(np.array([1.0]), np.array([1e-9]))[0]
    edge = disc_displacement(np.array([1.0]), np.array([1.0 - 1e-12]))[0]
    assert inside == pytest.approx(2.0, rel=ROUNDING)
    assert edge == pytest.approx(4.0 / np.pi, rel=1e-10)


def test_far_away_a_loaded_disc_acts_as_a_point_force():
    far = disc_displacement(np.array([1.0]), np.array([1000.0]))[0]
    assert far == pytest.approx(1.0 / 1000.0, rel=1e-6)


def test_hertz_is_reproduced_in_its_pressure():
    solved = press(smooth_gap, DEPTH_M, RINGS)
    share = solved.radii_m / solved.radius_m
    peak_pa = 2.0 * E_STAR_PA * solved.radius_m / (np.pi * RADIUS_M)
    inner = share < 0.95
    expected_pa = peak_pa * np.sqrt(1.0 - share[inner] ** 2)
    np.testing.assert_allclose(solved.pressures_pa[inner], expected_pa, rtol=PRESSURE_ERROR)


@pytest.mark.parametrize('gap', [smooth_gap, rough_gap])
def test_no_pressure_is_negative_and_a_larger_circle_would_have_tension(gap):
    solved = press(gap, DEPTH_M, RINGS)
    mean_pa = solved.force_n / (np.pi * solved.radius_m**2)
    assert np.min(solved.pressures_pa) > SMALLEST_SHARE * mean_pa
    mesh = ring_mesh(RINGS)
    larger_m = 1.001 * solved.radius_m
    assert (mesh.inverse @ (DEPTH_M - gap(larger_m * mesh.middles)))[-1] < 0.0


def test_a_sphere_a_punch_and_a_cone_have_the_forces_of_closed_forms():
    sphere, cone = solved('smooth', DEPTH_M), solved('cone', DEPTH_M)
    assert sphere.force_n == pytest.approx(float(hertz_force(DEPTH_M)), rel=1e-7, abs=0.0)
    assert sphere.radius_m == pytest.approx(np.sqrt(RADIUS_M * DEPTH_M), rel=5e-7, abs=0.0)
    cone_m = 2.0 * DEPTH_M / (np.pi * CONE_SLOPE)
    cone_n = 0.5 * np.pi * E_STAR_PA * CONE_SLOPE * cone_m**2
    assert cone.force_n == pytest.approx(cone_n, rel=1e-7, abs=0.0)
    assert cone.radius_m == pytest.approx(cone_m, rel=5e-7, abs=0.0)
    punch = press_punch(1e-6, DEPTH_M, 256)
    assert punch.force_n == pytest.approx(2.0 * E_STAR_PA * 1e-6 * DEPTH_M, rel=3e-7, abs=0.0)


def test_the_force_on_the_rough_body_converges_with_the_third_order():
    coarse_n, middle_n, fine_n = (solved('rough', DEPTH_M, n).force_n for n in (64, 128, 256))
    order = np.log2((middle_n - coarse_n) / (fine_n - middle_n))
    assert order == pytest.approx(ORDER, rel=0.05)
