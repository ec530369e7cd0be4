"""The 3-D half-space solver beside the evidence: its disc, its pressure, its refusals."""

import numpy as np
import pytest

from stickslip_ros.errors import OutOfRange
from stickslip_ros.validation.half_space import (
    disc_displacement,
    press,
    ring_mesh,
    rough_gap,
    smooth_gap,
)
from stickslip_ros.validation.references import E_STAR_PA, RADIUS_M

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


@pytest.mark.parametrize('depth_m', [0.0, -1e-9, np.nan])
def test_a_depth_that_does_not_press_is_refused(depth_m):
    with pytest.raises(OutOfRange, match='press the body in'):
        press(smooth_gap, depth_m, RINGS)


def test_a_mesh_without_rings_is_refused():
    with pytest.raises(OutOfRange, match='below 4'):
        ring_mesh(3)
