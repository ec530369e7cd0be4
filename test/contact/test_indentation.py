# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""The normal problem: profiles of any size, Hertz of any sphere, and what does not press."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from stickslip_ros.contact.mdr import effective_elasticity, indent
from stickslip_ros.contact.profile import PowerProfile, rough_profile, smooth_profile
from stickslip_ros.errors import OutOfRange

NEWTON = 1e-12
"""Newton ends at 1e-15 in log x; exponents up to 3 and a dozen powers of ten cost digits."""
QUADRATURE = 1e-9
"""quad on a cusp |x|^H at the end of the interval."""

RADII_M = st.floats(1e-6, 1.0)
PREFACTORS = st.floats(1e-8, 1.0)
HURSTS = st.floats(0.1, 1.0)  # at 0.01 the radius of an atom's height is below any double
LENGTHS_M = st.floats(1e-12, 1.0)
PROFILES = st.builds(rough_profile, RADII_M, PREFACTORS, HURSTS) | st.builds(
    smooth_profile, RADII_M
)


@given(PROFILES, LENGTHS_M)
def test_the_radius_at_a_depth_is_the_inverse_of_the_height(profile, length_m):
    back_m = profile.half_width(profile.height(length_m))
    assert float(back_m) == pytest.approx(length_m, rel=1e-10, abs=0.0)
    radius_m = profile.half_width(length_m)
    assert float(profile.height(radius_m)) == pytest.approx(length_m, rel=NEWTON, abs=0.0)


@given(PROFILES, LENGTHS_M)
def test_the_radius_of_an_area_is_the_inverse_of_the_area_of_a_radius(profile, area_m2):
    radius_m = profile.radius_at_area(area_m2)
    assert float(profile.pressed_area(radius_m)) == pytest.approx(area_m2, rel=NEWTON, abs=0.0)


def test_a_profile_takes_arrays_and_is_zero_where_nothing_presses():
    profile = rough_profile(0.5e-3, 4.4478e-4, 0.7)
    x_m = np.array([[0.0, 1e-6], [-1e-6, 3e-6]])
    heights_m = profile.height(x_m)
    assert heights_m[0, 0] == 0.0
    assert heights_m[1, 0] == heights_m[0, 1] == x_m[0, 1] ** 2 / 0.5e-3 + 4.4478e-4 * 1e-6**0.7
    np.testing.assert_allclose(profile.half_width(heights_m), np.abs(x_m), rtol=1e-12)
    assert float(profile.half_width(-1e-9)) == 0.0


@pytest.mark.parametrize('radius_m', [1e-8, 3.11549e-6, 1e-4])
@pytest.mark.parametrize(
    'profile',
    [smooth_profile(0.5e-3), rough_profile(0.5e-3, 4.4478e-4, 0.7), PowerProfile((3.0,), (0.1,))],
)
def test_the_pressed_area_is_the_integral_under_the_depth(profile, radius_m):
    depth_m = float(profile.height(radius_m))
    integral, _ = quad(
        lambda share: 1.0 - float(profile.height(share * radius_m)) / depth_m,
        0.0,
        1.0,
        epsabs=0.0,
        epsrel=QUADRATURE / 10.0,
        limit=1000,
    )
    area_m2 = float(profile.pressed_area(radius_m))
    assert area_m2 == pytest.approx(integral * depth_m * radius_m, rel=QUADRATURE, abs=0.0)


@given(RADII_M, st.floats(1e-6, 1e3), st.floats(1e3, 1e13), st.floats(0.0, 0.5))
def test_a_smooth_sphere_follows_hertz(radius_m, force_n, young_pa, poisson):
    elasticity = effective_elasticity(young_pa, poisson, young_pa, poisson)
    contact = indent(smooth_profile(radius_m), elasticity, force_n)
    modulus_pa = young_pa / (2.0 * (1.0 - poisson**2))
    hertz_radius_m = (3.0 * force_n * radius_m / (4.0 * modulus_pa)) ** (1.0 / 3.0)
    assert contact.normal_force_n == force_n
    assert contact.radius_m == pytest.approx(hertz_radius_m, rel=NEWTON, abs=0.0)
    assert contact.depth_m == pytest.approx(hertz_radius_m**2 / radius_m, rel=NEWTON, abs=0.0)


def test_roughness_keeps_the_bodies_apart(hemisphere):
    rough, smooth = (hemisphere(kind, 0.1).indentation for kind in ('rough', 'smooth'))
    assert rough.depth_m > smooth.depth_m
    assert rough.radius_m < smooth.radius_m


@pytest.mark.parametrize('force_n', [0.0, -1.0, math.nan])
def test_a_force_that_does_not_press_is_refused(force_n, steel_on_ruby):
    with pytest.raises(OutOfRange) as caught:
        indent(smooth_profile(1e-3), steel_on_ruby, force_n)
    expected = f'normal force {force_n:.6g} N is not above 0 N; press the bodies together'
    assert str(caught.value) == expected
