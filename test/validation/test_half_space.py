"""The 3-D half-space solver reproduces what is known in closed form, and converges."""

import numpy as np
import pytest
from scipy import special

from stickslip_ros.errors import OutOfRange
from stickslip_ros.validation.half_space import (
    disc_displacement,
    elliptic_integrals,
    press,
    press_punch,
    ring_mesh,
)

MODULUS_PA = 147e9
SPHERE_M = 0.5e-3
DEPTH_M = 80e-9
RINGS = 128
FORCE_ERROR = 5e-7
"""Seen with 128 rings: 2e-7 on the sphere, 3e-7 on the cone."""
RADIUS_ERROR = 3e-6
"""Seen with 128 rings: 1.5e-6; the edge lies between two collocation points."""
PUNCH_ERROR = 1e-6
"""Seen with 128 rings: 7e-7, the pressure being infinite at the edge."""
PRESSURE_ERROR = 0.002
"""At the middles of rings away from the edge; a ring has one pressure only."""
ORDER_ERROR = 0.2
ROUNDING = 1e-13
SMALLEST_SHARE = -1e-9
"""Of the mean pressure: the last ring has none, up to rounding."""


def sphere(r_m):
    return r_m**2 / (2.0 * SPHERE_M)


def rough(r_m):
    return sphere(r_m) + 3.13e-4 * r_m**0.7


def test_the_elliptic_integrals_are_those_of_scipy():
    complement = np.logspace(-14, 0, 57)
    first, second = elliptic_integrals(complement)
    np.testing.assert_allclose(first, special.ellipkm1(complement), rtol=ROUNDING)
    np.testing.assert_allclose(second, special.ellipe(1.0 - complement), rtol=ROUNDING)


def test_a_loaded_disc_sinks_by_two_in_its_centre_and_by_four_over_pi_at_its_edge():
    inside = disc_displacement(np.array([1.0]), np.array([1e-9]))[0]
    edge = disc_displacement(np.array([1.0]), np.array([1.0 - 1e-12]))[0]
    assert inside == pytest.approx(2.0, rel=ROUNDING)
    assert edge == pytest.approx(4.0 / np.pi, rel=1e-10)


def test_far_away_a_loaded_disc_acts_as_a_point_force():
    far = disc_displacement(np.array([1.0]), np.array([1000.0]))[0]
    assert far == pytest.approx(1.0 / 1000.0, rel=1e-6)


def test_hertz_is_reproduced_in_force_and_contact_radius():
    solved = press(sphere, MODULUS_PA, DEPTH_M, RINGS)
    force_n = 4.0 / 3.0 * MODULUS_PA * np.sqrt(SPHERE_M) * DEPTH_M**1.5
    assert solved.force_n == pytest.approx(force_n, rel=FORCE_ERROR)
    assert solved.radius_m == pytest.approx(np.sqrt(SPHERE_M * DEPTH_M), rel=RADIUS_ERROR)


def test_hertz_is_reproduced_in_its_pressure():
    solved = press(sphere, MODULUS_PA, DEPTH_M, RINGS)
    share = solved.radii_m / solved.radius_m
    peak_pa = 2.0 * MODULUS_PA * solved.radius_m / (np.pi * SPHERE_M)
    inner = share < 0.95
    expected_pa = peak_pa * np.sqrt(1.0 - share[inner] ** 2)
    np.testing.assert_allclose(solved.pressures_pa[inner], expected_pa, rtol=PRESSURE_ERROR)


def test_the_flat_punch_is_reproduced():
    solved = press_punch(1e-6, MODULUS_PA, DEPTH_M, RINGS)
    assert solved.force_n == pytest.approx(2.0 * MODULUS_PA * 1e-6 * DEPTH_M, rel=PUNCH_ERROR)


def test_the_cone_is_reproduced():
    solved = press(lambda r_m: 0.01 * r_m, MODULUS_PA, DEPTH_M, RINGS)
    radius_m = 2.0 * DEPTH_M / (np.pi * 0.01)
    assert solved.radius_m == pytest.approx(radius_m, rel=RADIUS_ERROR)
    force_n = 0.5 * np.pi * MODULUS_PA * 0.01 * radius_m**2
    assert solved.force_n == pytest.approx(force_n, rel=FORCE_ERROR)


@pytest.mark.parametrize('gap', [sphere, rough])
def test_no_pressure_is_negative_and_a_larger_circle_would_have_tension(gap):
    solved = press(gap, MODULUS_PA, DEPTH_M, RINGS)
    mean_pa = solved.force_n / (np.pi * solved.radius_m**2)
    assert np.min(solved.pressures_pa) > SMALLEST_SHARE * mean_pa
    mesh = ring_mesh(RINGS)
    larger_m = 1.001 * solved.radius_m
    assert (mesh.inverse @ (DEPTH_M - gap(larger_m * mesh.middles)))[-1] < 0.0


def test_the_rough_body_converges_with_the_third_power_of_the_number_of_rings():
    forces_n = [press(rough, MODULUS_PA, DEPTH_M, rings).force_n for rings in (32, 64, 128)]
    order = np.log2((forces_n[1] - forces_n[0]) / (forces_n[2] - forces_n[1]))
    assert order == pytest.approx(3.0, abs=ORDER_ERROR)


@pytest.mark.parametrize('depth_m', [0.0, -1e-9, np.nan])
def test_a_depth_that_does_not_press_is_refused(depth_m):
    with pytest.raises(OutOfRange, match='press the body in'):
        press(sphere, MODULUS_PA, depth_m, RINGS)


def test_a_mesh_without_rings_is_refused():
    with pytest.raises(OutOfRange, match='below 4'):
        ring_mesh(3)
